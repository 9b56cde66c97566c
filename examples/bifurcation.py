"""Motions that a hammer settles in, and whether they depend on where it comes from.

The reversal distance D_1 (at constant power) and the feed are moved up and down in small steps
without starting the drill anew. At each step some blows pass, and those that follow are drawn.
From a feed at which blows have no order every other feed is also set at once, at some moments:
which motion then follows is a matter of chance.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from examples.motions import ABOUT_ERRORS, KINDS, Branch, branch_of, described, kind_of
from examples.shared import BLUE, ORANGE, PINK, command_line, figure_of, plain_ticks
from percussion_model import Scene, Simulation
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM
from percussion_model.verification.paper.runs import force_at_constant_power

NAME = "bifurcation"
# The feed from which others are set at once [N], and after how many blows there.
LOW_FEED, MOMENTS = 250.0, (20, 35, 50)
# No run of blows takes so long [s].
LONG = 1e3
COLOURS = {"falling": ORANGE, "rising": BLUE, "at once": PINK}
SIZES = {"falling": 2.2, "rising": 1.4, "at once": 1.5}
# A mean rate that is known no better, relative, is not drawn.
MOST_ERROR = 0.1


def follow(
    values: np.ndarray, inputs: Callable[[float], dict[str, float]], settle: int, keep: int
) -> Branch:
    """Move a parameter through its values, without a new start; the branch has them rising."""
    simulation = Simulation(Scene(), record_events=False)
    rows = []
    for value in values.tolist():
        simulation.set_inputs(**inputs(value))
        wanted = len(simulation.blows) + settle + keep
        while (missing := wanted - len(simulation.blows)) > 0:
            simulation.advance(simulation.time + 0.04 * missing)
        rows.append(simulation.blows[wanted - keep : wanted])
    return branch_of(values, rows)


def jump(values: np.ndarray, after: int, settle: int, keep: int) -> Branch:
    """Set each feed at once when the drill has made `after` blows at the low one."""
    simulation = Simulation(Scene(), record_events=False)
    simulation.set_inputs(feed_force=LOW_FEED)
    simulation.advance_blows(after, LONG)
    here = simulation.save()
    rows = []
    for value in values.tolist():
        simulation.restore(here)
        simulation.set_inputs(feed_force=value)
        simulation.advance_blows(settle + keep, LONG)
        rows.append(simulation.blows[-keep:])
    return branch_of(values, rows)


def at_constant_power(distance: float) -> dict[str, float]:
    """Inputs that change D_1 and keep the power scale."""
    force = force_at_constant_power(Scene(), np.array(distance))
    return {"reversal_distance": distance, "drive_force": float(force)}


def main(out: Path, quick: bool = False) -> dict[str, Any]:
    """Draw impact velocity and rate over D_1 and over feed, both ways."""
    count, settle, keep = (5, 12, 8) if quick else (60, 120, 48)
    distance, feed = np.geomspace(1.2e-3, 20e-3, count), np.geomspace(150.0, 3e3, count)
    ways = (
        ("distance", distance, at_constant_power, MM, "distance $D_1$ at constant power [mm]"),
        ("feed", feed, lambda force: {"feed_force": force}, 1.0 / KN, "feed force $F_S$ [kN]"),
    )
    found: dict[str, Any] = {"errors": ABOUT_ERRORS}
    with figure_of(NAME, Path(out), (10.5, 6.8)) as fig:
        axes = fig.subplots(3, 2, sharex="col", height_ratios=(0.5, 2.2, 1.4))
        for column, (key, values, inputs, factor, words) in zip(axes.T, ways, strict=True):
            branches = {
                "falling": [follow(values[::-1], inputs, settle, keep)],
                "rising": [follow(values, inputs, settle, keep)],
            }
            if key == "feed":
                high = values[values > LOW_FEED]
                branches["at once"] = [jump(high, k, settle, keep) for k in MOMENTS[quick * 2 :]]
            draw(column, factor, words, branches)
            for name, some in branches.items():
                found |= {f"{key}_{name}": [described(branch) for branch in some]}
        handles = [Patch(color=colour, label=kind) for kind, colour in KINDS.items()]
        words = {"at once": f"set at once from {LOW_FEED:g} N"}
        handles += [Patch(color=c, label=words.get(way, way)) for way, c in COLOURS.items()]
        style.head(fig, "Blows of the settled motion, by where the drill comes from", handles)
    return found


def draw(axes: np.ndarray, factor: float, words: str, branches: dict[str, list[Branch]]) -> None:
    """Draw a column: the order of the blows, each blow, and the rate."""
    strip, blows, rate = axes
    _draw_kinds(strip, factor, branches)
    for way, some in branches.items():
        markers = {"color": COLOURS[way], "markersize": SIZES[way]}
        for branch in some:
            at = np.repeat(branch.values * factor, branch.impact_velocity.shape[1])
            blows.plot(at, branch.impact_velocity.ravel(), "o", mew=0, **markers)
            known = np.where(branch.error < MOST_ERROR * branch.rate, branch.rate, np.nan)
            rate.plot(branch.values * factor, known * MM, "o", mew=0, alpha=0.8, **markers)
    plain_ticks(rate, branches["falling"][0].values * factor)
    rate.set_ylim(0.0, 1.6 * float(np.median(branches["falling"][0].rate)) * MM)
    for line in rate.lines:
        line.set_markersize(2.0 * line.get_markersize())
    style.label(blows, "", "impact velocity [m/s]", "Each blow")
    style.label(rate, words, "rate [mm/s]", "Mean rate of penetration, where it is known to 10 %")


def _draw_kinds(ax: Axes, factor: float, branches: dict[str, list[Branch]]) -> None:
    """A strip for each way that tells the kind of motion; branches of one way share it."""
    colours = ListedColormap(list(KINDS.values()))
    for top, some in enumerate(branches.values()):
        edges = np.linspace(top, top + 0.92, len(some) + 1)
        for low, high, branch in zip(edges, edges[1:], some, strict=False):
            x = branch.values * factor
            ratio = np.sqrt(x[1] / x[0])
            kinds = [[kind_of(velocity) for velocity in branch.impact_velocity]]
            ax.pcolormesh(np.append(x / ratio, x[-1] * ratio), [low, high], kinds,
                          cmap=colours, vmin=0, vmax=len(KINDS) - 1)  # fmt: skip
            ax.axhline(high, color="white", linewidth=0.7)
    ax.set_yticks([row + 0.46 for row in range(len(branches))], list(branches))
    ax.tick_params(length=0, labelbottom=False)
    ax.grid(False)
    ax.set_title("Order of the blows")


if __name__ == "__main__":
    command_line(main, NAME)
