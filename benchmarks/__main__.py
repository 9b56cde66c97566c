"""Speed on one thread, compilation excluded: a table, and benchmarks/latest.json.

`python3 build.py bench` runs this with a fresh numba cache. `--quick` takes fewer
repetitions. Take figures for the record on an idle machine.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.fmu import fmu
from benchmarks.fmu import rows as fmu_rows

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
LATEST = HERE / "latest.json"
REFERENCE = ROOT / "scenarios" / "reference.toml"
RIGID = ROOT / "scenarios" / "rigid.toml"

# What linear algebra libraries and numba read when they are loaded.
ONE_THREAD = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)

# Simulated times of the reference scene with and without leaps.
LEAPING_DURATION, STEPPING_DURATION = 4.0, 2.0


def measure(scene: Any, duration: float) -> dict[str, Any]:
    """Run a scene once; `cost` is processor time [s] without compilation and set-up."""
    from percussion_model import Simulation

    simulation = Simulation(scene)
    began = time.process_time()
    simulation.advance(duration)
    return {"cost": time.process_time() - began, **simulation.statistics()}


def reference(repeats: int) -> list[dict[str, Any]]:
    """Real-time factor of the reference scene by modes, with and without leaps, and by waves."""
    from percussion_model import Scene, simulate

    rows = []
    for solver, cells in itertools.product(("modal", "wave"), (20, 40, 80)):
        for leaps in (True, False) if solver == "modal" and cells < 80 else (solver == "modal",):
            scene = Scene.from_toml(REFERENCE).computed_by(
                solver, **{"solver.cells": cells, "solver.leaps": leaps}
            )
            duration = LEAPING_DURATION if leaps else STEPPING_DURATION
            count = repeats if leaps else max(2, repeats // 3)
            results = [simulate(scene, duration) for _ in range(count)]
            factors = [result.real_time_factor for result in results]
            summary = results[0].summary()
            rows.append(
                {
                    "solver": solver,
                    "cells": cells,
                    "leaps": leaps,
                    "real_time_factor": statistics.median(factors),
                    "slowest": min(factors),
                    "fastest": max(factors),
                    "runs": len(factors),
                    "rate_of_penetration": summary["rate_of_penetration"],
                    "rate_of_penetration_error": summary["rate_of_penetration_error"],
                    "blow_period": summary["blow_period"],
                    "numerical_relative": summary["energy"]["numerical_relative"],
                    "steps": results[0].statistics["steps"],
                }
            )
    return rows


def rigid(repeats: int) -> dict[str, Any]:
    """Cost of a blow of the rigid option."""
    from percussion_model import Scene

    scene = Scene.from_toml(RIGID)
    runs = [measure(scene, 100.0) for _ in range(repeats)]
    return {
        "blow": statistics.median(run["cost"] / run["blows"] for run in runs),
        "blows": runs[0]["blows"],
        "events": runs[0]["events"],
    }


def elements(repeats: int) -> dict[str, Any]:
    """Real-time factor of the finite elements with the paper's numerics, and cost of a step."""
    from percussion_model import Scene

    scene = Scene.from_toml(REFERENCE).computed_by("fem")
    runs = [measure(scene, STEPPING_DURATION) for _ in range(repeats)]
    factor = statistics.median(STEPPING_DURATION / run["cost"] for run in runs)
    # noise only adds, so the least is the measure of a step
    step = min(run["cost"] / run["steps"] for run in runs)
    return {"real_time_factor": factor, "step": step}


def command_line(repeats: int) -> dict[str, Any]:
    """Time of a whole `percussion run` of a tenth of a second, once the cache is filled."""
    command = [
        *(sys.executable, "-c", "from percussion_model.interface.cli import main; main()"),
        *("run", str(REFERENCE), "--duration", "0.1", "--settle", "0", "--json", "-"),
    ]
    times = []
    for _ in range(repeats + 1):
        began = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - began)
    return {"first": times[0], "second": statistics.median(times[1:])}


def show(found: dict[str, Any]) -> None:
    """Print the figures as tables."""
    from rich.console import Console

    from percussion_model.interface.tables import airy_table, named_table, print_table
    from percussion_model.simulation.uncertain import rate_text

    console = Console()
    computer = found["machine"]
    console.print(
        f"{computer['processor']}, one thread; Python {computer['python']}, "
        f"numba {computer['numba']}; compiled in {found['compilation']:.0f} s"
    )
    if (computer["load_before"] or 0.0) > 0.5:
        console.print(f"[yellow]The machine was busy: load {computer['load_before']:.1f}.[/yellow]")

    headings = ("solver", "cells", "leaps", "times real time", "range", "rate mm/s", "period ms")
    title = "Reference scene: simulated time by time to compute"
    table = airy_table(headings, headings[:1], title=title, title_justify="left")
    for row in found["reference"]:
        table.add_row(
            row["solver"],
            f"{row['cells']}",
            "on" if row["leaps"] else "off",
            f"{row['real_time_factor']:.1f}",
            f"{row['slowest']:.0f}-{row['fastest']:.0f} ({row['runs']} runs)",
            rate_text(row),
            f"{1e3 * row['blow_period']:.4f}",
        )
    print_table(table)
    fem, start = found["elements"], found["command_line"]
    shown = f"{fem['real_time_factor']:.2f} times real time, {1e6 * fem['step']:.2f} µs a step"
    rows = [
        ("Rigid option, a blow", f"{1e6 * found['rigid']['blow']:.2f} µs"),
        ("Finite elements", shown),
        *fmu_rows(found["fmu"]),
        ("Command line, 0.1 s simulated: first start", f"{start['first']:.2f} s"),
        ("Command line, 0.1 s simulated: later starts", f"{start['second']:.2f} s"),
    ]
    print_table(named_table(rows))


def compiled_in() -> float:
    """Compile all solvers; the time it took [s]."""
    from percussion_model import Scene, Simulation

    began = time.perf_counter()
    for solver in ("wave", "fem", "rigid"):
        Simulation(Scene.from_toml(REFERENCE).computed_by(solver))
    return time.perf_counter() - began


def bench(quick: bool, say: Callable[[str], None]) -> dict[str, Any]:
    """Take all measurements."""
    from percussion_model.verification.accuracy.timing import machine

    computer = machine()
    computer["load_before"] = computer.pop("load")
    found: dict[str, Any] = {"date": computer.pop("date"), "machine": computer}
    say("compiling")
    found["compilation"] = compiled_in()
    for name, text, measured, repeats, fewer in (
        ("reference", "reference scene", reference, 9, 3),
        ("rigid", "rigid option", rigid, 7, 3),
        ("elements", "finite elements", elements, 7, 3),
        ("fmu", "FMU", fmu, 5, 1),
        ("command_line", "command line", command_line, 5, 1),
    ):
        say(text)
        found[name] = measured(fewer if quick else repeats)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(prog="build.py bench", description="Measure speed.")
    parser.add_argument("--quick", action="store_true", help="fewer repetitions")
    quick = parser.parse_args().quick
    with tempfile.TemporaryDirectory(prefix="percussion-numba-") as cache:
        # Both are read when numba is imported, which nothing has done yet.
        os.environ.setdefault("NUMBA_CACHE_DIR", cache)
        os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
        found = bench(quick, lambda text: print(f"{text} ...", file=sys.stderr, flush=True))
    LATEST.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    show(found)


if __name__ == "__main__":
    main()
