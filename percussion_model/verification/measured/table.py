"""Measured and computed numbers as text: one table, for terminals and pages."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields

from percussion_model.simulation.files import csv_text
from percussion_model.simulation.markdown import table
from percussion_model.simulation.uncertain import in_digits, with_short_error
from percussion_model.verification.measured.comparison import (
    FITTED,
    MASSES,
    MET,
    MISSED,
    MIXED,
    NO_CRITERION,
    PREDICTED,
    ROCK,
    UNDECIDED,
    Comparison,
    FoundFit,
    Row,
    VariantRow,
)
from percussion_model.verification.measured.experiments import Measurement
from percussion_model.verification.measured.quantities import QUANTITIES, Quantity

HEADINGS = (
    "number", "verdict", "measured", "kind", "computed", "by fit", "off", "criterion",
)  # fmt: skip
# Those of words; all others are of numbers.
OF_WORDS = ("", "number", "verdict", "kind")
# Of a source, and the sign for it.
SECOND_HAND, STAR = ", second hand", "*"
# A smaller error, relative to the number, is not shown.
LEAST_ERROR = 1e-3
# Names, units and scales of parameters that are not shown in SI.
SYMBOLS = {
    "rock.loading_stiffness": ("loading stiffness", "kN/mm", 1e6),
    "rock.unloading_ratio": ("unloading / loading stiffness", "", 1.0),
    "rock.loading_exponent": ("n", "", 1.0),
    "rock.unloading_exponent": ("q", "", 1.0),
    "rock.chipping_force": ("chipping force", "kN", 1e3),
    "rock.chipping_penetration": ("chipping penetration", "mm", 1e-3),
    "rock.reference_penetration": ("reference penetration", "mm", 1e-3),
}
NOTES = (
    "measured ± is what the source and its reading leave open; kind shows whether the number was "
    "measured, computed by others, or read among points of both; * is second hand.",
    "computed ± is the numerical error, by the time step; by fit ± is what the errors of the "
    "fitted numbers leave open. Neither says whether model and rock are right.",
    "off and criterion are shares of the measured number; of a restitution, differences.",
    "What is fitted is no success: a fit has as many parameters as numbers.",
    "(rock): half or twice the rock's stiffness, or what its unloading / loading stiffness "
    "is above 1, moves the "
    "number by more than the criterion. (masses): they do not, so it says little of the rock.",
)


def is_number(heading: str) -> bool:
    """Whether a column has numbers, which stand at its right."""
    return heading not in OF_WORDS


def shown(quantity: Quantity, value: float, error: float) -> str:
    """A number with its error in the unit of tables, without that unit."""
    value, error = value / quantity.scale, error / quantity.scale
    if not math.isfinite(value):
        return "none"
    if not math.isfinite(error) or error <= LEAST_ERROR * abs(value):
        return in_digits(value, 4)
    return with_short_error(value, error)


def measured_text(one: Row | Measurement) -> str:
    """A measured number with its error and unit."""
    quantity = QUANTITIES[one.quantity]
    value = one.measured if isinstance(one, Row) else one.value
    unit = "" if quantity.unit == "-" else f" {quantity.unit.replace('us', 'µs')}"
    return shown(quantity, value, one.error) + unit


def off_text(row: Row) -> str:
    """Deviation in per cent, or as a difference."""
    if not math.isfinite(row.deviation):
        return "–"
    relative = QUANTITIES[row.quantity].relative
    text = f"{100 * row.deviation:+.1f} %" if relative else f"{row.deviation:+.3f}"
    return text.lstrip("+-") if text.strip("+-0. %") == "" else text


def criterion_text(row: Row) -> str:
    """Criterion in per cent, or as a difference."""
    if row.within is None:
        return "none"
    relative = QUANTITIES[row.quantity].relative
    return f"±{100 * row.within:.0f} %" if relative else f"±{row.within:g}"


def verdict_text(row: Row) -> str:
    """Whether a number was fitted or predicted, and what its criterion says."""
    if row.verdict in (FITTED, NO_CRITERION):
        return row.role
    by = f" ({row.decided_by})" if row.decided_by else ""
    return f"{row.role}, {row.verdict}{by}"


def cells(row: Row) -> list[str]:
    """Texts of a row, one for each of `HEADINGS`."""
    quantity = QUANTITIES[row.quantity]
    by_fit = "–"
    if row.role == PREDICTED and row.fit_error > 0.0:
        by_fit = f"±{in_digits(row.fit_error / quantity.scale, 2)}"
    return [
        row.id, verdict_text(row), measured_text(row), row.source.replace(SECOND_HAND, STAR),
        shown(quantity, row.computed, row.numerical_error), by_fit, off_text(row),
        criterion_text(row),
    ]  # fmt: skip


def parameters_text(found: FoundFit) -> str:
    """Parameters of a fit with their errors, and which were kept."""
    parts = []
    for key, value in found.values.items():
        row = found.scene.row_of(key)
        plain = (key.rpartition(".")[2].replace("_", " "), row.unit.strip("-"), 1.0)
        name, unit, scale = SYMBOLS.get(key, plain)
        unit = f" {unit}" if unit else ""
        if key in found.fitted:
            shape = Quantity("", "", "", scale)
            parts.append(f"{name} {shown(shape, value, found.errors[key])}{unit}")
        else:
            parts.append(f"{name} {in_digits(value / scale, 4)}{unit} (kept)")
    return "; ".join(parts)


def count_text(found: Comparison) -> str:
    """How many predicted numbers met their criteria."""
    once = found.counts_once()
    texts = [
        "Each measured number counts once, however many fits and laws predict it; a restitution "
        "does not count beside the two speeds that it is the quotient of.",
        f"The masses decide {_counted(once[MASSES])}",
        f"The rock decides {_counted(once[ROCK])}",
        "By law, where a number of both counts for each:",
    ]
    texts += [f"Law {law}: {_counted(found.counts(law))}" for law in found.laws]
    again = found.counts(anew=True)
    if sum(again.values()) > again[NO_CRITERION]:
        texts.append(f"With one parameter fitted anew at another speed: {_counted(again)}")
    return " ".join(texts)


def _counted(counts: dict[str, int]) -> str:
    decided = sum(counts.values()) - counts[NO_CRITERION]
    parts = [f"{counts[MET]} are met", f"{counts[MISSED]} missed"]
    parts += [f"{counts[one]} {one}" for one in (MIXED, UNDECIDED) if counts[one]]
    text = f"{decided} predicted numbers with a criterion, of which {', '.join(parts)}"
    return f"{text}; {counts[NO_CRITERION]} without." if counts[NO_CRITERION] else f"{text}."


def laws_side_by_side(found: Comparison, name: str) -> tuple[list[str], list[list[str]]]:
    """Numbers of an experiment by all its whole fits: headings and rows; none for one fit."""
    fits = [f for f in found.fits if f.experiment == name and not f.start]
    if len({f.law for f in fits}) < 2:
        return [], []
    by_fit = [{row.id: row for row in found.of(name, f.name)} for f in fits]
    ids = dict.fromkeys(key for rows in by_fit for key in rows)
    headings = ["number", "measured", *(f"{f.law}, {f.name}" for f in fits)]
    table = []
    for key in ids:
        rows = [each.get(key) for each in by_fit]
        any_row = next(row for row in rows if row is not None)
        texts = ["–" if row is None else _by_law(row) for row in rows]
        table.append([key, measured_text(any_row), *texts])
    return headings, table


def _by_law(row: Row) -> str:
    text = shown(QUANTITIES[row.quantity], row.computed, row.numerical_error)
    return f"{text}, {verdict_text(row).removeprefix(f'{PREDICTED}, ')}"


def reasons(found: Comparison) -> dict[str, list[str]]:
    """Why numbers have no criterion: ids by reason."""
    told: dict[str, list[str]] = {}
    for row in found.rows:
        if row.reason and row.id not in told.setdefault(row.reason, []):
            told[row.reason].append(row.id)
    return told


def as_csv(found: Comparison) -> str:
    """All rows, SI units."""
    names = [one.name for one in fields(Row)]
    return csv_text({name: [getattr(row, name) for row in found.rows] for name in names})


def markdown(found: Comparison) -> Iterator[str]:
    """Lines of the tables of a page: an experiment after the other."""
    yield count_text(found)
    yield ""
    for one in found.experiments:
        yield f"### {one.title}"
        yield ""
        yield f"{one.about} Source: {one.source['published']}; doi {one.source['doi']}."
        yield f"Read in {one.source['read_in']}."
        yield ""
        for plan in one.fits:
            fit = found.found(one.name, plan.name)
            yield f"**Law {plan.law}, fit {plan.name}**: {parameters_text(fit)}."
            yield ""
            yield table(HEADINGS, map(_emphasised, found.of(one.name, plan.name)), OF_WORDS)
            yield ""
        headings, rows = laws_side_by_side(found, one.name)
        if rows:
            yield "**Laws side by side**"
            yield ""
            yield table(headings, rows, OF_WORDS)
            yield ""
    for why, ids in reasons(found).items():
        yield f"- No criterion for {', '.join(ids)}: {why}."
    yield ""
    for title, headings, rows in variant_tables(found):
        yield f"### {title}"
        yield ""
        yield table(headings, rows, OF_WORDS)
        yield ""
    for name, why in reasons_of_variants(found).items():
        yield f"- *{name}*: {why}"
    yield ""


def _emphasised(row: Row) -> list[str]:
    texts = cells(row)
    texts[1] = texts[1].replace(MISSED, f"**{MISSED}**")
    return texts


def variant_tables(found: Comparison) -> Iterator[tuple[str, list[str], list[list[str]]]]:
    """What other rigs and readings change: title, headings and rows, for each fit that has them."""
    for one in found.experiments:
        for plan in one.fits:
            rows = [
                r
                for r in found.variants
                if (r.experiment, r.fit, r.role) == (one.name, plan.name, PREDICTED)
            ]
            if not rows:
                continue
            first = {r.id: r for r in rows}
            lines = [
                ("measured", {r.id: r.measured for r in rows}),
                ("as above", {r.id: r.base for r in rows}),
            ]
            for variant in one.variants:
                late = " (added after the first run)" if variant.after_run else ""
                own = {r.id: r.computed for r in rows if r.variant == variant.name}
                lines.append((variant.name + late, own))
            yield (
                f"{one.title}, {plan.name}: other rigs and readings",
                ["", *first],
                [[name, *(_text(first[key], own[key]) for key in first)] for name, own in lines],
            )


def _text(row: VariantRow, value: float) -> str:
    quantity = QUANTITIES[row.quantity]
    unit = "" if quantity.unit == "-" else f" {quantity.unit.replace('us', 'µs')}"
    return in_digits(value / quantity.scale, 3) + unit


def reasons_of_variants(found: Comparison) -> dict[str, str]:
    """Why each other rig or reading was tried, by its name."""
    tried = {row.variant for row in found.variants}
    return {
        variant.name: variant.why
        for one in found.experiments
        for variant in one.variants
        if variant.name in tried
    }
