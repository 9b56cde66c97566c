"""Studies: points, what is kept of them, and the processes and clusters that run them."""

from __future__ import annotations

import inspect
import json
import os
import re
import signal
import subprocess
import sys
import time
from multiprocessing import active_children
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from percussion_model import Scene, SceneError, SimulationError, settled
from percussion_model.analysis.study import Study, grid, study, table, workers
from percussion_model.analysis.study.response import COMPUTING, KINDS, run_points
from percussion_model.analysis.study.store import PARTS, PLAN
from percussion_model.analysis.study.variants import PLAIN_GROUPS
from percussion_model.engine import solver as engine
from percussion_model.interface.cli import INTERRUPTED, _guarded, app
from percussion_model.scene import contradictions
from percussion_model.scene.hammers import with_chambers
from percussion_model.scene.parameters import parameter_table
from percussion_model.simulation.files import ResultError, to_json
from percussion_model.solvers import sources

SCENE = Scene(title="rigid bodies").computed_by("rigid")
AXES = {"feed.force": [1500.0, 2500.0, 4000.0], "rock.loading_stiffness": [3e8, 7.5e8]}


@pytest.mark.parametrize(
    "key", ["feed.strength", "solver.name", "piston.sections", "pneumatic.supply_pressure"]
)
def test_keys_that_no_study_can_vary_are_refused_at_once(key, tmp_path):
    with pytest.raises(SceneError, match=key):
        study(SCENE, grid({key: [1.0]}), tmp_path / "out")
    with pytest.raises(SceneError, match=r"must be Points; grid\(...\) makes them"):
        study(SCENE, {key: [1.0]}, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert grid({"feed.force": 3e3}).values.tolist() == [[3e3]]


def test_a_point_has_the_numbers_of_settled_and_whole_numbers_stay_whole():
    scene = Scene()
    rows, failures = run_points(scene, ("solver.cells",), np.array([[10.0]]), 1e-4, 400, 1e-3)
    found = settled(scene.replace(**{"solver.cells": 10}))
    assert failures == [""]
    assert rows["rate_of_penetration"][0] == found.rate_of_penetration
    assert rows["blow_period"][0] == found.blow_period
    assert KINDS[rows["kind"][0]] == "periodic"


@pytest.mark.parametrize("solver", ["wave", "modal"])
def test_bits_do_not_depend_on_the_threads_of_linear_algebra(solver):
    threadpoolctl = pytest.importorskip("threadpoolctl")
    scene, found = Scene().computed_by(solver), []
    for threads in (1, 2):
        engine._kept.clear()
        with threadpoolctl.threadpool_limits(threads):
            rows, _ = run_points(scene, ("solver.cells",), np.array([[40.0]]), 1e-4, 400, 1e-3)
        found.append(rows)
    for name in set(found[0].dtype.names) - {"wall_time"}:
        np.testing.assert_array_equal(found[0][name], found[1][name])


def test_what_goes_wrong_at_a_point_is_recorded_and_stops_nothing():
    rows, failures = run_points(
        SCENE, ("rock.unloading_ratio",), np.array([[5.0], [0.5], [6.0]]), 1e-4, 400, 1e-3
    )
    assert [KINDS[kind] for kind in rows["kind"]][1] == "failed"
    assert "rock.unloading_ratio = 0.5: must be a number above 1" in failures[1]
    assert np.isnan(rows["rate_of_penetration"][1])
    assert np.isfinite(rows["rate_of_penetration"][[0, 2]]).all()


@pytest.mark.parametrize(
    ("scene", "key", "values"),
    [
        (SCENE, "drive.force", [6000.0, 5000.0, -1.0, 7000.0]),
        (Scene(), "rock.loading_stiffness", [7e8, 3e8, 7e8]),  # which tables follow from
        (Scene(), "solver.cells", [10.0, 12.0]),
        (with_chambers("dth3", 1.8e6), "pneumatic.pressure", [1.8e6, 2.2e6, 1.5e6]),
    ],
)
def test_points_one_after_the_other_are_those_of_their_own_scenes(scene, key, values):
    rows, failures = run_points(scene, (key,), np.array([values]).T, 1e-4, 40, 1e-2)
    for k, value in enumerate(values):
        (row,), (failure,) = run_points(scene, (key,), np.array([[value]]), 1e-4, 40, 1e-2)
        assert failures[k] == failure
        for name in set(rows.dtype.names) - {"wall_time"}:
            np.testing.assert_array_equal(rows[name][k], row[name])


def test_plain_numbers_decide_no_contradiction_and_no_solver():
    """Rules that look at one would have to be asked at each point."""
    seen = set(re.findall(r"\bv\.(\w+)", inspect.getsource(contradictions)))
    for choice in (Scene.solver_name.fget, Scene._against_modes.func, Scene.motor_stalls.fget):
        seen |= {
            f"{a}_{b}" for a, b in re.findall(r"self\.(\w+)\.(\w+)", inspect.getsource(choice))
        }
    plain = {
        row.key.replace(".", "_")
        for row in parameter_table()
        if row.kind == "number" and row.key.partition(".")[0] in PLAIN_GROUPS
    }
    assert {"loss_time", "run_settle", "effects_loss"} <= seen
    assert "feed_force" in plain
    assert not seen & plain


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A study in two processes."""
    return study(SCENE, grid(AXES), tmp_path_factory.mktemp("study"), processes=2)


def test_processes_find_what_one_finds(whole):
    points = grid(AXES)
    rows, _ = run_points(SCENE, points.keys, points.values, 1e-4, 400, 1e-3)
    for name in set(rows.dtype.names) - {"wall_time"}:
        np.testing.assert_array_equal(whole.rows[name], rows[name])


def test_a_study_becomes_tables_and_grids(whole, tmp_path):
    import pandas
    import xarray

    csv, netcdf, parquet = whole.save(tmp_path / "out")
    frame = pandas.read_parquet(parquet)
    text = pandas.read_csv(csv).drop(columns="failure")  # which is empty
    numbers = frame.drop(columns="failure")
    pandas.testing.assert_frame_equal(text, numbers, check_dtype=False, rtol=1e-15)
    assert frame.equals(whole.to_pandas())
    assert "the discretisation error is not estimated" in frame.attrs["errors"]
    with xarray.open_dataset(netcdf) as data:
        assert data.rate_of_penetration.dims == ("feed.force", "rock.loading_stiffness")
        assert data.rate_of_penetration.attrs["units"] == "m/s"
        assert "rate_of_penetration_error" in data.rate_of_penetration.attrs["error"]
        assert data.impact_velocity.attrs["error"] == "error not estimated"
        here = data.rate_of_penetration.sel({"feed.force": 4000.0, "rock.loading_stiffness": 3e8})
        k = int(np.argmax(np.all(whole.points.values == [4000.0, 3e8], axis=1)))
        assert float(here) == whole.rows["rate_of_penetration"][k]
        (tmp_path / "scene.toml").write_text(data.attrs["scene"])
    assert Scene.from_toml(tmp_path / "scene.toml") == SCENE


def test_without_pyarrow_a_study_has_no_parquet_and_says_so(whole, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    names = [path.name for path in whole.save(tmp_path / "out")]
    assert names == ["points.csv", "points.nc"]
    over = ["--over", "feed.farce=1"]
    said = CliRunner().invoke(app, ["study", "rigid", *over, "--out", str(tmp_path / "new")]).stderr
    assert '"percussion_model[parquet]"' in said


def blow_energy_again(found):
    return float(found.counted["blow_energy"].mean())


def soft_only(found):
    """A metric that fails at half of the points."""
    if found.rate_of_penetration < 0.02:
        raise ValueError("too hard")
    return found.rate_of_penetration


def test_a_metric_is_a_column_of_its_own_and_goes_on_with_its_study(whole, tmp_path):
    folder, points = tmp_path / "out", grid(AXES)
    calls = []

    def interrupt(done, of):
        calls.append(done)
        if 0 < done < of:
            raise KeyboardInterrupt

    given = {"metric": blow_energy_again, "processes": 2}
    with pytest.raises(KeyboardInterrupt):
        study(SCENE, points, folder, progress=interrupt, **given)
    finished = {path: path.stat().st_mtime_ns for path in (folder / PARTS).iterdir()}
    found = study(SCENE, points, folder, **given)
    assert finished
    assert {path: path.stat().st_mtime_ns for path in finished} == finished
    np.testing.assert_array_equal(found.rows["blow_energy_again"], whole.rows["blow_energy"])
    for name in set(whole.rows.dtype.names) - {"wall_time"}:
        np.testing.assert_array_equal(found.rows[name], whole.rows[name])
    assert found.to_xarray()["blow_energy_again"].dims == points.keys
    with pytest.raises(ResultError, match="holds another study"):
        study(SCENE, points, folder, metric={"blow_energy_again": soft_only})
    with pytest.raises(ResultError, match="holds another study"):
        study(SCENE, points, folder)


def test_a_metric_that_fails_takes_no_other_number_from_its_point(whole, tmp_path):
    found = study(SCENE, grid(AXES), tmp_path / "out", processes=1, metric=soft_only)
    hard = whole.rows["rate_of_penetration"] < 0.02
    assert 0 < hard.sum() < len(hard)
    np.testing.assert_array_equal(np.isnan(found.rows["soft_only"]), hard)
    np.testing.assert_array_equal(
        found.rows["rate_of_penetration"], whole.rows["rate_of_penetration"]
    )
    told = "metric soft_only: ValueError: too hard"
    assert found.failures == [told if one else "" for one in hard]
    first = f"{hard.sum()} of {len(hard)}, the first at {found.place(int(np.argmax(hard)))}: {told}"
    assert dict(found.headlines())["Failed"] == first
    assert "Failed" not in dict(whole.headlines())


def test_a_metric_that_cannot_be_a_column_or_go_to_processes_is_refused(tmp_path):
    points = grid({"feed.force": [2000.0, 3000.0]})
    for metric in (lambda found: 1.0, {"kind": soft_only}, {"my rate": soft_only}, {"a": 3.0}):
        with pytest.raises(SceneError, match="metric"):
            study(SCENE, points, tmp_path / "out", metric=metric)
    own = {"own": lambda found: 2.0 * found.blow_period}
    with pytest.raises(SimulationError, match=r"metric own: .* or take processes=1"):
        study(SCENE, points, tmp_path / "out", metric=own, processes=2)
    assert not (tmp_path / "out").exists()
    found = study(SCENE, points, tmp_path / "out", metric=own)  # one process, unless asked
    np.testing.assert_array_equal(found.rows["own"], 2.0 * found.rows["blow_period"])


def test_a_rate_has_its_error_where_that_shows(whole):
    rows = whole.rows.copy()
    rows["rate_of_penetration"], rows["rate_of_penetration_error"] = 0.0123456, 1e-12
    rows["rate_of_penetration_error"][1] = np.nan
    made = Study(whole.scene, whole.points, rows, whole.failures)
    assert made.rate_text(0) == "12.3 mm/s"
    assert made.rate_text(1) == "12.3 mm/s, error not estimated"
    told = dict(made.headlines())
    assert told["Lowest rate"] == (
        "12.3 mm/s (44.4 m/h) at feed.force = 1500 N, rock.loading_stiffness = 3e+08 N/m"
    )
    rows["rate_of_penetration_error"] = 2e-4
    assert made.rate_text(0) == "12.35 ± 0.20 mm/s"
    assert "nor are errors of the other numbers" in told["These errors"]


def test_motions_that_are_counted_are_said_to_be_those_of_one_grid(whole):
    def told(scene):
        return dict(Study(scene, whole.points, whole.rows, whole.failures).headlines())

    assert "These motions" not in told(SCENE)  # rigid bodies have none
    for solver in ("wave", "fem"):
        of_grid = told(Scene().computed_by(solver))
        assert of_grid["Points"] == told(SCENE)["Points"]
        assert of_grid["These motions"].startswith("were found with one discretisation")


def test_an_interrupted_study_goes_on_where_it_was(whole, tmp_path):
    """Ctrl-C after two parts; what was finished is not run again."""
    folder = tmp_path / "out"
    interrupted(folder)
    finished = {path.name: path.stat().st_mtime_ns for path in (folder / PARTS).iterdir()}
    assert 0 < len(finished) < 6
    seen = []
    again = study(SCENE, grid(AXES), folder, processes=1, progress=lambda *at: seen.append(at))
    assert seen[0] == (len(finished), 6)
    assert seen[-1] == (6, 6)
    for name, written in finished.items():
        assert (folder / PARTS / name).stat().st_mtime_ns == written
    np.testing.assert_array_equal(
        again.rows["rate_of_penetration"], whole.rows["rate_of_penetration"]
    )


def test_another_study_is_not_mixed_in(tmp_path):
    folder = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        study(
            SCENE, grid(AXES), folder, progress=lambda *_: (_ for _ in ()).throw(KeyboardInterrupt)
        )
    with pytest.raises(ResultError, match="holds another study"):
        study(SCENE.replace(**{"loss.time": 0.0}), grid(AXES), folder)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "letter.txt").write_text("dear")
    with pytest.raises(ResultError, match="is not empty"):
        study(SCENE, grid(AXES), tmp_path / "full", force=True)
    assert (tmp_path / "full" / "letter.txt").read_text() == "dear"


def test_force_replaces_another_study_and_nothing_else(tmp_path):
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    SCENE.to_toml(scene)

    def run(over, *more):
        words = ["study", str(scene), "--over", over, "--processes", "1", "--out", str(out)]
        return CliRunner().invoke(app, [*words, "--no-report", *more])

    assert run("feed.force=1500,2500,4000").exit_code == 0
    (out / "notes.txt").write_text("dear")
    refused = run("feed.force=2500")
    assert isinstance(refused.exception, ResultError)
    assert "--force replaces it" in str(refused.exception)
    assert run("feed.force=nonsense", "--force").exit_code != 0
    assert len(study(SCENE, grid({"feed.force": [1500.0, 2500.0, 4000.0]}), out).rows) == 3
    done = run("feed.force=2500", "--force")
    assert done.exit_code == 0
    assert "1: 1 periodic" in done.stdout
    assert (out / "notes.txt").read_text() == "dear"
    assert len(list((out / PARTS).iterdir())) == 1
    kept = next((out / PARTS).iterdir()).stat().st_mtime_ns
    assert run("feed.force=2500", "--force").exit_code == 0  # the same study goes on
    assert next((out / PARTS).iterdir()).stat().st_mtime_ns == kept


def interrupted(folder):
    """A study that was stopped after its first parts."""

    def stop(done, count):
        if done >= 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study(SCENE, grid(AXES), folder, processes=1, progress=stop)
    return len(list((folder / PARTS).iterdir()))


def test_points_of_other_sources_are_not_mixed_in(tmp_path, monkeypatch):
    """A kernel was edited since, or the folder is older than this check."""
    folder = tmp_path / "out"
    kept = interrupted(folder)
    monkeypatch.setattr("percussion_model.analysis.study.sources_digest", lambda patterns: "edited")
    with pytest.raises(ResultError, match=r"other sources .* than those of now: --force"):
        study(SCENE, grid(AXES), folder, processes=1)
    monkeypatch.undo()
    plan = json.loads((folder / PLAN).read_text())
    older = {key: value for key, value in plan.items() if key != "sources"}
    (folder / PLAN).write_text(to_json(older) + "\n")
    with pytest.raises(ResultError, match="other sources"):
        study(SCENE, grid(AXES), folder, processes=1)
    (folder / PLAN).write_text("[1]")
    monkeypatch.setattr("percussion_model.analysis.study.sources_digest", lambda patterns: "edited")
    with pytest.raises(ResultError, match="are not known to be of this study") as caught:
        study(SCENE, grid(AXES), folder, processes=1)
    assert "--force" not in str(caught.value)  # it would lose the points
    assert len(list((folder / PARTS).iterdir())) == kept


def test_the_hash_of_sources_sees_an_edit_and_a_new_file(tmp_path, monkeypatch):
    (tmp_path / "physics").mkdir()
    (tmp_path / "physics" / "rock.py").write_text("K = 1")
    monkeypatch.setattr(sources, "PACKAGE", tmp_path)
    found = [sources.sources_digest()]
    (tmp_path / "physics" / "rock.py").write_text("K = 2")
    found.append(sources.sources_digest())
    (tmp_path / "physics" / "new.py").write_text("")
    found.append(sources.sources_digest())
    (tmp_path / "terminal.py").write_text("shows")
    assert len(set(found)) == 3
    assert sources.sources_digest() == found[-1]


def test_all_that_computes_a_point_is_in_the_hash():
    """What a worker loads, but for files, tables, warnings and other points."""
    code = (
        "import sys, numpy as np; from percussion_model import Scene; "
        "from percussion_model.analysis.study.response import run_points; "
        "scene = Scene().computed_by('rigid'); "
        "run_points(scene, ('feed.force',), np.array([[2500.0]]), 1e-4, 400, 1e-3); "
        "print(*(m.__file__ for n, m in sys.modules.items() if n.startswith('percussion_model')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    left = {Path(name) for name in done.stdout.split()} - set(sources.source_files(COMPUTING))
    names = {path.relative_to(sources.PACKAGE).as_posix() for path in left}
    of_study = {f"analysis/study/{name}.py" for name in ("__init__", "metrics", "store", "workers")}
    assert names == of_study | {"__init__.py", "analysis/__init__.py"}


def test_a_part_that_was_damaged_is_named(whole, tmp_path):
    study(SCENE, table({"feed.force": [2500.0]}), tmp_path / "out", processes=1)
    part = next((tmp_path / "out" / PARTS).glob("*.npz"))
    part.write_bytes(part.read_bytes()[:100])
    with pytest.raises(ResultError, match=f"{part.name}: cannot be read"):
        study(SCENE, table({"feed.force": [2500.0]}), tmp_path / "out", processes=1)


def die_once(flag, number):
    """A task whose first worker is killed."""
    if number == 1 and not os.path.exists(flag):
        with open(flag, "w"):
            pass
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


@pytest.mark.skipif(os.name == "nt", reason="no SIGKILL there")
def test_a_worker_that_is_killed_loses_nothing(tmp_path):
    tasks = [(str(tmp_path / "flag"), number) for number in range(6)]
    found = dict(workers.on_this_machine(die_once, tasks, 2))
    assert found == {number: number**2 for number in range(6)}


def run_script(folder, text):
    """Run a program in a process of its own; what it has done."""
    (folder / "script.py").write_text(text)
    words = [sys.executable, "script.py"]
    return subprocess.run(
        words, cwd=folder, capture_output=True, text=True, check=False, timeout=120
    )


def test_workers_that_are_ended_within_a_message_hold_nobody_up(tmp_path):
    """The bug: a pool's own thread read on for ever, as the interpreter ended."""
    done = run_script(
        tmp_path,
        "from percussion_model.analysis.study.workers import on_this_machine\n"
        "def work(number):\n"
        "    return bytes(number)\n"
        "if __name__ == '__main__':\n"
        "    print(len(next(on_this_machine(work, [(2_000_000,)] * 20, 2))[1]))\n",
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "2000000\n", "")


@pytest.mark.skipif(os.name == "nt", reason="no masks of signals there")
def test_no_worker_hears_ctrl_c(tmp_path):
    """The bug: the first one did, where nothing before it had started what tracks resources."""
    done = run_script(
        tmp_path,
        "import signal\n"
        "from percussion_model.analysis.study.workers import on_this_machine\n"
        "def work(number):\n"
        "    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])\n"
        "if __name__ == '__main__':\n"
        "    print([deaf for _, deaf in on_this_machine(work, [(k,) for k in range(6)], 3)])\n",
    )
    assert done.stdout == f"{[True] * 6}\n"


def test_a_script_that_workers_run_again_is_told_so(tmp_path):
    done = run_script(
        tmp_path,
        "from percussion_model import Scene\n"
        "from percussion_model.analysis.study import study, table\n"
        "scene = Scene().computed_by('rigid')\n"
        "study(scene, table({'feed.force': range(2000, 2040)}), 'out', processes=2)\n",
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith('under `if __name__ == "__main__":`')
    assert done.stderr.count("Traceback") == 1  # of the script, none of its workers


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is sent to a group of processes")
def test_ctrl_c_ends_a_study_at_once_and_says_what_is_kept(tmp_path):
    """While workers start, and while they work."""
    scene = tmp_path / "scene.toml"
    SCENE.to_toml(scene)
    words = [
        sys.executable,
        "-c",
        "from percussion_model.interface.cli import main; main()",
        "study",
    ]
    words += [str(scene), "--over", "feed.force=1:9000:90000", "--processes", "2"]
    for number, wait in enumerate((2.0, 6.0)):
        out = ["--out", str(tmp_path / f"out{number}")]
        child = subprocess.Popen(
            [*words, *out],
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            # a shell may have started the tests with the signal ignored
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        time.sleep(wait)
        os.killpg(child.pid, signal.SIGINT)
        try:
            _, errors = child.communicate(timeout=30)
        finally:
            child.kill()
        assert child.returncode == 130
        assert "Traceback" not in errors
        if (tmp_path / f"out{number}" / PARTS).is_dir():
            assert "the same command continues" in " ".join(errors.split())


@pytest.mark.skipif(os.name == "nt", reason="no masks of signals there")
def test_ctrl_c_while_workers_start_waits_until_they_are_known():
    """New processes inherit that it is blocked, so that they never hear it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    asks = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))"
    told = []

    def start():
        with workers._interrupts_left_to_this_process():
            os.kill(os.getpid(), signal.SIGINT)
            told.append(subprocess.check_output([sys.executable, "-c", asks], text=True).strip())

    try:
        with pytest.raises(KeyboardInterrupt):
            start()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert told == ["True"]


def test_ctrl_c_while_a_part_is_kept_ends_the_workers(tmp_path):
    """What holds its traceback, as the message does, would let them go on."""
    points = table({"feed.force": list(range(2000, 2400))})

    def interrupt(done, count):
        if done:
            raise KeyboardInterrupt

    others = set(active_children())
    with pytest.raises(KeyboardInterrupt) as held:
        study(SCENE, points, tmp_path / "out", processes=2, progress=interrupt)
    left = set(active_children()) - others
    assert held.tb is not None
    assert not left


def test_ctrl_c_within_compiled_code_is_no_failure_of_a_point(tmp_path, monkeypatch):
    """It comes out as a `SystemError` where numba loads kernels."""

    def interrupted(*words, **options):
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as cause:
            raise SystemError from cause

    monkeypatch.setattr("percussion_model.analysis.study.response.settled", interrupted)
    with pytest.raises(KeyboardInterrupt):
        study(SCENE, table({"feed.force": [2500.0]}), tmp_path / "out", processes=1)


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemError])
def test_ctrl_c_while_the_report_is_written_says_what_is_kept(error, tmp_path, monkeypatch, capsys):
    """It may come out of compiled code as a `SystemError`."""

    def interrupted(found, folder):
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as cause:
            raise error from cause

    monkeypatch.setattr("percussion_model.interface.commands.study._report", interrupted)
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    SCENE.to_toml(scene)
    words = ["study", str(scene), "--over", "feed.force=1500,4000", "--processes", "1"]
    words += ["--out", str(out)]
    assert _guarded(lambda: app(words, standalone_mode=False)) == INTERRUPTED
    told = " ".join(capsys.readouterr().err.split())
    assert told.endswith(f"finished points are kept in {out}, the same command continues")
    assert (out / "points.parquet").is_file()


def test_a_cluster_finds_the_same_and_survives_a_worker(whole, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50
    ) as cluster:
        kept, seen = interrupted(tmp_path / "out"), []  # on this machine: the cluster goes on

        def progress(*at):
            if not seen and os.name != "nt":  # as soon as points are given out
                os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)
            seen.append(at)

        found = study(
            SCENE, grid(AXES), tmp_path / "out", cluster=cluster.scheduler_address,
            progress=progress,
        )  # fmt: skip
        assert (kept, seen[0][0], seen[-1]) == (2, 2, (6, 6))
    for name in set(found.rows.dtype.names) - {"wall_time"}:
        np.testing.assert_array_equal(found.rows[name], whole.rows[name])


def test_the_command_writes_tables_and_tells_what_it_found(tmp_path):
    scene = tmp_path / "scene.toml"
    SCENE.to_toml(scene)
    over = ["--over", "feed.force=1500:2500:2", "--processes", "1"]
    answer = CliRunner().invoke(app, ["study", str(scene), *over, "--out", str(tmp_path / "out")])
    assert answer.exit_code == 0
    assert "2 periodic" in answer.stdout
    written = {"points.csv", "points.parquet", "points.nc", "study.json", "report.html"}
    assert written <= set(os.listdir(tmp_path / "out"))
    plan = json.loads((tmp_path / "out" / "study.json").read_text())
    assert plan["keys"] == ["feed.force"]
    said = ["--set", "feed.force=3"]
    again = CliRunner().invoke(app, ["study", str(scene), *over, *said, "--out", str(tmp_path)])
    assert again.exit_code == 2
    twice = CliRunner().invoke(app, ["study", str(scene), *over, *over, "--out", str(tmp_path)])
    assert twice.exit_code == 2
    assert "pyarrow" not in twice.stderr
