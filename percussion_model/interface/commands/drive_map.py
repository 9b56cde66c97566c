"""Command `drive-map`: the pressure law that stands for chambers of air or oil."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    import numpy as np

    from percussion_model.analysis.drive_map import DriveMap

BAR = 1e-5
# Headings, columns of a row, factors and digits.
SHOWN = (
    ("blows,\nHz", "frequency", 1.0, ".2f"),
    ("energy,\nJ", "blow_energy", 1.0, ".0f"),
    ("F_0,\nkN", "force", 1e-3, ".3f"),
    ("D_1,\nmm", "reversal_distance", 1e3, ".2f"),
    ("omitted:\nblows, %", "left_out_frequency", 100.0, "+.1f"),
    ("\nenergy", "left_out_blow_energy", 100.0, "+.1f"),
    ("in rock:\nblows, %", "rock_frequency", 100.0, "+.1f"),
    ("\nenergy", "rock_blow_energy", 100.0, "+.1f"),
    ("\nrate", "rock_rate", 100.0, "+.1f"),
)


def drive_map(
    scene: common.SceneFile,
    pressures: Annotated[
        str | None,
        typer.Option(
            "--pressures",
            metavar="A,B,C",
            help="Of the supply, as 10bar,18bar,24bar or 6bar:30bar:5; default: a quarter to five "
            "quarters of the scene's.",
        ),
    ] = None,
    rebounds: Annotated[
        str | None,
        typer.Option(
            "--rebounds",
            metavar="A,B,C",
            help="Velocities after a blow, divided by those before it; default 0.1,0.3,0.5,0.7.",
        ),
    ] = None,
    settings: common.Settings = None,
    rock: common.RockName = None,
    bit: common.BitName = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="CSV", help="Write all columns, in SI.")
    ] = None,
    json_file: common.JsonFile = None,
) -> None:
    """Tabulate the pressure law that stands for chambers of air or oil, and its errors."""
    from percussion_model.analysis.drive_map import REBOUNDS
    from percussion_model.analysis.drive_map import drive_map as find
    from percussion_model.interface.progress import progress
    from percussion_model.scene.units import has_unit

    common.check_file("--out", out)
    common.check_json(json_file)
    chosen = common.load_scene(scene, settings=settings, rock=rock, bit=bit)
    parts = (pressures or "").replace(":", ",").split(",")
    if pressures is not None and not any(has_unit(one.strip()) for one in parts):
        raise common.refusal(f"--pressures {pressures}: give each value its unit, as 10bar,24bar")
    columns = _values("--pressures", "pneumatic.supply_pressure", pressures)
    across = _values("--rebounds", "contact.restitution", rebounds) or REBOUNDS
    common.tell_of_compiling(chosen.solver_name, "rigid")
    with progress("running chambers") as report:
        found = find(
            chosen, columns, across, lambda done, of: report(f"{done} of {of} laws", done / of)
        )
    if out is not None:
        common.list_files([common.write_file(out, csv_text(found))])
    common.write_json(json_file, plain(found))
    if json_file != "-":
        feed = chosen.feed.force if chosen.effects.feed else 0.0
        show(found, feed if chosen.effects.drive == "pneumatic" else math.inf)


def _values(option: str, key: str, text: str | None) -> list[float] | None:
    """Values that an option gives, as those of a study."""
    from percussion_model.analysis.study import read_axis
    from percussion_model.scene.rows import SceneError

    if text is None:
        return None
    try:
        return list(map(float, read_axis(f"{key}={text}")[1]))
    except SceneError as error:
        told = str(error).replace("KEY=", "").replace(f"--over {key}=", f"{option} ")
        raise common.refusal(told) from None


def _in_order(found: DriveMap) -> list[tuple[bool, np.void]]:
    """Rows of each pressure, and behind them that of the scene's own rock."""
    return [
        (is_own, row)
        for rows, own in zip(found.rows, found.own, strict=True)
        for is_own, row in (*((False, row) for row in rows), (True, own))
    ]


def plain(found: DriveMap) -> dict[str, Any]:
    """Return rows as plain values, SI; `of_the_rock` tells those of the scene's own rock."""
    from percussion_model.analysis.drive_map import ROW
    from percussion_model.simulation.files import plain as plain_values

    rows = [
        dict(zip(ROW.names or (), row.item(), strict=True)) | {"of_the_rock": is_own}
        for is_own, row in _in_order(found)
    ]
    values: dict[str, Any] = plain_values({"rows": rows, "worst_energy_errors": found.worst})
    return values


def csv_text(found: DriveMap) -> str:
    """Return rows as a table; what is not defined is empty."""
    rows = plain(found)["rows"]
    lines = [["" if v is None else f"{v:.7g}" for v in row.values()] for row in rows]
    return "\n".join(",".join(line) for line in [list(rows[0]), *lines]) + "\n"


def show(found: DriveMap, feed: float) -> None:
    """Print the map, and what its errors come from."""
    from percussion_model.interface.tables import airy_table, print_notes, print_table

    table = airy_table(["\nbar", "\nrebound", *(one[0] for one in SHOWN)], (), pad_edge=False)
    columns = (("", "rebound", 1.0, ".2f"), *SHOWN)
    for is_own, row in _in_order(found):
        rebound, *cells = (
            "-" if row[key] != row[key] else f"{factor * row[key]:{form}}"
            for _, key, factor, form in columns
        )
        table.add_row(f"{BAR * row['pressure']:.3g}", rebound + "*" * is_own, *cells)
    print_table(table, keys=2, groups=(4, 2, 3))
    print_notes(["", *about(found, feed)])


def about(found: DriveMap, feed: float) -> list[str]:
    """Say what the errors are of, and what is the greatest of them."""
    from percussion_model.analysis.drive_map import HELD

    worst = found.worst
    where = {
        "left_out": "between rows",
        "rows": "in this rock by the rows of other rebounds",
        "own": "by its own",
    }
    notes = [
        "Errors of the law. Omitted: interpolated between the neighbouring rows. In rock: in "
        "place of the chambers, in this scene. *: at the rebound of its rock, interpolated."
    ]
    if worst:
        told = (f"by up to {100.0 * worst[key]:.2g} % {where[key]}" for key in worst)
        notes.append(f"Energy of a blow is off {', '.join(told)}.")
    if worst.get("rows", 0.0) > max((worst[key] for key in worst if key != "rows"), default=1.0):
        notes[1] += " The main error is the rebound, which the rock sets, not pressure."
    loose = found.own["pressure"][found.own["force"] * HELD > feed]
    if len(loose):
        notes.append(
            f"From {BAR * loose[0]:.3g} bar on the feed of {1e-3 * feed:.3g} kN is less than "
            f"{HELD:g} F_0: by the law the bit may bounce, where gas would hold it down."
        )
    return notes
