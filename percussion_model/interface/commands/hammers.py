"""Command `hammers`: the hammers that are known, each number with kind, interval and source."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from percussion_model.interface.commands import common
from percussion_model.interface.commands.bits import interval_text

if TYPE_CHECKING:
    from percussion_model.scene.hammers.library import StoredHammer
    from percussion_model.scene.rocks import Number

HEADINGS = (
    "hammer", "driven by", "size", "bar", "Hz", "J", "kW", "published", "derived", "estimated",
    "scene",
)  # fmt: skip
LEFT = ("hammer", "driven by", "scene")
BAR, RPM = 1e-5, 9.549296585513721
# Names, units and scales of what is shown.
SHOWN = {
    "outer_diameter": ("outer diameter", "mm", 1e3),
    "length": ("length", "mm", 1e3),
    "weight": ("weight", "kg", 1.0),
    "piston_mass": ("piston", "kg", 1.0),
    "bore": ("bore", "mm", 1e3),
    "stroke": ("stroke", "mm", 1e3),
    "working_pressure": ("working pressure", "bar", BAR),
    "flow": ("flow", "l/min", 6e4),
    "air_consumption": ("air", "m^3/min", 60.0),
    "frequency": ("frequency", "Hz", 1.0),
    "impact_energy": ("energy of a blow", "J", 1.0),
    "impact_power": ("impact power", "kW", 1e-3),
    "input_power": ("input power", "kW", 1e-3),
    "least_bit_diameter": ("least bit", "mm", 1e3),
    "bit_diameter": ("bits", "mm", 1e3),
    "feed_force": ("feed", "kN", 1e-3),
    "rotation_speed": ("rotation", "rpm", RPM),
    "blow_power": ("power of the blows", "kW", 1e-3),
    "blow_energy": ("energy by power", "J", 1.0),
    "impact_velocity": ("impact velocity", "m/s", 1.0),
    "fluid_power": ("power of the fluid", "kW", 1e-3),
}
DIGITS = 4
NOTE = (
    "Size is the outer diameter, else the weight. A star marks what was not published but derived "
    "or estimated. Scenes stand for a hammer: `percussion new --hammer`. `percussion hammers NAME` "
    "shows all of one: in brackets is the range that the maker gives, or the interval that the "
    "number is believed to lie in."
)


def hammers(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="One of them. Default: a list of all.")
    ] = None,
    json_file: common.JsonFile = None,
) -> None:
    """List hammers on the market: size, pressure, blows, sources; or show one."""
    from rich.markup import escape

    from percussion_model.interface.tables import named_table, print_stored, print_table
    from percussion_model.scene.hammers import CHAMBERS
    from percussion_model.scene.hammers.library import stored_hammer, stored_hammers

    if name in CHAMBERS:
        raise common.refusal(f"{name} is a scene (percussion new): its hammer is {CHAMBERS[name]}")
    chosen = [stored_hammer(one) for one in (stored_hammers() if name is None else [name])]
    if not common.told_as_json(json_file, chosen, plain):
        if name is None:
            print_stored(HEADINGS, LEFT, map(cells, chosen), NOTE)
        else:
            rows = ((first, escape(text)) for first, text in details(chosen[0]))
            print_table(named_table(rows, chosen[0].title))


def plain(one: StoredHammer) -> dict[str, Any]:
    """Return a hammer as plain values, with units, what follows from them, and sources."""
    from percussion_model.scene.hammers.library import sources, unit_of

    told = (*one.figures, *one.consistency)
    return asdict(one) | {
        "counts": one.counts,
        "consistency": [asdict(number) for number in one.consistency],
        "units": {number.key: unit_of(number.key) for number in told},
        "sources": {key: sources()[key] for key in _read(one)},
    }


def _read(one: StoredHammer) -> list[str]:
    """Names of its sources."""
    return list(dict.fromkeys(number.source for number in one.figures if number.source))


def _short(one: StoredHammer, key: str) -> str:
    """Value of a quantity; a star where it was not published, a dash where it is not known."""
    number, scale = one.figure(key), SHOWN[key][2]
    if number is None:
        return "-"
    return f"{scale * number.value:.{DIGITS}g}" + "*" * (number.kind != "published")


def cells(one: StoredHammer) -> tuple[str, ...]:
    """Return the texts of a row, by `HEADINGS`."""
    key = "outer_diameter" if one.figure("outer_diameter") else "weight"
    size = f"{_short(one, key)} {SHOWN[key][1]}" if one.figure(key) else "-"
    pressure = _short(one, "working_pressure")
    stated = [number.at for number in one.figures if number.at]
    if pressure == "-" and stated:  # that at which the rest is told
        pressure = f"{BAR * max(stated):g}"
    blows = (_short(one, key) for key in ("frequency", "impact_energy", "impact_power"))
    counts = map(str, one.counts.values())
    return one.name, one.kind, size, pressure, *blows, *counts, one.scene or "-"


def number_cells(one: Number, at: float | None = None) -> tuple[str, str]:
    """Return name and text of a number, with its unit."""
    words, unit, scale = SHOWN[one.key]
    place = "" if at is None else f" at {BAR * at:g} bar"
    return (words + place).capitalize(), f"{interval_text(one, scale, DIGITS)} {unit}"


def details(one: StoredHammer) -> Iterable[tuple[str, str]]:
    """Go through all that is known of a hammer, as names and texts."""
    from percussion_model.scene.hammers import CHAMBER_FILES, CHAMBERS
    from percussion_model.scene.hammers.library import sources
    from percussion_model.scene.text import read_toml

    yield "Driven by", one.kind
    for number in one.figures:
        words, text = number_cells(number, number.at)
        origin = f", {number.source}" if number.source else ""
        why = f": {number.why}" if number.why else ""
        yield words, f"{text}, {number.kind}{origin}{why}"
    for other in one.consistency:
        words, text = number_cells(other)
        yield words, f"{text}, follows: {other.why}"
    if one.scene:
        yield "Scene", one.scene
    for name, file in CHAMBERS.items():
        if read_toml(CHAMBER_FILES / f"{file}.toml")["hammer"] == one.name:
            yield "Chambers, estimated", f"percussion new --hammer {name} --pressure"
    if one.note:
        yield "Note", one.note
    for key in _read(one):
        source = sources()[key]
        hand = " (second hand)" if source["second_hand"] else ""
        yield f"Source {key}", f"{source['cited']}; read in {source['read_in']}{hand}"
