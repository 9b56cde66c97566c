"""Button bits by name: diameter, buttons and where they are, with intervals and sources."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from percussion_model.scene.rocks import Number
from percussion_model.scene.scene import Scene
from percussion_model.scene.text import read_stored, stored_names

_HERE = Path(__file__).parent
# Revolutions in a minute are this divided by the diameter in inches (a maker's rule for
# down-the-hole hammers, docs/breaking.md).
RULE, INCH = 300.0, 0.0254
HOLE, COUNT, RADIUS, SPEED, THRESHOLD = (
    "hole_diameter", "breaking.buttons", "rotation.mean_radius", "rotation.speed",
    "breaking.threshold",
)  # fmt: skip
# Threshold of a crater [J] under a button of a diameter [m]; similar craters under others have
# one by its cube.
MEASURED_THRESHOLD, MEASURED_DIAMETER = 5.0, 17.02e-3


@dataclass(frozen=True)
class ButtonBit:
    """A bit.

    Attributes
    ----------
    name, title : str
    diameter : float
        [m]
    gauge_buttons : int
        Of the buttons those on the outer row.
    gauge_button_diameter, front_button_diameter : float
        [m]
    buttons, mean_radius : Number
        How many there are, and the mean of the radii on which they are [m].
    source : dict of str
        `cited` and `read_in`.
    """

    name: str
    title: str
    diameter: float
    gauge_buttons: int
    gauge_button_diameter: float
    front_button_diameter: float
    buttons: Number
    mean_radius: Number
    source: dict[str, str]

    @property
    def usual_speed(self) -> float:
        """Speed of rotation by the makers' rule [rad/s]."""
        return RULE / (self.diameter / INCH) * 2.0 * math.pi / 60.0

    @property
    def button_diameter(self) -> float:
        """Mean over the buttons [m]."""
        share = self.gauge_buttons / self.buttons.value
        return share * self.gauge_button_diameter + (1.0 - share) * self.front_button_diameter

    @property
    def threshold_share(self) -> float:
        """Threshold of a crater under its buttons, by that under the button of the craters."""
        return (self.button_diameter / MEASURED_DIAMETER) ** 3

    @property
    def parameters(self) -> dict[str, Any]:
        """What a scene has of the bit, by dotted keys; breaking and rotation are on."""
        return {
            "effects.breaking": True,
            "effects.rotation": True,
            HOLE: self.diameter,
            COUNT: round(self.buttons.value),
            RADIUS: self.mean_radius.value,
            THRESHOLD: MEASURED_THRESHOLD * self.threshold_share,
            SPEED: self.usual_speed,
        }


def bits() -> list[str]:
    """Names of the bits that there are, by kind and size."""
    return sorted(stored_names(_HERE), key=_kind_and_size)


def _kind_and_size(name: str) -> tuple[str, int]:
    kind, _, size = name.partition("-")
    return kind, int(size)


@cache
def bit(name: str) -> ButtonBit:
    """Return a bit.

    Raises
    ------
    SceneError
        If there is none of that name.
    """
    tree = read_stored("bit", name, bits(), _HERE)
    counted = {key: Number(key, **tree.pop(key)) for key in ("buttons", "mean_radius")}
    return ButtonBit(name, **{**tree, **counted})


def bit_of(scene: Scene) -> str:
    """Name of the bit whose numbers a scene has; empty where it has those of none."""
    if not (scene["effects.breaking"] or scene["effects.rotation"]):
        return ""
    for one in map(bit, bits()):
        if all(scene[key] == one.parameters[key] for key in (HOLE, COUNT, RADIUS)):
            return one.name
    return ""
