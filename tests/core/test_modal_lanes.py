"""Eight numbers side by side, against numpy."""

from __future__ import annotations

import numpy as np
from numba import njit

from percussion_model.solvers.modal.lanes import WIDTH, load, lower_of, lowest, spread, store, total


@njit
def _work(x, y):
    one, other = load(x, 0, 0), load(x, 1, 0)
    store(y, 0, 1, lower_of(one, other) + spread(1.0))
    return lowest(one), total(one * other), lowest(other * -1.0)


def test_lanes_do_what_numpy_does():
    x = np.random.default_rng(5).normal(size=(2, WIDTH))
    y = np.zeros((1, WIDTH + 1))
    least, product, most = _work(x, y)
    assert least == x[0].min()
    assert -most == x[1].max()
    np.testing.assert_allclose(product, x[0] @ x[1], rtol=1e-14)
    np.testing.assert_array_equal(y[0], [0.0, *(np.minimum(*x) + 1.0)])
