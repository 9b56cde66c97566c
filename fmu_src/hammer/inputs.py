"""The hammer's inputs, and what they are for the solver."""

from __future__ import annotations

# Inputs of the FMU that are inputs of the solver as they are.
PLAIN_INPUTS = {
    "feed_force": "feed_force",
    "rock.loading_stiffness": "loading_stiffness",
    "rock.unloading_ratio": "unloading_ratio",
    "rock.barrier_damping": "barrier_damping",
    "rock.barrier_energy": "barrier_energy",
    "drive.reversal_distance": "reversal_distance",
}
# Those from which the drive's forces follow.
DRIVE_INPUTS = ("percussion_on", "supply_pressure", "drive.effective_area", "piston_force")

# The solver's inputs as hosts know them.
NAMES_OUTSIDE = {inner: name for name, inner in PLAIN_INPUTS.items()} | {
    "drive_force": "supply_pressure",
    "external_force": "piston_force",
}
