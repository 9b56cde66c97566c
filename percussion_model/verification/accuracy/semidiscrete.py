"""The equations of the finite elements as y' = f(t, y), for general integrators.

Mesh, mass, stiffness, penalty and rock law are those of `solver.name = "fem"`
(docs/numerics.md, eq. 8). Inertia is a dense matrix, inverted once.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from percussion_model.physics.records import Mode
from percussion_model.scene.numbers import section_numbers
from percussion_model.scene.scene import Scene
from percussion_model.solvers.fem.mesh import assemble, cut_bar
from percussion_model.solvers.fem.records import Mesh
from percussion_model.verification.accuracy.peer import refuse_uncarried

__all__ = ["Drill", "OutOfTime", "refuse_general"]

# Dead band of the velocity of the bit's end [m/s]; docs/model.md, section 6.
REST = 1e-9
# Events by what they change.
GAP, DRIVE, ROCK = "gap", "drive", "rock"

EventFunction = Callable[[float, np.ndarray], float]


class OutOfTime(Exception):
    """A method that takes too long."""


def refuse_general(scene: Scene) -> None:
    """Raise `SceneError` for a scene whose equations these are not."""
    refuse_uncarried("general integrators", scene, {"absent"})


class Drill:
    """The semi-discrete drill; y = (u, v, W, E): nodes, dashpot's work, energy into rock.

    Parameters
    ----------
    scene : Scene
        With elastic bars, bilinear rock with a barrier, and a pressure drive or none.

    Attributes
    ----------
    y : ndarray, shape (2 n + 2,)
        State; n nodes [m, m/s, J, J].
    mode : Mode
    closed : bool
        Whether piston and bit touch.
    alpha : int
        Direction of the drive.
    calls : int
        Evaluations of the slope.
    deadline : float
        Value of `time.process_time` at which a run gives up [s].
    """

    def __init__(self, scene: Scene) -> None:
        refuse_general(scene)
        self.scene, rock = scene, scene.rock
        first = scene.bit if scene.piston.model == "absent" else scene.piston
        element = first.length / scene.fem.elements
        bars = [cut_bar(section_numbers(scene.bit), element)]
        if scene.piston.model != "absent":
            bars.insert(0, cut_bar(section_numbers(scene.piston), element))
        mesh = assemble(bars)
        self.n_p, self.n = bars[0].n + 1 if len(bars) > 1 else 0, mesh.shape[1]
        off = mesh[Mesh.COUPLING, :-1]
        self.mass = np.diag(mesh[Mesh.MASS]) + np.diag(off, 1) + np.diag(off, -1)
        off = -mesh[Mesh.STIFFNESS, :-1]
        springs = np.diag(mesh[Mesh.SPRINGS]) + np.diag(off, 1) + np.diag(off, -1)
        self.inverse = np.linalg.inv(self.mass)
        self.pull = -self.inverse @ springs
        self.eta = scene.loss.time if scene.loss_on else 0.0
        self.share = mesh[Mesh.SHARE].copy()
        self.k_r, self.gamma = rock.loading_stiffness, rock.unloading_ratio
        self.c_r, self.w_r = rock.barrier_damping, rock.barrier_energy
        self.level = rock.barrier_threshold * self.w_r
        self.k_c = scene.fem.contact_stiffness
        self.weight = scene.gravity.acceleration if scene.effects.gravity else 0.0
        feed = scene.feed.force if scene.effects.feed else 0.0
        self.on_bit = self.weight + feed / scene.bit.mass
        self.push = 0.0
        if scene.effects.drive == "pressure":
            self.push = scene.drive.force / scene.piston.mass
        self.calls, self.deadline, self.reached = 0, np.inf, 0.0
        self._begin()

    def _begin(self) -> None:
        start, n, n_p = self.scene.start, self.n, self.n_p
        self.y = np.zeros(2 * n + 2)
        self.y[n + n_p : 2 * n] = start.bit_velocity
        self.y[:n_p] = -start.gap
        self.y[n : n + n_p] = start.piston_velocity if n_p else 0.0
        self.mode, self.closed, self.alpha = Mode.FF, False, int(start.drive_direction)
        self.x_r, self.p_u = 0.0, start.rock_gap

    @property
    def rock(self) -> tuple[float, float, float]:
        """Stiffness, damping and place of no force, table 1 of docs/model.md."""
        c = self.c_r if self.mode in (Mode.DFC, Mode.SS) else 0.0
        if self.mode == Mode.FF:
            return 0.0, 0.0, 0.0
        if self.mode in (Mode.DFC, Mode.FC):
            return self.k_r, c, self.x_r
        return self.gamma * self.k_r, c, self.x_r + self.p_u

    def bit_force(self, y: np.ndarray) -> np.ndarray:
        """Force on the rock [N] of states in the present mode, shape (2 n + 2, ...)."""
        k, c, x = self.rock
        return k * (y[self.n - 1] - x) + c * y[2 * self.n - 1]

    def slope(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return y'."""
        self.calls += 1
        self.reached = t
        if self.calls % 256 == 0 and time.process_time() > self.deadline:
            raise OutOfTime
        n, n_p = self.n, self.n_p
        u, v = y[:n], y[n : 2 * n]
        out = np.empty(2 * n + 2)
        out[:n] = v
        a = out[n : 2 * n]
        np.dot(self.pull, u + self.eta * v, out=a)
        a[:n_p] += self.weight + self.alpha * self.push
        a[n_p:] += self.on_bit
        if self.closed:
            push = -self.k_c * (u[n_p] - u[n_p - 1])
            a += push * (self.inverse[:, n_p] - self.inverse[:, n_p - 1])
        k, c, x = self.rock
        force = 0.0
        if k:
            force = k * (u[-1] - x) + c * v[-1]
            a -= force * self.inverse[:, -1]
        out[-2] = c * v[-1] * v[-1] if self.mode == Mode.DFC else 0.0
        out[-1] = force * v[-1]
        return out

    def jacobian(self, t: float, y: np.ndarray) -> np.ndarray:
        """Matrix of the derivatives of y' by y."""
        n, n_p = self.n, self.n_p
        out = np.zeros((2 * n + 2, 2 * n + 2))
        out[:n, n : 2 * n] = np.eye(n)
        by_u, by_v = out[n : 2 * n, :n], out[n : 2 * n, n : 2 * n]
        by_u[:] = self.pull
        by_v[:] = self.eta * self.pull
        if self.closed:
            ends = self.inverse[:, n_p] - self.inverse[:, n_p - 1]
            by_u[:, n_p] -= self.k_c * ends
            by_u[:, n_p - 1] += self.k_c * ends
        k, c, x = self.rock
        by_u[:, -1] -= k * self.inverse[:, -1]
        by_v[:, -1] -= c * self.inverse[:, -1]
        speed = y[2 * n - 1]
        if self.mode == Mode.DFC:
            out[-2, 2 * n - 1] = 2.0 * c * speed
        out[-1, n - 1] = k * speed
        out[-1, 2 * n - 1] = k * (y[n - 1] - x) + 2.0 * c * speed
        return out

    def mean(self, values: np.ndarray, bit: bool) -> float:
        """Mean of nodal values of a bar, by mass."""
        part = slice(self.n_p, None) if bit else slice(0, self.n_p)
        return float(self.share[part] @ values[part] / self.share[part].sum())

    def relative_displacement(self, y: np.ndarray) -> float:
        """Mean displacement of the piston relative to the bit, u_r [m]."""
        u = y[: self.n]
        return self.mean(u, False) - self.mean(u, True)

    def kinetic(self, y: np.ndarray) -> float:
        """Kinetic energy of the bit [J]."""
        v = y[self.n + self.n_p : 2 * self.n]
        return 0.5 * float(v @ self.mass[self.n_p :, self.n_p :] @ v)

    def event_functions(self) -> list[tuple[str, EventFunction]]:
        """Functions that are positive until their event, each with the name of the event."""
        n, n_p = self.n, self.n_p
        end = self.x_r + self.p_u
        found: list[tuple[str, EventFunction]] = []
        if n_p:
            sign = -1.0 if self.closed else 1.0
            found.append((GAP, lambda t, y: sign * (y[n_p] - y[n_p - 1])))
        if self.push:
            level = 0.0 if self.alpha > 0 else self.scene.drive.reversal_distance
            way = -float(self.alpha)
            found.append((DRIVE, lambda t, y: way * self.relative_displacement(y) + level))
        if self.mode == Mode.FF:
            found.append((ROCK, lambda t, y: end - y[n - 1]))
        elif self.mode == Mode.DFC:
            found.append((ROCK + " full", lambda t, y: self.w_r - y[-2]))
            found.append((ROCK, lambda t, y: y[2 * n - 1] + REST))
        elif self.mode == Mode.FC:
            found.append((ROCK, lambda t, y: y[2 * n - 1] + REST))
        elif self.mode == Mode.BC:
            found.append((ROCK + " free", lambda t, y: y[n - 1] - end))
            found.append((ROCK, lambda t, y: REST - y[2 * n - 1]))
        else:
            found.append((ROCK, lambda t, y: self.level - self.kinetic(y)))
            found.append((ROCK + " free", lambda t, y: float(self.bit_force(y))))
        for _, function in found:
            function.terminal, function.direction = True, -1.0  # type: ignore[attr-defined]
        return found

    def step_off(self, t: float, step: float) -> list[str]:
        """Advance a little by Heun's method, off the zero of an event just processed.

        Interpolants of multistep methods need not vanish where the state does; a
        second event at the same instant would be lost.

        Returns
        -------
        list of str
            Events of `event_functions` meanwhile; they have been processed.
        """
        first = self.slope(t, self.y)
        second = self.slope(t, self.y + step * first)
        self.y = self.y + 0.5 * step * (first + second)
        processed = []
        for what, function in self.event_functions():
            if function(t, self.y) < 0.0:
                self.process_event(what)
                processed.append(what)
                break
        return processed

    def process_event(self, what: str) -> None:
        """Process an event of `event_functions`: table 1 of docs/model.md."""
        y = self.y
        p = float(y[self.n - 1]) - self.x_r
        if what == GAP:
            self.closed = not self.closed
        elif what == DRIVE:
            self.alpha = -self.alpha
        elif what == ROCK + " full":
            self.mode = Mode.FC
        elif what == ROCK + " free":
            self.mode = Mode.FF
        elif self.mode in (Mode.DFC, Mode.FC):
            self.p_u, self.mode = p * (self.gamma - 1.0) / self.gamma, Mode.BC
        elif self.mode in (Mode.FF, Mode.BC) and self.kinetic(y) <= self.level:
            self.mode = Mode.SS
        elif self.mode == Mode.SS and y[2 * self.n - 1] < -REST:
            self.mode = Mode.BC
        else:
            self._cycle(p, 0.0 if self.mode == Mode.FF else self.gamma * (p - self.p_u))

    def _cycle(self, p: float, start: float) -> None:
        """Begin a drilling cycle, eq. 19 of docs/model.md."""
        self.x_r += p - start
        self.y[-2] = 0.0
        self.mode = Mode.DFC
