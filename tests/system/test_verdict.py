"""A coupled run says whether its energies balance, or which communication step would do."""

from __future__ import annotations

import json
import math
from functools import cache

import numpy as np
import pytest

from percussion_model.coupling import Coupling
from percussion_model.coupling.coupled_run import STRING_ENERGIES, CoupledRun
from percussion_model.coupling.verdict import judge_run
from percussion_model.interface.cli import main

# A shoulder whose own time is a fortieth of the usual one; docs/data/step_rejection.md has
# its errors: 27 % of the feed at 1 ms.
STIFF = {"string.shoulder.stiffness": 1e7, "string.shoulder.damping": 2000.0}


def run_at(system, step, duration, parameters=None):
    return Coupling(system, parameters or {}).run(duration, step)


@cache
def verdict_at(system, step, duration):
    """Of a run that several tests look at."""
    return run_at(system, step, duration).verdict


# Rows of docs/data/coupling_step.md: up to 2 ms the rate is right to 1.5 %, the shoulder as given.
@pytest.mark.parametrize(
    ("step", "duration", "word"),
    [
        (1e-5, 0.05, "balanced"),
        (1e-4, 0.15, "balanced"),
        (1e-3, 0.5, "balanced"),
        (2e-3, 0.5, "balanced"),
        (2.5e-3, 0.5, "step too long"),
        (5e-3, 0.5, "step too long"),
        (2e-2, 1.0, "step too long"),
        (1e-1, 1.0, "step too long"),
        (5e-1, 1.0, "step too long"),
    ],
)
def test_the_verdict_over_a_ladder_of_steps(feed_control, step, duration, word):
    verdict = verdict_at(feed_control, step, duration)
    assert verdict.word == word, verdict.text
    assert verdict.is_bad == (word != "balanced")


@pytest.mark.parametrize("step", [2.5e-3, 0.02, 0.5])
def test_the_step_that_is_said_to_do_does(feed_control, step):
    verdict = verdict_at(feed_control, step, 1.0)
    assert verdict.findings[0].signal == "string.shoulder_stiffness"
    assert verdict.step == 2e-3
    assert verdict_at(feed_control, verdict.step, 0.5).word == "balanced"


def test_a_stiff_shoulder_wants_a_shorter_step(feed_control):
    """The usual step leaves it 4 % of its stiffness."""
    verdict = run_at(feed_control, 1e-3, 0.2, STIFF).verdict
    assert verdict.word == "step too long"
    # m / (20 h^2) = k, as docs/system.md has it
    assert verdict.findings[0].step == pytest.approx(math.sqrt(8.69 / 20.0 / 1e7), rel=1e-6)
    assert verdict.step == 2e-4


def test_what_a_step_does_not_mend_is_not_blamed_on_it(feed_control):
    """Its pulses are shorter than the cells of the string: shorter cells close the balance."""
    coarse = run_at(feed_control, 1e-4, 0.15, STIFF | {"string.rod.cells": 1}).verdict
    assert (coarse.word, coarse.step) == ("not balanced", None)
    assert coarse.findings[0].signal == "string.rod.cells"
    fine = run_at(feed_control, 1e-4, 0.15, STIFF | {"string.rod.cells": 8}).verdict
    assert fine.word == "balanced"


def test_a_loop_that_swings_up_for_the_step_alone_is_told(feed_control):
    """With a shoulder that bears 20 ms the loop of rig and head is left, which does not."""
    soft = {"string.shoulder.stiffness": 1000.0, "string.start.feed_force": 30.0,
            "controller.feed_setpoint": 30.0, "rig.slide.friction": 0.0,
            "rig.cylinder.area": 0.02}  # fmt: skip
    verdict = run_at(feed_control, 0.02, 1.0, soft).verdict
    assert verdict.word == "step too long"
    assert verdict.findings[0].signal == "rig.force"
    assert verdict.findings[0].step < 0.01


def test_a_part_that_fails_is_the_verdict(feed_control):
    def crash(inputs, time, step):
        if time > 0.02:
            raise RuntimeError("the sensor is gone")
        return {"force_command": -800.0, "pressure_command": 2e6, "percussion_on": True}

    verdict = Coupling(feed_control, replaced={"controller": crash}).run(0.1, 1e-3).verdict
    assert verdict.word == "ended early"
    assert "the sensor is gone" in verdict.text


def made_up(**changes):
    """Rows of a run in which nothing moves, with some of them changed."""
    columns = {f"string.energy.{name}": np.zeros(50) for name in STRING_ENERGIES}
    columns["string.energy.stored"] += 10.0
    columns |= {"time": np.linspace(0.0, 1.0, 50), "hammer.energy_residual": np.zeros(50)}
    columns |= {name.replace("__", "."): values for name, values in changes.items()}
    return CoupledRun(columns, 1e-3, 1000)


def late(value):
    return np.where(np.arange(50) < 20, 0.0, value)


def test_no_number_in_a_signal_that_is_kept(feed_control):
    verdict = made_up(hammer__blow_energy=late(np.nan)).verdict
    assert verdict.word == "not balanced"
    assert verdict.text == "hammer.blow_energy is no number in 30 rows, from 0.408163 s on"
    assert made_up().verdict.word == "balanced"


def test_a_ledger_that_is_open_at_any_step():
    verdict = made_up(hammer__energy_residual=late(1e-6)).verdict
    assert (verdict.word, verdict.step) == ("not balanced", None)
    assert "whatever the step" in verdict.text


def test_a_balance_of_nan_is_no_balance():
    assert made_up(hammer__energy_residual=late(np.nan)).verdict.is_bad


def test_a_value_at_its_limit_is_a_remark():
    verdict = made_up(rig__limited=late(1.0)).verdict
    assert verdict.word == "balanced"
    assert verdict.remarks == [
        "the valve of the rig gave its full flow in 61 % of the rows (rig.limited)"
    ]


def test_few_steps_tell_nothing(feed_control):
    verdict = run_at(feed_control, 1e-3, 5e-3).verdict
    assert verdict.word == "undecided"
    assert "5 steps are too few" in verdict.text


def test_compiled_and_python_loops_have_one_verdict(feed_control):
    verdicts = [
        Coupling(feed_control, compiled=compiled).run(0.1, 1e-3, interval=7e-3).verdict
        for compiled in (True, False)
    ]
    assert verdicts[0] == verdicts[1]


def test_rows_may_be_thin(feed_control):
    """The change in a step is that of a step, however far rows are apart."""
    every, thin = (
        Coupling(feed_control).run(0.5, 1e-3, interval=interval).jumps["string.feed_force"]
        for interval in (1e-3, 7e-3)
    )
    assert thin == pytest.approx(every, rel=0.5)


@pytest.mark.parametrize(("step", "code"), [("0.5", 1), ("1e-3", 0)])
def test_the_command_ends_with_its_verdict(feed_control, tmp_path, monkeypatch, capsys, step, code):
    numbers = tmp_path / "numbers.json"
    words = ["percussion", "couple", str(feed_control), "--step", step, "--duration", "1",
             "--no-figures", "--out", str(tmp_path / "out"), "--json", str(numbers)]  # fmt: skip
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == code
    said = capsys.readouterr()
    assert max(map(len, (said.out + said.err.replace(str(tmp_path), "")).splitlines())) <= 80
    verdict = json.loads(numbers.read_text(encoding="utf-8"))["verdict"]
    if code:
        assert "the communication step of 500 ms is too long" in said.err
        assert verdict["word"] == "step too long"
    else:
        told = " ".join(said.err.split())
        assert "the communication step of 1 ms is short enough: energies balance" in told
        assert verdict["word"] == "balanced"


@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, -1.0])
def test_a_stiffness_or_a_jump_that_is_no_number_is_judged(value):
    """FMUs of others may say anything."""
    columns = {"time": np.arange(3.0), "string.shoulder_stiffness": np.array([1e5, value, 1e5])}
    verdict = judge_run(columns, {}, {"a.b": value}, 1e-3, 100, "", controlled=False)
    assert verdict.is_bad, verdict.text
    assert ("is no number" in verdict.text) == (not math.isfinite(value))


def test_the_command_says_of_which_numbers_the_error_is_not_known(
    feed_control, tmp_path, monkeypatch, capsys
):
    words = ["couple", str(feed_control), "--duration", "0.2", "--no-figures"]
    words += ["--json", str(tmp_path / "numbers.json"), "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", ["percussion", *words])
    with pytest.raises(SystemExit):
        main()
    lines = capsys.readouterr().out.splitlines()
    for name in ("Depth of the bit", "Rate in the second half", "Work of the feed on the bit"):
        (line,) = [one for one in lines if one.startswith(name)]
        assert line.endswith("(error not estimated)"), line
    found = json.loads((tmp_path / "numbers.json").read_text(encoding="utf-8"))
    assert found["rate_second_half_error"] is None
    assert found["without_error"] == [
        "depth", "rate_second_half", "shoulder_energy", "feed_work", "shoulder_by_blows",
    ]  # fmt: skip


@pytest.mark.parametrize(("duration", "told"), [("0.1", True), ("0.09", False)])
def test_a_time_that_is_no_multiple_of_the_step_is_told(
    feed_control, tmp_path, monkeypatch, capsys, duration, told
):
    words = ["couple", str(feed_control), "--duration", duration, "--step", "0.03"]
    words += ["--no-figures", "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", ["percussion", *words])
    with pytest.raises(SystemExit):
        main()
    said = capsys.readouterr().err
    line = "--duration 0.1: 0.09 s are simulated, 3 whole steps of 0.03 s"
    assert (line in said) == told
    assert ("are simulated" in said) == told


def test_options_that_do_not_go_together_are_named(feed_control, tmp_path, monkeypatch, capsys):
    words = ["couple", str(feed_control), "--tolerance", "0.01", "--every", "rock=10"]
    monkeypatch.setattr("sys.argv", ["percussion", *words, "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "tolerance 0.01 and every rock=10 do not go together (--tolerance, --every)" in line


@pytest.mark.parametrize(
    "refused",
    [("--set", "nothing.there=1"), ("--signal", "hammer.nothing"), ("--duration", "0")],
    ids=lambda words: words[0],
)
def test_a_system_that_is_refused_claims_no_folder(
    feed_control, tmp_path, monkeypatch, capsys, refused
):
    """Nothing is said of a numbered folder that is not going to be written."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "out" / feed_control.stem
    folder.mkdir(parents=True)
    (folder / "kept.txt").write_text("")
    monkeypatch.setattr("sys.argv", ["percussion", "couple", str(feed_control), *refused])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert "this one goes to" not in capsys.readouterr().err
    assert list(folder.parent.iterdir()) == [folder]
