"""Page of all hard cases (docs/data/hard_cases.md): runs, verdict, disagreements of solvers."""

from __future__ import annotations

from typing import Any

from percussion_model.simulation.markdown import table
from percussion_model.verification.hard_cases.cases import hard_cases
from percussion_model.verification.hard_cases.collection import (
    DISAGREE,
    MOST_MOMENTUM,
    MOST_RESIDUAL,
    Collection,
    off_text,
    short_rate,
)
from percussion_model.verification.hard_cases.refinement import LEAST_CHANCE, RATE_WITHIN, SIGMAS

GROUPS = {
    "rock": "The rock law",
    "laws": "Power law, chipping and cuttings",
    "drive": "Drive, feed and weight",
    "bars": "Bars and their cells",
    "contact": "Starts that graze, rest or bounce",
    "chains": "Drill strings",
    "inputs": "Inputs that change during the run",
}

HEADINGS = (
    *("case", "solver", "rate, mm/s", "residual", "numerical", "momentum"),
    *("events", "guards", "refined", "speed"),
)

_INTRODUCTION = """# Hard cases: all runs

Read this page to look up a case, a rate or a disagreement. It has every hard case by every solver
that computes it, as `percussion stability` writes them, and is explained in
{guide}.

**What must hold of every run**: it ends, with finite numbers. The energy residual is below
{residual:g} of the ledger's denominator, and momentum equals impulses within {momentum:g}.
Nothing pulls between piston and bit, nor on the rock with `release`. Piston and bit interpenetrate
no deeper than a penalty allows that holds all energy put in, and not at all without a penalty.
There are no more events a second than the ceiling of the case, in the mean over 50 ms or more. The
same run in other calls gives the same bits.
"""

_COLUMNS = """*rate*: rate of penetration. {about_errors}

*residual*, *numerical*: entries of the energy ledger, divided by its denominator. *momentum*: its
greatest difference to the impulses, divided by the greatest impulse. *events*: per simulated
second. *guards*: how often one acted. *refined*: change of the rate with twice as many cells or
elements, of aperiodic cases in standard errors. *speed*: simulated time divided by time to compute,
readings included, beside whatever else the machine did.
"""


def page(found: Collection, picture: str | None, guide: str = "docs/data/stability.md") -> str:
    """Text of the page.

    Parameters
    ----------
    found : Collection
    picture : str, optional
        Path of the figure from the page.
    guide : str
        What the page that explains this one is called, in Markdown.
    """
    introduction = _INTRODUCTION.format(guide=guide, residual=MOST_RESIDUAL, momentum=MOST_MOMENTUM)
    parts = [introduction, verdict(found)]
    parts += [f"{text}\n" for text in found.about_left_out()]
    if picture:
        parts.append(f"![Residual, momentum, dissipation and events of every case]({picture})\n")
    parts.append(_disagreements(found))
    if found.is_refined:
        parts.append(_unresolved(found))
    parts.append("## All runs\n\n" + _COLUMNS.format(about_errors=found.about_errors()))
    parts += [text for group in GROUPS if (text := _group(found, group))]
    return "\n".join(parts)


def verdict(found: Collection) -> str:
    """Whether all holds for all runs, and the extremes of residual, events and guards."""
    failures = found.failures()
    guarded = [row for row in found.rows if row["guards"]]
    worst = max(found.rows, key=lambda row: abs(row["residual"] or 0.0))
    busiest = max(found.rows, key=lambda row: row["events_per_second"] or 0.0)
    lines = [
        f"**Result**: {len({row['case'] for row in found.rows})} cases, {len(found.rows)} runs; "
        + ("all of this holds for all of them." if not failures else "this does not hold:"),
        *(f"- {text}" for text in failures),
        "",
        f"Each case ran for {100 * found.share:g} % of its duration"
        + (", and on a finer grid as well. " if found.is_refined else ". ")
        + f"The greatest residual is {abs(worst['residual'] or 0.0):.1e} ({worst['case']}, "
        f"{worst['solver']}), the most events {_plain(busiest['events_per_second'], 3)} a second "
        f"({busiest['case']}, {busiest['solver']}). Guards acted in "
        + (", ".join(f"{row['case']} ({row['solver']})" for row in guarded) or "none")
        + ".\n",
    ]
    return "\n".join(lines)


def _disagreements(found: Collection) -> str:
    rows = []
    for entry in found.disagreements():
        of_case = {row["solver"]: row for row in found.rows if row["case"] == entry["case"]}
        first = entry["compared_with"]
        rows.append(
            (
                entry["case"], entry["solver"], short_rate(of_case[entry["solver"]]),
                f"{short_rate(of_case[first])} ({first})", off_text(entry),
                entry["reason"] or "**not known**",
            )
        )  # fmt: skip
    lines = [
        "## Where solvers disagree",
        "",
        f"Every case whose mean rate differs by more than {100 * DISAGREE:g} % from that of the "
        "first solver, with the reason. ± follows from the errors of both rates. A difference is "
        "undecided where it lies within three standard errors of the scatter and what finer grids "
        "change.",
        "",
        table(("case", "solver", "rate, mm/s", "first solver, mm/s", "off", "reason"), rows),
        "",
    ]
    return "\n".join(lines)


def _unresolved(found: Collection) -> str:
    rows = [
        (
            row["case"], row["solver"], _percent(row["refined_rate_change"]),
            _plain(row["refined_rate_sigmas"]), _plain(row["refined_periods_chance"]),
        )
        for row in found.unresolved()
    ]  # fmt: skip
    lines = [
        "## What a finer grid changes",
        "",
        f"Rates that change by more than {100 * RATE_WITHIN:g} % and by more than {SIGMAS:g} "
        "standard errors with twice as many cells or elements. In aperiodic cases also those whose "
        f"distribution of periods changes: by chance it would with less than {LEAST_CHANCE:g}. The "
        "default does not resolve these; it resolves all others.",
        "",
        table(
            ("case", "solver", "rate changes by", "standard errors", "chance of the periods"), rows
        ),
        "",
    ]
    return "\n".join(lines)


def _group(found: Collection, group: str) -> str:
    cases = {name: case for name, case in hard_cases().items() if case.group == group}
    rows = [row for row in found.rows if row["case"] in cases]
    if not rows:
        return ""
    lines = [f"### {GROUPS[group]}", ""]
    shown = {row["case"] for row in rows}
    lines += [f"- **{n}**: {c.hard}. Holds: {c.holds}." for n, c in cases.items() if n in shown]
    runs = table(HEADINGS, (_row(row, cases[row["case"]].aperiodic) for row in rows))
    return "\n".join([*lines, "", runs, ""])


def _row(row: dict[str, Any], aperiodic: bool) -> tuple[str, ...]:
    refined = _percent(row.get("refined_rate_change"))
    if aperiodic and row.get("refined_rate_sigmas") is not None:
        refined = f"{row['refined_rate_sigmas']:.1f} σ"
    speed = row["duration"] / row["wall_time"] if row["wall_time"] else None
    sizes = (_small(row[name]) for name in ("residual", "numerical", "momentum"))
    return (
        row["case"], row["solver"], short_rate(row), *sizes, _plain(row["events_per_second"], 3),
        str(row["guards"] or ""), refined, _plain(speed),
    )  # fmt: skip


def _small(value: float | None) -> str:
    return "-" if value is None else "0" if value == 0.0 else f"{value:.0e}"


def _plain(value: float | None, digits: int = 2) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:.2g} %"
