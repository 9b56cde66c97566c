"""Exact flow: elements in space, matrix exponentials in time, events on the flow.

A peer that methods are compared with. Half lumped, half consistent mass, whose dispersion is
of fourth order, hard contact, and a step that is as long as events allow.
It stays as the one peer that is ahead of explicit elements anywhere: in 4 of the 44 cells of
docs/data/accuracy.md, section 2.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from percussion_model.physics.records import DriveKind, Mode
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.rock_law import rock_numbers
from percussion_model.scene.scene import Scene
from percussion_model.solvers.fem.mesh import BarMesh, assemble, cut_bar
from percussion_model.solvers.fem.records import Mesh
from percussion_model.solvers.setup import fill_parameters, fill_start, kelvin_voigt_time
from percussion_model.solvers.state import State
from percussion_model.verification.accuracy.exact_flow_step import (
    FINE,
    FLOW_PAR,
    FLOW_STATE,
    LEVELS,
    Flow,
    run,
)
from percussion_model.verification.accuracy.peer import PeerSolver, refuse_uncarried

# Steps in the bit's transit in which events are looked for: half as many miss short bounces
# on rock that springs back stiffly, twice as many change nothing that a finer mesh does not.
WATCH = 8
# Of what not all peers carry.
CARRIED = frozenset({"absent", "spring", "none", "no barrier", "paper"})


class ExactFlowSolver(PeerSolver):
    """Exact flow of the semi-discrete bars.

    Parameters
    ----------
    scene : Scene
        With elastic bars; its inputs stay as they are.
    elements : int
        In the piston, or in the bit without one; the bit's have about the same length.
    """

    name, title = "exact-flow", "exact flow"
    time_step: float
    consistent = 0.5  # of the mass; the rest is lumped
    levels = LEVELS
    COUNTS: ClassVar[tuple[str, ...]] = ("steps", "events", "blows")

    def __init__(self, scene: Scene, elements: int) -> None:
        refuse_uncarried(self.title, scene, CARRIED)
        super().__init__(scene)
        self._numbers = numbers = numbers_of(scene)
        par = np.zeros(1, FLOW_PAR)
        p: Any = par[0]
        fill_parameters(p, numbers, True)
        p["step"] = self.time_step = scene.bit.transit_time / WATCH
        first = scene.bit if scene.piston.model == "absent" else scene.piston
        bars = [cut_bar(numbers.bit, first.length / elements)]
        if scene.piston.model != "absent":
            p["start_gap"] = scene.start.gap
            bars.insert(0, cut_bar(numbers.piston, first.length / elements))
        p["n_p"], p["n_b"] = sum(bar.n + 1 for bar in bars[:-1]), bars[-1].n + 1
        self.cells = dict(zip(("piston", "bit")[-len(bars) :], (b.n for b in bars), strict=True))
        self._par = par
        self._bars = dict(zip(self.cells, bars, strict=True))
        p["eta"] = kelvin_voigt_time(numbers)
        self._mesh = assemble(bars)
        self._flow = self._matrices(self._mesh, float(p["eta"]))

    def _matrices(self, mesh: np.ndarray, eta: float) -> Flow:
        """Exponentials of all modes at all levels."""
        p, scene = self._par[0], self.scene
        n_p, n = int(p["n_p"]), mesh.shape[1]
        share, off = mesh[Mesh.SHARE], self.consistent * mesh[Mesh.COUPLING, :-1]
        mass = np.diag(share + self.consistent * (mesh[Mesh.MASS] - share))
        mass += np.diag(off, 1) + np.diag(off, -1)
        springs = np.diag(mesh[Mesh.SPRINGS])
        springs -= np.diag(mesh[Mesh.STIFFNESS, :-1], 1) + np.diag(mesh[Mesh.STIFFNESS, :-1], -1)
        inverse = np.linalg.inv(mass)
        steady, driven = np.full((2, n), float(p["gravity"]))
        driven[:] = 0.0
        steady[n_p:] += (scene.feed.force if scene.effects.feed else 0.0) / float(p["mass_b"])
        if p["drive"] == DriveKind.PRESSURE:
            driven[:n_p] = scene.drive.force / float(p["mass_p"])
        apart = np.zeros(n)
        if n_p:
            apart[n_p - 1], apart[n_p] = 1.0, -1.0
            p["soft"] = apart @ inverse @ apart
        spring, ratio, dashpot, _ = rock_numbers(self._numbers)
        of_mode = {
            Mode.FF: (0.0, 0.0),
            Mode.DFC: (spring, dashpot),
            Mode.FC: (spring, 0.0),
            Mode.BC: (ratio * spring, 0.0),
            Mode.SS: (ratio * spring, dashpot),
        }
        top, low = np.arange(n_p), np.arange(n_p, n)
        piston = np.zeros((1, self.levels, 2 * n_p + 2, 2 * n_p))
        bit = np.zeros((5, self.levels, 2 * (n - n_p) + 2, 2 * (n - n_p)))
        both, force = np.zeros((5, self.levels, 2 * n + 2, 2 * n)), np.zeros((5, 2 * n + 2))
        order = np.r_[top, n + top, low, n + low, 2 * n, 2 * n + 1]
        for mode, (k, c) in of_mode.items():
            a = np.zeros((n, 2 * n + 2))
            a[:, :n], a[:, n : 2 * n] = -inverse @ springs, -eta * inverse @ springs
            a[:, n - 1] -= k * inverse[:, -1]
            a[:, 2 * n - 1] -= c * inverse[:, -1]
            a[:, -2], a[:, -1] = steady, driven
            if n_p:
                row = apart @ a / p["soft"]
                force[mode] = row[order]
                both[mode] = self._powers(a - np.outer(inverse @ apart, row), np.arange(n))
            if n_p and mode == Mode.FF:
                piston[0] = self._powers(a, top)
            bit[mode] = self._powers(a, low)
        blocks = np.r_[top, n + top, low, n + low]
        if n_p:
            both[:] = both[:, :, order][:, :, :, blocks]
        kick = np.zeros(2 * n + 2)
        kick[: n_p + n_p] = np.r_[np.zeros(n_p), -(inverse @ apart)[:n_p]]
        kick[2 * n_p : 2 * n] = np.r_[np.zeros(n - n_p), -(inverse @ apart)[n_p:]]
        above = np.cumsum(share[n_p:])
        return Flow(
            piston, bit, both, force, kick, share.copy(),
            np.array([np.diag(mass)[n_p:], np.r_[off[n_p:], 0.0]]),
            np.array([mesh[Mesh.STIFFNESS, n_p:], above]),
        )  # fmt: skip

    def _powers(self, acceleration: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Exponentials of the flow of some nodes over all steps, shortest first.

        Differences from 1 are squared, so that the shortest step costs no digits.
        """
        n, m = acceleration.shape[0], len(nodes)
        a = np.zeros((2 * m + 2, 2 * m + 2))
        a[:m, m : 2 * m] = np.eye(m)
        a[m : 2 * m] = acceleration[np.ix_(nodes, np.r_[nodes, n + nodes, 2 * n, 2 * n + 1])]
        a *= self.time_step * 0.5**FINE
        square = a @ a
        change = a + square / 2.0 + square @ a / 6.0 + square @ square / 24.0
        found = np.zeros((self.levels, 2 * m + 2, 2 * m))
        for level in range(self.levels):
            found[level] = (change + np.eye(2 * m + 2))[:-2].T
            change = 2.0 * change + change @ change
        return found

    def new_state(self) -> State:
        """State at time zero."""
        n_p, n_b = int(self._par[0]["n_p"]), int(self._par[0]["n_b"])
        state = State(FLOW_STATE, ((2, 2 * (n_p + n_b) + 2),))
        s, (x, _) = state.record[0], state.arrays[0]
        fill_start(s, self._numbers)
        start = self.scene.start
        x[: 2 * n_p + n_b] = -start.rock_gap
        x[:n_p] -= start.gap
        x[n_p : 2 * n_p] = start.piston_velocity
        x[2 * n_p + n_b : -2] = start.bit_velocity
        x[-2], x[-1] = 1.0, s["alpha"]
        return state

    def set_inputs(self, state: State, **inputs: float) -> None:
        """Refuse: the exponentials hold for the inputs of the scene."""
        raise SimulationError(f"{self.title}: {', '.join(inputs)} cannot change during a run")

    def _run(
        self, reads: int, state: State, t: float, blows: np.ndarray, events: np.ndarray,
        reading: np.ndarray,
    ) -> int:  # fmt: skip
        x, y = state.arrays[0]
        return run(reads, self._par, state.record, self._flow, x, y, t, blows, events, reading)

    def grid_of(self, bar: str) -> BarMesh | None:
        """Elements of "piston" or "bit", None where it has none."""
        return self._bars.get(bar)

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Elastic force [N] and velocity [m/s] of each element, top to bottom, by bar."""
        x, first, out = state.arrays[0][0], 0, dict[str, np.ndarray]()
        for name, bar in self._bars.items():
            nodes = bar.n + 1
            u, v = x[2 * first : 2 * first + nodes], x[2 * first + nodes : 2 * (first + nodes)]
            out[f"{name}_force"] = -self._mesh[Mesh.STIFFNESS, first : first + bar.n] * np.diff(u)
            out[f"{name}_velocity"] = 0.5 * (v[:-1] + v[1:])
            first += nodes
        return out
