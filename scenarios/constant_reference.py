"""The reference hammer, feed and pressure constant: `-m scenarios.constant_reference`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .harness import Instance, command_line, run

DURATION, STEP = 1.0, 1e-3  # [s]
TITLE = "Reference: constant feed and supply pressure"
PANELS = (
    ("position [mm]", 1e3, "bit.position", "piston.position"),
    ("peak force [kN]", 1e-3, "contact.force_peak", "bit.force_peak"),
    ("mean force [kN]", 1e-3, "bit.force_mean"),
    ("rate of penetration, last blow [mm/s]", 1e3, "rate_of_penetration"),
    ("blow frequency [1/s]", 1, "blow_frequency"),
)


def simulate(hammer: Path) -> dict[str, np.ndarray]:
    """Run the scenario; see `harness.run`."""
    with Instance(hammer) as instance:
        return run(instance.start(), DURATION, STEP)


if __name__ == "__main__":
    command_line("constant_reference", simulate, TITLE, PANELS)
