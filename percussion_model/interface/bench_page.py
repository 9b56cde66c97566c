"""Page of a controller's standard runs, with a figure for each."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from percussion_model.coupling import bench
from percussion_model.coupling.bench import FEED, HIGHEST_FEED, HIGHEST_TORQUE, Score
from percussion_model.interface.bench_text import (
    COLUMNS,
    TEXTS,
    about_errors,
    cells,
    mean_text,
    points_text,
)
from percussion_model.interface.pages import filled
from percussion_model.interface.plotting import style
from percussion_model.simulation.files import staged

PAGE = "index.html"
VOID_COLOUR, LIMIT_COLOUR = "#dddddd", "#bb0000"


def write_bench_page(scores: Sequence[Score], folder: Path, title: str) -> Path:
    """Write a figure for each run and one page with all, everything or nothing; return the page."""
    with staged(folder) as draft:
        pictures = {}
        for score in scores:
            figure = _figure(score, draft / f"{score.trial}.png")
            pictures[score.trial] = b64encode(figure.read_bytes()).decode()
        page = filled(
            "bench.html.j2",
            title=title,
            scores=scores,
            failed=[score.trial for score in scores if score.faults],
            mean=mean_text(scores),
            about_errors=about_errors(scores),
            pictures=pictures,
            bench=bench,
            columns=COLUMNS,
            texts=TEXTS,
            cells=cells,
            points_text=points_text,
        )
        (draft / PAGE).write_text(page, encoding="utf-8")
    return folder / PAGE


@rc_context(style.STYLE)
def _figure(score: Score, path: Path) -> Path:
    """Feed and what is wanted, force of the rig, depth and torque, over time."""
    run = score.run
    figure = Figure(figsize=(10.0, 5.4), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True)
    (feed, depth), (rig, torque) = axes
    _panel(feed, score, "feed force on the bit [kN]", 1e-3, "string.feed_force_mean")
    _panel(rig, score, "force command to the rig [kN]", 1e-3, "controller.force_command")
    _panel(depth, score, "depth of the bit [mm]", 1e3, "hammer.bit.position")
    _panel(torque, score, "torque on the rotation [N m]", 1.0, "rock.rotation_torque")
    wanted = feed.axhline(1e-3 * FEED, color="k", linewidth=0.9, linestyle="--")
    for ax, level in ((feed, 1e-3 * HIGHEST_FEED), (torque, HIGHEST_TORQUE)):
        limit = ax.axhline(level, color=LIMIT_COLOUR, linewidth=0.9, linestyle=":")
        ax.set_ylim(bottom=0.0)
    handles: list[Artist] = [wanted, limit]
    labels = ["wanted", "limit"]
    if np.any(run["rock.in_void"] > 0.0):
        handles.append(Patch(color=VOID_COLOUR))
        labels.append("bit in the void")
    if score.run.error:
        handles.append(feed.axvline(run["time"][-1], color=LIMIT_COLOUR, linewidth=2.0))
        labels.append("ended early")
    for ax in axes[1]:
        ax.set_xlabel("time [s]")
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return style.save_png(figure, path, dpi=90)


def _panel(ax: Axes, score: Score, label: str, factor: float, name: str) -> None:
    run = score.run
    ax.plot(run["time"], factor * run[name], linewidth=1.2)
    ax.fill_between(
        run["time"], 0, 1, where=run["rock.in_void"] > 0.0, color=VOID_COLOUR, linewidth=0,
        transform=ax.get_xaxis_transform(), zorder=0,
    )  # fmt: skip
    ax.set_title(label[:1].upper() + label[1:])
    ax.margins(x=0.01, y=0.1)
