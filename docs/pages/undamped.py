"""Rate of penetration against structural loss; takes some minutes."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from typing import Any

from matplotlib.figure import Figure

from docs.blocks import Made
from percussion_model import Scene, simulate
from percussion_model.interface.plotting import style
from percussion_model.simulation.markdown import table
from percussion_model.simulation.warnings import least_loss_time

CELLS = (20, 40, 80)
COLOURS = ("#56B4E9", "#0072B2", "#222222")
# Loss times [s]; between the limits the motion is aperiodic and needs many blows; below,
# resolutions differ so much that few tell, and blows of hundreds of cycles are dear.
FEW_TELL, APERIODIC = 5e-10, 1.6e-8
LOSSES = (
    *(0.0, 1e-10, 1e-9, 2e-9, 4e-9, 7e-9, 1e-8, 1.5e-8, 2e-8, 2.5e-8, 3e-8, 4e-8),
    *(5e-8, 7e-8, 1e-7, 1.4e-7, 1.9366112636768248e-07, 3e-7, 5e-7, 7e-7, 1e-6),
)
SETTLE = 1.0
LONG, SHORT, SHORTEST = 41.0, 5.0, 4.0  # [s]
# Rates of two resolutions that differ by more count as different, if not by chance.
SAME = 0.01
# The loss axis is linear up to here [s].
LINEAR = 1e-10


def rates() -> Iterator[dict[str, Any]]:
    """Run the reference with every loss time and number of cells."""
    for loss in LOSSES:
        for cells in CELLS:
            scene = Scene().computed_by("wave", **{"loss.time": loss, "solver.cells": cells})
            duration = LONG if loss < APERIODIC else SHORT
            if loss < FEW_TELL:
                duration = SHORTEST
            result = simulate(scene, duration, settle=SETTLE, record_events=False)
            summary = result.summary()
            yield {
                "loss": loss,
                "cells": cells,
                "rate": summary["rate_of_penetration"],
                "error": summary["rate_of_penetration_standard_error"],
                "cycles": summary["drilling_cycles_per_blow"],
                "warned": any("structural loss" in text for text in result.warnings),
                "least": least_loss_time(result),
            }


def spread(rows: list[dict[str, Any]]) -> tuple[float, float]:
    """Greatest difference of the resolutions by the finest, and its standard error."""
    finest = rows[-1]
    others = [row for row in rows[:-1] if not math.isnan(row["rate"])]
    if math.isnan(finest["rate"]) or not others:
        return math.nan, math.nan
    far = max(others, key=lambda row: abs(row["rate"] - finest["rate"]))
    error = (far["error"] ** 2 + finest["error"] ** 2) ** 0.5
    return abs(far["rate"] - finest["rate"]) / finest["rate"], error / finest["rate"]


def by_loss(rows: list[dict[str, Any]]) -> dict[float, list[dict[str, Any]]]:
    """Rows of each loss time, coarse to fine."""
    return {loss: [row for row in rows if row["loss"] == loss] for loss in LOSSES}


def draw(rows: list[dict[str, Any]]) -> Figure:
    """Rate against loss time, and how far the resolutions differ."""
    fig = Figure(figsize=(8.6, 6.6), layout="constrained")
    above, below = fig.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    for cells, colour in zip(CELLS, COLOURS, strict=True):
        mine = [row for row in rows if row["cells"] == cells]
        above.errorbar(
            [row["loss"] for row in mine],
            [1e3 * row["rate"] for row in mine],
            [2e3 * row["error"] for row in mine],
            color=colour, marker="o", markersize=3.5, capsize=2, label=f"{cells} cells",
        )  # fmt: skip
    found = by_loss(rows)
    spreads = [spread(found[loss]) for loss in LOSSES]
    below.errorbar(
        LOSSES, [1e2 * off for off, _ in spreads], [2e2 * error for _, error in spreads],
        color=COLOURS[1], marker="o", markersize=3.5, capsize=2,
    )  # fmt: skip
    below.axhline(1e2 * SAME, color=style.RULE_COLOUR, linestyle="--", linewidth=1)
    limit = max(row["least"] for row in rows if row["warned"])
    reference = Scene().loss.time
    for ax in (above, below):
        ax.axvspan(-LINEAR, limit, color=style.SHADE_COLOUR, linewidth=0, zorder=0)
        ax.axvline(reference, color=style.MEAN_COLOUR, linewidth=1.2)
        ax.set_xscale("symlog", linthresh=LINEAR, linscale=0.5)
        ax.set_xlim(-0.1 * LINEAR, 1.2 * LOSSES[-1])
    above.set_yscale("log")
    above.set_yticks([15, 20, 30, 50, 100], ["15", "20", "30", "50", "100"])
    above.minorticks_off()
    above.annotate("reference", (reference, 60.0), (5, 0), textcoords="offset points")
    above.annotate("warned of", (2e-10, 15.2), fontstyle="italic")
    above.legend(loc="upper right")
    style.label(above, "", "rate of penetration [mm/s]")
    finest = f"greatest difference\nto {CELLS[-1]} cells [%]"
    style.label(below, "structural loss, Kelvin–Voigt time $\\eta$ [s]", finest)
    style.head(fig, "Without enough loss the answer is another one, and depends on the cells")
    return fig


def block(rows: list[dict[str, Any]]) -> str:
    """The page's table."""
    head = ["loss time, s", *(f"{cells} cells" for cells in CELLS), "differ by", "cycles", "warns"]
    lines = []
    for loss, mine in by_loss(rows).items():
        off, error = spread(mine)
        cells = [f"{loss:.4g}", *(_rate(row) for row in mine)]
        apart = "–" if math.isnan(off) else f"{100 * off:.1f} ± {100 * error:.1f} %"
        cells += [apart, f"{mine[-1]['cycles']:.0f}"]
        cells.append("yes" if all(row["warned"] for row in mine) else "no")
        lines.append(cells)
    return table(head, lines)


def _rate(row: dict[str, Any]) -> str:
    if math.isnan(row["rate"]):
        return "not settled"
    rate, error = 1e3 * row["rate"], 1e3 * row["error"]
    return f"{rate:.2f} ± {error:.2f}" if error > 5e-3 else f"{rate:.3f}"


def made() -> Made:
    """The figure and the table."""
    rows = []
    for row in rates():
        print({name: row[name] for name in ("loss", "cells", "rate", "error")}, file=sys.stderr)
        # what has not settled within the duration has no rate
        rows.append({name: math.nan if value is None else value for name, value in row.items()})
    return Made(
        ("data/undamped.md",), {"rates": block(rows)}, dpi=110,
        figures=lambda: [("undamped", draw(rows))],
    )  # fmt: skip
