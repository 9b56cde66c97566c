"""Ceilings of memory and work: told before they are met, and when they are."""

import inspect
import json

import pytest

from percussion_model import Scene, SceneError, Simulation, SimulationError
from percussion_model.analysis import stationary
from percussion_model.analysis.cost import explained, forecast
from percussion_model.analysis.stationary import settled
from percussion_model.interface.commands.scene import settled as settled_command
from percussion_model.simulation import runner
from percussion_model.simulation import simulate as runs
from percussion_model.solvers import base
from percussion_model.solvers.base import make_solver

RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
WAVES = Scene().computed_by("wave")
LONG_BIT = {"bit": {"sections": [{"length": 1000.0, "area": 5e-3}]}}
SHORT_PISTON = {"piston": {"sections": [{"length": 1e-9, "area": 5e-3}]}}

TOO_LARGE = {
    "long bit": (
        LONG_BIT | {"solver": {"name": "wave", "cells": 100_000}},
        "5.72e.08 cells, more than 1000000",
    ),
    "short piston": (LONG_BIT | SHORT_PISTON | {"solver": {"name": "wave"}}, "1e.12 cells"),
    "accuracy": (
        LONG_BIT | {"piston": {"sections": [{"length": 1e-3, "area": 5e-3}]},
                    "solver": {"name": "wave", "accuracy": 1e-4}},
        "cells, more than 1000000",
    ),
    "elements": (
        LONG_BIT | {"solver": {"name": "fem"}, "fem": {"elements": 100_000}}, "5.72e.08 elements"
    ),
    "modes": ({"solver": {"name": "modal", "cells": 1000}}, "modes, more than 1000"),
    "modes of a long bit": (
        LONG_BIT | SHORT_PISTON | {"solver": {"name": "modal", "cells": 100_000}},
        "modes, more than 1000",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", TOO_LARGE)
def test_what_is_too_large_is_refused_before_it_is_made(name):
    groups, text = TOO_LARGE[name]
    with pytest.raises(SceneError, match=text):
        make_solver(Scene(**groups))


@pytest.mark.parametrize("solver", ["wave", "modal", "fem", "rigid"])
def test_a_run_ends_where_its_rows_have_their_ceiling(solver, monkeypatch):
    monkeypatch.setattr(runs, "MOST_ROW_BYTES", 2000)
    simulation = Simulation(Scene().computed_by(solver))
    with pytest.raises(SimulationError, match="take more than 2000 bytes: shorten"):
        simulation.advance(4.0)
    assert simulation.blow_rows == len(simulation.blows)


def test_blows_without_number_are_told_before():
    scene = Scene().replace(**RIGID, **{"drive.reversal_distance": 5e-324})
    found = forecast(scene)
    assert found.row_bytes > runs.MOST_ROW_BYTES
    assert "the run ends with an error" in found.refused
    assert json.loads(json.dumps(explained(scene, found)))["refused"] == found.refused
    assert forecast(Scene().replace(**RIGID)).refused == ""


def test_settling_is_given_up_at_its_ceiling():
    scene = Scene().replace(**RIGID)
    with pytest.raises(SimulationError, match=r"all the time that it may \(--most-time"):
        settled(scene, most_time=1e-9)
    with pytest.raises(SceneError, match="most_time = 0"):
        settled(scene, most_time=0.0)


def test_the_command_has_the_same_ceiling():
    default = inspect.signature(settled_command).parameters["most_time"].default
    assert default == stationary.MOST_TIME


@pytest.mark.parametrize("solver", ["wave", "modal", "rigid"])
def test_looking_at_the_clock_changes_no_bit(solver, monkeypatch):
    scene = Scene().computed_by(solver)
    whole = settled(scene)
    monkeypatch.setattr(runner, "CELL_STEPS", 2e4)
    monkeypatch.setattr(base, "USUAL_STEP", 5e-8)
    pieces = settled(scene)
    assert whole.blows.tobytes() == pieces.blows.tobytes()
    assert whole.rate_of_penetration == pieces.rate_of_penetration


def test_explain_tells_the_memory_of_the_set_up():
    for scene, least in ((WAVES, 100), (Scene(), 1e5)):
        solver = make_solver(scene)
        assert solver.operator_bytes > least
        assert explained(scene, forecast(scene))["operator_bytes"] == solver.operator_bytes
