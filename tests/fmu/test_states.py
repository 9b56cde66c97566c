"""Saved states: whole, versioned, bound to their parameters, alike in every process."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from fmu_src.slave.states import HEADER, MAGIC

ROOT = Path(__file__).parents[2]
STEP = 1.9e-3
NAMES = ["PercussiveHammer", "RigidHammer", "NumbaRigidHammer"]
RIGID = NAMES[1:]


def go_on(instance, count, feed=None):
    """Step and return every output after every step."""
    rows = []
    for k in range(count):
        if feed is not None:
            instance.set({"feed_force": feed + 10.0 * (k % 3)})
        instance.step(STEP)
        rows.append(instance.values(instance.outputs))
    return np.array(rows, dtype=float)


@pytest.mark.parametrize("name", NAMES)
def test_a_restored_run_repeats_bit_for_bit(make, name):
    instance = make(name)
    rng = np.random.default_rng(11)
    for k in range(20):
        instance.step(float(rng.uniform(1e-6, 0.02)))
        if k % 2:  # an input that waits to be passed on belongs to the state
            instance.set({"feed_force": float(rng.uniform(1000.0, 4000.0))})
        time, saved = instance.time, instance.save()
        seen = instance.values(instance.outputs)
        first = go_on(instance, 12)
        instance.restore(saved, time)
        assert instance.values(instance.outputs) == seen
        np.testing.assert_array_equal(go_on(instance, 12), first)


@pytest.mark.parametrize("name", NAMES)
def test_a_state_that_never_was_bytes_repeats_too(make, name):
    instance, twin = make(name), make(name)
    go_on(instance, 15, feed=2600.0)
    go_on(twin, 4)
    time, state = instance.time, instance.slave.getFMUstate()
    seen = instance.values(instance.outputs)
    first = go_on(instance, 12)
    for one in (instance, twin, instance):
        one.slave.setFMUstate(state)
        one.time = time
        assert one.values(one.outputs) == seen
        np.testing.assert_array_equal(go_on(one, 12), first)
    instance.slave.freeFMUstate(state)


@pytest.mark.parametrize(("name", "of"), [(RIGID[0], RIGID[1]), (RIGID[1], RIGID[0]),
                                          (RIGID[0], "RockFilter")])  # fmt: skip
def test_a_state_of_another_fmu_of_the_process_is_refused(make, name, of):
    instance, other = make(name), make(of)
    state = other.slave.getFMUstate()
    with pytest.raises(FMICallException):
        instance.slave.setFMUstate(state)
    assert any("another FMU" in text for text in instance.messages)
    other.slave.freeFMUstate(state)


@pytest.mark.parametrize("name", NAMES)
def test_saving_and_reading_change_nothing(make, name):
    quiet, watched = make(name), make(name)
    for _ in range(40):
        quiet.step(STEP)
        watched.step(STEP)
        watched.save()
        watched.values(watched.outputs)
    assert quiet.values(quiet.outputs) == watched.values(watched.outputs)


REPEAT = """
import sys
import numpy as np
from pathlib import Path
from scenarios.harness import Instance
sys.path.insert(0, "tests/fmu")
from test_states import go_on

folder, states, out, when = sys.argv[1:]
found = []
for path in sorted(Path(states).glob("*.state")):
    instance = Instance(folder)
    if when == "initialised":
        instance.start()
    instance.restore(path.read_bytes(), float(path.stem))
    found.append(go_on(instance, 5))
    instance.free()
np.save(out, np.array(found))
"""


@pytest.mark.parametrize("when", ["initialised", "instantiated"])
@pytest.mark.parametrize("name", NAMES)
def test_a_new_process_goes_on_bit_for_bit_before_any_step(make, unpacked, tmp_path, name, when):
    instance = make(name)
    rng = np.random.default_rng(5)
    wanted = {}
    for _ in range(20):
        instance.step(float(rng.uniform(1e-6, 0.02)))
        key = f"{instance.time:.17f}"
        instance.time = float(key)
        (tmp_path / f"{key}.state").write_bytes(instance.save())
        time, saved = instance.time, instance.save()
        wanted[key] = go_on(instance, 5)
        instance.restore(saved, time)
    done = subprocess.run(
        [sys.executable, "-c", REPEAT, unpacked[name], str(tmp_path), str(tmp_path / "found.npy"),
         when],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = np.load(tmp_path / "found.npy")
    assert len(found) == 20
    for rows, key in zip(found, sorted(wanted), strict=True):
        np.testing.assert_array_equal(rows, wanted[key])


def test_a_state_brings_the_inputs_that_its_solver_was_made_with(make):
    """Leaps are made for the rock of the start; another start must not change a bit."""
    first = make("PercussiveHammer", rock__loading_stiffness=4e8)
    go_on(first, 10)
    time, saved = first.time, first.save()
    second = make("PercussiveHammer")
    second.restore(saved, time)
    np.testing.assert_array_equal(go_on(second, 30), go_on(first, 30))


@pytest.mark.parametrize("name", NAMES)
def test_a_state_does_not_grow(make, name):
    instance = make(name)
    sizes = []
    for _ in range(30):
        go_on(instance, 5)
        sizes.append(len(instance.save()))
    assert len(set(sizes)) == 1


def refused(instance, saved, message):
    with pytest.raises(FMICallException):
        instance.restore(saved, 0.0)
    assert any(message in text for text in instance.messages), instance.messages


@pytest.mark.parametrize("name", RIGID)
def test_a_state_of_other_parameters_is_refused(make, name):
    saved = make(name).save()
    refused(make(name, bit__model="rigid", loss__time=1e-7), saved, "other parameters")


@pytest.mark.parametrize("name", RIGID)
def test_a_state_of_another_version_is_refused(make, name):
    saved = bytearray(make(name).save())
    magic, version, *_ = HEADER.unpack_from(saved)
    assert magic == MAGIC
    saved[8] += 1
    refused(make(name), bytes(saved), f"version {version + 1}")


@pytest.mark.parametrize("name", RIGID)
@pytest.mark.parametrize("wrong", [b"", b"nonsense" * 20], ids=["empty", "nonsense"])
def test_what_is_no_state_is_refused(make, wrong, name):
    refused(make(name), wrong, "saved state")


@pytest.mark.parametrize("name", RIGID)
def test_a_state_that_is_cut_short_is_refused(make, name):
    refused(make(name), make(name).save()[:-8], "bytes where")
