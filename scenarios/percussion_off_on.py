"""Percussion is switched off and on again: `python -m scenarios.percussion_off_on`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .harness import Instance, command_line, run

DURATION, STEP = 2.4, 5e-3  # [s]
# Switched off near the top of a stroke: in the ideal pressure law nothing but weight
# would bring a piston back that is on its way up.
OFF, ON = 0.62, 1.6  # [s]
TITLE = "Percussion off and on"
PANELS = (
    ("casing force [kN]", 1e-3, "casing_force"),
    ("position [mm]", 1e3, "piston.position", "bit.position"),
    ("blow frequency [1/s]", 1, "blow_frequency"),
    ("rate of penetration, last blow [mm/s]", 1e3, "rate_of_penetration"),
    ("mean force [kN]", 1e-3, "bit.force_mean", "contact.force_mean"),
)


def simulate(hammer: Path) -> dict[str, np.ndarray]:
    """Run the scenario; see `harness.run`."""
    with Instance(hammer) as instance:
        return run(instance.start(), DURATION, STEP, {"percussion_on": lambda t: not OFF <= t < ON})


if __name__ == "__main__":
    command_line("percussion_off_on", simulate, TITLE, PANELS)
