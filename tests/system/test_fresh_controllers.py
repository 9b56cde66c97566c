"""Each run begins with a fresh Python controller: nothing is left of the run before."""

from __future__ import annotations

import json
import threading
from functools import cache, partial

import pytest

from percussion_model.coupling import Coupling, CouplingError
from percussion_model.coupling.bench import bench
from percussion_model.coupling.fresh import CopiedPart, with_values
from percussion_model.interface.cli import main

pytestmark = pytest.mark.usefixtures("brief")

ALONE, AFTER_ANOTHER = ["soft"], ["collaring", "soft"]
STILL = {"force_command": -800.0, "pressure_command": 2e6, "percussion_on": True}


class PI:
    """A PI on the feed, which winds up in a run."""

    def __init__(self, gain=0.5, time=0.2):
        self.gain, self.time, self.sum = gain, time, 0.0

    def __call__(self, inputs, time, step):
        error = inputs["feed_setpoint"] - inputs["feed_force"]
        self.sum += error * step
        return STILL | {"force_command": -800.0 + self.gain * (error + self.sum / self.time)}

    def work(self, inputs, time, step):
        return self(inputs, time, step)


class Resettable(PI):
    def reset(self):
        self.sum = 0.0


def make():
    return PI()


@pytest.fixture
def points(feed_control, brief):
    """Points of the PI on `soft`, from an instance of its own."""
    return points_alone(feed_control)


@cache
def points_alone(system):
    return bench(system, make, trials=ALONE, check_step=False)[0].points


@pytest.mark.parametrize(
    "controller",
    [PI, make, partial(PI, gain=0.5), lambda: Resettable(), Resettable()],
    ids=["class", "factory", "partial", "factory of what has reset", "object with reset"],
)
def test_the_score_is_that_of_the_run_alone(feed_control, controller, points):
    scores = bench(feed_control, controller, trials=AFTER_ANOTHER, check_step=False)
    assert scores[1].points == points


@pytest.mark.parametrize("kind", ["object", "method"])
def test_a_plain_object_is_copied_and_that_is_said(feed_control, kind, points):
    one = PI()
    given = one if kind == "object" else one.work
    with pytest.warns(CopiedPart, match=r"has no reset\(\): each run has a copy of it"):
        scores = bench(feed_control, given, trials=AFTER_ANOTHER, check_step=False)
    assert scores[1].points == points
    assert one.sum == 0.0


def test_an_object_that_cannot_be_copied_is_refused(feed_control):
    one = PI()
    one.lock = threading.Lock()
    with (
        pytest.warns(CopiedPart),
        pytest.raises(CouplingError, match=r"object of PI .* cannot be copied .*give its class"),
    ):
        bench(feed_control, one, trials=ALONE)


def test_a_function_that_keeps_values_is_refused(feed_control):
    """In its closure, here; the first run shows it."""
    kept = {"sum": 0.0}

    def careless(inputs, time, step):
        kept["sum"] += step
        return STILL

    with pytest.raises(CouplingError, match=r"careless keeps values .*\(kept\): give its class"):
        bench(feed_control, careless, trials=ALONE)


def test_a_function_that_keeps_nothing_is_taken_as_it_is(feed_control, recwarn):
    gains = {"force": -800.0}
    (score,) = bench(feed_control, lambda *words: STILL | {"force_command": gains["force"]},
                     trials=ALONE, check_step=False)  # fmt: skip
    assert score.run.error == ""
    assert not [one for one in recwarn if one.category is CopiedPart]


@pytest.mark.parametrize(
    ("controller", "text"),
    [
        (lambda: {"gain": 1.0}, "gives dict, which cannot be called with inputs, time and step"),
        (lambda: PI, "gives the class PI, which cannot be called"),
        (lambda inputs, time: STILL, "called with inputs, time and step .too many"),
        (lambda: lambda inputs: STILL, "gives cannot be called with inputs, time and step"),
    ],
)
def test_what_makes_no_controller_is_refused(feed_control, controller, text):
    with pytest.raises(CouplingError, match=text):
        bench(feed_control, controller, trials=ALONE)


def test_a_class_that_fails_is_told_with_its_place(feed_control):
    class Broken(PI):
        def __init__(self):
            {}["gain"]

    line = Broken.__init__.__code__.co_firstlineno + 1
    text = rf"controller: KeyError: 'gain' \(test_fresh_controllers.py, line {line}\)"
    with pytest.raises(CouplingError, match=text):
        bench(feed_control, Broken, trials=ALONE)


def test_a_class_that_needs_arguments_is_refused(feed_control):
    class Tuned(PI):
        def __init__(self, gain):
            super().__init__(gain)

    with pytest.raises(CouplingError, match=r"Tuned cannot be made without arguments .*a factory"):
        bench(feed_control, Tuned, trials=ALONE)


def test_arguments_are_set_as_variables_of_an_fmu(feed_control):
    tuned, plain = (bench(feed_control, one, trials=["collaring"], check_step=False)[0].points
                    for one in (with_values(PI, {"gain": 0.1}), lambda: PI(gain=0.1)))  # fmt: skip
    assert tuned == plain
    for given, text in ((PI, "PI has no argument gian: did you mean gain"),
                        (PI().work, "work is a function, which has no variables")):  # fmt: skip
        with pytest.raises(CouplingError, match=text):
            with_values(given, {"gian": 0.1})
    with pytest.raises(CouplingError, match=r"gain: controller is a Python callable"):
        bench(feed_control, PI, {"controller.gain": 0.1})


def test_a_system_of_other_signals_is_refused(feed_control, monkeypatch):
    monkeypatch.setattr("percussion_model.coupling.bench.SIGNALS", ("string.waves", "rig.energy"))
    with pytest.raises(CouplingError, match=r"has no string.waves: the bench needs FeedControl"):
        bench(feed_control, PI, trials=ALONE)


def test_coupled_runs_go_by_the_same_rule(feed_control):
    one = Resettable()
    # both are made before either runs
    couplings = [Coupling(feed_control, replaced={"controller": one}) for _ in range(2)]
    runs = [coupling.run(0.2, 1e-3) for coupling in couplings]
    forces = [run["controller.force_command"].tolist() for run in runs]
    assert forces[0] == forces[1]
    made = Coupling(feed_control, replaced={"controller": Resettable}).run(0.2, 1e-3)
    assert made["controller.force_command"].tolist() == forces[0]


FILE = """
total = 0.0
def work(inputs, time, step):
    global total
    error = inputs["feed_setpoint"] - inputs["feed_force"]
    total += error * step
    return {"force_command": -800.0 + 0.5 * (error + total / 0.2), "pressure_command": 2e6,
            "percussion_on": True}
"""


def test_a_file_is_loaded_afresh_for_each_run(feed_control, tmp_path, monkeypatch, points):
    """So that its globals are those of the run."""
    (tmp_path / "mine.py").write_text(FILE)
    numbers = tmp_path / "numbers.json"
    words = ["percussion", "bench-controller", f"{tmp_path / 'mine.py'}:work", "--system",
             str(feed_control), "--trial", "collaring", "--trial", "soft", "--json", str(numbers),
             "--out", str(tmp_path / "out")]  # fmt: skip
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    found = {one["trial"]: one["points"] for one in json.loads(numbers.read_text())["trials"]}
    assert found["soft"] == points


def test_the_table_fits_a_terminal(feed_control, tmp_path, monkeypatch, capsys):
    words = ["percussion", "bench-controller", "--system", str(feed_control), "--trial", "rod",
             "--trial", "collaring", "--out", str(tmp_path / "out")]  # fmt: skip
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit):
        main()
    said = capsys.readouterr()
    assert any(line.endswith("index.html") for line in said.err.splitlines()[-2:])
    lines = said.out.splitlines()
    assert max(map(len, lines)) <= 80
    assert any(line.startswith("mean of the points: ") for line in lines)
    for trial in ("collaring", "rod"):
        # the table is in blocks of columns; a number for each, none of them cut
        words = [word for line in lines if line.split()[0] == trial for word in line.split()[1:]]
        assert len([[float(part) for part in word.split("±")] for word in words]) == 10
    assert sum("[MJ/m]" in line for line in lines) == 1
