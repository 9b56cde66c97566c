"""A user's controller as an FMU: equal to the callable, with parameters, states, clear faults."""

from __future__ import annotations

import json
import textwrap

import numpy as np
import pytest
from conftest import plan_of
from fmpy import read_model_description

from fmu_src.command_line import app
from fmu_src.parts.build import build_controller
from fmu_src.parts.controller import TABLE
from fmu_src.parts.own_controller import NAME, SOURCE, OwnController
from fmu_src.system.archive import write_with_controller
from percussion_model.coupling import Coupling
from percussion_model.coupling.component import CouplingError
from percussion_model.interface.cli import BAD_INPUT, _guarded

PI = """
GAIN = 0.5


class PI:
    def __init__(self, gain=GAIN, time=0.2, order=1, on=True):
        self.gain, self.time, self.sum, self.past = gain, time, 0.0, [0.0, 0.0]

    def __call__(self, inputs, time, step):
        error = inputs["feed_setpoint"] - inputs["feed_force"]
        self.sum += error * step
        self.past = [self.past[1], time]
        force = -800.0 + self.gain * (error + self.sum / self.time) + 10.0 * (time > 0.05)
        return {"force_command": force, "pressure_command": 2e6, "percussion_on": True}


def held(inputs, time, step):
    return {"force_command": -800, "pressure_command": 2e6, "percussion_on": 1}


def make():
    total = 0.0

    def control(inputs, time, step):
        nonlocal total
        total += step
        return held(inputs, time, step) | {"force_command": total}

    return control
"""


@pytest.fixture
def written(tmp_path):
    """Writes the FMU of a name of a file: its path, and why it cannot save."""
    file = tmp_path / "my.py"
    file.write_text(PI, encoding="utf-8")

    def write(name, text=None):
        if text is not None:
            file.write_text(textwrap.dedent(text), encoding="utf-8")
        path = tmp_path / f"{name}.fmu"
        return path, build_controller(file, name, path)

    return write


def run(system, given, **options):
    return Coupling(system, replaced={"controller": given}, **options).run(0.15, step=1e-3)


def callable_of(name):
    space = {}
    exec(PI, space)
    return space[name]


@pytest.mark.parametrize("name", ["PI", "held", "make"])
def test_a_run_with_the_fmu_is_one_with_the_callable(name, feed_control, written):
    path, _ = written(name)
    ours, theirs = run(feed_control, path), run(feed_control, callable_of(name))
    assert not ours.error
    for signal in ("controller.force_command", "hammer.bit.position", "string.feed_force_mean"):
        np.testing.assert_array_equal(ours[signal], theirs[signal])


def test_numbers_that_a_class_can_be_given_are_parameters(feed_control, written):
    path, _ = written("PI")
    found = {one.name: one for one in read_model_description(str(path)).modelVariables}
    own = {name: one for name, one in found.items() if one.causality == "parameter"}
    assert {name: (one.type, one.start) for name, one in own.items()} == {
        "gain": ("Real", "0.5"), "time": ("Real", "0.2"),
        "order": ("Integer", "1"), "on": ("Boolean", "true"),
    }  # fmt: skip
    slow = run(feed_control, path, parameters={"controller.gain": 0.1})
    given = callable_of("PI")
    np.testing.assert_array_equal(
        slow["hammer.bit.position"], run(feed_control, lambda: given(0.1))["hammer.bit.position"]
    )


def test_steps_are_taken_back_where_the_state_is_known_and_refused_where_not(feed_control, written):
    path, kept = written("PI")
    assert kept == ""
    again = Coupling(feed_control, replaced={"controller": path}).run(0.05, 1e-3, tolerance=1e-2)
    assert not again.error
    assert again.rejected > 0
    path, kept = written("make")
    assert kept == "values of the function around it"
    assert not read_model_description(str(path)).coSimulation.canGetAndSetFMUstate
    with pytest.raises(CouplingError, match="state"):
        Coupling(feed_control, replaced={"controller": path}).run(0.05, 1e-3, tolerance=1e-2)


def test_a_state_has_what_the_file_and_the_object_keep(tmp_path):
    file = tmp_path / "my.py"
    file.write_text(
        PI + "\ncount = 0\n\n\ndef counting(inputs, time, step):\n    global count\n"
        "    count += 1\n    return held(inputs, time, step) | {'force_command': count}\n"
    )
    for name, at in (("PI", {"gain": 0.5, "time": 0.2}), ("counting", {})):
        made = [OwnController({**at, SOURCE: file, NAME: name}) for _ in range(2)]
        inputs = {one: entry[3] for one, entry in TABLE.inputs.items()} | {"feed_force": 2000.0}
        for _ in range(3):
            made[0].step(inputs, 1e-3)
        kept = json.loads(json.dumps(made[0].save()))
        made[1].restore(kept)  # of its own file, run anew
        later = [(one.step(inputs, 1e-3), one.outputs())[1] for one in made]
        assert later[0] == later[1]
        made[0].restore(kept)
        made[0].step(inputs, 1e-3)
        assert made[0].outputs() == later[0]
        assert made[0].outputs()["force_command"] != kept["sent"]["force_command"]


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("def PI(inputs, time, step, past=[]):\n    {}", "attributes or defaults of a function"),
        ("def PI(inputs, time, step):\n    {}\n\nPI.past = 0",
         "attributes or defaults of a function"),
        ("import random\nnoise = random.Random(1)\n\ndef PI(inputs, time, step):\n    {}",
         "noise, of type Random"),
        ("import math\nGAIN = 0.5\n\ndef PI(inputs, time, step):\n    {}", ""),
    ],
)  # fmt: skip
def test_what_no_state_can_hold_is_named(text, kept, written):
    send = "return {'force_command': 0, 'pressure_command': 2e6, 'percussion_on': True}"
    assert written("PI", text.format(send))[1] == kept


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("class PI:\n    pass", "cannot be called with inputs, time and step"),
        ("PI = 3", "has no function or class PI"),
        ("raise SystemExit(3)", "the controller ends the program: SystemExit.3."),
        ("def PI(inputs, time, step):\n    raise SystemExit", "controller: SystemExit"),
        ("def PI(inputs, time, step):\n    return {'force_command': float('nan'), "
         "'pressure_command': 2e6, 'percussion_on': True}", "nan: must be a finite"),
        ("import no_such_package", "ModuleNotFoundError: No module named 'no_such_package'"),
        ("def PI(inputs, time, step):\n    return {}", "gave no force_command"),
        ("def PI(inputs, time, step):\n    pass", r"^controller: PI \(my.py\) returned None: must "
         "return a dict with force_command, percussion_on, pressure_command$"),
        ("raise ValueError('no data')", r"my.py: cannot be loaded: ValueError: no data \(my.py, "),
        ("def PI(inputs, time, step):\n    return {'force_command': '3 kN', "
         "'pressure_command': 2e6, 'percussion_on': True}",
         "my.py: the controller gave force_command = '3 kN': must be a finite number"),
        ("def PI(inputs, time, step):\n    return inputs['feed_farce']", "did you mean feed_force"),
        ("class PI:\n    def __init__(self, feed_force=1.0): pass\n"
         "    def __call__(self, inputs, time, step): pass", "feed_force: an argument cannot be"),
    ],
)  # fmt: skip
def test_what_is_no_controller_is_refused_before_a_file_is_written(text, said, written, tmp_path):
    with pytest.raises(CouplingError, match=said):
        written("PI", text)
    assert not list(tmp_path.glob("*.fmu"))


def test_the_archive_has_the_controller_and_what_it_does_not_know_is_told(
    fmus, written, tmp_path, monkeypatch
):
    monkeypatch.setattr("fmu_src.system.archive.build_fmus", lambda plan, folder: fmus)
    path, _ = written("PI")
    ssp = tmp_path / "mine.ssp"
    left = write_with_controller(plan_of("feed_control"), path, tmp_path, ssp)
    assert left == {"start.force": -800.0}
    found = Coupling(ssp).run(0.1, step=1e-3)
    assert not found.error
    assert found["controller.force_command"][0] == pytest.approx(-800.0, abs=500.0)


def test_the_command_writes_and_does_not_replace(written, tmp_path, monkeypatch, capsys):
    written("PI")
    monkeypatch.chdir(tmp_path)
    words = ["controller", "my.py:PI", "-o", "mine.fmu"]
    assert _guarded(lambda: app(words, standalone_mode=False)) == 0
    assert "mine.fmu: written, valid, from PI of my.py" in capsys.readouterr().out
    for bad in (words, [*words[:3], "my.zip"], ["controller", "my.py", "-o", "a.fmu"]):
        assert _guarded(lambda bad=bad: app(bad, standalone_mode=False)) == BAD_INPUT
    assert {path.name for path in tmp_path.glob("*.fmu")} == {"PI.fmu", "mine.fmu"}
