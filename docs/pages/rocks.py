"""Rocks and bits that are stored."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import fill

from docs.blocks import Made
from percussion_model.interface.commands.bits import HEADINGS as BIT_HEADINGS
from percussion_model.interface.commands.bits import NOTE as BIT_NOTE
from percussion_model.interface.commands.bits import cells as bit_cells
from percussion_model.interface.commands.rocks import (
    HEADINGS,
    NOTES,
    SHOWN,
    cells,
    interval_text,
    kind_text,
)
from percussion_model.scene.bits import bit, bits
from percussion_model.scene.rocks import REFERENCE, STIFFNESS, Number, Rock, rock, rocks
from percussion_model.scene.rocks.breaking import breaking_numbers
from percussion_model.scene.rocks.derived import button_stiffness, mean_factor, pressure_factors
from percussion_model.simulation.markdown import table

DERIVED = """
## Stiffness by strength

Where no slope was found, it is derived. Rock below a spherical button is taken as fully plastic,
with a mean pressure of C times the compressive strength σ. A button of radius R has the area 2πRp
at a small penetration p, so K = 2πRCσ. The rocks with a slope have C from {low:.2g} to {high:.2g};
their geometric mean {mean:.2g} is taken, and the intervals of derived numbers cover the range.
Strength says little of a slope, as the last column shows: calibrate where you can. On nine rocks
a button of 14 mm met slopes about 20 % steeper under impact than under slow loading (S. Okubo et
al. 1992, as quoted by S. Okubo, K. Fukui, A. Ota, J. of MMIJ 115 (1999) 661).
"""


def numbers(chosen: Iterable[Rock]) -> list[str]:
    """Lines of what the command prints, in two tables that fit a page."""
    rows = [(f"`{name}`", *rest) for name, *rest in map(cells, chosen)]
    values = [
        (name, buttons, f"{stiffness}, {kind}", f"{ratio}, {other}")
        for name, _, buttons, stiffness, kind, ratio, other, _, _ in rows
    ]
    rock_, law, buttons, stiffness, _, ratio, _, source, fitted = HEADINGS
    others = [(row[0], row[1], row[-1], row[-2]) for row in rows]
    first = table((rock_, buttons, stiffness, ratio), values)
    return ["", first, "", table((rock_, law, fitted, source), others)]


def sources(chosen: Iterable[Rock]) -> list[str]:
    """Lines of the tables of bits, blows, intervals and publications."""
    lines = []
    for one in chosen:
        strength = [one.strength] if one.strength else []
        known = (*one.numbers, *strength, *breaking_numbers(one))
        rows = [
            ("bit", one.indenter),
            ("fitted to", one.fitted_to),
            ("holds for", one.holds_for),
            *((of(number.key), told(number)) for number in known),
            ("source", f"{one.source['published']}; doi: {one.source['doi']}"),
            ("read in", one.source["read_in"]),
        ]
        lines += [f"\n## {one.title}\n\n`{one.name}`: {one.rock} ({one.origin}).\n"]
        lines.append(table(("", ""), rows))
    return lines


def check(factors: dict[str, float]) -> list[str]:
    """Lines of the table of what the strength of rocks with a slope would have told."""
    rows, mean = [], mean_factor(factors.values())
    for name, factor in factors.items():
        one = rock(name)
        assert one.strength is not None
        assert one.buttons is not None
        assert one.button_radius is not None
        known = one.number(STIFFNESS).value / one.buttons
        guess = button_stiffness(one.button_radius, one.strength.value, mean)
        radius, strength = 1e3 * one.button_radius, 1e-6 * one.strength.value
        row = (f"{radius:.3g}", f"{strength:.3g}", f"{factor:.2g}", f"{known / 1e6:.3g}")
        off = f"{100 * (guess / known - 1):+.0f} %"
        rows.append((f"`{name}`", *row, f"{guess / 1e6:.2g}", off))
    headings = (
        "rock", "R, mm", "σ, MPa", "C", "slope of one button, kN/mm", "by strength, kN/mm", "off",
    )  # fmt: skip
    return ["", table(headings, rows)]


def bit_lines() -> list[str]:
    """Lines of the table of bits."""
    rows = [(f"`{name}`", *rest) for name, *rest in map(bit_cells, map(bit, bits()))]
    return ["\n## Bits\n", table(BIT_HEADINGS, rows), "", fill(BIT_NOTE, 110)]


def of(key: str) -> str:
    """Name of a number in these tables."""
    return "strength" if key == "strength" else f"`{key}`"


def told(one: Number) -> str:
    """A number with its unit, kind and reason."""
    unit = {STIFFNESS: "kN/mm", "strength": "MPa", REFERENCE: "mm"}.get(one.key, SHOWN[one.key][1])
    unit = f" {unit}" if unit else ""
    return f"{interval_text(one)}{unit}, {kind_text(one)}: {one.why}"


def tables() -> str:
    """All of it, Markdown."""
    chosen, factors = [rock(name) for name in rocks()], pressure_factors()
    values = factors.values()
    words = DERIVED.format(mean=mean_factor(values), low=min(values), high=max(values))
    lines = [
        *numbers(chosen), words.rstrip(), *check(factors), *bit_lines(), *sources(chosen),
    ]  # fmt: skip
    return "\n".join(lines).strip()


def made() -> Made:
    """The notes and the tables."""
    return Made(("data/rocks.md",), {"notes": fill(" ".join(NOTES), 110), "rocks": tables})
