"""Drawing of the solvers: the waves of one impact, what is exact in them and what approximate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from docs.drawings.fronts import fronts
from docs.drawings.shapes import INK, NOTE, SMALL, blank, lines_of_text
from percussion_model import Scene, Simulation
from percussion_model.analysis.drill_string import cells_of, closed_contacts
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM, MODE_COLOURS, US
from percussion_model.physics.records import EventKind, Mode
from percussion_model.solvers.modal.records import STEP

# A piston with a step, so that waves meet one [m], [m^2].
STEPPED = [{"length": 0.105, "area": 0.0055}, {"length": 0.070, "area": 0.0035}]
STEPS = 40
COLOURS = 21  # few, so that the file stays small
SHOWN = 510e-6  # since the impact: up to the second one [s]
FOLLOWED = 240e-6  # fronts, which loss wears down [s]
# Modes of the piston that are compared, and the span in which they differ [s].
MODES = (8, 20, 80)
MODE_LINES = (("#E69F00", "-"), ("#0072B2", "-"), ("#222222", "-"))
BEFORE, AFTER = 5e-6, 95e-6
# Steps whose error is shown, and by which it is found.
COUNTS, FINE = (6, 8, 10, 13, 16, 20, 24, 32, 40, 50, 64, 80), 400
EXACT = (
    "Exact",
    "waves: a bar of any length delays them by its transit time",
    "modes: motion and loss between two events, of the modes kept",
    "both: reflection at ends and steps, by impedance",
    "both: hard contact, without a stiffness to choose",
    "waves: events of the rock within a step, in closed form",
)
APPROXIMATE = (
    "Approximate",
    "modes: finitely many, so fronts are rounded and ring",
    f"modes: events to 1/{1 << STEP} of a step",
    "waves: what arrives at an end is constant over a step",
    "waves: a delay that is no whole number of steps spreads fronts",
)


@dataclass(frozen=True)
class Impact:
    """The first impact of a scene by waves; times since it [s]."""

    time: np.ndarray  # of the columns of `stress` [s]
    edges: np.ndarray  # borders of its rows [m]
    stress: np.ndarray  # shape (cells, times), compression positive [Pa]
    contacts: list[tuple[float, float]]
    events: list[tuple[float, int]]  # time and kind
    start: float  # time of the impact in the run [s]


def stepped(scene: Scene) -> Scene:
    """Return the scene with a step in its piston."""
    return scene.replace(piston={"sections": STEPPED})


def impact_of(scene: Scene) -> Impact:
    """Run the first impact by waves, and keep the stress of all cells at every step."""
    simulation = Simulation(scene.computed_by("wave", **{"solver.cells": STEPS}))
    step = simulation.solver.time_step
    rows = []
    for k in range(int(SHOWN / step) + 3):
        simulation.advance(k * step)
        fields = simulation.fields()
        rows.append(np.concatenate([fields["piston_force"], fields["bit_force"]]))
    events = simulation.events
    start = float(events["time"][events["kind"] == EventKind.CONTACT_CLOSED][0])
    piston, bit = (
        cells_of(bar, simulation.solver.section_cells(bar)) for bar in (scene.piston, scene.bit)
    )
    return Impact(
        time=np.arange(len(rows)) * step - start,
        edges=np.append(piston[0], piston[0][-1] + bit[0][1:]),
        stress=np.array(rows).T / np.append(piston[1], bit[1])[:, None],
        contacts=closed_contacts(events, start, start + SHOWN),
        events=[(float(e["time"]) - start, int(e["kind"])) for e in events],
        start=start,
    )


def draw_waves(scene: Scene) -> Figure:
    """Draw an impact over time and depth, and the errors of modes and steps."""
    scene = stepped(scene)
    found = impact_of(scene)
    fig = Figure(figsize=(10.6, 8.2), layout="constrained")
    grid = fig.add_gridspec(3, 2, width_ratios=(1.75, 1.0), height_ratios=(2.4, 2.0, 1.15))
    left = grid[:2, 0].subgridspec(2, 1, height_ratios=(5.6, 1.0), hspace=0.02)
    above = fig.add_subplot(left[0])
    _diagram(fig, above, scene, found)
    _rock_modes(fig.add_subplot(left[1], sharex=above), found)
    above.tick_params(labelbottom=False)
    _modes(fig.add_subplot(grid[0, 1]), scene, found)
    _steps(fig.add_subplot(grid[1, 1]), scene, found)
    _words(fig.add_subplot(grid[2, :]))
    style.head(fig, "The solvers: waves of one impact, piston with a step")
    return fig


def _diagram(fig: Figure, ax: Axes, scene: Scene, found: Impact) -> None:
    """Draw stress over time and depth, the fronts upon it, and contacts with their events."""
    step = found.time[1] - found.time[0]
    edges = np.append(found.time, found.time[-1] + step) - 0.5 * step
    limit = float(np.abs(found.stress).max()) / style.MPA
    mesh = ax.pcolormesh(
        edges * US, found.edges * MM, found.stress / style.MPA,
        cmap=colormaps["RdBu_r"].resampled(COLOURS), vmin=-limit, vmax=limit,
        rasterized=True, alpha=0.8,
    )  # fmt: skip
    lines, borders = fronts(scene, found.contacts, FOLLOWED)
    for front in lines:
        (t0, x0), (t1, x1) = front.start, front.end
        share = min(1.0, (FOLLOWED - t0) / (t1 - t0))
        ax.plot(
            [t0 * US, (t0 + share * (t1 - t0)) * US], [x0 * MM, (x0 + share * (x1 - x0)) * MM],
            "-" if front.force > 0.0 else "--", color=INK, linewidth=0.5 + 1.1 * abs(front.force),
        )  # fmt: skip
    struck = len(scene.piston.sections)
    for k, border in enumerate(borders[1:-1], start=1):
        dashes = "-" if k == struck else ":"
        ax.plot([0.0, SHOWN * US], [border * MM] * 2, dashes, color=NOTE, linewidth=0.8)
        if k != struck:
            ax.text(SHOWN * US - 6, border * MM - 5, "step of the piston", ha="right", va="bottom",
                    fontsize=SMALL, color=NOTE)  # fmt: skip
    _contacts(ax, found, borders[struck])
    middles = (0.5 * borders[struck], 0.5 * (borders[struck] + borders[-1]))
    for name, depth in zip(("piston", "bit"), middles, strict=True):
        ax.text(-12.0, depth * MM, name, rotation=90, ha="center", va="center", fontweight="bold")
    ax.set_ylim(borders[-1] * MM, 0.0)
    ax.set_xlim(-22.0, SHOWN * US)
    ax.grid(False)
    style.label(ax, "", "depth below the top of the piston [mm]",
                "Stress (colour) and fronts along characteristics (lines)")  # fmt: skip
    bar = fig.colorbar(mesh, ax=ax, location="top", aspect=50, shrink=0.6, pad=0.02)
    bar.set_label("axial stress [MPa], compression red, tension blue")
    bar.outline.set_visible(False)
    ax.legend(handles=[
        Line2D([], [], color=INK, linewidth=1.5, label="front of compression"),
        Line2D([], [], color=INK, linewidth=1.5, linestyle="--", label="front of tension"),
        Line2D([], [], color=INK, linewidth=4.0, label="piston on bit"),
    ], loc="upper right", fontsize=SMALL, bbox_to_anchor=(0.99, 0.99))  # fmt: skip


def _contacts(ax: Axes, found: Impact, depth: float) -> None:
    """Draw where piston and bit touch; say once where that ends, and where it begins again."""
    for start, stop in found.contacts:
        ax.plot([start * US, min(stop, SHOWN) * US], [depth * MM] * 2, color=INK, linewidth=4.0,
                solid_capstyle="butt", zorder=4)  # fmt: skip
    words = {EventKind.CONTACT_CLOSED: "contact closes", EventKind.CONTACT_OPENED: "contact opens"}
    for time, kind in found.events:
        if kind in words and 1e-6 < time < SHOWN:
            late = time > 0.8 * SHOWN
            ax.annotate(
                words.pop(EventKind(kind)), (time * US, depth * MM), (-14 if late else 14, 20),
                textcoords="offset points", ha="right" if late else "left", fontsize=SMALL,
                bbox={"facecolor": "white", "linewidth": 0.0, "alpha": 0.8, "pad": 1.0},
                arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 0.9},
            )  # fmt: skip


def _rock_modes(ax: Axes, found: Impact) -> None:
    """Draw the mode of the rock over time, and its events."""
    changes = [(t, Mode(kind)) for t, kind in found.events if kind <= EventKind.MODE_SS]
    times = [0.0, *(t for t, _ in changes), SHOWN]
    modes = [Mode.FF, *(mode for _, mode in changes)]
    for mode, start, end in zip(modes, times[:-1], times[1:], strict=True):
        width = min(end, SHOWN) - start
        ax.barh(0.0, width * US, left=start * US, height=1.0, color=MODE_COLOURS[mode])
        if width > 14e-6:
            ax.text((start + 0.5 * width) * US, 0.0, mode.name, ha="center", va="center",
                    fontsize=SMALL, color="white" if mode != Mode.FF else INK)  # fmt: skip
    for t, _ in changes:
        ax.plot([t * US], [0.72], "v", color=INK, markersize=5.0, clip_on=False)
    ax.set_ylim(-0.5, 0.9)
    ax.set_yticks([0.0], ["rock"])
    ax.tick_params(axis="y", length=0)
    ax.grid(False)
    ax.set_xlabel("time since the impact [µs]; triangles: events of the rock law")


def _modes(ax: Axes, scene: Scene, found: Impact) -> None:
    """Draw the contact force by different numbers of modes, and by waves."""
    runs = [
        (f"{count} modes", scene.computed_by("modal", **{"solver.cells": count}), look)
        for count, look in zip(MODES, MODE_LINES, strict=True)
    ]
    runs.append((f"waves, {STEPS} steps", scene.computed_by(
        "wave", **{"solver.cells": STEPS}), ("#CC79A7", "--")))  # fmt: skip
    times = np.arange(max(found.start - BEFORE, 0.0), found.start + AFTER, 2e-7)
    for name, chosen, (colour, dashes) in runs:
        force = Simulation(chosen).sample(times)["contact_force"]
        ax.plot((times - found.start) * US, force / KN, dashes, color=colour, label=name,
                linewidth=1.2)  # fmt: skip
    ax.legend(loc="lower center", fontsize=SMALL)
    style.label(ax, "time since the impact [µs]", "contact force $F_C$ [kN]",
                "Modes: the fewer, the rounder the fronts")  # fmt: skip


def _steps(ax: Axes, scene: Scene, found: Impact) -> None:
    """Draw the error of the force on the rock by the number of steps in the piston."""
    times = found.start + np.arange(0.0, SHOWN, 2e-7)

    def force(count: int) -> np.ndarray:
        chosen = scene.computed_by("wave", **{"solver.cells": count})
        return Simulation(chosen).sample(times)["bit_force"]

    fine = force(FINE)
    errors = np.array([np.abs(force(n) - fine).sum() for n in COUNTS]) / np.abs(fine).sum()
    ax.loglog(COUNTS, 100.0 * errors, "o", color="#0072B2", markersize=4.5,
              label="force on the rock, mean difference")  # fmt: skip
    first = errors[-1] * COUNTS[-1] / np.array([COUNTS[0], COUNTS[-1]])
    ax.loglog([COUNTS[0], COUNTS[-1]], 100.0 * first, "--", color=NOTE, linewidth=1.0,
              label="first order")  # fmt: skip
    ax.set_xticks([6, 10, 20, 40, 80], ["6", "10", "20", "40", "80"])
    ax.set_yticks([0.2, 0.5, 1.0, 2.0], ["0.2", "0.5", "1", "2"])
    ax.minorticks_off()
    ax.legend(loc="lower left", fontsize=SMALL)
    style.label(ax, "steps in which a wave crosses the piston", "error [%]",
                "Waves: the more steps, the smaller the error")  # fmt: skip


def _words(ax: Axes) -> None:
    """Write what is exact and what is approximate."""
    blank(ax, 10.0, 6.4)
    for x, lines, colour in ((0.1, EXACT, "#009E73"), (5.1, APPROXIMATE, "#D55E00")):
        ax.add_line(Line2D([x - 0.06] * 2, [0.0, 6.2], color=colour, linewidth=3.0))
        head, *rest = lines
        lines_of_text(ax, (x, 0.55), [head], 1.0, fontweight="bold")
        lines_of_text(ax, (x, 1.65), rest, 1.05)
