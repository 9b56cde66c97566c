"""Commands that are killed, or told to end, and two of them at once in one place."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from percussion_model.analysis.study.store import Store
from percussion_model.scene.writing import own_prefix, remove_abandoned
from percussion_model.simulation.files import ResultError
from percussion_model.simulation.one_writer import hold
from percussion_model.simulation.origin import Claim

LONG = "PERCUSSION_LONG" in os.environ
ROOT = Path(__file__).parents[1]
RIGID = str(ROOT / "scenarios" / "rigid.toml")
TERMINATED = 143
# No process is left so long after the one that started it [s].
GONE_AFTER = 5.0

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows sends no signals to a child")


def started(code, *words, **options):
    """A process that runs a text of Python."""
    return subprocess.Popen(
        [sys.executable, "-c", code, *map(str, words)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options,
    )  # fmt: skip


def is_there(process):
    """Whether a process runs, and is no corpse that nobody has asked for yet."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def left(processes, within=GONE_AFTER):
    """Those of some processes that are there after that time."""
    end = time.monotonic() + within
    while time.monotonic() < end and any(map(is_there, processes)):
        time.sleep(0.05)
    return [one for one in processes if is_there(one)]


def children(process):
    """All processes below one."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(entry.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
        if parent == process:
            found += [int(entry.parent.name), *children(int(entry.parent.name))]
    return found


needs_proc = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")

# Workers that would be at it for a minute.
WORKERS = """
import time
from pathlib import Path
from percussion_model.analysis.study.workers import on_this_machine
from percussion_model.interface.commands.common import end_script

def work(name):
    Path(name).touch()
    time.sleep(60.0)

if __name__ == "__main__":
    end_script("script", lambda: list(on_this_machine(work, [("one",), ("two",)], 2)))
"""


@needs_proc
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL], ids=lambda one: one.name)
def test_no_worker_outlives_the_process_that_started_it(number, tmp_path):
    """The bug: two workers of 200 MB and a tracker stayed for ever."""
    script = tmp_path / "script.py"
    script.write_text(WORKERS)
    run = subprocess.Popen(
        [sys.executable, str(script)], cwd=tmp_path, stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    while not ((tmp_path / "one").exists() and (tmp_path / "two").exists()):
        assert run.poll() is None
        time.sleep(0.05)
    below = children(run.pid)
    assert len(below) >= 2
    run.send_signal(number)
    run.wait(GONE_AFTER)
    assert run.returncode == (TERMINATED if number == signal.SIGTERM else -number)
    assert left(below) == []
    run.communicate()


RUN = """
import contextlib, sys
from percussion_model.interface import progress

def report(t):
    if t > 1.0 and not told:
        told.append(t)
        print("drilling", flush=True)

told, report.stage = [], lambda name, end: None
progress.progress_bar = lambda end: contextlib.nullcontext(report)
from percussion_model.interface.cli import main
main()
"""


@pytest.mark.parametrize("ignored", [False, True], ids=["plain", "in the background"])
def test_a_run_that_is_told_to_end_keeps_finished_work(ignored, tmp_path):
    """SIGTERM is Ctrl-C with another exit code, also where a shell lets Ctrl-C be ignored."""
    words = ["run", RIGID, "--duration", "1e6", "--out", tmp_path / "out", "--no-error-estimate"]
    ignore = (lambda: signal.signal(signal.SIGINT, signal.SIG_IGN)) if ignored else None
    run = started(RUN, *words, preexec_fn=ignore)
    assert run.stdout.readline() == "drilling\n"
    run.send_signal(signal.SIGTERM)
    _, err = run.communicate(timeout=60)
    assert run.returncode == TERMINATED, err
    assert "percussion: interrupted at t = " in err
    names = {"summary.json", "blows.csv", "events.csv", "scene.toml", "made_by.json"}
    assert set(os.listdir(tmp_path / "out")) == names
    assert os.listdir(tmp_path) == ["out"]


TEMPORARY = """
import sys, tempfile, time
from percussion_model.scene.writing import draft_in, own_prefix
from pathlib import Path
folder = tempfile.mkdtemp(prefix=own_prefix(sys.argv[1]), dir=sys.argv[1])
draft_in(Path(sys.argv[1])).write_text("half")
print(folder, flush=True)
time.sleep(60)
"""


def test_what_a_killed_process_has_left_is_gone_at_the_next_start(tmp_path):
    own = tempfile.mkdtemp(prefix=own_prefix(tmp_path), dir=tmp_path)
    foreign = tmp_path / "percussion-00000000-1-abcd"  # of another machine
    foreign.mkdir()
    (tmp_path / "percussion-notes").write_text("mine")
    run = started(TEMPORARY, tmp_path)
    there = Path(run.stdout.readline().strip())
    assert there.is_dir()
    assert len(os.listdir(tmp_path)) == 5
    remove_abandoned.cache_clear()
    remove_abandoned(str(tmp_path))
    assert len(os.listdir(tmp_path)) == 5  # it is alive
    run.kill()
    run.communicate()
    remove_abandoned.cache_clear()
    remove_abandoned(str(tmp_path))
    assert {path.name for path in tmp_path.iterdir()} == {
        Path(own).name, foreign.name, "percussion-notes",
    }  # fmt: skip


HOLDER = """
import sys, time
from pathlib import Path
from percussion_model.simulation.one_writer import hold
one = hold(Path(sys.argv[1]))
print(one is not None, flush=True)
time.sleep(60)
"""


def test_a_folder_has_one_writer_at_a_time(tmp_path):
    """Of two runs into one folder one is refused, or numbered where no folder was named."""
    folder = tmp_path / "out"
    holder = started(HOLDER, folder)
    try:
        assert holder.stdout.readline() == "True\n"
        assert hold(folder) is None
        for force in (False, True):
            with pytest.raises(ResultError, match="is being written by another process: another"):
                Claim(folder, {"command": "run"}, force)
        numbered = Claim(folder, {"command": "run"}, numbered=True)
        assert numbered.folder.name == "out-2"
        assert "(--force" not in numbered.moved
        with pytest.raises(ResultError, match="is being written by another process: wait until"):
            Store(folder, {"scene": "x"}, force=True)
        assert os.listdir(tmp_path) == []
    finally:
        holder.kill()
        holder.communicate()
    assert Claim(folder, {"command": "run"}).folder == folder
    Store(folder, {"scene": "x"})


# ------------------------------------------------------------------ whole commands

COMMAND = "from fmu_src.command_line import main; main()"
SAVED = {"summary.json", "blows.csv", "events.csv", "scene.toml", "made_by.json"}
# Words, what tells that it is at work, what SIGTERM keeps in the folder, and what is said.
COMMANDS = {
    "study": (
        ["study", RIGID, "--over", "feed.force=1kN:9kN:400", "--over", "drive.force=5kN:9kN:20",
         "--processes", "2", "--out", "out"],
        "of 8000 points", {"study.json", "parts"}, "interrupted; finished points are kept",
    ),
    "run": (["run", RIGID, "--duration", "1e6", "--out", "out"],
            "s simulated", SAVED, "interrupted at t ="),
    "calibrate": (
        ["calibrate", RIGID, "--measured", "penetration=1.5+-0.1 mm @5",
         "--measured", "rebound_velocity=1+-0.1 m/s @5", "--out", "out"],
        " s: ", None, "interrupted before there was a result",  # a fit ends before a second line
    ),
    "couple": (
        ["couple", "system.ssp", "--duration", "1e5", "--out", "out", "--no-figures"],
        "s simulated", {"signals.csv", "made_by.json"}, "it was interrupted",
    ),
}  # fmt: skip


@needs_proc
@pytest.mark.skipif(not LONG, reason="ten seconds each; set PERCUSSION_LONG=1")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL], ids=lambda one: one.name)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_that_is_ended_leaves_nobody_behind(name, number, tmp_path):
    words, working, kept, said = COMMANDS[name]
    (tmp_path / "tmp").mkdir()
    environment = os.environ | {"TMPDIR": str(tmp_path / "tmp"), "PYTHONPATH": str(ROOT)}
    if name == "couple":
        build = [sys.executable, "-c", COMMAND, "system", "FeedControlRigid", "-o", "."]
        subprocess.run(build, cwd=tmp_path, env=environment, check=True, capture_output=True)
        (tmp_path / "FeedControlRigid.ssp").rename(tmp_path / "system.ssp")
    run = started(COMMAND, *words, cwd=tmp_path, env=environment)
    assert any(working in line for line in run.stderr)
    while name == "study" and len(children(run.pid)) < 3:
        time.sleep(0.1)
    below = children(run.pid)
    run.send_signal(number)
    try:
        run.wait(60.0)  # results are written
        assert left(below) == []
    finally:
        run.kill()
        _, err = run.communicate()
    if number == signal.SIGTERM:
        assert run.returncode == TERMINATED
        assert said in " ".join(err.split())
        assert kept is None or set(os.listdir(tmp_path / "out")) == kept
    else:  # the next start removes it
        subprocess.run([sys.executable, "-c", COMMAND, "rocks"], cwd=tmp_path, env=environment,
                       check=True, capture_output=True)  # fmt: skip
    found = [one for one in os.listdir(tmp_path / "tmp") if one.startswith("percussion-")]
    assert found == []


@pytest.mark.skipif(not LONG, reason="half a minute; set PERCUSSION_LONG=1")
def test_two_runs_into_one_folder(tmp_path):
    """One wins or both do: what is there belongs together."""
    for command in (
        ["run", RIGID, "--duration", "3", "--out", "out", "--no-figures"],
        ["study", RIGID, "--over", "feed.force=1kN:9kN:9", "--processes", "1", "--out", "study"],
    ):
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        both = [started(COMMAND, *command, cwd=tmp_path, env=environment) for _ in range(2)]
        errors = [one.communicate(timeout=300)[1] for one in both]
        codes = sorted(one.returncode for one in both)
        assert codes in ([0, 0], [0, 2]), errors
        assert codes == [0, 0] or any("is being written by another" in one for one in errors)
    assert [one for one in os.listdir(tmp_path) if one.startswith(".")] == []
