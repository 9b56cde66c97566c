"""Figures and page of a controller's standard runs."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape
from pathlib import Path

import matplotlib.pyplot as plt

from percussion_model.coupling.bench import FEED, Score
from percussion_model.result_files import staged_text

STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:75em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse}td,th{padding:.2em .8em;text-align:right;"
    "border-bottom:1px solid #ddd}td:first-child,th:first-child{text-align:left}"
    ".bad{color:#b00}img{max-width:100%}"
)


def save_bench(
    scores: Sequence[Score],
    points: float,
    columns: Sequence[tuple[str, str, float]],
    folder: Path,
    title: str,
) -> Path:
    """Write a figure for each run and one page with all; return the page.

    Parameters
    ----------
    columns : sequence of tuple
        Name of a number, head of its column, factor.
    """
    folder.mkdir(parents=True, exist_ok=True)
    head = "".join(f"<th>{escape(text)}</th>" for _, text, _ in columns)
    parts = [
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}'
        f"</title><style>{STYLE}</style></head><body><h1>{escape(title)}</h1>"
        f"<p>{points:.1f} of 100 points</p><table><tr><th>run</th><th>points</th>{head}</tr>"
    ]
    for score in scores:
        cells = "".join(f"<td>{factor * score.numbers[n]:.4g}</td>" for n, _, factor in columns)
        parts.append(f"<tr><td>{score.trial}</td><td>{score.points:.1f}</td>{cells}</tr>")
    parts.append("</table>")
    for score in scores:
        picture = _figure(score, folder / f"{score.trial}.png").read_bytes()
        parts.append(f"<h2>{score.trial}</h2>")
        if score.error:
            parts.append(f'<p class="bad">ended early, {escape(score.error)}</p>')
        parts.append(f'<img src="data:image/png;base64,{b64encode(picture).decode()}">')
    page = folder / "index.html"
    staged_text(page, "\n".join(parts) + "\n</body></html>\n")
    return page


def _figure(score: Score, path: Path) -> Path:
    run = score.run
    panels = (
        ("feed [kN]", 1e-3, "string.feed_force_mean"),
        ("rig [kN]", 1e-3, "controller.force_command"),
        ("bit [mm]", 1e3, "hammer.bit.position"),
        ("torque [N m]", 1.0, "rock.rotation_torque"),
    )
    figure, axes = plt.subplots(2, 2, sharex=True, figsize=(9.0, 4.5))
    for ax, (label, factor, name) in zip(axes.flat, panels, strict=True):
        ax.plot(run["time"], factor * run[name], linewidth=1.1)
        ax.set_ylabel(label)
        ax.grid(alpha=0.3)
    axes[0, 0].axhline(1e-3 * FEED, color="k", linewidth=0.7, linestyle="--")
    axes[1, 0].set_xlabel("time [s]")
    axes[1, 1].set_xlabel("time [s]")
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return path
