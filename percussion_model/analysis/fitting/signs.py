"""Whether a drop was measured with the wrong sign: found by fitting it turned round."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from percussion_model.analysis.fitting.found import Source
from percussion_model.analysis.fitting.likelihood import Likelihood, Place
from percussion_model.analysis.fitting.measurements import DropTest, FitError

# Residuals that are this share of how far a signal varies, or follow from each other so much, make
# one ask for its sign; it is the wrong one if the other leaves residuals smaller by this factor.
LITTLE, ALIKE, SMALLER = 0.2, 0.5, 2.0


def check_signs(
    thin: Likelihood,
    whole: Sequence[Place],
    sources: Sequence[Source],
    searched: Callable[[Sequence[Source]], tuple[Likelihood, Place]],
) -> None:
    """Refuse drops that are explained far better with their sign reversed.

    Parameters
    ----------
    thin : Likelihood
        Of few samples of each drop.
    whole : sequence of Place
        The best first, of all samples.
    sources : sequence
    searched : callable
        Gives the likelihood and the best place of other measurements, by as many samples.

    Raises
    ------
    FitError
    """
    doubtful = [
        k
        for k, (one, off) in enumerate(zip(sources, whole[0].residuals, strict=True))
        if isinstance(one, DropTest) and _is_doubtful(one.values, off[: len(one.values)])
    ]
    if not doubtful:
        return
    best = thin.at(whole[0].at)
    tried = [doubtful] if len(doubtful) == 1 else [doubtful, *([k] for k in doubtful)]
    for turned in tried:
        others = [
            replace(one, values=-one.values) if k in turned and isinstance(one, DropTest) else one
            for k, one in enumerate(sources)
        ]
        like, found = searched(others)
        gained = sum(2.0 * len(like.series[k].data) * math.log(SMALLER) for k in turned)
        if best.deviance - found.deviance > gained:
            names = ", ".join(sources[k].name for k in turned)
            raise FitError(
                f"{names}: the sign is reversed: with the opposite one the rock explains the data "
                "far better; down and compression count positive, so multiply the column by -1"
            )


def _is_doubtful(data: np.ndarray, off: np.ndarray) -> bool:
    total = float(off @ off)
    alike = total > 0.0 and float(off[1:] @ off[:-1]) > ALIKE * total
    return alike or total > LITTLE**2 * len(data) * float(np.var(data))
