"""Other co-simulation hosts load and step the FMUs and find what fmpy finds."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import pytest

STEP, COUNT = 1e-3, 200
FEED = 3000.0

# ecospy's library wants tbb, which the wheel of that name brings along.
ECOS = """
import ctypes, json, sys
from pathlib import Path
for library in sorted(Path(sys.prefix, "lib").glob("libtbb.so.*")):
    ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
    break
from ecospy import EcosSimulation, EcosSimulationStructure
with EcosSimulationStructure() as structure:
    structure.add_model("hammer", sys.argv[1])
    structure.add_parameter_set("start", {"hammer::feed_force": float(sys.argv[4])})
    with EcosSimulation(float(sys.argv[2]), structure=structure) as simulation:
        simulation.init(parameter_set="start")
        simulation.step(int(sys.argv[3]))
        real = [simulation.get_real(f"hammer::{name}") for name in sys.argv[5].split()]
        print("FOUND", json.dumps([*real, simulation.get_integer("hammer::blow_count")]))
        simulation.terminate()
"""

COSIM = """
import json, sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
execution = CosimExecution.from_step_size(step_size=round(float(sys.argv[2]) * 1e9))
slave = CosimLocalSlave(fmu_path=sys.argv[1], instance_name="hammer")
index = execution.add_local_slave(local_slave=slave)
observer = CosimObserver.create_last_value()
execution.add_observer(observer=observer)
found = {one.name.decode(): one.reference for one in execution.slave_variables(slave_index=index)}
execution.real_initial_value(index, found["feed_force"], float(sys.argv[4]))
execution.step(step_count=int(sys.argv[3]))
names = sys.argv[5].split()
real = observer.last_real_values(index, [found[name] for name in names])
whole = observer.last_integer_values(index, [found["blow_count"]])
print("FOUND", json.dumps([*real, *whole]))
"""

NAMES = ("blow_time", "blow_position", "impact_velocity", "bit.impulse", "piston.position")


@pytest.mark.parametrize(
    ("package", "script"), [("ecospy", ECOS), ("libcosimpy", COSIM)], ids=["ecospy", "libcosimpy"]
)
def test_another_host_finds_the_same(make, rigid, package, script):
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"{package} is not installed (the extra `hosts` has it on Linux, x86-64)")
    if package == "ecospy" and not list(Path(sys.prefix, "lib").glob("libtbb.so.*")):
        pytest.skip("ecospy needs libtbb.so, which the package tbb brings along")
    done = subprocess.run(
        [sys.executable, "-c", script, str(rigid), repr(STEP), str(COUNT), repr(FEED),
         " ".join(NAMES)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    # hosts print lines of their own
    (said,) = [line for line in done.stdout.splitlines() if line.startswith("FOUND")]
    found = json.loads(said.removeprefix("FOUND"))
    instance = make("RigidHammer", feed_force=FEED)
    for k in range(COUNT):
        instance.time = k * STEP
        instance.step(STEP)
    *real, count = instance.values([*NAMES, "blow_count"])
    assert found[-1] == count == 4
    # the time of the last blow to the last bit; where the hosts' clocks differ, by rounding
    assert found[:3] == real[:3]
    assert found[3:-1] == pytest.approx(real[3:], rel=1e-9)
