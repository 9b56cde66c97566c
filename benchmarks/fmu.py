"""Cost of the FMU in fmpy: instantiation, a communication step, and what is read after it."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

STEP = 1e-3  # of the communication [s]
COUNT = 2000
SHORT_STEP = 1e-6  # nearly all of its cost is beyond the physics [s]
A_FEW = ("rate_of_penetration", "bit.force_mean", "casing_force", "blow_count")

# In a process of its own, since that is what a host is: times of the first instance and
# of the next one, then of stepping.
HOST = """
import json, sys, time
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
path, step, count, short, few = sys.argv[1], *map(float, sys.argv[2:5]), sys.argv[5].split()
count = int(count)
folder = extract(path)
model = read_model_description(folder)

def make():
    began = time.perf_counter()
    slave = FMU2Slave(guid=model.guid, unzipDirectory=folder, instanceName="a",
                      modelIdentifier=model.coSimulation.modelIdentifier)
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    return slave, time.perf_counter() - began

def stepping(names, step, count):
    slave, _ = make()
    read = {"Real": slave.getReal, "Boolean": slave.getBoolean}
    kinds = {}
    for one in model.modelVariables:
        if one.name in names:
            kinds.setdefault(read.get(one.type, slave.getInteger), []).append(one.valueReference)
    began = time.process_time()
    for k in range(count):
        slave.doStep(k * step, step)
        for get, references in kinds.items():
            get(references)
    return time.process_time() - began

outputs = [one.name for one in model.modelVariables if one.causality == "output"]
first, again = make()[1], make()[1]
found = {"first": first, "again": again}
if count:
    stepping(outputs, step, 10)
    for name, names in (("none", []), ("few", few), ("all", outputs)):
        found[name] = min(stepping(names, step, count) for _ in range(3))
    found["short"] = min(stepping([], short, count) for _ in range(3)) / count
print(json.dumps(found))
"""


def fmu(repeats: int) -> dict[str, Any]:
    """Measure the FMU of the reference scene.

    Returns
    -------
    dict
        `cold`: first instance with kernels to compile; `warm`: the first in a process,
        kernels compiled; `again`: the next one [s]. `step`: cost of a doStep beyond the
        physics [s]. `none`, `few`, `all`: simulated time by time, with that many outputs
        read at each point; `physics`: the library alone, in one call.
    """
    from fmu_src.hammer.build import build_hammer
    from percussion_model import Scene, Simulation

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "PercussiveHammer.fmu"
        build_hammer(Scene(), path)
        cold = host(path, 0, folder)["first"]
        runs = [host(path, COUNT, folder) for _ in range(repeats)]
    simulation = Simulation(Scene())
    began = time.process_time()
    simulation.advance(COUNT * STEP)
    physics = time.process_time() - began
    least = {name: min(run[name] for run in runs) for name in ("none", "few", "all", "short")}
    return {
        "cold": cold,
        "warm": statistics.median(run["first"] for run in runs),
        "again": statistics.median(run["again"] for run in runs),
        "step": (least["none"] - physics) / COUNT,
        "short_step": least["short"],
        **{name: COUNT * STEP / least[name] for name in ("none", "few", "all")},
        "physics": COUNT * STEP / physics,
    }


def host(path: Path, count: int, cache: str) -> dict[str, float]:
    """Run a host in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", HOST, str(path), repr(STEP), str(count), repr(SHORT_STEP),
         " ".join(A_FEW)],
        check=True, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PERCUSSION_FMU_CACHE": cache},
    )  # fmt: skip
    found: dict[str, float] = json.loads(done.stdout)
    return found


def read_rows(of: str, found: dict[str, Any], digits: int) -> list[tuple[str, str]]:
    """Speed by what is read after each step, as lines of a table."""
    read = {"none": "no output", "few": f"{len(A_FEW)} outputs", "all": "all outputs"}
    return [
        (
            f"{of}: steps of 1 ms, {text} read at each",
            f"{found[name]:.{digits}f} × real time",
        )
        for name, text in read.items()
    ]


def rows(found: dict[str, Any]) -> list[tuple[str, str]]:
    """Figures as lines of a table."""
    return [
        ("FMU: first instance ever, kernels compiled", f"{found['cold']:.1f} s"),
        ("FMU: first instance in a process", f"{found['warm']:.2f} s"),
        ("FMU: next instance", f"{1e3 * found['again']:.1f} ms"),
        ("FMU: a doStep of 1 ms beyond the physics", f"{1e6 * found['step']:.1f} µs"),
        ("FMU: a doStep of 1 µs", f"{1e6 * found['short_step']:.1f} µs"),
        *read_rows("FMU", found, 1),
        ("The same in the library, one call", f"{found['physics']:.1f} × real time"),
    ]
