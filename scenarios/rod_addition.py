"""A new rod with and without a PI on the feed: `python -m scenarios.rod_addition`.

A rod brings its weight all at once, half a kilonewton at the start values. A rig that
keeps its force lets it rest on the bit; the PI takes it away.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from percussion_model.coupling import CoupledRun

from .coupled import FEED, draw_runs, held_since, run, write

NAME = "rod_addition"
DURATION = 4.0  # [s]
WAY = 0.015  # of the head to the new rod [m]
SHARE = 0.05  # the feed is back within this of what is wanted
LATE = 0.5  # the last part of a run, for means [s]
# Numbers as they are printed: words, factor, unit.
SHOWN = {
    "added": ("the rod comes at", 1.0, "s"),
    "weight": ("its weight", 1.0, "N"),
    "highest": ("highest feed afterwards, above what is wanted", 100.0, "%"),
    "back_after": ("feed within 5 % after", 1.0, "s"),
    "late_feed": ("mean feed at the end", 1.0, "N"),
}


def simulate(system: Path, duration: float = DURATION) -> dict[str, CoupledRun]:
    """Runs with the PI and with a force that stays."""
    return {
        name: run(system, duration, {"string.start.rod_left": WAY, "controller.pi.on": on})
        for name, on in (("PI on the feed", True), ("constant force", False))
    }


def numbers(found: CoupledRun) -> dict[str, float]:
    """What the new rod does.

    Returns
    -------
    dict
        added: when it came [s]; weight: step of the weight [N]; highest: of the feed after
        it, by what is wanted [1]; back_after: time until the feed stays within 5 % [s], not
        a number if it does not; late_feed: mean feed at the end [N].
    """
    time, feed = found["time"], found["string.feed_force_mean"]
    step = int(np.argmax(np.diff(found["string.rod_count"])))
    after = time > time[step]
    near = np.abs(feed[after] / FEED - 1.0) < SHARE
    return {
        "added": float(time[step + 1]),
        "weight": float(found["string.weight"][-1] - found["string.weight"][0]),
        "highest": float(feed[after].max() / FEED - 1.0),
        "back_after": held_since(time[after], near) - float(time[step + 1]),
        "late_feed": float(feed[time > time[-1] - LATE].mean()),
    }


def draw(runs: dict[str, CoupledRun], path: Path) -> Path:
    """Draw both runs."""
    return draw_runs(
        path,
        "A new rod: its weight rests on the bit unless the controller takes it away",
        runs,
        [
            ("weight of head, rods and casing [kN]", 1e-3, "string.weight"),
            ("force command to the rig [kN]", 1e-3, "controller.force_command"),
            ("feed force on the bit, filtered [kN]", 1e-3, "string.feed_force_mean"),
            ("rate of penetration, last blow [mm/s]", 1e3, "hammer.rate_of_penetration"),
        ],
        {"string.feed_force_mean": [(1e-3 * FEED, "wanted")]},
    )


if __name__ == "__main__":
    write(NAME, simulate, numbers, draw, SHOWN)
