"""One blow of the reference drill by scipy's solve_ivp, on the equations of the finite elements.

    python -m benchmarks.general_integrator            # every method, a table
    python -m benchmarks.general_integrator RK45 LSODA

Same mesh, mass, stiffness, penalty and rock law as `solver.name = "fem"` with the paper's
numerics; the events are scipy's, and each of them starts the integrator anew. Inertia is a dense
matrix, inverted once. A method that takes longer than its time is stopped.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from percussion_model import Mode, Scene, Simulation
from percussion_model.core.fem_records import Mesh
from percussion_model.solvers.mesh import assemble, cut_bar

METHODS = ("RK45", "RK23", "DOP853", "LSODA", "Radau", "BDF")
BLOW = 0.0456  # from the first impact until just before the next [s]
RELATIVE = 1e-4
# Absolute tolerances of displacement [m], velocity [m/s] and work [J].
ABSOLUTE = (1e-9, 1e-3, 1e-6)
PATIENCE = 120.0  # [s]
REST = 1e-9  # dead band of the velocity [m/s]


class OutOfTime(Exception):
    """A method that takes too long."""


class Drill:
    """The semi-discrete drill as y' = f(t, y), with y = (u, v, W)."""

    def __init__(self, scene: Scene) -> None:
        self.scene, rock = scene, scene.rock
        element = scene.piston.length / scene.fem.elements
        bars = [cut_bar(bar, element) for bar in (scene.piston, scene.bit)]
        mesh = assemble(bars)
        self.n_p, self.n = bars[0].n + 1, mesh.shape[1]
        off = mesh[Mesh.COUPLING, :-1]
        self.mass = np.diag(mesh[Mesh.MASS]) + np.diag(off, 1) + np.diag(off, -1)
        off = -mesh[Mesh.STIFFNESS, :-1]
        bars_only = np.diag(mesh[Mesh.SPRINGS]) + np.diag(off, 1) + np.diag(off, -1)
        self.inverse = np.linalg.inv(self.mass)
        self.pull = -self.inverse @ bars_only
        self.eta = scene.loss.time
        self.share = mesh[Mesh.SHARE].copy()
        self.k_r, self.gamma = rock.loading_stiffness, rock.unloading_ratio
        self.c_r, self.w_r = rock.barrier_damping, rock.barrier_energy
        self.k_c = scene.fem.contact_stiffness
        self.y = np.zeros(2 * self.n + 1)
        self.y[: self.n_p] = -scene.start.gap
        self.y[self.n : self.n + self.n_p] = scene.start.piston_velocity
        self.mode, self.closed, self.alpha = Mode.FF, False, 1
        self.x_r, self.p_u = 0.0, scene.start.rock_gap
        self.calls, self.deadline, self.reached = 0, np.inf, 0.0

    @property
    def rock(self) -> tuple[float, float, float]:
        """Stiffness, damping and place of no force, table 1 of docs/model.md."""
        c = self.c_r if self.mode in (Mode.DFC, Mode.SS) else 0.0
        if self.mode == Mode.FF:
            return 0.0, 0.0, 0.0
        if self.mode in (Mode.DFC, Mode.FC):
            return self.k_r, c, self.x_r
        return self.gamma * self.k_r, c, self.x_r + self.p_u

    def slope(self, t: float, y: np.ndarray) -> np.ndarray:
        self.calls += 1
        self.reached = t
        if self.calls % 256 == 0 and time.perf_counter() > self.deadline:
            raise OutOfTime
        n, n_p, scene = self.n, self.n_p, self.scene
        u, v = y[:n], y[n:-1]
        a = self.pull @ (u + self.eta * v)
        a[:n_p] += scene.gravity.acceleration + self.alpha * scene.drive.force / scene.piston.mass
        a[n_p:] += scene.gravity.acceleration + scene.feed.force / scene.bit.mass
        if self.closed:
            push = -self.k_c * (u[n_p] - u[n_p - 1])
            a += push * (self.inverse[:, n_p] - self.inverse[:, n_p - 1])
        k, c, x = self.rock
        if k:
            a -= (k * (u[-1] - x) + c * v[-1]) * self.inverse[:, -1]
        power = c * v[-1] * v[-1] if self.mode == Mode.DFC else 0.0
        return np.concatenate([v, a, [power]])

    def jacobian(self, t: float, y: np.ndarray) -> np.ndarray:
        n, n_p = self.n, self.n_p
        out = np.zeros((2 * n + 1, 2 * n + 1))
        out[:n, n:-1] = np.eye(n)
        by_u, by_v = out[n:-1, :n], out[n:-1, n:-1]
        by_u[:] = self.pull
        by_v[:] = self.eta * self.pull
        if self.closed:
            ends = self.inverse[:, n_p] - self.inverse[:, n_p - 1]
            by_u[:, n_p] -= self.k_c * ends
            by_u[:, n_p - 1] += self.k_c * ends
        k, c, _ = self.rock
        by_u[:, -1] -= k * self.inverse[:, -1]
        by_v[:, -1] -= c * self.inverse[:, -1]
        if self.mode == Mode.DFC:
            out[-1, 2 * n - 1] = 2.0 * c * y[2 * n - 1]
        return out

    def mean(self, values: np.ndarray, bit: bool) -> float:
        part = slice(self.n_p, None) if bit else slice(0, self.n_p)
        return float(self.share[part] @ values[part] / self.share[part].sum())

    def kinetic(self, y: np.ndarray) -> float:
        v = y[self.n + self.n_p : -1]
        return 0.5 * float(v @ self.mass[self.n_p :, self.n_p :] @ v)

    def watch(self) -> list[Callable[[float, np.ndarray], float]]:
        """Functions that are positive until their event."""
        n, n_p, sign = self.n, self.n_p, -1.0 if self.closed else 1.0
        looks = [lambda t, y: sign * (y[n_p] - y[n_p - 1])]
        level = 0.0 if self.alpha > 0 else self.scene.drive.reversal_distance
        way = -float(self.alpha)
        looks.append(lambda t, y: way * (self.mean(y[:n], False) - self.mean(y[:n], True)) + level)
        end = self.x_r + self.p_u
        if self.mode == Mode.FF:
            looks.append(lambda t, y: end - y[n - 1])
        elif self.mode == Mode.DFC:
            looks += [lambda t, y: self.w_r - y[-1], lambda t, y: y[-2] + REST]
        elif self.mode == Mode.FC:
            looks.append(lambda t, y: y[-2] + REST)
        elif self.mode == Mode.BC:
            looks += [lambda t, y: y[n - 1] - end, lambda t, y: REST - y[-2]]
        else:
            k, c, x = self.rock
            looks.append(lambda t, y: self.w_r - self.kinetic(y))
            looks.append(lambda t, y: k * (y[n - 1] - x) + c * y[-2])
        for look in looks:
            look.terminal, look.direction = True, -1.0  # type: ignore[attr-defined]
        return looks

    def change(self, which: int) -> None:
        """Make the change of the event `which` of `watch`."""
        y = self.y
        p = y[self.n - 1] - self.x_r
        if which == 0:
            self.closed = not self.closed
        elif which == 1:
            self.alpha = -self.alpha
        elif self.mode == Mode.FF:
            self.cycle(p, 0.0) if self.kinetic(y) > self.w_r else self.stand()
        elif self.mode == Mode.DFC and which == 2:
            self.mode = Mode.FC
        elif self.mode in (Mode.DFC, Mode.FC):
            self.p_u, self.mode = p * (self.gamma - 1.0) / self.gamma, Mode.BC
        elif which == 2 if self.mode == Mode.BC else which == 3:
            self.mode = Mode.FF
        elif self.mode == Mode.BC and self.kinetic(y) <= self.w_r:
            self.stand()
        elif self.mode == Mode.SS and y[-2] < -REST:
            self.mode = Mode.BC
        else:
            self.cycle(p, self.gamma * (p - self.p_u))

    def stand(self) -> None:
        self.mode = Mode.SS

    def cycle(self, p: float, start: float) -> None:
        self.x_r += p - start
        self.y[-1] = 0.0
        self.mode = Mode.DFC

    def run(self, method: str, end: float) -> int:
        """Integrate to `end`; the number of events."""
        t, events = 0.0, 0
        tolerances = np.repeat(ABSOLUTE, (self.n, self.n, 1))
        options: dict[str, Any] = {"rtol": RELATIVE, "atol": tolerances}
        if method in ("Radau", "BDF", "LSODA"):
            options["jac"] = self.jacobian
        self.deadline = time.perf_counter() + PATIENCE
        while t < end:
            watched = self.watch()
            found = solve_ivp(self.slope, (t, end), self.y, method, events=watched, **options)
            t, self.y = float(found.t[-1]), found.y[:, -1].copy()
            if found.status < 0:
                raise RuntimeError(found.message)
            if found.status == 1:
                hits = [k for k, times in enumerate(found.t_events) if len(times)]
                self.change(hits[0])
                events += 1
        return events


def by_elements(scene: Scene) -> tuple[float, float, int]:
    """Time that the package takes for the blow [s], bit position [m], and events."""
    runs = []
    for _ in range(5):
        simulation = Simulation(scene)
        began = time.process_time()
        simulation.advance(BLOW)
        runs.append(time.process_time() - began)
    seen = simulation.observe()
    return min(runs), seen["bit_position"], simulation.statistics()["events"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("methods", nargs="*", default=METHODS, help=", ".join(METHODS))
    scene = Scene().replace(**{"solver.name": "fem"})
    cost, position, events = by_elements(scene)
    print("| method | time, s | by fem | mean bit position, mm | events | evaluations |")
    print("|---|---|---|---|---|---|")
    print(f"| fem | {cost:.4f} | 1 | {1e3 * position:.4f} | {events} | |", flush=True)
    for method in parser.parse_args().methods:
        drill = Drill(scene)
        began = time.process_time()
        try:
            count = drill.run(method, BLOW)
        except OutOfTime:
            spent = time.process_time() - began
            far = f"stopped at {1e3 * drill.reached:.2f} ms"
            print(
                f"| {method} | over {spent:.0f} | over {spent / cost:.0f} | {far} | | |", flush=True
            )
            continue
        spent = time.process_time() - began
        here = drill.mean(drill.y[: drill.n], True)
        print(
            f"| {method} | {spent:.1f} | {spent / cost:.0f} | {1e3 * here:.4f} | {count} "
            f"| {drill.calls} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
