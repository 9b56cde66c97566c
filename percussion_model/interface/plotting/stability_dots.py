"""Figure of the stability of the solvers: a dot for every case, a panel for each measure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

from percussion_model.interface.plotting import style
from percussion_model.verification.hard_cases import SOLVERS, Collection
from percussion_model.verification.hard_cases.collection import MOST_MOMENTUM, MOST_RESIDUAL


class Panel(NamedTuple):
    """A measure: its title, key of a row, axis, foot, and limit or key of the limit of each row.

    What lies below the foot of the axis is drawn there.
    """

    title: str
    key: str
    axis: str
    foot: float
    limit: float | str | None


PANELS = (
    Panel("Energy that the ledger misses", "residual", "share of the energy [–]", 1e-17,
          MOST_RESIDUAL),
    Panel("Momentum less impulses", "momentum", "share of the greatest impulse [–]", 1e-17,
          MOST_MOMENTUM),
    Panel("Numerical dissipation", "numerical", "share of the energy [–]", 1e-7, None),
    Panel("Events", "events_per_second", "events in a simulated second [1/s]", 1.0, "ceiling"),
)  # fmt: skip
COLOURS = {
    "wave": "#0072B2",
    "modal": "#E69F00",
    "fem": "#009E73",
    "rigid": "#595959",
}
LIMIT_COLOUR = "#D55E00"
# The dots of a solver fill so much of its column, in the order of their size.
SPREAD = 0.4


def draw_stability(found: Collection) -> Figure:
    """Draw every case of every solver, sorted, against what is allowed; the greatest is named."""
    cases = list(dict.fromkeys(row["case"] for row in found.rows))
    solvers = [name for name in SOLVERS if any(row["solver"] == name for row in found.rows)]
    fig = Figure(figsize=(12.5, 8.0), layout="constrained")
    for ax, panel in zip(fig.subplots(2, 2).flat, PANELS, strict=True):
        _panel(ax, found, panel, solvers)
    handles = [
        Line2D([], [], color=style.RULE_COLOUR, marker="o", markersize=4.0, linestyle="",
               label="one case, in the order of size"),
        Line2D([], [], color=LIMIT_COLOUR, linestyle="--", label="what is allowed"),
        Line2D([], [], color=LIMIT_COLOUR, marker="_", linestyle="",
               label="what is allowed of that case"),
    ]  # fmt: skip
    count = f"{len(cases)} hard cases" if len(cases) != 1 else "1 hard case"
    style.head(fig, f"{count} by {', '.join(solvers)}: lower is better", handles)
    return fig


def _panel(ax: Axes, found: Collection, panel: Panel, solvers: list[str]) -> None:
    highest = panel.foot
    ax.set_yscale("log")
    names = []
    for k, solver in enumerate(solvers):
        rows = [row for row in found.rows if row["solver"] == solver]
        rows = sorted(
            (r for r in rows if r[panel.key] is not None), key=lambda r: abs(r[panel.key])
        )
        names.append(f"{solver}, {len(rows)} cases\n")
        if not rows:
            continue
        y = np.array([max(abs(row[panel.key]), panel.foot) for row in rows])
        x = k + SPREAD * np.linspace(-1.0, 1.0, len(rows) + 2)[1:-1]
        ax.plot(x, y, "o", color=COLOURS[solver], markersize=3.5, zorder=3)
        if isinstance(panel.limit, str):
            ceilings = [row[panel.limit] for row in rows]
            ax.plot(x, ceilings, "_", color=LIMIT_COLOUR, markersize=4.0, zorder=2)
            highest = max(highest, *ceilings)
        highest = max(highest, float(y[-1]))
        names[k] += f"most in\n{rows[-1]['case']}" if y[-1] > panel.foot else "all at the foot"
    if isinstance(panel.limit, float):
        ax.axhline(panel.limit, color=LIMIT_COLOUR, linestyle="--", linewidth=1.1)
        highest = max(highest, panel.limit)
    ax.set_ylim(0.3 * panel.foot, 20.0 * highest)
    ax.set_xlim(-0.6, len(solvers) - 0.4)
    ax.yaxis.set_major_locator(LogLocator(10.0, numticks=8))
    ax.yaxis.set_minor_locator(NullLocator())
    ax.set_xticks(range(len(solvers)), names, fontsize=6.8)
    ax.tick_params(axis="x", length=0)
    ax.grid(visible=False, axis="x")
    style.label(ax, "", panel.axis, panel.title)
    if panel.foot < 1e-3:
        words = f"at the foot: below {panel.foot:.0e}".replace("e-0", "e-")
        ax.text(0.99, 0.015, words, transform=ax.transAxes, ha="right", fontsize=7.5,
                color=style.RULE_COLOUR)  # fmt: skip
