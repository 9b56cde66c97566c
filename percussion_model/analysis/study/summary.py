"""What a study found, in a few lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from percussion_model.analysis.study.work import KINDS

if TYPE_CHECKING:
    from percussion_model.analysis.study import Study

# Rates with a larger relative error are counted.
BEYOND = 1e-3


def headlines(found: Study) -> list[tuple[str, str]]:
    """Motions, lowest and highest rate with their points, errors, cost: names and texts."""
    rows = found.rows
    counts = np.bincount(rows["kind"], minlength=len(KINDS)).tolist()
    motions = [f"{n} {kind}" for n, kind in zip(counts, KINDS, strict=True) if n]
    lines = [("Points", f"{len(found.points)}: {', '.join(motions)}")]
    rate = rows["rate_of_penetration"]
    if np.isfinite(rate).any():
        for name, k in (("Lowest rate", np.nanargmin(rate)), ("Highest rate", np.nanargmax(rate))):
            at = ", ".join(
                f"{key} = {value:.5g}" for key, value in found.points.changes(int(k)).items()
            )
            lines.append((name, f"{1e3 * rate[k]:.5g} mm/s at {at}"))
    for kind in ("periodic", "aperiodic"):
        error = found.relative_error[rows["kind"] == KINDS.index(kind)]
        if np.isfinite(error).any():
            count = int(np.count_nonzero(error > BEYOND))
            words = f"{count} of them above {100 * BEYOND:g} %" if count else ""
            largest = f"at most {100 * np.nanmax(error):.3g} % of the rate"
            lines.append((f"Error, {kind}", ", ".join(filter(None, (largest, words)))))
    lines.append(("Computed in", f"{rows['wall_time'].sum():.3g} s of one core"))
    return lines
