"""A study as one self-contained HTML page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from markupsafe import Markup

from percussion_model.analysis.study import Study, headlines
from percussion_model.interface.page import (
    FigureBlock,
    render,
    shown_unit,
    without_zoom,
    write_page,
)

# What each figure shows.
CAPTIONS = {
    "map": (
        "A map over two parameters and cuts through it; choose what is shown, and values of the "
        "others by the sliders. Crosses mark points whose motion is not periodic."
    ),
    "scatter": (
        "All points over each parameter. Blue is periodic, orange aperiodic. Points that are "
        "chosen with a box or lasso in one panel stand out in all."
    ),
    "points": "All points and what was found there; a click on a heading sorts.",
}
# So many failed points are listed.
MOST_FAILURES = 10


def write_study_report(found: Study, folder: str | Path) -> Path:
    """Write `report.html`, which needs no other file and no network.

    Without bokeh it has no figures, and says so.

    Parameters
    ----------
    found : Study
    folder : str or Path
        Made if it is not there.

    Returns
    -------
    Path
        The report.
    """
    return write_page(Path(folder), render_study_report(found))


def render_study_report(found: Study) -> str:
    """Return the page as text."""
    remark, scripts = without_zoom(), ""
    blocks: list[FigureBlock] = []
    if not remark:
        from percussion_model.interface.plotting.zoom import embedded
        from percussion_model.interface.plotting.zoom_study import zoomable_study

        made = zoomable_study(found)
        places, scripts = embedded(list(made.values()))
        blocks = [
            FigureBlock(Markup(place), CAPTIONS[name])
            for name, place in zip(made, places, strict=True)
        ]
    points = found.points
    failed = [k for k, text in enumerate(found.failures) if text]
    return render(
        "study.html.j2",
        found.scene,
        dict.fromkeys(points.keys, "varied"),
        count=len(points),
        headlines=headlines(found),
        axes=[_axis(found, k) for k in range(len(points.keys))],
        failures=[
            (", ".join(f"{key} = {value:.6g}" for key, value in points.changes(k).items()),
             found.failures[k])
            for k in failed[:MOST_FAILURES]
        ],
        failed=len(failed),
        figures=blocks,
        zoomable=bool(blocks),
        remark=remark,
        scripts=Markup(scripts),
    )  # fmt: skip


def _axis(found: Study, k: int) -> tuple[str, str, str, str, str, str]:
    """Key, ends, count, unit and meaning of what was varied."""
    key, values = found.points.keys[k], found.points.values[:, k]
    row = found.scene.row_of(key)
    ends = f"{values.min():.6g}", f"{values.max():.6g}"
    return key, *ends, f"{len(np.unique(values)):,}", shown_unit(row.unit), row.description
