"""The rigid option against an ODE solver that steps through the same equations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from percussion_model.engine.solvers import RigidSolver
from percussion_model.physics.records import BLOW, EVENT, EventKind, Mode
from percussion_model.scene.scene import Scene

FF, DFC, FC, BC, SS = Mode


class Stepped:
    """Impacts, drive and rock law of the reference scene, with `solve_ivp` between events.

    x holds bit position, bit velocity, piston position, piston velocity and the work of
    the dashpot; positions are absolute. Written from the tables of docs/model.md alone.
    """

    def __init__(self, scene):
        self.scene = scene
        self.m_p, self.m_b = scene.piston.mass, scene.bit.mass
        self.e = self.m_p / self.m_b  # equal sections: ratio of the lengths
        self.k, self.gamma = scene.rock.loading_stiffness, scene.rock.unloading_ratio
        self.c, self.w_r = scene.rock.barrier_damping, scene.rock.barrier_energy
        self.mode, self.alpha, self.x_r, self.p_u = FF, 1, 0.0, scene.start.rock_gap

    def rock_force(self, x):
        p = x[0] - self.x_r
        if self.mode == FF:
            return 0.0
        if self.mode in (DFC, FC):
            return self.k * p + (self.c * x[1] if self.mode == DFC else 0.0)
        force = self.gamma * self.k * (p - self.p_u)
        return force + (self.c * x[1] if self.mode == SS else 0.0)

    def rate(self, _, x):
        a_b = 10.0 + (self.scene.feed.force - self.rock_force(x)) / self.m_b
        a_p = 10.0 + self.alpha * self.scene.drive.force / self.m_p
        power = self.c * x[1] ** 2 if self.mode == DFC else 0.0
        return x[1], a_b, x[3], a_p, power

    def conditions(self):
        """Functions that cross zero at an event, with direction and name."""
        found = [(lambda t, x: x[0] - x[2], -1, "close")]
        if self.alpha < 0:
            reversal = self.scene.drive.reversal_distance
            found.append((lambda t, x: x[0] - x[2] - reversal, 1, "switch"))
        if self.mode == FF:
            found.append((lambda t, x: x[0] - self.x_r - self.p_u, 1, "touch"))
        elif self.mode == DFC:
            found.append((lambda t, x: x[4] - self.w_r, 1, "spent"))
            found.append((lambda t, x: x[1], -1, "peak"))
        elif self.mode == FC:
            found.append((lambda t, x: x[1], -1, "peak"))
        elif self.mode == BC:
            found.append((lambda t, x: x[0] - self.x_r - self.p_u, -1, "lift"))
            found.append((lambda t, x: x[1], 1, "turn"))
        else:
            found.append((lambda t, x: self.rock_force(x), -1, "lift"))
            limit = math.sqrt(2 * self.w_r / self.m_b)
            found.append((lambda t, x: abs(x[1]) - limit, 1, "leave"))
        for function, direction, _ in found:
            function.terminal, function.direction = True, direction
        return found

    def start_cycle(self, x, p):
        self.x_r, self.mode, x[4] = x[0] - p, DFC, 0.0

    def fast(self, x):
        return 0.5 * self.m_b * x[1] ** 2 > self.w_r

    def change(self, name, x):
        """Let an event happen; yield the kinds of its rows."""
        before = self.mode
        if name == "close":
            yield EventKind.CONTACT_CLOSED
            if self.alpha > 0:
                self.alpha = -1
                yield EventKind.DRIVE_UP
            impulse = (1 + self.e) * (x[3] - x[1]) / (1 / self.m_p + 1 / self.m_b)
            x[3] -= impulse / self.m_p
            x[1] += impulse / self.m_b
            yield EventKind.CONTACT_OPENED
            if self.mode == SS and self.fast(x):
                self.start_cycle(x, self.gamma * (x[0] - self.x_r - self.p_u))
        elif name == "switch":
            self.alpha = 1
            yield EventKind.DRIVE_DOWN
        elif name == "touch":
            if self.fast(x):
                self.start_cycle(x, 0.0)
            else:
                self.mode = SS
        elif name == "spent":
            self.mode = FC
        elif name == "peak":
            self.mode = BC
            self.p_u = (x[0] - self.x_r) * (1 - 1 / self.gamma)
        else:
            self.mode = {"lift": FF, "turn": SS}[name]
        if self.mode != before:
            yield EventKind.MODE_FF + self.mode

    def run(self, end):
        start = self.scene.start
        x, t, rows = np.array([0.0, 0.0, -start.gap, start.piston_velocity, 0.0]), 0.0, []
        while t < end:
            found = self.conditions()
            stretch = solve_ivp(
                self.rate,
                (t, end),
                x,
                method="DOP853",
                rtol=1e-12,
                atol=1e-15,
                max_step=1e-5 if abs(x[1]) < 0.05 else 1e-4,  # no return within a step
                events=[condition for condition, _, _ in found],
            )
            t, x = stretch.t[-1], stretch.y[:, -1].copy()
            for times, (_, _, name) in zip(stretch.t_events, found, strict=True):
                if len(times):
                    rows.extend((int(kind), t, x[0]) for kind in self.change(name, x))
        return rows


def test_same_events_as_an_ode_solver():
    scene = Scene(piston={"model": "rigid"}, bit={"model": "rigid"})
    end = 0.1
    solver = RigidSolver(scene)
    blows, events = np.zeros(10, BLOW), np.zeros(1000, EVENT)
    _, n_blows, n_events = solver.advance(solver.new_state(), end, blows, events, True)
    rows = Stepped(scene).run(end)
    events = events[:n_events]
    assert n_blows == 2
    assert [row[0] for row in rows] == list(events["kind"])
    assert [row[1] for row in rows] == pytest.approx(events["time"], abs=1e-12)
    assert [row[2] for row in rows] == pytest.approx(events["bit_position"], abs=1e-12)
