"""Progress of long commands: lines on a pipe, runs of a request by name, Ctrl-C in one of them."""

from __future__ import annotations

import importlib
import io
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fitting_data import noisy_curve

from percussion_model import Scene, simulate
from percussion_model.analysis.fitting import fit
from percussion_model.analysis.fitting.sampling import walk
from percussion_model.interface import progress
from percussion_model.interface.cli import BAD_INPUT, INTERRUPTED, _guarded, app
from percussion_model.interface.progress import RunProgress, progress_bar
from percussion_model.scene.solver_names import counted
from percussion_model.simulation.accuracy_control import planned_cells
from percussion_model.solvers.base import Solver

ROOT = Path(__file__).parents[1]
BETWEEN_LINES = progress.EVERY  # as it is where no test has changed it
RIGID = str(ROOT / "scenarios" / "rigid.toml")
REFERENCE = str(ROOT / "scenarios" / "reference.toml")
ASKED = Scene().replace(**{"solver.accuracy": 3e-2, "run.check": True})
# Far longer than two lines take, on any machine [s].
PATIENCE = 20.0


class Heard(io.StringIO):
    """A pipe in place of stderr."""

    def wait_for(self, count: int) -> None:
        """Let time pass until there are so many lines of progress."""
        end = time.monotonic() + PATIENCE
        while self.progress() < count and time.monotonic() < end:
            time.sleep(1e-3)

    def progress(self) -> int:
        """Lines that begin with the time that a command has taken."""
        words = [line.split() for line in self.getvalue().splitlines()]
        return sum(len(line) > 2 and line[1] == "s:" for line in words)


@pytest.fixture
def heard(monkeypatch):
    """Progress comes often, to a stderr that is no terminal."""
    monkeypatch.setattr(progress, "EVERY", 5e-3)
    pipe = Heard()
    # pytest puts its own stderr in place when a test begins
    monkeypatch.setattr(progress, "sys", SimpleNamespace(stderr=pipe))
    monkeypatch.setattr(progress, "LOADING", 0.0)
    monkeypatch.setattr(progress, "_before", [])
    return pipe


def slow(heard):
    """A piece of work that takes as long as two lines of progress, then ends in Ctrl-C."""

    def work(*words, **options):
        heard.wait_for(2)
        raise KeyboardInterrupt

    return work


def test_lines_come_before_a_reader_takes_a_command_for_dead():
    assert 0.0 < BETWEEN_LINES <= 5.0


def test_lines_after_the_first_are_rare(heard, monkeypatch):
    """A compile of nine minutes had 180 of them."""
    assert BETWEEN_LINES * progress.RARER == 30.0
    monkeypatch.setattr(progress, "EVERY", 0.02)
    monkeypatch.setattr(progress, "RARER", 1e4)
    with progress.lines("compiling"):
        heard.wait_for(1)
        time.sleep(0.1)
        assert heard.progress() == 1
    with progress.lines("a second piece of work, right after it"):
        time.sleep(0.1)
        assert heard.progress() == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", RIGID],
        ["run", REFERENCE, "--accuracy", "1e-3"],
        ["plot", RIGID, "--out", "out"],
        ["settled", RIGID],
        ["explain", RIGID],
        ["study", RIGID, "--over", "feed.force=1000:5000:3", "--out", "out", "--processes", "1"],
        ["compare", RIGID, "--solvers", "rigid", "--no-figures"],
        ["accuracy", REFERENCE, "--no-figures", "--out", "out"],
        ["effects", RIGID, "--no-figures"],
        ["paper", "--out", "out", "--processes", "1"],
        ["stability", "gamma_40", "--workers", "1"],
    ],
    ids=lambda words: " ".join([words[0], *words[2:3]]),
)
def test_every_command_says_on_a_pipe_that_it_runs(arguments, heard, tmp_path, monkeypatch):
    """Whatever a command does, it makes a solver: which never comes back here."""
    if arguments[0] in ("paper", "plot", "study"):
        pytest.importorskip("matplotlib")
        pytest.importorskip("xarray")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Solver, "__init__", slow(heard))
    code = _guarded(lambda: app(arguments, standalone_mode=False))
    assert code == INTERRUPTED, heard.getvalue()
    assert heard.progress() >= 2


def test_a_calibration_says_on_a_pipe_that_it_runs(heard, tmp_path, monkeypatch):
    """Its work is held up where it reads the curve, and at the end of each walk."""
    curve = noisy_curve(1)
    columns = np.column_stack([curve.penetration, curve.force])
    np.savetxt(tmp_path / "slow.csv", columns, delimiter=",",
               header="penetration,force", comments="")  # fmt: skip
    read = Path.open

    def held(path, *words, **options):
        if path.name == "slow.csv":
            heard.wait_for(2)
        return read(path, *words, **options)

    def slow_walk(*words):
        met = walk(*words)
        heard.wait_for(heard.progress() + 1)
        return met

    monkeypatch.setattr(Path, "open", held)
    monkeypatch.setattr(fit, "walk", slow_walk)
    words = ["calibrate", str(ROOT / "scenarios" / "drop_test.toml"), "--curve"]
    code = _guarded(lambda: app([*words, str(tmp_path / "slow.csv")], standalone_mode=False))
    assert code != BAD_INPUT
    assert heard.progress() >= 2
    for line in heard.getvalue().splitlines():
        if "descent" in line:
            assert " of " not in line, "how many computations a descent needs is not known"
        if counted := re.search(r"(\d+) of (\d+) computations", line):
            done, planned = map(int, counted.groups())
            assert done <= planned, line
    assert re.search(r"walk \d of \d: \d+ of \d+ computations", heard.getvalue())


def test_short_pieces_of_work_in_a_row_are_not_silent_together(heard, monkeypatch):
    """Each ends before a line is due, all of them do not; loading counts as well."""
    monkeypatch.setattr(progress, "EVERY", 0.2)
    for k in range(4):
        with progress.lines(f"piece {k}"):
            time.sleep(0.15)
    assert 1 <= heard.progress() <= 3
    heard.truncate(0)
    monkeypatch.setattr(progress, "_before", [])
    monkeypatch.setattr(progress, "LOADING", 0.15)
    with progress.lines("after loading"):
        heard.wait_for(1)
        assert heard.progress() == 1


def test_what_ends_soon_says_nothing(heard, monkeypatch):
    monkeypatch.setattr(progress, "EVERY", PATIENCE)
    with progress.lines("short"):
        pass
    assert heard.getvalue() == ""


def test_a_line_tells_time_share_and_what_is_left():
    clock = SimpleNamespace(now=0.0)
    lines = progress.Lines("preparing", lambda: clock.now)
    clock.now = 10.0
    assert lines.line() == "  10 s: preparing"
    clock.now = 12.0
    lines.begin("run 2")
    clock.now = 30.0
    lines.show("run 2, 3 s of 4 s simulated", 0.75)
    assert lines.line() == "  30 s: run 2, 3 s of 4 s simulated, 75%, about 6 s left"
    clock.now = 40.0
    lines.show("all but done", 0.01)  # too early to tell what is left
    assert lines.line() == "  40 s: all but done, 1%"


def test_what_is_left_is_told_of_each_part_and_only_where_its_pace_is_even():
    clock = SimpleNamespace(now=0.0)
    lines = progress.Lines("runs", lambda: clock.now)
    for second in range(101):
        clock.now = float(second)
        lines.show("run 1 of 2", second / 100.0)
    lines.show("run 2 of 2", 0.0)
    clock.now = 110.0
    lines.show("run 2 of 2", 0.5)  # in ten seconds; the hundred before count no more
    assert lines.line() == " 110 s: run 2 of 2, 50%, about 10 s left"
    clock.now = 117.0  # and then it stops: who knows for how long
    assert lines.line() == " 117 s: run 2 of 2, 50%"


def test_a_slow_start_is_not_taken_for_the_pace():
    clock = SimpleNamespace(now=0.0)
    lines = progress.Lines("runs", lambda: clock.now)
    for k in range(20_001):  # told often, as a coupled run is
        clock.now = 18.0 + 6.0 * k / 20_000
        lines.show("runs", 0.35 * k / 20_000)
    assert lines.line() == "  24 s: runs, 35%"


def test_what_has_no_share_is_not_in_the_pace():
    """A minute of compilation says nothing of the runs, before them or among them."""
    clock = SimpleNamespace(now=0.0)
    lines = progress.Lines("runs", lambda: clock.now)
    for begun in (0.0, 70.0):
        clock.now = begun
        lines.show("compiling", None)
        clock.now = begun + 30.0
        lines.show("compiling another", None)
        assert lines.line() == f"{clock.now:4.0f} s: compiling another"
        for second in range(10):
            clock.now = begun + 60.0 + second
            lines.show("runs", (10 * (begun > 0.0) + second) / 40.0)
        left = 31 if begun == 0.0 else 21
        assert lines.line().endswith(f", about {left} s left")


def test_work_within_work_leaves_what_is_aside_aside(heard):
    with progress.lines("outer") as report:
        report("compiling", None)
        since = progress._running[0].aside
        with progress.lines("inner") as inner:
            inner("half", 0.5)
            assert progress._running[0].aside is None
        assert progress._running[0].aside == since is not None


def test_what_begins_late_is_judged_by_what_is_done_since():
    clock = SimpleNamespace(now=0.0)
    lines = progress.Lines("scenes", lambda: clock.now)
    clock.now = 100.0
    lines.begin("scene 2 of 2", 0.5)
    clock.now = 110.0
    lines.show("scene 2 of 2", 0.75)
    assert lines.line() == " 110 s: scene 2 of 2, 75%, about 10 s left"


def test_the_place_of_a_run_in_a_long_row_is_known():
    told = []
    runs = RunProgress(lambda text, share: told.append((text, share)), 0.0)
    runs.stage("run 2 of 2", 3.0, before=1.0, whole=4.0)
    runs(1.0)
    assert told[-1] == ("run 2 of 2, 1 s of 3 s simulated", 0.5)


def test_what_goes_on_is_neither_all_done_nor_about_to_end():
    clock = SimpleNamespace(now=0.0)
    lines = progress.Lines("runs", lambda: clock.now)
    clock.now = 400.0
    lines.show("278 of 279 runs", 278 / 279)
    assert lines.line() == " 400 s: 278 of 279 runs, 99%, a few s left"
    clock.now = 430.0  # the last one takes its time
    assert lines.line() == " 430 s: 278 of 279 runs, 99%, about 30 s left"
    lines.show("279 of 279 runs", 1.0)
    clock.now = 440.0
    assert lines.line() == " 440 s: 279 of 279 runs, finishing"


def test_what_is_done_within_a_command_is_told_in_its_lines(heard):
    with progress.lines("outer"):
        with progress_bar(4.0) as report:
            report(1.0)
            count = heard.progress()
            heard.wait_for(count + 2)
            report.stage("run 2 of 3 with 40 cells", 2.0)
            heard.wait_for(count + 4)
        heard.wait_for(heard.progress() + 2)
    told = heard.getvalue()
    assert "1 s of 4 s simulated, 25%" in told
    assert "run 2 of 3 with 40 cells, 0 s of 2 s simulated, 0%" in told
    assert told.splitlines()[-1].endswith("outer")


def test_figures_are_told_one_by_one(heard, tmp_path, monkeypatch):
    """Each is held up until two lines have been printed meanwhile."""
    pytest.importorskip("matplotlib")
    plotting = importlib.import_module("percussion_model.interface.plotting")
    for name in ("overview", "motion", "activation", "stress"):
        monkeypatch.setattr(plotting, f"draw_{name}", waiting(heard, f"draw_{name}", plotting))
    monkeypatch.chdir(tmp_path)
    words = ["plot", REFERENCE, "--out", "out", "--duration", "0.3", "--settle", "0.1"]
    assert not _guarded(lambda: app(words, standalone_mode=False))
    shown = [name for name in plotting.CAPTIONS if name not in plotting.OF_STRINGS]
    for k, name in enumerate(shown, 1):
        assert f"drawing figure {k} of 4, {name}" in heard.getvalue()


def waiting(heard, name, module):
    """That function of a module, which begins after two more lines."""
    work = getattr(module, name)

    def wait(*words):
        heard.wait_for(heard.progress() + 2)
        return work(*words)

    return wait


def test_the_parts_of_the_paper_are_told(heard, tmp_path, monkeypatch):
    """The first part and the first sweep are held up; the sweep ends in Ctrl-C."""
    pytest.importorskip("matplotlib")
    runs = importlib.import_module("percussion_model.verification.paper.runs")
    law = importlib.import_module("percussion_model.verification.paper.rock_law")
    monkeypatch.setattr(runs, "run_drops", lambda scene: heard.wait_for(heard.progress() + 2))
    monkeypatch.setattr(law, "run_sinking", lambda scene: {})

    def sweep(scene, sweep, folder, processes, report):
        report(3, 31)
        heard.wait_for(heard.progress() + 2)
        raise KeyboardInterrupt

    monkeypatch.setattr(runs, "run_sweep", sweep)
    style = importlib.import_module("percussion_model.interface.plotting.style")
    monkeypatch.setattr(style, "save_figures", lambda *words, **more: [])
    words = ["paper", "--out", str(tmp_path / "out")]
    assert _guarded(lambda: app(words, standalone_mode=False)) == INTERRUPTED
    count = 4 + len(runs.SWEEPS)
    assert f"part 1 of {count}, drop tests and sinking, figure 6" in heard.getvalue()
    assert f"3 of 31 points of figure 9a, part 2 of {count}, 9%" in heard.getvalue()
    words = [*words, "--only", "figure9"]
    assert _guarded(lambda: app(words, standalone_mode=False)) == INTERRUPTED
    assert f"points of figure 9a, part 1 of {1 + len(runs.SWEEPS)}, 9%" in heard.getvalue()


def test_one_figure_of_the_paper_is_computed_alone_and_a_run_of_all_goes_on(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    runs = importlib.import_module("percussion_model.verification.paper.runs")
    monkeypatch.chdir(tmp_path)
    words = ["paper", "--out", "out", "--only", "figure6", "--pdf"]
    assert _guarded(lambda: app(words, standalone_mode=False)) == 0
    made = {path.name for path in Path("out").iterdir() if path.name[0] != "."}
    assert made == {"made_by.json", *(f"figure6.{kind}" for kind in ("pdf", "png", "svg"))}
    assert Path("out/figure6.pdf").read_bytes().startswith(b"%PDF")
    monkeypatch.setattr(runs, "run_drops", lambda scene: (_ for _ in ()).throw(KeyboardInterrupt))
    assert _guarded(lambda: app(words[:3], standalone_mode=False)) == INTERRUPTED  # not refused
    assert _guarded(lambda: app([*words, "--json", "-"], standalone_mode=False)) == 2


# ----------------------------------------------------------------- several runs


def test_a_request_names_its_runs():
    scene = Scene().replace(**{"run.duration": 0.4, "run.settle": 0.1})
    told, times = [], []
    simulate(scene, accuracy=3e-2, check=True, progress=times.append,
             stage=lambda name, end: told.append((name, end, len(times))))  # fmt: skip
    names = [name for name, *_ in told]
    assert len(names) >= 2
    for k, name in enumerate(names, 1):
        assert name.startswith(f"run {k} of ")
        assert name.endswith(f" {counted(scene.solver_name)}")
    assert all(end == 0.4 for _, end, _ in told)
    places = [place for *_, place in told]  # each run moves the bar
    assert places == sorted(set(places))
    assert places[-1] < len(times)


def test_the_runs_that_tell_the_error_are_named_and_move_the_bar():
    scene = Scene().replace(**{"run.duration": 0.6, "run.settle": 0.1})
    told, times = [], []
    simulate(scene, progress=times.append, error_estimate=True,
             stage=lambda name, end: told.append((name, len(times))))  # fmt: skip
    assert len(told) >= 1
    assert all(name.startswith("error of the means, run ") for name, _ in told)
    assert told[-1][1] < len(times)


def interrupt_in(monkeypatch, name_of_run):
    """Ctrl-C as soon as a run of this name has begun."""
    module = importlib.import_module("percussion_model.simulation.simulate")
    work, armed, sent = module.run_in_chunks, [], []
    longer = module._Stages.longer

    def told(stages, end):
        if stages.name.startswith(name_of_run):
            armed.append(stages.name)
        longer(stages, end)

    def run(simulation, *words):
        if armed and not sent:
            sent.append(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
        return work(simulation, *words)

    monkeypatch.setattr(module._Stages, "longer", told)
    monkeypatch.setattr(module, "run_in_chunks", run)


@pytest.mark.parametrize(
    ("words", "run"),
    [
        (["--accuracy", "3e-2", "--check"], f"run {len(planned_cells(ASKED))} of"),
        ([], "error of the means"),
    ],
    ids=["finer run", "error estimate"],
)
def test_ctrl_c_in_another_run_keeps_the_first_and_has_its_code(words, run, monkeypatch, capsys):
    interrupt_in(monkeypatch, run)
    call = ["run", REFERENCE, "--duration", "0.6", "--settle", "0.1", *words]
    code = _guarded(lambda: app(call, standalone_mode=False))
    said = capsys.readouterr()
    assert code == INTERRUPTED
    assert "percussion: interrupted" in said.err
    assert "Rate of penetration" in said.out


def test_a_whole_process_tells_that_it_runs():
    """A command in a process of its own, whose stderr is a pipe."""
    script = (
        "import percussion_model.interface.progress as progress; progress.EVERY = 0.02\n"
        "from percussion_model.interface.cli import main; main()"
    )
    child = subprocess.Popen(
        [sys.executable, "-c", script, "run", RIGID, "--duration", "1e6"],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    lines = [child.stderr.readline() for _ in range(3)]
    child.kill()
    child.communicate()
    assert all(" s: " in line for line in lines)
