"""A wanted accuracy: rigid bodies, and what is achieved on scenes drawn by seed."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest

from percussion_model import Scene, SceneError, simulate
from percussion_model.engine.solvers import ModalSolver, WaveSolver
from percussion_model.scene.numbers import numbers_of
from percussion_model.simulation.accuracy_control import planned_cells
from percussion_model.simulation.result import Result
from percussion_model.solvers.modal.resolution import modes_for, most_modes

LONG = os.environ.get("PERCUSSION_LONG") == "1"
RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
FREE = {"piston.sections.0.length": 0.287, "bit.sections.0.length": 0.411}
WAVE_SHORT = {"run.duration": 1.4, "run.settle": 0.7}


# ------------------------------------------------------------------------ error of a run


def test_waves_tell_their_error_where_loss_refuses_steps_half_as_long_again():
    """Of 7 steps 5 and 6 are refused: 4 agree by chance, but no error is below the promised one."""
    scene = Scene().replace(**{"solver.name": "wave", "loss.time": 4e-6})
    solver = WaveSolver(scene)
    assert solver.cells["piston"] == 7
    with pytest.raises(SceneError, match="too long for waves"):
        WaveSolver(scene.replace(**{"solver.cells": 5}))
    assert [one.solver.cells for one in solver.coarser_scenes()] == [4]
    result = simulate(scene, record_events=False)
    modes = simulate(scene.computed_by("modal"), record_events=False)
    off = abs(result.rate_of_penetration - modes.rate_of_penetration)
    assert off < result.rate_of_penetration_error < 0.1 * result.rate_of_penetration


# ------------------------------------------------------------------------ rigid bodies


def test_rigid_bodies_run_until_the_standard_error_is_met():
    """At this reversal distance rigid motion does not repeat; only a longer run helps."""
    scene = Scene().replace(**RIGID, **{"drive.reversal_distance": 0.002})
    short = simulate(scene, 4.0, settle=1.0)
    off = short.rate_of_penetration_standard_error / short.rate_of_penetration
    wanted = 0.5 * off
    assert 1e-4 < wanted < 0.1
    result = simulate(scene, 4.0, settle=1.0, accuracy=wanted)
    error = result.rate_of_penetration_standard_error / result.rate_of_penetration
    assert result.duration > 10.0
    assert error <= wanted
    assert result.rate_of_penetration_relative_error == pytest.approx(error)
    assert not [text for text in result.warnings if "accuracy" in text]


def test_a_bound_ends_a_run_that_never_meets_it(monkeypatch):
    monkeypatch.setattr("percussion_model.simulation.simulate.LONGEST", 3.0)
    scene = Scene().replace(**RIGID, **{"drive.reversal_distance": 0.002})
    seen = []
    result = simulate(scene, 2.0, settle=0.5, accuracy=1e-4, progress=seen.append)
    assert result.duration == seen[-1] == 6.0
    (warning,) = (text for text in result.warnings if "accuracy" in text)
    assert "aperiodic" in warning


def test_without_blows_there_is_nothing_to_judge():
    scene = Scene().replace(
        **RIGID, **{"effects.drive": "none", "start.piston_velocity": 0.0, "effects.gravity": False}
    )
    result = simulate(scene, 0.2, settle=0.0, accuracy=1e-3)
    assert math.isnan(result.rate_of_penetration_relative_error)
    assert any("cannot be judged" in text for text in result.warnings)
    assert result.summary()["rate_of_penetration_relative_error"] is None


def test_the_estimate_is_saved(tmp_path):
    result = simulate(Scene().replace(**RIGID), 1.0, settle=0.2, accuracy=1e-2)
    result.save(tmp_path / "run")
    loaded = Result.load(tmp_path / "run")
    expected = result.rate_of_penetration_relative_error
    assert loaded.rate_of_penetration_relative_error == expected
    assert loaded.scene.solver.accuracy == 1e-2


# --------------------------------------------------------------------- what is achieved


# Twelve of the first sixteen: the other four take half of the time.
QUICK = (0, 1, 3, 5, 6, 7, 8, 10, 12, 13, 14, 15)


def drawn(seed, free=False):
    """A scene drawn by seed; lengths have a common measure unless they are `free`."""
    rng = np.random.default_rng(seed)

    def between(low, high):
        return float(math.exp(rng.uniform(math.log(low), math.log(high))))

    reversal = between(0.008, 0.08)
    force = 3000.0 * (0.04 / reversal) ** (1.0 / 3.0) * float(rng.uniform(0.8, 1.25))
    piston = float(rng.uniform(0.12, 0.25)) if free else 0.175
    ratio = float(rng.uniform(0.9, 2.0)) if free else int(rng.integers(18, 40)) / 20.0
    return Scene().replace(
        **{
            "rock.loading_stiffness": between(1e8, 2e9),
            "rock.unloading_ratio": between(2.0, 12.0),
            "feed.force": between(1000.0, 15000.0),
            "drive.reversal_distance": reversal,
            "drive.force": force,
            "piston.sections.0.length": piston,
            "bit.sections.0.length": piston * ratio,
            **WAVE_SHORT,
        }
    )


def truth(scene, levels):
    """Rate by waves on the finest of two grids, and how unsure it is, relative to it.

    Requests are answered by modes. Refined, waves agree with finite elements and with
    the lumped chain (docs/numerics.md, sections 9 and 11). Errors are of first order at
    least: what the finest is off by is no more than its difference to one with half of the
    steps. Scatter from blow to blow adds to that: motion that is not periodic
    is unsure.
    """
    results = []
    for fewest in levels:
        waves = scene.computed_by("wave", **{"solver.cells": fewest})
        results.append(simulate(waves, record_events=False, error_estimate=False))
    coarse, fine = (result.rate_of_penetration for result in results)
    scatter = results[-1].rate_of_penetration_standard_error
    return fine, (abs(coarse - fine) + scatter) / abs(fine)


def judge(scene, requests, levels):
    """Check all requests whose truth is known well enough; how many there were."""
    rate, unsure = truth(scene, levels)
    requests = [accuracy for accuracy in requests if unsure <= 0.2 * accuracy]
    costs = []
    for accuracy in requests:
        result = simulate(scene, accuracy=accuracy, record_events=False)
        costs.append(sum(result.cells.values()) / result.time_step)
        off = abs(result.rate_of_penetration / rate - 1.0)
        warned = [text for text in result.warnings if "was not reached" in text]
        assert off <= accuracy or warned, (accuracy, off, result.cells)
        assert warned or result.rate_of_penetration_relative_error <= accuracy
    # updates of modes for a simulated second, the cost of a run without leaps
    assert costs == sorted(costs)
    return len(requests)


@pytest.mark.slow
def test_requests_are_met_on_scenes_drawn_by_seed(monkeypatch):
    """Finer runs end at 120 cells here, which only makes more of them end with a warning."""
    monkeypatch.setattr("percussion_model.simulation.accuracy_control.FINEST", 120)
    judged = [judge(drawn(seed), (1e-2, 1e-3), (60, 120)) for seed in QUICK]
    assert sum(judged) >= 12


@pytest.mark.skipif(not LONG, reason="an hour; set PERCUSSION_LONG=1")
@pytest.mark.parametrize("seed", range(60))
def test_requests_are_met_on_many_scenes(seed):
    judge(drawn(1000 + seed, free=seed % 3 == 2), (1e-2, 1e-3), (90, 180))


@pytest.mark.skipif(not LONG, reason="half an hour; set PERCUSSION_LONG=1")
@pytest.mark.parametrize("seed", range(6))
def test_the_tightest_request_is_met(seed):
    judge(drawn(2000 + seed), (1e-2, 1e-3, 1e-4), (140, 280))


def test_plan_lists_what_will_be_run():
    scene = Scene().replace(**{"solver.accuracy": 1e-3, "solver.name": "wave"})
    assert planned_cells(scene) == [160, 240]
    checked = scene.replace(**{"solver.accuracy": 4e-3, "run.check": True})
    assert planned_cells(checked) == [40, 60, 120]
    odd = scene.replace(**{"bit.sections.0.length": 0.175 * 1.432})
    assert planned_cells(odd) == [160, 240]
    assert planned_cells(odd.replace(**{"solver.name": None})) == [20, 28, 40, 56]


@pytest.mark.parametrize(
    ("changes", "name", "solver"),
    [
        ({}, "auto", "modal"),
        (FREE, "auto", "modal"),
        (FREE, "wave", "wave"),
        ({"loss.time": 1e-8}, "auto", "wave"),
        ({"loss.time": 1e-4}, "auto", "modal"),
    ],
)
def test_modes_answer_where_no_solver_is_named(changes, name, solver, monkeypatch):
    """But for a loss that lets modes ring, or that takes many of them.

    Finer runs end at 120 cells, which decides neither the solver nor whether there is an error.
    """
    monkeypatch.setattr("percussion_model.simulation.accuracy_control.FINEST", 120)
    scene = Scene().replace(**changes, **{"solver.name": name, "solver.accuracy": 2e-2})
    assert scene.solver_name == solver
    result = simulate(scene, 0.6, settle=0.2, record_events=False)
    assert result.solver == solver
    assert math.isfinite(result.rate_of_penetration_relative_error)


def test_a_request_says_that_its_error_is_estimated_anyway():
    scene = Scene(bit={"model": "rigid"}, piston={"model": "rigid"})
    short = {"duration": 0.4, "settle": 0.1, "record_events": False, "error_estimate": False}
    notes = simulate(scene, accuracy=0.1, **short).warnings
    assert [note for note in notes if note.startswith("run.error_estimate = false has no effect")]
    assert not any("run.error_estimate" in note for note in simulate(scene, **short).warnings)


def test_a_modal_solver_takes_the_modes_of_the_rule():
    scene = Scene().replace(**{"solver.name": "modal", "solver.accuracy": 1e-3})
    assert ModalSolver(scene).modes == modes_for(numbers_of(scene), 1e-3) == 56
    most = most_modes(numbers_of(scene))
    ModalSolver(scene.replace(**{"solver.accuracy": None, "solver.cells": most}))
    with pytest.raises(SceneError, match="modes, more than 1000"):
        ModalSolver(scene.replace(**{"solver.accuracy": None, "solver.cells": most + 64}))
