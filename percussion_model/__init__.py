"""Percussive drilling: elastic piston and bit, and rock, blow by blow."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from percussion_model.analysis.comparison import Comparison, compare
    from percussion_model.analysis.identify.drill import drill_of
    from percussion_model.analysis.identify.profile import identify
    from percussion_model.analysis.stationary import Settled, settled
    from percussion_model.interface.drill_log import read_log
    from percussion_model.physics.records import (
        BLOW,
        EVENT,
        SAMPLE_FIELDS,
        EventKind,
        Mode,
    )
    from percussion_model.scene.bar_groups import BitBar, PistonBar, Section
    from percussion_model.scene.drive_calibration import calibrate_drive, piston_cycle
    from percussion_model.scene.inputs import SimulationError
    from percussion_model.scene.scene import Scene, SceneError
    from percussion_model.simulation.files import ResultError
    from percussion_model.simulation.result import Result
    from percussion_model.simulation.simulate import Simulation, Snapshot, simulate

# Home of each name. Nothing is imported before it is used, so that starting
# costs only what is needed.
_NAMES = {
    "analysis.comparison": ("Comparison", "compare"),
    "analysis.identify.drill": ("drill_of",),
    "analysis.identify.profile": ("identify",),
    "analysis.stationary": ("Settled", "settled"),
    "interface.drill_log": ("read_log",),
    "physics.records": ("BLOW", "EVENT", "SAMPLE_FIELDS", "EventKind", "Mode"),
    "scene.bar_groups": ("BitBar", "PistonBar", "Section"),
    "scene.drive_calibration": ("calibrate_drive", "piston_cycle"),
    "scene.inputs": ("SimulationError",),
    "scene.scene": ("Scene", "SceneError"),
    "simulation.files": ("ResultError",),
    "simulation.result": ("Result",),
    "simulation.simulate": ("Simulation", "Snapshot", "simulate"),
}
_HOME = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [
    "BLOW",
    "EVENT",
    "SAMPLE_FIELDS",
    "BitBar",
    "Comparison",
    "EventKind",
    "Mode",
    "PistonBar",
    "Result",
    "ResultError",
    "Scene",
    "SceneError",
    "Section",
    "Settled",
    "Simulation",
    "SimulationError",
    "Snapshot",
    "__version__",
    "calibrate_drive",
    "compare",
    "drill_of",
    "identify",
    "piston_cycle",
    "read_log",
    "settled",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("percussion_model")
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    # Submodules of the same name must not take its place.
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
