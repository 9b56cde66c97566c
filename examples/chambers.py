"""Pressure and ports of a hammer on air: p-V diagrams, efficiency, and the best port at given air.

Efficiency is the power of the blows by what the air consumed could do, m R T ln(p/p_a). A port edge
is tuned for most blow energy at the air of a compressor; pressure follows from both.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from examples.shared import BLUE, GREEN, GREY, ORANGE, command_line, figure_of, study_points
from percussion_model import simulate
from percussion_model.analysis.study import grid
from percussion_model.interface.plotting import style
from percussion_model.physics.gas import FREE_AIR
from percussion_model.scene.hammers import with_chambers
from percussion_model.simulation.means import air_work

NAME = "chambers"
BAR, LITRE, MM = 1e5, 1e-3, 1e3
SUPPLY, EDGE = "pneumatic.supply_pressure", "pneumatic.upper_intake_edge"
# A feed that holds the casing at the greatest pressure: what lifts takes less air.
SCENE = with_chambers("dth5", 24 * BAR).replace(**{"feed.force": 20e3})
# Air of compressors [m^3/s of free air], and the most pressure that they give [Pa].
COMPRESSORS = {12.0 / 60.0: GREEN, 16.0 / 60.0: ORANGE, 20.0 / 60.0: BLUE}
MOST_PRESSURE = 25 * BAR
MOST_BLOWS = 150
# Of p-V diagrams [s].
STEP = 1e-5


def diagrams() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Volume [m^3] and pressure [Pa] of both chambers over the last blow of a short run."""
    # pressures are told once in a step
    fine = {"pneumatic.step": STEP, "run.error_estimate": False}
    run = simulate(SCENE.replace(**fine), 0.5, trace=STEP)
    assert run.trace is not None
    time, blow = run.trace["time"], run.blows[-1]
    of_blow = (time >= blow["time"]) & (time <= blow["time"] + blow["period"])
    x = -run.trace["relative_displacement"][of_blow]
    volumes = {
        "upper": SCENE["pneumatic.upper_volume"] - SCENE["pneumatic.upper_area"] * x,
        "lower": SCENE["pneumatic.lower_volume"] + SCENE["pneumatic.lower_area"] * x,
    }
    return {n: (v, run.trace[f"pneumatic_{n}_pressure"][of_blow]) for n, v in volumes.items()}


def indicated_work(volume: np.ndarray, pressure: np.ndarray) -> float:
    """Work of a chamber over a blow: the area of its loop [J]."""
    return float(np.trapezoid(np.append(pressure, pressure[0]), np.append(volume, volume[0])))


def efficiency(rows: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Power of the blows by that of the air, at each point of a study."""
    ambient = SCENE["pneumatic.ambient_pressure"], SCENE["pneumatic.ambient_temperature"]
    work = np.array([air_work(p, *ambient) for p in pressure.ravel()]).reshape(pressure.shape)
    return rows["blow_energy"] / (rows["blow_period"] * rows["pneumatic_air"] * work)


def at_air(air: float, pressure: np.ndarray, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Pressure, energy and rate for each edge where the hammer takes this air [m^3/s], else NaN."""
    names = ("blow_energy", "rate_of_penetration")
    found = {name: np.full(rows.shape[1], np.nan) for name in ("pressure", *names)}
    for k, column in enumerate(rows.T):
        known = column["pneumatic_air"] / FREE_AIR
        if known[0] <= air <= known[-1] and np.all(np.diff(known) > 0.0):
            found["pressure"][k] = p = np.interp(air, known, pressure)
            for name in names:
                found[name][k] = np.interp(p, pressure, column[name])
    return found


def main(out: Path, quick: bool = False) -> dict[str, Any]:
    """Draw p-V diagrams, map efficiency over pressure and a port edge, and tune the edge."""
    out = Path(out)
    pressure = np.linspace(8.0, 34.0, 4 if quick else 27) * BAR
    edge = np.linspace(36.0, 94.0, 5 if quick else 30) / MM
    found = study_points(grid({SUPPLY: pressure, EDGE: edge}), out, quick, MOST_BLOWS, SCENE)
    rows = found.rows.reshape(len(pressure), len(edge))
    share = efficiency(rows, np.repeat(pressure[:, np.newaxis], len(edge), axis=1))
    loops = diagrams()
    tuned = {air: at_air(air, pressure, rows) for air in COMPRESSORS}
    with figure_of(NAME, out, (10.2, 5.0)) as fig:
        cells = fig.add_gridspec(2, 3, width_ratios=(0.9, 1.25, 1.1))
        for k, (name, loop) in enumerate(loops.items()):
            _draw_loop(fig.add_subplot(cells[k, 0]), name, loop)
        ax = fig.add_subplot(cells[:, 1])
        mesh = ax.pcolormesh(edge * MM, pressure / BAR, 100.0 * share, shading="nearest")
        fig.colorbar(mesh, ax=ax, label="efficiency [%]")
        air = rows["pneumatic_air"] / FREE_AIR * 60.0
        lines = ax.contour(edge * MM, pressure / BAR, air, [8, 12, 16, 20, 24, 28], colors="white")
        ax.clabel(lines, fmt="%g m³/min", fontsize=8.0)
        ax.plot(SCENE[EDGE] * MM, SCENE[SUPPLY] / BAR, "o", color="white", mec="black")
        ax.grid(False)
        title = "Blow power / air power; free air (white)"
        style.label(ax, "upper intake opens at [mm]", "supply pressure, gauge [bar]", title)
        _draw_tuned(fig.add_subplot(cells[:, 2]), edge, tuned)
        style.head(fig, "A 5-inch hammer on air: what its chambers do, and where a port is best")
    return _told(loops, edge, tuned) | {
        "points": len(found.rows), "least_efficiency": float(np.nanmin(share)),
        "greatest_efficiency": float(np.nanmax(share)),
    }  # fmt: skip


def _told(
    loops: Any, edge: np.ndarray, tuned: dict[float, dict[str, np.ndarray]]
) -> dict[str, Any]:
    """Indicated works, and for each compressor the fitted edge and the best within its pressure."""
    told: dict[str, Any] = {
        "indicated_work": {n: indicated_work(*loop) for n, loop in loops.items()}
    }
    for air, found in tuned.items():
        energy = np.where(found["pressure"] <= MOST_PRESSURE, found["blow_energy"], -np.inf)
        best = int(np.argmax(energy))
        fitted = {key: float(np.interp(SCENE[EDGE], edge, values)) for key, values in found.items()}
        chosen = {"edge": float(edge[best])} | {key: float(v[best]) for key, v in found.items()}
        told[f"at_{60.0 * air:.0f}_m3_min"] = {"fitted": fitted, "best": chosen}
    return told


def _draw_loop(ax: Axes, name: str, loop: tuple[np.ndarray, np.ndarray]) -> None:
    volume, pressure = loop
    ax.plot(volume / LITRE, pressure / BAR, color=BLUE)
    told = f"net work {indicated_work(*loop):.0f} J"
    ax.text(0.97, 0.92, told, ha="right", va="top", transform=ax.transAxes)
    style.label(ax, "volume [l]", "pressure, absolute [bar]", f"{name.capitalize()} chamber")


def _draw_tuned(ax: Axes, edge: np.ndarray, tuned: dict[float, dict[str, np.ndarray]]) -> None:
    for air, colour in COMPRESSORS.items():
        energy, pressure = tuned[air]["blow_energy"], tuned[air]["pressure"]
        ax.plot(edge * MM, energy, "--", color=colour, lw=1.0)
        within = np.where(pressure <= MOST_PRESSURE, energy, np.nan)
        ax.plot(edge * MM, within, color=colour, lw=2.0, label=f"{60.0 * air:.0f} m³/min")
    ax.plot([], [], "--", color=GREY, lw=1.0, label=f"above {MOST_PRESSURE / BAR:.0f} bar")
    ax.axvline(SCENE[EDGE] * MM, color=GREY, lw=0.8, ls=":", label="as fitted")
    ax.legend(loc="lower right")
    style.label(
        ax, "upper intake opens at [mm]", "energy of a blow [J]", "At the air of a compressor"
    )


if __name__ == "__main__":
    command_line(main, NAME)
