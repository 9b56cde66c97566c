"""Drawing of the drilling system as blocks: its FMUs, and the signals between them."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from docs.drawings.shapes import INK, NOTE, SMALL, Place, arrow, blank, box, lines_of_text
from fmu_src.parts.build import PARTS, part_variables
from fmu_src.system.archive import HAMMER, SYSTEMS, SystemPlan, read_plan
from fmu_src.variables import Variable
from percussion_model.interface.plotting import style

SYSTEM = SYSTEMS / "feed_control.toml"
WIDTH, HEIGHT = 19.2, 10.4
ACTION, COMMAND, MEASURED, ROCK = "#222222", "#D55E00", "#0072B2", "#8A6D3B"
HAMMER_WORDS = "Piston, bit and rock force, blow by blow, with the scene in it"
CONTROLLER = "controller"


@dataclass(frozen=True)
class Block:
    """A component: place and size of its box, fill, characters in a line of it."""

    x: float
    y: float
    width: float
    height: float
    face: str
    columns: int


@dataclass(frozen=True)
class Route:
    """Way of an arrow from component to component, and where its signals are written."""

    points: tuple[Place, ...]  # from the source to the sink
    text: Place  # where the first signal stands
    align: str


BLOCKS = {
    "controller": Block(1.3, 0.9, 16.4, 1.2, "#FBE5D6", 100),
    "rig": Block(1.3, 4.3, 2.3, 2.2, "#EEF2F6", 23),
    "string": Block(5.9, 4.3, 2.3, 2.2, "#EEF2F6", 23),
    "hammer": Block(10.2, 4.3, 3.0, 2.2, "#DCE6EE", 28),
    "supply": Block(15.4, 4.3, 2.3, 2.2, "#EEF2F6", 23),
    "rock": Block(5.9, 8.5, 11.8, 1.2, "#E9DFCF", 80),
}
TOP, BOTTOM, LOW = 2.1, 4.3, 6.5
ROUTES = {
    ("controller", "rig"): Route(((2.2, TOP), (2.2, BOTTOM)), (2.35, 3.2), "left"),
    ("string", "controller"): Route(((7.0, BOTTOM), (7.0, TOP)), (6.85, 3.0), "right"),
    ("controller", "hammer"): Route(((11.0, TOP), (11.0, BOTTOM)), (10.85, 3.2), "right"),
    ("hammer", "controller"): Route(((12.4, BOTTOM), (12.4, TOP)), (12.55, 2.5), "left"),
    ("controller", "supply"): Route(((16.0, TOP), (16.0, BOTTOM)), (15.85, 3.4), "right"),
    ("supply", "controller"): Route(((17.1, BOTTOM), (17.1, TOP)), (17.25, 3.2), "left"),
    ("rig", "string"): Route(((3.6, 4.9), (5.9, 4.9)), (4.75, 4.65), "center"),
    ("rig", "hammer"): Route(
        ((2.5, LOW), (2.5, 6.95), (10.5, 6.95), (10.5, LOW)), (2.65, 7.25), "left"
    ),
    ("string", "rig"): Route(((5.9, 5.9), (3.6, 5.9)), (4.75, 6.15), "center"),
    ("string", "hammer"): Route(((8.2, 4.9), (10.2, 4.9)), (9.2, 4.65), "center"),
    ("hammer", "string"): Route(((10.2, 5.7), (8.2, 5.7)), (9.2, 5.95), "center"),
    ("supply", "hammer"): Route(((15.4, 4.9), (13.2, 4.9)), (14.3, 4.29), "center"),
    ("hammer", "supply"): Route(((13.2, 5.9), (15.4, 5.9)), (14.3, 6.15), "center"),
    ("string", "rock"): Route(((7.0, LOW), (7.0, 8.5)), (6.85, 7.5), "right"),
    ("hammer", "rock"): Route(((11.0, LOW), (11.0, 8.5)), (10.85, 7.5), "right"),
    ("rock", "hammer"): Route(((12.4, 8.5), (12.4, LOW)), (12.55, 7.3), "left"),
    ("supply", "rock"): Route(((16.5, LOW), (16.5, 8.5)), (16.35, 7.9), "right"),
    ("rock", "controller"): Route(
        ((5.9, 9.1), (0.6, 9.1), (0.6, 1.5), (1.3, 1.5)), (0.75, 8.8), "left"
    ),
}
STEP_OF_LINES = 0.36


def connected(plan: SystemPlan) -> Iterator[tuple[str, str, Variable | None]]:
    """Source and sink of each connection, and what is known of its variable."""
    variables = {name: {v.name: v for v in part_variables(part)} for name, part in PARTS.items()}
    for sink, source in plan.connections.items():
        # the hammer is no part: what it gives or takes is known by the other end
        ends = (signal.partition(".") for signal in (source, sink))
        known = (variables.get(plan.components[one], {}).get(name) for one, _, name in ends)
        yield source, sink, next(filter(None, known), None)


def signals(plan: SystemPlan) -> dict[tuple[str, str], list[str]]:
    """Outputs that go from component to component, each with its unit.

    Returns
    -------
    dict of list
        By names of source and sink.
    """
    found: dict[tuple[str, str], list[str]] = {}
    for source, sink, one in connected(plan):
        component, _, name = source.partition(".")
        unit = f" [{one.unit}]" if one and one.unit else ""
        if one and one.type == "Boolean":
            unit = " [on/off]"
        found.setdefault((component, sink.partition(".")[0]), []).append(name + unit)
    return found


def draw_system() -> Figure:
    """Draw the feed-controlled system as its file has it."""
    plan = read_plan(SYSTEM)
    fig = Figure(figsize=(13.0, 7.8), layout="constrained")
    ax = fig.subplots()
    blank(ax, WIDTH, HEIGHT)
    for name, fmu in plan.components.items():
        _block(ax, name, fmu)
    for ends, names in signals(plan).items():
        _route(ax, ends, names)
    looks = {
        ACTION: "what acts: force, velocity, place, pressure",
        COMMAND: "what the controller asks for",
        MEASURED: "what it measures",
        ROCK: "to and from the rock profile",
    }
    handles = [Line2D([], [], color=colour, linewidth=2.0, label=t) for colour, t in looks.items()]
    style.head(fig, f"The drilling system: {plan.name}, six FMUs and their signals", handles)
    words = (
        "An arrow goes from an output, which names it, to an input. All are exchanged once a "
        f"communication step, {1e3 * plan.step:g} ms here, and held in between."
    )
    ax.text(0.3, 10.15, words, va="center", color=NOTE)
    return fig


def _block(ax: Axes, name: str, fmu: str) -> None:
    """Draw a component: its name, that of its FMU, and what the FMU says it is."""
    one = BLOCKS[name]
    box(ax, (one.x, one.y), (one.width, one.height), one.face)
    words = HAMMER_WORDS if fmu == HAMMER else PARTS[fmu].description
    lines = textwrap.wrap(words, one.columns)
    count = 1.25 + len(lines)
    first = one.y + 0.5 * (one.height - (count - 1.0) * STEP_OF_LINES)
    middle = one.x + 0.5 * one.width
    ax.text(middle, first, f"{name}: {fmu}", ha="center", va="center", fontweight="bold",
            fontsize=8.5)  # fmt: skip
    lines_of_text(ax, (middle, first + 1.25 * STEP_OF_LINES), lines, STEP_OF_LINES,
                  ha="center", fontsize=SMALL, color=NOTE)  # fmt: skip


def _route(ax: Axes, ends: tuple[str, str], names: list[str]) -> None:
    """Draw an arrow and write its signals beside it."""
    route = ROUTES[ends]
    colour = _colour(*ends)
    *way, last = route.points
    for a, b in pairwise(way):
        ax.add_line(Line2D([a[0], b[0]], [a[1], b[1]], color=colour, linewidth=1.4))
    arrow(ax, way[-1], last, colour)
    lines_of_text(ax, route.text, names, STEP_OF_LINES, ha=route.align, fontsize=SMALL,
                  color=colour if colour != ACTION else INK)  # fmt: skip


def _colour(source: str, sink: str) -> str:
    """Colour of a signal by what it is for."""
    if source == CONTROLLER:
        return COMMAND
    if sink == CONTROLLER:
        return MEASURED
    return ROCK if "rock" in (source, sink) else ACTION
