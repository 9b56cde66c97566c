"""Fresh rock of a scene under a slow test, by the kernels of its law."""

from __future__ import annotations

from typing import Any

import numpy as np

from percussion_model.physics.indentation import weigh
from percussion_model.physics.kernel import entry_of
from percussion_model.physics.power_law import fresh_force, fresh_recovery, start_loading
from percussion_model.physics.records import RockKind
from percussion_model.physics.state import COMMON_PARAMETERS, COMMON_STATE
from percussion_model.scene.rock_law import fill_power
from percussion_model.scene.scene import Scene
from percussion_model.scene.values import values_of

PARAMETERS, STATE = np.dtype(COMMON_PARAMETERS), np.dtype(COMMON_STATE)
# Sums that a comparison of forces gives, see `weigh`.
SUMS = 7


class SlowRock:
    """Fresh rock of a scene, which a slow test loads and unloads once.

    Parameters
    ----------
    scene : Scene
        With the bilinear law or the power law.
    """

    def __init__(self, scene: Scene) -> None:
        par, s = np.zeros(1, PARAMETERS)[0], np.zeros(1, STATE)[0]
        values: Any = values_of(scene)
        fill_power(par, values)
        par["rock"] = RockKind.BILINEAR
        s["k_r"] = par["buttons"] * values.rock_loading_stiffness
        s["gamma"] = values.rock_unloading_ratio
        start_loading(par, s, 0.0)
        self._records = par, s

    def given_back(self, depth: float) -> float:
        """Penetration that the rock gives back from a peak at a depth [m]."""
        force = fresh_force(*self._records, depth)
        return float(fresh_recovery(*self._records, depth, force))

    def weigh(
        self, p: np.ndarray, force: np.ndarray, first: int, datum: float, peak: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compare a measured curve with the rock: its forces, and sums of what is off.

        Parameters as those of the kernel `weigh`, results its `model` and `sums`.
        """
        model, sums = np.empty(len(p)), np.zeros(SUMS)
        entry_of(weigh)(*self._records, p, force, first, datum, peak, model, sums)
        return model, sums
