"""Every hard case by every solver that supports it: what must hold of all runs."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from percussion_model import Scene
from percussion_model.interface.cli import INTERRUPTED, _guarded, app
from percussion_model.interface.terminal import show_stability
from percussion_model.scene.inputs import SimulationError
from percussion_model.verification.hard_cases import (
    SOLVERS,
    hard_cases,
    measure,
    run_collection,
)
from percussion_model.verification.hard_cases.collection import (
    FROM_CHANGE,
    Collection,
    left_out,
    numerical_error,
    off_text,
    short_rate,
    violations,
)
from percussion_model.verification.hard_cases.refinement import refine
from percussion_model.verification.hard_cases.stability_page import page

PAGE = Path(__file__).parents[2] / "docs" / "data" / "hard_cases.md"
LONG = os.environ.get("PERCUSSION_LONG") == "1"
# Share of each case's duration: enough for a blow or two, and for the first storm.
SHARES = {"wave": 0.15, "modal": 0.15, "fem": 0.08, "rigid": 0.12}
# Too dear for every run of the suite, at any length.
DEAR = {("ratio_50", "fem"), ("fine", "fem")}
# The command itself, which says when the first of its runs has ended.
TALKING = """
import contextlib, sys
import percussion_model.interface.progress as progress
progress.EVERY = 3600.0  # no lines but those of this test

@contextlib.contextmanager
def talk(what):
    yield lambda done, total: done == 1 and print("begun", file=sys.stderr, flush=True)

progress.count_bar = talk
from percussion_model.interface.cli import main
if __name__ == "__main__":
    main()
"""
RUNS = [(name, solver) for name, case in hard_cases().items() for solver in case.solvers]


def test_there_are_enough_cases_and_each_says_why():
    assert len(hard_cases()) >= 40
    for case in hard_cases().values():
        assert case.hard
        assert case.holds
        assert set(case.solvers) <= set(SOLVERS)
        assert case.scene.title == case.name
        assert not case.scene.unused or case.group in ("bars", "rock", "contact", "drive")
        assert set(case.differs) <= set(SOLVERS)


def test_scripts_change_inputs_in_order_and_in_turn():
    changes = hard_cases()["everything_changes"].changes(0.01)
    times = [t for t, _ in changes]
    assert times == sorted(set(times))
    seen = [inputs["drive_force"] for _, inputs in changes if "drive_force" in inputs]
    assert seen[:4] == [0.0, 1e4, 3000.0, 0.0]


@pytest.mark.parametrize(("name", "solver"), RUNS, ids=[f"{n}-{s}" for n, s in RUNS])
def test_what_must_hold_of_every_run(name, solver):
    if (name, solver) in DEAR and not LONG:
        pytest.skip("takes seconds: PERCUSSION_LONG=1 runs it")
    found = measure(hard_cases()[name], solver, 1.0 if LONG else SHARES[solver])
    assert violations(found.to_dict()) == []
    assert found.duration > 0.0


def test_the_ceiling_of_events_is_one_of_a_blow_and_not_of_its_first_burst():
    """The first 10 ms have 400 events, the whole 0.5 s 4500, and at most 20 000 a second."""
    case = hard_cases()["gamma_1000"]
    short = measure(case, "rigid", 0.02, again=False)
    assert short.events_per_second > case.ceiling
    assert violations(short.to_dict()) == []
    # five times as many would be too many for a blow as well, and whole runs are held as before
    low = measure(replace(case, ceiling=0.2 * case.ceiling), "rigid", 0.02, again=False)
    assert any("events_per_second" in text for text in violations(low.to_dict()))
    assert measure(case, "rigid", 0.1, again=False).ceiling == case.ceiling


@pytest.mark.skipif(not LONG, reason="PERCUSSION_LONG=1 runs every case on a finer grid")
def test_rates_of_periodic_cases_stay_on_a_finer_grid_of_waves():
    left = set()
    for name, case in hard_cases().items():
        if "wave" in case.solvers and not case.aperiodic:
            found = refine(case, measure(case, "wave", again=False))
            if found.converged is False:
                left.add(name)
    assert left <= {"one_cell", "no_loss", "no_loss_no_barrier", "spring", "gamma_1"}


def test_a_finer_grid_leaves_the_first_contact_as_it_is():
    case = hard_cases()["gap_0"]
    found = refine(case, measure(case, "wave", again=False))
    assert found.path_change < 5e-3
    assert found.rate_change < 2e-3
    assert found.converged


ROW = {
    "case": "gap_0", "solver": "wave", "error": "", "residual": 0.0, "momentum": 0.0,
    "contact_tension": 0.0, "rock_tension": None, "interpenetration": 0.0,
    "events_per_second": 10.0, "ceiling": 20.0, "guards": 0, "same_bits": True,
    "rate": 0.016, "rate_error": 0.0, "depends_on_cells": False,
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"residual": 2e-6}, "residual = 2e-06"),
        ({"residual": None}, "residual is no number"),
        ({"momentum": -1e-3}, "momentum"),
        ({"contact_tension": 0.1}, "contact_tension"),
        ({"interpenetration": 1.5}, "interpenetration"),
        ({"events_per_second": 21.0}, "events_per_second = 21"),
        ({"same_bits": False}, "other bits"),
        ({"error": "gone"}, "gone"),
    ],
)
def test_what_does_not_hold_is_found(change, words):
    assert violations(ROW) == []
    (text,) = violations(ROW | change)
    assert words in text


def test_disagreements_have_a_reason_or_say_that_none_is_known():
    other = ROW | {"solver": "fem", "rate": 0.018}
    (entry,) = Collection([ROW, other]).disagreements()
    assert entry["difference"] == pytest.approx(0.125)
    assert entry["reason"] == ""
    (entry,) = Collection([ROW, other | {"rate_error": 0.002}]).disagreements()
    assert "1.0 standard errors" in entry["reason"]
    (entry,) = Collection([ROW, other | {"solver": "rigid"}]).disagreements()
    assert "rigid bodies" in entry["reason"]
    assert Collection([ROW, other | {"rate": 0.0162}]).disagreements() == []


def test_a_rate_is_only_off_where_the_errors_of_both_do_not_reach_so_far(capsys):
    other = ROW | {"solver": "fem", "rate": 0.0166}

    def entry(base, row):
        (found,) = Collection([ROW | base, other | row]).disagreements()
        return found

    assert entry({}, {})["decided"] is True  # 3.75 %
    far = entry({}, {"rate_error": 1.5e-4})  # 4 standard errors, and one is 0.9 %
    assert far["standard_errors"] == pytest.approx(4.0)
    assert far["decided"] is False
    assert "the errors of the two rates reach 2.8 % of the first" in far["reason"]
    assert entry({"depends_on_cells": True}, {})["decided"] is False
    assert short_rate(ROW | {"depends_on_cells": True}) == "undecided"
    change = 0.02 / FROM_CHANGE
    assert entry({}, {"refined_rate_change": change})["decided"] is False
    assert entry({"refined_rate_change": change}, {})["decided"] is False
    assert entry({}, {"refined_rate_change": 0.5 * change})["decided"] is True
    undecided = other | {"solver": "rigid", "rate_error": 1.5e-4}
    rows = [row | {"wall_time": 0.1} for row in (ROW, other, undecided)]
    show_stability(Collection(rows))
    shown = " ".join(capsys.readouterr().out.split())
    assert "16.60±0.15" in shown
    assert "± of a rate is its standard error by the scatter of the blows alone" in shown
    assert "More than 2 % off the first solver's rate: 1; undecided, since their errors" in shown
    assert shown.endswith("so far: 1.")


def test_a_disagreement_has_the_digits_that_its_errors_leave():
    """16 mm/s against 18 ± 0.1, of which the grid makes a part; and against 18 ± 2."""
    other = ROW | {"solver": "fem", "rate": 0.018, "rate_error": 1e-4, "duration": 1.0}
    rest = {"numerical": 0.0, "duration": 1.0, "wall_time": 0.1}
    (entry,) = Collection([ROW, other]).disagreements()
    assert off_text(entry) == "+12.5±0.6 %"
    rows = [ROW | rest, other | rest | {"rate_error": 2e-3}]
    (entry,) = Collection(rows).disagreements()
    assert off_text(entry) == "undecided"
    text = page(Collection(rows), None)
    line, *_ = (one for one in text.splitlines() if one.startswith("| gap_0 | fem | 18.0±2.0"))
    assert "16.00 (wave) | undecided |" in line


def test_the_error_of_a_rate_is_of_scatter_and_of_the_grid():
    assert numerical_error(ROW | {"rate_error": 1e-4}) == 1e-4
    finer = {"rate_error": 1e-4, "refined_rate_change": 0.05}
    assert numerical_error(ROW | finer) == pytest.approx(FROM_CHANGE * 0.05 * ROW["rate"])
    assert numerical_error(ROW | {"rate_error": 1e-4, "refined_rate_change": None}) == 1e-4
    assert numerical_error(ROW | {"rate": None}) is None


def test_processes_give_the_same_rows_as_this_one():
    choice = {"names": ["grazing", "reversal_1"], "solvers": ["rigid"], "share": 0.1}
    here, there = (run_collection(**choice, workers=n).rows for n in (0, 2))
    for row in (*here, *there):
        del row["wall_time"]
    assert here == there


def test_the_command_writes_json_page_and_figure(tmp_path, capsys):
    words = ["stability", "grazing", "bounce_dead", "--solvers", "rigid", "--share", "0.2"]
    words += ["--workers", "0", "--out", str(tmp_path), "--json", "-"]
    assert _guarded(lambda: app(words, standalone_mode=False)) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["cases"] == values["runs"] == 2
    assert values["failures"] == []
    assert {row["case"] for row in values["rows"]} == {"grazing", "bounce_dead"}
    text = (tmp_path / "hard_cases.md").read_text(encoding="utf-8")
    assert "bounce_dead" in text
    assert "](images/stability.png)" in text
    assert (tmp_path / "images" / "stability.png").stat().st_size > 10_000


def test_cases_that_are_left_out_are_named_with_the_reason(capsys):
    words = ["stability", "grazing", "hard_penalty", "bounce_dead", "--solvers", "rigid"]
    words += ["--share", "0.02", "--no-refine", "--workers", "0", "--json", "-"]
    assert _guarded(lambda: app(words, standalone_mode=False)) == 0
    left = {entry["case"]: entry for entry in json.loads(capsys.readouterr().out)["left_out"]}
    assert left["hard_penalty"]["reason"] == "computed by fem alone"
    assert left["one_cell"]["reason"] == "not asked for"
    assert len(left) == len(hard_cases()) - 2
    assert "grazing" not in left
    entries = left_out(["grazing", "hard_penalty", "bounce_dead"], ["fem", "rigid"])
    rows = [ROW | {"case": case, "wall_time": 1.0} for case in ("grazing", "bounce_dead")]
    found = Collection(rows, 1.0, entries)
    show_stability(found)
    shown = " ".join(capsys.readouterr().out.split())
    assert "no solver asked for computes them: hard_penalty (computed by fem alone)" in shown
    assert "Not computed by every solver: bounce_dead (not by fem)." in shown
    assert f"Other cases, not asked for: {len(hard_cases()) - 3}." in shown
    assert Collection([ROW]).about_left_out() == []


def test_an_unknown_case_is_refused(capsys):
    assert _guarded(lambda: app(["stability", "grazin"], standalone_mode=False)) == 2
    assert "unknown case grazin" in capsys.readouterr().err


def test_cases_that_no_solver_asked_for_computes_are_refused():
    (name, solvers), *_ = ((n, c.solvers) for n, c in hard_cases().items() if len(c.solvers) < 3)
    other = next(solver for solver in SOLVERS if solver not in solvers)
    with pytest.raises(SimulationError, match=f"none of these cases is computed by {other}"):
        run_collection([name], [other], workers=0)


def test_a_run_that_failed_at_once_has_its_row_on_the_page():
    undefined = ("rate", "rate_error", "residual", "numerical", "momentum", "events_per_second")
    row = ROW | dict.fromkeys(undefined) | {"error": "gone", "duration": 0.0, "wall_time": 0.1}
    text = page(Collection([row]), None)
    assert "gap_0, wave: gone" in text
    assert "| gap_0 | wave | - | - | - | - | - |" in text


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no SIGINT to a child")
def test_ctrl_c_ends_all_processes_at_once(tmp_path):
    words = ["stability", "--solvers", "rigid", "--workers", "2", "--json", str(tmp_path / "a")]
    child = subprocess.Popen(
        [sys.executable, "-c", TALKING, *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # a shell may have started the tests with the signal ignored
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert child.stderr.readline() == "begun\n"
    os.killpg(child.pid, signal.SIGINT)  # as a terminal does
    _, err = child.communicate(timeout=30)
    assert child.returncode == INTERRUPTED
    assert err == "percussion: interrupted before there was a result\n"
    assert os.listdir(tmp_path) == []


def test_the_reference_is_no_hard_case():
    assert all(case.scene != Scene() for case in hard_cases().values())


def test_the_page_tells_of_every_case_and_knows_every_reason():
    text = PAGE.read_text(encoding="utf-8")
    for name, case in hard_cases().items():
        for solver in case.solvers:
            assert f"| {name} | {solver} |" in text, "run: python -m docs.make stability"
        assert case.hard in text, "run: python -m docs.make stability"
    assert "all of this holds for all of them" in text
    assert "not known" not in text
