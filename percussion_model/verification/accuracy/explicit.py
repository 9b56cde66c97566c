"""Explicit elements: lumped masses, leapfrog at the greatest stable step, hard contact.

A peer that methods are compared with, compiled and tuned as its best user would.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, NamedTuple

import numpy as np

from percussion_model.physics.records import Piston
from percussion_model.scene.bars import (
    AREA,
    LENGTH,
    YOUNGS_MODULUS,
    bar_transit_time,
    section_mass,
    section_transit_time,
)
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.simulate import Simulation
from percussion_model.solvers.setup import (
    MOST_CHANGES,
    fill_parameters,
    fill_start,
    kelvin_voigt_time,
)
from percussion_model.solvers.state import State
from percussion_model.verification.accuracy.explicit_step import (
    EXPLICIT_PAR,
    EXPLICIT_STATE,
    STRETCH,
    Joint,
    prepare_mode,
    run,
)
from percussion_model.verification.accuracy.peer import PeerSolver, refuse_uncarried

__all__ = ["ExplicitSolver", "explicit_rate"]

# Time step by the longest stable one: there the highest mode would ring on for ever.
COURANT = 0.9
# Of what not all peers carry.
CARRIED = frozenset({"external", "spring", "none", "no barrier", "paper"})


def stable_step(transit_time: float, loss_time: float) -> float:
    """Longest step at which an element's highest mode does not grow [s].

    2 / omega (sqrt(1 + zeta^2) - zeta): damping that looks back half a step shortens it.
    """
    zeta = loss_time / transit_time
    return transit_time * (math.sqrt(1.0 + zeta * zeta) - zeta)


class Elements(NamedTuple):
    """Elements of one bar, top to bottom.

    Attributes
    ----------
    mass : ndarray, shape (n,)
        Of each [kg].
    """

    mass: np.ndarray

    @property
    def n(self) -> int:
        """Number of elements."""
        return len(self.mass)


class ExplicitSolver(PeerSolver):
    """Explicit elements.

    Parameters
    ----------
    scene : Scene
        With elastic bars on bilinear rock, a spring or none.
    elements : int
        In the piston, or in the bit without one; the bit's have about the same transit time.
    courant : float
        Time step by the greatest that is stable.
    """

    name = "explicit"
    time_step: float
    COUNTS: ClassVar = ("steps", "events", "blows", "locked")

    def __init__(self, scene: Scene, elements: int, courant: float = COURANT) -> None:
        refuse_uncarried("explicit elements", scene, CARRIED | {"absent"})
        super().__init__(scene)
        self._numbers = numbers = numbers_of(scene)
        par = np.zeros(1, EXPLICIT_PAR)
        p: Any = par[0]
        fill_parameters(p, numbers, True)
        kind = Piston(int(p["piston"]))
        bars = [numbers.bit] if kind == Piston.ABSENT else [numbers.piston, numbers.bit]
        element = bar_transit_time(bars[0]) / elements
        p["eta"], p["start_gap"] = kelvin_voigt_time(numbers), scene.start.gap
        p["most_changes"] = MOST_CHANGES
        if kind == Piston.ABSENT:
            p["mass_p"] = p["start_gap"] = 0.0
        runs = np.zeros(sum(map(len, bars)), STRETCH)
        transits = np.zeros(len(runs))
        k = node = 0
        for bar in bars:
            for section in bar:
                transit = section_transit_time(section)
                n = max(2, math.floor(transit / element + 0.5))
                mass = section_mass(section) / n
                stiff = n * section[YOUNGS_MODULUS] * section[AREA] / section[LENGTH]
                runs[k] = (node, n, bar is numbers.bit, Joint.WELD, mass / 2, stiff / mass, 0, 0)
                transits[k] = transit / n
                k, node = k + 1, node + n + 1
            runs[k - 1]["joint"] = Joint.ROCK if bar is numbers.bit else Joint.CONTACT
        eta = float(p["eta"])
        p["dt"] = self.time_step = courant * min(stable_step(t, eta) for t in transits)
        runs["kappa"] *= p["dt"]
        p["end_mass"] = runs["half"][-1]
        p["uppers"] = np.sum(runs["bit"] == 0)
        self._par, self._runs, self._nodes = par, runs, node
        self.cells = {
            name: int(runs["n"][runs["bit"] == bit].sum())
            for name, bit in (("piston", 0), ("bit", 1))
            if np.any(runs["bit"] == bit)
        }

    def new_state(self) -> State:
        """State at time zero."""
        state = State(EXPLICIT_STATE, ((3, self._nodes),))
        s, (rows,) = state.record[0], state.arrays
        fill_start(s, self._numbers)
        values = self._numbers.values
        piston = int(self._runs["first"][self._runs["bit"] == 1][0])
        w, _, v = rows
        v[:piston], v[piston:] = values.start_piston_velocity, values.start_bit_velocity
        w[:piston] = -values.start_gap
        w += self._par[0]["eta"] * v
        s["v_end"] = values.start_bit_velocity
        s["p"] -= 0.5 * self.time_step * s["v_end"]  # half a step before
        prepare_mode(self._par[0], s)
        return state

    def _run(
        self, reads: int, state: State, t: float, blows: np.ndarray, events: np.ndarray,
        reading: np.ndarray,
    ) -> int:  # fmt: skip
        rows = state.arrays[0]
        return run(
            reads, self._par, state.record, self._runs, rows[0], rows[1], rows[2], t,
            blows, events, reading,
        )  # fmt: skip

    def grid_of(self, bar: str) -> Elements | None:
        """Elements of "piston" or "bit", None where it has none."""
        runs = self._runs[self._runs["bit"] == (bar == "bit")]
        return Elements(np.repeat(2.0 * runs["half"], runs["n"])) if len(runs) else None

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Elastic force [N] and velocity [m/s] of each element, top to bottom, by bar."""
        rows, v = state.arrays[0], state.arrays[0][2]
        w = rows[int(state.record[0]["flip"])]
        par, out = self._par[0], dict[str, np.ndarray]()
        for name in self.cells:
            parts: dict[str, list[np.ndarray]] = {"force": [], "velocity": []}
            for row in self._runs[self._runs["bit"] == (name == "bit")]:
                nodes = slice(int(row["first"]), int(row["first"] + row["n"] + 1))
                stiffness = 2.0 * row["half"] * row["kappa"] / par["dt"]
                parts["force"].append(-stiffness * np.diff(w[nodes] - par["eta"] * v[nodes]))
                parts["velocity"].append(0.5 * (v[nodes][:-1] + v[nodes][1:]))
            out |= {f"{name}_{what}": np.concatenate(arrays) for what, arrays in parts.items()}
        return out


def explicit_rate(
    scene: Scene,
    elements: int,
    duration: float = 4.0,
    settle: float = 1.0,
    courant: float = COURANT,
) -> float:
    """Rate of penetration by explicit elements, over whole blows after settling [m/s].

    Parameters
    ----------
    scene : Scene
        With elastic bars of any lengths and sections.
    elements : int
        In the piston; the error falls about as their number rises, and more quickly in the
        mean over scenes.
    duration, settle : float
        Simulated time, and what of it does not count [s].
    courant : float
        Time step by the greatest that is stable.
    """
    simulation = Simulation(
        scene, record_events=False, solver=ExplicitSolver(scene, elements, courant)
    )
    simulation.advance(duration)
    rate = simulation.result(settle).rate_of_penetration
    if not math.isfinite(rate):
        raise SceneError(f"explicit elements: too few blows after {settle:g} s tell no rate")
    return rate
