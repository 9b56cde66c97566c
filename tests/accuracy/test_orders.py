"""Orders, costs and errors, on numbers whose answer is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from percussion_model.verification.accuracy.orders import cost_at, cost_range, fitted_order
from percussion_model.verification.accuracy.problems import (
    HISTORY,
    Answer,
    relative_error,
)


@pytest.mark.parametrize("power", [0.5, 1.0, 3.0])
def test_a_power_law_is_found(power):
    sizes = [0.1, 0.05, 0.02, 0.01]
    order = fitted_order(sizes, [7.0 * size**power for size in sizes])
    assert order is not None
    assert order.value == pytest.approx(power, abs=1e-12)
    assert order.scale == pytest.approx(7.0)
    assert order.error == pytest.approx(0.0, abs=1e-9)


def test_scatter_shows_in_the_error_of_the_order():
    sizes = np.geomspace(1.0, 1e-3, 8)
    noise = np.array([2.0, 0.5] * 4)
    clean, rough = fitted_order(sizes, sizes), fitted_order(sizes, sizes * noise)
    assert clean is not None
    assert rough is not None
    assert rough.error > 100.0 * clean.error
    assert abs(rough.value - 1.0) < 3.0 * rough.error


def test_an_order_of_few_points_has_the_spread_of_its_parts():
    """Points on a line but for a bend: their mean slope is surer than what lies between them."""
    sizes = 10.0 ** -np.arange(5.0)
    order = fitted_order(sizes, 10.0 ** np.array([0.0, -1.0, -2.0, -2.9, -4.0]))
    assert order is not None
    assert order.error == pytest.approx(0.5 * (1.1 - 0.9))
    twice = fitted_order([1.0, 1.0, 0.1, 0.01], [1.0, 1.0, 0.1, 0.01])
    assert twice is not None
    assert twice.error == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("errors", [[1e-1, 1e-2], [1e-1, 1e-2, math.nan], [1e-1, 1e-2, 0.0]])
def test_two_points_are_no_order(errors):
    assert fitted_order([1.0, 0.1, 0.01][: len(errors)], errors) is None


def test_cost_lies_between_the_points_that_bracket_it():
    assert cost_at([1.0, 100.0], [1e-1, 1e-3], 1e-2) == pytest.approx(10.0)


def test_a_lucky_cheap_point_does_not_count():
    assert cost_at([1.0, 2.0, 4.0], [1e-9, 1e-1, 1e-3], 1e-2) > 2.0


def test_cost_of_what_is_never_or_always_met():
    assert math.isnan(cost_at([1.0, 2.0], [1e-1, 1e-2], 1e-3))
    assert math.isnan(cost_at([], [], 1e-3))
    assert cost_at([1.0, 2.0], [1e-5, 1e-6], 1e-3) == 1.0


def test_error_of_a_history_is_l1_by_l1():
    wanted = {HISTORY: np.array([0.0, 2.0, 4.0, 2.0])}
    found = Answer({}, histories={HISTORY: np.array([0.0, 2.0, 3.0, 3.0])})
    assert relative_error(found, {}, wanted, HISTORY) == pytest.approx(2.0 / 8.0)
    assert math.isnan(relative_error(found, {}, {HISTORY: wanted[HISTORY][:3]}, HISTORY))
    assert math.isnan(relative_error(Answer({}), {"blow_period": 1.0}, {}, "blow_period"))


def test_a_cost_is_as_sure_as_the_reference_and_the_times():
    rungs = [(1.0, 0.1, 1e-1), (10.0, 0.1, 1e-2), (100.0, 0.1, 1e-3)]
    sure = cost_range("wave", rungs, 1e-2, 0.0)
    assert sure.decided
    assert (sure.value, sure.low, sure.high) == pytest.approx((10.0, 9.0, 11.0))
    blurred = cost_range("wave", rungs, 1e-2, 2e-3)
    assert blurred.low < sure.low < sure.high < blurred.high
    whole = cost_range("wave", rungs, 3e-3, 1.5e-3)  # the last error may be nothing but bar
    assert whole.low < whole.value < whole.high
    assert not cost_range("wave", rungs, 1e-3, 5e-4).decided
    missed = cost_range("wave", rungs, 1e-4, 5e-4)
    assert missed.decided
    assert math.isnan(missed.value)
    assert missed.dearest == 100.0
