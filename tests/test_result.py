"""Result: means, rate, ledger, warnings, files."""

import json
import math
import os
import pickle
import re
from dataclasses import replace

import numpy as np
import pytest

from percussion_model import Result, ResultError, Scene, Simulation, simulate
from percussion_model.interface.plotting import CAPTIONS
from percussion_model.physics.records import BLOW
from percussion_model.simulation.files import check_writable, staged
from percussion_model.simulation.rate import LEAST_BLOWS
from percussion_model.simulation.result import FIGURES, REPORT
from percussion_model.simulation.validity import numerical_note
from percussion_model.simulation.warnings import find_warnings

RIGID = Scene().replace(**{"piston.model": "rigid", "bit.model": "rigid"})
WAVES = {"solver.name": "wave"}
KEYS = [
    "rate_of_penetration",
    "rate_of_penetration_standard_error",
    "rate_of_penetration_fixed_window",
    "blow_period",
    "blow_frequency",
    "impact_velocity",
    "rebound_velocity",
    "stroke",
    "blow_energy",
    "rock_energy",
    "transfer_efficiency",
    "penetration_per_blow",
    "contacts_per_blow",
    "drilling_cycles_per_blow",
    "peak_bit_force",
    "peak_contact_force",
    "standstill_bit_force",
    "mean_bit_force",
    "mean_contact_force",
    "energy",
    "blows",
    "events",
    "cells",
    "time_step",
    "wall_time",
    "real_time_factor",
    "solver",
    "duration",
    "settle",
    "warnings",
]


@pytest.fixture(scope="module")
def rigid():
    return simulate(RIGID, 2.0, settle=1.0, trace=1e-3)


@pytest.fixture(scope="module", params=["wave", "modal"])
def elastic(request):
    return simulate(Scene().computed_by(request.param), 0.5, settle=0.2)


# ------------------------------------------------------------------------ numbers


def test_the_summary_is_plain_and_complete(rigid, elastic):
    for result in (rigid, elastic):
        summary = json.loads(json.dumps(result.summary(), allow_nan=False))
        assert set(KEYS) <= set(summary)
        assert {"numerical", "residual", "numerical_relative", "input"} <= set(summary["energy"])
    assert rigid.summary()["cells"] is None
    cells = {"wave": {"piston": 24, "bit": 28}, "modal": {"piston": 24, "bit": 24}}
    assert elastic.summary()["cells"] == cells[elastic.solver]


def test_notebooks_show_the_numbers_of_drillers_and_what_a_scene_changes(elastic):
    told = Scene(title="A <b> & c", feed={"force": 4000.0})._repr_html_()
    assert "A &lt;b&gt; &amp; c" in told
    assert "<td>feed.force</td><td>4000.0</td><td>N</td>" in told
    assert "<table>" not in Scene()._repr_html_()  # which changes nothing
    shown = elastic._repr_html_()
    per_hour = elastic.summary()["driller_numbers"]["rate_of_penetration"]["value"]
    (rate,) = re.findall(r"<td>Rate of penetration</td><td>([\d.]+) ± [\d.]+</td>", shown)
    assert float(rate) == pytest.approx(per_hour, rel=1e-3)
    assert f"{len(elastic.counted)} blows counted" in shown
    warned = replace(elastic, warnings=["too <little> time"])
    assert "<td>too &lt;little&gt; time</td>" in warned._repr_html_()


def test_the_reference_needs_no_warning(elastic, rigid):
    assert elastic.warnings == []
    assert rigid.warnings == []


def test_the_rate_is_taken_between_blow_starts(rigid):
    starts = rigid.blows[rigid.blows["time"] >= 1.0]
    advance = starts["hole_depth"][-1] - starts["hole_depth"][0]
    took = starts["time"][-1] - starts["time"][0]
    assert rigid.rate_of_penetration == pytest.approx(advance / took, rel=1e-6)
    assert rigid.rate_of_penetration == pytest.approx(
        starts["hole_advance"].sum() / starts["period"].sum(), rel=1e-12
    )


def test_impulse_over_whole_periods(elastic):
    # Oracle 8: <F_R> = F_S + (M_p + M_b) G + <F_A>; <F_C> = M_p G + <F_A>.
    rows, scene = elastic.counted, elastic.scene
    drive = rows["drive_impulse"].sum() / rows["period"].sum()
    weight = 10.0 * (scene.piston.mass + scene.bit.mass)
    assert elastic.mean_bit_force == pytest.approx(2500.0 + weight + drive, rel=2e-3)
    assert elastic.mean_contact_force == pytest.approx(10.0 * scene.piston.mass + drive, rel=5e-3)


def test_the_ledger_adds_up(elastic):
    e = elastic.energy
    assert e["input"] == pytest.approx(e["drive"] + e["feed"] + e["gravity"])
    rest = e["initial"] + e["input"] - e["stored"] - e["dissipated"]
    rest -= e["numerical"] + e["overshoot"]
    assert e["residual"] == pytest.approx(rest, abs=1e-9)
    assert abs(e["residual_relative"]) < 1e-9


def test_the_fixed_window_is_cut_by_time(rigid):
    """Eq. 58 of the paper: off the rate over whole blows by less than a blow's share."""
    simulation = Simulation(rigid.scene)
    start, end = simulation.sample([rigid.settle, rigid.duration])["bit_position"]
    rate = rigid.rate_of_penetration_fixed_window
    assert rate == pytest.approx((end - start) / (rigid.duration - rigid.settle), rel=1e-12)
    assert 0 < abs(rate / rigid.rate_of_penetration - 1.0) < 1.0 / len(rigid.counted)
    assert simulation.result().rate_of_penetration_fixed_window == rate


def test_a_fixed_window_survives_calls_and_snapshots(rigid):
    simulation = Simulation(rigid.scene)
    for t in np.linspace(0.0, rigid.duration, 7):
        simulation.restore(pickle.loads(pickle.dumps(simulation.save())))
        simulation.advance(t)
    found = simulation.result()
    assert found.rate_of_penetration_fixed_window == rigid.rate_of_penetration_fixed_window
    # what was not read at that time is not known
    assert simulation.result(settle=0.1).summary()["rate_of_penetration_fixed_window"] is None
    short = Simulation(rigid.scene)
    short.advance(0.5 * rigid.settle)
    assert math.isnan(short.result().rate_of_penetration_fixed_window)


# ----------------------------------------------------------------------- warnings


@pytest.mark.parametrize("error_estimate", [False, True])
def test_a_rate_that_scatters_says_so_once(error_estimate):
    scene = RIGID.replace(**{"feed.force": 150.0})
    result = simulate(scene, 3.0, settle=1.0, error_estimate=error_estimate)
    error = result.rate_of_penetration_standard_error / result.rate_of_penetration
    assert error > 0.01
    (warning,) = (text for text in result.warnings if "standard error" in text)
    assert f"{100.0 * error:.2g} %" in warning


def test_few_blows_tell_no_rate():
    result = simulate(RIGID, 0.12, settle=0.0)
    assert result.summary()["rate_of_penetration"] is None
    assert any("only 2 whole blows" in text for text in result.warnings)
    none = simulate(RIGID, 0.01, settle=0.0)
    assert none.summary()["blow_period"] is None
    assert any("no whole blow" in text for text in none.warnings)


def test_a_hammer_that_stalls_has_no_rate():
    scene = RIGID.replace(**{"effects.drive": "external", "drive.external_force": 5e3})
    result = simulate(scene, 0.5, settle=0.0)
    assert result.has_stalled
    assert len(result.counted) >= LEAST_BLOWS
    summary = result.summary()
    for end in ("", "_standard_error", "_error", "_relative_error"):
        assert summary[f"rate_of_penetration{end}"] is None
    (said,) = [text for text in result.warnings if "rate of penetration" in text]
    assert "the hammer has stalled: no blow ended after 0.0" in said
    held = simulate(scene, 0.02, settle=0.0)  # too soon to tell
    assert not held.has_stalled


def test_an_undamped_scene_warns_and_says_why():
    result = simulate(Scene().replace(**{"effects.loss": False}), 0.05, settle=0.0)
    assert all(math.isfinite(value) for value in result.energy.values())
    assert any(
        "structural loss is off" in text and "must not be trusted" in text
        for text in result.warnings
    )


@pytest.mark.parametrize(
    ("changes", "warning"),
    [
        ({"drive.external_force": 5.0}, "without effect in this scene: drive.external_force"),
        (WAVES | {"bit.sections.0.length": 0.05, "solver.cells": 3}, "is shorter than a time step"),
        (WAVES | {"solver.cells": 1}, "is a single cell"),
        ({"solver.cells": 5, "effects.loss": False}, "is taken by averaging fronts within steps"),
        ({"solver.name": "fem"}, "is taken by the time scheme"),
    ],
)
def test_warnings_about_the_scene(changes, warning):
    result = simulate(Scene().replace(**changes), 0.01, settle=0.0)
    assert any(warning in text for text in result.warnings)


def test_what_the_discretisation_takes_is_told_beyond_its_limits():
    assert not list(numerical_note(0.01, "wave"))
    assert "1 % of the energy" in "".join(numerical_note(0.0101, "wave"))


@pytest.mark.parametrize("solver", ["wave", "modal", "fem", "rigid"])
@pytest.mark.parametrize("law", ["bilinear", "power"])
def test_a_solver_that_makes_energy_is_told(rigid, solver, law):
    """Bounds of docs/model.md, section 8, on any rock."""
    scene = rigid.scene.replace(**{"effects.rock": law})
    for share, told in ((-1.1e-9, True), (-0.9e-9, False)):
        energy = rigid.energy | {"numerical_relative": share}
        made = replace(rigid, scene=scene, solver=solver, energy=energy)
        assert any("error of the solver" in text for text in find_warnings(made)) == told


# -------------------------------------------------------------------------- files


def test_a_saved_result_reads_back(rigid, tmp_path):
    folder = tmp_path / "deep" / "run"
    files = rigid.save(folder)
    assert {path.name for path in files} == {
        "summary.json", "blows.csv", "events.csv", "trace.csv", "scene.toml",
    }  # fmt: skip
    assert sorted(path.name for path in folder.iterdir()) == sorted(path.name for path in files)
    assert os.listdir(folder.parent) == ["run"]
    again = Result.load(folder)
    assert again.scene == rigid.scene
    for name in BLOW.names:
        np.testing.assert_array_equal(again.blows[name], rigid.blows[name])
    np.testing.assert_array_equal(again.events, rigid.events)
    for name, values in rigid.trace.items():
        np.testing.assert_array_equal(again.trace[name], values)
    assert again.summary() == rigid.summary()


def test_saving_again_replaces_and_leaves_other_files_alone(rigid, tmp_path):
    rigid.save(tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    simulate(RIGID, 0.2, settle=0.0).save(tmp_path)
    assert (tmp_path / "notes.txt").exists()
    assert not (tmp_path / "trace.csv").exists()
    assert len(Result.load(tmp_path).blows) == 4


def test_nothing_half_written_stays(tmp_path):
    def fail():
        with staged(tmp_path / "run") as draft:
            (draft / "half.csv").write_text("1,")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_what_was_made_of_an_earlier_result_goes(rigid, tmp_path):
    """A report beside the numbers of another run would be believed; other files stay."""
    assert set(FIGURES) == set(CAPTIONS)
    derived = [REPORT, *(f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg"))]
    for name in (*derived, "notes.txt"):
        (tmp_path / name).write_text("made earlier")
    rigid.save(tmp_path)  # that folder held no result: nothing in it was made of one
    assert all((tmp_path / name).exists() for name in derived)
    rigid.save(tmp_path)
    assert not any((tmp_path / name).exists() for name in derived)
    assert (tmp_path / "notes.txt").exists()


def test_a_long_trace_becomes_a_compressed_file(rigid, tmp_path, monkeypatch):
    monkeypatch.setattr("percussion_model.simulation.result.LONGEST_CSV", 100)
    rigid.save(tmp_path)
    assert (tmp_path / "trace.npz").exists()
    assert not (tmp_path / "trace.csv").exists()
    np.testing.assert_array_equal(Result.load(tmp_path).trace["gap"], rigid.trace["gap"])


def test_what_cannot_be_written_is_said_before(rigid, tmp_path):
    (tmp_path / "file").write_text("")
    check_writable(tmp_path / "new" / "folder")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(ResultError, match="cannot be written"):
            check_writable(folder)
        with pytest.raises(ResultError, match="cannot be written"):
            rigid.save(folder)


def test_a_blow_table_without_a_column_is_refused(rigid, tmp_path):
    rigid.save(tmp_path)
    table = rigid.to_pandas().drop(columns=["hole_depth", "hole_advance"])
    table.to_csv(tmp_path / "blows.csv", index=False, na_rep="nan")
    with pytest.raises(ResultError, match="not a complete result: has no column hole_advance"):
        Result.load(tmp_path)


def test_what_is_no_result_is_refused(tmp_path):
    with pytest.raises(ResultError, match="no such result folder"):
        Result.load(tmp_path / "none")
    with pytest.raises(ResultError, match=r"no summary\.json and no scene\.toml"):
        Result.load(tmp_path)
    RIGID.to_toml(tmp_path / "scene.toml")
    with pytest.raises(ResultError, match=r"no result folder, it has no summary\.json; "):
        Result.load(tmp_path)
    (tmp_path / "summary.json").write_text("{}")
    with pytest.raises(ResultError, match="not a complete result"):
        Result.load(tmp_path)


def _saved(rigid, tmp_path):
    rigid.save(tmp_path / "out")
    return tmp_path / "out"


STRANGE_TRACES = {
    "pickles": lambda path: np.savez(path, time=np.array([print], dtype=object)),
    "no archive": lambda path: path.write_bytes(b"PK" + bytes(100)),
    "an empty file": lambda path: path.write_bytes(b""),
    "a folder": lambda path: path.mkdir(),
}


@pytest.mark.parametrize("name", STRANGE_TRACES)
def test_a_strange_trace_is_refused_and_nothing_of_it_is_run(name, rigid, tmp_path):
    folder = _saved(rigid, tmp_path)
    (folder / "trace.csv").unlink(missing_ok=True)
    STRANGE_TRACES[name](folder / "trace.npz")
    with pytest.raises(ResultError, match=r"trace\.npz: cannot be read"):
        Result.load(folder)


def test_arrays_that_unpack_to_too_much_are_not_unpacked(rigid, tmp_path, monkeypatch):
    folder = _saved(rigid, tmp_path)
    np.savez_compressed(folder / "trace.npz", time=np.zeros(10**6))
    assert (folder / "trace.npz").stat().st_size < 100_000
    monkeypatch.setattr("percussion_model.simulation.files.LARGEST_TABLE", 10**6)
    with pytest.raises(ResultError, match="unpacks to 8000128 bytes, more than 1000000"):
        Result.load(folder)


@pytest.mark.parametrize(
    "text", ["[" * 50_000, "[]", "5", "{}", '{"energy": 5}', '{"energy": {"a": {}}}', "\0"]
)
def test_a_strange_summary_is_one_error(text, rigid, tmp_path):
    folder = _saved(rigid, tmp_path)
    (folder / "summary.json").write_text(text)
    with pytest.raises(ResultError, match="not a complete result"):
        Result.load(folder)


@pytest.mark.parametrize("text", ["", "time", "time,kind\n1", "a\n" + "x" * 200_000, "time\n\0"])
def test_a_strange_table_is_one_error(text, rigid, tmp_path):
    folder = _saved(rigid, tmp_path)
    (folder / "blows.csv").write_text(text)
    with pytest.raises(ResultError, match="not a complete result") as caught:
        Result.load(folder)
    assert len(str(caught.value)) < 1000


def test_tables_for_pandas(rigid):
    pandas = pytest.importorskip("pandas")
    blows, events = rigid.to_pandas(), rigid.events_to_pandas()
    assert isinstance(blows, pandas.DataFrame)
    assert list(blows.columns) == list(BLOW.names)
    assert len(blows) == len(rigid.blows)
    assert "contact_closed" in set(events["kind"])
    assert events["time"].is_monotonic_increasing
