"""Motion of the bit and its force on the rock (figure 7 of the paper)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM, MS
from percussion_model.interface.plotting.window import Window
from percussion_model.physics.records import Mode
from percussion_model.simulation.uncertain import in_digits

# Fraction of the whole stretch below which a zoom is worth its panel.
WORTH_A_ZOOM = 0.8


def draw_motion(window: Window) -> Figure:
    """Draw mean bit motion and bit force against time and against each other."""
    fig = Figure(figsize=(10.0, 9.0), layout="constrained")
    axes = fig.subplots(3, 2)
    zoom = window.active_until
    has_zoom = zoom < WORTH_A_ZOOM * window.length
    position = window.since_start("bit_position") * MM
    force = window.samples["bit_force"] / KN
    whole = "One blow" if window.is_blow else "After first contact"
    for column, (end, name) in enumerate(
        ((window.length, whole), (zoom, f"First {in_digits(zoom * MS, 2)} ms"))
    ):
        ends = (min(0.0, window.time[0]) if column else 0.0, end)
        for ax, values, y, title in (
            (axes[0, column], position, "mean bit displacement [mm]", "mean bit motion"),
            (axes[1, column], force, "bit force [kN]", "force on the rock"),
        ):
            _over_time(ax, window, ends, values, y, f"{name}: {title}")
    if has_zoom:
        _settled_force(axes[1, 0], window)
    _phase_portrait(axes[2, 0], window)
    ax = axes[2, 1]
    force_over(ax, window, window.since_start("bit_end_position"))
    place = "displacement of the bit's rock end [mm]"
    style.label(ax, place, "bit force [kN]", "Force against penetration")
    handles: list[object] = list(style.mode_handles(window.samples["drilling_mode"]))
    if window.contacts:
        handles.append(style.contact_handle())
    style.head(fig, f"Bit motion and force on the rock — {window.name}", handles)
    return fig


def _over_time(
    ax: Axes, window: Window, ends: tuple[float, float], values: np.ndarray, y: str, title: str
) -> None:
    shown = window.time <= ends[1]
    style.shade_contacts(ax, [c for c in window.contacts if c[0] < ends[1]], MS)
    mode = window.samples["drilling_mode"]
    style.draw_by_mode(ax, window.time[shown] * MS, values[shown], mode[shown])
    style.label(ax, "time [ms]", y, title)
    ax.set_xlim(ends[0] * MS, ends[1] * MS)


def _settled_force(ax: Axes, window: Window) -> None:
    """Say at what force the bit comes to rest: too small to be read off the axis."""
    force = float(window.samples["bit_force"][-1])
    ax.annotate(
        f"at the end {in_digits(force / KN)} kN",
        (window.length * MS, force / KN),
        (0.97, 0.25),
        textcoords="axes fraction",
        ha="right",
        arrowprops={"arrowstyle": "-", "color": style.RULE_COLOUR, "linewidth": 0.8},
    )


def _phase_portrait(ax: Axes, window: Window) -> None:
    inside = window.time >= 0.0
    x = window.since_start("bit_position")[inside] * MM
    v = window.samples["bit_velocity"][inside]
    style.draw_by_mode(ax, x, v, window.samples["drilling_mode"][inside])
    ax.plot(x[:1], v[:1], "o", color="black", markersize=4, zorder=5)
    # Beside the point, on the side where the curve has more room.
    left = x[0] > 0.5 * (x.min() + x.max())
    ax.annotate(
        "start",
        (x[0], v[0]),
        (-7, -3) if left else (6, -11),
        textcoords="offset points",
        ha="right" if left else "left",
    )
    style.label(
        ax,
        "mean bit displacement [mm]",
        "mean bit velocity [m/s]",
        "Phase portrait of the mean bit motion",
    )


def force_over(ax: Axes, window: Window, x: np.ndarray) -> None:
    """Draw the force over a length [m], in the range where there is one."""
    inside = window.time >= 0.0
    x, mode = x[inside] * MM, window.samples["drilling_mode"][inside]
    style.draw_by_mode(ax, x, window.samples["bit_force"][inside] / KN, mode)
    touching = x[mode != Mode.FF]
    if len(touching) and np.ptp(touching) > 0:
        room = 0.05 * np.ptp(touching)  # free flight has no force: it may leave the picture
        ax.set_xlim(touching.min() - room, touching.max() + room)
