"""The supply pressure breaks down and comes back: `python -m scenarios.pressure_loss`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .harness import Instance, command_line, ramp, run

DURATION, STEP = 2.4, 5e-3  # [s]
FULL, LEFT = 20e5, 8e5  # [Pa]
LOST, BACK = (0.7, 0.75), (1.6, 1.65)  # [s]
TITLE = "Loss of supply pressure"
PANELS = (
    ("supply pressure [bar]", 1e-5, "supply_pressure"),
    ("impact velocity [m/s]", 1, "impact_velocity"),
    ("blow energy [J]", 1, "blow_energy"),
    ("blow frequency [1/s]", 1, "blow_frequency"),
    ("rate of penetration, last blow [mm/s]", 1e3, "rate_of_penetration"),
)


def simulate(hammer: Path) -> dict[str, np.ndarray]:
    """Run the scenario; see `harness.run`. The pressure is in the table too."""
    pressure = ramp((LOST[0], FULL), (LOST[1], LEFT), (BACK[0], LEFT), (BACK[1], FULL))
    with Instance(hammer) as instance:
        found = run(instance.start(), DURATION, STEP, {"supply_pressure": pressure})
    found["supply_pressure"] = np.array([pressure(t) for t in found["time"]])
    return found


if __name__ == "__main__":
    command_line("pressure_loss", simulate, TITLE, PANELS)
