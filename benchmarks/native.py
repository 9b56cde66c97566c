"""Cost of the native FMU: steps of 10 kHz from C, by processor time, and steps of 1 ms in fmpy.

`python3 -m benchmarks.native [runs]` prints a table. The time of a step is also the least of
several identical runs, which leaves out what interrupts the process.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.fmu import COUNT, STEP, host, read_rows

HOST = Path(__file__).with_name("native_steps.c")


def native(runs: int) -> dict[str, Any]:
    """Measure the native FMU of the reference scene (FMI 2.0).

    Parameters
    ----------
    runs : int
        Runs of 10 s at 10 kHz.

    Returns
    -------
    dict
        `empty`, `empty_read`: a step in which nothing happens, without and with a reading of
        all Real outputs [ns]; `step_first`, `step_least`: median, 99.9 % and greatest time of
        a step [ns] in the first run, and of the least over the runs; `step_worst`: ends of the
        costliest steps [s] and their least times [ns]; `read_...`: the same with all Real outputs
        read; `none`, `few`, `all`: simulated time by time in fmpy.
    """
    from fmpy import extract, read_model_description

    from fmu_src.hammer.build import about_hammer
    from fmu_src.native.archive import write_native_fmu
    from fmu_src.native.library import libraries, this_platform
    from fmu_src.native.tables import model_tables
    from percussion_model import Scene

    scene = Scene()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "PercussiveHammer.fmu"
        write_native_fmu(
            path, "2.0", about_hammer(scene, path), scene, libraries([this_platform()]),
            lambda guid: model_tables(scene, guid),
        )  # fmt: skip
        model = read_model_description(str(path))
        unpacked = Path(extract(str(path), str(Path(folder) / "unpacked")))
        program = Path(folder) / "steps"
        compiler = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))))
        subprocess.run([compiler, "-O2", str(HOST), "-o", str(program), "-ldl"], check=True)
        outputs = [
            str(one.valueReference) for one in model.modelVariables
            if one.causality == "output" and one.type == "Real"
        ]  # fmt: skip
        done = subprocess.run(
            [program, next((unpacked / "binaries").rglob("*.so")), model.guid,
             (unpacked / "resources").as_uri(), str(runs), *outputs],
            check=True, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        found: dict[str, Any] = json.loads(done.stdout)
        times = [host(path, COUNT, folder) for _ in range(3)]
    for name in ("none", "few", "all"):
        found[name] = COUNT * STEP / min(one[name] for one in times)
    return found


def rows(found: dict[str, Any]) -> list[tuple[str, str]]:
    """Figures as lines of a table."""

    def spread(name: str) -> str:
        middle, most, worst = (1e-3 * one for one in found[name])
        return f"{middle:.2f} µs, 99.9 % below {most:.1f} µs, at most {worst:.1f} µs"

    def dear(name: str) -> str:
        return ", ".join(f"{1e-3 * took:.1f} µs to {end:.4f} s" for end, took in found[name])

    return [
        ("C: a doStep in which nothing happens", f"{found['empty']:.0f} ns"),
        ("C: the same, and all Real outputs read", f"{found['empty_read']:.0f} ns"),
        ("C: doSteps of 0.1 ms, first run", spread("step_first")),
        ("C: the same, least of the runs", spread("step_least")),
        ("C: the dearest of these", dear("step_worst")),
        ("C: with all Real outputs read, first run", spread("read_first")),
        ("C: the same, least of the runs", spread("read_least")),
        ("C: the dearest of these", dear("read_worst")),
        *read_rows("fmpy", found, 0),
    ]


if __name__ == "__main__":
    table = rows(native(int(sys.argv[1]) if len(sys.argv) > 1 else 5))
    width = max(len(name) for name, _ in table)
    for name, value in table:
        print(f"{name:<{width}}  {value}")
