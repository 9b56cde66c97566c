"""Waves of stress through piston and bit after an impact."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM, MPA, US
from percussion_model.interface.plotting.window import StressField, Window


def draw_stress(window: Window, fields: dict[str, StressField]) -> Figure:
    """Draw stress over time and depth, with the forces at the ends below.

    Parameters
    ----------
    window : Window
    fields : dict of StressField
        By bar, top to bottom, as from `stress_fields`.
    """
    fig = Figure(figsize=(10.0, 7.2), layout="constrained")
    map_ax, force_ax = fig.subplots(2, 1, sharex=True, height_ratios=(2.6, 1.0))
    limit = max(float(np.abs(field.stress).max(initial=0.0)) for field in fields.values()) or 1.0
    top = 0.0
    boundaries = [0.0]
    for name, field in fields.items():
        mesh = map_ax.pcolormesh(
            field.time_edges * US,
            (top + field.depth_edges) * MM,
            field.stress / MPA,
            cmap="RdBu_r",
            vmin=-limit / MPA,
            vmax=limit / MPA,
            rasterized=True,
        )
        bottom = top + float(field.depth_edges[-1])
        _beside(map_ax, 0.5 * (top + bottom), name, rotation=270)
        top = bottom
        boundaries.append(bottom)
    _beside(map_ax, top, "rock")
    end = float(next(iter(fields.values())).time_edges[-1])
    if len(fields) == 2:
        _mark_contacts(map_ax, window, boundaries[1], end)
    map_ax.set_ylim(top * MM, 0.0)
    map_ax.set_xlim(0.0, end * US)
    map_ax.grid(False)
    style.label(map_ax, "", "depth below the top [mm]")
    bar = fig.colorbar(mesh, ax=map_ax, pad=0.05, aspect=30)
    bar.set_label("axial stress [MPa]\ncompression positive (red), tension negative (blue)")
    bar.outline.set_visible(False)
    _end_forces(force_ax, window, end, has_contact=len(fields) == 2)
    where = " and ".join(f"the {name}" for name in fields)
    style.head(fig, f"Stress waves in {where} — {window.name}")
    return fig


def _beside(ax: Axes, depth: float, text: str, rotation: float = 0.0) -> None:
    """Write a text right of the axes, at a depth [m]."""
    place = ax.get_yaxis_transform()
    ax.text(1.01, depth * MM, text, transform=place, va="center", rotation=rotation)


def _mark_contacts(ax: Axes, window: Window, depth: float, end: float) -> None:
    """Draw the border of piston and bit, thick where they touch."""
    ax.axhline(depth * MM, color="black", linewidth=0.8, linestyle=(0, (1, 2)))
    closed: dict[str, Any] = {"color": "black", "linewidth": 2.6}
    for start, stop in window.contacts:
        if start < end:
            times = [start * US, min(stop, end) * US]
            ax.plot(times, [depth * MM] * 2, solid_capstyle="butt", **closed)
    ax.plot([], [], label="piston on bit", **closed)
    ax.plot([], [], color="black", linewidth=0.8, linestyle=(0, (1, 2)), label="gap open")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)


def _end_forces(ax: Axes, window: Window, end: float, has_contact: bool) -> None:
    """Draw what the ends of the bit feel, on the same time axis."""
    shown = (window.time >= 0) & (window.time <= end)
    time = window.time[shown] * US
    if has_contact:
        force = window.samples["contact_force"][shown] / KN
        ax.plot(time, force, "--", color=style.PISTON_COLOUR, label="piston on bit")
    ax.plot(
        time, window.samples["bit_force"][shown] / KN, color=style.BIT_COLOUR, label="bit on rock"
    )
    style.room_above(ax, 0.3)
    ax.legend(loc="upper right", ncols=2)
    style.label(ax, "time [µs]", "force [kN]")
