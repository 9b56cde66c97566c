"""Time of a coupled run, by part and call: `python -m benchmarks.coupling [SYSTEM.ssp ...]`.

Each system of the drilling loop runs at 1 kHz, its rows thinned. For each part the processor
time of setting its inputs, of its step and of reading its outputs is taken, in a run of its
own whose calls Python makes: a clock around each call costs more than the cheaper ones.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from percussion_model.coupling import CoupledRun, Coupling
from percussion_model.simulation import markdown

ROOT = Path(__file__).resolve().parents[1]
STEP = 1e-3  # [s]
ROWS_EVERY = 1.0  # [s]
DURATION, CLOCKED = 20.0, 5.0  # simulated [s]
SYSTEMS = ("FeedControl", "FeedControlRigid")
HOUR = 3600.0  # [s]
# An hour drills some 70 m: one kind of rock with a variation.
LONG_HOLE = {
    "rock.layers[1].loading_stiffness": 7.5e8,
    "rock.layers[2].top": 20.0, "rock.layers[2].loading_stiffness": 1.2e9,
    "rock.layers[3].top": 35.0, "rock.layers[3].loading_stiffness": 5e8,
    "rock.variation.spread": 0.06,
}  # fmt: skip
CALLS = ("write", "step", "read")
# What the machine does beside a step is not in the least of so many runs.
RUNS, STEPS = 9, 2000


class Clocked(Coupling):
    """A system whose calls are timed: `spent` is processor time [s] by part and call."""

    def _initialise(self) -> None:
        super()._initialise()
        self.spent: dict[tuple[str, str], float] = {}
        for port in self.ports:
            for call in CALLS:
                self.spent[port.name, call] = 0.0
                setattr(port, call, self._clocked(getattr(port, call), (port.name, call)))

    def _clocked(self, call: Callable[..., Any], key: tuple[str, str]) -> Callable[..., Any]:
        spent, clock = self.spent, time.process_time

        def clocked(*arguments: Any) -> Any:
            began = clock()
            found = call(*arguments)
            spent[key] += clock() - began
            return found

        return clocked


def measure(
    system: Path,
    duration: float,
    parameters: dict[str, Any],
    progress: Callable[[float], None] | None = None,
) -> CoupledRun:
    """Run a system with its rows thinned."""
    return Coupling(system, parameters).run(duration, STEP, interval=ROWS_EVERY, progress=progress)


def minutes() -> Callable[[float], None]:
    """Return a progress callback that prints each simulated minute."""
    began, used = time.perf_counter(), time.process_time()

    def report(at: float) -> None:
        if at % 60.0 < 0.5 * ROWS_EVERY:
            wall, cost = time.perf_counter() - began, time.process_time() - used
            print(f"{at:6.0f} s in {wall:.0f} s ({cost:.0f} s of the processor)", file=sys.stderr)

    return report


def by_part(system: Path, parameters: dict[str, Any]) -> dict[tuple[str, str], float]:
    """Processor time of a step [s], by part and call."""
    coupling = Clocked(system, parameters, compiled=False)
    run = coupling.run(CLOCKED, STEP, interval=ROWS_EVERY)
    return {key: spent / run.steps for key, spent in coupling.spent.items()}


class Watched(Coupling):
    """A system whose steps are timed one by one: `spent` is time of the thread [s]."""

    def _stepping(self, count: int, step: float, control: Any) -> Callable[[int, int], int]:
        go = super()._stepping(count, step, control)
        self.spent, clock = np.zeros((2, count)), time.thread_time

        def one(done: int, until: int) -> int:
            began = clock()
            go(done, done + 1)
            ended = clock()
            go(done, done + 1)  # nothing but the call
            self.spent[:, done] = ended - began, clock() - ended
            return done + 1

        return one


def dearest(system: Path) -> str:
    """One line on the dearest step of a system: the least time of each step in some runs."""
    least = np.full(STEPS, np.inf)
    for _ in range(RUNS):
        coupling = Watched(system)
        coupling.run(STEPS * STEP, STEP, interval=ROWS_EVERY)
        taken, nothing = coupling.spent
        least = np.minimum(least, taken - np.median(nothing))
    mean, most, at = 1e6 * least.mean(), 1e6 * least.max(), int(least.argmax())
    return (
        f"{system.stem}: {mean:.1f} us a step, the dearest is number {at + 1}: {most:.1f} us, "
        f"{most / mean:.1f} times as much"
    )


def table(spent: dict[tuple[str, str], float]) -> str:
    """Markdown: microseconds a step."""
    parts = list(dict.fromkeys(part for part, _ in spent))
    rows = [(part, [1e6 * spent[part, call] for call in CALLS]) for part in parts]
    rows.append(("together", [sum(values) for values in zip(*(r for _, r in rows), strict=True)]))
    lines = [[part, *(f"{one:.1f}" for one in (*values, sum(values)))] for part, values in rows]
    return markdown.table(("part", "set inputs", "step", "read outputs", "all"), lines)


def line(system: Path, run: CoupledRun) -> str:
    """One line on the cost of a run."""
    simulated, cost = run.steps * run.step, run.processor_time
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    return (
        f"{system.stem}: {simulated:g} s in {run.wall_time:.1f} s ({cost:.1f} s of the processor), "
        f"{simulated / run.wall_time:.2f} ({simulated / cost:.2f}) times real time, "
        f"{1e6 * cost / run.steps:.1f} us a step; load {load:.1f}; "
        f"depth {run['hammer.bit.position'][-1]:.4f} m {run.error}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.coupling", description=__doc__)
    parser.add_argument("systems", nargs="*", type=Path, help="archives; left out: those of dist")
    parser.add_argument("--duration", type=float, default=DURATION, help="simulated time [s]")
    parser.add_argument("--hour", action="store_true", help="one hour of one system alone")
    parser.add_argument("--dearest", action="store_true", help="the dearest step of each alone")
    choice = parser.parse_args()
    dist = [ROOT / "dist" / f"{name}.ssp" for name in SYSTEMS]
    if choice.hour:
        system = choice.systems[0] if choice.systems else dist[0]
        print(line(system, measure(system, HOUR, LONG_HOLE, minutes())))
        return
    for system in choice.systems or dist:
        if choice.dearest:
            print(dearest(system), flush=True)
            continue
        print(line(system, measure(system, choice.duration, LONG_HOLE)), flush=True)
        print(table(by_part(system, LONG_HOLE)), flush=True)


if __name__ == "__main__":
    main()
