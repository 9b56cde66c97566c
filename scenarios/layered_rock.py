"""Soft, hard, soft rock through the rock inputs: `python -m scenarios.layered_rock`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .harness import Instance, command_line, run

DURATION, STEP = 3.0, 1e-2  # [s]
SOFT, HARD = 3e8, 1.2e9  # K_R [N/m]
# The hard layer by depth of the bit [m].
LAYER = 0.025, 0.040
TITLE = "Soft, hard and soft rock by depth"
PANELS = (
    ("loading stiffness $K_R$ of the rock [kN/mm]", 1e-6, "rock.loading_stiffness"),
    ("depth of the bit [mm]", 1e3, "bit.position"),
    ("rate of penetration, last blow [mm/s]", 1e3, "rate_of_penetration"),
    ("peak force on the rock in each step [kN]", 1e-3, "bit.force_peak"),
    ("share of the blow energy that reaches the rock [–]", 1, "transfer_efficiency"),
)


def simulate(hammer: Path) -> dict[str, np.ndarray]:
    """Run the scenario; see `harness.run`. The stiffness is in the table too."""
    stiffness, depths = [], [0.0]

    def rock_profile(instance: Instance) -> None:
        depths.append(max(depths[-1], instance.get("bit.position")))  # as deep as it has been
        stiffness.append(HARD if LAYER[0] <= depths[-1] < LAYER[1] else SOFT)
        instance.set({"rock.loading_stiffness": stiffness[-1]})

    with Instance(hammer) as instance:
        instance.start(rock__loading_stiffness=SOFT)
        found = run(instance, DURATION, STEP, before_step=rock_profile)
    found["rock.loading_stiffness"] = np.array([*stiffness, stiffness[-1]])
    return found


if __name__ == "__main__":
    command_line("layered_rock", simulate, TITLE, PANELS)
