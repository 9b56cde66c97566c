"""Where in a step a contact has to begin for its front to get the width that loss gives it."""

from __future__ import annotations

import numpy as np

# Terms of the series of a front's variance; the largest is a tenth.
HARMONICS = 200


def place_of_closure(variance: float) -> float:
    """Where in a step a closure has to come for its front to get the right width.

    Loss spreads a sharp front to a Gaussian; the means over cells then have a larger
    variance than the Gaussian, by the mean of f (1 - f) of what its places leave over
    whole cells. Smoothing from cell to cell, exact for smooth waves, misses that while
    the front is narrower than a cell. A front that begins at the share f of a step
    is averaged over a cell and has f (1 - f) (docs/numerics.md, eqs 14a and 14b).

    Parameters
    ----------
    variance : float
        Of the Gaussian after one transit of the bar [cells squared].

    Returns
    -------
    float
        Share of the step, from 0 without loss to 0.211.
    """
    order = np.arange(1, HARMONICS + 1)
    missing = np.exp(-2.0 * np.pi**2 * order**2 * variance) / (np.pi * order) ** 2
    width = max(1.0 / 6.0 - missing.sum(), 0.0)
    return 0.0 if variance == 0.0 else float(0.5 * (1.0 - np.sqrt(1.0 - 4.0 * width)))
