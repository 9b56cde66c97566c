"""The hammer's inputs, and what they are for the solver."""

from __future__ import annotations

from percussion_model.scene.inputs import INPUTS, PRESSURES

# The solver's inputs as hosts know them: by keys of the parameter table, but for these.
NAMES_OUTSIDE = {name: one.key for name, one in INPUTS.items()} | {
    "feed_force": "feed_force",
    "drive_force": "supply_pressure",
    **dict.fromkeys(PRESSURES.values(), "supply_pressure"),
    "external_force": "piston_force",
}
# Inputs from which forces of the drive, or the pressure at it, follow.
DRIVE_INPUTS = ("percussion_on", "supply_pressure", "drive.effective_area", "piston_force")
# Hosts go between two equal values of an input, to within so much of it.
SAME = 1e-14
# The drive force's name in a message.
PRODUCT = "supply_pressure * drive.effective_area"
# Inputs that are inputs of the solver as they are.
PLAIN_INPUTS = {
    outside: inner for inner, outside in NAMES_OUTSIDE.items() if outside not in DRIVE_INPUTS
}
