"""Predicted rates beside measured ones, and what the criteria say of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from percussion_model.components.breaking import THRESHOLD
from percussion_model.scene.rocks.breaking import energy_by_strength
from percussion_model.simulation.files import plain
from percussion_model.verification.rates.cases import DOWN, TOP, Case, Crater, Stored, stored_cases
from percussion_model.verification.rates.criteria import (
    Verdict,
    after_site_factor,
    by_others,
    geometric_mean,
    judged,
    judged_crater,
    scatter,
    share,
)
from percussion_model.verification.rates.prediction import Prediction, predict

ALL = "all cases"
# The criterion is of the first; the second carries the energy over as the program does.
SAME_ENERGY, BY_STRENGTH = "one crushing energy", "crushing energy by strength"


@dataclass(frozen=True)
class RateRow:
    """One case: measured and predicted."""

    case: Case
    predicted: Prediction

    @property
    def ratio(self) -> float:
        """Predicted by measured."""
        return self.predicted.rate / self.case.rate


@dataclass(frozen=True, repr=False)
class Rates:
    """All cases compared."""

    stored: Stored
    rows: list[RateRow]

    @property
    def groups(self) -> dict[str, list[RateRow]]:
        """All rows, and those of each kind of hammer."""
        found = {ALL: self.rows}
        found |= {one: [r for r in self.rows if r.case.type == one] for one in (TOP, DOWN)}
        return {name: rows for name, rows in found.items() if rows}

    @property
    def verdicts(self) -> dict[str, list[Verdict]]:
        """What the criteria say, by group; those of all cases are the claim."""
        found = {
            name: judged([r.ratio for r in rows], [r.case.site for r in rows])
            for name, rows in self.groups.items()
        }
        found["craters"] = crater_verdicts(self.stored.craters)
        return found

    def beside(self) -> dict[str, dict[str, float]]:
        """Numbers without a criterion, by group.

        `energy_alone` is the scatter of the measured energy at the drill by the volume of the
        hole: that of a prediction by power and diameter with one fitted number and no rock.
        `mean_without_threshold` and the scatter beside it were thought of after the comparison.
        """
        return {name: _beside(rows) for name, rows in self.groups.items()}

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, SI units; None is what is not defined."""
        rows = [
            {**asdict(r.case), "rate": r.case.rate, "predicted": asdict(r.predicted),
             "ratio": r.ratio}
            for r in self.rows
        ]  # fmt: skip
        found: dict[str, Any] = plain(
            {
                "rows": rows,
                "verdicts": {
                    name: [asdict(one) for one in rows] for name, rows in self.verdicts.items()
                },
                "beside": self.beside(),
                "unused": self.stored.unused,
                "wanted": self.stored.wanted,
                "craters": [asdict(one) for one in self.stored.craters],
            }
        )
        return found


def _beside(rows: Sequence[RateRow]) -> dict[str, float]:
    ratios, sites = [r.ratio for r in rows], [r.case.site for r in rows]
    left, others = after_site_factor(ratios, sites), by_others(ratios, sites)
    free = [r.predicted.without_threshold / r.case.rate for r in rows]
    powers = [r.case for r in rows if r.case.power is not None]
    energies = [one.power / (one.rate * one.bit**2) for one in powers if one.power is not None]
    return {
        "within_30_percent": share(ratios, 0.7, 1.3),
        "scatter_after_site_factor": scatter(left),
        "within_30_percent_by_others_at_the_site": share(others, 0.7, 1.3),
        "within_factor_2_by_others_at_the_site": share(others, 0.5, 2.0),
        "energy_alone": scatter(energies),
        "mean_without_threshold": geometric_mean(free),
        "scatter_without_threshold": scatter(free),
    }


def crater_verdicts(craters: Sequence[Crater]) -> list[Verdict]:
    """The volume of the second crater, by the crushing energy that the first one needs."""
    first, second = craters
    energy = (first.crushing - THRESHOLD) / first.volume
    carried = energy * energy_by_strength(second.strength) / energy_by_strength(first.strength)
    beyond = second.crushing - THRESHOLD
    predicted = {SAME_ENERGY: beyond / energy, BY_STRENGTH: beyond / carried}
    return judged_crater(predicted, second.volume)


def compare_rates(
    stored: Stored | None = None, progress: Callable[[int, int], None] | None = None
) -> Rates:
    """Predict all cases.

    Parameters
    ----------
    stored : Stored, optional
        `stored_cases()` if left out.
    progress : callable, optional
        Is told how many cases are done, and of how many.
    """
    chosen = stored_cases() if stored is None else stored
    rows = []
    for k, case in enumerate(chosen.cases, 1):
        rows.append(RateRow(case, predict(case)))
        if progress is not None:
            progress(k, len(chosen.cases))
    return Rates(chosen, rows)
