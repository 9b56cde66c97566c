"""Length and step of a piston that bring a blow into the rock best.

A single blow of given energy, without a drive. What counts is what stays in the rock once
the bit is at rest: crushing and barrier, not what springs back.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from examples.shared import BLACK, BLUE, GREEN, GREY, ORANGE, command_line, figure_of
from percussion_model import Scene, Simulation, settled
from percussion_model.interface.plotting import style
from percussion_model.simulation.uncertain import in_few_characters

NAME = "drill_design"
ENERGY = 250.0  # of the blow [J], about that of the reference
AT_REST = 20e-3  # when the bit has come to rest [s]
STIFFNESSES = {2.5e8: GREEN, 7.5e8: BLUE, 2.25e9: ORANGE}  # K_R [N/m]
REFERENCE = Scene()
BIT = REFERENCE.bit.sections[0]
CELLS = 20  # modes of the bit; the piston gets as many for its length
# The piston that is stepped, by the bit's length; its mass stays, so that the speed does.
STEPPED_RATIO = 2.0
SHARES = {"rock": BLUE, "loss": ORANGE, "piston": GREY}  # what takes or keeps energy


def design(sections: list[tuple[float, float]], stiffness: float) -> Scene:
    """Scene with a piston of sections (length by the bit's, area by the bit's), top to bottom."""
    piston = [{"length": x * BIT.length, "area": a * BIT.area} for x, a in sections]
    cells = round(CELLS * sum(x for x, _ in sections))
    return REFERENCE.replace(
        **{"piston.sections": piston, "rock.loading_stiffness": stiffness, "solver.cells": cells}
    )


def stepped(share: float, areas: float) -> list[tuple[float, float]]:
    """Sections of a piston whose lower end, a share of its length, has `areas` times the area."""
    upper = 1.0 / (1.0 - share + share * areas)
    return [(STEPPED_RATIO * (1.0 - share), upper), (STEPPED_RATIO * share, upper * areas)]


def single_blow(scene: Scene) -> dict[str, float]:
    """Shares of a blow's energy that rock and structural loss take and that the piston keeps."""
    speed = math.sqrt(2.0 * ENERGY / scene.piston.mass)
    changes = {"effects.drive": "none", "start.piston_velocity": speed, "start.rock_gap": 0.0}
    simulation = Simulation(scene.replace(**changes), record_events=False)
    simulation.advance(AT_REST)
    energy = simulation.energy()
    rock = sum(energy[name] for name in ("crushing", "barrier", "standstill"))
    found = {"rock": rock / ENERGY, "loss": energy["loss"] / ENERGY}
    return found | {"piston": 1.0 - sum(found.values())}


def contact_stress(scene: Scene) -> float:
    """Greatest stress of the first wave in the end of the piston [Pa] (docs/model.md, eq. 11)."""
    end, bit = scene.piston.sections[-1], scene.bit.sections[0]
    speed = math.sqrt(2.0 * ENERGY / scene.piston.mass)
    return speed / (1.0 / end.impedance + 1.0 / bit.impedance) / end.area


def first_wave(ratio: np.ndarray, stiffness: float) -> np.ndarray:
    """Share that the first wave leaves in the rock (docs/model.md, section 12, oracle 6)."""
    beta = 2.0 * stiffness * ratio * BIT.length / (BIT.youngs_modulus * BIT.area)
    kept = 1.0 - 1.0 / REFERENCE.rock.unloading_ratio
    return kept * 2.0 * (1.0 - np.exp(-beta)) ** 2 / beta


def main(out: Path, quick: bool = False) -> dict[str, Any]:
    """Draw shares of a blow's energy over piston length and over steps of the piston."""
    stiffness = REFERENCE.rock.loading_stiffness
    ratio = np.arange(10, 81, 35 if quick else 1) / CELLS
    rock = {
        k: np.array([single_blow(design([(x, 1.0)], k))["rock"] for x in ratio.tolist()])
        for k in ([stiffness] if quick else STIFFNESSES)
    }
    share = np.array([0.25, 0.75]) if quick else np.arange(2, 39, 2) / 40
    areas = np.geomspace(0.25, 4.0, 3 if quick else 17)
    steps = np.array(
        [[single_blow(design(stepped(s, a), stiffness))["rock"] for s in share] for a in areas]
    )
    best = np.unravel_index(np.argmax(steps), steps.shape)
    found = float(share[best[1]]), float(areas[best[0]])
    designs = {
        "reference": REFERENCE,
        f"uniform, {STEPPED_RATIO:g} bits": design([(STEPPED_RATIO, 1.0)], stiffness),
        "stepped, best": design(stepped(*found), stiffness),
    }
    blows = {name: single_blow(scene) for name, scene in designs.items()}
    motions = {name: settled(scene, error_estimate=True) for name, scene in designs.items()}
    rates = {name: found.rate_of_penetration for name, found in motions.items()}
    errors = {name: found.rate_of_penetration_error for name, found in motions.items()}
    shown = {k: in_few_characters(1e3 * rates[k], 1e3 * errors[k], 1e-3) for k in rates}
    stress = {name: contact_stress(scene) for name, scene in designs.items()}
    with figure_of(NAME, Path(out), (10.2, 5.0)) as fig:
        left, middle, right = fig.subplots(1, 3, width_ratios=(1.15, 1.15, 1.0))
        _draw_lengths(left, ratio, rock)
        mesh = middle.pcolormesh(share, areas, 100 * steps, cmap="viridis", shading="nearest")
        fig.colorbar(mesh, ax=middle, label="energy in the rock [%]")
        middle.plot(*found, "*", color="white", mec="black", ms=13)
        middle.set_yscale("log")
        middle.set_yticks([0.25, 0.5, 1, 2, 4], ["¼", "½", "1", "2", "4"])
        middle.minorticks_off()
        middle.grid(False)
        title = f"Piston of {STEPPED_RATIO:g} bit lengths, stepped"
        style.label(middle, "lower section / whole [-]", "its area / that above [-]", title)
        _draw_designs(right, blows, shown, stress)
        style.head(fig, f"Where {ENERGY:g} J of a blow go")
    return {"blows": blows, "rates": rates, "rate_errors": errors, "stress": stress, "best": found}


def _draw_lengths(ax: Axes, ratio: np.ndarray, rock: dict[float, np.ndarray]) -> None:
    for stiffness, found in rock.items():
        colour = STIFFNESSES[stiffness]
        ax.plot(ratio, 100.0 * found, color=colour, label=f"$K_R$ = {stiffness * 1e-6:g} kN/mm")
        ax.plot(ratio, 100.0 * first_wave(ratio, stiffness), color=colour, ls="--", lw=1.0)
    ax.plot([], [], color=BLACK, ls="--", lw=1.0, label="first wave alone")
    ax.axvline(REFERENCE.piston.length / BIT.length, color=GREY, lw=0.8, ls=":", label="reference")
    ax.set_ylim(0.0, 100.0)
    ax.legend(loc="lower right")
    style.label(ax, "length of piston / bit [-]", "energy in the rock [%]", "Uniform piston")


def _draw_designs(
    ax: Axes, blows: dict[str, dict[str, float]], rates: dict[str, str], stress: dict[str, float]
) -> None:
    # lying bars: their labels are wide, and have a line each
    base = np.zeros(len(blows))
    for name, colour in SHARES.items():
        width = np.array([100.0 * blow[name] for blow in blows.values()])
        ax.barh(range(len(blows)), width, left=base, color=colour, label=name, height=0.65)
        for k, value in enumerate(width):
            ax.text(base[k] + value / 2, k, f"{value:.0f}", ha="center", va="center", color="white")
        base += width
    words = [f"{name}\n{rates[name]} mm/s\n{1e-6 * stress[name]:.0f} MPa" for name in blows]
    ax.set_yticks(range(len(blows)), words)
    ax.grid(axis="y", visible=False)
    ax.set_xlim(0.0, 100.0)
    ax.set_ylim(len(blows) - 0.5, -0.9)
    ax.legend(loc="upper center", ncols=3, columnspacing=1.0)
    style.label(ax, "energy of the blow [%]", "", "Designs: rate, stress")


if __name__ == "__main__":
    command_line(main, NAME)
