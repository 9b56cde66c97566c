"""The engine for browsers gives in node what the package gives, bit for bit."""

from __future__ import annotations

import json
import math
import random
import shutil
import subprocess
from pathlib import Path
from subprocess import PIPE

import numpy as np
import pytest

from percussion_model import Scene, SceneError, Simulation
from percussion_model.analysis.stationary import settled
from percussion_model.engine import wasm
from percussion_model.engine.compiler import NoCompilerError
from percussion_model.engine.fault_texts import fault_text, faults
from percussion_model.engine.library import entries_of
from percussion_model.engine.records import ADVANCE, GaugeBar
from percussion_model.engine.scene_image import Own, image_of
from percussion_model.interface.commands.common import rock_changes
from percussion_model.physics.records import BLOW, EVENT, READING
from percussion_model.scene.bits import bit
from percussion_model.scene.hammers import hammer, hammers
from percussion_model.scene.numbers import numbers_of

DRIVER = Path(__file__).with_name("engine_in_node.mjs")
# Rocks by name, as `--rock` takes them for the bit of the hammer, another one if it is named.
NAMED = (("dth4", "kuru-granite", ""), ("dth6", "st-anne-limestone", "dth-152"))
# What random scenes have changed, between these shares of what they have.
DRAWN = (
    "feed.force", "drive.force", "drive.reversal_distance", "rock.loading_stiffness",
    "rock.unloading_ratio", "rock.barrier_energy", "gravity.acceleration", "start.piston_velocity",
)  # fmt: skip
LEAST, MOST = 0.6, 1.5


@pytest.fixture(scope="module")
def in_node(tmp_path_factory):
    """Function that does jobs in node; they are told in `engine_in_node.mjs`."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed, which runs WebAssembly")
    folder = tmp_path_factory.mktemp("site")
    try:
        wasm.write(folder)
    except NoCompilerError as error:
        pytest.skip(f"the engine for browsers is not there: {error}")

    command = [node, str(DRIVER), str(folder)]
    with subprocess.Popen(command, stdin=PIPE, stdout=PIPE, text=True) as process:

        def run(*jobs):
            process.stdin.write(json.dumps(jobs) + "\n")
            process.stdin.flush()
            return json.loads(process.stdout.readline())

        yield run


def words(rows):
    """Rows of a file of JSON as whole numbers of eight bytes."""
    return np.array(rows, object).astype(np.int64)


def bits(numbers):
    return np.array(numbers, np.float64).view(np.int64)


def rows_of(records):
    """Records as bits of numbers, as the driver has them."""
    return np.array([[float(one) for one in row] for row in records.tolist()]).view(np.int64)


def scene_of(preset="reference", rock="", bit_name="", **values):
    scene = hammer(preset) if preset in hammers() else Scene.from_toml(preset)
    if bit_name:
        scene = scene.replace(**bit(bit_name).parameters)
    return scene.replace(**rock_changes(rock or None, scene)).replace(**values)


def assert_same(found, simulation):
    assert found["time"] == simulation.time
    np.testing.assert_array_equal(words(found["blows"]), rows_of(simulation.blows))
    np.testing.assert_array_equal(words(found["events"]), rows_of(simulation.events))


def test_blows_of_the_reference_have_the_same_bits(in_node):
    (found,) = in_node({"work": "run", "preset": "reference", "until": 4.0})
    wanted = Simulation(scene_of(), record_events=True)
    wanted.advance(4.0)
    assert len(wanted.blows) == 87
    assert_same(found, wanted)


@pytest.mark.parametrize("solver", ["wave", "rigid"])
def test_other_solvers_and_inputs_that_change(in_node, solver):
    scene = Scene().computed_by(solver)
    values = {key: scene[key] for key in ("solver.name", "piston.model", "bit.model")}
    job = {"work": "run", "preset": "reference", "values": values, "count": 3, "until": 1.0}
    (found,) = in_node(job | {"set": {"feed.force": 4000.0}, "end": 0.4})
    wanted = Simulation(scene, record_events=True)
    wanted.advance_blows(3, 1.0)
    wanted.set_inputs(feed_force=4000.0)
    wanted.advance(0.4)
    assert_same(found, wanted)


def test_images_of_all_presets_and_hammers_on_rocks(in_node):
    from percussion_model.engine.web_table import scenes

    presets = scenes()
    named = [{"preset": one, "rock": rock, "bit": name} for one, rock, name in NAMED]
    jobs = [{"preset": one} for one in presets] + named
    wanted = [*presets.values(), *(scene_of(*one) for one in NAMED)]
    for image, scene in zip(
        in_node(*({"work": "image"} | job for job in jobs)), wanted, strict=True
    ):
        found, whole = words(image), image_of(numbers_of(scene))
        found[len(found) - len(Own) + Own.BARRIER_GIVEN] = 0  # that is for refusals alone
        np.testing.assert_array_equal(found, whole)


def test_hammers_on_rocks_by_name(in_node):
    jobs = [{"work": "run", "preset": a, "rock": b, "bit": c, "until": 0.3} for a, b, c in NAMED]
    for found, one in zip(in_node(*jobs), NAMED, strict=True):
        wanted = Simulation(scene_of(*one), record_events=True)
        wanted.advance(0.3)
        assert_same(found, wanted)


def test_random_settings(in_node):
    draw, jobs = random.Random(20), []
    for _ in range(20):
        preset = draw.choice(["reference", "chatter", "dth3", "dth5", "stiff_rock"])
        scene, keys = scene_of(preset), draw.sample(DRAWN, 4)
        values = {key: draw.uniform(LEAST, MOST) * scene[key] for key in keys}
        values["effects.rock"] = draw.choice(["bilinear", "bilinear", "power", "spring"])
        values["effects.barrier"] = draw.choice([True, False])
        jobs.append({"work": "run", "preset": preset, "values": values, "until": 0.25})
    texts = []
    for found, job in zip(in_node(*jobs), jobs, strict=True):
        try:
            wanted = Simulation(scene_of(job["preset"], **job["values"]), record_events=True)
        except SceneError as error:
            texts.append(str(error))
            assert found == texts[-1]
        else:
            wanted.advance(job["until"])
            assert_same(found, wanted)
    assert 0 < len(texts) < 10


def test_what_is_refused_is_told_in_the_same_words(in_node):
    cases = (
        {"feed.force": -1.0, "rock.buttons": 0, "drive.force": None},
        {"effects.rock": "clay", "rock.unloading_ratio": 1e-7},
        {"solver.cells": 100_000},
        {"solver.accuracy": 0.01, "solver.cells": 30},
        {"effects.breaking": True},
        {"run.settle": 5.0},
    )
    found = in_node(*({"work": "run", "preset": "reference", "values": one} for one in cases))
    for text, values in zip(found, cases, strict=True):
        with pytest.raises(SceneError) as refused:
            Simulation(scene_of(**values))
        assert text == str(refused.value)


def test_facts_are_written_as_python_does(in_node):
    numbers = [[0.0, 1.5e-7, 123456789.0, 1e16], [5.0, 0.1, 1e-5, 2.5e22], [3.0, 1e5, -0.03, 12.0]]
    texts = faults()
    jobs = [
        (k, [1.0] * 4 if "|" in texts[k] else one) for k in range(1, len(texts)) for one in numbers
    ]
    found = in_node(*({"work": "fault", "number": k, "facts": one} for k, one in jobs))
    assert found == [fault_text(*one) for one in jobs]


def stress_at(scene, place, t):
    """Stress at a gauge on the bit by the package's own engine [Pa]."""
    entries, image = entries_of(scene.solver_name), image_of(numbers_of(scene))
    base = entries.create(image.ctypes.data, int(GaugeBar.BIT), place, 0)
    simulation = Simulation(scene)
    moving = base + int(simulation.solver._motion.head["state_at"])
    blows, events, seen = np.zeros(64, BLOW), np.zeros(8, EVENT), np.zeros(1, READING)
    copy = simulation.solver.new_state()
    at = blows.ctypes.data, len(blows), events.ctypes.data, len(events), 0
    assert entries.run(base, moving, ADVANCE, t, *at) == 0
    entries.read(base, moving, copy.address, t, seen.ctypes.data, 0)
    # reading leaves waves alone
    found = entries.stress(base, moving if scene.solver_name == "wave" else copy.address)
    entries.free(base)
    return found


@pytest.mark.parametrize("preset", ["reference", "t38_rods"])
def test_samples_fields_and_stress(in_node, preset):
    times = np.concatenate([np.linspace(0.02, 0.1, 700), [0.1001]])
    gauge = {"bar": "bit", "place": 0.1}
    (found,) = in_node({"work": "see", "preset": preset, "times": times.tolist(), "gauge": gauge})
    scene = scene_of(preset)
    simulation = Simulation(scene)
    wanted = simulation.sample_rows(times)
    np.testing.assert_array_equal(words(found["sample"]).T, bits(wanted))
    solver, seen = simulation.solver, np.zeros(1, READING)
    state = solver.read(simulation.save().state, times[-1], seen, peaks=False)
    fields = solver.fields(state)
    assert len(fields) == 2 * len(found["fields"])
    for name, row in fields.items():
        bar, _, kind = name.rpartition("_")
        np.testing.assert_array_equal(words(found["fields"][bar][kind]), bits(row))
    assert int(found["stress"]) == int(bits([stress_at(scene, 0.1, times[-1])])[0])
    assert float(found["stress"]) != 0.0


SETTLING = (
    ("reference", {}, (1e-4, 400, 0.0)),
    ("aperiodic", {}, (1e-4, 400, 0.02)),
    ("dth4", {"rotation.stall_torque": 2000.0}, (1e-4, 400, 0.0)),
    ("reference", {"feed.force": 0.0, "drive.force": 10.0}, (1e-4, 400, 0.0)),
)
NAMES = {"rate": "rate_of_penetration", "error": "settling_error", "multiplier": "multiplier"}


def test_blows_settle_as_in_python(in_node):
    jobs = [{"preset": a, "values": b, "asked": c} for a, b, c in SETTLING]
    kinds = []
    for found, (preset, values, asked) in zip(
        in_node(*({"work": "settle"} | job for job in jobs)), SETTLING, strict=True
    ):
        tolerance, most, scatter = asked
        wanted = settled(scene_of(preset, **values), tolerance, most, scatter=scatter)
        kinds.append(found["kind"])
        assert (found["kind"], found["order"]) == (wanted.kind, wanted.order)
        assert (found["blows"], found["time"]) == (len(wanted.blows), wanted.duration)
        for name, own in NAMES.items():
            value, number = found[name], getattr(wanted, own)
            value = math.nan if value is None else value  # JSON has no such number
            assert value == pytest.approx(number, rel=1e-9, nan_ok=True)
    assert set(kinds) == {"periodic", "aperiodic", "stalled"}


def test_memory_is_given_back(in_node):
    job = {"work": "sizes", "preset": "reference", "values": {"solver.cells": 5}, "times": 200}
    (sizes,) = in_node(job)
    assert sizes[-1] == sizes[1]
