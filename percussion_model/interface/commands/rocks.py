"""Command `rocks`: the rocks that --rock takes, with intervals and sources."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.scene.rocks import Number, Rock

STIFFNESS, RATIO = "rock.loading_stiffness", "rock.unloading_ratio"
# Names, units and scales of what is shown.
SHOWN = {
    STIFFNESS: ("loading stiffness", "kN/mm", 1e6),
    RATIO: ("unloading / loading stiffness", "", 1.0),
    "rock.loading_exponent": ("loading exponent", "", 1.0),
    "rock.reference_penetration": ("reference penetration", "mm", 1e-3),
    "rock.unloading_exponent": ("unloading exponent", "", 1.0),
    "strength": ("strength", "MPa", 1e6),
    "breaking.crushing_energy": ("crushing energy", "MJ/m^3", 1e6),
    "breaking.threshold": ("threshold of a button", "J", 1.0),
    "rotation.renewal_length": ("renewal length", "mm", 1e-3),
    "rotation.friction": ("friction of buttons", "", 1.0),
}
SECOND_HAND = "*"
HEADINGS = (
    "rock", "law", "buttons", "stiffness, kN/mm", "kind", "unloading / loading stiffness", "kind",
    "source", "fitted to",
)  # fmt: skip
# Of these, columns that stay in one block of a narrow terminal.
GROUPS = (4, 2, 2)
WORDS = ("source", "fitted to")
NOTES = (
    "In brackets is the interval that the number is believed to lie in. Kinds: fitted to measured "
    "or to computed numbers of others; derived from the strength of the rock; assumed, as no "
    "source has it; * is second hand.",
    "A bit of N buttons on flat rock is about N times as stiff as one: NAME:N asks for it. With "
    "effects.breaking the buttons are those of the bit, on the bottom that it has drilled: half as "
    "stiff. The law power has the stiffness of one, at its reference penetration. The energy "
    "barrier stays that of the scene.",
)


def rocks(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME[:BUTTONS]]", help="One of them. Default: a list of all."),
    ] = None,
    json_file: common.JsonFile = None,
) -> None:
    """List the rocks that --rock takes: law, numbers with intervals, sources; or show one."""
    from percussion_model.scene.rocks import read_rock, rock
    from percussion_model.scene.rocks import rocks as names

    chosen = [rock(one) for one in names()] if name is None else [read_rock(name)]
    if not common.told_as_json(json_file, chosen, common.with_parameters):
        if name is None:
            show_rocks(chosen)
        else:
            show_rock(chosen[0])


def interval_text(one: Number) -> str:
    """Return a number, and its interval where one is known, without the unit."""
    _, _, scale = SHOWN[one.key]
    value, low, high = (f"{number / scale:.4g}" for number in (one.value, one.low, one.high))
    return value if one.low == one.high else f"{value} ({low} to {high})"


def kind_text(one: Number) -> str:
    """Return the kind of a number, with a star where it is second hand."""
    return one.kind + SECOND_HAND * one.second_hand


def cells(rock: Rock) -> tuple[str, ...]:
    """Return the texts of a row, by `HEADINGS`."""
    stiffness, ratio = rock.number(STIFFNESS), rock.number(RATIO)
    return (
        rock.name, rock.law, str(rock.buttons or "not stated"),
        interval_text(stiffness), kind_text(stiffness), interval_text(ratio), kind_text(ratio),
        rock.source["cited"], rock.fitted_to,
    )  # fmt: skip


def details(rock: Rock) -> Iterable[tuple[str, str]]:
    """Go through all that is known of a rock, as names and texts."""
    yield "Rock", f"{rock.rock} ({rock.origin})"
    yield "Law", rock.law
    if rock.asked is not None:
        yield "Buttons", f"{rock.asked}; the reason behind the stiffness is for {rock.buttons}"
    from percussion_model.scene.rocks.breaking import breaking_numbers

    strength = [rock.strength] if rock.strength else []
    for one in (*rock.numbers, *strength, *breaking_numbers(rock)):
        name, unit, _ = SHOWN[one.key]
        told = f"{interval_text(one)} {unit}".rstrip()
        yield name.capitalize(), f"{told}, {kind_text(one)}: {one.why}"
    yield "Bit", rock.indenter
    yield "Fitted to", rock.fitted_to
    yield "Holds for", rock.holds_for
    yield "Source", f"{rock.source['published']}; doi: {rock.source['doi']}"
    yield "Read in", rock.source["read_in"]


def show_rocks(chosen: Sequence[Rock]) -> None:
    """Print the table of rocks, and what its words mean."""
    from percussion_model.interface.tables import airy_table, print_notes, print_table

    table = airy_table(HEADINGS, HEADINGS, WORDS, pad_edge=False)
    for one in chosen:
        table.add_row(*cells(one))
    print_table(table, groups=GROUPS)
    print_notes(["", *NOTES, "`percussion rocks NAME` shows all of one."])


def show_rock(chosen: Rock) -> None:
    """Print all that is known of a rock."""
    from rich.markup import escape

    from percussion_model.interface.tables import named_table, print_notes, print_table

    rows = ((name, escape(text)) for name, text in details(chosen))
    print_table(named_table(rows, chosen.title))
    print_notes(NOTES)
