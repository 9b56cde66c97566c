"""All that commands print fits 80 columns: no number, name or word is cut or broken."""

import importlib
import json
from pathlib import Path

import numpy as np
import pytest
from fitting_data import noisy_curve
from narrow import Printed, faults, words
from rich.console import Console
from rich.table import Table

from percussion_model.interface.cli import _guarded, app
from percussion_model.interface.tables import print_table
from percussion_model.verification.accuracy.study import Study as AccuracyStudy
from percussion_model.verification.paper.runs import paper_scene
from percussion_model.verification.paper.statements import Statement, about_scales

ROOT = Path(__file__).parents[1]
REFERENCE, RIGID, DROP = (
    str(ROOT / "scenarios" / f"{name}.toml") for name in ("reference", "rigid", "drop_test")
)
APERIODIC = str(ROOT / "scenarios" / "aperiodic.toml")
SHORT = ["--duration", "0.8", "--settle", "0.2"]


@pytest.fixture
def shown(capsys, tmp_path, monkeypatch):
    """Run a command in 80 columns; its exit code and all that it printed, which is checked."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        printed = Printed(monkeypatch)
        code = _guarded(lambda: app(list(arguments), standalone_mode=False))
        said = capsys.readouterr()
        assert faults(said.out) == []
        assert faults(said.err) == []
        assert printed.broken(said.out + said.err) == set()
        return code, said.out + said.err

    return call


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", REFERENCE, *SHORT],
        ["run", DROP],
        ["run", APERIODIC, "--duration", "1.5", "--settle", "0.5"],
        ["run", REFERENCE, "--set", "feed.force=150", *SHORT],
        ["run", RIGID, *SHORT, "--out", "a-folder", "--json", "a-file.json", "--no-figures"],
        ["compare", REFERENCE, *SHORT, "--no-figures"],
        ["compare", REFERENCE, *SHORT, "--no-figures", "--set", "feed.force=150"],
        ["settled", REFERENCE],
        ["settled", RIGID, "--set", "drive.reversal_distance=0.002"],
        ["explain", REFERENCE],
        ["rocks"],
        ["rocks", "kuru-granite:10"],
        ["hammers"],
        ["hammers", "sandvik-4-inch"],
        ["explain", str(ROOT / "scenarios" / "top_hammer.toml"), "--solver", "rigid"],
        ["effects", RIGID, *SHORT, "--no-figures"],
        [
            "stability",
            "gamma_10000",
            "hard_penalty_long_step",
            "drive_pulls",
            "grazing_apart",
            "--share",
            "0.02",
            "--no-refine",
            "--workers",
            "1",
        ],
        ["new", "mine.toml"],
    ],
    ids=lambda words: " ".join(Path(word).stem for word in words[:2]),
)
def test_commands_fit(shown, arguments):
    code, text = shown(*arguments)
    assert code == 0, text
    assert text


@pytest.mark.parametrize("name", ["undamped", "drop_test"])
def test_rows_of_a_run_that_have_long_numbers_keep_to_a_line(shown, name):
    code, text = shown("run", str(ROOT / "scenarios" / f"{name}.toml"))
    assert code == 0
    rows = [line.split("│")[1:-1] for line in text.splitlines() if line.startswith("│")]
    for name, value, _ in rows:  # "undecided" alone has a second line
        assert name.strip() or "at this resolution" in value


def test_help_fits(shown):
    assert "stability" in shown("--help")[1]
    for command in app.registered_commands:
        name = command.name or command.callback.__name__.replace("_", "-")
        text = shown(name, "--help")[1]
        assert "--help" in text


def test_a_study_fits_and_tells_by_its_code_that_points_have_failed(shown):
    pytest.importorskip("xarray")
    words = ["study", RIGID, "--out", "out", "--no-report", "--processes", "1"]
    code, text = shown(*words, "--over", "feed.force=1000:5000:3", "--over",
                       "rock.unloading_ratio=3:9:2")  # fmt: skip
    assert (code, "6 periodic" in text) == (0, True)
    assert "wrote out/points.nc\nwrote out/points.parquet\n" in text
    words[3] = "other"
    code, text = shown(*words, "--over", "rock.unloading_ratio=0.5,3,9")
    assert code == 1
    said = " ".join(text.replace("│", " ").split())
    assert "1 of 3, the first at" in said
    assert "must be a number above 1" in said


def test_accuracy_fits(shown, monkeypatch):
    """The stored studies, whose tables are as wide as any."""
    stored = {
        name: AccuracyStudy.from_dict(
            json.loads((ROOT / "docs" / "accuracy" / f"{name}.json").read_text(encoding="utf-8"))
        )
        for name in ("reference", "drop_test", "aperiodic", "drawn_1")
    }
    waiting = list(stored.values())
    module = importlib.import_module("percussion_model.verification.accuracy")
    monkeypatch.setattr(module, "study", lambda *words: waiting.pop(0))
    scenes = [str(ROOT / "scenarios" / f"{name}.toml") for name in list(stored)[:3]]
    scenes.append(str(ROOT / "scenarios" / "drawn" / "drawn_1.toml"))
    code, text = shown("accuracy", *scenes, "--no-figures", "--out", "out")
    assert code == 0
    for point in stored["reference"].points:
        assert words(point.label) <= words(text)
    assert "wrote out/reference.json" in text


def test_statements_of_the_paper_fit(shown, monkeypatch):
    pytest.importorskip("matplotlib")
    long = Statement(
        "4.5.2",
        "the rate of penetration falls with the stiffness of the rock, as K_R to -0.55",
        "K_R^-0.5432 ± 0.0031 between 1e8 and 1e10 N/m, 0.53 below 7.5e8 N/m",
        False,
        "the paper's mesh is too coarse for the stiffest rock; with 400 elements it agrees",
    )
    module = importlib.import_module("percussion_model.interface.commands.paper")
    made = [*about_scales(paper_scene()), long]
    monkeypatch.setattr(module, "_statements", lambda *words: iter(made))
    monkeypatch.setattr(module, "_sweeps", lambda *words: {"d": None})
    # what takes these names at its import would keep the patched ones
    for user in ("", ".compared_blows", ".coupled_signals", ".effect_bars"):
        importlib.import_module(f"percussion_model.interface.plotting{user}")
    for name, place in (
        ("run_drops", "percussion_model.verification.paper.runs"),
        ("run_sinking", "percussion_model.verification.paper.rock_law"),
        ("save_figures", "percussion_model.interface.plotting.style"),
    ):
        monkeypatch.setattr(importlib.import_module(place), name, lambda *words, **more: [])
    window = importlib.import_module("percussion_model.interface.plotting.window")
    monkeypatch.setattr(window, "last_blow_window", lambda result: None)

    class Both:
        results = {"wave": None, "fem": None}  # noqa: RUF012

    module = importlib.import_module("percussion_model.analysis.comparison")
    monkeypatch.setattr(module, "compare", lambda *words, **more: Both())
    code, text = shown("paper", "--out", "out")
    assert code == 0
    assert "differs" in text
    # three lines of a long text, not a column of words
    found = text[text.index("found here: K_R^-0.5432") :]
    assert found[: found.index("why: ")].count("\n") <= 2


def test_a_calibration_fits(shown, tmp_path):
    curve = tmp_path / "slow.csv"
    slow = noisy_curve(1)
    np.savetxt(curve, np.column_stack([slow.penetration, slow.force]), delimiter=",",
               header="penetration,force", comments="")  # fmt: skip
    code, text = shown("calibrate", DROP, "--curve", "slow.csv")
    assert code == 0, text
    assert {"K_R", "gamma", "determined"} <= words(text)


@pytest.mark.parametrize("width", [34, 47, 80, 200])
@pytest.mark.parametrize("keys", [1, 2])
@pytest.mark.parametrize("pad_edge", [True, False])
def test_a_table_keeps_all_its_words_at_any_width(width, keys, pad_edge, monkeypatch, capsys):
    table = Table(title="A table with numbers, names and words", pad_edge=pad_edge)
    columns = [("case", True), ("solver", True), *((f"n{k}", True) for k in range(7))]
    columns += [("what was\nfound", False), ("and why", False)]
    for name, whole in columns:
        table.add_column(name, no_wrap=whole)
    for k in range(5):
        numbers = [f"{-1.234e-5 * (k + 1) ** n:.3e}" for n in range(7)]
        table.add_row(f"case_{k}", "wave", *numbers, f"words {k} of a finding", "a reason " * k)
    printed = Printed(monkeypatch)
    print_table(table, Console(width=width), keys)
    text = capsys.readouterr().out
    given = {word for column in table.columns for cell in (column.header, *column.cells)
             for word in cell.split()}  # fmt: skip
    assert printed.broken(text) == set()
    assert given <= words(text)
    assert "…" not in text
    assert max(len(line.rstrip()) for line in text.splitlines()) <= width
