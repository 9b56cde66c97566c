"""Two FMUs: pneumatic chambers push the hammer's piston: `python -m scenarios.pneumatic_drive`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .harness import Instance, command_line, fmu, run

DURATION, STEP = 0.6, 1e-4  # [s]
CHAMBERS = ("upper.pressure", "lower.pressure", "piston_force", "air_used")
TITLE = "A pneumatic drive in an FMU of its own"
PANELS = (
    ("pressure [bar]", 1e-5, "upper.pressure", "lower.pressure"),
    ("piston force [kN]", 1e-3, "piston_force"),
    ("position [mm]", 1e3, "piston.position", "bit.position"),
    ("impact velocity [m/s]", 1, "impact_velocity"),
    ("rate of penetration, last blow [mm/s]", 1e3, "rate_of_penetration"),
)


def simulate(hammer: Path, drive: Path) -> dict[str, np.ndarray]:
    """Run the scenario; see `harness.run`. Outputs of the drive are in the table too."""
    rows = []
    with Instance(hammer, "hammer") as instance, Instance(drive, "drive") as chambers:
        chambers.start()
        instance.set({"effects.drive": "external"})
        instance.start(piston_force=chambers.get("piston_force"))

        def couple(hammer: Instance) -> None:
            rows.append(chambers.values(CHAMBERS))
            piston, bit = hammer.values(["piston.position", "bit.position"])
            speeds = hammer.values(["piston.velocity", "bit.velocity"])
            chambers.set({"displacement": piston - bit, "velocity": speeds[0] - speeds[1]})
            chambers.time = hammer.time
            chambers.step(STEP)
            hammer.set({"piston_force": chambers.get("piston_force")})

        found = run(instance, DURATION, STEP, before_step=couple)
        rows.append(chambers.values(CHAMBERS))
    for name, column in zip(CHAMBERS, np.array(rows).T, strict=True):
        found[name] = column
    return found


if __name__ == "__main__":
    command_line("pneumatic_drive", simulate, TITLE, PANELS, fmu("DRIVE.fmu", "PneumaticDrive"))
