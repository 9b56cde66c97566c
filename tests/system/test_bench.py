"""The bench tells controllers apart, and says what is wrong with one that fails."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from percussion_model.coupling import CouplingError
from percussion_model.coupling.bench import (
    STANDARD_RUNS,
    bench,
    judge,
    mean_points,
    mean_points_error,
    with_step_error,
)
from percussion_model.coupling.coupled_run import CoupledRun
from percussion_model.interface.bench_page import write_bench_page
from percussion_model.interface.bench_text import COLUMNS, about_errors, cells, points_text
from percussion_model.interface.cli import main
from percussion_model.interface.progress import RunProgress
from tests.browser import find_browser, visit

COLUMN = {name: k for k, (name, *_) in enumerate(COLUMNS)}


def nothing(inputs, time, step):
    return {"force_command": -800.0, "pressure_command": 2e6, "percussion_on": True}


def test_the_bench_ranks_nothing_below_a_bad_pi_below_a_good_one(feed_control):
    """A new rod brings half a kilonewton, which nobody but a controller takes away."""
    bad = {"controller.pi.gain": 0.1, "controller.pi.time": 0.4}
    points = [
        mean_points(bench(feed_control, controller, values, ["rod"], check_step=False))
        for controller, values in ((nothing, {}), (None, bad), (None, {}))
    ]
    assert points[0] > 0.0
    assert points[0] + 1.0 < points[1]
    assert points[1] + 1.0 < points[2] <= 100.0


def test_the_share_that_is_done_rises_over_all_runs(feed_control, brief):
    shares = []
    watch = RunProgress(lambda text, share: shares.append(share), 0.0)
    bench(feed_control, trials=["rod", "soft"], watch=watch)
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert shares[-1] == pytest.approx(1.0)


def test_nothing_fails_where_the_bit_is_held(feed_control):
    """Something has to be done about a jam; what ships does it in time."""
    (idle,) = bench(feed_control, nothing, trials=["jam"], check_step=False)
    assert idle.points == 0.0
    assert "beyond the limits of feed or torque" in idle.faults[0]
    (retracting,) = bench(feed_control, trials=["jam"], check_step=False)
    assert retracting.faults == []
    assert retracting.numbers["violations"] < 0.6 * idle.numbers["violations"]


def test_rotation_jams_where_nobody_looks_at_its_torque(feed_control):
    """Once it stands, the climb out of its craters is too steep for the motor at this feed."""
    blind = {"controller.retract.on": False}
    for controller, values in ((nothing, {}), (None, blind)):
        (jammed,) = bench(feed_control, controller, values, trials=["rotation"], check_step=False)
        assert jammed.points == 0.0
        assert jammed.run["rock.rotation_torque"][-1] == pytest.approx(265.0)  # its motor's most
    (seeing,) = bench(feed_control, trials=["rotation"], check_step=False)
    assert seeing.faults == []
    assert seeing.numbers["depth"] > 2.0 * jammed.numbers["depth"]


def test_air_that_runs_short_changes_the_reaction_which_a_pi_makes_good(feed_control):
    """Pressure, and with it blows and the drive's reaction on the casing, fall for seconds."""
    slow = {"controller.pi.gain": 0.1, "controller.pi.time": 0.4}
    found = [
        bench(feed_control, controller, values, ["air"], check_step=False)[0]
        for controller, values in ((nothing, {}), (None, slow), (None, {}))
    ]
    points = [score.points for score in found]
    assert 0.0 < points[0] < points[1]
    assert points[1] + 1.0 < points[2] <= 100.0
    run = found[2].run
    begin, end = np.searchsorted(run["time"], (1.0, 4.0))
    for name in ("supply.supply_pressure", "hammer.blow_frequency"):
        assert run[name][end - 1] < 0.97 * run[name][begin], name
    # F_0 is as the pressure, and so is the reaction that the rig has to hold less of
    command = run["controller.force_command"]
    assert command[end - 1] < command[begin] - 100.0


def test_a_crash_has_no_points_and_a_page(feed_control, tmp_path, monkeypatch, capsys):
    source = tmp_path / "mine.py"
    source.write_text(
        "def fly(inputs, time, step):\n"
        "    if time > 0.05:\n"
        "        raise RuntimeError('no idea what to do')\n"
        "    return {'force_command': -800.0, 'pressure_command': 2e6, 'percussion_on': True}\n"
    )
    out = tmp_path / "out"
    words = ["percussion", "bench-controller", f"{source}:fly", "--system", str(feed_control)]
    monkeypatch.setattr("sys.argv", [*words, "--trial", "rod", "--out", str(out)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "rod ended early, at 0.051 s: controller: RuntimeError: no idea what to do" in said
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "no idea what to do" in page
    assert '<tr class="bad"><td><a href="#rod">rod</a><small>a rod is added</small></td>' in page
    assert "1 of 1 runs failed: rod" in page


def nonsense(inputs, time, step):
    return nothing(inputs, time, step) | ({"force_command": math.nan} if time > 0.05 else {})


def test_no_number_ends_the_run_with_what_there_is(feed_control):
    (score,) = bench(feed_control, nonsense, trials=["rod"])
    assert score.points == 0.0
    assert score.faults == ["ended early, at 0.051 s: controller: force_command = nan is no number"]
    assert score.numbers["depth"] > 0.0
    assert score.run["time"][-1] == pytest.approx(0.051)


def test_a_bad_controller_fails_visibly(feed_control, tmp_path, monkeypatch, capsys):
    """A PI that swings up: the command says so and ends with 1, row and run are red."""
    out, numbers = tmp_path / "out", tmp_path / "numbers.json"
    words = ["percussion", "bench-controller", "--system", str(feed_control), "--trial", "rod",
             "--set", "pi.gain=4", "--set", "pi.time=0.05", "--set", "cutback.on=false",
             "--set", "retract.on=false"]  # fmt: skip
    monkeypatch.setattr("sys.argv", [*words, "--out", str(out), "--json", str(numbers)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 1
    assert "rod failed: " in capsys.readouterr().err
    (found,) = json.loads(numbers.read_text(encoding="utf-8"))["trials"]
    assert found["swing"] > 0.3
    assert found["violations"] > 0.4
    assert "s beyond the limits of feed or torque" in found["faults"][0]
    page = (out / "index.html").read_text(encoding="utf-8")
    assert '<tr class="bad">' in page
    assert f'<p class="bad">{found["faults"][0]}</p>' in page
    if find_browser() is not None:  # the table is as wide as a telephone, and scrolls
        width = "document.documentElement.scrollWidth"
        seen = visit(out / "index.html", tmp_path / "profile", (width,), width=390)
        assert (seen.answers, seen.errors) == ([390], [])


def test_an_interrupted_bench_keeps_the_runs_that_are_done(
    feed_control, brief, tmp_path, monkeypatch, capsys
):
    def interrupted(system, controller, values, trials, take, trust, watch, check_step, tell):
        bench(system, controller, values, ["rod"], take, trust, watch, check_step, tell)
        raise KeyboardInterrupt

    monkeypatch.setattr("percussion_model.coupling.bench.bench", interrupted)
    words = ["percussion", "bench-controller", "--system", str(feed_control)]
    monkeypatch.setattr("sys.argv", [*words, "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 130
    assert "the page has the 1 runs that were done" in capsys.readouterr().err
    assert "rod" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")


def made_up(feed, torque=100.0, error="", since=3.7):
    """A run of 4 s with a constant feed, and a torque in its last part."""
    time = np.linspace(0.0, 4.0, 801)
    still = np.zeros_like(time)
    columns = {
        "time": time,
        "string.feed_force_mean": still + feed,
        "rock.rotation_torque": np.where(time > since, torque, 0.0),
        "hammer.bit.position": 0.02 * time,
        "controller.force_command": still - 800.0,
        "rig.energy": 10.0 * time,
        "supply.energy": 990.0 * time,
        "hammer.blow_count": np.floor(20.0 * time),
        "hammer.bit.force_peak": still + 5e5,
    }
    for name in ("string.lifted", "hammer.off_bottom", "rock.in_void"):
        columns[name] = still
    return CoupledRun(columns, 1e-3, 4000, error)


def test_points_are_what_they_are_said_to_be():
    trial = STANDARD_RUNS[0]
    assert judge(trial, made_up(3000.0)).points == pytest.approx(100.0)
    assert judge(trial, made_up(2400.0)).points == pytest.approx(80.0)
    jammed = judge(trial, made_up(3000.0, torque=300.0))
    assert jammed.numbers["violations"] == pytest.approx(0.3, abs=0.01)
    assert jammed.points == pytest.approx(92.5, abs=0.3)
    assert jammed.numbers["energy_per_metre"] == pytest.approx(50e3)
    falling = made_up(3000.0)
    void = (falling["time"] > 2.0) & (falling["time"] < 2.5)
    falling.columns["string.feed_force_mean"] = np.where(void, 0.0, 3000.0)
    assert judge(trial, falling).points == pytest.approx(85.7, abs=0.3)
    falling.columns["rock.in_void"] = void.astype(float)
    assert judge(trial, falling).points == pytest.approx(100.0)
    assert judge(trial, made_up(3600.0)).numbers["overshoot"] == pytest.approx(0.2)
    assert judge(trial, made_up(3000.0, error="at 1 s it fell")).points == 0.0


@pytest.mark.parametrize(
    ("changes", "faults"),
    [
        ({"feed": 2500.0}, []),
        ({"feed": 2000.0}, ["the feed is off by 33 % on average"]),
        (
            {"feed": 3000.0, "torque": 300.0, "since": 3.0},
            ["1.0 s beyond the limits of feed or torque"],
        ),
        ({"feed": 3000.0, "error": "at 1 s it fell"}, ["ended early, at 1 s it fell"]),
    ],
)
def test_a_run_fails_for_a_reason(changes, faults):
    score = judge(STANDARD_RUNS[0], made_up(**changes))
    assert score.faults == faults
    assert (score.points == 0.0) == bool(faults)


def test_the_page_says_what_a_stranger_needs(tmp_path):
    scores = [judge(STANDARD_RUNS[0], made_up(3000.0)), judge(STANDARD_RUNS[3], made_up(2000.0))]
    page = write_bench_page(scores, tmp_path, "<mine>").read_text("utf-8")
    assert "Controller bench: &lt;mine&gt;" in page
    assert "1 of 2 runs failed: void" in page
    assert page.count("<img alt=") == 2
    for name, head, _, text in COLUMNS:
        assert name in scores[0].numbers
        assert page.count(head) == 2
        assert text in page
    assert STANDARD_RUNS[0].text in page
    assert (tmp_path / "void.png").stat().st_size > 15_000


def test_a_page_that_cannot_be_finished_leaves_the_old_one(tmp_path):
    """Its figures too: they would belong to another run."""
    scores = [judge(STANDARD_RUNS[0], made_up(3000.0))]
    write_bench_page(scores, tmp_path, "first")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    scores = [judge(STANDARD_RUNS[0], made_up(2900.0)), judge(STANDARD_RUNS[3], made_up(2000.0))]
    del scores[1].run.columns["hammer.bit.position"]
    with pytest.raises(KeyError):
        write_bench_page(scores, tmp_path, "second")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_score_has_its_error_by_the_step():
    """Twice the change, as an error of first order has it, and no less than what no step sees."""
    score, finer = (
        judge(STANDARD_RUNS[3], made_up(2900.0)),
        judge(STANDARD_RUNS[3], made_up(2880.0)),
    )
    found = with_step_error(score, finer)
    assert (found.points, found.numbers) == (score.points, score.numbers)
    assert found.points_error == pytest.approx(2.0 * 100.0 * 20.0 / 3000.0)
    assert found.errors["feed_error"] == pytest.approx(2.0 * 20.0 / 3000.0)
    assert found.errors["peak_force"] == pytest.approx(0.02 * 5e5)
    assert found.errors["dry_blows"] == 0.0
    same = with_step_error(score, score)
    assert same.points_error == pytest.approx(0.02 * 100.0 * 100.0 / 3000.0)
    assert cells(found)[COLUMN["feed_error"]] == "3.3±1.3"
    assert cells(found)[COLUMN["peak_force"]] == "500±10"
    assert cells(found)[COLUMN["dry_blows"]] == "0"
    assert points_text(found.points, found.points_error) == "96.7±1.3"
    assert "twice what half the step changes" in about_errors([found])
    assert mean_points_error([found, score]) is None
    assert points_text(score.points, score.points_error) == "96.7"
    assert "was not estimated" in about_errors([score])


def test_an_error_is_no_less_than_what_a_blow_makes():
    """One halving happens to change little, the next ones more: 0.423, 0.4315, 0.3975 s."""
    run, other = made_up(3000.0), made_up(3000.0)
    for one, end in ((run, 0.423), (other, 0.4315)):
        time = one.columns["time"] = np.linspace(0.0, 4.0, 8001)
        for name, column in list(one.columns.items()):
            if name != "time":
                one.columns[name] = np.interp(time, np.linspace(0.0, 4.0, len(column)), column)
        one.columns["string.lifted"] = ((time > 0.0) & (time < end + 1e-6)).astype(float)
        one.columns["rock.in_void"] = one.columns["string.lifted"]
        one.columns["hammer.blow_count"] = np.floor(20.0 * time)
    found = with_step_error(judge(STANDARD_RUNS[3], run), judge(STANDARD_RUNS[3], other))
    times = found.numbers["time_off_bottom"], found.errors["time_off_bottom"]
    assert times[0] == pytest.approx(0.423, abs=6e-4)
    assert abs(times[0] - 0.3975) < times[1]
    assert times[1] == pytest.approx(4.0 / 80.0)
    assert found.numbers["dry_blows"] == 8.0
    assert found.errors["dry_blows"] == 1.0
    short = made_up(3000.0)
    short.columns["hammer.blow_count"] = np.floor(5.0 * short["time"])  # 20 blows
    few = with_step_error(*(judge(STANDARD_RUNS[0], short) for _ in range(2)))
    for name in ("depth", "energy_per_metre"):
        assert few.errors[name] == pytest.approx(few.numbers[name] / 20.0)
    assert (few.errors["time_off_bottom"], few.errors["dry_blows"]) == (0.0, 0.0)
    assert "one blow's share of depth" in about_errors([few])


def test_what_is_no_controller_is_told(feed_control, tmp_path, monkeypatch, capsys):
    given = tmp_path / "scene.toml"
    given.write_text("title = 'no archive'\n")
    words = ["bench-controller", str(given), "--system", str(feed_control)]
    monkeypatch.setattr("sys.argv", ["percussion", *words, "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("scene.toml: is neither an FMU nor FILE.py:NAME")


def test_a_run_that_fails_with_one_step_alone_is_in_doubt():
    good, bad = judge(STANDARD_RUNS[0], made_up(3000.0)), judge(STANDARD_RUNS[0], made_up(2000.0))
    for score, finer, words in ((good, bad, "it fails: the feed is off"), (bad, good, "not fail")):
        found = with_step_error(score, finer)
        assert words in found.doubt
        assert found.points_error == pytest.approx(100.0)
    assert with_step_error(bad, bad).doubt == ""


def test_a_bench_runs_with_half_the_step_too(feed_control, tmp_path, monkeypatch, capsys):
    """Errors hold what a tenth of the step finds; without them that is said."""
    rod = tuple(replace(one, duration=2.4) for one in STANDARD_RUNS if one.name == "rod")
    monkeypatch.setattr("percussion_model.coupling.bench.STANDARD_RUNS", rod)
    words = ["bench-controller", "--system", str(feed_control), "--trial", "rod",
             "--json", str(tmp_path / "numbers.json"), "--out", str(tmp_path / "out")]  # fmt: skip
    found = {}
    for extra in ([], ["--no-step-check", "--force"]):
        monkeypatch.setattr("sys.argv", ["percussion", *words, *extra])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 0
        said = " ".join(capsys.readouterr().out.split())
        (found[bool(extra)],) = json.loads((tmp_path / "numbers.json").read_text())["trials"]
        assert ("twice what half the step changes" in said) == (not extra)
        assert ("by the communication step of 1 ms was not estimated" in said) == bool(extra)
        page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
        assert ("was not estimated" in page) == bool(extra)
    checked, bare = found[False], found[True]
    assert (bare["points_error"], bare["errors"]) == (None, {})
    assert checked["points"] == bare["points"]
    monkeypatch.setattr("percussion_model.coupling.bench.STEP", 1e-4)
    (fine,) = bench(feed_control, trials=["rod"], check_step=False)
    assert 0.0 < abs(fine.points - checked["points"]) <= checked["points_error"]
    for name in ("depth", "energy_per_metre", "overshoot", "feed_error", "swing"):
        assert abs(fine.numbers[name] - checked[name]) <= checked["errors"][name]


def test_sensors_do_not_depend_on_the_step():
    """They have a clock of their own: half the step sees each sample twice."""
    (trial,) = (one for one in STANDARD_RUNS if one.name == "sensors")
    usual, half = trial.on_way(), trial.on_way()
    coarse = [usual("controller.feed_force", 1e-3 * k, float(k)) for k in range(100)]
    fine = [half("controller.feed_force", 5e-4 * k, float(k // 2)) for k in range(200)]
    assert fine[::2] == coarse
    assert fine[1::2] == coarse


@pytest.mark.parametrize("name", ["nothing", "rods"])
def test_an_unknown_run_is_named(feed_control, name):
    with pytest.raises(CouplingError, match=f"no run {name}: there are collaring, hard"):
        bench(feed_control, nothing, trials=[name])


def test_sensors_are_late_and_noisy_with_a_seed():
    (trial,) = (one for one in STANDARD_RUNS if one.name == "sensors")
    ways = [trial.on_way(), trial.on_way()]
    values = [[way("controller.feed_force", 1e-3 * k, float(k)) for k in range(200)]
              for way in ways]  # fmt: skip
    assert values[0] == values[1]
    lag = np.arange(100, 200) - np.array(values[0][100:])
    assert np.mean(lag) == pytest.approx(30.0, abs=4.0)
    assert math.isclose(ways[0]("hammer.feed_force", 0.0, 7.0), 7.0)
