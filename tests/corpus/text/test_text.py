"""Words, scenes and encodings that people have: read, or refused in one line."""

from __future__ import annotations

import ast
import io
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

from percussion_model.analysis.study import grid
from percussion_model.coupling import CouplingError
from percussion_model.coupling.component import Component
from percussion_model.coupling.python_part import PythonPart
from percussion_model.interface import streams
from percussion_model.interface.commands.study import _tell_of_cost
from percussion_model.scene.rows import SceneError
from percussion_model.scene.scene import Scene
from tests.commands import percussion

HERE = Path(__file__).parent
ROOT = Path(__file__).parents[3]
CASES = tomllib.loads((HERE / "cases.toml").read_text(encoding="utf-8"))["case"]
LONG = {"{nines}": "9" * 5000, "{hex}": "0x" + "f" * 5000}
# Of terminals and pipes in the world; none of them has all signs that the program writes.
ENCODINGS = (
    *("ascii", "cp437", "cp850", "cp874", "cp932", "cp936", "cp1250", "cp1251", "cp1252"),
    *("cp1253", "cp1256"),
)
FULL = Path("/dev/full")


def filled(word):
    for name, text in LONG.items():
        word = word.replace(name, text)
    return str(HERE / word[1:-1]) if word.startswith("{") else word


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_words_are_read_or_refused_in_one_line(case, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code = percussion(*map(filled, case["words"]))
    said = capsys.readouterr().err
    assert code == 2
    assert said.startswith("percussion: ")
    assert all(part in said for part in case["right"]), said
    assert len(said) < 1200
    if "everywhere" not in case["id"]:  # a scene has a line for each fault
        assert said.count("\n") == 1
    assert not any(tmp_path.iterdir())


def test_a_byte_order_mark_is_no_part_of_a_scene():
    """Editors of Windows write it: a report."""
    assert Scene.from_toml(HERE / "byte_order_mark.toml").feed.force == 4000.0


class Pipe(io.TextIOWrapper):
    """A pipe of some encoding in place of stdout."""

    def __init__(self, encoding):
        super().__init__(io.BytesIO(), encoding=encoding)

    def text(self):
        self.flush()
        return self.buffer.getvalue().decode(self.encoding)


def spoken(words, encoding, monkeypatch):
    """What a command writes to a stdout of this encoding."""
    pipe = Pipe(encoding)
    monkeypatch.setattr(sys, "stdout", pipe)
    streams.bear_all_text()
    assert percussion(*words) == 0
    return pipe.text()


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_encoding_bears_the_tables(encoding, monkeypatch):
    run = ["run", "rigid", "--duration", "0.5", "--settle", "0.1"]
    said = spoken(run, encoding, monkeypatch)
    assert "x real time" in said or "× real time" in said
    assert "?" not in said
    for words in (["rocks", "red-bohus-granite"], ["calibrate", "--help"]):
        assert "?" not in spoken(words, encoding, monkeypatch)


def test_errors_are_told_in_ascii(monkeypatch):
    assert "+-" in spoken(["run", "rigid", "--duration", "2"], "ascii", monkeypatch)


@pytest.mark.skipif("PERCUSSION_LONG" not in os.environ, reason="set PERCUSSION_LONG=1")
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_encoding_bears_long_commands(encoding, monkeypatch, tmp_path):
    pytest.importorskip("xarray")
    study = ["study", "rigid", "--over", "feed.force=5000", "--out", tmp_path, "--no-report"]
    for words in (["explain", "rigid"], [*study, "--processes", "1"], ["effects", "--help"]):
        assert "?" not in spoken(words, encoding, monkeypatch)


def test_every_sign_that_the_program_writes_has_a_stand_in():
    signs = set()
    for folder in ("interface", "simulation", "scene", "analysis", "coupling"):
        files = (ROOT / "percussion_model" / folder).rglob("*.py")
        texts = [file.read_text(encoding="utf-8") for file in files]
        for text in texts:
            for node in () if text.isascii() else ast.walk(ast.parse(text)):
                if isinstance(node, ast.Constant) and isinstance(node.value, str):
                    signs |= {one for one in node.value if not one.isascii()}
    lacking = {one for one in signs if "?" in streams.stand_in(one)}
    assert {"±", "×", "µ"} < signs
    assert lacking <= {"\ufffe", "\uffff"}  # which are no characters


def test_names_of_others_keep_their_letters():
    assert streams.stand_in("Müller, Ångström, 5 µm ± 3 %, ½, \udce4, 岩") == (
        "Muller, Angstrom, 5 um +- 3 %, 12, ?, ?"
    )


def ended(words, **places):
    """Exit code and stderr of the command in a process of its own."""
    command = [sys.executable, "-m", "percussion_model.interface.cli", *words]
    done = subprocess.run(command, text=True, cwd=ROOT, timeout=120, **places)
    return done.returncode, done.stderr


@pytest.mark.skipif(not FULL.is_char_device(), reason="a disk that is full")
def test_a_stdout_that_is_full_is_one_line():
    with FULL.open("w") as full:
        code, said = ended(["--version"], stdout=full, stderr=subprocess.PIPE)
    assert code == 1
    assert said == "percussion: stdout: cannot be written: No space left on device\n"


def test_a_reader_that_has_gone_is_told_nothing():
    reading, writing = os.pipe()
    os.close(reading)
    code, said = ended(["--version"], stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    assert (code, said) == (1, "")


@pytest.mark.skipif(os.name == "nt", reason="a stream that the shell has closed")
def test_a_closed_stderr_does_not_send_words_to_stdout():
    words = "-m percussion_model.interface.cli rocks no-such-rock"
    done = subprocess.run(
        f"'{sys.executable}' {words} 2>&-", shell=True, cwd=ROOT, stdout=subprocess.PIPE
    )
    assert (done.returncode, done.stdout) == (2, b"")


def test_a_large_study_tells_its_cost_before(capsys):
    pytest.importorskip("threadpoolctl")
    scene = Scene().computed_by("rigid")
    points = grid({"feed.force": [4000.0, 5000.0], "rock.barrier_energy": [0.01, 0.05]})
    _tell_of_cost(scene, points, 1e-4, 1e-3, 1)
    said = " ".join(capsys.readouterr().err.split())
    assert re.search(r"4 points take about [\d.]+ s on 1 process, as the one in the middle", said)
    with pytest.raises(SceneError, match=r"did you mean feed\.force"):
        _tell_of_cost(scene, grid({"feed.froce": [4000.0]}), 1e-4, 1e-3, 1)


def test_a_folder_that_holds_a_study_is_looked_at_before_the_cost(tmp_path, capsys):
    """One that goes on has told its cost; another one is refused before a point is tried."""
    pytest.importorskip("xarray")
    (tmp_path / "study.json").write_text('{"scene": ""}', encoding="utf-8")
    words = ["study", "rigid", "--over", "feed.force=4kN:5kN:2000", "--out", tmp_path]
    assert percussion(*words) == 2
    said = capsys.readouterr().err
    assert "holds another study" in said
    assert "take about" not in said


def test_a_misspelt_output_of_a_controller_is_guessed():
    part = PythonPart("controller", lambda *_: {"force_comand": 1.0, "pressure": 2.0}, {})
    part.begin()
    part.step(0.0, 1e-3)
    with pytest.raises(CouplingError) as refused:
        part.reader(["force_command", "pressure"]).read()
    assert str(refused.value) == (
        "controller gave no force_command; did you mean force_command by force_comand?"
    )


def test_sections_as_scenes_count_are_told_in_fmus():
    part = SimpleNamespace(name="hammer", variables={"piston.sections[2].length": None})
    with pytest.raises(CouplingError) as refused:
        Component.find(part, "piston.sections.1.length")
    assert "did you mean piston.sections[2].length?" in str(refused.value)
    assert "from 1 in FMUs, from 0 in scenes" in str(refused.value)


def test_what_a_command_reads_is_not_replaced(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    content = (ROOT / "scenarios" / "rigid.toml").read_bytes()
    scene, drop = tmp_path / "X.toml", tmp_path / "drop.csv"
    scene.write_bytes(content)
    drop.write_bytes(b"time,bit position\n")
    calibrate = ["calibrate", scene, "--drop", f"{drop}@5", "--force"]
    commands = (
        ("-o", "fmu", scene, "-o", "X.toml"),
        ("-o", "fmu", "X.toml", "-o", scene, "--force"),
        ("-o", "native", scene, "-o", "X.toml"),
        ("--json", "run", scene, "--json", "X.toml"),
        ("--json", "explain", scene, "--json", "./X.toml"),
        ("--out", *calibrate, "--out", "X.toml"),
        ("--figure", *calibrate, "--figure", "drop.csv"),
    )
    for option, *words in commands:
        assert percussion(*words) == 2
        said = capsys.readouterr().err
        assert f"percussion: {option} " in said
        assert "the command reads this file; name another" in said
        assert said.count("\n") == 1
    assert scene.read_bytes() == content
    assert sorted(tmp_path.iterdir()) == [scene, drop]
