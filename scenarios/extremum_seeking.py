"""A seeker finds the best feed from three starts: `python -m scenarios.extremum_seeking`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import cycle
from pathlib import Path

import numpy as np

from percussion_model.coupling import CoupledRun, Coupling
from percussion_model.interface.progress import progress
from percussion_model.simulation.uncertain import (
    ABOUT,
    UNDECIDED,
    change_text,
    in_digits,
    with_error,
)

from .coupled import save_runs, save_table, whole
from .drawing import in_style
from .results import command_line, system, tell

NAME = "extremum_seeking"
STEP = 2e-3  # the longest at which the shoulder is as stiff as it is [s]
ABOUT_STEP = (
    f"± is the error of the fit alone, and {ABOUT} stands before what has no error of its own. The "
    f"communication step of {1e3 * STEP:g} ms adds 1 to 2 % to a rate (docs/system.md, section 4), "
    "much alike in all of them."
)
INTERVAL = 0.02  # of the rows that are kept [s]
DURATION = 40.0  # [s]
STARTS = (1700.0, 2500.0, 4200.0)  # low, near and high [N]
# Feeds of the open-loop sweep [N], each held for so long, the first part for settling [s].
SWEEP = (
    1700.0, 2000.0, 2200.0, 2400.0, 2500.0, 2600.0, 2700.0, 2800.0, 2900.0, 3000.0, 3100.0,
    3200.0, 3300.0, 3400.0, 3600.0, 3900.0, 4200.0,
)  # fmt: skip
HELD, SETTLING = 6.0, 2.0
LAST = 8.0  # the seeker's rate is that of its last seconds: four swings [s]
BOUND = 0.03  # the seeker ends this near to the best rate
# The top is that of a quartic through the logarithms of the rates this near to the greatest.
NEAR, DEGREE = 0.2, 4
SIGNALS = ("hammer.blow_position", "hammer.blow_time", "controller.seek.centre",
           "controller.feed_wanted", "controller.seek.gradient")  # fmt: skip


def values(feed: float) -> dict[str, float]:
    """Setpoint and start of a run; the rig's force without drilling is feed less weights."""
    return {
        "controller.feed_setpoint": feed,
        "string.start.feed_force": feed,
        "controller.start.force": feed - 3800.0,
        "rig.start.force": feed - 3800.0,
    }


def rate_over(run: CoupledRun, since: float) -> float:
    """Rate of penetration over whole blows after a time [m/s]."""
    late = whole(run)["time"] >= since
    places, times = run["hammer.blow_position"][late], run["hammer.blow_time"][late]
    return float((places[-1] - places[0]) / (times[-1] - times[0]))


def sweep(
    archive: Path,
    feeds: Sequence[float] = SWEEP,
    held: float = HELD,
    settings: Mapping[str, float | bool] | None = None,
) -> np.ndarray:
    """Rates at constant feeds.

    Returns
    -------
    ndarray, shape (feeds, 2)
        Feed [N], rate of penetration [m/s].
    """
    rows = []
    for feed in feeds:
        chosen = {**values(feed), "controller.seek.on": False, **(settings or {})}
        run = Coupling(archive, chosen).run(held, STEP, SIGNALS, INTERVAL, tell=tell)
        mean = float(np.mean(run["string.feed_force_mean"][run["time"] >= SETTLING]))
        rows.append((mean, rate_over(run, SETTLING)))
    return np.array(rows)


def top_of(hill: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Top of a hill, between the feeds of the sweep: feed [N] and rate [m/s], and their errors.

    Parameters
    ----------
    hill : ndarray, shape (feeds, 2)
        See `sweep`.
    """
    greatest = hill[np.argmax(hill[:, 1]), 0]
    return with_jackknife(_fitted, hill[np.abs(np.log(hill[:, 0] / greatest)) <= NEAR])


def with_jackknife(
    top: Callable[[np.ndarray], Sequence[float]], hill: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of a hill, and their standard errors: how they move when one point is left out."""
    tops = np.array([top(np.delete(hill, k, axis=0)) for k in range(len(hill))])
    errors = np.sqrt((len(tops) - 1) / len(tops) * np.sum((tops - tops.mean(axis=0)) ** 2, axis=0))
    return np.array(top(hill)), errors


def _fitted(hill: np.ndarray) -> tuple[float, float]:
    """Feed [N] and rate [m/s] at the top of the curve through the points."""
    x = np.log(hill[:, 0])
    middle = x.mean()
    curve = np.polyfit(x - middle, np.log(hill[:, 1]), DEGREE)
    fine = np.linspace(x.min(), x.max(), 20_001) - middle
    heights = np.polyval(curve, fine)
    best = int(np.argmax(heights))
    return float(np.exp(fine[best] + middle)), float(np.exp(heights[best]))


def seek(
    archive: Path,
    start: float,
    duration: float = DURATION,
    settings: Mapping[str, float | bool] | None = None,
) -> CoupledRun:
    """One run of the seeker from a feed [N]."""
    chosen = {**values(start), **(settings or {})}
    return Coupling(archive, chosen).run(duration, STEP, SIGNALS, INTERVAL, tell=tell)


@in_style
def draw(hill: np.ndarray, runs: Sequence[CoupledRun], path: Path) -> Path:
    """Draw the hill and the ways up."""
    from matplotlib.figure import Figure

    from percussion_model.interface.plotting.style import head, label, save_png

    (best_feed, best_rate), _ = top_of(hill)
    figure = Figure(figsize=(11.0, 4.8), layout="constrained")
    axes = figure.subplots(1, 2)
    axes[0].plot(1e-3 * hill[:, 0], 1e3 * hill[:, 1], "o-", color="0.4", markersize=4,
                 label="feed held (open loop)")  # fmt: skip
    axes[0].axhspan((1.0 - BOUND) * 1e3 * best_rate, 1e3 * best_rate, color="#cfe8cf", zorder=0,
                    label=f"within {100 * BOUND:.0f} % of the best rate")  # fmt: skip
    for run, marker in zip(runs, cycle("s^o"), strict=False):
        centre = run["controller.seek.centre"]
        rate = rate_over(run, run["time"][-1] - LAST)
        words = f"from {1e-3 * centre[0]:.1f} kN: {100 * (rate / best_rate - 1.0):+.1f} %"
        (line,) = axes[1].plot(run["time"], 1e-3 * centre, label=f"from {1e-3 * centre[0]:.1f} kN")
        axes[0].plot(1e-3 * centre[-1], 1e3 * rate, marker, color=line.get_color(), label=words,
                     fillstyle="none", markersize=9)  # fmt: skip
    axes[1].axhline(1e-3 * best_feed, color="k", linewidth=0.9, linestyle="--",
                    label=f"best feed of the sweep, {1e-3 * best_feed:.2f} kN")  # fmt: skip
    label(axes[0], "feed force [kN]", "rate of penetration [mm/s]",
          "Where the seeker ends, its swing included")  # fmt: skip
    label(axes[1], "time [s]", "feed about which the seeker swings [kN]", "The way of the seeker")
    for ax in axes:
        ax.legend()
    head(figure, "Extremum seeking on the feed force")
    return save_png(figure, path, 110)


def main(paths: Sequence[Path], folder: Path) -> list[Path]:
    """Write figure and data, and print where the top is and where the seeker ends."""
    with progress("sweeping held feeds, then seeking"):
        hill = sweep(*paths)
        runs = {f"from {start:.0f} N": seek(*paths, start) for start in STARTS}
    top, errors = top_of(hill)
    print(f"best feed {with_error(top[0], errors[0])} N, "
          f"rate {with_error(1e3 * top[1], 1e3 * errors[1])} mm/s")  # fmt: skip
    print(ABOUT_STEP)
    for name, run in runs.items():
        rate = rate_over(run, DURATION - LAST)
        print(f"{name}: {about(run['controller.seek.centre'][-1])} N, "
              f"{reached(rate, top[1], errors[1])}")  # fmt: skip
    columns = ("feed_force", "rate_of_penetration")
    return write_search(NAME, folder, draw, hill, columns, runs)


def about(value: float) -> str:
    """A number of whose error nothing is known."""
    return f"{ABOUT}{in_digits(value)}"


def reached(rate: float, best: float, error: float) -> str:
    """Rate of a seeker, and by how much it is off the best one, which has an error [m/s]."""
    off = change_text(rate / best - 1.0, error / best, rough=True)
    off = f"{off} off the best rate" if off == UNDECIDED else f"{off} %"
    return f"{about(1e3 * rate)} mm/s, {off}"


def write_search(
    name: str,
    folder: Path,
    draw: Callable[[np.ndarray, list[CoupledRun], Path], Path],
    hill: np.ndarray,
    columns: Sequence[str],
    runs: Mapping[str, CoupledRun],
) -> list[Path]:
    """Write figure, sweep and runs of a search; return their files.

    Parameters
    ----------
    name : str
        Of the files.
    folder : Path
    draw : callable
        Draws hill and runs into a file.
    hill : ndarray, shape (points, columns)
    columns : sequence of str
        Of the hill.
    runs : mapping
        Runs by what the names of their files end with.
    """
    table = dict(zip(columns, hill.T, strict=True))
    return [
        draw(hill, list(runs.values()), folder / f"{name}.png"),
        save_table(table, folder / f"{name}_sweep.csv"),
        *save_runs(runs, name, folder),
    ]


if __name__ == "__main__":
    command_line(NAME, __doc__, [system("ExtremumSeekingRigid")], main)
