"""Scene files of all kinds: one clear error, or a scene that runs and stays finite."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from hypothesis import example, given, settings
from hypothesis import strategies as st

from percussion_model import Scene, SceneError, Simulation
from percussion_model.interface.cli import BAD_INPUT, _guarded, app
from percussion_model.scene.parameters import parameter_table

EXAMPLES = 2000 if "PERCUSSION_LONG" in os.environ else 100
KEYS = [row.key for row in parameter_table() if "*" not in row.key]
# A run of more cells than this is left out, and none takes more steps.
MOST_CELLS, STEPS = 80, 5
LONGEST_LINE, MOST_LINES = 400, 40


def read(content):
    """Scene of a file with these bytes, None where it is refused as it should be."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_bytes(content)
        try:
            return Scene.from_toml(path)
        except SceneError as error:
            text = str(error)
            assert text.startswith(f"{path}: ")
            lines = text.splitlines()
            assert all(len(line) < LONGEST_LINE for line in lines), "an endless message"
            assert len(lines) <= MOST_LINES
            return None
        finally:
            assert [one.name for one in Path(folder).iterdir()] == ["scene.toml"]


def check(content):
    """Read a file, and run what can be read for a few steps."""
    scene = read(content)
    if scene is None or is_dear(scene):
        return
    simulation = Simulation(scene)
    step = simulation.solver.time_step or 1e-6
    simulation.advance(STEPS * step)
    seen = simulation.observe()
    for name, value in seen.items():
        silent = scene.piston.model == "absent" or name == "contact_force"
        assert silent or np.isfinite(value), name


def is_dear(scene):
    """Whether a scene has so many cells that making it takes long."""
    bars = [bar for bar in (scene.piston, scene.bit) if bar.model == "elastic"]
    if not bars:
        return False
    times = [section.transit_time for bar in bars for section in bar.sections]
    wanted = scene.solver.cells or scene.fem.elements
    return wanted * sum(times) > MOST_CELLS * bars[0].transit_time


NASTY = (
    *(0.0, -0.0, 5e-324, -5e-324, 2.2e-308, 1e308, -1e308, float("nan"), float("inf")),
    *(-float("inf"), 10**30, -(10**400), 2**63, 1, -1, True, False, "", "nan", "x" * 10_000, "\0"),
    *([], {}, [[]], [{}], [1.0, "x"], {"a": {"b": {}}}),
)
numbers = st.sampled_from(NASTY) | st.floats() | st.integers() | st.floats(1e-6, 1e6)
values = numbers | st.booleans() | st.text(max_size=20) | st.dates() | st.lists(numbers, max_size=3)
names = st.sampled_from(KEYS) | st.text(max_size=12) | st.sampled_from(["title", "rock", "bit.x"])


@st.composite
def trees(draw):
    """Nested tables with known and unknown keys and all sorts of values."""
    tree = {}
    for key, value in draw(st.lists(st.tuples(names, values), max_size=4)):
        *parents, last = key.split(".")
        node = tree
        for part in parents:
            node = node.setdefault(part, {})
            if not isinstance(node, dict):
                break
        if isinstance(node, dict):
            node[last] = value
    if draw(st.booleans()):
        fields = st.sampled_from(["length", "area", "youngs_modulus", "density", "lenth"])
        section = st.dictionaries(fields, values, max_size=5)
        tree.setdefault("bit", {})
        if isinstance(tree["bit"], dict):
            tree["bit"]["sections"] = draw(st.lists(section, max_size=3))
    return tree


@settings(max_examples=EXAMPLES, derandomize=True, database=None)
@given(trees())
def test_any_tree_is_refused_or_runs(tree):
    try:
        text = tomli_w.dumps(tree)
        content = text.encode("utf-8")
    except (UnicodeEncodeError, ValueError):  # not even a file, as with half a surrogate
        return
    check(content)


@settings(max_examples=EXAMPLES, derandomize=True, database=None)
@given(st.binary(max_size=200))
@example(b"")
@example(b"\x00\x01\x02")
@example("\ufefftitle = 'x'".encode())
def test_any_bytes_are_refused_or_run(content):
    check(content)


@settings(max_examples=EXAMPLES, derandomize=True, database=None)
@given(st.data())
def test_a_damaged_reference_is_refused_or_runs(data):
    """Bytes changed, lost, repeated, in the file that comes with the program."""
    path = Path(__file__).parents[2] / "scenarios" / "reference.toml"
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content) - 1))
        what = data.draw(st.sampled_from(["change", "lose", "repeat", "cut"]))
        if what == "change":
            content[place] = data.draw(st.integers(0, 255))
        elif what == "lose":
            del content[place : place + data.draw(st.integers(1, 60))]
        elif what == "repeat":
            content[place:place] = content[place : place + data.draw(st.integers(1, 200))]
        else:
            content = content[: max(place, 1)]
    check(bytes(content))


LONG_FILES = {
    "deep array": b"a = " + b"[" * 50_000,
    "deep array that ends": b"title = " + b"[" * 50_000 + b"]" * 50_000,
    "deep table": b"[" + b"a." * 2_000 + b"a]",
    "deep key": b"a." * 2_000 + b"a = 1",
    "deep inline tables": b"rock = " + b"{a = " * 20_000 + b"1" + b"}" * 20_000,
    "number of many digits": b"[feed]\nforce = " + b"9" * 100_000,
    "fraction of many digits": b"[feed]\nforce = 0." + b"9" * 100_000,
    "exponent of many digits": b"[feed]\nforce = 1e" + b"9" * 10_000,
    "long key": b"k" * 1_000_000 + b" = 1",
    "long unknown key of a table": b"[rock]\n" + b"k" * 100_000 + b" = 1",
    "long title": b'title = "' + b"t" * 1_000_000 + b'"',
    "long word": b'[effects]\nrock = "' + b"r" * 1_000_000 + b'"',
    "many sections": b"[[bit.sections]]\nlength = 1e-3\narea = 1e-3\n" * 1_000,
    "many bad sections": b"[[bit.sections]]\nlength = -1\n" * 1_000,
    "many unknown keys": b"".join(b"k%d = 1\n" % k for k in range(10_000)),
    "duplicate key": b"[rock]\nunloading_ratio = 5\nunloading_ratio = 6",
    "duplicate table": b"[rock]\n[rock]\n",
    "table over value": b"rock = 1\n[rock]\nunloading_ratio = 5",
    "date for a number": b"[feed]\nforce = 2026-01-01",
    "hexadecimal": b"[feed]\nforce = 0xFFFFFFFFFFFFFFFFFFFF",
    "not a number": b"[feed]\nforce = -nan",
    "a bare carriage return": b"title = 'x'\r[rock]",
    "utf-16": "title = 'x'".encode("utf-16"),
}


@pytest.mark.parametrize("name", LONG_FILES)
def test_files_at_the_limits(name):
    check(LONG_FILES[name])


SCENES = {"long title", "many sections", "hexadecimal", "fraction of many digits"}
SCENES |= {"a bare carriage return"}


@pytest.mark.parametrize("name", [name for name in LONG_FILES if name not in SCENES])
def test_the_command_line_writes_nothing_for_a_bad_file(name, tmp_path, capsys):
    path, out = tmp_path / "scene.toml", tmp_path / "out"
    path.write_bytes(LONG_FILES[name])
    words = ["run", str(path), "--out", str(out), "--json", str(tmp_path / "summary.json")]
    assert _guarded(lambda: app(words, standalone_mode=False)) == BAD_INPUT
    assert "Traceback" not in capsys.readouterr().err
    assert [one.name for one in tmp_path.iterdir()] == ["scene.toml"]
