"""Percussive drilling with travelling waves: piston, bit and rock, blow by blow."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from percussion_model.calibration import calibrate_drive, piston_cycle
    from percussion_model.comparison import Comparison, compare
    from percussion_model.core.records import (
        BLOW,
        EVENT,
        SAMPLE_FIELDS,
        EventKind,
        Mode,
    )
    from percussion_model.inputs import SimulationError
    from percussion_model.parameters import BitBar, PistonBar, Section
    from percussion_model.result import Result
    from percussion_model.result_files import ResultError
    from percussion_model.scene import Scene, SceneError
    from percussion_model.simulation import Simulation, Snapshot, simulate
    from percussion_model.stationary import Settled, settled

# Where each name lives. Nothing is imported before it is used, so that starting
# costs only what is needed.
_HOME = {
    "BLOW": "core.records",
    "EVENT": "core.records",
    "SAMPLE_FIELDS": "core.records",
    "BitBar": "parameters",
    "EventKind": "core.records",
    "Mode": "core.records",
    "PistonBar": "parameters",
    "Result": "result",
    "ResultError": "result_files",
    "Scene": "scene",
    "Settled": "stationary",
    "SceneError": "scene",
    "Section": "parameters",
    "Simulation": "simulation",
    "SimulationError": "inputs",
    "Snapshot": "simulation",
    "Comparison": "comparison",
    "calibrate_drive": "calibration",
    "compare": "comparison",
    "piston_cycle": "calibration",
    "settled": "stationary",
    "simulate": "simulation",
}

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
    "piston_cycle",
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
