"""The drawings of the documents: every text is inside and readable, and they are current."""

from __future__ import annotations

import html
import re
import tomllib
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from docs.blocks import IMAGES, REFERENCE
from docs.drawings import fronts, house, system, waves
from docs.pages.drawings import DPI, DRAWINGS
from fmu_src.parts.build import PARTS
from fmu_src.system.archive import HAMMER, read_plan
from percussion_model import Scene
from percussion_model.interface.plotting.style import STYLE, save_figures

ROOT = Path(__file__).resolve().parent.parent
# Drawn without a run, from what the code says of itself: these are held to it word by word.
OF_THE_CODE = ("drawing_house", "drawing_system")
# Boxes of texts have a margin: they may overlap by so much [pixel].
TOUCHING = 1.0


def misplaced_texts(fig: Figure) -> list[str]:
    """Texts of a drawn figure that leave it, or lie on each other; none in a good one."""
    fig.draw_without_rendering()
    unseen = _unseen_ticks(fig)
    texts = [one for one in fig.findobj(Text) if one.get_visible() and one.get_text().strip()]
    boxes = [
        (one.get_text(), one.get_window_extent())
        for one in texts
        if _is_shown(one) and one not in unseen
    ]
    frame, found = fig.bbox, []
    for k, (text, one) in enumerate(boxes):
        if one.x0 < frame.x0 or one.y0 < frame.y0 or one.x1 > frame.x1 or one.y1 > frame.y1:
            found.append(f"{text!r} leaves the figure")
        for other, two in boxes[k + 1 :]:
            wide = min(one.x1, two.x1) - max(one.x0, two.x0)
            high = min(one.y1, two.y1) - max(one.y0, two.y0)
            if wide > TOUCHING and high > TOUCHING:
                found.append(f"{text!r} lies on {other!r}")
    return found


def _unseen_ticks(fig: Figure) -> set[Text]:
    """Labels of ticks beyond the ends of their axis, which exist but are not drawn."""
    found = set()
    for ax in fig.axes:
        for axis in (ax.xaxis, ax.yaxis):
            low, high = sorted(axis.get_view_interval())
            room = 1e-9 * (high - low)
            for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
                if not low - room <= tick.get_loc() <= high + room:
                    found |= {tick.label1, tick.label2}
    return found


def _is_shown(text: Text) -> bool:
    """Whether a text is drawn at all: the names of axes that are off are not."""
    return text.axes is None or text.axes.axison or text in text.axes.texts


@pytest.mark.parametrize("name", DRAWINGS)
def test_texts_are_inside_and_apart(name, tmp_path):
    with matplotlib.rc_context(STYLE):
        fig = DRAWINGS[name]()
        assert misplaced_texts(fig) == []
    for path in save_figures(lambda: [(name, fig)], tmp_path, dpi=DPI):
        assert 20_000 < path.stat().st_size < 300_000


def test_misplaced_texts_are_found():
    fig = matplotlib.figure.Figure()
    fig.text(0.5, 0.5, "one")
    fig.text(0.5, 0.5, "upon another")
    fig.text(0.99, 0.1, "beyond the edge")
    assert misplaced_texts(fig) == [
        "'one' lies on 'upon another'", "'beyond the edge' leaves the figure",
    ]  # fmt: skip


@pytest.mark.parametrize("name", OF_THE_CODE)
def test_drawings_of_the_code_are_current(name):
    """Matplotlib notes every text of a figure in its SVG."""
    svg = (IMAGES / f"{name}.svg").read_text(encoding="utf-8")
    written = {html.unescape(text) for text in re.findall(r"<!-- (.*?) -->", svg)}
    with matplotlib.rc_context(STYLE):
        drawn = {text.get_text() for text in DRAWINGS[name]().axes[0].texts}
    assert drawn <= written, f"run: python -m docs.make drawings {name}"


def test_every_drawing_is_there():
    for name in DRAWINGS:
        assert (IMAGES / f"{name}.png").is_file()
        assert (IMAGES / f"{name}.svg").is_file()


def test_layers_are_those_of_the_contract():
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    contracts = tomllib.loads(text)["tool"]["importlinter"]["contracts"]
    rows = next(one["layers"] for one in contracts if one["type"] == "layers")
    assert house.layers() == [row.replace(" : ", " | ").split(" | ") for row in rows]
    for row in house.layers():
        for folder in row:
            assert folder in house.COLOURS
            assert house.line_on(f"percussion_model/{folder}")


def test_every_component_and_signal_has_its_place():
    plan = read_plan(system.SYSTEM)
    assert set(system.BLOCKS) == set(plan.components)
    # systems of their own have the others
    assert set(plan.components.values()) == {HAMMER, *PARTS} - {"RockFilter", "WaveString"}
    signals = system.signals(plan)
    assert set(system.ROUTES) == set(signals)
    assert sum(map(len, signals.values())) == len(plan.connections)
    assert all(re.search(r" \[.+\]$", name) for names in signals.values() for name in names)


def test_arrows_begin_and_end_at_their_blocks():
    def touches(block, place):
        edges = (
            np.isclose(place[0], [block.x, block.x + block.width]),
            np.isclose(place[1], [block.y, block.y + block.height]),
        )
        across = block.x <= place[0] <= block.x + block.width
        along = block.y <= place[1] <= block.y + block.height
        return (edges[0].any() and along) or (edges[1].any() and across)

    for (source, sink), route in system.ROUTES.items():
        assert touches(system.BLOCKS[source], route.points[0]), source
        assert touches(system.BLOCKS[sink], route.points[-1]), sink


def test_fronts_take_the_share_of_the_impedances():
    """At the step of the piston the force divides, and both bars' times add up."""
    scene = waves.stepped(Scene.from_toml(REFERENCE))
    upper, lower = scene.piston.sections
    found, borders = fronts.fronts(scene, [(0.0, 1.0)], 200e-6)
    assert borders == pytest.approx([0.0, 0.105, 0.175, 0.37625])
    upwards = [f for f in found if f.start[1] == borders[1] and f.end[1] == 0.0]
    passed = min(upwards, key=lambda f: f.start)
    share = 2.0 * upper.area / (upper.area + lower.area)
    assert passed.force == pytest.approx(share)
    assert passed.end[0] == pytest.approx(scene.piston.transit_time)
    back = next(f for f in found if f.start == passed.end)
    assert back.force == pytest.approx(-share)  # a free end


def test_fronts_of_an_open_gap_turn_back():
    scene = Scene.from_toml(REFERENCE)
    found, borders = fronts.fronts(scene, [(0.0, 1e-6)], 100e-6)
    from_above = [f for f in found if f.end[1] == borders[1] and f.start[1] < borders[1]]
    (first,) = [f for f in from_above if f.end[0] < 80e-6]
    assert any(f.start == first.end and f.end[1] == 0.0 and f.force == -first.force for f in found)
    assert not any(f.start == first.end and f.end[1] > borders[1] for f in found)
