"""Rates as text, for terminals and pages."""

from __future__ import annotations

import math
from collections.abc import Iterator
from operator import attrgetter

from percussion_model.simulation.files import csv_text
from percussion_model.simulation.markdown import table
from percussion_model.simulation.uncertain import in_digits
from percussion_model.verification.rates.cases import TOP, Case
from percussion_model.verification.rates.comparison import RateRow, Rates
from percussion_model.verification.rates.criteria import MET, MISSED, NOT_CLAIMED, Verdict

HOUR = 3600.0
TITLE = "Rates of penetration, m/h"
HEADINGS = (
    "case", "rock", "MPa", "bit", "hammer", "measured", "predicted", "by the rock", "ratio",
)  # fmt: skip
OF_VERDICTS = ("of", "criterion", "asked", "found", "cases", "verdict")
# Numbers without a criterion, by their words.
BESIDE = {
    "within 30 %": "within_30_percent",
    "within 30 % by others at the site": "within_30_percent_by_others_at_the_site",
    "scatter of power by area alone": "energy_alone",
    "mean without threshold": "mean_without_threshold",
    "scatter without threshold": "scatter_without_threshold",
}
# Columns of the CSV file, but for the source.
IN_CSV = {
    "case": "case.id",
    **{name: f"case.{name}" for name in ("type", "rock", "site", "strength", "bit")},
    "measured": "case.rate",
    "predicted": "predicted.rate",
    **{name: f"predicted.{name}" for name in ("numerical_error", "low", "high")},
    "ratio": "ratio",
}
OF_WORDS = ("case", "rock", "hammer", *OF_VERDICTS)
NOTES = (
    "measured is the mean of the published rates of a case, net; each number counts once.",
    "predicted ± is the numerical error; by the rock is what the intervals of crushing energy, "
    "threshold and ratio of unloading to loading stiffness leave open. No number is fitted "
    "to a rate.",
    "A case's bit is in mm. Power and frequency of top hammers are makers'; of hammers down the "
    "hole mass, stroke and the pressure behind the drive force are assumed.",
)


def hammer_text(case: Case) -> str:
    """Energy and frequency of a top hammer, or pressure and piston of one down the hole."""
    if case.type == TOP:
        return f"{case.blow_energy:.0f} J, {case.frequency:.0f} Hz"
    assert case.pressure is not None
    assert case.piston is not None
    return f"{case.pressure / 1e5:.0f} bar, {case.piston * 1e3:.0f} mm"


def cells(row: RateRow) -> list[str]:
    """Texts of a case, one for each of `HEADINGS`."""
    case, found = row.case, row.predicted
    return [
        case.id, f"{case.rock}, {case.site}", f"{case.strength / 1e6:.1f}",
        f"{case.bit * 1e3:.0f}", hammer_text(case), f"{case.rate * HOUR:.1f}",
        rate_text(found.rate, found.numerical_error),
        f"{found.low * HOUR:.1f} to {found.high * HOUR:.1f}", f"{row.ratio:.2f}",
    ]  # fmt: skip


def rate_text(rate: float, error: float) -> str:
    """A rate in m/h with its error; plain 0 where nothing is drilled."""
    if rate == 0.0:
        return "0"
    return f"{rate * HOUR:.1f} ± {max(error * HOUR, 0.1):.1f}"


def verdict_cells(group: str, one: Verdict) -> list[str]:
    """Texts of a verdict, one for each of `OF_VERDICTS`."""
    is_share = "%" in one.asked
    if math.isnan(one.found):
        found = "–"
    elif math.isinf(one.found):
        found = "no end"
    else:
        found = f"{100 * one.found:.0f} %" if is_share else in_digits(one.found, 3)
    return [group, one.name.replace("%", " %"), one.asked, found, str(one.count), one.verdict]


def verdict_rows(found: Rates) -> list[list[str]]:
    """All verdicts, the claim first."""
    return [verdict_cells(name, one) for name, rows in found.verdicts.items() for one in rows]


def summary(found: Rates) -> str:
    """What the criteria say, in a line."""
    parts = []
    for name in found.groups:
        rows = found.verdicts[name]
        met, open_ = (sum(one.verdict == word for one in rows) for word in (MET, NOT_CLAIMED))
        text = f"{name}: {met} of {len(rows)} criteria met"
        parts.append(text + (f", {open_} not claimed" if open_ else ""))
    return f"Rates, {'; '.join(parts)}. The claim is that of all cases."


def as_csv(found: Rates) -> str:
    """All cases, SI units."""
    columns = {name: list(map(attrgetter(of), found.rows)) for name, of in IN_CSV.items()}
    return csv_text(columns | {"source": [row.case.source["published"] for row in found.rows]})


def verdicts(found: Rates) -> Iterator[str]:
    """Lines of the table of the criteria, and of numbers beside them."""
    yield _table(OF_VERDICTS, verdict_rows(found))
    headings = ("of", *BESIDE)
    rows = [
        [name, *(_number(key, values[key]) for key in BESIDE.values())]
        for name, values in found.beside().items()
    ]
    yield "Without a criterion:"
    yield ""
    yield _table(headings, rows)


def _number(key: str, value: float) -> str:
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "no end"
    return f"{100 * value:.0f} %" if key.startswith("within") else in_digits(value, 3)


def all_cases(found: Rates) -> Iterator[str]:
    """Lines of the table of all cases, with what is assumed and the sources."""
    yield _table(HEADINGS, [cells(row) for row in found.rows])
    yield from (f"- {one}" for one in NOTES)
    for row in found.rows:
        if row.case.remark:
            yield f"- *{row.case.id}*: {row.case.remark}."
    for name, text in {row.case.type: row.case.assumed for row in found.rows}.items():
        yield f"- Assumed, {name}: {text}."
    for one in {row.case.source["published"]: row.case.source for row in found.rows}.values():
        yield f"- Source: {one['published']}. Read in {one['read_in']}. Rates: {one['rate']}."
    yield ""


def other_rates(found: Rates) -> Iterator[str]:
    """Lines of what is no case, and of what could not be read."""
    headings = ("rate", "kind", "hammer", "bit", "rock", "stated", "lacks")
    keys = ("id", "kind", "hammer", "bit", "rock", "rate", "lacks")
    yield _table(headings, [[row[key] for key in keys] for row in found.stored.unused])
    yield "## Wanted"
    yield ""
    for row in found.stored.wanted:
        yield f"- {row['what']}: {row['where']}. Not had: {row['why']}."
    yield ""


def _table(headings: tuple[str, ...], rows: list[list[str]]) -> str:
    """A table, and the empty line below it."""
    others = ("rate", "kind", "bit", "stated", "lacks") if "stated" in headings else ()
    left = (*OF_WORDS, *others)
    shown = [[f"**{one}**" if one == MISSED else one for one in row] for row in rows]
    return table(headings, shown, left) + "\n"
