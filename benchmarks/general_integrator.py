"""One blow of the reference drill by scipy's solve_ivp, on the equations of the finite elements.

    python -m benchmarks.general_integrator            # every method, a table
    python -m benchmarks.general_integrator RK45 LSODA

Same mesh, mass, stiffness, penalty and rock law as `solver.name = "fem"` with the paper's
numerics; the events are scipy's, and each of them starts the integrator anew. A method that
takes longer than its time is stopped. `percussion accuracy` has error against time.
"""

from __future__ import annotations

import argparse
import time

from percussion_model import Scene, Simulation
from percussion_model.verification.accuracy.integrators import INTEGRATORS, integrate
from percussion_model.verification.accuracy.semidiscrete import Drill, OutOfTime

BLOW = 0.0456  # from the first impact until just before the next [s]
RELATIVE = 1e-4
PATIENCE = 120.0  # [s]


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
    parser.add_argument("methods", nargs="*", default=INTEGRATORS, help=", ".join(INTEGRATORS))
    methods = parser.parse_args().methods
    scene = Scene().replace(**{"solver.name": "fem"})
    cost, position, events = by_elements(scene)
    print("| method | time, s | by fem | mean bit position, mm | events | evaluations |")
    print("|---|---|---|---|---|---|")
    print(f"| fem | {cost:.4f} | 1 | {1e3 * position:.4f} | {events} | |", flush=True)
    for method in methods:
        drill = Drill(scene)
        try:
            found = integrate(drill, method, RELATIVE, BLOW, patience=PATIENCE)
        except (OutOfTime, RuntimeError, ValueError) as error:
            far = f"{type(error).__name__} at {1e3 * drill.reached:.2f} ms"
            print(f"| {method} | - | - | {far} | | |", flush=True)
            continue
        here = drill.mean(drill.y[: drill.n], True)
        print(
            f"| {method} | {found.cost:.1f} | {found.cost / cost:.0f} | {1e3 * here:.4f} "
            f"| {found.events} | {found.calls} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
