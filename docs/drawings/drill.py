"""Drawing for drillers: a hammer in its hole, and what the program computes of it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle

from docs.drawings.model import CRUSHED, DRIVE, FORCE, ROCK, STEEL
from docs.drawings.shapes import INK, NOTE, arrow, blank
from percussion_model import Scene, Simulation, settled
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM, MS
from percussion_model.scene.hammers import hammer
from percussion_model.scene.rocks import rock

HAMMER, GRANITE = "dth5", "kuru-granite"
FEEDS = np.linspace(2e3, 20e3, 13)  # [N]
START, BLOWS = 1.0, 8  # blows that are drawn, from a time on [s]
STEP = 5e-5  # of the depth [s]
FINE, LONG = 1e-6, 1e-3  # of the forces of one blow, and how long they are drawn [s]
PER_HOUR = 3600.0
MIDDLE = 3.4  # of the sketch, in its own units


def on_granite(name: str) -> Scene:
    """A hammer on the market, with its bit on granite."""
    scene = hammer(name)
    return scene.replace(**rock(GRANITE, buttons=scene.breaking.buttons).parameters)


def draw_drill() -> Figure:
    """Draw the hammer, and beside it depth, forces and rate as computed."""
    scene = on_granite(HAMMER)
    fig = Figure(figsize=(9.4, 6.0), layout="constrained")
    left, right = fig.subfigures(1, 2, width_ratios=(1.0, 1.15))
    _sketch(left.subplots())
    depth, forces, rate = right.subplots(3, 1)
    _blows(depth, forces, scene)
    _rates(rate, scene)
    style.head(fig, "A 5-inch hammer in granite: what happens, and what is computed")
    return fig


def _sketch(ax: Axes) -> None:
    """Draw casing, piston and bit in the hole, and say what each does."""
    blank(ax, 8.9, 12.4, equal=True)
    x, top, end, hole = MIDDLE, 2.0, 10.2, 1.35
    ax.add_patch(Rectangle((0.2, 1.6), x - hole - 0.2, 10.4, facecolor=ROCK))
    ax.add_patch(Rectangle((x + hole, 1.6), 8.8 - x - hole, 10.4, facecolor=ROCK))
    ax.add_patch(Rectangle((x - hole, end + 0.25), 2.0 * hole, 12.0 - end - 0.25, facecolor=ROCK))
    for side in (-1.0, 1.0):  # walls of the casing, and the string above
        ax.add_patch(Rectangle((x + side * 0.95 - 0.13, top), 0.26, 6.3, facecolor="#9AA7B3"))
    ax.add_patch(Rectangle((x - 1.08, top - 0.3), 2.16, 0.4, facecolor="#9AA7B3"))
    ax.add_patch(Rectangle((x - 0.35, 0.2), 0.7, top - 0.4, facecolor="#9AA7B3"))
    for corner, size, name in (
        ((x - 0.78, 3.2), (1.56, 2.4), "piston"), ((x - 0.62, 6.6), (1.24, 2.4), "bit"),
    ):  # fmt: skip
        ax.add_patch(Rectangle(corner, *size, facecolor=STEEL, edgecolor=INK))
        ax.text(x, corner[1] + 0.5 * size[1], name, ha="center", va="center", fontweight="bold")
    ax.add_patch(Rectangle((x - 1.25, 9.0), 2.5, end - 9.0, facecolor=STEEL, edgecolor=INK))
    for k in range(5):
        ax.add_patch(Circle((x - 1.0 + 0.5 * k, end + 0.06), 0.19, facecolor="#555555"))
    for k in range(4):
        place = x - 0.75 + 0.5 * k
        chip = [(place - 0.14, end + 0.5), (place + 0.16, end + 0.45), (place, end + 0.8)]
        ax.add_patch(Polygon(chip, facecolor=CRUSHED, edgecolor=NOTE, linewidth=0.5))
    arrow(ax, (x, 0.25), (x, 1.6), FORCE)
    arrow(ax, (x - 0.2, 4.0), (x - 0.2, 3.3), DRIVE, linewidth=1.0)
    arrow(ax, (x + 0.2, 4.8), (x + 0.2, 5.5), DRIVE, linewidth=1.0)
    arrow(ax, (x + hole - 0.1, 10.0), (x + hole - 0.1, 2.2), NOTE, linewidth=1.0)
    at = x + hole + 0.25
    for y, words, colour in (
        (0.7, "feed, rotation and air\ncome down the string", FORCE),
        (4.4, "air throws the piston", DRIVE),
        (6.1, "it strikes the bit: a wave\nof stress runs down", INK),
        (8.0, "air carries cuttings up", NOTE),
        (10.4, "buttons crush the rock\nand turn to fresh rock", INK),
    ):
        ax.text(at, y, words, va="center", color=colour)


def _blows(depth: Axes, forces: Axes, scene: Scene) -> None:
    """Draw the hole blow by blow, and the forces of one of them."""
    simulation = Simulation(scene)
    simulation.advance(START)
    start = simulation.time
    found = settled(scene)
    period = found.blow_period
    coarse = simulation.sample(start + np.arange(0.0, BLOWS * period, STEP))
    hole = (coarse["hole_depth"] - coarse["hole_depth"][0]) * MM
    depth.plot((coarse["time"] - start) * MS, hole, color=style.BIT_COLOUR)
    style.label(
        depth, "time [ms]", "hole [mm]", f"{60.0 / period:.0f} blows per minute deepen the hole"
    )
    struck = np.flatnonzero(coarse["contact_force"] > 0.0)
    begin = coarse["time"][struck[0]] + period - 1e-4
    again = Simulation(scene)
    fine = again.sample(begin + np.arange(0.0, LONG, FINE))
    time = (fine["time"] - begin) * MS
    forces.plot(
        time, fine["contact_force"] / KN, "--", color=style.PISTON_COLOUR, label="piston on bit"
    )
    forces.plot(time, fine["bit_force"] / KN, color=style.BIT_COLOUR, label="bit on rock")
    forces.legend(loc="upper right")
    style.label(forces, "time [ms]", "force [kN]", "One blow")


def _rates(ax: Axes, scene: Scene) -> None:
    """Draw the rate of penetration over the feed."""
    rates = [
        PER_HOUR * settled(scene.replace(**{"feed.force": feed})).rate_of_penetration
        for feed in FEEDS
    ]
    ax.plot(FEEDS / KN, rates, "o-", markersize=3.0, color=style.BIT_COLOUR)
    ax.set_ylim(bottom=0.0)
    style.label(ax, "feed force [kN]", "rate [m/h]", "Rate of penetration over feed")
