"""The usual index of hardness: the rate, less what a regression gives pressure, feed and rotation.

As in the literature on measurement while drilling (H. Schunnesson, Tunn. Undergr. Space Technol. 11
(1996) 345): the logarithm of the rate is fitted by those of the settings in the hole, and what is
left is the rock. It has no scale of its own: here it has that of a truth or a label.
"""

from __future__ import annotations

import numpy as np

from percussion_model.analysis.identify.cleaning import Samples
from percussion_model.analysis.identify.observation import RATE

# Of a setting that changes by less nothing is fitted, by the logarithm.
CHANGES = 0.02
OVER = 21  # samples of the running median


def hardness_index(samples: Samples) -> np.ndarray:
    """Return the logarithm of a hardness that grows as the rate at usual settings falls.

    A running median of the samples up to each one.
    """
    rate = np.log(samples.signals[:, RATE])
    settings = np.log(samples.settings / np.median(samples.settings, axis=0))
    used = np.std(settings, axis=0) > CHANGES
    columns = np.column_stack([np.ones(len(rate)), settings[:, used]])
    found = np.linalg.lstsq(columns, rate, rcond=None)[0]
    hard = columns[:, 1:] @ found[1:] - rate
    return np.array([np.median(hard[max(k - OVER + 1, 0) : k + 1]) for k in range(len(hard))])
