"""A wanted accuracy: its rule, its refusals, and when runs grow."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from percussion_model.solvers.wave.cutting import cut

from percussion_model import Scene, SceneError, simulate
from percussion_model.analysis.fitting.predictions import bit_alone
from percussion_model.physics.records import BLOW
from percussion_model.scene.numbers import numbers_of, section_numbers
from percussion_model.simulation.accuracy_control import GROWTH, run_to_accuracy, time_needed
from percussion_model.simulation.error_estimate import (
    FIT_EFFECT,
    FLOOR_SHARE,
    SAFETY,
    GridRun,
    estimate_error,
)
from percussion_model.simulation.result import Result
from percussion_model.solvers.wave.resolution import (
    CALIBRATED,
    FIT_SHARE,
    cells_by_rule,
    cells_for,
    coarser_cells,
    finer_cells,
    misfits,
    promised_error,
)

RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
UNDAMPED = {"effects.loss": False}
ALONE = {"piston.model": "absent", "effects.drive": "none"}


# --------------------------------------------------------------------------- the rule


def test_rule_passes_through_its_calibration_and_rises():
    for accuracy, cells in CALIBRATED:
        assert cells_by_rule(accuracy) == pytest.approx(cells, rel=1e-12)
    found = [cells_by_rule(accuracy) for accuracy in np.geomspace(0.1, 1e-4, 40)]
    assert np.all(np.diff(found) > 0)


def test_rule_finds_cells_that_fit_the_lengths():
    scene = Scene()
    for accuracy in (1e-2, 1e-3, 1e-4):
        cells, fit = cells_for(numbers_of(scene), accuracy)
        assert cells % 20 == 0  # L_b/L_p = 23/20: nothing else fits
        assert fit < 1e-12
        assert cells_by_rule(accuracy) <= cells <= 2 * cells_by_rule(accuracy) + 1
    assert coarser_cells(numbers_of(scene), 60) == [40]
    assert finer_cells(numbers_of(scene), 60, 1e-4, 256) == 100
    assert finer_cells(numbers_of(scene), 200, 1e-4, 256) is None


def test_rule_counts_the_cells_of_the_shorter_bar():
    long_bit = Scene().replace(**{"bit.sections.0.length": 1.75})
    short_bit = Scene().replace(**{"bit.sections.0.length": 0.0875})
    assert cells_for(numbers_of(long_bit), 1e-3)[0] == 56
    assert cells_for(numbers_of(short_bit), 1e-3)[0] == 112
    rigid_piston = Scene().replace(**{"piston.model": "rigid"})
    assert cells_for(numbers_of(rigid_piston), 1e-3)[0] == 56


def test_rule_says_how_well_lengths_fit():
    odd = Scene().replace(**{"bit.sections.0.length": 0.175 * 0.996})
    cells, fit = cells_for(numbers_of(odd), 1e-3)
    time_step = odd.piston.transit_time / cells
    assert fit == pytest.approx(cut(section_numbers(odd.bit), time_step).fit)
    assert fit > FIT_SHARE * 1e-3


def test_solver_takes_the_cells_of_the_rule_in_library_and_fmu():
    from fmu_src.hammer.variables import hammer_variables
    from percussion_model.solvers.wave.solver import WaveSolver

    scene = Scene().replace(**{"solver.accuracy": 1e-3})
    assert WaveSolver(scene).cells == {"piston": 60, "bit": 69}
    variable = next(v for v in hammer_variables(scene) if v.name == "solver.accuracy")
    assert (variable.causality, variable.variability) == ("parameter", "fixed")
    assert (variable.start, variable.left_out) == (1e-3, 0.0)
    plain = Scene(**scene.given_values())
    assert WaveSolver(plain).cells == {"piston": 60, "bit": 69}


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


def invented(rate, scatter=0.0, blows=50, cells=20, misfit=0.0, duration=4.0):
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
        wave_speed_error=misfit,
        duration=duration,
        settle=1.0,
        blows=rows,
        events=np.zeros(0),
        trace=None,
        energy={},
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


# Rates by cells, and the cells at which a scene with an accuracy of 1e-3 ends.
CONVERGED = {40: 1.0004, 60: 1.0, 100: 1.0}
LATE = {40: 1.01, 60: 1.0009, 100: 1.0, 140: 1.0}
CHANCE = {40: 1.0, 60: 1.01, 100: 1.01, 140: 1.0, 200: 1.0}
NEVER = {40: 1.0, 60: 1.01, 100: 0.99, 140: 1.02, 200: 1.0}


@pytest.mark.parametrize(
    ("rates", "check", "cells", "error"),
    [
        (CONVERGED, False, 60, 4e-4),
        (CONVERGED, True, 100, 4e-4),
        (LATE, False, 140, 9e-4),
        (CHANCE, False, 200, 1e-2),
        (NEVER, False, 200, 0.03 / 1.02),
    ],
)
def test_doubt_leads_to_finer_runs(rates, check, cells, error):
    scene = Scene().computed_by("wave", **{"solver.accuracy": 1e-3, "run.check": check})
    asked = []

    def once(chosen, longer):
        assert chosen.solver.accuracy is None
        asked.append((chosen.solver.cells, longer))
        rate, count = 0.02 * rates[chosen.solver.cells], chosen.solver.cells
        return replace(invented(rate, cells=count), scene=chosen)

    result = run_to_accuracy(scene, once)
    warned = error > 1e-3
    assert result.scene == scene
    assert result.cells["piston"] == cells == asked[-1][0]
    assert [longer for _, longer in asked] == [False] + [True] * (len(asked) - 1)
    assert (result.wall_time, result.setup_time) == (len(asked), 0.5 * len(asked))
    assert bool([text for text in result.warnings if "was not reached" in text]) == warned
    assert result.rate_of_penetration_relative_error == pytest.approx(error, rel=0.03)


# ------------------------------------------------------------------------- the estimate


def on_grid(rate, cells=56, misfit=0.0, scatter=0.0, cycles=5.0):
    """A run with a given rate on an invented grid of two bars."""
    result = invented(rate, scatter, cells=cells)
    result.blows["drilling_cycles"] = cycles
    return GridRun(result, np.array([0.0, misfit]), promised_error(numbers_of(Scene()), cells))


def test_where_lengths_fit_the_difference_is_the_error():
    fine, coarse = on_grid(1.0), on_grid(1.002, 40)
    assert estimate_error(fine, [coarse]).total == pytest.approx(0.002, rel=1e-6)


def test_agreement_by_chance_does_not_go_below_the_floor():
    estimate = estimate_error(on_grid(1.0), [on_grid(1.0, 40)])
    assert estimate.total == pytest.approx(FLOOR_SHARE * 1e-3)
    assert estimate_error(on_grid(1.0, 128), [on_grid(1.0)]).total == pytest.approx(
        FLOOR_SHARE * 1e-4
    )


def test_grids_that_share_a_misfit_tell_nothing_of_it():
    """Halving 30 + 43 cells keeps the misfit, and all agree on a wrong rate."""
    runs = [on_grid(1.0, cells, 8.9e-4) for cells in (30, 60, 120)]
    assert estimate_error(runs[-1], runs[:-1]).total >= FIT_EFFECT * 8.9e-4


def test_two_misfits_tell_the_effect_of_a_misfit():
    """Rates on a straight line in the misfit: the last is off by its own."""
    effect = 43.0
    runs = [on_grid(1.0 + effect * misfit, 30, misfit) for misfit in (-1e-3, 5e-4, 1e-4)]
    estimate = estimate_error(runs[-1], runs[:-1])
    assert estimate.cells == pytest.approx(0.0, abs=1e-9)
    assert estimate.fit == pytest.approx(SAFETY * effect * 1e-4 / runs[-1].value, rel=1e-6)
    # another number of drilling cycles: any of the motions may be the right one
    other = [on_grid(1.03, 30, -1e-3, cycles=4.0), runs[1]]
    assert estimate_error(runs[-1], other).total >= 0.02


def test_scatter_is_part_of_an_estimate():
    noisy = on_grid(1.0, scatter=0.01)
    assert estimate_error(noisy, [on_grid(1.0, 40)]).total == pytest.approx(noisy.scatter)


def test_a_finer_grid_has_another_misfit():
    scene = Scene().replace(**{"piston.sections.0.length": 0.287, "bit.sections.0.length": 0.411})
    numbers = numbers_of(scene)
    here = misfits(numbers, 30)
    assert np.max(np.abs(misfits(numbers, 60) - here)) < 1e-12  # halving keeps it
    finer = finer_cells(numbers, 30, 1e-4, 256)
    there = misfits(numbers, finer)
    assert np.max(np.abs(there - here)) > 0.5 * np.max(np.abs(here))
    assert np.max(np.abs(there)) < 3e-4
