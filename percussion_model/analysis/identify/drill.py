"""A hammer with its bit, and what a pressure in a log is for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from percussion_model.analysis.identify.cleaning import Log
from percussion_model.analysis.identify.tabulate import IdentifyError, check_scene
from percussion_model.scene.hammers import AIR, CHAMBER_FILES
from percussion_model.scene.inputs import PRESSURES
from percussion_model.scene.scene import Scene
from percussion_model.scene.text import read_toml


@dataclass(frozen=True)
class Drill:
    """A hammer and the pressure at which its scene holds.

    Attributes
    ----------
    scene : Scene
    pressure : float or None
        [Pa]; None where only a log can tell: then it is the log's median.
    """

    scene: Scene
    pressure: float | None

    def changes(self, pressure: float) -> dict[str, Any]:
        """Changes of the scene for a pressure [Pa]; the pressure law's force is in proportion."""
        kind = self.scene["effects.drive"]
        if kind in PRESSURES:
            return {f"{kind}.supply_pressure": pressure}
        assert self.pressure is not None
        return {"drive.force": self.scene["drive.force"] * pressure / self.pressure}

    def at_pressure_of(self, log: Log) -> tuple[Drill, str]:
        """The drill with a pressure, and what was decided for it; nothing where it has one."""
        if self.pressure is not None:
            return self, ""
        values = log.columns.get("pressure")
        if values is None or not np.any(values > 0.0):
            return replace(self, pressure=1.0), ""
        usual = float(np.median(values[values > 0.0]))
        said = (
            f"pressure: the hammer's drive is taken to hold at the log's median, {usual:.4g} Pa, "
            "and to grow in proportion; give it by --pressure"
        )
        return replace(self, pressure=usual), said


def drill_of(scene: Scene, name: str = "", pressure: float | None = None) -> Drill:
    """Return the drill of a scene.

    Parameters
    ----------
    scene : Scene
    name : str
        Of a hammer whose force by pressure is stored, as `dth5`.
    pressure : float, optional
        At which the scene's drive holds [Pa].

    Raises
    ------
    IdentifyError
        If the scene has no bit that breaks and turns.
    """
    check_scene(scene)
    kind = scene["effects.drive"]
    if kind in PRESSURES:
        if pressure is not None:
            raise IdentifyError(f"--pressure: the scene has its own, {kind}.supply_pressure")
        return Drill(scene, float(scene[f"{kind}.supply_pressure"]))
    if kind != "pressure":
        raise IdentifyError(
            f"effects.drive = {kind!r}: rock is identified for a hammer with a pressure"
        )
    if pressure is None and name in AIR:
        rows = read_toml(CHAMBER_FILES / "laws.toml")[name]
        pressure = float(np.interp(scene["drive.force"], rows["force"], rows["pressure"]))
    return Drill(scene, pressure)
