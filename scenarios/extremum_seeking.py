"""A seeker finds the best feed from three starts: `python -m scenarios.extremum_seeking`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from percussion_model.coupling import CoupledRun, Coupling
from scenarios.harness import FIGURES, ROOT

STEP = 2e-3  # [s]: the longest at which the shoulder is as stiff as it is
DURATION = 40.0  # [s]
STARTS = (1700.0, 2500.0, 4200.0)  # [N]
# Feeds of the open-loop sweep [N], each held for so long, the first part for settling [s].
SWEEP = (1700.0, 2100.0, 2400.0, 2600.0, 2700.0, 2800.0, 2900.0, 3000.0, 3200.0, 3600.0, 4200.0)
HELD, SETTLING = 4.0, 2.0
LAST = 8.0  # the seeker's rate is that of its last seconds: four swings [s]


def _values(feed: float) -> dict[str, float]:
    """Setpoint and start of a run; the rig's force without drilling is feed less weights."""
    return {
        "controller.feed_setpoint": feed,
        "string.start.feed_force": feed,
        "controller.start.force": feed - 3800.0,
        "rig.start.force": feed - 3800.0,
    }


def rate_over(run: CoupledRun, since: float) -> float:
    """Mean rate of penetration after a time, by a straight line [m/s]."""
    if run.error:
        raise RuntimeError(run.error)
    late = run["time"] >= since
    return float(np.polyfit(run["time"][late], run["hammer.bit.position"][late], 1)[0])


def sweep(system: Path, feeds: Sequence[float] = SWEEP) -> np.ndarray:
    """Rates at constant feeds.

    Returns
    -------
    ndarray, shape (feeds, 2)
        Feed [N], rate of penetration [m/s].
    """
    rows = []
    for feed in feeds:
        values = {**_values(feed), "controller.seek.on": False}
        run = Coupling(system, values).run(HELD, STEP, interval=2 * STEP)
        mean = float(np.mean(run["string.feed_force_mean"][run["time"] >= SETTLING]))
        rows.append((mean, rate_over(run, SETTLING)))
    return np.array(rows)


def seek(system: Path, start: float, duration: float = DURATION) -> CoupledRun:
    """One run of the seeker from a feed [N]."""
    signals = ["controller.seek.centre", "controller.feed_wanted"]
    return Coupling(system, _values(start)).run(duration, STEP, signals, interval=0.02)


def draw(found: np.ndarray, runs: Sequence[CoupledRun], path: Path) -> Path:
    """Draw the hill and the ways up."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10.0, 4.2))
    axes[0].plot(1e-3 * found[:, 0], 1e3 * found[:, 1], "o-", label="constant feed")
    for run in runs:
        centre = run["controller.seek.centre"]
        label = f"from {1e-3 * centre[0]:.1f} kN"
        axes[1].plot(run["time"], 1e-3 * centre, label=label)
        rate = rate_over(run, run["time"][-1] - LAST)
        axes[0].plot(1e-3 * centre[-1], 1e3 * rate, "s", label=label)
    best = found[np.argmax(found[:, 1]), 0]
    axes[1].axhline(1e-3 * best, color="k", linewidth=0.7, linestyle="--")
    axes[0].set_xlabel("feed [kN]")
    axes[0].set_ylabel("rate [mm/s]")
    axes[1].set_xlabel("time [s]")
    axes[1].set_ylabel("centre of the swing [kN]")
    for ax in axes:
        ax.grid(alpha=0.3)
        ax.legend(fontsize="small")
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path


if __name__ == "__main__":
    archive = Path(sys.argv[1]) if sys.argv[1:] else ROOT / "dist" / "ExtremumSeekingRigid.ssp"
    hill = sweep(archive)
    ways = [seek(archive, start) for start in STARTS]
    print(np.round(hill * [1.0, 1e3], 3))
    for way in ways:
        rate = rate_over(way, DURATION - LAST)
        print(f"{way['controller.seek.centre'][-1]:.0f} N {1e3 * rate:.3f} mm/s")
    print(draw(hill, ways, FIGURES / "extremum_seeking.png"))
