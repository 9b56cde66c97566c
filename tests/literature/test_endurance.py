"""An hour of drilling: minute after minute the same, and no digit lost to depth or time.

`python tests/literature/test_endurance.py` tells the figures of docs/data/stability_record.md.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
from pathlib import Path

import numpy as np
import pytest

from percussion_model import Scene, Simulation

MINUTE, HOUR = 60.0, 3600.0
# Share of the rate that minutes may differ by.
MOST_SPREAD = 3e-5
# What rounding alone does to a minute's rate: a trend below it in an hour is none.
ROUNDING = 1e-10
# A process that keeps its blows grows by their size (136 bytes, twice while they are
# joined); this much more, in bytes, is noise of the allocator.
NOISE_OF_MEMORY = 32e6


def resident():
    """Memory of this process [bytes]; NaN where the system does not tell."""
    path = Path("/proc/self/statm")
    if not path.exists():
        return math.nan
    return int(path.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def drill(duration, depth=0.0):
    """Blows of the reference, memory after every ten minutes, and the ledger."""
    simulation = Simulation(Scene().replace(**{"start.depth": depth}), record_events=False)
    simulation.advance(1.0)
    memory = [resident()]
    for end in np.arange(10 * MINUTE, duration + 1.0, 10 * MINUTE):
        simulation.advance(float(end))
        memory.append(resident())
    simulation.advance(duration)
    return simulation, np.array(memory)


def minute_rates(blows, first=1):
    """Rate of penetration over the whole blows that start within each minute [m/s]."""
    minutes = (blows["time"] // MINUTE).astype(int)
    rates = []
    for minute in range(first, minutes[-1]):
        rows = blows[minutes == minute]
        advance = rows["bit_position"][-1] + rows["penetration"][-1] - rows["bit_position"][0]
        rates.append(advance / (rows["time"][-1] + rows["period"][-1] - rows["time"][0]))
    return np.array(rates)


def trend(rates):
    """Slope over the minutes and its standard error, as shares of the mean rate a minute."""
    minutes = np.arange(len(rates)) - 0.5 * (len(rates) - 1)
    shares = rates / rates.mean() - 1.0
    slope = float(minutes @ shares / (minutes @ minutes))
    left = shares - slope * minutes
    error = math.sqrt(float(left @ left) / (len(rates) - 2) / float(minutes @ minutes))
    return slope, error


def missed(blows):
    """Blows that did not come when they were due: gaps and periods out of the ordinary."""
    gaps = blows["time"][:-1] + blows["period"][:-1] - blows["time"][1:]
    periods = blows["period"][blows["time"] > 1.0]
    odd = np.abs(periods / np.median(periods) - 1.0) > 0.02
    return int(np.sum(np.abs(gaps) > 1e-9)) + int(odd.sum())


def figures(simulation, memory):
    """Everything that is to be known of a long run."""
    blows = simulation.blows
    rates = minute_rates(blows)
    slope, error = trend(rates)
    with tempfile.TemporaryDirectory() as folder:
        files = simulation.result().save(folder)
        sizes = {path.name: path.stat().st_size for path in files}
    return {
        "blows": len(blows),
        "mean rate": float(rates.mean()),
        "spread of the minutes": float(np.ptp(rates) / rates.mean()),
        "trend a minute": slope,
        "standard error": error,
        "missed": missed(blows),
        "memory": memory.tolist(),
        "residual": simulation.energy()["residual_relative"],
        "files": sizes,
        "wall time": simulation.wall_time,
    }


@pytest.fixture(scope="module")
def ten_minutes():
    return drill(10 * MINUTE)


def check(found):
    """Hold a long run against what is promised."""
    assert found["spread of the minutes"] < MOST_SPREAD
    slope, error = abs(found["trend a minute"]), found["standard error"]
    assert slope < 2.0 * error or slope * 60.0 < ROUNDING
    assert found["missed"] == 0
    assert abs(found["residual"]) < 1e-6
    if not math.isnan(found["memory"][0]):
        assert np.ptp(found["memory"]) < NOISE_OF_MEMORY + 3 * 136 * found["blows"]
    assert sum(found["files"].values()) < 400 * found["blows"] + 100_000


def test_ten_minutes_of_drilling(ten_minutes):
    found = figures(*ten_minutes)
    assert found["blows"] == pytest.approx(10 * MINUTE / 0.0456, rel=3e-3)
    check(found)


@pytest.mark.slow
@pytest.mark.skipif("PERCUSSION_LONG" not in os.environ, reason="set PERCUSSION_LONG=1")
def test_an_hour_of_drilling():
    found = figures(*drill(HOUR))
    assert found["blows"] == pytest.approx(HOUR / 0.0456, rel=3e-3)
    check(found)


def test_micrometres_are_right_after_ten_minutes_as_at_the_start(ten_minutes):
    """Later blows of a periodic motion repeat the first ones but for rounding."""
    blows = ten_minutes[0].blows
    early, late = blows[100:200], blows[-100:]
    for name in ("penetration", "period", "stroke", "impact_velocity", "rock_energy"):
        np.testing.assert_allclose(late[name].mean(), early[name].mean(), rtol=1e-9)


def test_a_hole_of_sixty_metres_costs_no_digit():
    blows = [drill(5.0, depth)[0].blows.tobytes() for depth in (0.0, 60.0)]
    assert blows[0] == blows[1]


def test_what_is_not_periodic_is_seen(ten_minutes):
    """A lost blow and a drift of 1e-6 a minute are found by the measures above."""
    blows = ten_minutes[0].blows
    assert missed(blows) == 0
    assert missed(np.delete(blows, 1000)) > 0
    rates = minute_rates(blows)
    drifting = rates * (1.0 + 1e-6 * np.arange(len(rates)))
    slope, error = trend(drifting)
    assert slope == pytest.approx(1e-6, rel=1e-3)
    assert slope > 2.0 * error


if __name__ == "__main__":
    print(json.dumps(figures(*drill(HOUR)), indent=1))
