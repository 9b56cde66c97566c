"""Waves in a drill string: force by place and time, energy by bar, stress at gauges."""

from __future__ import annotations

from collections.abc import Iterator

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from percussion_model.analysis.drill_string import StringReport, WatchedBlow
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MPA, MS

# What is shown lasts so many times of a wave down to the rock: down, up, and down again.
TRANSITS_SHOWN = 3.0
# The colours end at the force that is exceeded in this share of the cells and steps shown:
# where steel is thickest, in the head of the bit, it is far greater than elsewhere.
EXCEEDED = 5e-3
# Names beside the string that would come closer than this share of its length move apart.
APART = 0.032
# Two times that are closer than this share of what is shown are written on either side.
CLOSE = 0.1
# So many shades, an odd number: what is weaker than half of one is white, and files are small.
MAP, SHADES = "RdBu_r", 25
PRESSED, PULLED = "#B2182B", "#2166AC"  # as the map has them
BAR_SHADES = (0.30, 0.85)  # of matplotlib's Blues, for the first and the last rod


def draw_string(report: StringReport) -> Iterator[tuple[str, Figure]]:
    """Draw all figures of a report; that of gauges where it has some.

    Yields
    ------
    str, Figure
        Its name, and the figure.
    """
    yield "string_waves", draw_waves(report)
    yield "string_energy", draw_energy(report)
    if report.gauges:
        yield "string_gauges", draw_gauges(report)


def bar_title(name: str) -> str:
    """What a bar is called in figures."""
    return "rod 1, the shank" if name == "rod 1" else name


def _offsets(watched: WatchedBlow) -> dict[str, float]:
    """Where each bar begins, from the struck end down [m]; the piston lies above it."""
    lengths = {name: float(edges[-1]) for name, edges in watched.edges.items()}
    place = -lengths.get("piston", 0.0)
    found = {}
    for name, length in lengths.items():
        found[name] = place
        place += length
    return found


def _bottom(watched: WatchedBlow) -> float:
    """Length of the string from the struck end down [m]."""
    return sum(float(edges[-1]) for name, edges in watched.edges.items() if name != "piston")


def _until(report: StringReport) -> int:
    """How many steps are shown."""
    shown = TRANSITS_SHOWN * report.transit_time
    return int(np.searchsorted(report.watched.time, shown, side="right"))


# force by place and time


def draw_waves(report: StringReport) -> Figure:
    """Draw the force in the whole string over time and place, with the forces at its ends."""
    watched, count = report.watched, _until(report)
    time = watched.time[:count]
    step = float(time[1] - time[0])
    time_edges = np.append(time - 0.5 * step, time[-1] + 0.5 * step) * MS
    fig = Figure(figsize=(10.0, 7.6), layout="constrained")
    ax, below = fig.subplots(2, 1, sharex=True, height_ratios=(3.4, 1.0))
    shown = np.concatenate([np.abs(force[:count]).ravel() for force in watched.force.values()])
    limit = float(np.quantile(shown, 1.0 - EXCEEDED)) or 1.0
    shades, offsets = matplotlib.colormaps[MAP].resampled(SHADES), _offsets(watched)
    for name, force in watched.force.items():
        mesh = ax.pcolormesh(
            time_edges,
            offsets[name] + watched.edges[name],
            force[:count].T / KN,
            cmap=shades,
            vmin=-limit / KN,
            vmax=limit / KN,
            rasterized=True,
        )
    bottom = _bottom(watched)
    _mark_bars(ax, watched, offsets, bottom)
    _mark_contacts(ax, watched, float(time[-1]))
    ax.set_ylim(bottom, min(offsets.values()))
    ax.set_xlim(0.0, float(time[-1]) * MS)
    ax.grid(False)
    style.label(ax, "", "distance below the struck end [m]")
    bar = fig.colorbar(mesh, ax=ax, pad=0.02, aspect=32, extend="both")
    bar.set_label("force in the string [kN]\ncompression positive (red), tension negative (blue)")
    bar.outline.set_visible(False)
    _end_forces(below, watched, count)
    style.head(fig, f"One blow in the string — {report.title}")
    return fig


def _mark_bars(ax: Axes, watched: WatchedBlow, offsets: dict[str, float], bottom: float) -> None:
    """Draw joints as thin lines, and write the name of each bar beside it."""
    place = ax.get_yaxis_transform()
    top = min(offsets.values())
    least, last = APART * (bottom - top), -np.inf
    for name, offset in offsets.items():
        if offset > 0.0:
            ax.axhline(offset, color="black", linewidth=0.5)
        middle = offset + 0.5 * float(watched.edges[name][-1])
        at = max(middle, last + least)
        ax.annotate(
            bar_title(name), (1.0, middle), (1.02, at), xycoords=place, textcoords=place,
            va="center", annotation_clip=False,
            arrowprops={"arrowstyle": "-", "linewidth": 0.5, "shrinkA": 1, "shrinkB": 0},
        )  # fmt: skip
        last = at
    ax.annotate(
        "rock", (1.0, bottom), (1.02, max(bottom, last) + least), xycoords=place,
        textcoords=place, va="center", annotation_clip=False,
    )  # fmt: skip


def _mark_contacts(ax: Axes, watched: WatchedBlow, end: float) -> None:
    """Draw the struck end: thick where the piston is on it, dotted where there is a gap."""
    dotted = (0, (1, 2))
    ax.axhline(0.0, color="black", linewidth=1.0, linestyle=dotted)
    for start, stop in watched.contacts:
        if start < end:
            times = [start * MS, min(stop, end) * MS]
            ax.plot(times, [0.0, 0.0], color="black", linewidth=3.0, solid_capstyle="butt")
    ax.plot([], [], color="black", linewidth=3.0, label="piston on the shank")
    ax.plot([], [], color="black", linewidth=1.0, linestyle=dotted, label="gap between them")
    ax.plot([], [], color="black", linewidth=0.5, label="joint")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.2)


def _end_forces(ax: Axes, watched: WatchedBlow, count: int) -> None:
    """Draw the forces in the first and the last cell of the string, piston apart."""
    time, names = watched.time[:count] * MS, [name for name in watched.force if name != "piston"]
    first, last = watched.force[names[0]][:count, 0], watched.force[names[-1]][:count, -1]
    ax.plot(time, first / KN, "--", color=style.PISTON_COLOUR, label="first cell of the shank")
    ax.plot(time, last / KN, color=style.BIT_COLOUR, label="last cell of the bit")
    ax.axhline(0.0, color=style.RULE_COLOUR, linewidth=0.6)
    style.room_above(ax, 0.3)
    ax.legend(loc="upper right", ncols=2)
    style.label(ax, "time since the impact [ms]", "force [kN]")


# energy and peaks


def draw_energy(report: StringReport) -> Figure:
    """Draw the energy of each bar over time, and the greatest forces along the string."""
    watched, count = report.watched, _until(report)
    fig = Figure(figsize=(10.0, 7.4), layout="constrained")
    above, below = fig.subplots(2, 1, height_ratios=(1.25, 1.0))
    time = watched.time[:count] * MS
    energy = {name: watched.kinetic[name] + watched.elastic[name] for name in watched.kinetic}
    names, colours = [name for name in energy if name != "piston"], _bar_colours(watched)
    stack = [energy[name][:count] for name in names]
    above.stackplot(
        time, stack, colors=[colours[name] for name in names],
        labels=[bar_title(name) for name in names], linewidth=0.4, edgecolor="white",
    )  # fmt: skip
    if "piston" in energy:
        above.plot(
            time, energy["piston"][:count], "--", color=style.PISTON_COLOUR, label="piston alone"
        )
    _mark_time(above, report.transit_time, "front at the rock")
    above.set_xlim(0.0, float(time[-1]))
    above.set_ylim(0.0, 1.12 * max(np.sum(stack, axis=0).max(), above.get_ylim()[1] / 1.05))
    handles, labels = above.get_legend_handles_labels()
    above.legend(  # in the order in which they lie on each other
        handles[::-1], labels[::-1], loc="center left", bbox_to_anchor=(1.0, 0.5)
    )
    style.label(
        above, "time since the impact [ms]", "energy [J]",
        "Energy of motion and strain: bars of the string added up, and the piston by itself",
    )  # fmt: skip
    _peaks(below, watched)
    style.head(fig, f"Energy and peak forces along the string — {report.title}")
    return fig


def _bar_colours(watched: WatchedBlow) -> dict[str, object]:
    """Rods from light to dark, the bit darkest."""
    rods = [name for name in watched.force if name not in ("piston", "bit")]
    blues = matplotlib.colormaps["Blues"]
    shades = np.linspace(*BAR_SHADES, max(len(rods), 2))[: len(rods)]
    found: dict[str, object] = {"bit": "#222222"}
    return found | {name: blues(shade) for name, shade in zip(rods, shades, strict=True)}


def _mark_time(ax: Axes, time: float, text: str, side: int = 1) -> None:
    """Draw a dotted upright line at a time [s], and write right or left (-1) of it what it is."""
    ax.axvline(time * MS, color="black", linewidth=0.9, linestyle=(0, (1, 2)))
    ax.annotate(
        text, (time * MS, 0.97), (4 * side, 0), xycoords=ax.get_xaxis_transform(),
        textcoords="offset points", va="top", ha="left" if side > 0 else "right",
    )  # fmt: skip


def _peaks(ax: Axes, watched: WatchedBlow) -> None:
    """Draw the greatest compression and tension at each place of the string."""
    offsets, bottom = _offsets(watched), _bottom(watched)
    told = False
    for name, force in watched.force.items():
        edges = offsets[name] + watched.edges[name]
        for peak, colour, text in (
            (force.max(axis=0), PRESSED, "greatest compression"),
            (force.min(axis=0), PULLED, "greatest tension"),
        ):
            ax.stairs(
                peak / KN, edges, baseline=0.0, fill=True, color=colour, alpha=0.25, linewidth=0
            )
            ax.stairs(peak / KN, edges, baseline=None, color=colour, linewidth=1.2,
                      label="" if told else text)  # fmt: skip
        told = True
        ax.axvline(edges[0], color="black", linewidth=0.5, alpha=0.6)
    ax.axhline(0.0, color=style.RULE_COLOUR, linewidth=0.6)
    ax.set_xlim(min(offsets.values()), bottom)
    style.room_above(ax, 0.2)
    for name, offset in offsets.items():
        length = float(watched.edges[name][-1])
        if length > 0.1 * bottom:
            middle = offset + 0.5 * length
            ax.annotate(
                name, (middle, 0.97), xycoords=ax.get_xaxis_transform(), ha="center", va="top"
            )
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    style.label(
        ax, "distance below the struck end [m]; the piston lies left of 0", "force [kN]",
        "Greatest forces of the whole blow; upright lines are joints",
    )  # fmt: skip


# gauges


def draw_gauges(report: StringReport) -> Figure:
    """Draw the stress at each gauge of a report over time, one below the other."""
    watched, count = report.watched, _until(report)
    time, step = watched.time[:count], float(watched.time[1] - watched.time[0])
    offsets = _offsets(watched)
    fig = Figure(figsize=(10.0, 1.0 + 2.1 * len(report.gauges)), layout="constrained")
    panels = fig.subplots(len(report.gauges), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for ax, ((bar, place), stress) in zip(panels, report.gauges.items(), strict=True):
        shown = stress[:count] / MPA
        for sign, colour, text in ((1, PRESSED, "compression"), (-1, PULLED, "tension")):
            ax.fill_between(
                time * MS, 0.0, shown, where=sign * shown > 0, color=colour, alpha=0.35,
                linewidth=0, interpolate=True, label=text,
            )  # fmt: skip
        ax.plot(time * MS, shown, color="black", linewidth=0.9)
        ax.axhline(0.0, color=style.RULE_COLOUR, linewidth=0.6)
        if bar != "piston":
            there = _cells_above(watched, bar, place) * step
            back = 2.0 * report.transit_time - there
            close = back - there < CLOSE * float(time[-1])
            _mark_time(ax, there, "first wave", -1 if close else 1)
            _mark_time(ax, back, "back from the rock")
        below = offsets[bar] + place
        title = f"{bar_title(bar)}: {place:.3g} m below its top, {below:.3g} m below the struck end"
        style.label(ax, "", "stress [MPa]", title)
    panels[0].set_xlim(0.0, float(time[-1]) * MS)
    style.room_above(panels[0], 0.2)
    panels[-1].set_xlabel("time since the impact [ms]")
    handles = panels[0].get_legend_handles_labels()[0]
    style.head(fig, f"Stress at gauges on the string — {report.title}", handles)
    return fig


def _cells_above(watched: WatchedBlow, bar: str, place: float) -> float:
    """How many cells a wave crosses from the struck end to a place in a bar."""
    found = 0.0
    for name, edges in watched.edges.items():
        if name == bar:
            return found + float(np.interp(place, edges, np.arange(len(edges))))
        if name != "piston":
            found += len(edges) - 1
    return found
