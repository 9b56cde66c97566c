"""Collaring: feed and pressure are low, then rise: `python -m scenarios.collaring_ramp`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .harness import Instance, command_line, ramp, run

DURATION, STEP = 2.4, 5e-3  # [s]
LOW, HIGH = 0.8, 1.6  # the ramp begins and ends [s]
FEED = 500.0, 2500.0  # [N]
PRESSURE = 5e5, 20e5  # [Pa]
TITLE = "Collaring: feed and supply pressure rise"
PANELS = (
    ("supply pressure [bar]", 1e-5, "supply_pressure"),
    ("feed force [kN]", 1e-3, "feed_force"),
    ("blow energy [J]", 1, "blow_energy"),
    ("blow frequency [1/s]", 1, "blow_frequency"),
    ("rate of penetration, last blow [mm/s]", 1e3, "rate_of_penetration"),
    ("depth of the bit [mm]", 1e3, "bit.position"),
)


def signals() -> dict:
    """Feed force and supply pressure over time."""
    return {
        "feed_force": ramp((LOW, FEED[0]), (HIGH, FEED[1])),
        "supply_pressure": ramp((LOW, PRESSURE[0]), (HIGH, PRESSURE[1])),
    }


def simulate(hammer: Path) -> dict[str, np.ndarray]:
    """Run the scenario; see `harness.run`. The inputs are in the table too."""
    wanted = signals()
    with Instance(hammer) as instance:
        instance.start(**{name: signal(0.0) for name, signal in wanted.items()})
        found = run(instance, DURATION, STEP, wanted)
    for name, signal in wanted.items():
        found[name] = np.array([signal(t) for t in found["time"]])
    return found


if __name__ == "__main__":
    command_line("collaring_ramp", simulate, TITLE, PANELS)
