"""Page of a controller's standard runs, with a figure for each."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from percussion_model.coupling.bench import (
    FEED,
    HIGHEST_FEED,
    HIGHEST_TORQUE,
    MOST_ERROR,
    MOST_VIOLATION,
    SETTLING,
    Score,
)
from percussion_model.interface.bench_text import (
    COLUMNS,
    TEXTS,
    about_errors,
    cells,
    mean_text,
    points_text,
)
from percussion_model.interface.plotting import style
from percussion_model.simulation.files import staged

STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:75em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;font-size:14px}td,th{padding:.25em .7em;text-align:right;"
    "border-bottom:1px solid #ddd;vertical-align:bottom}"
    "td:first-child,th:first-child,td:nth-child(2),th:nth-child(2){text-align:left}"
    ".bad{color:#b00;font-weight:bold}.good{color:#070}img{max-width:100%}dt{font-weight:bold}"
    "dl{display:grid;grid-template-columns:max-content auto;gap:.1em 1em}dd{margin:0}"
)
PAGE = "index.html"
VOID_COLOUR, LIMIT_COLOUR = "#dddddd", "#bb0000"


def write_bench_page(scores: Sequence[Score], folder: Path, title: str) -> Path:
    """Write a figure for each run and one page with all, everything or nothing; return the page."""
    failed = [score.trial for score in scores if score.faults]
    verdict = (
        f'<span class="bad">{len(failed)} of {len(scores)} runs failed: {", ".join(failed)}</span>'
        if failed
        else f'<span class="good">none of {len(scores)} runs failed</span>'
    )
    parts = [
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}'
        f"</title><style>{STYLE}</style></head><body><h1>Controller bench: {escape(title)}</h1>"
        f"<p><b>{mean_text(scores)} of 100 points, the mean of the runs; {verdict}.</b></p>",
        _rules(),
        _table(scores),
        f"<p>{escape(about_errors(scores))}</p>",
        "<dl>" + "".join(f"<dt>{escape(head)}</dt><dd>{escape(text)}</dd>"
                         for _, head, _, text in COLUMNS) + "</dl>",
    ]  # fmt: skip
    with staged(folder) as draft:
        for score in scores:
            parts += _section(score, _figure(score, draft / f"{score.trial}.png"))
        page = "\n".join(parts) + "\n</body></html>\n"
        (draft / PAGE).write_text(page, encoding="utf-8")
    return folder / PAGE


def _section(score: Score, figure: Path) -> list[str]:
    picture = b64encode(figure.read_bytes()).decode()
    return [
        f'<h2 id="{score.trial}">{score.trial}: {escape(TEXTS.get(score.trial, ""))}</h2>',
        *(f'<p class="bad">{escape(fault)}</p>' for fault in score.faults),
        *([f'<p class="bad">{escape(score.doubt)}</p>'] if score.doubt else []),
        f'<img alt="feed, rig force, depth and torque over time in the run {score.trial}" '
        f'src="data:image/png;base64,{picture}">',
    ]


def _rules() -> str:
    return (
        "<p>Each run drills with the same rig, string and hammer; the controller has to keep a "
        f"feed of {1e-3 * FEED:g} kN whatever happens. A run is worth 100 points, less the mean "
        f"distance of the feed from that in per cent (after the first {SETTLING:g} s, and not in "
        "a void), times the share of its time within the limits: "
        f"{1e-3 * HIGHEST_FEED:g} kN of feed and {HIGHEST_TORQUE:g} N m of torque. It fails, and "
        "the row is red, where it ends early, is beyond the limits for more than "
        f"{100 * MOST_VIOLATION:g} % of its time, or the feed is "
        f"off by more than {100 * MOST_ERROR:g} %. A run that fails has no points.</p>"
    )


def _table(scores: Sequence[Score]) -> str:
    head = "".join(
        f'<th title="{escape(text)}">{escape(head)}</th>' for _, head, _, text in COLUMNS
    )
    rows = [f"<table><tr><th>run</th><th>what happens</th><th>points</th>{head}</tr>"]
    for score in scores:
        numbers = "".join(f"<td>{text}</td>" for text in cells(score))
        points = points_text(score.points, score.points_error)
        kind = ' class="bad"' if score.faults else ""
        rows.append(
            f'<tr{kind}><td><a href="#{score.trial}">{score.trial}</a></td>'
            f"<td>{escape(TEXTS.get(score.trial, ''))}</td><td>{points}</td>{numbers}</tr>"
        )
    return "".join([*rows, "</table>"])


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
