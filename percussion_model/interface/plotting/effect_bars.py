"""Figure of the cost and change of each effect, as bars."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from percussion_model.analysis.change import Change
from percussion_model.analysis.effect_study import EffectsStudy
from percussion_model.interface.plotting import style
from percussion_model.simulation.uncertain import ABOUT, UNDECIDED, in_digits

COST_COLOUR, MORE_COLOUR, LESS_COLOUR = "#0072B2", "#D55E00", "#009E73"
UNDECIDED_COLOUR = "#EEEEEE"
UNDECIDED_EDGE = "#BBBBBB"
# Axes are made for changes up to this [%].
WIDEST = 60.0
# Bars beyond this multiple of it have no room for their number, and are cut off.
UNCUT = 1.4
# Room beside the longest bar for its number, as a factor on its length; what is cut off, and
# what is undecided, ends before the axis does.
ROOM, WITHIN = 1.75, 0.92
# Width of a character by that of half a panel.
CHARACTER = 0.072
# Changes below this are none [%].
NOTHING = 5e-3
# A figure is as wide as that of so many panels, for its title.
LEAST_WIDTH = 3
# Draws a panel.
Panel = Callable[[Axes], None]


# Cost of what, by its key in the numbers of a trial; of the run where there are no blows.
COSTS = {"step_time": "a time step", "blow_time": "a blow"}
COST_OF_RUN = {"step_time": "a time step", "wall_time": "the run"}
CHANGES = {
    "rate_of_penetration": "Rate of penetration",
    "blow_period": "Blow period",
    "peak_bit_force": "Peak bit force",
    "depth": "Depth",
    "rebound_velocity": "Rebound velocity",
    "rest_time": "Time of rest",
}


def draw_effects(found: EffectsStudy) -> Figure:
    """Draw costs and changes, a panel each; one that has nothing is left out."""
    trials = found.trials
    names = [trial.variant.name for trial in trials]
    panels = [*_cost_panels(found), *_change_panels(found)]
    height, width = 2.2 + 0.32 * len(trials), 2.0 + 2.0 * max(len(panels), LEAST_WIDTH)
    fig = Figure(figsize=(width, height), layout="constrained")
    axes = fig.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for ax, draw in zip(axes, panels, strict=True):
        draw(ax)
    axes[0].set_yticks(range(len(trials)), names)
    axes[0].invert_yaxis()
    for ax in axes:
        ax.grid(visible=False, axis="y")
        ax.tick_params(axis="y", length=0)
        # a rule between the rows leads from their names to the last panel
        ends = ax.get_xlim()
        ax.hlines([k + 0.5 for k in range(len(trials) - 1)], *ends, color="#E6E6E6", linewidth=0.7,
                  zorder=0)  # fmt: skip
        ax.set_xlim(ends)
    title = found.scene.title
    head = "What each effect costs and changes, one turned at a time"
    style.head(fig, head + (f" — {title}" if title else ""), _handles(found))
    return fig


def _handles(found: EffectsStudy) -> list[Patch | Line2D]:
    """Legend of what occurs: colours, cut bars, and signs of what is not known."""
    changes = [found.change(trial, key) for trial in found.trials for key in found.changed]
    known = [one for one in changes if one.value is not None and not one.is_undecided]
    handles: list[Patch | Line2D] = [
        Patch(facecolor=COST_COLOUR, label="computing time divided by that of the scene as it is"),
        Patch(facecolor=MORE_COLOUR, label="more than in the scene as it is"),
        Patch(facecolor=LESS_COLOUR, label="less than in it"),
    ]
    if any(one.is_undecided for one in changes):
        handles.append(Patch(facecolor=UNDECIDED_COLOUR, edgecolor=UNDECIDED_EDGE,
                             label="undecided: the errors may explain it"))  # fmt: skip
    if any(100.0 * abs(one.value or 0.0) > UNCUT * WIDEST for one in known):
        handles.append(
            Patch(facecolor=MORE_COLOUR, edgecolor="w", hatch="///", label="bar cut off")
        )
    words = {"–": "means nothing there"}
    if any(one.is_rough for one in changes):
        words[ABOUT] = "error not known"
    handles += [
        Line2D([], [], linestyle="", marker=f"${sign}$", color="black", label=text)
        for sign, text in words.items()
    ]
    return handles


def _cost_panels(found: EffectsStudy) -> Iterator[Panel]:
    """Costs by those of the scene as it is."""
    base = found.base.numbers()
    for key, title in (COSTS if base["blow_time"] else COST_OF_RUN).items():
        costs = [trial.numbers()[key] for trial in found.trials]
        values = [c / base[key] if c is not None and base[key] else None for c in costs]
        if any(value is not None for value in values):
            yield partial(_costs, values, f"Cost of {title}")


def _change_panels(found: EffectsStudy) -> Iterator[Panel]:
    """Changes of numbers, and which of them are not known."""
    for key in found.changed:
        changes = [found.change(trial, key) for trial in found.trials]
        if any(change.value is not None for change in changes):
            yield partial(_changes, changes, CHANGES[key])


def _costs(values: list[float | None], title: str, ax: Axes) -> None:
    """Bars from 1, on a logarithmic axis."""
    known = [value for value in values if value is not None]
    least, most = min([0.5, *known]), max([2.0, *known])
    ax.set_xscale("log")
    ax.set_xlim(least / 20.0, most * 9.0)
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_locator(NullLocator())
    for y, value in enumerate(values):
        if value is None:
            ax.text(1.0, y, " –", va="center")
            continue
        ax.barh(y, value - 1.0, left=1.0, height=0.62, color=COST_COLOUR)
        side = 1.08 if value >= 1.0 else 1.0 / 1.08
        align = "left" if value >= 1.0 else "right"
        ax.text(value * side, y, in_digits(value, 2), va="center", ha=align, fontsize=8.0)
    ax.axvline(1.0, color=style.RULE_COLOUR, linewidth=0.8)
    style.label(ax, "times that of the scene", "", title)


def _changes(changes: list[Change], title: str, ax: Axes) -> None:
    """Bars from 0 in per cent, with their errors, grey where they are not known."""
    shares = [None if one.value is None else 100.0 * one.value for one in changes]
    known = [
        abs(share)
        for share, one in zip(shares, changes, strict=True)
        if share is not None and not one.is_undecided
    ]
    end = min(max([1.0, *known]), WIDEST)
    ax.set_xlim(-ROOM * end, ROOM * end)
    longest = WITHIN * ROOM * end
    for y, (share, change) in enumerate(zip(shares, changes, strict=True)):
        if change.is_undecided:
            ax.barh(y, 2.0 * longest, left=-longest, height=0.62, facecolor=UNDECIDED_COLOUR,
                    edgecolor=UNDECIDED_EDGE, linewidth=0.6)  # fmt: skip
            ax.text(0.0, y, UNDECIDED, va="center", ha="center", fontsize=8.0)
            continue
        if share is None:
            ax.text(0.0, y, " –", va="center")
            continue
        cut = abs(share) > UNCUT * end
        shown = math.copysign(longest, share) if cut else share
        colour = MORE_COLOUR if share >= 0.0 else LESS_COLOUR
        ax.barh(y, shown, height=0.62, color=colour, hatch="///" if cut else None, edgecolor="w")
        text = " 0 " if abs(share) < NOTHING else f" {change.text()} "
        # what has no room beside its bar stands on the other side of zero
        has_room = abs(shown) / (ROOM * end) + CHARACTER * (len(text) - 1) <= 1.0
        align = "left" if (share >= 0.0) == has_room else "right"
        ax.text(shown if has_room else 0.0, y, text, va="center", ha=align, fontsize=8.0)
    ax.axvline(0.0, color=style.RULE_COLOUR, linewidth=0.8)
    style.label(ax, "change [%]", "", title)
