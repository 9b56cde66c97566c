"""Eight numbers side by side, against numpy."""

from __future__ import annotations

import numpy as np
from numba import njit

from percussion_model.solvers.modal import lanes
from percussion_model.solvers.modal.lanes import WIDTH, load, spread, store, total

lower_of, higher_of, root = lanes.lower_of, lanes.higher_of, lanes.root


@njit
def _work(x, y):
    one, other = load(x, 0, 0), load(x, 1, 0)
    store(y, 0, 1, lower_of(one, other) + spread(1.0))
    store(y, 1, 0, higher_of(one, other))
    store(y, 2, 0, root(one * one / other))
    return total(one * other)


def test_lanes_do_what_numpy_does():
    x = np.random.default_rng(5).normal(size=(2, WIDTH))
    x[1] = np.abs(x[1])
    y = np.zeros((3, WIDTH + 1))
    np.testing.assert_allclose(_work(x, y), x[0] @ x[1], rtol=1e-14)
    np.testing.assert_array_equal(y[0], [0.0, *(np.minimum(*x) + 1.0)])
    np.testing.assert_array_equal(y[1], [*np.maximum(*x), 0.0])
    np.testing.assert_array_equal(y[2], [*np.sqrt(x[0] * x[0] / x[1]), 0.0])
