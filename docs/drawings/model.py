"""Drawing of the model: piston, bit and rock with their forces, and the laws of drive and rock."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle

from docs.drawings.shapes import INK, NOTE, SMALL, arrow, blank, dimension
from percussion_model import Scene, Simulation
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM, MODE_COLOURS
from percussion_model.physics.records import Mode

STEEL, ROCK, CRUSHED = "#DCE6EE", "#E9DFCF", "#CDB994"
FORCE, DRIVE = "#D55E00", "#0072B2"
# A barrier that is seen: that of the reference takes a thousandth of a blow's energy [J], [N s/m].
SHOWN_BARRIER = {"rock.barrier_energy": 8.0, "rock.barrier_damping": 4e4}
DROP_TIME, DROP_STEP = 0.03, 5e-7  # [s]
# Two blows from the start of the run: the first one starts anew, the second has a whole path.
DRIVE_TIME, DRIVE_STEP = 0.12, 1e-4  # [s]

# The sketch in its own units, depth down.
WIDTH, HEIGHT, AXIS = 11.0, 15.4, 5.0
PISTON = ((1.2, 3.9, 1.15), (3.9, 5.6, 0.8))  # top, bottom, half width of each section
BIT = ((6.5, 10.1, 0.8), (10.1, 12.4, 1.35))
SURFACE, DATUM, HOLE = 9.7, 11.5, 1.6
# Rule by which each mode of table 1 ends, as in docs/model.md.
ENDS = {
    Mode.FF: ("0", "at $p = P_u$: DFC if $KE_b > W_R$, else SS"),
    Mode.DFC: ("$K_R$, $C_R$", "when the dashpot has taken $W_R$, or as FC"),
    Mode.FC: ("$K_R$", "when the bit turns up, $\\dot p < 0$"),
    Mode.BC: ("$\\gamma K_R$", "at $p = P_u$, or when the bit turns down"),
    Mode.SS: ("$\\gamma K_R$, $C_R$", "when $KE_b > W_R$, or the force is gone"),
}


def draw_model(scene: Scene) -> Figure:
    """Draw the parts with their symbols, and beside them both laws of a scene."""
    fig = Figure(figsize=(11.2, 8.0), layout="constrained")
    left, right = fig.subfigures(1, 2, width_ratios=(1.0, 1.12))
    _sketch(left.subplots())
    drive, rock, modes = right.subplots(3, 1, height_ratios=(1.0, 1.75, 0.95))
    _drive_law(drive, scene)
    _rock_law(rock, scene)
    _modes(modes)
    style.head(fig, "The model: piston, bit and rock")
    return fig


def _sketch(ax: Axes) -> None:
    blank(ax, WIDTH, HEIGHT, equal=True)
    _rock(ax)
    for name, sections in (("piston", PISTON), ("bit", BIT)):
        for top, bottom, half in sections:
            corner = (AXIS - half, top)
            ax.add_patch(
                Rectangle(corner, 2.0 * half, bottom - top, facecolor=STEEL, edgecolor=INK)
            )
        top, bottom = sections[0][0], sections[-1][1]
        ax.text(AXIS, top + 0.6, name, ha="center", va="center", fontweight="bold")
        symbol = name[0]
        dimension(ax, 3.05, top, bottom, f"$L_{symbol}$", at=0.3)
        _waves(ax, 0.5 * (top + bottom) - 0.1)
    ax.text(AXIS, 13.9, "rock", ha="center", va="center", fontweight="bold")
    dimension(ax, 3.05, PISTON[-1][1], BIT[0][0], "gap $g$")
    _forces(ax)
    arrow(ax, (0.5, 1.2), (0.5, 14.6), INK, linewidth=1.6)
    words = "positions, displacements, velocities: positive down"
    ax.text(0.15, 7.6, words, rotation=90, ha="center", va="center")
    ax.text(AXIS, 0.55, "sections: $L,\\ A,\\ E,\\ \\rho$ each", ha="center", va="center",
            color=NOTE)  # fmt: skip


def _rock(ax: Axes) -> None:
    """Draw the rock with its hole, the datum of the cycle and what is crushed below it."""
    left, right, low = 0.9, 10.6, 14.7
    end = BIT[-1][1]
    outline = [
        (left, SURFACE), (AXIS - HOLE, SURFACE), (AXIS - HOLE, DATUM), (AXIS - 1.35, DATUM),
        (AXIS - 1.35, end), (AXIS + 1.35, end), (AXIS + 1.35, DATUM), (AXIS + HOLE, DATUM),
        (AXIS + HOLE, SURFACE), (right, SURFACE), (right, low), (left, low),
    ]  # fmt: skip
    ax.add_patch(Polygon(outline, facecolor=ROCK, edgecolor="none"))
    ax.add_line(Line2D(*zip(*outline[:-2], strict=True), color=INK, linewidth=1.1))
    pressed = [(AXIS - 1.35, end), (AXIS + 1.35, end), (AXIS + 0.95, 13.2), (AXIS - 0.95, 13.2)]
    ax.add_patch(Polygon(pressed, facecolor=CRUSHED, edgecolor="none"))
    ax.plot([1.5, AXIS - 1.35], [DATUM, DATUM], ":", color=NOTE, linewidth=1.2)
    ax.plot([1.5, AXIS - 1.35], [end, end], ":", color=NOTE, linewidth=1.2)
    dimension(ax, 2.6, DATUM, end, "$p$")
    dimension(ax, 2.6, SURFACE, DATUM, "hole")
    ax.text(1.1, DATUM, "$x_R$", va="center", color=NOTE)
    ax.text(1.1, end, "$x_b$", va="center", color=NOTE)


def _waves(ax: Axes, y: float) -> None:
    """Draw the two waves in a bar."""
    for x, start, end, name, align in (
        (AXIS - 0.25, y - 0.45, y + 0.45, "$d$", "right"),
        (AXIS + 0.25, y + 0.45, y - 0.45, "$u$", "left"),
    ):
        arrow(ax, (x, start), (x, end), NOTE, linewidth=1.1, mutation_scale=8.0)
        side = -0.13 if align == "right" else 0.13
        ax.text(x + side, y, name, ha=align, va="center", color=NOTE)


def _forces(ax: Axes) -> None:
    """Draw the forces from outside right of the bodies, and those between them at their faces."""
    x = AXIS + 1.75
    arrow(ax, (x, 1.6), (x, 3.0), DRIVE, "<|-|>")
    ax.text(x + 0.25, 2.0, "drive $F_A = \\pm F_0$", va="center", color=DRIVE)
    ax.text(x + 0.25, 2.65, "turned by the pressure law", va="center", color=NOTE, fontsize=SMALL)
    arrow(ax, (x, 3.5), (x, 4.5), FORCE)
    ax.text(x + 0.25, 4.0, "weight $M_p G$", va="center", color=FORCE)
    arrow(ax, (x, 7.1), (x, 8.1), FORCE)
    ax.text(x + 0.25, 7.6, "feed force $F_S$, weight $M_b G$", va="center", color=FORCE)
    top, bottom = PISTON[-1][1], BIT[0][0]
    half = 0.5
    for side in (-half, half):
        arrow(ax, (AXIS + side, top + 0.42), (AXIS + side, top), FORCE)
        arrow(ax, (AXIS + side, bottom - 0.42), (AXIS + side, bottom), FORCE)
    ax.text(x + 0.25, 5.8, "contact force $F_C$", va="center", color=FORCE)
    ax.text(x + 0.25, 6.4, "on both faces, while $g = 0$", va="center", color=NOTE, fontsize=SMALL)
    end = BIT[-1][1]
    for side in (-0.9, 0.9):
        arrow(ax, (AXIS + side, end), (AXIS + side, end - 0.8), FORCE)
        arrow(ax, (AXIS + side, end), (AXIS + side, end + 0.8), FORCE)
    ax.text(x + 0.25, 12.0, "bit force $F_R$", va="center", color=FORCE)
    ax.text(x + 0.25, 12.6, "by the rock law", va="center", color=NOTE, fontsize=SMALL)
    ax.text(x + 0.25, 13.2, "compression is positive", va="center", color=NOTE, fontsize=SMALL)
    ax.text(x + 0.25, 8.75, "in the bars: $v = d + u$,  $F = Z\\,(d - u)$", va="center",
            color=NOTE)  # fmt: skip


def _drive_law(ax: Axes, scene: Scene) -> None:
    """Draw the drive's force over the relative displacement, as a run by rigid bodies has it."""
    simulation = Simulation(scene.computed_by("rigid"))
    samples = simulation.sample(np.arange(0.0, DRIVE_TIME, DRIVE_STEP))
    x, force = samples["relative_displacement"] * MM, samples["drive_force"] / KN
    strength, turn = scene.drive.force / KN, -scene.drive.reversal_distance * MM
    lifting = force < 0.0
    for chosen in (lifting, ~lifting):
        path = np.where(chosen, x, np.nan)
        ax.plot(path, np.where(chosen, force, np.nan), color=DRIVE, linewidth=2.2)
    for place in (turn, 0.0):
        ax.plot([place] * 2, [-strength, strength], "--", color=DRIVE, linewidth=1.1)
    arrow(ax, (turn, -0.4 * strength), (turn, 0.4 * strength), DRIVE)
    arrow(ax, (0.0, 0.4 * strength), (0.0, -0.4 * strength), DRIVE)
    ax.text(turn + 1.5, 0.35 * strength, "at $-D_1$ it turns down", va="center")
    ax.text(-1.5, -0.2 * strength, "at 0 it turns up", ha="right", va="center")
    ax.text(turn - 1.5, 0.72 * strength, "pushes down, $+F_0$", ha="right", va="center")
    ax.text(0.5 * turn, -0.72 * strength, "lifts, $-F_0$", ha="center", va="center")
    ax.set_ylim(-1.25 * strength, 1.25 * strength)
    style.label(ax, "piston relative to bit, $u_r$ [mm]", "drive force $F_A$ [kN]",
                "Drive: pressure law")  # fmt: skip


def _rock_law(ax: Axes, scene: Scene) -> None:
    """Draw the force over the way of the bit's end, as a rigid bit that falls has it."""
    fall = {"effects.drive": "none", "piston.model": "absent", "start.bit_velocity": 5.25}
    simulation = Simulation(scene.computed_by("rigid", **fall, **SHOWN_BARRIER))
    samples = simulation.sample(np.arange(0.0, DROP_TIME, DROP_STEP))
    mode, x = samples["drilling_mode"], samples["bit_end_position"] * MM
    x = x - scene.start.rock_gap * MM
    force = samples["bit_force"] / KN
    style.draw_by_mode(ax, x, force, mode)
    for line in ax.lines:
        line.set_linewidth(2.2)
    first = np.flatnonzero(np.diff((mode == Mode.DFC).astype(int)) == -1)[0] + 1
    inside = (mode[:first] == Mode.DFC).nonzero()[0]
    spring = scene.rock.loading_stiffness / KN / MM * x[inside]
    ax.fill_between(x[inside], spring, force[inside], color=MODE_COLOURS[Mode.DFC], alpha=0.3,
                    linewidth=0)  # fmt: skip
    _say(ax, x, force, mode)
    ax.set_xlim(-0.06, 1.12 * x.max())
    ax.set_ylim(-0.14 * force.max(), 1.12 * force.max())
    barrier = scene.rock.barrier_energy
    many = SHOWN_BARRIER["rock.barrier_energy"] / barrier
    name = f"Rock: two slopes and a barrier (here {many:.0f} times that of the reference)"
    style.label(ax, "displacement of the bit's end [mm]", "bit force $F_R$ [kN]", name)


def _say(ax: Axes, x: np.ndarray, force: np.ndarray, mode: np.ndarray) -> None:
    """Write beside the pieces of the path what they are."""
    peak = int(np.argmax(np.where(mode == Mode.FC, force, 0.0)))
    dfc = mode == Mode.DFC
    ax.annotate("barrier: the dashpot takes $W_R$", (x[dfc][0], force[dfc][0]), (12, 18),
                textcoords="offset points", color=INK)  # fmt: skip
    ax.annotate("slope $K_R$", (0.62 * x[peak], 0.62 * force[peak]), (8, -6),
                textcoords="offset points", va="top")  # fmt: skip
    ax.annotate("slope $\\gamma K_R$", (x[peak], force[peak]), (10, -4),
                textcoords="offset points", va="top")  # fmt: skip
    still = int(np.argmax(np.where(mode == Mode.SS, force, 0.0)))
    ax.annotate("it comes\nto rest", (x[still], force[still]), (8, 10), textcoords="offset points",
                va="bottom")  # fmt: skip
    ax.text(0.45 * x[peak], -0.07 * force.max(), "it flies and returns", ha="center", va="center")


def _modes(ax: Axes) -> None:
    """Write the modes with their stiffness and their ends, each in its colour."""
    blank(ax, 10.0, 6.0)
    rows = [("mode", "$K,\\ C$", "ends"), *((style.MODE_NAMES[m], *ENDS[m]) for m in ENDS)]
    colours = (None, *(MODE_COLOURS[m] for m in ENDS))
    for k, (row, colour) in enumerate(zip(rows, colours, strict=True)):
        y = k + 0.5
        if colour:
            ax.add_line(Line2D([0.0, 0.35], [y, y], color=colour, linewidth=3.0))
        for x, text in zip((0.5, 4.5, 6.0), row, strict=True):
            weight = "bold" if colour is None else "normal"
            ax.text(x, y, text, va="center", fontsize=SMALL, fontweight=weight)
