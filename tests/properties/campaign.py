"""Thousands of random scenes, in the background: `python -m tests.properties.campaign`.

One worker process runs the cases and this one watches it, so that neither a hang nor a
crash of the interpreter ends the campaign. The record is written again and again; the
same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import platform
import signal
import subprocess
import sys
import time
from collections import Counter
from importlib.metadata import version
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from percussion_model.scene.text import write_text

# Cases of some ten milliseconds; a hang is far beyond that, on however busy a machine [s].
PATIENCE = 100.0
# Loading the kernels may mean to compile them [s].
PATIENCE_AT_START = 1800.0
# Cases between two writings of the record.
CHUNK = 100
# Solvers that cases are computed by, each compiled at its first.
SOLVERS = ("wave", "modal", "fem", "rigid")
PACKAGES = ("numpy", "numba", "llvmlite", "scipy")


# How far the numbers of cases reach: bounds of WIDE, or all that the parameter table allows.
REACHES = {"wide": ("near", "wide", "wide", "wide"), "any": ("any",)}


def run_case(seed: int, index: int, reach: str = "wide") -> dict[str, Any]:
    """Draw and check one case; what went wrong stands under `fault`."""
    from percussion_model import SceneError, SimulationError
    from tests.properties.checks import check_case
    from tests.properties.scenes import draw_case
    from tests.properties.source import Generator

    try:
        case = draw_case(Generator(seed, index), REACHES[reach])
    except SceneError as error:
        return {"refused": str(error)}
    try:
        return check_case(case)
    except AssertionError as error:
        fault = str(error).strip()
    except SimulationError as error:
        fault = f"stopped: {error}"
    except Exception as error:  # anything else is a crash
        fault = f"{type(error).__name__}: {error}"
    return {"fault": fault[:500]} | story_of(seed, index, reach)


def story_of(seed: int, index: int, reach: str) -> dict[str, Any]:
    """What a case is, so that it can be found again by later versions."""
    from tests.properties.scenes import draw_case
    from tests.properties.source import Generator

    case = draw_case(Generator(seed, index), REACHES[reach])
    calls = [[share, what, argument] for share, what, argument in case.calls]
    story = {"reach": case.reach, "scene": case.scene.to_toml(), "length": case.length}
    return {"solver": case.scene.solver_name, **story, "calls": calls}


def work(pipe: Connection, seed: int, reach: str) -> None:
    """Run the cases that are asked for, until None is."""
    while (index := pipe.recv()) is not None:
        began = time.perf_counter()
        outcome = run_case(seed, index, reach)
        pipe.send(outcome | {"wall_time": time.perf_counter() - began})


class Worker:
    """A process that runs cases, replaced where one does not come back."""

    def __init__(self, seed: int, reach: str = "wide") -> None:
        self._seed, self._reach = seed, reach
        self._process: Any = None
        self._kinds: set[str] = set()

    def run(self, index: int) -> dict[str, Any]:
        """What the case gave; a hang and a crash are faults as well."""
        if self._process is None:
            self._start()
        self._pipe.send(index)
        patience = PATIENCE if len(self._kinds) == len(SOLVERS) else PATIENCE_AT_START
        try:
            if self._pipe.poll(patience):
                outcome = self._pipe.recv()
                self._kinds.add(outcome.get("solver", "wave"))
                return outcome
            fault = f"hang: more than {patience:.0f} s"
        except EOFError:
            fault = "crash: the process ended"
        self.stop()
        return {"fault": fault, "wall_time": patience} | story_of(self._seed, index, self._reach)

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=work, args=(theirs, self._seed, self._reach), daemon=True
        )
        self._process.start()
        theirs.close()
        self._kinds = set()

    def stop(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process = None


def new_record(seed: int, reach: str) -> dict[str, Any]:
    """A record of nothing yet."""
    return {
        "seed": seed,
        "reach": reach,
        "drawn": 0,
        "run": 0,
        "refused": 0,
        "solvers": {},
        "modes": {},
        "blows": 0,
        "events": 0,
        "locked_cases": 0,
        "greatest_residual": 0.0,
        "longest_case": 0.0,
        "wall_time": 0.0,
        "versions": {},
        "failures": {},
    }


def take(record: dict[str, Any], index: int, outcome: dict[str, Any]) -> None:
    """Add what a case gave to the record."""
    record["drawn"] = max(record["drawn"], index + 1)
    record["wall_time"] += outcome["wall_time"]
    if "refused" in outcome:
        record["refused"] += 1
        return
    record["run"] += 1
    record["longest_case"] = max(record["longest_case"], outcome["wall_time"])
    name = outcome["solver"]
    record["solvers"][name] = record["solvers"].get(name, 0) + 1
    if "fault" in outcome:
        record["failures"][str(index)] = outcome
        return
    record["modes"] = dict(Counter(record["modes"]) + Counter(outcome["modes"]))
    record["blows"] += outcome["blows"]
    record["events"] += outcome["events"]
    record["locked_cases"] += bool(outcome["locked"])
    record["greatest_residual"] = max(record["greatest_residual"], outcome["residual"])


def versions() -> dict[str, str]:
    """What the cases ran with."""
    found = {name: version(name) for name in PACKAGES} | {"python": platform.python_version()}
    asked = subprocess.run(
        ["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=False
    )
    return found | {"commit": asked.stdout.strip()}


def campaign(
    count: int, seed: int, path: Path | None, reach: str = "wide", report: Any = None
) -> dict[str, Any]:
    """Run cases until `count` of them were run, with those in the record at `path`.

    Returns
    -------
    dict
        The record.
    """
    record = new_record(seed, reach)
    if path is not None and path.exists():
        record = json.loads(path.read_text(encoding="utf-8"))
        if (record["seed"], record["reach"]) != (seed, reach):
            kind = f"seed {record['seed']} and reach {record['reach']}"
            raise SystemExit(f"{path} is the record of {kind}: give another file")
    record["versions"] = versions()
    worker = Worker(seed, reach)
    try:
        while record["run"] < count:
            take(record, record["drawn"], worker.run(record["drawn"]))
            if record["run"] % CHUNK == 0 or record["run"] >= count:
                save(record, path)
                (report or print)(tell(record, count), flush=True)
    finally:
        worker.stop()
        save(record, path)
    return record


def again(path: Path) -> dict[str, Any]:
    """Run the failed cases of a record once more, after a repair, and update it."""
    record = json.loads(path.read_text(encoding="utf-8"))
    worker = Worker(record["seed"], record["reach"])
    mended = record.setdefault("mended", {})
    for key in list(record["failures"]):
        outcome = worker.run(int(key))
        before = record["failures"].pop(key)
        if "fault" in outcome:
            record["failures"][key] = outcome
        else:
            mended[key] = before["fault"]
        print(key, outcome.get("fault", "mended"))
    worker.stop()
    record["versions_of_repair"] = versions()
    save(record, path)
    return record


def save(record: dict[str, Any], path: Path | None) -> None:
    """Write the record in one go."""
    if path is not None:
        write_text(path, json.dumps(record, indent=1, allow_nan=True) + "\n")


def tell(record: dict[str, Any], count: int) -> str:
    """One line of progress."""
    return (
        f"{record['run']} of {count} run, {record['refused']} refused, "
        f"{len(record['failures'])} failed, {record['wall_time']:.0f} s"
    )


def table(record: dict[str, Any]) -> str:
    """A record as the table of docs/data/stability_record.md."""
    count = {name: f"{number:,}" for name, number in sorted(record["solvers"].items())}
    rows = {
        "seed; reach": f"{record['seed']}; {record['reach']}",
        "scenes run": f"{record['run']:,}",
        "of which": ", ".join(f"{name} {number}" for name, number in count.items()),
        "refused as contradictions": record["refused"],
        "failed": len(record["failures"]),
        "blows; events": f"{record['blows']:,}; {record['events']:,}",
        "samples in each mode": ", ".join(f"{k} {n:,}" for k, n in record["modes"].items()),
        "greatest residual": f"{record['greatest_residual']:.1e}",
        "longest case; all, s": f"{record['longest_case']:.1f}; {record['wall_time']:.0f}",
        "with": ", ".join(f"{name} {text}" for name, text in record["versions"].items()),
    }
    return "\n".join(["| | |", "|---|---|", *(f"| {name} | {rows[name]} |" for name in rows)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20_000, help="scenes to run in all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--reach", choices=REACHES, default="wide", help="how far numbers reach")
    parser.add_argument("--record", type=Path, help="JSON file; default campaign_SEED.json")
    parser.add_argument("--again", action="store_true", help="run the failed ones again")
    parser.add_argument("--table", action="store_true", help="show a record as a table")
    parser.add_argument("--case", type=int, help="run this one case here, and show what it gives")
    options = parser.parse_args()
    # a request to end ends the worker as well
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    path = options.record or Path(f"campaign_{options.seed}.json")
    if options.case is not None:
        print(json.dumps(run_case(options.seed, options.case, options.reach), indent=1))
        return
    if options.table:
        print(table(json.loads(path.read_text(encoding="utf-8"))))
        return
    record = again(path) if options.again else None
    record = record or campaign(options.count, options.seed, path, options.reach)
    for index, outcome in record["failures"].items():
        print(index, outcome["solver"], outcome["fault"].splitlines()[0])


if __name__ == "__main__":
    main()
