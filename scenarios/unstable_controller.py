"""A PI that is too fast for its loop, and what shows it: `python -m scenarios.unstable_controller`.

The feed is measured through a filter of 0.1 s, and the rig's servo takes 20 ms more. A PI
that asks for more than this delay allows swings up, from the knocks of the blows alone, until
the valve of the rig gives its full flow both ways and the feed is beyond its limit in one half
of the swing. All else of the controller is off, so that nothing hides it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from percussion_model.coupling import CoupledRun
from percussion_model.coupling.bench import HIGHEST_FEED, STANDARD_RUNS, judge

from .coupled import FEED, draw_runs, run, write

NAME = "unstable_controller"
DURATION = 5.0  # [s]
WINDOW = 0.25  # in which a swing is measured [s]
PI_ALONE = {"controller.cutback.on": False, "controller.retract.on": False}
CONTROLLERS = {
    "as it ships: gain 0.5, 0.2 s": PI_ALONE,
    "unstable: gain 2, 0.1 s": {**PI_ALONE, "controller.pi.gain": 2.0, "controller.pi.time": 0.1},
}
# Numbers as they are printed: words, factor, unit.
SHOWN = {
    "growth": ("growth of the swing of the feed", 1.0, "1/s"),
    "first_swing": ("first swing", 1.0, "N"),
    "greatest_swing": ("greatest swing", 1.0, "N"),
    "points": ("points of the bench", 1.0, "of 100"),
    "overshoot": ("highest feed, above what is wanted", 100.0, "%"),
    "time_off_bottom": ("time off the bottom", 1.0, "s"),
    "violations": ("time beyond the limits of feed and torque", 1.0, "s"),
}


def simulate(system: Path, duration: float = DURATION) -> dict[str, CoupledRun]:
    """The feed PI as it ships, and one that is too fast."""
    return {name: run(system, duration, values) for name, values in CONTROLLERS.items()}


def swings(found: CoupledRun, window: float = WINDOW) -> np.ndarray:
    """Half of the range of the feed in successive windows [N].

    Returns
    -------
    ndarray, shape (windows,)
    """
    time, feed = found["time"], found["string.feed_force_mean"]
    count = int(time[-1] / window)
    return np.array([
        0.5 * np.ptp(feed[(time >= k * window) & (time < (k + 1) * window)]) for k in range(count)
    ])  # fmt: skip


def growth(sizes: np.ndarray, window: float = WINDOW) -> float:
    """Rate at which a swing grows up to half of its greatest size, or falls over all of it [1/s].

    Parameters
    ----------
    sizes : ndarray, shape (windows,)
        Of the swing in successive windows.
    """
    top = int(np.argmax(sizes >= 0.5 * sizes.max()))
    rising = sizes[: top + 1] if top >= 2 else sizes
    return float(np.polyfit(window * np.arange(len(rising)), np.log(rising), 1)[0])


def numbers(found: CoupledRun) -> dict[str, float]:
    """What shows instability: growth of the swing, and the bench's scores.

    Returns
    -------
    dict
        growth [1/s]; first and greatest swing [N]; those of `percussion bench-controller`.
    """
    sizes = swings(found)
    score = judge(STANDARD_RUNS[0], found)
    return {
        "growth": growth(sizes), "first_swing": float(sizes[0]),
        "greatest_swing": float(sizes.max()), "points": score.points,
        **{name: score.numbers[name] for name in ("overshoot", "time_off_bottom", "violations")},
    }  # fmt: skip


def draw(runs: dict[str, CoupledRun], path: Path) -> Path:
    """Draw both runs."""
    return draw_runs(
        path,
        "A controller that is too fast for its loop swings up",
        runs,
        [
            ("feed force on the bit, filtered [kN]", 1e-3, "string.feed_force_mean"),
            ("force command to the rig [kN]", 1e-3, "controller.force_command"),
            ("valve of the rig at its full flow (1 is yes) [-]", 1.0, "rig.limited"),
            ("depth of the bit [mm]", 1e3, "hammer.bit.position"),
        ],
        {
            "string.feed_force_mean": [
                (1e-3 * FEED, "wanted"), (1e-3 * HIGHEST_FEED, "violation above")
            ],
        },
    )  # fmt: skip


if __name__ == "__main__":
    write(NAME, simulate, numbers, draw, SHOWN)
