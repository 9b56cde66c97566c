"""Collection of all hard cases by all solvers: runs, failures, disagreements."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any

from percussion_model.analysis.change import change_error
from percussion_model.analysis.study.workers import on_this_machine
from percussion_model.scene.inputs import SimulationError
from percussion_model.simulation.uncertain import (
    UNDECIDED,
    change_text,
    in_few_characters,
    scaled,
)
from percussion_model.verification.hard_cases.cases import (
    SOLVERS,
    HardCase,
    hard_cases,
)
from percussion_model.verification.hard_cases.measures import measure
from percussion_model.verification.hard_cases.refinement import SIGMAS, refine

# Solvers disagree where their mean rates are further apart than this.
DISAGREE = 0.02
# Error of a rate by what a grid of twice as many cells changes: of first order in the cells that
# is half of the error.
FROM_CHANGE = 2.0
# What must hold of every row.
MOST_RESIDUAL = 1e-6
MOST_MOMENTUM = 1e-8
MOST_TENSION = 1e-9

# Why a case was left out that its solvers could compute.
NOT_ASKED = "not asked for"
# Why rates differ where a case says nothing else.
RIGID_REASON = (
    "rigid bodies: no wave takes its time to the rock, none comes back, none stays in the bit"
)
CHANCE_REASON = (
    "within {sigmas:.1f} standard errors of the two rates: too few blows to distinguish them"
)
REACH_REASON = "the errors of the two rates reach {reach:.1%} of the first"


@dataclass(frozen=True)
class Collection:
    """Measures of all cases by all solvers.

    Attributes
    ----------
    rows : list of dict
        A row for each case and solver: `Measures` and `Refinement` as plain values.
    share : float
        Share of each case's duration that was run.
    left_out : list of dict
        Cases that were not run, or not by all solvers that were asked for: `case`, the
        `solvers` that did not run it, and the `reason`.
    """

    rows: list[dict[str, Any]] = field(repr=False)
    share: float = 1.0
    left_out: list[dict[str, Any]] = field(default_factory=list, repr=False)

    @property
    def is_refined(self) -> bool:
        """Whether the cases were run on finer grids as well."""
        return any("refined_converged" in row for row in self.rows)

    def about_errors(self) -> str:
        """What the ± of a rate is."""
        if self.is_refined:
            return (
                "± of a rate is its standard error by the scatter of the blows, or twice what a "
                "grid of twice as many cells changes, whichever is greater; a rate without it is "
                "known to its four digits, but without loss in the bars a rate depends on the "
                "cells, and is undecided."
            )
        return (
            "± of a rate is its standard error by the scatter of the blows alone; what finer "
            "cells change was not run (--refine)."
        )

    def about_left_out(self) -> list[str]:
        """Which cases were left out and why, a sentence each; empty where none was.

        Those that nobody asked for are counted: they are all others.
        """
        run = {row["case"] for row in self.rows}
        others, whole, partly = 0, [], []
        for entry in self.left_out:
            if entry["reason"] == NOT_ASKED:
                others += 1
            elif entry["case"] in run:
                partly.append(f"{entry['case']} (not by {', '.join(entry['solvers'])})")
            else:
                whole.append(f"{entry['case']} ({entry['reason']})")
        found = []
        if whole:
            found.append(f"Omitted, since no solver asked for computes them: {', '.join(whole)}.")
        if partly:
            found.append(f"Not computed by every solver: {', '.join(partly)}.")
        if others:
            found.append(f"Other cases, {NOT_ASKED}: {others}.")
        return found

    def failures(self) -> list[str]:
        """What does not hold, a line each; empty where all is well."""
        return [
            f"{row['case']}, {row['solver']}: {text}"
            for row in self.rows
            for text in violations(row)
        ]

    def disagreements(self) -> list[dict[str, Any]]:
        """Where mean rates are further apart than `DISAGREE`, and why.

        `decided` are those that are so whatever their errors.
        """
        by_case: dict[str, list[dict[str, Any]]] = {}
        for row in self.rows:
            by_case.setdefault(row["case"], []).append(row)
        found = []
        for name, rows in by_case.items():
            first, *others = rows
            for row in others:
                entry = _disagreement(hard_cases()[name], first, row)
                if entry is not None:
                    found.append(entry)
        return found

    def unresolved(self) -> list[dict[str, Any]]:
        """Rows whose rate or periods change on a finer grid."""
        return [row for row in self.rows if row.get("refined_converged") is False]

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "cases": len({row["case"] for row in self.rows}),
            "runs": len(self.rows),
            "share": self.share,
            "left_out": self.left_out,
            "failures": self.failures(),
            "disagreements": self.disagreements(),
            "rows": self.rows,
        }


def violations(row: dict[str, Any]) -> list[str]:
    """Return what does not hold of a row."""
    found = [row["error"]] if row["error"] else []
    for name, most in (
        ("residual", MOST_RESIDUAL),
        ("momentum", MOST_MOMENTUM),
        ("contact_tension", MOST_TENSION),
        ("rock_tension", MOST_TENSION),
        ("interpenetration", 1.0),
        ("events_per_second", row["ceiling"]),
    ):
        value = row[name]
        if value is None:
            if name in ("residual", "events_per_second"):
                found.append(f"{name} is no number")
        elif abs(value) > most:
            found.append(f"{name} = {value:.3g}, more than {most:.3g}")
    if not row["same_bits"]:
        found.append("other calls give other bits")
    return found


def numerical_error(row: dict[str, Any]) -> float | None:
    """Error of a rate, by its scatter and by what a finer grid changes [m/s]; None if unknown."""
    if row["rate"] is None or row["rate_error"] is None:
        return None
    return max(row["rate_error"], _by_grid(row))


def short_rate(row: dict[str, Any]) -> str:
    """Rate of a row [mm/s] with its error, for a narrow column."""
    if row["depends_on_cells"] and row["rate"]:
        return UNDECIDED
    return in_few_characters(scaled(1e3, row["rate"]), scaled(1e3, numerical_error(row)))


def off_text(entry: dict[str, Any]) -> str:
    """Difference of a disagreement in per cent, with its error; undecided where errors reach it."""
    if not entry["decided"]:
        return UNDECIDED
    return change_text(entry["difference"], entry["difference_error"]) + " %"


def _by_grid(row: dict[str, Any]) -> float:
    """Error of a rate by its change on a finer grid [m/s], 0 where there is none to tell."""
    return FROM_CHANGE * abs(row["rate"]) * (row.get("refined_rate_change") or 0.0)


def _disagreement(
    case: HardCase, first: dict[str, Any], row: dict[str, Any]
) -> dict[str, Any] | None:
    """Entry of the list of disagreements, None where two rates agree or there is none."""
    base, rate = first["rate"], row["rate"]
    if base is None or rate is None or base == rate:
        return None
    off = rate / base - 1.0 if base else math.inf
    if abs(off) <= DISAGREE:
        return None
    error = math.hypot(first["rate_error"] or 0.0, row["rate_error"] or 0.0)
    sigmas = abs(rate - base) / error if error > 0.0 else math.inf
    reach = SIGMAS * error + _by_grid(first) + _by_grid(row)
    decided = abs(rate - base) - reach > DISAGREE * abs(base)
    decided = decided and not (first["depends_on_cells"] or row["depends_on_cells"])
    reason = case.differs.get(row["solver"])
    if reason is None and sigmas <= SIGMAS:
        reason = CHANCE_REASON.format(sigmas=sigmas)
    if reason is None and not decided and base:
        reason = REACH_REASON.format(reach=reach / abs(base)).replace("%", " %")
    if reason is None and row["solver"] == "rigid":
        reason = RIGID_REASON
    return {
        "case": case.name,
        "solver": row["solver"],
        "compared_with": first["solver"],
        "rate": rate,
        "rate_error": row["rate_error"],
        "other_rate": base,
        "other_rate_error": first["rate_error"],
        "difference": off if math.isfinite(off) else None,
        "difference_error": change_error(rate, numerical_error(row), base, numerical_error(first)),
        "standard_errors": sigmas if math.isfinite(sigmas) else None,
        "decided": decided,
        "reason": reason or "",
    }


def run_collection(
    names: Iterable[str] | None = None,
    solvers: Iterable[str] = SOLVERS,
    share: float = 1.0,
    refined: bool = True,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Collection:
    """Run hard cases by every solver that supports them.

    Parameters
    ----------
    names : iterable of str, optional
        Cases. Default: all.
    solvers : iterable of str
    share : float
        Share of each case's duration.
    refined : bool
        Whether to run each on a finer grid as well.
    workers : int, optional
        Processes; as many as there are processors if left out, 0 or 1: this process.
    progress : callable, optional
        Called with the number of runs done and of all.

    Raises
    ------
    SimulationError
        If there is no such case or solver, or nothing to run.
    """
    wanted, chosen = list(solvers), list(hard_cases() if names is None else names)
    for name in chosen:
        if name not in hard_cases():
            raise SimulationError(f"unknown case {name}: there are {', '.join(hard_cases())}")
    jobs: list[tuple[Any, ...]] = [
        (name, solver, share, refined)
        for name in chosen
        for solver in hard_cases()[name].solvers
        if solver in wanted
    ]
    for solver in wanted:
        if solver not in SOLVERS:
            raise SimulationError(f"unknown solver {solver}: there are {', '.join(SOLVERS)}")
    if not jobs:
        raise SimulationError(f"none of these cases is computed by {', '.join(wanted)}")
    order = {(job[0], job[1]): k for k, job in enumerate(jobs)}
    rows = []
    processes = (os.cpu_count() or 1) if workers is None else max(workers, 1)
    # the costliest first, so that no long run is left at the end
    jobs.sort(key=lambda job: job[1] != "fem")
    with closing(on_this_machine(_row, jobs, processes)) as ended:
        for _, row in ended:
            rows.append(row)
            if progress is not None:
                progress(len(rows), len(jobs))
    rows.sort(key=lambda row: order[row["case"], row["solver"]])
    return Collection(rows, share, left_out(chosen, wanted))


def left_out(chosen: Sequence[str], wanted: Sequence[str]) -> list[dict[str, Any]]:
    """Entries of `Collection.left_out` for a choice of cases and solvers."""
    found = []
    for name, case in hard_cases().items():
        missing = list(wanted)
        if name in chosen and set(wanted) & set(case.solvers):
            # nobody expects all solvers of a drill string
            expected = case.solvers if case.scene.effects.string else SOLVERS
            missing = [one for one in wanted if one in expected and one not in case.solvers]
        if missing:
            alone = f"computed by {' and '.join(case.solvers)} alone"
            reason = alone if name in chosen else NOT_ASKED
            found.append({"case": name, "solvers": missing, "reason": reason})
    return found


def _row(name: str, solver: str, share: float, refined: bool) -> dict[str, Any]:
    """Measures of one case by one solver."""
    case = hard_cases()[name]
    found = measure(case, solver, share)
    row = found.to_dict()
    if refined:
        row |= refine(case, found, share).to_dict()
    return row
