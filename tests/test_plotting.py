"""Figures: what is drawn for which scene, and that a stranger can read the axes."""

from __future__ import annotations

import dataclasses
import re
from io import BytesIO

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from percussion_model.analysis.drill_string import closed_contacts
from percussion_model.coupling.coupled_run import CoupledRun
from percussion_model.interface.plotting import CAPTIONS, draw_figures, figures
from percussion_model.interface.plotting.coupled_signals import PANELS, draw_signals
from percussion_model.interface.plotting.style import MODE_COLOURS, STYLE, draw_by_mode, save_png
from percussion_model.interface.plotting.window import last_blow_window, stress_fields
from percussion_model.physics.records import EVENT, EventKind, Mode
from percussion_model.scene.scene import Scene
from percussion_model.simulation.files import ResultError
from percussion_model.simulation.result import Result
from percussion_model.simulation.simulate import simulate
from percussion_model.verification.hard_cases import Collection

ELASTIC = Scene(run={"duration": 0.2, "settle": 0.0})
RIGID = ELASTIC.replace(**{"piston.model": "rigid", "bit.model": "rigid"})
DROP = Scene(
    effects={"drive": "none"},
    piston={"model": "absent"},
    start={"bit_velocity": 5.25},
    run={"duration": 0.06, "settle": 0.0},
)
SCENES = {
    "elastic": (ELASTIC, ["overview", "bit_motion", "activation", "stress_waves"]),
    "rigid": (RIGID, ["overview", "bit_motion", "activation"]),
    "drop": (DROP, ["bit_motion", "stress_waves"]),
    "rigid drop": (DROP.replace(**{"bit.model": "rigid"}), ["bit_motion"]),
}


@pytest.fixture(scope="module")
def results() -> dict[str, Result]:
    return {name: simulate(scene) for name, (scene, _) in SCENES.items()}


@pytest.mark.parametrize("name", SCENES)
def test_every_axis_has_a_name_and_a_unit(name, results):
    drawn = []
    with matplotlib.rc_context(STYLE):
        for figure_name, fig in draw_figures(results[name]):
            drawn.append(figure_name)
            fig.canvas.draw()
            for ax in fig.axes:
                for axis in (ax.xaxis, ax.yaxis):
                    shares = axis is ax.xaxis and not any(
                        tick.get_visible() and tick.get_text() for tick in ax.get_xticklabels()
                    )
                    if shares or not axis.get_visible():
                        continue
                    if ax.get_label() == "<colorbar>" and axis is ax.xaxis:
                        continue
                    assert re.search(r"\[.+\]", axis.get_label_text()), (figure_name, ax)
    assert drawn == SCENES[name][1]
    assert set(drawn) <= set(CAPTIONS)


def test_files_are_whole_and_not_empty(results, tmp_path):
    paths = figures(results["drop"], tmp_path / "new" / "folder")
    assert [path.name for path in paths] == [
        f"{name}.{kind}" for name in SCENES["drop"][1] for kind in ("png", "svg")
    ]
    assert sorted(paths) == sorted((tmp_path / "new" / "folder").iterdir())
    for path in paths:
        assert 20_000 < path.stat().st_size < 600_000
        if path.suffix == ".png":
            assert np.ptp(imread(path)) > 0.5
        else:
            assert path.read_text(encoding="utf-8").rstrip().endswith("</svg>")


def test_same_result_gives_same_files(results, tmp_path):
    first = figures(results["rigid drop"], tmp_path / "a")
    second = figures(results["rigid drop"], tmp_path / "b")
    for a, b in zip(first, second, strict=True):
        assert a.read_bytes() == b.read_bytes()


def test_a_result_draws_one_figure_that_a_notebook_shows(results):
    with matplotlib.rc_context(STYLE):
        drawn = dict(draw_figures(results["elastic"]))
    for name, fig in drawn.items():
        shown = results["elastic"].plot(name)._repr_png_()
        assert shown.startswith(b"\x89PNG")
        with matplotlib.rc_context(STYLE):
            fig.savefig(buffer := BytesIO(), dpi=STYLE["figure.dpi"])
        ours, theirs = imread(BytesIO(shown)), imread(BytesIO(buffer.getvalue()))
        np.testing.assert_array_equal(ours, theirs)
    with pytest.raises(ResultError, match="there is none: did you mean overview"):
        results["elastic"].plot("overvew")
    with pytest.raises(ResultError, match=r"this run has none of that name: .* stress_waves"):
        results["drop"].plot("overview")


def test_window_is_the_last_whole_blow(results):
    result = results["elastic"]
    window = last_blow_window(result)
    blow = result.blows[-1]
    assert window.is_blow
    assert window.origin == blow["time"]
    assert window.length == blow["period"]
    assert len(window.contacts) == blow["contacts"]
    assert window.contacts[0][0] == pytest.approx(0.0, abs=1e-9)
    assert window.time[0] < 0.0 < window.activation_until < window.active_until < window.length
    # One transit of the piston and back, the St Venant contact, and what the loss adds.
    assert window.contacts[0][1] == pytest.approx(2.0 * ELASTIC.piston.transit_time, rel=0.15)


def test_window_of_a_drop_test_starts_at_first_contact(results):
    window = last_blow_window(results["drop"])
    assert not window.is_blow
    assert window.origin == pytest.approx(1.9047e-6, rel=1e-3)  # oracle 9 of the paper's notes
    assert window.active_until < 1e-3  # the zoom shows the first contact with the rock


def test_stress_after_impact_is_that_of_st_venant(results):
    window = last_blow_window(results["elastic"])
    fields = stress_fields(window)
    assert list(fields) == ["piston", "bit"]
    piston = fields["piston"]
    assert piston.depth_edges[-1] == pytest.approx(ELASTIC.piston.length)
    assert piston.stress.shape == (len(piston.depth_edges) - 1, len(piston.time_edges) - 1)
    steel = ELASTIC.piston.sections[0]
    expected = (
        0.5 * steel.density * steel.wave_speed * results["elastic"].blows[-1]["impact_velocity"]
    )
    half_transit = np.searchsorted(piston.time_edges, 0.8 * ELASTIC.piston.transit_time)
    assert piston.stress[-4, half_transit] == pytest.approx(expected, rel=0.03)
    assert fields["bit"].stress[3, half_transit] == pytest.approx(expected, rel=0.03)


def test_changed_inputs_give_no_figure_of_another_run(results, tmp_path):
    result = results["elastic"]
    blows = result.blows.copy()
    blows["time"][1:] += 0.01
    changed = dataclasses.replace(result, blows=blows)
    with pytest.warns(UserWarning, match="other blows"):
        paths = figures(changed, tmp_path)
    assert {path.stem for path in paths} == {"overview"}


def test_contacts_are_paired_and_cut_to_the_window():
    events = np.zeros(5, EVENT)
    events["time"] = [0.5, 1.0, 1.2, 2.0, 4.0]
    closed, opened = EventKind.CONTACT_CLOSED, EventKind.CONTACT_OPENED
    events["kind"] = [opened, closed, opened, closed, EventKind.DRIVE_DOWN]
    found = np.array(closed_contacts(events, 1.0, 3.0))
    np.testing.assert_allclose(found, [(0.0, 0.2), (1.0, 2.0)])


def test_a_line_by_mode_leaves_no_gap():
    from matplotlib.figure import Figure

    ax = Figure().subplots()
    mode = np.array([Mode.FF, Mode.FF, Mode.FC, Mode.FF])
    draw_by_mode(ax, np.arange(4.0), np.arange(4.0), mode)
    lines = {line.get_color(): line.get_xdata() for line in ax.lines}
    np.testing.assert_array_equal(lines[MODE_COLOURS[Mode.FC]], [2.0, 3.0])
    np.testing.assert_array_equal(lines[MODE_COLOURS[Mode.FF]], [0.0, 1.0, 2.0, 3.0])


class _TornFigure(Figure):
    """A figure whose file breaks off, as on a full disk."""

    def savefig(self, path, **choice):
        with open(path, "wb") as file:
            file.write(b"half of it")
        raise OSError("no space left on device")


def test_a_single_figure_is_written_whole_or_not_at_all(tmp_path):
    path = save_png(Figure(figsize=(2.0, 1.0)), tmp_path / "new" / "one.png", dpi=50)
    before = path.read_bytes()
    assert imread(path).shape[:2] == (50, 100)
    with pytest.raises(ResultError, match="no space left"):
        save_png(_TornFigure(), path, dpi=50)
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == ["one.png"]


def test_signals_of_a_coupled_run_are_named_in_words():
    """Symbols stand behind words; names of signals stand behind what they are."""
    time = np.linspace(0.0, 1.0, 11)
    columns = {name: time for panel in PANELS for name in panel.signals}
    axes = draw_signals(CoupledRun({"time": time, **columns}, 1e-3, 10), "A system").axes
    titles = [ax.get_title(loc="left") for ax in axes]
    assert len(titles) == len(PANELS)
    assert all(re.match(r"[A-Z][a-z]+ [a-z]+ ", title) for title in titles)
    assert "loading stiffness $K_R$" in titles[0]
    assert titles[0].endswith(" [kN/mm]")
    assert titles[-1] == "What the controller does"
    assert [text.get_text() for text in axes[-1].get_yticklabels()] == [
        "drills", "in a void", "retracts",
    ]  # fmt: skip
    labels = [text.get_text() for ax in axes if ax.get_legend() for text in ax.get_legend().texts]
    assert len(labels) == 6
    assert all(re.match(r"[a-z ]+: \w+\.\w+$", label) for label in labels)


def test_a_system_without_usual_signals_shows_what_it_has():
    time = np.linspace(0.0, 1.0, 11)
    (ax,) = draw_signals(CoupledRun({"time": time, "a.b": time}, 1e-3, 10), "A system").axes
    assert [text.get_text() for text in ax.get_legend().texts] == ["signal: a.b"]


def test_what_lies_on_another_line_is_seen(results):
    """The bit is nearly where the hole is: its line is above that, and thinner."""
    with matplotlib.rc_context(STYLE):
        overview = dict(draw_figures(results["elastic"]))["overview"]
    hole, bit = overview.axes[0].lines
    assert (hole.get_label(), bit.get_label()) == ("hole", "mean bit position")
    assert hole.get_zorder() <= bit.get_zorder()
    assert bit.get_linewidth() < 0.5 * hole.get_linewidth()
    assert bit.get_color() != hole.get_color()


def test_letters_of_contacts_lie_on_no_line(results):
    with matplotlib.rc_context(STYLE):
        fig = dict(draw_figures(results["elastic"]))["activation"]
        fig.canvas.draw()
        ax = next(ax for ax in fig.axes if "near zero" in ax.get_title(loc="left"))
        assert {text.get_text() for text in ax.texts} == set("ABCD")
        for text in ax.texts:
            box = text.get_window_extent()
            for line in ax.lines[:-1]:  # the last is the axis of zero
                places = line.get_transform().transform(line.get_xydata())
                inside = (places > box.min + 1.0) & (places < box.max - 1.0)
                assert not inside.all(axis=1).any(), text.get_text()


def test_every_hard_case_is_a_dot_and_the_greatest_is_named():
    from percussion_model.interface.plotting.stability_dots import PANELS, draw_stability

    rows = [
        {"case": f"case_{k}", "solver": solver, "residual": residual, "momentum": 1e-12,
         "numerical": None, "events_per_second": 100.0 * (k + 1), "ceiling": 2e4}
        for solver in ("wave", "rigid") for k, residual in enumerate((1e-9, -1e-8, 0.0))
    ]  # fmt: skip
    with matplotlib.rc_context(STYLE):
        axes = draw_stability(Collection(rows, 1.0, [])).axes
    assert len(axes) == len(PANELS)
    dots = [line for line in axes[0].lines if line.get_marker() == "o"]
    for line in dots:  # sorted, by size, what is zero at the foot
        np.testing.assert_allclose(line.get_ydata(), [PANELS[0].foot, 1e-9, 1e-8])
    names = [text.get_text() for text in axes[0].get_xticklabels()]
    assert len(dots) == len(names) == 2
    assert all("3 cases" in name and name.endswith("case_1") for name in names)
    assert all("0 cases" in text.get_text() for text in axes[2].get_xticklabels())
    assert not [line for line in axes[2].lines if line.get_marker() == "o"]


def test_errors_are_drawn_in_per_cent():
    from percussion_model.interface.plotting.error_against_time import _log_axes

    ax = Figure().subplots()
    ax.plot([1e-3, 1.0], [1e-4, 1e-2])
    _log_axes(ax)
    ax.figure.draw_without_rendering()
    shown = {text.get_text(): value for value, text in
             zip(ax.get_yticks(), ax.get_yticklabels(), strict=True)}  # fmt: skip
    assert shown["1"] == pytest.approx(1e-2)
    assert shown["0.01"] == pytest.approx(1e-4)
