"""Which motions does a hammer settle in, and does that depend on where it comes from?

The reversal distance D_1 (at constant power) and the feed are moved up and down in small steps
without starting the drill anew. At each step some blows pass, and those that follow are drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from examples.shared import BLACK, BLUE, GREEN, GREY, ORANGE, command_line, figure_of
from percussion_model import Scene, Simulation
from percussion_model.paper.sweeps import force_at_constant_power
from percussion_model.plotting import style
from percussion_model.plotting.style import KN, MM

NAME = "bifurcation"
# Impact velocities that differ by less, relative, are the same.
SAME = 1e-3
# Blows go round n values where they repeat after n blows so much better than after one.
BETTER = 8.0
LONGEST_CYCLE = 8
# Blows without order that differ by less are nearly alike.
NEARLY = 0.05
KINDS = {
    "every blow alike": "#E6E6E6",
    "round 2 to 8 values": GREEN,
    "nearly alike": GREY,
    "no order": BLACK,
}
# A mean rate that is known no better, relative, is not drawn.
MOST_ERROR = 0.1


@dataclass(frozen=True)
class Branch:
    """Blows along one way through the values of a parameter."""

    values: np.ndarray
    impact_velocity: np.ndarray  # (values, blows) [m/s]
    rate: np.ndarray  # mean over the blows of each value [m/s]
    error: np.ndarray  # its standard error [m/s]


def order_of(velocity: np.ndarray) -> int:
    """Values that impact velocities go round, one after the other; 0 if they do not."""
    lags = range(1, min(LONGEST_CYCLE, len(velocity) // 2) + 1)
    changes = [float(np.max(np.abs(velocity[n:] - velocity[:-n]))) for n in lags]
    same = max(SAME * float(np.mean(velocity)), changes[0] / BETTER)
    return next((n for n, change in zip(lags, changes, strict=True) if change <= same), 0)


def kind_of(velocity: np.ndarray) -> int:
    """Place among `KINDS`."""
    order = order_of(velocity)
    return min(order, 2) - 1 if order else 2 + int(np.ptp(velocity) > NEARLY * np.mean(velocity))


def follow(
    values: np.ndarray, inputs: Callable[[float], dict[str, float]], settle: int, keep: int
) -> Branch:
    """Move a parameter through its values, the drill going on; the branch has them rising."""
    simulation = Simulation(Scene(), record_events=False)
    velocity, rates = [], []
    for value in values.tolist():
        simulation.set_inputs(**inputs(value))
        wanted = len(simulation.blows) + settle + keep
        while (missing := wanted - len(simulation.blows)) > 0:
            simulation.advance(simulation.time + 0.04 * missing)
        blows = simulation.blows[wanted - keep : wanted]
        velocity.append(blows["impact_velocity"])
        rate = np.sum(blows["penetration"]) / np.sum(blows["period"])
        off = np.std(blows["penetration"] - rate * blows["period"])  # docs/model.md, section 7
        rates.append((rate, off / np.sqrt(keep) / np.mean(blows["period"])))
    up = np.argsort(values)
    return Branch(values[up], np.array(velocity)[up], *np.array(rates)[up].T)


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
    found = {}
    with figure_of(NAME, Path(out), (10.5, 6.6)) as fig:
        axes = fig.subplots(3, 2, sharex="col", height_ratios=(0.35, 2.2, 1.4))
        for column, (key, values, inputs, factor, words) in zip(axes.T, ways, strict=True):
            branches = [follow(way, inputs, settle, keep) for way in (values, values[::-1])]
            draw(column, values * factor, words, *branches)
            for name, branch in zip(("rising", "falling"), branches, strict=True):
                order = [order_of(velocity) for velocity in branch.impact_velocity]
                told = {"values": values.tolist(), "order": order, "rate": branch.rate.tolist()}
                found[f"{key}_{name}"] = told
        handles = [Patch(color=colour, label=kind) for kind, colour in KINDS.items()]
        handles += [Patch(color=BLUE, label="rising"), Patch(color=ORANGE, label="falling")]
        style.head(fig, "Blows of the settled motion, the parameter rising and falling", handles)
    return found


def draw(axes: np.ndarray, x: np.ndarray, words: str, rising: Branch, falling: Branch) -> None:
    """Draw a column: the order of the blows, each blow, and the rate."""
    strip, blows, rate = axes
    _draw_kinds(strip, x, rising, falling)
    for branch, colour, size in ((falling, ORANGE, 2.2), (rising, BLUE, 1.0)):
        at = np.repeat(x, branch.impact_velocity.shape[1])
        blows.plot(at, branch.impact_velocity.ravel(), "o", color=colour, markersize=size, mew=0)
        known = np.where(branch.error < MOST_ERROR * branch.rate, branch.rate, np.nan)
        rate.plot(x, known * MM, "-o", color=colour, markersize=1.2 * size, linewidth=0.7)
    blows.set_xscale("log")
    ticks = [t for t in (0.2, 0.5, 1, 2, 5, 10, 20) if x[0] <= t <= x[-1]]
    rate.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    rate.minorticks_off()
    rate.set_ylim(0.0, 1.6 * float(np.median(falling.rate)) * MM)
    style.label(blows, "", "impact velocity [m/s]", "Each blow")
    style.label(rate, words, "rate [mm/s]", "Mean rate of penetration, where it is known to 10 %")


def _draw_kinds(ax: Axes, x: np.ndarray, rising: Branch, falling: Branch) -> None:
    """Two strips that tell the kind of motion, rising above falling."""
    kinds = np.array([[kind_of(blows) for blows in b.impact_velocity] for b in (rising, falling)])
    colours = ListedColormap(list(KINDS.values()))
    ax.pcolormesh(
        x, [0.5, -0.5], kinds, cmap=colours, vmin=0, vmax=len(KINDS) - 1, shading="nearest"
    )
    ax.axhline(0.0, color="white", linewidth=2)
    ax.set_yticks([0.5, -0.5], ["rising", "falling"])
    ax.tick_params(length=0, labelbottom=False)
    ax.grid(False)
    ax.set_title("Order of the blows")


if __name__ == "__main__":
    command_line(main, NAME)
