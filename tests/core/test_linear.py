"""Products of leaps against numpy's."""

import numpy as np
import pytest
from percussion_model.solvers.wave.leaps.lanes import WIDTH
from percussion_model.solvers.wave.leaps.linear import carry, multiply, quadratic

# Sums of up to 80 products in another order.
ROUNDING = 1e-13


@pytest.fixture
def random():
    return np.random.default_rng(7)


@pytest.mark.parametrize("rows", [WIDTH, 3 * WIDTH, 5 * WIDTH])
@pytest.mark.parametrize("columns", [WIDTH, 4 * WIDTH])
@pytest.mark.parametrize("add", [False, True])
def test_a_product_of_a_map_stored_by_column(random, rows, columns, add):
    operator = random.normal(size=(rows, 4 * WIDTH))
    x, y = random.normal(size=rows), random.normal(size=columns)
    expected = (y if add else 0.0) + operator[:, :columns].T @ x
    multiply(operator, x, y, rows, columns, add)
    np.testing.assert_allclose(y, expected, atol=ROUNDING * rows)


@pytest.mark.parametrize("size", [WIDTH, 3 * WIDTH])
def test_a_quadratic_form_stored_as_a_triangle(random, size):
    form = random.normal(size=(size, size))
    form = form + form.T
    triangle = 2.0 * np.tril(form, -1) + np.diag(np.diag(form))
    x = random.normal(size=size)
    found = quadratic(triangle, x, np.zeros(size), size)
    assert found == pytest.approx(x @ form @ x, abs=ROUNDING * size * size)


@pytest.mark.parametrize("steps", [0, 1, 2, 3, 4, 63, 64, 201, 255])
def test_any_number_of_steps_from_powers_of_four(random, steps):
    size = 2 * WIDTH
    step = np.linalg.qr(random.normal(size=(size, size)))[0]  # keeps lengths
    exponents = [digit * 4**level for level in range(4) for digit in (1, 2, 3)]
    powers = np.array([np.linalg.matrix_power(step, exponent) for exponent in exponents])
    x = random.normal(size=size)
    expected = np.linalg.matrix_power(step, steps) @ x
    by_column = np.ascontiguousarray(powers.transpose(0, 2, 1))
    carry(by_column, steps, x, np.zeros(size), size)
    np.testing.assert_allclose(x, expected, atol=ROUNDING * size)
