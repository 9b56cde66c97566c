"""Pages in a real browser: they draw, zoom and choose, without errors and without a network."""

from __future__ import annotations

import numpy as np
import pytest

from percussion_model.analysis.study import Study, grid, study, table
from percussion_model.interface.report import (
    STUDY_CAPTIONS,
    render_study_report,
    write_report,
    write_study_report,
)
from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import simulate
from tests.browser import Drag, find_browser, visit
from tests.test_report import Outline

pytest.importorskip("tornado", reason="a browser is driven through tornado")
needs_browser = pytest.mark.skipif(
    find_browser() is None, reason="no Chromium is installed to open pages with"
)
LARGEST = 4_000_000  # [bytes]
CHOOSE = (
    "((id, value) => {const one = document.getElementById(id); one.value = value;"
    "(one.oninput ?? one.onchange).call(one);})"
)
SHORT = Scene(title="A <short> run", run={"duration": 0.3, "settle": 0.1})
SCENE = Scene(title="rigid <bodies>").computed_by("rigid")
AXES = {
    "feed.force": np.linspace(1500.0, 6000.0, 4),
    "rock.loading_stiffness": np.geomspace(3e8, 3e9, 3),
    "drive.reversal_distance": np.array([0.02, 0.04]),
}


def opened(path, folder, *steps):
    """Answers of a page that is opened without a fault."""
    assert path.stat().st_size < LARGEST
    found = visit(path, folder / "profile", steps, folder / "page.png")
    assert found.errors == []
    own = path.resolve().as_uri()
    assert [at for at in found.requests if at != own and not at.startswith("data:")] == []
    assert found.requests.count(own) == 1
    assert found.height > 1200
    assert (folder / "page.png").stat().st_size > 50_000
    return found.answers


def self_contained(path):
    outline = Outline(path.read_text(encoding="utf-8"))
    assert "link" not in outline.tags
    return all(target.startswith(("#", "data:")) for target in outline.targets)


@pytest.fixture(scope="module")
def run_page(tmp_path_factory):
    return write_report(simulate(SHORT), tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return study(SCENE, grid(AXES), tmp_path_factory.mktemp("study"), processes=1)


def test_a_run_page_is_self_contained(run_page):
    assert self_contained(run_page)
    text = run_page.read_text(encoding="utf-8")
    assert "<short>" not in text
    assert text.count("<figcaption><strong>") == 4


@needs_browser
def test_the_last_blow_of_a_run_is_moved_through(run_page, tmp_path):
    """The greatest force is that of the table of blows, and time is chosen in a plot."""
    first, after, greatest = opened(
        run_page,
        tmp_path,
        "report.player.t",
        Drag(1, (0.5, 0.5), (0.9, 0.5)),
        "report.player.t",
        "report.blow.greatest.bit_force",
    )
    assert first < after < 1.3e-3
    blows = simulate(SHORT).blows
    assert greatest == pytest.approx(blows["peak_bit_force"][-1], rel=2e-3)


@needs_browser
def test_a_dragged_box_enlarges_a_drawing(run_page, tmp_path):
    ask = "document.querySelector('figure svg').getAttribute('viewBox').split(' ').map(Number)"
    again = "document.querySelector('figure svg').dispatchEvent(new Event('dblclick'))"
    number = 4  # drawings follow the plots of the blow
    before, near, _, after = opened(
        run_page, tmp_path, ask, Drag(number, (0.15, 0.06), (0.35, 0.16)), ask, again, ask
    )
    assert near[2] == pytest.approx(0.2 * before[2], rel=0.05)
    assert before[0] < near[0] < near[0] + near[2] < before[0] + before[2]
    assert after == before


@needs_browser
def test_a_map_shows_the_slice_and_the_quantity_that_are_chosen(found, tmp_path):
    path = write_study_report(found, tmp_path)
    assert self_contained(path)
    shown = "study.cells().map(one => one[0])"
    choose = f"{CHOOSE}('drive.reversal_distance', 0); {CHOOSE}('shown', 'impact')"
    rates, _, impacts, title = opened(
        path,
        tmp_path,
        shown,
        choose,
        shown,
        "document.querySelector('#map figcaption').textContent",
    )
    rows = found.rows.reshape(found.points.shape)
    # row by row from the softest rock on, as the map is drawn
    assert rates == pytest.approx(3600.0 * rows["rate_of_penetration"][:, :, 1].T.ravel(), rel=1e-6)
    assert impacts == pytest.approx(rows["impact_velocity"][:, :, 0].T.ravel(), rel=1e-6)
    assert title == "Impact velocity [m/s]"


DRAWN_ROWS = (
    "[...document.querySelectorAll('.points tbody tr')].map(row => [...row.children]"
    ".map(cell => cell.textContent)).filter(row => row.length)"
)


@needs_browser
def test_a_study_shows_three_digits_and_two_of_an_error(tmp_path):
    """The error of the grid is not known in a study; what was given has all of its digits."""
    points = grid({"feed.force": [2636.3636, 4321.0], "drive.reversal_distance": [0.002, 0.04]})
    found = study(SCENE, points, tmp_path / "out", processes=1)
    rows = found.rows.copy()
    rows["rate_of_penetration"][:2] = 16.2113e-3, 0.0174321
    rows["rate_of_penetration_error"][:2] = 1.8069e-11, 0.0004321
    rows["drilling_cycles_per_blow"][:2] = 3.0, 3.14159
    path = write_study_report(Study(SCENE, points, rows, found.failures), tmp_path)
    (first, second, *_), names, *shown, rates, _, (least, *_), _, (most, *_) = opened(
        path, tmp_path, DRAWN_ROWS, "[...document.getElementById('shown')].map(o => o.textContent)",
        "study.shown('rate', 16.2113)", "study.shown('off', 1.8069e-8)", "study.shown('cycles', 3)",
        "study.rates", *["document.querySelectorAll('.points button')[4].click()", DRAWN_ROWS] * 2,
    )  # fmt: skip
    assert first[:2] == ["2636.4", "0.002"]
    assert first[4:7] == ["58.4", "6.5e-08", "1.1e-09"]
    assert second[4:7] == ["62.8", "1.6", "0.025"]
    assert shown == ["16.2", "1.8e-08", "3"]
    assert rates[0] == "58.4"
    assert "62.8 ± 1.6" in rates
    assert "Standard error (scatter) or convergence [m/h]" in names
    sizes = sorted(float(text) for text in (least[4], most[4]))
    assert [float(least[4]), float(most[4])] == sizes
    assert sizes[0] < sizes[1]


@needs_browser
def test_a_map_hides_what_is_undecided_in_each_slice(found, tmp_path):
    """One point, in the other slice than that shown first."""
    rows = found.rows.copy()
    rows["rate_of_penetration_error"][0] = 2.0 * rows["rate_of_penetration"][0]
    path = write_study_report(Study(found.scene, found.points, rows, found.failures), tmp_path)
    cells = "study.cells().map(([value, verdict]) => [value === null, verdict])"
    slide = f"{CHOOSE}('drive.reversal_distance', 0)"
    choose = f"{CHOOSE}('shown', 'impact')"
    first, _, second, _, third = opened(path, tmp_path, cells, slide, cells, choose, cells)
    assert first == [[False, ""]] * 12
    assert second == [[True, "undecided"]] + [[False, ""]] * 11
    # an impact velocity is known there
    assert third == [[False, "undecided"]] + [[False, ""]] * 11


@needs_browser
def test_samples_are_scattered_over_each_parameter(tmp_path):
    """One of them fails, and the page says so; a box chooses points, and all have error bars."""
    points = table({"feed.force": [1e3, 2e3, 4e3], "rock.unloading_ratio": [5.0, 0.5, 8.0]})
    found = study(SCENE, points, tmp_path / "out", processes=1)
    path = write_study_report(found, tmp_path)
    text = path.read_text(encoding="utf-8")
    assert "rock.unloading_ratio = 0.5: must be a number above 1" in text
    assert STUDY_CAPTIONS["scatter"] in text
    count, panels, bars, _ = opened(
        path, tmp_path, "document.getElementById('shown').options.length",
        "document.querySelectorAll('#scatter figure').length", "[0, 2].map(study.bars)",
        Drag(1, (0.2, 0.2), (0.8, 0.7)), "1",
    )  # fmt: skip
    assert count > 10
    assert panels == 2
    assert bars == pytest.approx(3600.0 * found.rows["rate_of_penetration_error"][[0, 2]], rel=1e-5)


def test_a_large_study_makes_a_page_of_some_megabytes():
    axes = {key: np.linspace(1.0, 2.0, 22) for key in AXES}
    points = grid(axes)
    rows = np.zeros(len(points), dtype=study_rows())
    for name in rows.dtype.names:
        rows[name] = np.random.default_rng(1).random(len(points))
    page = render_study_report(Study(SCENE, points, rows, [""] * len(points)))
    assert len(page.encode()) < LARGEST


def study_rows():
    from percussion_model.analysis.study.response import ROW

    return ROW
