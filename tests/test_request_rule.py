"""A wanted accuracy: its rule, its refusals, and when runs grow."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from percussion_model import Scene, SceneError, simulate
from percussion_model.analysis.fitting.predictions import bit_alone
from percussion_model.physics.judgement import FIRST_ORDER
from percussion_model.physics.records import BLOW
from percussion_model.scene.numbers import numbers_of
from percussion_model.simulation.accuracy_control import GROWTH, run_to_accuracy, time_needed
from percussion_model.simulation.error_estimate import (
    FLOOR_SHARE,
    GridRun,
    estimate_error,
)
from percussion_model.simulation.result import Result
from percussion_model.solvers.modal.resolution import CALIBRATED, modes_by_rule, modes_for
from percussion_model.solvers.wave.resolution import (
    COARSER,
    DEFAULT_STEPS,
    STEPS_OF_TWO,
    coarser_steps,
    comparable_steps,
    error_by_steps,
    steps_for,
)

RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
UNDAMPED = {"effects.loss": False}
ALONE = {"piston.model": "absent", "effects.drive": "none"}


# --------------------------------------------------------------------------- the rule


def test_rule_passes_through_its_calibration_and_rises():
    for accuracy, modes in CALIBRATED:
        assert modes_by_rule(accuracy) == pytest.approx(modes, rel=1e-12)
    found = [modes_by_rule(accuracy) for accuracy in np.geomspace(0.1, 1e-4, 40)]
    assert np.all(np.diff(found) > 0)


def test_steps_are_as_many_as_they_promise():
    """Errors by steps are of first order: the steps for an accuracy are just enough for it."""
    for accuracy in (1e-4, 7e-4, 1e-3, 4e-3):
        for is_string in (True, False):
            steps = steps_for(accuracy, is_string)
            assert error_by_steps(steps, is_string) <= accuracy * (1.0 + 1e-12)
            assert error_by_steps(steps - 1, is_string) > accuracy
    assert steps_for(0.1, True) == DEFAULT_STEPS
    assert steps_for(0.1, False) == STEPS_OF_TWO
    for steps in (2, 16, 80, 160):
        assert coarser_steps(steps) == pytest.approx(steps / COARSER, abs=0.5)
    assert coarser_steps(1) == 1


def test_steps_to_compare_with_where_loss_refuses_some():
    """Half as long again first, then shorter ones by a quarter, then longer, then the nearest."""
    assert comparable_steps(24) == [16, 17, 18, 19, 15, 14, 13, 12, 20, 21, 22, 23]
    assert comparable_steps(7) == [5, 4, 6]
    assert comparable_steps(2) == [1]
    assert comparable_steps(1) == []


def test_rule_counts_the_modes_of_the_shorter_bar():
    long_bit = Scene().replace(**{"bit.sections.0.length": 1.75})
    short_bit = Scene().replace(**{"bit.sections.0.length": 0.0875})
    assert modes_for(numbers_of(long_bit), 1e-3) == 56
    assert modes_for(numbers_of(short_bit), 1e-3) == 112
    rigid_piston = Scene().replace(**{"piston.model": "rigid"})
    assert modes_for(numbers_of(rigid_piston), 1e-3) == 56


def test_solver_takes_the_steps_of_the_rule_in_library_and_fmu():
    from fmu_src.hammer.variables import hammer_variables
    from percussion_model.engine.solvers import WaveSolver

    scene = Scene().replace(**{"solver.accuracy": 1e-3})
    assert WaveSolver(scene).cells == {"piston": 240, "bit": 276}
    variable = next(v for v in hammer_variables(scene) if v.name == "solver.accuracy")
    assert (variable.causality, variable.variability) == ("parameter", "fixed")
    assert (variable.start, variable.left_out) == (1e-3, 0.0)
    plain = Scene(**scene.given_values())
    assert WaveSolver(plain).cells == {"piston": 240, "bit": 276}


# ------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"solver.accuracy": 1e-3, "solver.cells": 40}, "both choose the resolution"),
        ({"solver.accuracy": 1e-3, "solver.name": "fem"}, "no finite elements: set fem.elements"),
        ({"solver.accuracy": 1e-7}, "from 0.0001 to 0.1"),
        ({"solver.accuracy": 0.5}, "from 0.0001 to 0.1"),
        ({"solver.accuracy": True}, "from 0.0001 to 0.1"),
        (
            {"solver.accuracy": 1e-3, **UNDAMPED},
            r"where effects\.loss = false .* set effects\.loss",
        ),
        ({"solver.accuracy": 1e-3, "loss.time": 0.0}, r"where loss\.time = 0\.0 s .* above 0 s"),
        ({"solver.accuracy": 1e-3, **ALONE}, r'piston\.model = "absent"\) does not have'),
        ({"solver.accuracy": 1e-3, **ALONE, **UNDAMPED}, "give a piston"),
    ],
)
def test_contradictions_are_refused(changes, message):
    with pytest.raises(SceneError, match=message):
        Scene().replace(**changes)


@pytest.mark.parametrize("changes", [UNDAMPED, ALONE])
def test_an_accuracy_of_no_rate_is_refused_before_anything_is_computed(changes, monkeypatch):
    scene = Scene().replace(**changes)
    monkeypatch.setattr("percussion_model.simulation.simulate.Simulation", None)
    with pytest.raises(SceneError, match=r"solver\.accuracy = 0\.001"):
        simulate(scene, accuracy=1e-3)
    with pytest.raises(SceneError, match=r"solver\.accuracy = 0\.001"):
        Scene(**{**scene.given_values(), "solver": {"accuracy": 1e-3}})


def test_rigid_bodies_need_no_loss():
    assert Scene().replace(**RIGID, **UNDAMPED, **{"solver.accuracy": 1e-3}).solver.accuracy == 1e-3


def test_a_drop_test_of_a_fit_takes_the_cells_of_the_request():
    asked = Scene().replace(**{"solver.accuracy": 1e-3, "run.check": True})
    alone = bit_alone(asked)
    assert (alone.solver.accuracy, alone.run.check) == (None, False)
    assert alone.solver.cells == 56
    assert bit_alone(asked.replace(**RIGID)).solver.cells is None


def test_check_without_an_accuracy_is_refused():
    with pytest.raises(SceneError, match=r"run\.check = true verifies solver\.accuracy"):
        simulate(Scene().replace(**RIGID), 1.0, check=True)
    with pytest.raises(SceneError, match="both choose the resolution"):
        simulate(Scene().replace(**{"solver.cells": 20}), 1.0, accuracy=1e-3)


# ------------------------------------------------------------- runs that grow, invented


def invented(rate, scatter=0.0, blows=50, cells=20, duration=4.0):
    """A result whose blows, up to its end, have a given rate and a given scatter of it."""
    rows, period = np.zeros(blows, BLOW), (duration - 1.0) / blows
    rows["period"] = period
    rows["time"] = 1.0 + period * np.arange(blows)
    off = np.random.default_rng(blows).standard_normal(blows)
    off -= off.mean()
    rows["hole_advance"] = period * (rate + scatter * off / off.std())
    return Result(
        scene=Scene(),
        solver="wave",
        cells={"piston": cells, "bit": cells},
        time_step=1e-6,
        wave_speed_error=0.0,
        duration=duration,
        settle=1.0,
        blows=rows,
        events=np.zeros(0),
        trace=None,
        energy={"numerical_relative": 0.0},
        statistics={},
        wall_time=1.0,
        setup_time=0.5,
        warnings=[],
    )


def test_periodic_motion_needs_no_longer_run():
    assert time_needed(invented(0.02), 1e-3) == 4.0
    assert time_needed(invented(0.02, blows=2), 1e-3) == 4.0  # tells no rate


def test_aperiodic_motion_needs_the_square_of_its_excess():
    result = invented(0.02, scatter=2e-4)
    error = result.rate_of_penetration_standard_error
    assert 0.5 < error / (2e-4 / math.sqrt(50)) < 2.0
    wanted = error / 0.02 / 1.5
    expected = 1.0 + 1.1 * 1.5**2 * 3.0
    assert time_needed(result, wanted) == pytest.approx(expected, rel=1e-9)
    assert time_needed(result, error / 0.02 / 100.0) == 1.0 + GROWTH * 3.0
    assert time_needed(result, 1.01 * error / 0.02) == 4.0


def test_the_scatter_of_few_blows_is_not_believed():
    few = invented(0.02, scatter=1e-5, blows=4)
    excess = few.rate_of_penetration_standard_error / 0.02
    assert time_needed(few, 2.0 * excess) == 1.0 + GROWTH * 3.0
    assert time_needed(few, 20.0 * excess) == 4.0


# Rates by steps, and the steps at which a scene with an accuracy of 1e-2 ends.
CONVERGED = {16: 1.0008, 24: 1.0, 48: 1.0}
LATE = {16: 1.04, 24: 1.0009, 48: 1.0, 96: 1.0}
CHANCE = {16: 1.0, 24: 1.01, 48: 1.01, 96: 1.0, 192: 1.0}
NEVER = {16: 1.0, 24: 1.01, 48: 0.99, 96: 1.02, 192: 1.0}


@pytest.mark.parametrize(
    ("rates", "check", "cells", "error"),
    [
        (CONVERGED, False, 24, FIRST_ORDER * 8e-4),
        (CONVERGED, True, 48, FIRST_ORDER * 8e-4),
        (LATE, False, 96, FIRST_ORDER * 9e-4),
        (CHANCE, False, 192, FIRST_ORDER * 1e-2),
        (NEVER, False, 192, FIRST_ORDER * 0.03 / 1.02),
    ],
)
def test_doubt_leads_to_finer_runs(rates, check, cells, error):
    scene = Scene().computed_by("wave", **{"solver.accuracy": 1e-2, "run.check": check})
    asked = []

    def once(chosen, longer):
        assert chosen.solver.accuracy is None
        asked.append((chosen.solver.cells, longer))
        rate, count = 0.02 * rates[chosen.solver.cells], chosen.solver.cells
        return replace(invented(rate, cells=count), scene=chosen)

    result = run_to_accuracy(scene, once)
    warned = error > 1e-2
    assert result.scene == scene
    assert result.cells["piston"] == cells == asked[-1][0]
    assert [longer for _, longer in asked] == [False] + [True] * (len(asked) - 1)
    assert (result.wall_time, result.setup_time) == (len(asked), 0.5 * len(asked))
    assert bool([text for text in result.warnings if "was not reached" in text]) == warned
    assert result.rate_of_penetration_relative_error == pytest.approx(error, rel=0.03)


# ------------------------------------------------------------------------- the estimate


def on_grid(rate, cells=80, scatter=0.0, cycles=5.0):
    """A run with a given rate and so many steps."""
    result = invented(rate, scatter, cells=cells)
    result.blows["drilling_cycles"] = cycles
    return GridRun(result, error_by_steps(cells, False))


@pytest.mark.parametrize("fewer", [60, 72, 80])
def test_the_error_is_that_of_the_first_order(fewer):
    """Rates on a straight line in the step: the finer run is off by what it says."""
    fine, coarse = (on_grid(1.0 + 0.3 / cells, cells) for cells in (90, fewer))
    off = 0.3 / 90 / fine.value
    assert estimate_error(fine, [coarse]).total == pytest.approx(off, rel=1e-6)


def test_agreement_by_chance_does_not_go_below_the_floor():
    estimate = estimate_error(on_grid(1.0), [on_grid(1.0, 40)])
    assert estimate.total == pytest.approx(FLOOR_SHARE * 3e-3)
    assert estimate_error(on_grid(1.0, 800), [on_grid(1.0)]).total == pytest.approx(
        FLOOR_SHARE * 3e-4
    )


def test_scatter_is_part_of_an_estimate():
    noisy = on_grid(1.0, scatter=0.01)
    assert estimate_error(noisy, [on_grid(1.0, 40)]).total == pytest.approx(noisy.scatter)
