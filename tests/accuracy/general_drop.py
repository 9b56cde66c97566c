"""A drop of the finite elements' bit by a general integrator, scipy's DOP853: an oracle.

Mesh, mass, stiffness and rock law are those of `solver.name = "fem"` (docs/numerics.md, eq. 8),
as y' = f(t, y) with y = (u, v, W, E): nodes, work of the dashpot, energy into the rock. The
integrator starts anew at each event of the rock law (table 1 of docs/model.md).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from percussion_model.physics.records import Mode
from percussion_model.scene.numbers import section_numbers
from percussion_model.scene.scene import Scene
from percussion_model.solvers.fem.mesh import assemble, cut_bar
from percussion_model.solvers.fem.records import Mesh

# Dead band of the velocity of the bit's end [m/s]; docs/model.md, section 6.
REST = 1e-9
# Absolute tolerances by the relative one: displacement [m], velocity [m/s], work and energy [J].
ABSOLUTE = (1e-5, 10.0, 1e-2, 1.0)
# After an event the state advances by so much, off the zero of that event [s].
NUDGE = 1e-9


class Drop:
    """The semi-discrete bit on bilinear rock with a barrier."""

    def __init__(self, scene: Scene) -> None:
        rock = scene.rock
        bit = section_numbers(scene.bit)
        mesh = assemble([cut_bar(bit, scene.bit.length / scene.fem.elements)])
        self.n = mesh.shape[1]
        off = mesh[Mesh.COUPLING, :-1]
        self.mass = np.diag(mesh[Mesh.MASS]) + np.diag(off, 1) + np.diag(off, -1)
        off = -mesh[Mesh.STIFFNESS, :-1]
        springs = np.diag(mesh[Mesh.SPRINGS]) + np.diag(off, 1) + np.diag(off, -1)
        self.inverse = np.linalg.inv(self.mass)
        self.pull = -self.inverse @ springs
        self.eta = scene.loss.time
        self.k_r, self.gamma = rock.loading_stiffness, rock.unloading_ratio
        self.c_r, self.w_r = rock.barrier_damping, rock.barrier_energy
        self.level = rock.barrier_threshold * self.w_r
        self.push = scene.gravity.acceleration + scene.feed.force / scene.bit.mass
        self.y = np.zeros(2 * self.n + 2)
        self.y[self.n : -2] = scene.start.bit_velocity
        self.mode, self.x_r, self.p_u = Mode.FF, 0.0, scene.start.rock_gap

    @property
    def rock(self) -> tuple[float, float, float]:
        """Stiffness, damping and place of no force."""
        c = self.c_r if self.mode in (Mode.DFC, Mode.SS) else 0.0
        if self.mode == Mode.FF:
            return 0.0, 0.0, 0.0
        if self.mode in (Mode.DFC, Mode.FC):
            return self.k_r, c, self.x_r
        return self.gamma * self.k_r, c, self.x_r + self.p_u

    def force(self, y: np.ndarray) -> Any:
        """Force on the rock [N] of states in the present mode."""
        k, c, x = self.rock
        return k * (y[self.n - 1] - x) + c * y[2 * self.n - 1]

    def slope(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return y'."""
        u, v, force = y[: self.n], y[self.n : -2], self.force(y)
        a = self.pull @ (u + self.eta * v) + self.push - force * self.inverse[:, -1]
        crushed = self.c_r * v[-1] * v[-1] if self.mode == Mode.DFC else 0.0
        return np.concatenate([v, a, [crushed, force * v[-1]]])

    def kinetic(self, y: np.ndarray) -> float:
        """Kinetic energy [J]."""
        v = y[self.n : -2]
        return 0.5 * float(v @ self.mass @ v)

    def events(self) -> dict[str, Any]:
        """Functions that are positive until their event, by what happens then."""
        end, place, velocity = self.x_r + self.p_u, self.n - 1, 2 * self.n - 1
        found: dict[str, Any] = {
            Mode.FF: {"touch": lambda t, y: end - y[place]},
            Mode.DFC: {
                "full": lambda t, y: self.w_r - y[-2],
                "turn": lambda t, y: y[velocity] + REST,
            },
            Mode.FC: {"turn": lambda t, y: y[velocity] + REST},
            Mode.BC: {
                "leave": lambda t, y: y[place] - end,
                "touch": lambda t, y: REST - y[velocity],
            },
            Mode.SS: {
                "move": lambda t, y: self.level - self.kinetic(y),
                "leave": lambda t, y: float(self.force(y)),
            },
        }[self.mode]
        for function in found.values():
            function.terminal, function.direction = True, -1.0
        return found

    def process(self, event: str) -> None:
        """Change the mode at an event."""
        y, p = self.y, float(self.y[self.n - 1]) - self.x_r
        if event == "full":
            self.mode = Mode.FC
        elif event == "leave":
            self.mode = Mode.FF
        elif event == "turn":
            self.p_u, self.mode = p * (self.gamma - 1.0) / self.gamma, Mode.BC
        elif event == "touch" and self.kinetic(y) <= self.level:
            self.mode = Mode.SS
        elif event == "move" and y[2 * self.n - 1] < -REST:
            self.mode = Mode.BC
        else:  # a drilling cycle begins, eq. 19
            self.x_r += p - (0.0 if self.mode == Mode.FF else self.gamma * (p - self.p_u))
            y[-2], self.mode = 0.0, Mode.DFC

    def step_off(self, t: float) -> None:
        """Advance a little by Heun's method, so that a second event here is not lost."""
        first = self.slope(t, self.y)
        second = self.slope(t, self.y + NUDGE * first)
        self.y = self.y + 0.5 * NUDGE * (first + second)
        for event, function in self.events().items():
            if function(t, self.y) < 0.0:
                self.process(event)
                return

    def run(self, end: float, times: np.ndarray, relative: float) -> np.ndarray:
        """Integrate to a time [s] with a relative tolerance; the force on the rock at times [N]."""
        absolute = relative * np.repeat(ABSOLUTE, (self.n, self.n, 1, 1))
        now, forces = 0.0, []
        while now < end:
            events = self.events()
            step = solve_ivp(
                self.slope, (now, end), self.y, "DOP853", dense_output=True,
                events=list(events.values()), rtol=relative, atol=absolute,
            )  # fmt: skip
            until = float(step.t[-1])
            here = times[(times >= now) & (times <= until)]
            if len(here):
                forces.append(self.force(step.sol(here)))
            if step.status == 0:
                self.y = step.y[:, -1]
                break
            event = next(k for k, hits in enumerate(step.t_events) if len(hits))
            self.y = step.y_events[event][-1].copy()
            self.process(list(events)[event])
            self.step_off(until)
            now = until + NUDGE
        return np.concatenate(forces)
