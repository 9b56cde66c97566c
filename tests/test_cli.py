"""The command line: output, errors, Ctrl-C."""

import importlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from percussion_model.engine import library
from percussion_model.engine.compiler import NoCompilerError
from percussion_model.interface import progress
from percussion_model.interface.cli import BAD_INPUT, INTERRUPTED, _guarded, app
from percussion_model.interface.commands import common
from percussion_model.interface.commands.common import needs_extra, print_message

SCENARIOS = Path(__file__).parents[1] / "scenarios"
RIGID = str(SCENARIOS / "rigid.toml")
SHORT = ["--duration", "0.5", "--settle", "0.1"]


@pytest.fixture
def percussion(capsys):
    """Run the command in this process; return its exit code, stdout and stderr."""

    def call(*arguments):
        words = [str(word) for word in arguments]
        code = _guarded(lambda: app(words, standalone_mode=False))
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return call


# ---------------------------------------------------------------------------- run


def test_json_on_stdout_is_one_object_and_nothing_else(percussion):
    code, out, err = percussion("run", RIGID, *SHORT, "--json", "-")
    assert (code, err) == (0, "")
    summary = json.loads(out)
    assert summary["solver"] == "rigid"
    assert summary["duration"] == 0.5
    assert summary["settle"] == 0.1
    assert summary["warnings"] == []
    assert summary["rate_of_penetration"] > 0.01


def test_what_a_refused_command_was_to_say_is_forgotten(percussion):
    common._moved.append("out/FeedControl holds another result: this one goes elsewhere")
    code, _, err = percussion("run", RIGID, *SHORT, "--json", "-")
    assert (code, err) == (0, "")


def test_the_table_names_the_rate(percussion):
    code, out, _ = percussion("run", RIGID, *SHORT)
    assert code == 0
    assert "Rate of penetration" in out


def test_results_and_json_go_to_files(percussion, tmp_path):
    out, summary = tmp_path / "results", tmp_path / "summary.json"
    code, _, err = percussion(
        "run", RIGID, *SHORT, "--trace", "1e-3", "--out", out, "--json", summary, "--no-figures"
    )
    assert code == 0
    names = {path.name for path in out.iterdir()}
    told = " ".join(err.split())
    files = {"summary.json", "blows.csv", "events.csv", "trace.csv", "scene.toml"}
    assert told.startswith(f"wrote to {out}/: ")
    assert all(name in told for name in files)
    assert told.endswith(f"wrote {summary}")
    assert names == files | {"made_by.json"}
    assert json.loads(summary.read_text()) == json.loads((out / "summary.json").read_text())


def test_settings_and_solver_change_the_scene(percussion):
    reference = SCENARIOS / "reference.toml"
    code, out, _ = percussion(
        "run", reference, *SHORT, "--solver", "rigid", "--set", "feed.force=4000", "--json", "-"
    )
    summary = json.loads(out)
    assert (code, summary["solver"]) == (0, "rigid")
    faster = summary["rate_of_penetration"]
    _, out, _ = percussion("run", RIGID, *SHORT, "--json", "-")
    assert faster > 1.01 * json.loads(out)["rate_of_penetration"]


def test_cells_are_passed_on(percussion):
    code, out, _ = percussion(
        "run", SCENARIOS / "reference.toml", "--duration", "0.01", "--settle", "0", "--cells",
        "40", "--solver", "wave", "--json", "-",
    )  # fmt: skip
    assert code == 0
    assert json.loads(out)["cells"] == {"piston": 40, "bit": 46}


def test_an_accuracy_is_asked_for(percussion):
    code, out, _ = percussion("run", RIGID, *SHORT, "--accuracy", "1e-2", "--json", "-")
    summary = json.loads(out)
    assert code == 0
    assert summary["rate_of_penetration_relative_error"] <= 1e-2
    code, _, err = percussion("run", RIGID, *SHORT, "--accuracy", "1e-2", "--cells", "40")
    assert code == BAD_INPUT
    assert "both choose the resolution" in err
    code, _, err = percussion("run", RIGID, *SHORT, "--check")
    assert code == BAD_INPUT
    assert "solver.accuracy" in err


@pytest.mark.parametrize("command", ["run", "explain"])
@pytest.mark.parametrize(
    ("scene", "reason"), [("undamped", "effects.loss = false"), ("drop_test", "a bit alone")]
)
def test_an_accuracy_of_no_rate_is_refused_in_one_line(percussion, command, scene, reason):
    file = str(SCENARIOS / f"{scene}.toml")
    for asked in (["--accuracy", "1e-3"], ["--set", "solver.accuracy=1e-3"]):
        code, out, err = percussion(command, file, *asked)
        assert (code, out) == (BAD_INPUT, "")
        assert err.count("\n") == 1
        assert "solver.accuracy = 0.001" in err
        assert reason in err


# ------------------------------------------------------------------- other commands


def test_explain(percussion):
    code, out, _ = percussion(
        "explain", SCENARIOS / "reference.toml", "--set", "effects.loss=false"
    )
    assert code == 0
    out = " ".join(out.replace("│", " ").split())
    for text in (
        "loss",
        "wave",
        "24 in the piston",
        "loss.time",
        "A blow",
        "ms to compute; ",
        "Predicted cost",
        "within a factor of 2",
        "Bit transit time (T_2)",
    ):
        assert text in out


def test_explain_says_why_a_solver_was_taken(percussion):
    for words, said in (([], "modal (auto: elastic bars with loss)"), (["--solver", "fem"], "fem")):
        _, out, _ = percussion("explain", SCENARIOS / "reference.toml", *words)
        assert re.search(rf"Solver +│ {re.escape(said)} +│", out)


def test_explain_shows_no_rounding_as_an_error_of_the_wave_speed(percussion):
    waves = [SCENARIOS / "reference.toml", "--solver", "wave", "--cells", "23"]
    for words, error in (([], False), (["--set", "bit.sections.0.length=0.005"], True)):
        code, out, _ = percussion("explain", *waves, *words)
        assert code == 0
        out = " ".join(out.replace("│", " ").split())
        assert bool(re.search(r"Wave speed error \d[\d.]* %", out)) == error


def test_explain_promises_runs_for_the_error_only_where_there_are_any(percussion):
    wave, promise = SCENARIOS / "reference.toml", "the short runs that show its error come on top"
    rigid = "no short runs on top, since there are no cells whose error they would show"
    undamped = "without loss its error by the cells is not known, and no run looks for it"
    for words, said in (
        ([wave], promise),
        ([RIGID], rigid),
        ([wave, "--solver", "rigid"], rigid),
        ([SCENARIOS / "undamped.toml"], undamped),
    ):
        code, out, _ = percussion("explain", *words)
        assert code == 0
        out = " ".join(out.replace("│", " ").split())
        assert said in out
        assert (promise in out) == (said == promise)


@pytest.mark.parametrize("command", ["explain", "settled"])
def test_a_bar_shows_what_a_command_waits_for(percussion, command, monkeypatch):
    monkeypatch.setattr(progress, "_PATIENCE", 0.0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    module = importlib.import_module("percussion_model.analysis.cost")
    work = module.forecast
    monkeypatch.setattr(module, "forecast", lambda scene: time.sleep(0.3) or work(scene))
    module = importlib.import_module("percussion_model.analysis.stationary")
    settle = module.settled
    monkeypatch.setattr(
        module, "settled", lambda *words, **more: time.sleep(0.3) or settle(*words, **more)
    )
    code, _, err = percussion(command, RIGID)
    assert code == 0
    assert {"explain": "trying the first blows", "settled": "preparing"}[command] in err


def test_who_waits_for_the_compiler_is_told_so_once(percussion, monkeypatch):
    """And it is compiled there: not while something is computed."""
    places, made = [Path("place", "of", "libraries"), None], []
    monkeypatch.setattr(library, "place_to_compile", lambda name: places.pop(0))
    monkeypatch.setattr(library, "make", lambda name, report: made.append(name))
    _, _, err = percussion("run", RIGID, *SHORT)
    assert " ".join(err.split()) == (
        "percussion: compiling the solver rigid: once, for about a minute; kept in "
        f"{Path('place', 'of', 'libraries')}"
    )
    assert percussion("run", RIGID, *SHORT)[2] == ""
    assert made == ["rigid"]


def test_new_writes_a_scene_that_runs_and_keeps_existing_files(percussion, tmp_path):
    path = tmp_path / "mine.toml"
    assert percussion("new", path)[0] == 0
    text = path.read_text()
    assert percussion("run", path, "--solver", "rigid", *SHORT)[0] == 0
    path.write_text(text + "# mine\n")
    code, _, err = percussion("new", path)
    assert code == BAD_INPUT
    assert "exists already" in err
    assert path.read_text().endswith("# mine\n")
    assert percussion("new", path, "--force")[0] == 0
    assert path.read_text() == text


def test_version(percussion):
    code, out, _ = percussion("--version")
    assert code == 0
    assert out.startswith("percussion ")


# ------------------------------------------------------------------------ bad input


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[rock", "not valid TOML"),
        ("[rock]\nunloding_ratio = 5", "did you mean rock.unloading_ratio?"),
        ('[feed]\nforce = "much"', "feed.force"),
        ("[[bit.sections]]\nlength = -1.0\narea = 1e-3", "bit.sections.0.length = -1.0 m"),
        ("[[bit.sections]]\nlength = 0.2\narea = 0.0", "bit.sections.0.area = 0.0 m^2"),
        ("[rock]\nunloading_ratio = 1.0", "rock.unloading_ratio = 1.0: must be a number above 1"),
        ("[feed]\nforce = nan", "feed.force = nan N"),
        ("[run]\nduration = 0", "run.duration = 0 s"),
        ('[piston]\nmodel = "absent"', "needs a piston"),
    ],
)
def test_bad_scenes_are_one_message_on_stderr(percussion, tmp_path, text, message):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    code, out, err = percussion("run", path, "--json", "-", "--out", tmp_path / "out")
    assert (code, out) == (BAD_INPUT, "")
    assert message in err
    assert "Traceback" not in err
    assert err.count("\n") == 1
    assert os.listdir(tmp_path) == ["scene.toml"]


def test_what_is_missing_is_in_the_extra_that_is_named():
    for package, extra in (("numba.core", "compile"), ("scipy", "fit"), ("fmpy", "fmu")):
        told = needs_extra(ImportError(name=package), "fmu")
        assert told.endswith(f'is missing: pip install "percussion_model[{extra}]"')


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "nowhere.toml"], "there is no such scene file"),
        (["run", RIGID, "--duration", "0"], "run.duration"),
        (["run", RIGID, "--duration", "nan"], "run.duration"),
        (["run", RIGID, "--settle", "9"], "run.settle"),
        (["run", RIGID, "--trace", "0"], "trace"),
        (["run", RIGID, "--set", "feed.force"], "KEY=VALUE"),
        (["run", RIGID, "--set", "feed.farce=1"], "did you mean feed.force?"),
        (["run", RIGID, "--set", "hammer.feed=1"], "did you mean one of feed.force"),
        (["run", RIGID, "--solver", "wave"], "bit.model"),
        (["run", RIGID, "--solver", "fem"], "fem"),
        (["run", RIGID, "--cells", "many"], "--cells 'many': must be a whole number; see"),
        (["run", RIGID, "--cells", "1.5"], "--cells '1.5': must be a whole number; see"),
        (
            ["run", RIGID, "--duration", "ten"],
            '--duration = "ten": must be a number above 0 and up to 1e6 s, or text as "2 ms"',
        ),
        (["run", RIGID, "--solver", "my"], "--solver 'my': must be one of 'wave', 'modal',"),
        (["stability", "--share", "7"], "--share '7': must be at most 1; see"),
        (["stability", "--share", "nan"], "--share 'nan': must be"),
        (["paper", "--out", "a", "--processes", "0"], "--processes '0': must be at least 1; see"),
        (["run", RIGID, "--bogus"], "no such option: --bogus"),
        (["run", RIGID, "other.toml"], "other.toml"),
        (["run"], "missing argument 'SCENE'; see"),
        (["paper"], "missing option '--out'; see"),
        (["compare", RIGID, "--solvers"], "--solvers"),
        (["plot", "nowhere.toml"], "there is no such folder or scene file"),
        (["plot", str(SCENARIOS)], "no result folder, it has no summary.json"),
        (["run", RIGID, "--json", str(SCENARIOS)], "is a folder; give the file to write"),
        (["study", RIGID, "--over", "feed.force=1:2:3", "--out", RIGID], "cannot be written"),
        (["accuracy", RIGID, RIGID, "--json", "-"], "must differ"),
        (["explain", "nowhere.toml"], "there is no such scene file"),
        (["drill"], "drill"),
    ],
)
def test_bad_arguments_are_refused(percussion, arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = percussion(*arguments)
    assert (code, out) == (BAD_INPUT, "")
    assert message in err
    assert err.startswith("percussion: ")
    assert err.count("\n") == 1
    assert "Input should" not in err
    assert list(tmp_path.iterdir()) == []


def test_no_words_at_all_ask_for_help(percussion):
    code, out, err = percussion()
    assert code == BAD_INPUT
    assert "Commands" in out + err


@pytest.mark.parametrize("name", ["no.csv", "folder", "other.csv"])
def test_a_file_that_cannot_be_read_is_told_of_without_numbers(percussion, name, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "other.csv").write_bytes(b"\xff\xfe")
    code, out, err = percussion(
        "calibrate", SCENARIOS / "drop_test.toml", "--curve", tmp_path / name
    )
    assert (code, out) == (BAD_INPUT, "")
    why = {"no.csv": "no such file", "folder": "Is a directory"}.get(name, "not a text file")
    assert f"{name}: cannot be read: {why}" in err
    assert "Errno" not in err
    assert "codec" not in err


def test_notes_are_broken_to_fit_and_refusals_are_one_line(capsys, monkeypatch):
    text = "a word of a note " * 20 + "/" + "path" * 30
    monkeypatch.setenv("COLUMNS", "60")
    print_message(text)
    first, *others = capsys.readouterr().err.splitlines()
    assert first.startswith("percussion: a word")
    assert all(line.startswith("  ") for line in others)
    assert max(len(line) for line in [first, *others[:-1]]) <= 60
    assert others[-1] == "  /" + "path" * 30
    assert print_message(text, BAD_INPUT) == BAD_INPUT
    assert capsys.readouterr().err == f"percussion: {text}\n"


def test_an_unwritable_folder_is_refused_before_the_run(percussion, tmp_path):
    (tmp_path / "file").write_text("")
    began = time.monotonic()
    for option in (["--out", tmp_path / "file" / "out"], ["--json", tmp_path / "file" / "a.json"]):
        code, out, err = percussion("run", RIGID, "--duration", "1e6", *option)
        assert (code, out) == (BAD_INPUT, "")
        assert "cannot be written" in err
    assert time.monotonic() - began < 5
    assert os.listdir(tmp_path) == ["file"]


def test_ctrl_c_is_told_whatever_the_command(percussion, monkeypatch):
    def interrupted(*words, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(
        importlib.import_module("percussion_model.analysis.comparison"), "compare", interrupted
    )
    monkeypatch.setattr(
        importlib.import_module("percussion_model.analysis.cost"), "forecast", interrupted
    )
    for words in (["compare", RIGID, "--solvers", "rigid", "--no-figures"], ["explain", RIGID]):
        code, out, err = percussion(*words)
        assert (code, out) == (INTERRUPTED, "")
        assert err == "percussion: interrupted before there was a result\n"


def system_error(behind):
    """Raise what compiled code makes of an exception that it takes no heed of."""
    try:
        raise behind
    except BaseException as error:
        raise SystemError("<built-in method f> returned a result with an exception set") from error


@pytest.mark.parametrize("far", [False, True])
def test_ctrl_c_while_kernels_load_is_told_as_one(percussion, monkeypatch, capsys, far):
    def interrupted(*words, **options):
        try:
            system_error(KeyboardInterrupt())
        except SystemError:
            if far:  # what lies between does not matter
                system_error(RuntimeError())
            raise

    forecast = importlib.import_module("percussion_model.analysis.cost")
    monkeypatch.setattr(forecast, "forecast", interrupted)
    told = "interrupted before there was a result\n"
    assert percussion("explain", RIGID) == (INTERRUPTED, "", f"percussion: {told}")
    assert _guarded(interrupted) == INTERRUPTED
    assert capsys.readouterr().err == f"percussion: {told}"
    with pytest.raises(SystemExit) as end:
        common.end_script("scripts.one", interrupted)
    assert end.value.code == INTERRUPTED
    assert capsys.readouterr().err == f"scripts.one: {told}"


def test_other_errors_of_the_system_stay_what_they_are(percussion, monkeypatch):
    def broken(*words, **options):
        system_error(RuntimeError())

    forecast = importlib.import_module("percussion_model.analysis.cost")
    monkeypatch.setattr(forecast, "forecast", broken)
    for work in (lambda: percussion("explain", RIGID), lambda: common.end_script("one", broken)):
        with pytest.raises(SystemError):
            work()


# ------------------------------------------------------------------ whole processes


# The command itself, which tells on stderr when it has drilled for a second.
TALKING = """
import contextlib, sys
import percussion_model.interface.progress as progress
progress.EVERY = 3600.0  # no lines but those of this test
told = []

def report(t):
    if t > 1.0 and not told:
        told.append(t)
        print("drilling", file=sys.stderr, flush=True)

report.stage = lambda name, end: None

@contextlib.contextmanager
def talk(end):
    yield report

progress.progress_bar = talk
from percussion_model.interface.cli import main
main()
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no SIGINT to a child")
def test_ctrl_c_keeps_finished_work(tmp_path):
    words = ["run", RIGID, "--duration", "1e6", "--out", str(tmp_path / "out"), "--json", "-"]
    child = subprocess.Popen(
        [sys.executable, "-c", TALKING, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert child.stderr.readline() == "drilling\n"
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=120)
    assert child.returncode == INTERRUPTED, err
    assert err.startswith("percussion: interrupted at t = ")
    summary = json.loads(out)
    assert summary["warnings"][-1].startswith("interrupted at t = ")
    assert summary["blows"] > 0
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"summary.json", "blows.csv", "events.csv", "scene.toml", "made_by.json"}
    assert os.listdir(tmp_path) == ["out"]


def test_a_json_run_loads_no_pictures_and_no_pandas():
    code = (
        "import sys; from percussion_model.interface.cli import _guarded, app\n"
        f"assert _guarded(lambda: app(['run', {RIGID!r}, '--json', '-'], standalone_mode=False)) "
        "== 0\nheavy = {'matplotlib', 'pandas', 'jinja2'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("files", "told"), [([], "is not there"), (["old"], "is of other sources")]
)
def test_without_a_compiler_the_page_says_what_its_engine_is(monkeypatch, tmp_path, files, told):
    def refuse(*_):
        raise NoCompilerError("no compiler")

    build = "percussion_model.interface.explore.build"
    monkeypatch.setattr(f"{build}.FOLDER", tmp_path)
    monkeypatch.setattr(f"{build}.BROUGHT", tmp_path / "none")
    monkeypatch.setattr("percussion_model.engine.wasm.engine_file", refuse)
    for stamp in files:
        (tmp_path / "table.json").write_text(json.dumps({"stamp": stamp}))
    found = CliRunner().invoke(app, ["explore", "--no-browser"])
    assert found.exit_code == 2
    assert found.stderr.endswith(f"no page: the engine in {tmp_path} {told}: no compiler\n")
