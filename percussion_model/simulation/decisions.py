"""Decisions of a motion that another resolution may take otherwise.

Each blow keeps how close its closest decisions were: a cycle begins or not, a standstill ends
or not (`barrier_margin`), a cycle counts or not (`counting_margin`), the gap closes or not
(`closing_speed`). What coarser runs have instead tells by how much these numbers may be off.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from percussion_model.physics import judgement

# Counts a blow, and what tells how close the decisions behind them were.
_COUNTED = {
    "drilling_cycles_per_blow": "counting_margin",
    "contacts_per_blow": "closing_speed",
}


def unsure_margin(name: str, blows: np.ndarray, others: Sequence[np.ndarray]) -> float:
    """Return by how much a column of margins may be off.

    Parameters
    ----------
    name : str
    blows : ndarray of BLOW
    others : sequence of ndarray of BLOW
        Of coarser runs; what has nothing to tell is skipped.
    """
    own, *middles = (judgement.middle(one[name]) for one in (blows, *others))
    return judgement.unsure_by(own, middles)


def other_barriers(margins: np.ndarray, unsure: float) -> Iterator[float]:
    """Give the barriers, by the present one, beyond which close decisions fall the other way.

    Parameters
    ----------
    margins : ndarray, shape (n,)
        `barrier_margin` of each blow; NaN where nothing was decided.
    unsure : float
        By how much they may be off.

    Yields
    ------
    float
        Above 1 where cycles began by little energy, below 1 where little was missing.
    """
    for sign in (1.0, -1.0):
        factor = judgement.other_barrier(sign, margins, unsure)
        if not math.isnan(factor):
            yield factor


def unsure_counts(blows: np.ndarray, others: Sequence[np.ndarray]) -> dict[str, float]:
    """Return by how much counts a blow may be off, by cycles and closures that hardly are any.

    Parameters
    ----------
    blows : ndarray of BLOW
    others : sequence of ndarray of BLOW
        Of coarser runs.
    """
    return {
        count: float(np.mean(np.abs(blows[name]) <= unsure_margin(name, blows, others)))
        for count, name in _COUNTED.items()
        if len(blows)
    }
