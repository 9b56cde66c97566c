"""Figures of the rock law: force over position and penetration (4, 7), sinking without barrier."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.motion import force_over
from percussion_model.interface.plotting.style import KN, MM, MS
from percussion_model.interface.plotting.window import ROOM_AFTER, Window
from percussion_model.physics.records import Mode
from percussion_model.simulation.uncertain import ABOUT
from percussion_model.verification.paper.rock_law import (
    BARRIER,
    FINER,
    LOSSLESS,
    LOSSY,
    OF_THE_CELLS,
    RIGID,
    RIGID_BARRIER,
    Sinking,
)

# Jumps of the datum that are small beside the greatest get no number.
WORTH_A_NUMBER = 0.02
# Axis by the deepest bit: the legend hides no line.
ROOM_OF_LEGEND = 1.5
# The rock bears a load from this share of the peak force on.
LOADED = 0.1
LINES = {
    RIGID: ("#009E73", "-"),
    RIGID_BARRIER: ("#009E73", (0, (4, 1.5))),
    LOSSLESS: ("#0072B2", "-"),
    LOSSLESS + FINER: ("#0072B2", (0, (1.2, 1.2))),
    LOSSY: ("#D55E00", "-"),
    BARRIER: ("#D55E00", (0, (4, 1.5))),
}


def draw_force(window: Window) -> Figure:
    """Draw the force of a blow over both displacements, the penetration, and the datum's jumps."""
    fig = Figure(figsize=(10.5, 7.8), layout="constrained")
    axes = fig.subplots(2, 2)
    mean, end = (window.since_start(name) for name in ("bit_position", "bit_end_position"))
    law = window.samples["penetration"]
    for ax, x, name, title in (
        (axes[0, 0], mean, "mean bit displacement [mm]", "(7) Over the mean: it fluctuates"),
        (
            axes[0, 1],
            end,
            "displacement of the bit's end [mm]",
            "(4a, 7) Over the bit's end: two slopes",
        ),
        (
            axes[1, 0],
            law,
            "penetration while drilling $p$ [mm]",
            "(4b) Over penetration: one line of loading",
        ),
    ):
        force_over(ax, window, x)
        style.label(ax, name, "bit force [kN]", title)
    _say_jump(axes[1, 0], window, end - law)
    _datum(axes[1, 1], window, end - law)
    title = f"Force of the rock through a blow (figures 4 and 7) — {window.name}"
    style.head(fig, title, style.mode_handles(window.samples["drilling_mode"]))
    return fig


def _say_jump(ax: Axes, window: Window, datum: np.ndarray) -> None:
    """Say where x_R jumps under force: the force stays, the penetration does not."""
    force, law = window.samples["bit_force"], window.samples["penetration"]
    loaded = force[:-1] > LOADED * np.max(force)
    jumps = np.where(loaded & (window.time[:-1] >= 0.0), np.diff(datum), 0.0)
    k = int(np.argmax(jumps))
    ax.annotate(
        f"$x_R$ jumps by {jumps[k] * MM:.3f} mm",
        (0.5 * (law[k] + law[k + 1]) * MM, force[k] / KN),
        (-12, 14),
        textcoords="offset points",
        ha="right",
        arrowprops={"arrowstyle": "-", "color": style.RULE_COLOUR, "linewidth": 0.8},
    )


def _datum(ax: Axes, window: Window, datum: np.ndarray) -> None:
    """Draw the bit's end and the datum x_R over time, with the datum's greater jumps in numbers."""
    mode = window.samples["drilling_mode"]
    moving = window.time[(mode != Mode.SS) & (window.time >= 0.0)]
    shown = (window.time >= 0.0) & (window.time <= ROOM_AFTER * moving[-1])
    time = window.time[shown] * MS
    position = window.since_start("bit_end_position")
    datum = datum[shown] * MM
    style.draw_by_mode(ax, time, position[shown] * MM, mode[shown])
    ax.plot(time, datum, color="black", linewidth=1.6, drawstyle="steps-post", zorder=5)
    jumps = np.diff(datum)
    for k in np.flatnonzero(jumps > WORTH_A_NUMBER * np.ptp(datum)):
        at = (time[k + 1], datum[k])
        ax.annotate(f"+{jumps[k]:.3f}", at, (4, -2), textcoords="offset points", va="top")
    title = "(4c) The bit's end, and the datum $x_R$ in black"
    style.label(ax, "time [ms]", "displacement [mm]", title)


def draw_sinking(found: Mapping[str, Sinking]) -> Figure:
    """Draw how deep a bit sinks that fell once, with and without an energy barrier."""
    fig = Figure(figsize=(8.0, 4.8), layout="constrained")
    ax = fig.subplots()
    for name, (colour, dashes) in LINES.items():
        one = found[name]
        depth = one.position * MM
        words = f"{depth[-1]:.3g} mm"
        if name in OF_THE_CELLS:
            words = f"{ABOUT} {depth[-1]:.2g} mm, depends on the cells"
        ax.plot(one.time, depth, color=colour, linestyle=dashes, label=f"{name}: {words}")
    deepest = max(float(np.max(found[name].position)) for name in LINES)
    ax.set_ylim(0.0, ROOM_OF_LEGEND * deepest * MM)
    ax.legend(loc="upper left")
    style.label(ax, "time [s]", "mean bit displacement, down [mm]")
    style.head(fig, "Drop test under feed: sinking without an energy barrier (section 2.3)")
    return fig
