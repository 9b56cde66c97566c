"""Explicit elements for a chain of bars: piston, rods and bit, joints, damper.

An oracle of the waves in chains, made of other things than these: lumped masses.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

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
from percussion_model.scene.scene import Scene
from percussion_model.solvers.setup import (
    MOST_CHANGES,
    fill_parameters,
    fill_start,
    kelvin_voigt_time,
)
from percussion_model.solvers.state import State
from percussion_model.verification.accuracy.explicit import CARRIED, COURANT, Elements, stable_step
from percussion_model.verification.accuracy.explicit_chain_step import (
    BAR_ROWS,
    CHAIN_PAR,
    CHAIN_STATE,
    CHAIN_STRETCH,
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
    begin,
    run,
)
from percussion_model.verification.accuracy.explicit_step import Joint
from percussion_model.verification.accuracy.peer import PeerSolver, refuse_uncarried

__all__ = ["ExplicitChainSolver"]

CONTACT = JOINT_KINDS.index("contact")


class ExplicitChainSolver(PeerSolver):
    """Explicit elements for a chain of elastic bars.

    Parameters
    ----------
    scene : Scene
        With a piston; with effects.string, or of piston and bit alone.
    elements : int
        In the piston; those of the other bars have about the same transit time.
    courant : float
        Time step by the greatest that is stable.
    """

    name = "explicit chain"
    time_step: float
    COUNTS: ClassVar = ("steps", "events", "blows", "locked")

    def __init__(self, scene: Scene, elements: int, courant: float = COURANT) -> None:
        refuse_uncarried("explicit elements of a chain", scene, CARRIED | {"string"})
        super().__init__(scene)
        self._numbers = numbers = numbers_of(scene)
        values = numbers.values
        self._par = par = np.zeros(1, CHAIN_PAR)
        p: Any = par[0]
        fill_parameters(p, numbers, True)
        bars = [numbers.piston, *numbers.rods, numbers.bit]
        self._names = ["piston", *(f"rod {k + 1}" for k in range(len(numbers.rods))), "bit"]
        element = bar_transit_time(numbers.piston) / elements
        p["eta"], p["start_gap"] = kelvin_voigt_time(numbers), values.start_gap
        p["most_changes"], p["bars"] = MOST_CHANGES, len(bars)
        if values.effects_string and values.effects_damper:
            p["damper"] = 1
            for name in DAMPER:
                p[f"damper_{name}"] = getattr(values, f"damper_{name}")
        self._runs = runs = np.zeros(sum(map(len, bars)), CHAIN_STRETCH)
        transits = np.zeros(len(runs))
        k = node = 0
        for i, bar in enumerate(bars):
            for section in bar:
                transits[k] = section_transit_time(section)
                n = max(2, math.floor(transits[k] / element + 0.5))
                half = section_mass(section) / (2 * n)
                stiff = n * section[YOUNGS_MODULUS] * section[AREA] / section[LENGTH]
                runs[k] = i, node, n, i == len(bars) - 1, Joint.WELD, half, stiff / (2 * half), 0, 0
                transits[k] /= n
                k, node = k + 1, node + n + 1
            runs[k - 1]["joint"] = Joint.CONTACT
        runs[-1]["joint"] = Joint.ROCK
        p["dt"] = dt = self.time_step = courant * min(stable_step(t, p["eta"]) for t in transits)
        runs["kappa"] *= dt
        p["end_mass"], p["uppers"] = runs["half"][-1], np.sum(runs["bit"] == 0)
        self._mass, self._nodes = np.array([bar_mass(bar) for bar in bars]), node
        self._fits = self._make_fits(bars)
        self.cells = {
            name: int(runs["n"][runs["bar"] == i].sum()) for i, name in enumerate(self._names)
        }

    def _make_fits(self, bars: list[np.ndarray]) -> np.ndarray:
        """Laws of the joints: that of the piston, and those below the rods."""
        fits = np.zeros(len(bars) - 1, FIT)
        fits["kind"][0] = CONTACT
        fits["upper"] = np.flatnonzero(self._runs["joint"] == Joint.CONTACT)
        upper = self._runs["half"][fits["upper"]]
        lower = self._runs["half"][fits["upper"] + 1]
        fits["shared"] = upper * lower / (upper + lower)
        for j, row in enumerate(self._numbers.joints, start=1):
            kind, transmission, relaxation, _, preload, stiffness = row.tolist()
            damping = 0.0
            if kind == LOSSY and transmission == 1.0:
                kind = PERFECT
            if kind == LOSSY:
                ends = bars[j][-1], bars[j + 1][0]
                gives = sum(1.0 / section_impedance(end) for end in ends)
                damping = transmission / ((1.0 - transmission) * gives)
                stiffness = (1.0 + damping * gives) / (gives * relaxation)
            if kind in (PERFECT, CONTACT):
                stiffness = 0.0
            if kind in (PERFECT, CONTACT, LOSSY):
                preload = 0.0
            fits[j] = kind, fits["upper"][j], fits["shared"][j], preload, stiffness, damping
        return fits

    def new_state(self) -> State:
        """State at time zero; velocities are those of half a step before."""
        state = State(
            CHAIN_STATE,
            ((BAR_ROWS, len(self._names)), (JOINT_ROWS, len(self._fits)), (4, self._nodes)),
        )
        s: Any = state.record[0]
        bars, joints, rows = state.arrays
        fill_start(s, self._numbers)
        values, fits = self._numbers.values, self._fits
        bars[VELOCITY] = values.start_bit_velocity
        bars[VELOCITY, 0] = s["v_p"]
        bars[POSITION, 0] = s["u_r"] = -values.start_gap
        joints[GAP, 0], joints[GAP, 1:] = values.start_gap, self._numbers.joints[:, 3]
        joints[GAP, (fits["kind"] == PERFECT) | (fits["kind"] == LOSSY)] = 0.0
        joints[STORED] = joints[GAP] * (fits["preload"] + 0.5 * fits["stiffness"] * joints[GAP])
        begin(self._par, state.record, self._runs, self._mass, bars, joints, rows)
        return state

    def _run(
        self, reads: int, state: State, t: float, blows: np.ndarray, events: np.ndarray,
        reading: np.ndarray,
    ) -> int:  # fmt: skip
        bars, joints, rows = state.arrays
        return run(
            reads, self._par, state.record, self._runs, self._fits, self._mass, bars, joints,
            rows, t, blows, events, reading,
        )  # fmt: skip

    def grid_of(self, bar: str) -> Elements | None:
        """Elements of a bar, None where it has none."""
        if bar not in self._names:
            return None
        runs = self._runs[self._runs["bar"] == self._names.index(bar)]
        return Elements(np.repeat(2.0 * runs["half"], runs["n"]))

    def joint_forces(self, state: State) -> np.ndarray:
        """Mean force in the last step, least and greatest so far, of each joint [N].

        Returns
        -------
        float array, shape (3, joints)
            The first is that of piston and struck bar; compression is positive.
        """
        return np.array(state.arrays[1][FORCE : GREATEST + 1])
