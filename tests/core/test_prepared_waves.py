"""What the library without Python does in one go is what the solver does step by step."""

from __future__ import annotations

import numpy as np
import pytest
from percussion_model.solvers.wave.grid import Refused
from percussion_model.solvers.wave.leaps.products import multiply_matrices, solve

from percussion_model import Scene
from percussion_model.scene.numbers import kernel_numbers
from percussion_model.solvers.wave.prepare import (
    cut_bars,
    fill_wave_parameters,
    make_operators,
    wanted_grid,
)
from percussion_model.solvers.wave.records import WAVE_PAR
from percussion_model.solvers.wave.solver import WaveSolver

WAVES = Scene().computed_by("wave", **{"solver.cells": 7})


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"piston.model": "rigid"},
        {"piston.model": "absent", "effects.drive": "none"},
        {"effects.rock": "wall"},
        {"effects.loss": False},
        {"solver.leaps": False},
        {"solver.cells": None, "solver.accuracy": 0.05, "run.check": False},
    ],
    ids=lambda changes: next(iter(changes), "reference"),
)
def test_all_of_a_set_up_in_one_go(changes):
    scene = WAVES.replace(**changes)
    numbers, par = kernel_numbers(scene), np.zeros(1, WAVE_PAR)
    time_step, wish = wanted_grid(numbers)
    assert wish.refused == Refused.NOT
    bars = cut_bars(numbers, time_step)
    fill_wave_parameters(par[0], numbers, bars)
    operators = make_operators(par, numbers, bars)
    solver = WaveSolver(scene)
    assert par.tobytes() == solver._par.tobytes()
    np.testing.assert_array_equal(bars.bit.coefficients, solver._cb)
    np.testing.assert_array_equal(bars.piston.coefficients, solver._cp)
    for found, expected in zip(operators, solver._operators, strict=True):
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("lower", [False, True])
def test_products_are_sums_in_their_order(lower):
    a, b = np.random.default_rng(1).normal(size=(2, 48, 48))
    out, expected = np.zeros((48, 48)), np.zeros((48, 48))
    multiply_matrices(a, b, out, 47, lower)
    for k in range(48):
        expected += a[:, k : k + 1] * b[k]
    wanted = np.tri(48, dtype=bool) if lower else np.ones((48, 48), bool)
    wanted[47] = False
    np.testing.assert_array_equal(out[wanted], expected[wanted])
    assert not out[47].any()


def test_equations_are_solved_where_they_can_be():
    a, x = np.random.default_rng(2).normal(size=(9, 9)), np.arange(1.0, 12.0)
    a[0, 0] = 0.0  # a pivot that has to be looked for
    assert solve(a.copy(), x)
    np.testing.assert_allclose(a @ x[:9], np.arange(1.0, 10.0), atol=1e-12)
    assert not solve(np.outer(np.ones(3), np.arange(3.0)), np.ones(3))
