"""The entry script: what it says without a network and without a .venv."""

import importlib.util
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture
def build(monkeypatch, tmp_path):
    """The script as a module, with its .venv in a temporary folder."""
    spec = importlib.util.spec_from_file_location("build_script", ROOT / "build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "VENV", tmp_path / ".venv")
    monkeypatch.setattr(module, "STAMP", tmp_path / ".venv" / "stamp")
    monkeypatch.setattr(module, "COMPILED", tmp_path / ".venv" / "compiled")
    return module


def test_help_needs_nothing_but_python():
    # -S and -E keep out everything installed: only the standard library is left.
    done = subprocess.run(
        [sys.executable, "-S", "-E", str(ROOT / "build.py"), "--help"],
        capture_output=True,
        text=True,
        check=True,
    )
    for command in ("setup", "run", "fmu", "test", "bench"):
        assert command in done.stdout


def test_an_old_python_is_told_which_one_to_install(build):
    message = build.missing_requirement((3, 9, 2), {"venv": True, "ensurepip": True})
    assert "3.9" in message
    assert "3.11 or newer" in message


def test_a_python_without_venv_is_told_what_to_install(build):
    message = build.missing_requirement((3, 12, 1), {"venv": True, "ensurepip": False})
    assert "ensurepip" in message
    assert "python3.12-venv" in message


def test_a_complete_python_is_told_nothing(build):
    assert build.missing_requirement((3, 11, 0), {"venv": True, "ensurepip": True}) == ""


def test_making_a_venv_says_that_it_still_runs(build, monkeypatch, capsys):
    """It takes up to ten seconds, of which the module says nothing itself."""
    monkeypatch.setattr(build, "EVERY", 1e-3)
    assert build.make_venv(renew=False) == 0
    assert "s: making .venv" in capsys.readouterr().err
    assert build.tool("python").exists()


def test_setup_ends_with_an_error_where_venv_is_missing(build, monkeypatch, capsys):
    monkeypatch.setattr(build.importlib.util, "find_spec", lambda name: None)
    assert build.setup() == 1
    assert "venv" in capsys.readouterr().err


def test_the_stamp_follows_requirements_and_python(build):
    stamp = build.wanted_stamp(b"a", (3, 11, 7))
    assert stamp == build.wanted_stamp(b"a", (3, 11, 9))
    assert stamp != build.wanted_stamp(b"b", (3, 11, 7))
    assert stamp != build.wanted_stamp(b"a", (3, 12, 0))


def test_setup_installs_once(build, monkeypatch):
    calls = []

    def pretend(command, **variables):
        calls.append([str(part) for part in command])
        build.tool("python").parent.mkdir(parents=True, exist_ok=True)
        build.tool("python").touch()
        return 0

    monkeypatch.setattr(build, "call", pretend)
    assert build.install() == 0
    assert [words[-1] for words in calls] == [str(build.VENV), ".[dev]"]
    assert build.setup() == 0
    assert calls[2][-1] == "fmu_src.warm_up"
    assert build.setup() == 0
    assert len(calls) == 3


def test_compiling_that_failed_is_tried_again(build, monkeypatch):
    monkeypatch.setattr(build, "install", lambda: 0)
    monkeypatch.setattr(build, "call", lambda command, **variables: 3)
    assert build.setup() == 3
    assert not build.COMPILED.exists()


def test_a_failed_installation_is_tried_again(build, monkeypatch):
    monkeypatch.setattr(build, "make_venv", lambda renew: 0)
    monkeypatch.setattr(build, "call", lambda command, **variables: 3)
    assert build.setup() == 3
    assert not build.STAMP.exists()


def test_an_environment_of_another_python_is_renewed(build, monkeypatch):
    asked = []
    build.VENV.mkdir()
    build.STAMP.write_text("3.10 0000")
    monkeypatch.setattr(build, "make_venv", lambda renew: asked.append(renew) or 1)
    assert build.setup() == 1
    assert asked == [True]


def test_test_runs_every_step_and_reports_the_first_failure(build, monkeypatch, capsys):
    names = []

    def pretend(command, **variables):
        names.append(Path(command[0]).stem)
        assert variables["MPLBACKEND"] == "Agg"
        assert Path(variables["NUMBA_CACHE_DIR"]).is_dir()
        return {"mypy": 7, "pytest": 1}.get(names[-1], 0)

    monkeypatch.setattr(build, "install", lambda: 0)
    monkeypatch.setattr(build, "call", pretend)
    assert build.main(["test", "-k", "rock"]) == 7
    assert names[-1] == "pytest"  # whose closing line is to be the last
    # the kernels are compiled beside the checks
    assert sorted(names) == ["lint-imports", "mypy", "pytest", "python", "ruff", "ruff"]
    assert "== pytest" in capsys.readouterr().out


def test_run_begins_with_the_fmu_beside_the_library(build, monkeypatch):
    commands = []
    monkeypatch.setattr(build, "setup", lambda: 0)
    monkeypatch.setattr(build, "call", lambda command, **variables: commands.append(command) or 0)
    assert build.main(["run"]) == 0
    assert [words[1:] for words in commands] == [["-m", "fmu_src.compare"], build.REFERENCE_RUN]


def test_fmu_passes_its_arguments_on(build, monkeypatch):
    commands = []
    monkeypatch.setattr(build, "setup", lambda: 0)
    monkeypatch.setattr(build, "call", lambda command, **variables: commands.append(command) or 0)
    words = ["--scene", "scenarios/rigid.toml", "-o", "dist/Rigid.fmu"]
    assert build.main(["fmu", *words]) == 0
    assert commands[0] == [build.tool("percussion"), "fmu", *words]


def test_run_passes_extra_arguments_on(build, monkeypatch):
    commands = []
    monkeypatch.setattr(build, "setup", lambda: 0)
    monkeypatch.setattr(build, "call", lambda command, **variables: commands.append(command) or 0)
    assert build.main(["run", "--cells", "40"]) == 0
    assert commands[0][1:] == [*build.REFERENCE_RUN, "--cells", "40"]


@pytest.mark.parametrize("arguments", [[], ["nonsense"], ["setup", "--what"]])
def test_wrong_arguments(build, arguments):
    with pytest.raises(SystemExit) as caught:
        build.main(arguments)
    assert caught.value.code == 2


def test_a_missing_program_is_named(build, capsys):
    assert build.call([build.tool("percussion")]) == 1
    assert "percussion" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="signals to a process group")
def test_ctrl_c_lets_the_program_finish_and_returns_130(tmp_path):
    child = (
        "import pathlib, sys, time\n"
        "folder = pathlib.Path(sys.argv[1])\n"
        "try:\n"
        "    (folder / 'started').touch(); time.sleep(60)\n"
        "except KeyboardInterrupt:\n"
        "    time.sleep(0.6); (folder / 'kept').touch()\n"
    )
    script = (
        # a shell starts what runs in its background deaf to Ctrl-C
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"import sys; sys.path.insert(0, {str(ROOT)!r}); import build\n"
        f"build.run = lambda extra: build.call([sys.executable, '-c', {child!r}, "
        f"{str(tmp_path)!r}])\n"
        "sys.exit(build.main(['run']))\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 30
    while not (tmp_path / "started").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert errors.strip() == "Interrupted."
    assert (tmp_path / "kept").exists()


def test_a_silent_program_is_said_to_run(build, monkeypatch, capsys):
    assert 0.0 < build.EVERY <= 5.0
    assert build.EVERY * build.RARER == 30.0
    monkeypatch.setattr(build, "EVERY", 0.01)
    heard = "import sys; sys.exit(len(sys.stdin.readline()))"  # ends when it is told to
    sent = []

    class Child(subprocess.Popen):
        def __init__(self, words, **options):
            super().__init__(words, stdin=subprocess.PIPE, text=True, **options)

        def wait(self, timeout=None):
            if timeout is not None and len(sent) == 2:
                self.stdin.write("end\n")
                self.stdin.flush()
                timeout = None
            sent.append(timeout)
            return super().wait(timeout)

    monkeypatch.setattr(build.subprocess, "Popen", Child)
    assert build.call([sys.executable, "-c", heard], silent="compiling") == 4
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert all(line.endswith(" s: compiling") for line in lines)
