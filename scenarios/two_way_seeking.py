"""A seeker finds the best feed and pressure at once: `python -m scenarios.two_way_seeking`.

Two swings at different frequencies, one on the feed and one on the supply pressure, each told
from the other by its frequency. The top is known from an open-loop sweep over both.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np

from percussion_model.coupling import CoupledRun, Coupling
from percussion_model.interface.progress import progress
from percussion_model.simulation.uncertain import with_error

from .drawing import in_style
from .extremum_seeking import (
    ABOUT_STEP,
    BOUND,
    INTERVAL,
    SETTLING,
    SIGNALS,
    STEP,
    about,
    rate_over,
    reached,
    with_jackknife,
    write_search,
)
from .results import command_line, system, tell

NAME = "two_way_seeking"
DURATION = 45.0  # [s]
LAST = 9.0  # the seeker's rate is that of its last seconds: three periods [s]
STARTS = ((2000.0, 1.3e6), (3800.0, 2.4e6), (3800.0, 1.3e6))  # [N], [Pa]
FEEDS = (2400.0, 2600.0, 2800.0, 3000.0, 3200.0)  # of the sweep [N]
PRESSURES = (1.6e6, 1.75e6, 1.9e6, 2.05e6, 2.2e6)  # of the sweep [Pa]
HELD = 4.0  # [s]
DEGREE = 3  # of the surface through the logarithms of the rates
# The drive's reaction on the casing by the pressure at the reference [m^2], weights [N].
REACTION, WEIGHTS = 0.93e-3, 5660.0


def values(feed: float, pressure: float) -> dict[str, float]:
    """Setpoints and start of a run, in balance."""
    force = feed + REACTION * pressure - WEIGHTS
    return {
        "controller.feed_setpoint": feed, "string.start.feed_force": feed,
        "controller.pressure_setpoint": pressure, "supply.start.pressure": pressure,
        "controller.start.force": force, "rig.start.force": force,
    }  # fmt: skip


def sweep(
    archive: Path, feeds: Sequence[float] = FEEDS, pressures: Sequence[float] = PRESSURES
) -> np.ndarray:
    """Rates at constant feeds and pressures.

    Returns
    -------
    ndarray, shape (feeds x pressures, 3)
        Feed [N], pressure that is asked for [Pa], rate of penetration [m/s].
    """
    rows = []
    for feed, pressure in product(feeds, pressures):
        chosen = {**values(feed, pressure), "controller.seek.on": False}
        run = Coupling(archive, chosen).run(HELD, STEP, SIGNALS, INTERVAL, tell=tell)
        rows.append((feed, pressure, rate_over(run, SETTLING)))
    return np.array(rows)


def seek(archive: Path, start: tuple[float, float], duration: float = DURATION) -> CoupledRun:
    """One run of the seeker from a feed [N] and a pressure [Pa]."""
    signals = [*SIGNALS, "controller.seek.pressure_centre", "controller.seek.pressure_gradient"]
    return Coupling(archive, values(*start)).run(duration, STEP, signals, INTERVAL, tell=tell)


def surface(hill: np.ndarray, feeds: np.ndarray, pressures: np.ndarray) -> np.ndarray:
    """Smooth rates through those of a sweep.

    Returns
    -------
    ndarray, shape (feeds, pressures)
        [m/s]
    """
    middle = np.log(hill[:, :2]).mean(axis=0)
    powers = [(i, j) for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)]

    def columns(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.stack([x**i * y**j for i, j in powers], axis=-1)

    x, y = (np.log(hill[:, :2]) - middle).T
    found = np.linalg.lstsq(columns(x, y), np.log(hill[:, 2]), rcond=None)[0]
    x, y = np.meshgrid(np.log(feeds) - middle[0], np.log(pressures) - middle[1], indexing="ij")
    return np.exp(columns(x, y) @ found)


def top_of(hill: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Top of a hill within its sweep, and standard errors of the jackknife.

    Returns
    -------
    top, errors : ndarray, shape (3,)
        Feed [N], pressure [Pa], rate [m/s].
    """
    return with_jackknife(_top, hill)


def _axes(hill: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    low, high = hill[:, :2].min(axis=0), hill[:, :2].max(axis=0)
    return np.linspace(low[0], high[0], 201), np.linspace(low[1], high[1], 201)


def _top(hill: np.ndarray) -> tuple[float, float, float]:
    feeds, pressures = _axes(hill)
    rates = surface(hill, feeds, pressures)
    i, j = np.unravel_index(np.argmax(rates), rates.shape)
    return float(feeds[i]), float(pressures[j]), float(rates[i, j])


@in_style
def draw(hill: np.ndarray, runs: Sequence[CoupledRun], path: Path) -> Path:
    """Draw the hill from above with the ways up, and both centres over time."""
    from matplotlib.figure import Figure

    from percussion_model.interface.plotting.style import head, label, save_png

    top, _ = top_of(hill)
    feeds, pressures = _axes(hill)
    figure = Figure(figsize=(11.0, 5.2), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.25, 1.0))
    above = figure.add_subplot(grid[:, 0])
    rates = 1e3 * surface(hill, feeds, pressures).T
    filled = above.contourf(1e-3 * feeds, 1e-5 * pressures, rates, 12, cmap="Greys", alpha=0.6)
    figure.colorbar(filled, ax=above, label="rate of penetration, held (open loop) [mm/s]")
    above.grid(False)
    above.plot(1e-3 * hill[:, 0], 1e-5 * hill[:, 1], "k.", markersize=3, label="sweep")
    over_time = [figure.add_subplot(grid[k, 1]) for k in range(2)]
    for run in runs:
        centres = run["controller.seek.centre"], run["controller.seek.pressure_centre"]
        rate = rate_over(run, run["time"][-1] - LAST)
        words = (f"from {1e-3 * centres[0][0]:.1f} kN, {1e-5 * centres[1][0]:.0f} bar: "
                 f"{100 * (rate / top[2] - 1.0):+.1f} %")  # fmt: skip
        (line,) = above.plot(1e-3 * centres[0], 1e-5 * centres[1], label=words, linewidth=1.4)
        above.plot(1e-3 * centres[0][-1], 1e-5 * centres[1][-1], "D", color=line.get_color())
        for ax, factor, centre in zip(over_time, (1e-3, 1e-5), centres, strict=True):
            ax.plot(run["time"], factor * centre, color=line.get_color())
    above.plot(1e-3 * top[0], 1e-5 * top[1], "k*", markersize=13, label="top of the sweep")
    for ax, level in zip(over_time, (1e-3 * top[0], 1e-5 * top[1]), strict=True):
        ax.axhline(level, color="k", linewidth=0.9, linestyle="--")
    label(over_time[0], "", "feed [kN]", "Centres of the swings; dashed: best of the sweep")
    label(over_time[1], "time [s]", "pressure [bar]", "")
    label(above, "feed force [kN]", "supply pressure that is asked for [bar]",
          "Ways over the hill; rate at the end by the best one")  # fmt: skip
    head(figure, "Extremum seeking on feed and pressure at once")
    handles, labels = above.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5)
    return save_png(figure, path, 110)


def main(paths: Sequence[Path], folder: Path) -> list[Path]:
    """Write figure and data, and print where the top is and where the seeker ends."""
    (archive,) = paths
    with progress("sweeping held feeds and pressures, then seeking"):
        hill = sweep(archive)
        runs = {
            f"from {feed:.0f} N {1e-5 * p:.0f} bar": seek(archive, (feed, p)) for feed, p in STARTS
        }
    top, errors = top_of(hill)
    print(f"best feed {with_error(top[0], errors[0])} N, "
          f"pressure {with_error(1e-5 * top[1], 1e-5 * errors[1])} bar, "
          f"rate {with_error(1e3 * top[2], 1e3 * errors[2])} mm/s; "
          f"the seeker is to be within {100 * BOUND:.0f} %")  # fmt: skip
    print(ABOUT_STEP)
    for name, run in runs.items():
        rate = rate_over(run, DURATION - LAST)
        print(f"{name}: {about(run['controller.seek.centre'][-1])} N, "
              f"{about(1e-5 * run['controller.seek.pressure_centre'][-1])} bar, "
              f"{reached(rate, top[2], errors[2])}")  # fmt: skip
    columns = ("feed_force", "supply_pressure", "rate_of_penetration")
    return write_search(NAME, folder, draw, hill, columns, runs)


if __name__ == "__main__":
    command_line(NAME, __doc__, [system("TwoWaySeekingRigid")], main)
