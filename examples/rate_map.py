"""Map of the rate of penetration over feed and pressure, with contours of efficiency.

Efficiency is the energy into the rock over a blow divided by the work of the drive. The rest of
the drive's work goes into structural loss. Feed and weight work on the rock too, so that a drill
of little power under much feed can come out above 100 %.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap

from examples.shared import GREY, command_line, figure_of, plain_ticks, study_points
from percussion_model import Scene
from percussion_model.analysis.study import Study, grid
from percussion_model.analysis.study.response import KINDS
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM

NAME = "rate_map"
# Gauge pressure at which an FMU of the reference has its drive force [Pa]; it sets the area.
PRESSURE = 20e5
AREA = Scene().drive.force / PRESSURE
BAR = 1e5
# Rates of aperiodic motion that are known no better, relative, are left blank.
MOST_ERROR = 0.1
MOST_BLOWS = 150


def drive_work(force: np.ndarray, distance: float, penetration: np.ndarray) -> np.ndarray:
    """Work of the pressure law on the piston over one blow [J].

    Between the two thresholds the piston goes up by D_1 against the bit and down
    again, pushed both times: 2 F_0 D_1. The bit advances while the drive points
    up, and the piston with it; at rest when it turns, to a ten-thousandth.
    """
    return force * (2.0 * distance - penetration)


def efficiency(found: Study) -> np.ndarray:
    """Energy into the rock by work of the drive, over a blow, at each point."""
    rows, force = found.rows, found.points.values[:, found.points.keys.index("drive.force")]
    distance = found.scene.drive.reversal_distance
    return rows["rock_energy"] / drive_work(force, distance, rows["penetration_per_blow"])


def main(out: Path, quick: bool = False) -> dict[str, Any]:
    """Map the rate over feed and pressure."""
    out = Path(out)
    feeds, pressures = (4, 3) if quick else (33, 26)
    feed = np.geomspace(500.0, 20e3, feeds)
    pressure = np.linspace(5.0 if quick else 2.5, 30.0 if quick else 40.0, pressures) * BAR
    points = grid({"feed.force": feed, "drive.force": pressure * AREA})
    found = study_points(points, out, quick, MOST_BLOWS)
    rows = found.rows.reshape(points.shape)
    share = efficiency(found).reshape(points.shape)
    unknown = ~(rows["rate_of_penetration_error"] < MOST_ERROR * rows["rate_of_penetration"])
    with figure_of(NAME, out, (7.6, 5.4)) as fig:
        ax = fig.subplots()
        x, y = feed / KN, pressure / BAR
        rate = np.where(unknown, np.nan, rows["rate_of_penetration"]) * MM
        mesh = ax.pcolormesh(x, y, rate.T, shading="nearest", cmap="viridis")
        fig.colorbar(mesh, ax=ax, label="rate of penetration [mm/s]")
        aperiodic = rows["kind"] != KINDS.index("periodic")
        cells = np.where(aperiodic, 1.0, np.nan).T
        clear = ListedColormap(["none"])
        ax.pcolor(x, y, cells, shading="nearest", cmap=clear, hatch="////", ec="black", lw=0.0)
        percent = np.where(aperiodic, np.nan, 100.0 * share)
        lines = ax.contour(
            x, y, percent.T, [85, 86, 88, 90, 95, 100], colors="white", linewidths=1.1
        )
        ax.clabel(lines, fmt="%g %%", fontsize=8.5)
        reference = Scene()
        ax.plot(reference.feed.force / KN, PRESSURE / BAR, "o", color="white", mec="black")
        ax.annotate("reference", (reference.feed.force / KN, PRESSURE / BAR), (-7, -3),
                    textcoords="offset points", color="white", ha="right")  # fmt: skip
        plain_ticks(ax, x)
        ax.grid(False)
        style.label(ax, "feed force [kN]", "supply pressure, gauge [bar]")
        style.head(fig, "Rate of penetration, and efficiency of the drive (white)")
        words = "hatched: no periodic motion; white: rate unknown"
        fig.text(0.99, 0.01, words, ha="right", color=GREY, fontsize=8.5)
    return {
        "points": len(points),
        "periodic": int(np.sum(~aperiodic)),
        "least_efficiency": float(np.min(share[~aperiodic])),
        "greatest_efficiency": float(np.max(share[~aperiodic])),
        "greatest_rate": float(np.nanmax(rate)) / MM,
    }


if __name__ == "__main__":
    command_line(main, NAME)
