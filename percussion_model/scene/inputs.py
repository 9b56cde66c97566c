"""Inputs that may change during a run, and the errors of a run."""

from __future__ import annotations

from typing import Any, NamedTuple

from percussion_model.components import COMPONENTS, DRIVES
from percussion_model.scene.rows import REFUSED
from percussion_model.scene.scene import Scene
from percussion_model.scene.units import read_value, refuse


class SimulationError(ValueError):
    """A run that cannot go on, or that was asked for what makes no sense."""


class Input(NamedTuple):
    """One input.

    Attributes
    ----------
    key : str
        Of its parameter, whose value it has at the start and whose bounds it keeps.
    field : str
        Of the state of a solver that holds it.
    at_once : bool
        Whether it acts at once, or from the next drilling cycle on.
    """

    key: str
    field: str
    at_once: bool


INPUTS = {
    "feed_force": Input("feed.force", "feed", True),
    "drive_force": Input("drive.force", "drive_force", True),
    "reversal_distance": Input("drive.reversal_distance", "reversal", True),
    "external_force": Input("drive.external_force", "external", True),
    "loading_stiffness": Input("rock.loading_stiffness", "next_k_r", False),
    "unloading_ratio": Input("rock.unloading_ratio", "next_gamma", False),
    "barrier_damping": Input("rock.barrier_damping", "next_c_r", False),
    "barrier_energy": Input("rock.barrier_energy", "next_w_r", False),
    **{
        f"{one.name}_{name}": Input(f"{one.name}.{name}", f"{one.name}_{name}", True)
        for one in COMPONENTS
        for name in one.inputs
    },
}
# Inputs that are the pressure at the hammer, by the choice of `effects.drive`.
PRESSURES = {
    one.name: f"{one.name}_supply_pressure" for one in DRIVES if "supply_pressure" in one.inputs
}


def no_effect_reason(scene: Scene, name: str) -> str:
    """Say why an input has no effect in a scene; empty if it has one."""
    row = scene.row_of(INPUTS[name].key)
    if not scene.matters(row.key):
        return f"needs {row.effect}"
    if name.startswith("barrier") and not scene.barrier_on:
        return "it began without a barrier, since rock.barrier_energy or rock.barrier_damping is 0"
    return ""


def check_input(scene: Scene, name: str, value: Any) -> float:
    """Return the value of an input as a number.

    Raises
    ------
    SimulationError
        If there is no such input, if it has no effect in the scene, or if the
        value is out of bounds; the message names key, value and bounds.
    """
    if name not in INPUTS:
        raise SimulationError(f"unknown input {name}: there are {', '.join(INPUTS)}")
    reason = no_effect_reason(scene, name)
    if reason:
        raise SimulationError(f"{name} has no effect in this scene: {reason}")
    row = scene.row_of(INPUTS[name].key)
    number = read_value(row, value)
    if number is REFUSED:
        raise SimulationError(refuse(row, name, value))
    return float(number)
