"""A scene's bars as the arrays that the kernels of chains go by."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from percussion_model.physics.records import Piston
from percussion_model.scene.bars import (
    LENGTH,
    bar_transit_time,
    section_impedance,
    section_transit_time,
)
from percussion_model.scene.numbers import Numbers
from percussion_model.scene.rows import SceneError
from percussion_model.solvers.chain.records import Body, Chain, Fit, Joint, Place, Steel
from percussion_model.solvers.chain.resolution import DEFAULT_STEPS, steps_for
from percussion_model.solvers.chain.taps import WHOLE, turning, weights_of
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.setup import MOST_CELLS, PISTONS, kelvin_voigt_time, refuse_many

# Where steps are shorter than the Kelvin-Voigt time, sections must have this share of their loss.
LEAST_SPREAD = 0.99
# Steps in which a wave crosses any bar at least, where a scene asks for none.
FEWEST_STEPS = 4


class Network(NamedTuple):
    """Bars cut into sections for a time step.

    Attributes
    ----------
    chain : Chain
    names : list of str
        Of the bars: "piston", "rod 1", ..., "bit".
    time_step : float
        [s]
    rings : int
        Numbers that all rings hold.
    misfit : float
        Largest relative error of a section's transit time: one shorter than a step.
    struck : int
        The bar that the piston strikes, or the topmost.
    """

    chain: Chain
    names: list[str]
    time_step: float
    rings: int
    misfit: float
    struck: int


def elastic_chain(numbers: Numbers) -> tuple[list[np.ndarray], list[str]]:
    """Sections of each elastic bar from top to bottom, and their names."""
    bars, names = [*numbers.rods, numbers.bit], [f"rod {k + 1}" for k in range(len(numbers.rods))]
    names.append("bit")
    if first_is_piston(numbers):
        return [numbers.piston, *bars], ["piston", *names]
    return bars, names


def time_step_of(numbers: Numbers) -> float:
    """Time step of a scene [s]: the transit time of the first elastic bar by its cells."""
    bars, _ = elastic_chain(numbers)
    values = numbers.values
    first = bar_transit_time(bars[0])
    if not math.isnan(values.solver_cells):
        return first / float(values.solver_cells)
    if not math.isnan(values.solver_accuracy):
        return first / steps_for(float(values.solver_accuracy))
    own = DEFAULT_STEPS if first_is_piston(numbers) else FEWEST_STEPS
    longest = [first / own, *(bar_transit_time(bar) / FEWEST_STEPS for bar in bars[1:])]
    # a section shorter than a step would be longer than it is
    longest += [section_transit_time(section) for bar in bars for section in bar]
    # and in steps shorter than the Kelvin-Voigt time short sections would lose their loss
    least = min(kelvin_voigt_time(numbers), first)
    if least > min(longest):
        return first / math.floor(first / least)
    return first / math.ceil(first / min(longest) - 1e-9)


def first_is_piston(numbers: Numbers) -> bool:
    """Whether the topmost elastic bar is the piston."""
    return bool(PISTONS[numbers.values.piston_model] == Piston.ELASTIC)


def network_of(numbers: Numbers) -> Network:
    """Cut the bars of a scene."""
    bars, names = elastic_chain(numbers)
    dt, eta = time_step_of(numbers), kelvin_voigt_time(numbers)
    refuse_many("cells", sum(map(bar_transit_time, bars)) / dt, MOST_CELLS)
    count = sum(map(len, bars))
    places = np.zeros((count, len(Place)), np.int64)
    steel = np.zeros((count, len(Steel)))
    bodies = np.zeros((len(bars), len(Body)))
    weights: list[np.ndarray] = []
    ring, misfit, k = 0, 0.0, 0
    for number, bar in enumerate(bars):
        bodies[number] = 0.0, k, k + len(bar) - 1, 0.0
        for section in bar:
            transit = section_transit_time(section) / dt
            wanted = eta * transit / dt
            if 1.0 + WHOLE < transit < 2.0 - WHOLE:
                a = turning(transit)
                delay, spread, mean, padded = 1, 0.0, transit, 1
                row = np.array([a, math.sqrt(1.0 - a * a)])
            else:
                delay, taps, spread = weights_of(max(transit, 1.0), wanted)
                mean = delay + float(np.arange(len(taps)) @ taps)
                padded = 1 if len(taps) == 1 else -(-len(taps) // WIDTH) * WIDTH
                # newest last, as they lie in the ring
                row = np.concatenate([np.zeros(padded - len(taps)), taps[::-1]])
            misfit = max(misfit, abs(mean / transit - 1.0))
            size = 1 << math.ceil(math.log2(delay + padded + 1))
            first = -1 if len(row) == 1 else sum(map(len, weights))
            cells = max(1, math.floor(mean) if padded == 1 else round(mean))
            places[k] = number, ring, size, delay - 1, padded, first, cells
            weights.append(row)
            ring += 4 * size + 2
            if dt < eta and spread < LEAST_SPREAD * wanted:
                raise _too_fine(float(section[LENGTH]), dt, eta)
            loss = 1.0 if eta else 0.0
            if spread > wanted:  # the rest is what fitting a short section to steps takes
                loss = wanted / spread
            z = section_impedance(section)
            mass = z * mean * dt  # of what is shorter than a step: as much as its waves have
            steel[k] = (
                z, 0.0, 0.0, mass / places[k, Place.CELLS], z * dt * loss, z * dt * (1.0 - loss)
            )  # fmt: skip
            bodies[number, Body.MASS] += mass
            if k > bodies[number, Body.FIRST]:
                above = steel[k - 1, Steel.IMPEDANCE]
                steel[k, Steel.ALPHA : Steel.BETA + 1] = (
                    2.0 * above / (above + z), 2.0 * z / (above + z)
                )  # fmt: skip
            k += 1
    bodies[:, Body.INV_MASS] = 1.0 / bodies[:, Body.MASS]
    struck = int(names[0] == "piston")
    fits = _fits(numbers, steel, bodies[struck:])
    chain = Chain(places, steel, np.concatenate(weights)[None], fits, bodies)
    return Network(chain, names, dt, ring, misfit, struck)


def _too_fine(length: float, dt: float, eta: float) -> SceneError:
    """Error for steps so short that a section cannot spread a wave enough."""
    return SceneError(
        f"loss.time = {eta:.3g} s: too long for a section of {length:g} m in steps of {dt:.2g} s: "
        "take a shorter loss.time, or fewer solver.cells"
    )


def _fits(numbers: Numbers, steel: np.ndarray, bodies: np.ndarray) -> np.ndarray:
    """Rows of `Fit` of the joints below the rods."""
    fits = np.zeros((len(numbers.rods), len(Fit)))
    for fit, joint, above, below in zip(fits, numbers.joints, bodies[:-1], bodies[1:], strict=True):
        kind, transmission, relaxation, _, preload, thread = joint.tolist()
        z = steel[[int(above[Body.LAST]), int(below[Body.FIRST])], Steel.IMPEDANCE]
        gives = float(np.sum(1.0 / z))
        stiffness, damping = thread, 0.0
        if kind == Joint.LOSSY and transmission < 1.0:
            damping = transmission / ((1.0 - transmission) * gives)
            stiffness = (1.0 + damping * gives) / (gives * relaxation)
        elif kind == Joint.LOSSY:
            kind = Joint.PERFECT
        fit[:] = (
            kind, gives, preload, stiffness, damping, below[Body.FIRST], 1.0 / gives, *(1.0 / z)
        )  # fmt: skip
    return fits


def parameters_of(network: Network, numbers: Numbers, par: np.ndarray) -> None:
    """Fill what `CHAIN_PAR` has beside the common parameters."""
    p: Any = par[0]
    values = numbers.values
    p["dt"] = network.time_step
    p["mass_b"] = network.chain.bodies[-1, Body.MASS]
    if PISTONS[values.piston_model] == Piston.ELASTIC:
        p["mass_p"] = network.chain.bodies[0, Body.MASS]
    p["sections"], p["bars"] = len(network.chain.places), len(network.names)
    p["joints"], p["struck"] = len(network.chain.fits), network.struck
    if PISTONS[values.piston_model] == Piston.ABSENT and values.effects_string:
        p["open_top"] = values.string_top
        p["pulse"], p["pulse_end"] = values.string_pulse_force, values.string_pulse_duration
    if values.effects_string:
        p["open_bottom"] = values.string_bottom
    if values.effects_string and values.effects_damper:
        p["damper"] = 1
        for name in ("stiffness", "damping", "preload"):
            p[f"damper_{name}"] = getattr(values, f"damper_{name}")
        p["casing_mass"] = values.damper_casing_mass
