"""Explicit elements: lumped masses, leapfrog at the greatest stable step, hard contact.

A peer that methods are compared with, compiled and tuned as its best user would.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from percussion_model.engine.solver import Grid
from percussion_model.physics.records import Piston
from percussion_model.scene.bars import (
    AREA,
    LENGTH,
    YOUNGS_MODULUS,
    bar_mass,
    bar_transit_time,
    section_impedance,
    section_mass,
    section_transit_time,
)
from percussion_model.scene.numbers import JOINT_KINDS, numbers_of
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.simulate import Simulation
from percussion_model.solvers.setup import (
    MOST_CHANGES,
    fill_parameters,
    fill_start,
    kelvin_voigt_time,
)
from percussion_model.solvers.state import State
from percussion_model.verification.accuracy.explicit_joints import (
    BAR_ROWS,
    DAMPER,
    FIT,
    FORCE,
    GAP,
    GREATEST,
    JOINT_ROWS,
    LOSSY,
    PERFECT,
    POSITION,
    STORED,
    VELOCITY,
    Chain,
    begin,
)
from percussion_model.verification.accuracy.explicit_rock import prepare_mode
from percussion_model.verification.accuracy.explicit_step import (
    EXPLICIT_PAR,
    EXPLICIT_STATE,
    STRETCH,
    Joint,
    run,
)
from percussion_model.verification.accuracy.peer import PeerSolver, refuse_uncarried

# Time step by the longest stable one: there the highest mode would ring on for ever.
COURANT = 0.9
CONTACT = JOINT_KINDS.index("contact")
# Of what not all peers carry.
CARRIED = frozenset({"external", "spring", "none", "no barrier", "paper"})


def stable_step(transit_time: float, loss_time: float) -> float:
    """Longest step at which an element's highest mode does not grow [s].

    2 / omega (sqrt(1 + zeta^2) - zeta): damping that looks back half a step shortens it.
    """
    zeta = loss_time / transit_time
    return transit_time * (math.sqrt(1.0 + zeta * zeta) - zeta)


class ExplicitSolver(PeerSolver):
    """Explicit elements.

    Parameters
    ----------
    scene : Scene
        With elastic bars, a drill string or none, on bilinear rock, a spring or none.
    elements : int
        In the piston, or in the bit without one; other bars' have about the same transit time.
    courant : float
        Time step by the greatest that is stable.
    """

    name = "explicit"
    time_step: float
    COUNTS: ClassVar = ("steps", "events", "blows", "locked")

    def __init__(self, scene: Scene, elements: int, courant: float = COURANT) -> None:
        self._is_chain = scene.effects.string
        refuse_uncarried(
            "explicit elements", scene, CARRIED | {"string" if self._is_chain else "absent"}
        )
        super().__init__(scene)
        self._numbers = numbers = numbers_of(scene)
        rods = {f"rod {k}": rod for k, rod in enumerate(numbers.rods, start=1)}
        bars = {"piston": numbers.piston, **rods, "bit": numbers.bit}
        if scene.piston.model == "absent":
            del bars["piston"]
        self._bars, self._mass = tuple(bars), np.array([bar_mass(bar) for bar in bars.values()])
        self._par = np.zeros(1, EXPLICIT_PAR)
        self._runs = self._divide(list(bars.values()), elements, courant)
        self._fits = self._make_fits() if self._is_chain else np.zeros(0, FIT)
        self._nodes = int((self._runs["n"] + 1).sum())
        self.cells = {name: int(self._runs_of(name)["n"].sum()) for name in bars}

    def _divide(self, bars: list[np.ndarray], elements: int, courant: float) -> np.ndarray:
        """Fill the parameters, and return the stretches of equal elements of all bars."""
        numbers = self._numbers
        p: Any = self._par[0]
        fill_parameters(p, numbers, True)
        has_piston = Piston(int(p["piston"])) != Piston.ABSENT
        p["eta"] = eta = kelvin_voigt_time(numbers)
        p["most_changes"], p["bars"] = MOST_CHANGES, len(bars)
        if has_piston:
            p["start_gap"] = numbers.values.start_gap
        else:
            p["mass_p"] = 0.0
        if self._is_chain and numbers.values.effects_damper:
            p["damper"] = 1
            for name in DAMPER:
                p[f"damper_{name}"] = getattr(numbers.values, f"damper_{name}")
        element = bar_transit_time(bars[0]) / elements
        rows, steps, node = [], [], 0
        for i, bar in enumerate(bars):
            is_bit = i == len(bars) - 1
            for section in bar:
                transit = section_transit_time(section)
                n = max(2, math.floor(transit / element + 0.5))
                mass = section_mass(section) / n
                stiff = n * section[YOUNGS_MODULUS] * section[AREA] / section[LENGTH]
                rows.append([i, node, n, is_bit, Joint.WELD, mass / 2, stiff / mass, 0, 0])
                steps.append(courant * stable_step(transit / n, eta))
                node += n + 1
            rows[-1][4] = Joint.ROCK if is_bit else Joint.ROD
            if i == 0 and has_piston:
                rows[-1][4] = Joint.CONTACT
        runs = np.array([tuple(row) for row in rows], STRETCH)
        p["dt"] = self.time_step = min(steps)
        runs["kappa"] *= p["dt"]
        p["end_mass"], p["bit_from"] = runs["half"][-1], np.sum(runs["bit"] == 0)
        p["uppers"] = np.sum(runs["bar"] == 0) if has_piston else 0
        return runs

    def _make_fits(self) -> np.ndarray:
        """Laws of the joints: that of the piston, and those below the rods."""
        uppers = np.flatnonzero(np.isin(self._runs["joint"], (Joint.CONTACT, Joint.ROD)))
        fits = np.zeros(len(uppers), FIT)
        fits["kind"] = CONTACT
        upper, lower = self._runs["half"][uppers], self._runs["half"][uppers + 1]
        fits["shared"] = upper * lower / (upper + lower)
        bars = [*self._numbers.rods, self._numbers.bit]
        for j, row in enumerate(self._numbers.joints, start=1):
            kind, transmission, relaxation, _, preload, stiffness = row.tolist()
            damping = 0.0
            if kind == LOSSY and transmission == 1.0:
                kind = PERFECT
            if kind == LOSSY:
                ends = bars[j - 1][-1], bars[j][0]
                gives = sum(1.0 / section_impedance(end) for end in ends)
                damping = transmission / ((1.0 - transmission) * gives)
                stiffness = (1.0 + damping * gives) / (gives * relaxation)
            if kind in (PERFECT, CONTACT):
                stiffness = 0.0
            if kind in (PERFECT, CONTACT, LOSSY):
                preload = 0.0
            fits[j] = kind, fits["shared"][j], preload, stiffness, damping
        return fits

    def new_state(self) -> State:
        """State at time zero; velocities are those of half a step before."""
        values, par = self._numbers.values, self._par[0]
        counts: tuple[tuple[int, int], ...] = ((3, self._nodes),)
        if self._is_chain:
            counts = (
                (4, self._nodes), (BAR_ROWS, len(self._bars)), (JOINT_ROWS, len(self._fits))
            )  # fmt: skip
        state = State(EXPLICIT_STATE, counts)
        s: Any = state.record[0]
        fill_start(s, self._numbers)
        speed, place = np.full(len(self._bars), values.start_bit_velocity), -par["start_gap"]
        if par["uppers"]:
            speed[0] = values.start_piston_velocity
        if self._is_chain:
            _, bars, joints = state.arrays
            bars[VELOCITY], bars[POSITION, 0], s["u_r"] = speed, place, place
            joints[GAP, 1:] = self._numbers.joints[:, 3]
            joints[GAP, (self._fits["kind"] == PERFECT) | (self._fits["kind"] == LOSSY)] = 0.0
            preload, stiffness = self._fits["preload"], self._fits["stiffness"]
            joints[STORED] = joints[GAP] * (preload + 0.5 * stiffness * joints[GAP])
            begin(self._par, state.record, self._chain_of(state))
            speed = bars[VELOCITY]
            kinetic = np.sum(self._mass * speed**2) + par["damper_casing_mass"] * s["v_c"] ** 2
            s["e_start"] = 0.5 * kinetic + joints[STORED].sum()
        w, _, v = state.arrays[0][:3]
        bar = np.repeat(self._runs["bar"], self._runs["n"] + 1)
        v[:] = speed[bar]
        w[:] = np.where(bar == 0, place, 0.0) + par["eta"] * v
        s["v_end"] = speed[-1]
        s["p"] -= 0.5 * self.time_step * s["v_end"]  # half a step before
        prepare_mode(par, s)
        return state

    def _chain_of(self, state: State) -> Chain | None:
        """What kernels need of a chain, None of two bars."""
        if not self._is_chain:
            return None
        rows, bars, joints = state.arrays
        return Chain(self._fits, self._mass, bars, joints, rows[3])

    def _run(
        self, reads: int, state: State, t: float, blows: np.ndarray, events: np.ndarray,
        reading: np.ndarray,
    ) -> int:  # fmt: skip
        rows, parts = state.arrays[0], self._chain_of(state) or (None,) * len(Chain._fields)
        return run(
            reads, self._par, state.record, self._runs, *parts, rows[0], rows[1], rows[2], t,
            blows, events, reading,
        )  # fmt: skip

    def _runs_of(self, bar: str) -> np.ndarray:
        """Stretches of a bar."""
        return self._runs[self._runs["bar"] == self._bars.index(bar)]

    def grid_of(self, bar: str) -> Grid | None:
        """Elements of a bar, None where it has none."""
        if bar not in self._bars:
            return None
        runs = self._runs_of(bar)
        return Grid(np.repeat(2.0 * runs["half"], runs["n"]), runs["n"].tolist())

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Elastic force [N] and velocity [m/s] of each element, top to bottom, by bar."""
        w, v = state.arrays[0][int(state.record[0]["flip"])], state.arrays[0][2]
        par, out = self._par[0], dict[str, np.ndarray]()
        for name in self._bars:
            parts: dict[str, list[np.ndarray]] = {"force": [], "velocity": []}
            for row in self._runs_of(name):
                nodes = slice(int(row["first"]), int(row["first"] + row["n"] + 1))
                stiffness = 2.0 * row["half"] * row["kappa"] / par["dt"]
                parts["force"].append(-stiffness * np.diff(w[nodes] - par["eta"] * v[nodes]))
                parts["velocity"].append(0.5 * (v[nodes][:-1] + v[nodes][1:]))
            out |= {f"{name}_{what}": np.concatenate(arrays) for what, arrays in parts.items()}
        return out

    def joint_forces(self, state: State) -> np.ndarray:
        """Mean force in the last step, least and greatest so far, of each joint of a string [N].

        Returns
        -------
        float array, shape (3, joints)
            The first is that of piston and struck bar; compression is positive.
        """
        return np.array(state.arrays[2][FORCE : GREATEST + 1])


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
        raise SceneError(f"explicit elements: too few blows after {settle:g} s give no rate")
    return rate
