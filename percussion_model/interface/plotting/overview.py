"""Figure of a whole run, blow by blow."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM
from percussion_model.simulation.result import Result
from percussion_model.simulation.uncertain import rate_text, shown_error

# Blows beyond this number are drawn as lines without markers.
MOST_MARKERS = 150
# Seen on the line of the hole.
BIT_POSITION_COLOUR = "#111111"
# An axis never zooms in on less than this share of its values: settled is flat.
LEAST_SPAN = 0.02
# Nearer to the mean blows count as alike: a relative deviation.
LEAST_DEVIATION = 1e-9


def draw_overview(result: Result) -> Figure:
    """Draw depth, rate, velocities, period, contacts and forces over the blows."""
    fig = Figure(figsize=(10.0, 8.2), layout="constrained")
    axes = fig.subplots(3, 2, sharex=True)
    blows = result.blows
    time = blows["time"]
    _depths(axes[0, 0], blows)
    rate = blows["hole_advance"] / blows["period"]
    _series(axes[0, 1], time, rate * MM, "rate [mm/s]", "Rate of penetration of each blow")
    _mean(axes[0, 1], result)
    _energies(axes[1, 0], blows)
    _deviations(axes[1, 1], result)
    _counts(axes[2, 0], blows)
    _forces(axes[2, 1], blows)
    for ax in axes.flat:
        ax.axvspan(0.0, result.settle, color="#F0F0F0", linewidth=0, zorder=0)
        ax.set_xlim(0.0, result.duration)
    for ax in axes[:2].flat:
        ax.set_xlabel("")
    title = result.scene.title or "Percussive drilling"
    style.head(fig, f"{title} — {len(blows)} blows in {result.duration:g} s")
    if result.settle > 0:
        fig.text(0.99, 0.99, "grey: settling, not averaged", ha="right", va="top", fontsize=8.5)
    return fig


def _depths(ax: Axes, blows: np.ndarray) -> None:
    """Draw how deep the hole is, and where the bit is, which may leap."""
    ax.plot(blows["time"], blows["hole_depth"] * MM, color=style.BIT_COLOUR, label="hole",
            **_marks(len(blows)) | {"linewidth": 2.8})  # fmt: skip
    # thinner and above: where both are the same, both are seen
    ax.plot(blows["time"], blows["bit_position"] * MM, color=BIT_POSITION_COLOUR, linewidth=0.8,
            label="mean bit position")  # fmt: skip
    ax.legend(loc="best")
    style.label(ax, "time [s]", "depth gained [mm]", "Depth at each blow")


def _mean(ax: Axes, result: Result) -> None:
    """Draw the mean rate with a band of its error; a word alone where that hides it."""
    summary = result.summary()
    mean, error = summary["rate_of_penetration"], shown_error(summary, "rate_of_penetration")
    if mean is None:
        return
    text, hidden = rate_text(summary), result.rate_of_penetration_undecided
    words = f"mean {text} mm/s" if hidden else f"settled mean {text} mm/s"
    if hidden:
        ax.plot([], [], linestyle="", label=words)
    else:
        ax.axhline(mean * MM, color=style.MEAN_COLOUR, lw=1.0, ls="--", label=words)
        if error:
            ends = (mean - error) * MM, (mean + error) * MM
            ax.axhspan(*ends, color=style.MEAN_COLOUR, alpha=0.2, linewidth=0)
    ax.legend(loc="best")


def _marks(count: int, marker: str = "o", size: float = 2.6) -> dict[str, Any]:
    shown = {"marker": marker, "markersize": size} if count <= MOST_MARKERS else {}
    return {"linewidth": 0.9, **shown}


def _series(ax: Axes, time: np.ndarray, values: np.ndarray, unit: str, title: str) -> None:
    ax.plot(time, values, color=style.BIT_COLOUR, **_marks(len(time)))
    _keep_flat(ax, values)
    style.label(ax, "time [s]", unit, title)


def _keep_flat(ax: Axes, values: np.ndarray) -> None:
    """Do not blow up the rounding of a settled series into a mountain range."""
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return
    low, high = float(finite.min()), float(finite.max())
    least = LEAST_SPAN * max(abs(low), abs(high))
    room = max(0.08 * (high - low), 0.5 * (least - (high - low)))
    if room > 0:
        ax.set_ylim(low - room, high + room)
    ax.ticklabel_format(axis="y", useOffset=False)


def _energies(ax: Axes, blows: np.ndarray) -> None:
    """Draw what the piston brings, and what of it goes into the rock."""
    for field, colour, dashes, name in (
        ("blow_energy", style.PISTON_COLOUR, "--", "of the piston"),
        ("rock_energy", style.BIT_COLOUR, "-", "into the rock"),
    ):
        ax.plot(blows["time"], blows[field], dashes, color=colour, label=name)
    high = float(np.nanmax(blows[["blow_energy", "rock_energy"]].tolist()))
    ax.set_ylim(0.0, 1.3 * high or 1.0)
    ax.legend(loc="upper right", ncols=2)
    style.label(ax, "time [s]", "energy [J]", "Energy of each blow")


def _deviations(ax: Axes, result: Result) -> None:
    """Draw how far each blow is from the mean of those that count: how motion settles."""
    blows, counted = result.blows, result.counted
    for field, name in (
        ("impact_velocity", "impact velocity"), ("period", "period"), ("hole_advance", "advance"),
    ):  # fmt: skip
        mean = float(np.mean(counted[field])) if len(counted) else 0.0
        if mean:
            off = np.maximum(np.abs(blows[field] / mean - 1.0), LEAST_DEVIATION)
            ax.semilogy(blows["time"], 100.0 * off, label=name, **_marks(len(blows), size=1.8))
    ax.legend(loc="upper right", ncols=3)
    ax.set_ylim(top=20.0 * ax.get_ylim()[1])
    style.label(ax, "time [s]", "deviation [%]", "How far blows are from their mean")


def _counts(ax: Axes, blows: np.ndarray) -> None:
    for field, colour, marker, name in (
        ("drilling_cycles", style.BIT_COLOUR, "s", "drilling cycles"),
        ("contacts", style.PISTON_COLOUR, "o", "piston/bit contacts"),
    ):
        marks = _marks(len(blows), marker, 2.0)
        ax.plot(blows["time"], blows[field], color=colour, label=name, **marks)
    high = max(int(blows[f].max()) for f in ("drilling_cycles", "contacts"))
    ax.set_ylim(-0.2, 1.35 * high + 0.5)
    ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    ax.legend(loc="upper right", ncols=2)
    style.label(ax, "time [s]", "number per blow [–]", "Contacts and drilling cycles")


def _forces(ax: Axes, blows: np.ndarray) -> None:
    peaks = [("peak_bit_force", style.BIT_COLOUR, "-", "bit on rock")]
    if np.any(np.nan_to_num(blows["peak_contact_force"]) > 0):
        peaks.append(("peak_contact_force", style.PISTON_COLOUR, "--", "piston on bit"))
    for field, colour, dashes, name in peaks:
        ax.plot(blows["time"], blows[field] / KN, dashes, color=colour, label=name)
    high = max(float(np.nanmax(blows[field])) for field, *_ in peaks) / KN
    ax.set_ylim(0.0, 1.3 * high or 1.0)
    ax.legend(loc="upper right", ncols=2)
    style.label(ax, "time [s]", "peak force [kN]", "Greatest forces of each blow")
