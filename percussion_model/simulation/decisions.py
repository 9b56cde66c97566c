"""Decisions of a motion that another resolution may take otherwise.

Each blow keeps how close its closest decisions were: a cycle begins or not, a standstill ends
or not (`barrier_margin`), a cycle counts or not (`counting_margin`), the gap closes or not
(`closing_speed`). What coarser runs have instead tells by how much these numbers may be off.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

# A margin may be off by so many times what coarser runs are: energies that decide converge late,
# and not from one side (docs/data/stated_errors.md, section 6).
UNSURE = 6.0
# So it may where coarser runs have other decisions, which tell nothing of this one.
UNSURE_OTHERWISE = 0.02
# The other barrier lies beyond the energies of all blows that are near, and what is doubtful, by
# this factor: the other motion has other energies. Those so many times as far are not near.
BEYOND, NEAR = 1.2, 3.0
# A decision that is farther from the barrier is not near, however unsure [1].
FAR = 0.07
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
    middles = [_middle(one[name]) for one in (blows, *others)]
    off = np.abs(np.array(middles[1:]) - middles[0])
    return UNSURE * float(np.max(off, initial=0.0, where=np.isfinite(off)))


def _middle(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else np.nan


def near_barrier(margins: np.ndarray, unsure: float) -> np.ndarray:
    """Those of the margins whose decision may fall the other way, and others nearly as close."""
    if not np.any(np.abs(margins) <= min(unsure, FAR)):
        return margins[:0]
    return margins[np.abs(margins) <= min(NEAR * unsure, FAR)]


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
        near = near_barrier(margins[sign * margins > 0.0], unsure)
        if len(near):
            farthest = max(float(np.max(np.abs(near))), min(unsure, FAR))
            yield 1.0 + sign * BEYOND * farthest


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
