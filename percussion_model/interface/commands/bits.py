"""Command `bits`: the button bits that --bit takes, with intervals and sources."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.scene.bits import ButtonBit
    from percussion_model.scene.rocks import Number

HEADINGS = (
    "bit", "diameter, mm", "buttons", "on the gauge", "button diameter, mm", "mean radius, mm",
    "rpm by rule",
)  # fmt: skip
MM, RPM = 1e3, 9.549296585513721
NOTE = (
    "In brackets is the interval that a number is believed to lie in. Counts were read second "
    "hand; the mean radius of the buttons follows from them. The rule is 300 divided by the "
    "diameter in "
    "inches. `percussion bits NAME` shows all of one."
)


def bits(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="One of them. Default: a list of all.")
    ] = None,
    json_file: common.JsonFile = None,
) -> None:
    """List the button bits that --bit takes: diameter, buttons, sources; or show one."""
    from percussion_model.interface.tables import named_table, print_stored, print_table
    from percussion_model.scene.bits import bit
    from percussion_model.scene.bits import bits as names

    chosen = [bit(one) for one in (names() if name is None else [name])]
    if not common.told_as_json(json_file, chosen, common.with_parameters):
        if name is None:
            print_stored(HEADINGS, HEADINGS[:1], map(cells, chosen), NOTE)
        else:
            print_table(named_table(details(chosen[0]), chosen[0].title))


def interval_text(one: Number, scale: float = 1.0, digits: int = 3) -> str:
    """Return a number, and its interval where it has one, times a scale."""
    value, low, high = (f"{scale * v:.{digits}g}" for v in (one.value, one.low, one.high))
    return value if one.low == one.high else f"{value} ({low} to {high})"


def _sizes(one: ButtonBit) -> str:
    """Diameters of the buttons [mm]."""
    sizes = sorted({one.gauge_button_diameter, one.front_button_diameter}, reverse=True)
    return " and ".join(f"{MM * size:g}" for size in sizes)


def cells(one: ButtonBit) -> tuple[str, ...]:
    """Return the texts of a row, by `HEADINGS`."""
    return (
        one.name, f"{MM * one.diameter:g}", interval_text(one.buttons), str(one.gauge_buttons),
        _sizes(one), interval_text(one.mean_radius, MM), f"{RPM * one.usual_speed:.0f}",
    )  # fmt: skip


def details(one: ButtonBit) -> Iterable[tuple[str, str]]:
    """Go through all that is known of a bit, as names and texts."""
    yield "Diameter", f"{MM * one.diameter:g} mm"
    yield "Buttons", f"{interval_text(one.buttons)}, {one.gauge_buttons} of them on the gauge"
    yield "Why", one.buttons.why
    yield "Button diameter", f"{_sizes(one)} mm"
    yield "Mean radius", f"{interval_text(one.mean_radius, MM)} mm: {one.mean_radius.why}"
    yield "Rotation by rule", f"{RPM * one.usual_speed:.0f} rpm"
    yield "Source", one.source["cited"]
    yield "Read in", one.source["read_in"]
