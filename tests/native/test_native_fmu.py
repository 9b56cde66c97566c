"""The FMUs that need no Python: the same bits as the package, whatever hosts set or ask for."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

from fmu_src.hammer.motion import Motion
from fmu_src.hammer.outputs import OUTPUTS
from fmu_src.native.compare import fmu_outputs, package_outputs
from percussion_model import Scene

VERSIONS = ("2.0", "3.0")
STEP = 2.0**-10
# Scenes that the modal solver computes, one a kind of motion.
SCENES = {
    "reference": {},
    "finer": {"solver.cells": 56},
    "spring": {"effects.rock": "spring", "effects.barrier": False},
    "bit alone": {"piston.model": "absent", "effects.drive": "none", "start.bit_velocity": 5.0},
    "rigid piston": {"piston.model": "rigid", "solver.name": "modal"},
    "no feed, gravity up": {"effects.feed": False, "gravity.acceleration": -9.81},
    "sections": {
        "piston.sections": [
            {"length": 0.2, "area": 5e-3},
            {"length": 0.1, "area": 3e-3, "youngs_modulus": 1.1e11, "density": 4500.0},
        ],
        "bit.sections": [{"length": 0.15, "area": 4e-3}, {"length": 0.2, "area": 6e-3}],
    },
}


def same(there, here):
    """Names of outputs that differ in any bit."""
    return [name for k, name in enumerate(OUTPUTS) if not np.array_equal(there[:, k], here[:, k])]


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", SCENES)
def test_outputs_are_those_of_the_package_to_the_last_bit(write, name, version):
    scene = Scene().replace(**SCENES[name])
    there, here = fmu_outputs(write(scene, version)), package_outputs(scene)
    assert same(there, here) == []
    assert len(there) == 256
    if "bit alone" not in name:
        assert there[-1, list(OUTPUTS).index("blow_count")] >= 3


@pytest.mark.parametrize("version", VERSIONS)
def test_what_a_host_sets_is_what_another_scene_would_have(write, version):
    """Sections, rock, loss, modes: set before the start, on an FMU that bakes the reference."""
    changes = {
        "rock.loading_stiffness": 4e8, "rock.unloading_ratio": 8.0, "loss.time": 1.7e-7,
        "solver.cells": 24, "feed.force": 3300.0, "drive.reversal_distance": 0.02,
        "gravity.acceleration": 3.7, "start.gap": 0.004, "effects.barrier": False,
        "piston.sections.0.length": 0.31, "bit.sections.0.area": 4.7e-3,
        "bit.sections.0.density": 7600.0,
    }  # fmt: skip
    outside = {"feed.force": "feed_force"}
    start = {}
    for key, value in changes.items():
        name = outside.get(key, key)
        parts = key.split(".")
        if "sections" in key:
            name = f"{parts[0]}.sections[1].{parts[3]}"
            if version == "3.0":
                name, value = f"{parts[0]}.sections.{parts[3]}", [value]
        start[name] = value
    found = simulate_fmu(
        write(Scene(), version), stop_time=256 * STEP, step_size=STEP, output_interval=STEP,
        output=list(OUTPUTS), start_values=start,
    )  # fmt: skip
    there = np.array([[float(row[name]) for name in OUTPUTS] for row in found[1:]])
    assert same(there, package_outputs(Scene().replace(**changes))) == []


def test_inputs_that_change_give_the_bits_of_the_package(write):
    """Feed, rock and pressure change between the steps."""
    scene = Scene()
    times = np.arange(257) * STEP
    feed = 2500.0 + 500.0 * np.sin(40.0 * times)
    rock = np.where(times < 0.1, 7.5e8, 4e8)
    signals = np.array(
        list(zip(times, feed, rock, strict=True)),
        dtype=[("time", "f8"), ("feed_force", "f8"), ("rock.loading_stiffness", "f8")],
    )
    found = simulate_fmu(
        write(scene, "2.0"), stop_time=256 * STEP, step_size=STEP, output_interval=STEP,
        output=list(OUTPUTS), input=signals,
    )  # fmt: skip
    there = np.array([[float(row[name]) for name in OUTPUTS] for row in found[1:]])
    motion = Motion(scene.replace(**{"feed.force": float(feed[0])}), None)
    reads = [one.read for one in OUTPUTS.values()]
    here, acting = [], (feed[0], rock[0])
    for k in range(256):
        changed = {}
        if feed[k] != acting[0]:
            changed["feed_force"] = float(feed[k])
        if rock[k] != acting[1]:
            changed["loading_stiffness"] = float(rock[k])
        acting = (feed[k], rock[k])
        motion.advance_to((k + 1) * STEP, STEP, changed)
        here.append([float(read(motion)) for read in reads])
    names = same(there, np.array(here))
    assert names in ([], ["gauge_stress"])  # the motion here carries no gauge


@pytest.mark.parametrize("version", VERSIONS)
def test_hosts_find_nothing_wrong(write, version):
    path = write(Scene(), version)
    assert validate_fmu(str(path)) == []
    description = read_model_description(str(path))
    assert description.coSimulation.needsExecutionTool is False


@pytest.fixture
def slave(write, tmp_path):
    """An instance of the reference, of FMI 2.0."""
    path = write(Scene(), "2.0")
    description = read_model_description(str(path))
    folder = extract(str(path), str(tmp_path / "unpacked"))
    one = FMU2Slave(
        guid=description.guid, unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier, instanceName="hammer",
    )  # fmt: skip
    one.instantiate()
    one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    one.exitInitializationMode()
    references = {v.name: v.valueReference for v in description.modelVariables}
    yield one, references
    one.terminate()
    one.freeInstance()


def test_a_restored_state_goes_on_as_the_first_time(slave):
    """Also from bytes, and whatever was read in between."""
    one, references = slave
    wanted = [references[name] for name in ("hole_depth", "bit.force_mean", "bit.force_peak")]

    def go(first, count):
        rows = []
        for k in range(first, first + count):
            one.doStep(k * STEP, STEP)
            rows.append(one.getReal(wanted))
        return rows

    go(0, 70)
    state = one.getFMUState()
    saved = one.serializeFMUState(state)
    ahead = go(70, 90)
    one.setFMUState(state)
    assert go(70, 90) == ahead
    other = one.deserializeFMUState(saved)
    one.setFMUState(other)
    assert go(70, 90) == ahead
    for each in (state, other):
        one.freeFMUState(each)


def test_damaged_states_are_refused(slave):
    """Every hundredth byte of a state is turned over: none is taken, and the instance goes on."""
    one, _ = slave
    one.doStep(0.0, STEP)
    saved = one.serializeFMUState(one.getFMUState())
    for place in range(0, len(saved), 100):
        damaged = bytearray(saved)
        damaged[place] ^= 0xFF
        with pytest.raises(Exception, match="failed"):
            one.setFMUState(one.deserializeFMUState(bytes(damaged)))
    one.doStep(STEP, STEP)


def test_a_process_without_python_runs_it(write, tmp_path):
    """A host in C: the process maps no Python, and its blows are those of the package."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None or sys.platform != "linux":
        pytest.skip("no C compiler, or no Linux")
    scene = Scene()
    path = write(scene, "2.0")
    description = read_model_description(str(path))
    folder = Path(extract(str(path), str(tmp_path / "unpacked")))
    references = {v.name: v.valueReference for v in description.modelVariables}
    library = next((folder / "binaries").rglob("*.so"))
    program = tmp_path / "host"
    source = Path(__file__).with_name("plain_host.c")
    subprocess.run([compiler, "-O1", str(source), "-o", str(program), "-ldl"], check=True)
    done = subprocess.run(
        [program, library, description.guid, (folder / "resources").as_uri(),
         str(references["hole_depth"]), "256"],
        capture_output=True, text=True, check=True, env={},
    )  # fmt: skip
    depth = package_outputs(scene)[:, list(OUTPUTS).index("hole_depth")]
    lines = done.stdout.split()
    assert lines[0] == "no-python"
    np.testing.assert_array_equal([float.fromhex(line) for line in lines[1:]], depth)
