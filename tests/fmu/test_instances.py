"""Many instances, several FMUs, reset, memory: nothing of one is seen in another."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
MEGABYTE = 2**20
# Growth of the memory over the cycles that count [bytes].
MOST_GROWTH = 5 * MEGABYTE
CYCLES = 1000


@pytest.mark.parametrize(
    ("name", "count", "steps"), [("RigidHammer", 50, 40), ("PercussiveHammer", 50, 25)]
)
def test_interleaved_instances_equal_those_alone(make, name, count, steps):
    feeds = np.linspace(1000.0, 5000.0, count)
    several = [make(name, feed_force=feed) for feed in feeds]
    for _ in range(steps):
        for instance in several:
            instance.step(5e-3)
    together = [instance.values(instance.outputs) for instance in several]
    assert len({tuple(row) for row in together}) == count  # they do differ
    for feed, row in zip(feeds, together, strict=True):
        alone = make(name, feed_force=feed)
        for _ in range(steps):
            alone.step(5e-3)
        assert alone.values(alone.outputs) == row
        alone.free()


def test_different_fmus_live_in_one_process(make):
    names = ("RigidHammer", "PercussiveHammer", "RockFilter", "NumbaRigidHammer")
    several = [make(name) for name in names]
    several += [make(name) for name in names]
    for _ in range(20):
        for instance in several:
            instance.step(1e-3)
    outputs = several[0].outputs
    for k in (3, 4, 7):
        assert several[k].values(outputs) == several[0].values(outputs)
    assert several[1].get("contact.force_peak") >= 0.0
    peak = max(several[0].get("bit.impulse"), several[1].get("bit.impulse"))
    assert several[0].get("bit.impulse") != several[1].get("bit.impulse")
    assert peak > 0
    assert several[2].get("apparent_energy") == several[6].get("apparent_energy")


def test_no_module_is_left_under_a_common_name(make):
    make("RigidHammer")
    make("NumbaRigidHammer")
    make("RockFilter")
    prefixes = ("percussive_hammer_", "drilling_system_")
    bundled = [name for name in sys.modules if name.startswith(prefixes)]
    assert any(name.endswith("percussion_model.simulation.runner") for name in bundled)
    assert any(name.endswith(".pythonfmu") for name in bundled)
    assert not [path for path in sys.path if path.endswith("/resources")]


def test_reset_goes_back_to_just_after_instantiation(make):
    fresh, used = make(start=False), make(start=False)
    used.start(feed_force=4000.0, rock__loading_stiffness=1e9)
    for _ in range(30):
        used.step(1e-2)
    used.slave.reset()
    assert used.get("feed_force") == fresh.get("feed_force") == 2500.0
    for instance in (fresh, used):
        instance.start(gauge__position=0.05)
        for _ in range(30):
            instance.step(1e-2)
    assert used.values(used.outputs) == fresh.values(fresh.outputs)


def test_a_start_time_shifts_the_clock_alone(make):
    early = make(start=False).start()
    late = make(start=False).start(time=2.0)
    for _ in range(20):
        early.step(2.0**-7)
        late.step(2.0**-7)
    assert late.time == early.time + 2.0
    assert late.values(late.outputs) == early.values(early.outputs)


MEMORY = """
import json, resource, sys
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave

def memory():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize()

def make(k):
    slave = FMU2Slave(guid=model.guid, unzipDirectory=folder, instanceName=f"i{k}",
                      modelIdentifier=model.coSimulation.modelIdentifier)
    slave.instantiate()
    return slave

folder, cycles = sys.argv[1], int(sys.argv[2])
model = read_model_description(folder)
variables = {one.name: one.valueReference for one in model.modelVariables}
outputs = [one.valueReference for one in model.modelVariables
           if one.causality == "output" and one.type == "Real"]
held = make(-1)
seen = []
for k in range(cycles):
    slave = make(k)
    slave.setReal([variables["feed_force"]], [2000.0 + k])
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    for i in range(3):
        slave.doStep(0.01 * i, 0.01)
    slave.getReal(outputs)
    state = slave.getFMUstate()
    slave.serializeFMUstate(state)
    slave.freeFMUstate(state)
    slave.freeInstance()
    if k % 50 == 49:
        seen.append(memory())
print(json.dumps(seen))
"""


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads the memory from /proc")
@pytest.mark.parametrize("name", ["RigidHammer", "NumbaRigidHammer"])
def test_a_thousand_instances_come_and_go_within_five_megabytes(unpacked, name):
    done = subprocess.run(
        [sys.executable, "-c", MEMORY, unpacked[name], str(CYCLES)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    # the first fifty make what is made once
    assert seen[-1] - seen[0] < MOST_GROWTH, np.diff(seen)
