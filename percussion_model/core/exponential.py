"""Integrals of a decaying exponential without loss of digits."""

from __future__ import annotations

import math

from percussion_model.core.kernel import inlined

# Below this exponent the series is exact to rounding, while the closed form
# has lost more than half of its digits.
SMALL_EXPONENT = 1e-3


@inlined
def exponential_area(x):
    """(x - 1 + exp(-x)) / x^2.

    The double integral of exp(-r s) over a time T is T^2 times this at x = r T.
    """
    if x < SMALL_EXPONENT:
        return 0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x / 120.0))
    return (x + math.expm1(-x)) / (x * x)
