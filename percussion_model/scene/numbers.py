"""A scene as plain numbers: one record of its parameters, and an array for each bar.

What follows from the arrays is in `percussion_model.scene.bars`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from percussion_model.scene.bar_groups import Bar
from percussion_model.scene.parameters import parameter_table
from percussion_model.scene.scene import Scene
from percussion_model.scene.values import SCENE_NUMBERS, values_of


class Numbers(NamedTuple):
    """All that a solver takes from a scene.

    Attributes
    ----------
    values : Values, or SCENE_NUMBERS record
        Parameters in SI units; of choices the place in the choices of the row, 0 or 1 for
        flags, NaN for what is left out.
    piston, bit : float array, shape (sections, 4)
        Sections as `section_numbers` has them, whatever the model of the bar.
    rod_sections : float array, shape (sections, 4)
        The same of all bars between them, from top to bottom: kernels take any number of rods
        so. None without effects.string.
    rod_counts : int array, shape (rods,)
        Sections of each rod.
    joints : float array, shape (rods, 6)
        Of each rod to the bar below, as `joint_numbers` has them.
    """

    values: Any
    piston: np.ndarray
    bit: np.ndarray
    rod_sections: np.ndarray = np.zeros((0, 4))
    rod_counts: np.ndarray = np.zeros(0, np.int64)
    joints: np.ndarray = np.zeros((0, 6))

    @property
    def rods(self) -> list[np.ndarray]:
        """Sections of each rod."""
        ends = np.cumsum(self.rod_counts).tolist()
        return [self.rod_sections[a:b] for a, b in zip([0, *ends], ends, strict=False)]


def numbers_of(scene: Scene) -> Numbers:
    """Numbers of a scene and of its bars."""
    ends = section_numbers(scene.piston), section_numbers(scene.bit)
    if not scene.effects.string:
        return Numbers(values_of(scene), *ends)
    rods = [section_numbers(rod) for rod in scene.string.rods]
    counts = np.array([len(rod) for rod in rods], np.int64)
    return Numbers(values_of(scene), *ends, np.concatenate(rods), counts, joint_numbers(scene))


# Kinds of joint, in the order of the choices.
JOINT_KINDS = next(row.choices for row in parameter_table() if row.key == "string.rods.*.joint")


def joint_numbers(scene: Scene) -> np.ndarray:
    """Joints of rods to the bars below.

    Returns
    -------
    float array, shape (rods, 6)
        Kind, by its place in `JOINT_KINDS`, transmission, relaxation [s], gap [m], preload [N]
        and thread stiffness [N/m]. With effects.joints off all are perfect.
    """
    rows = np.zeros((len(scene.string.rods), 6))
    for row, rod in zip(rows, scene.string.rods, strict=True):
        kind = JOINT_KINDS.index(rod.joint if scene.effects.joints else "perfect")
        row[:] = (
            kind, rod.transmission, rod.relaxation, rod.gap, rod.preload, rod.thread_stiffness
        )  # fmt: skip
    return rows


def scene_numbers(scene: Scene) -> np.ndarray:
    """Parameters of a scene as one record, by the fields of `Values`.

    Returns
    -------
    SCENE_NUMBERS array of length 1
    """
    return np.array([values_of(scene)], SCENE_NUMBERS)


def section_numbers(bar: Bar) -> np.ndarray:
    """Sections of a bar from top to bottom.

    Returns
    -------
    float array, shape (sections, 4)
        Length [m], area [m^2], Young's modulus [Pa] and density [kg/m^3].
    """
    return np.array(bar.numbers)
