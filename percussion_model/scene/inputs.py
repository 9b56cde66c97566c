"""Inputs that may change during a run, and the errors of a run."""

from __future__ import annotations

from typing import Any

from percussion_model.scene.rows import refuse_value
from percussion_model.scene.rules import SceneRules

# Each input and its row in the parameter table.
INPUTS = {
    "feed_force": "feed.force",
    "drive_force": "drive.force",
    "reversal_distance": "drive.reversal_distance",
    "external_force": "drive.external_force",
    "loading_stiffness": "rock.loading_stiffness",
    "unloading_ratio": "rock.unloading_ratio",
    "barrier_damping": "rock.barrier_damping",
    "barrier_energy": "rock.barrier_energy",
}


class SimulationError(ValueError):
    """A run that cannot go on, or that was asked for what makes no sense."""


def check_input(scene: SceneRules, name: str, value: Any) -> float:
    """Return the value of an input as a number.

    Raises
    ------
    SimulationError
        If there is no such input, if it has no effect in the scene, or if the
        value is out of bounds; the message names key, value and bounds.
    """
    if name not in INPUTS:
        raise SimulationError(f"unknown input {name}: there are {', '.join(INPUTS)}")
    row = scene.row_of(INPUTS[name])
    if not scene.matters(row.key):
        raise SimulationError(f"{name} has no effect in this scene: needs {row.effect}")
    if name.startswith("barrier") and not scene.barrier_on:
        raise SimulationError(
            f"{name} has no effect in this scene: it began without a barrier, since "
            "rock.barrier_energy or rock.barrier_damping is 0"
        )
    if not row.allows(value):
        raise SimulationError(refuse_value(row, name, value))
    return float(value)
