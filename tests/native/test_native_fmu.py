"""The FMUs that need no Python: the same bits as the package, whatever hosts set or ask for."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

from fmu_src.archive import ROOT
from fmu_src.hammer.motion import Gauge, Motion
from fmu_src.hammer.outputs import OUTPUTS
from fmu_src.hammer.variables import gauge_bars
from fmu_src.native.build import fmu_outputs, package_outputs
from percussion_model import Scene
from percussion_model.scene.numbers import section_numbers
from percussion_model.solvers.cells import find_cell

VERSIONS = ("2.0", "3.0")
STEP = 2.0**-10
RODS = [
    {"sections": [{"length": 0.4, "area": 3e-3}], "joint": "lossy", "transmission": 0.9},
    {"sections": [{"length": 0.3, "area": 4e-3}], "joint": "threaded", "preload": 2e4},
]
POWER = {
    "effects.rock": "power", "rock.loading_exponent": 1.5, "rock.unloading_exponent": 0.5,
    "rock.buttons": 2, "effects.cuttings": True,
}  # fmt: skip
# One scene for each kind of motion, and for each solver.
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
    "waves": {"solver.name": "wave", "solver.cells": 23},
    "waves in whole steps": {"solver.name": "wave", "solver.cells": 20},
    "waves and a rigid piston": {"piston.model": "rigid"},
    "wall": {"effects.rock": "wall", "effects.barrier": False},
    "no loss": {"effects.loss": False},
    "waves in a bit alone": {
        "solver.name": "wave", "piston.model": "absent", "effects.drive": "none",
        "start.bit_velocity": 5.0,
    },
    "elements": {"solver.name": "fem", "fem.elements": 12},
    "elements and a rigid piston": {
        "solver.name": "fem", "fem.elements": 12, "piston.model": "rigid",
    },
    "rigid bodies": {"piston.model": "rigid", "bit.model": "rigid"},
    "as rigid bodies": {"solver.fidelity": "rigid"},
    "string": {"string.rods": RODS, "effects.string": True, "effects.joints": True},
    "string without joints": {
        "string.rods": RODS, "effects.string": True, "effects.joints": False, "effects.loss": False,
    },
    "power law": {**POWER, "rock.chipping_force": 5e4, "rock.chipping_penetration": 1e-4},
    "power law in elements": {**POWER, "solver.name": "fem", "fem.elements": 12},
    "power law of rigid bodies": {**POWER, "piston.model": "rigid", "bit.model": "rigid"},
    "power law and a string": {**POWER, "string.rods": RODS, "effects.string": True},
    "cuttings": {"effects.cuttings": True},
    "air": {"effects.drive": "pneumatic", "solver.name": "modal"},
    "damper": {"effects.damper": True, "string.rods": RODS[:1], "effects.string": True},
}  # fmt: skip


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


def test_the_blow_map_is_retired(write, capfd):
    said = told(write(Scene(), "2.0"), capfd, **{"solver.fidelity": 3})
    assert 'solver.fidelity = 3: must be one of "wave", "rigid"; the blow map is retired' in said


def told(path, capfd, **start_values):
    """What an FMU logs of a run that fails."""
    capfd.readouterr()
    with pytest.raises(Exception, match="failed"):
        simulate_fmu(path, stop_time=256 * STEP, step_size=STEP, start_values=start_values)
    return capfd.readouterr().out


@pytest.mark.parametrize("solver", ["wave", "fem"])
def test_a_host_may_choose_the_solver(write, solver):
    scene = Scene().replace(**{"solver.name": solver, "fem.elements": 12})
    choices = list(scene.row_of("solver.name").choices)
    found = simulate_fmu(
        write(Scene(), "2.0"), stop_time=256 * STEP, step_size=STEP, output_interval=STEP,
        output=list(OUTPUTS),
        start_values={"solver.name": 1 + choices.index(solver), "fem.elements": 12},
    )  # fmt: skip
    there = np.array([[float(row[name]) for name in OUTPUTS] for row in found[1:]])
    assert same(there, package_outputs(scene)) == []


@pytest.mark.parametrize("bar", ["piston", "bit", "rod 1", "rod 2"])
def test_the_gauge_reads_any_bar(write, bar):
    scene = Scene().replace(**SCENES["string"])
    motion = Motion(scene, None)
    sections = section_numbers(scene.bars[bar])
    place = 0.3 * scene.bars[bar].length
    motion.gauge = Gauge(bar, *find_cell(sections, motion.solver.grid_of(bar).mass, place))
    here = []
    for k in range(1, 65):
        motion.advance_to(k * STEP, STEP, {})
        here.append(motion.stress())
    found = simulate_fmu(
        write(scene, "2.0"), stop_time=64 * STEP, step_size=STEP, output_interval=STEP,
        output=["gauge_stress"],
        start_values={"gauge.bar": 1 + gauge_bars(scene).index(bar), "gauge.position": place},
    )  # fmt: skip
    assert np.ptp(here) > 1e6
    np.testing.assert_array_equal(found["gauge_stress"][1:], here)


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


# Inputs by their names outside.
INSIDE = {
    "feed_force": "feed_force",
    "rock.loading_stiffness": "loading_stiffness",
    "drive.reversal_distance": "reversal_distance",
    "supply_pressure": "drive_force",
}
# One scene for each solver.
SOLVERS = {
    "modal": {}, "wave": SCENES["waves"], "fem": SCENES["elements"],
    "rigid": SCENES["rigid bodies"], "string": SCENES["string"],
}  # fmt: skip


@pytest.mark.parametrize("name", SOLVERS)
def test_inputs_that_change_give_the_bits_of_the_package(write, name):
    """Feed, rock, reversal and pressure change between the steps."""
    scene = Scene().replace(**SOLVERS[name])
    assert scene.solver_name == {"string": "wave"}.get(name, name)
    path = write(scene, "2.0")
    times = np.arange(257) * STEP
    (pressure,) = (
        one.start for one in read_model_description(str(path)).modelVariables
        if one.name == "supply_pressure"
    )  # fmt: skip
    area = scene.drive.force / float(pressure)
    late = times >= 0.1
    given = {
        "feed_force": 2500.0 + 300.0 * np.sin(40.0 * times),
        "rock.loading_stiffness": np.where(late, 7e8, 7.5e8),
        "drive.reversal_distance": np.where(late, 1.05, 1.0) * scene.drive.reversal_distance,
        "supply_pressure": np.where(late, 0.97, 1.0) * float(pressure),
    }
    signals = np.array(
        list(zip(times, *given.values(), strict=True)),
        dtype=[("time", "f8"), *((key, "f8") for key in given)],
    )
    found = simulate_fmu(
        path, stop_time=256 * STEP, step_size=STEP, output_interval=STEP,
        output=list(OUTPUTS), input=signals,
    )  # fmt: skip
    there = np.array([[float(row[name]) for name in OUTPUTS] for row in found[1:]])
    motion = Motion(scene, None)
    reads = [one.read for one in OUTPUTS.values()]
    here, acting = [], {key: values[0] for key, values in given.items()}
    for k in range(256):
        changed = {}
        for key, values in given.items():
            if values[k] != acting[key]:
                acting[key] = values[k]
                factor = area if key == "supply_pressure" else 1.0
                changed[INSIDE[key]] = float(values[k]) * factor
        motion.advance_to((k + 1) * STEP, STEP, changed)
        here.append([float(read(motion)) for read in reads])
    names = same(there, np.array(here))
    assert names in ([], ["gauge_stress"])  # the motion here carries no gauge


def test_the_library_names_no_place_of_the_machine_that_made_it(library):
    """So that it has the same bytes wherever it is built."""
    for made in library.values():
        for place in (ROOT, Path(numba.__file__).parent):
            assert os.fsencode(place) not in made


@pytest.mark.parametrize("version", VERSIONS)
def test_hosts_find_nothing_wrong(write, version):
    path = write(Scene(), version)
    assert validate_fmu(str(path)) == []
    description = read_model_description(str(path))
    assert description.coSimulation.needsExecutionTool is False


@pytest.fixture(params=SOLVERS)
def slave(write, tmp_path, request):
    """An instance of FMI 2.0, for each solver."""
    path = write(Scene().replace(**SOLVERS[request.param]), "2.0")
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
    """Also from bytes, whatever was read in between, and with inputs that change."""
    one, references = slave
    wanted = [references[name] for name in ("hole_depth", "bit.force_mean", "bit.force_peak")]
    feed = [references["feed_force"]]

    def go(first, count):
        rows = []
        for k in range(first, first + count):
            one.setReal(feed, [2500.0 + k % 7])
            one.doStep(k * STEP, STEP)
            rows.append(one.getReal(wanted))
        return rows

    go(0, 70)
    state = one.getFMUState()
    saved = one.serializeFMUState(state)
    ahead = go(70, 90)
    assert ahead[-1][0] > ahead[0][0]
    one.setFMUState(state)
    assert go(70, 90) == ahead
    other = one.deserializeFMUState(saved)
    one.setFMUState(other)
    assert go(70, 90) == ahead
    for each in (state, other):
        one.freeFMUState(each)


def test_damaged_states_are_refused(slave):
    """A hundred bytes of a state are turned over: none is taken, and the instance goes on."""
    one, _ = slave
    one.doStep(0.0, STEP)
    saved = one.serializeFMUState(one.getFMUState())
    for place in range(0, len(saved), max(1, len(saved) // 100)):
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
