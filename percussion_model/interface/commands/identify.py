"""Command `identify`: the rock along a hole from a log of the rig."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.analysis.identify.drill import Drill
    from percussion_model.analysis.identify.profile import Profile

# Less is a number without its unit [Pa].
LEAST_PRESSURE = 1e3
_PRESSURE = "Pressure at which the drive of the hammer holds; stored for dth hammers."
_EVERY = "Step of depth of the rows that are written."
_COLLARING = "Hole at its collar that is dropped."


def identify(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a drill rig, as text.")],
    hammer: Annotated[
        str, typer.Option("--hammer", metavar="NAME|SCENE", help="A hammer, or a scene file.")
    ],
    bit: common.BitName = None,
    rock: Annotated[
        str | None,
        typer.Option("--rock", metavar="NAME", help="Begin with what is known of a rock."),
    ] = None,
    columns: Annotated[
        Path | None,
        typer.Option("--columns", metavar="TOML", help="Names, units, factors of the columns."),
    ] = None,
    pressure: Annotated[
        float | None,
        common.number_option("--pressure", "PRESSURE", "pneumatic.supply_pressure", _PRESSURE),
    ] = None,
    every: Annotated[float, common.number_option("--every", "LENGTH", "start.depth", _EVERY)] = 0.1,
    collaring: Annotated[
        float, common.number_option("--collaring", "LENGTH", "start.depth", _COLLARING)
    ] = 0.5,
    plan: Annotated[
        bool,
        typer.Option(
            "--plan", help="Show which change in the next metre would narrow the interval most."
        ),
    ] = False,
    part: Annotated[
        Path | None,
        typer.Option("--part", metavar="TOML", help="Write parameters of the part RockFilter."),
    ] = None,
    example: Annotated[
        bool,
        typer.Option(
            "--example", help="Write LOG first: a hole through layers, of travelling waves."
        ),
    ] = False,
    settings: common.Settings = None,
    solver: common.SolverName = None,
    out: common.OutOrDefault = None,
    json_file: common.JsonFile = None,
    force: common.Force = False,
) -> None:
    """Show the rock along a hole from a log of the rig, in out/LOG-rock."""
    from percussion_model.analysis.identify.plan import ROOM
    from percussion_model.analysis.identify.plan import plan as plan_next
    from percussion_model.analysis.identify.profile import identify as tell_rock
    from percussion_model.analysis.identify.profile import table_with_room
    from percussion_model.interface.drill_log import read_log
    from percussion_model.interface.progress import progress

    if not every > 0.0:
        raise common.refusal(f"--every {every:g}: must be above 0 m")
    if pressure is not None and pressure < LEAST_PRESSURE:
        raise common.refusal(f"--pressure {pressure:g}: needs a unit, as in '24 bar'")
    drill = _drill(hammer, bit, settings, solver, pressure)
    common.check_json(json_file)
    common.check_file("--part", part)
    if example:
        common.refuse_existing(log, force)
        _write_example(log, _drill(hammer, bit, settings, "wave", pressure))
    read = read_log(log, columns)
    claimed = common.claim(
        "identify", out, Path("out") / f"{log.stem}-rock", force, log=common.digest(log),
        columns=common.digest(columns), scene=drill.scene, pressure=pressure, rock=rock,
        every=every, collaring=collaring, plan=plan,
    )  # fmt: skip
    common.tell_of_compiling(drill.scene.solver_name)
    with progress("reading the log") as report:
        found = tell_rock(read, drill, rock, collaring, progress=report)
        changes = []
        if plan:
            here = drill.at_pressure_of(read)[0]
            wide = table_with_room(found, here, ROOM, lambda s: report("runs a wider table", s))
            changes = plan_next(found, wide)
    summary = found.summary()
    if plan:
        summary["plan"] = [
            {"setting": one.setting, "share": one.share, "value": one.value,
             "interval": one.interval, "narrowed": one.narrowed}
            for one in changes
        ]  # fmt: skip
    common.write_json(json_file, summary)
    from percussion_model.interface import identify_text

    if part is not None:
        text = identify_text.part_text(found, drill.at_pressure_of(read)[0])
        common.list_files([common.write_file(part, text)])
    if json_file != "-":
        _show(found)
        if changes:
            print(identify_text.plan_words(changes))
    hole = f"hole of {1e3 * (drill.scene.hole_diameter or 0.0):.0f} mm"
    tool = f"Hammer {hammer}, bit {bit or 'of the scene'}, {hole}"
    with common.if_drawable():
        files = common.write_folder(
            claimed,
            lambda folder: identify_text.write_pages(found, folder, log.name, tool, every, changes),
        )
        common.list_files([*files, *common.sign(claimed)])


def _drill(
    hammer: str,
    bit: str | None,
    settings: list[str] | None,
    solver: str | None,
    pressure: float | None,
) -> Drill:
    from percussion_model.analysis.identify.drill import drill_of
    from percussion_model.scene.hammers import hammer as hammer_of
    from percussion_model.scene.hammers import hammers
    from percussion_model.scene.presets import scene_presets
    from percussion_model.scene.rows import said_among
    from percussion_model.scene.scene import Scene
    from percussion_model.scene.text import read_setting

    known = {*hammers(), *scene_presets()}
    if hammer not in known and not Path(hammer).exists():
        raise common.refusal(f"--hammer {hammer}: no scene file; {said_among(hammer, hammers())}")
    scene = hammer_of(hammer) if hammer in hammers() else Scene.from_toml(hammer)
    scene = common.with_bit(scene, bit)
    changes = dict(read_setting(text) for text in settings or ())
    scene = scene.computed_by(solver, **changes) if solver else scene.replace(**changes)
    return drill_of(scene, hammer, pressure)


def _write_example(log: Path, drill: Drill) -> None:
    """Write the log of a hole that is drilled by another solver than the filter's."""
    from percussion_model.analysis.identify.prior import prior_of
    from percussion_model.analysis.identify.synthetic import csv_text, make_hole, steps_of
    from percussion_model.analysis.identify.tabulate import IdentifyError
    from percussion_model.interface.progress import progress

    if drill.pressure is None:
        raise IdentifyError("--example: give the hammer's pressure by --pressure")
    common.tell_of_compiling("wave")
    prior = prior_of(drill.scene, "kuru-granite")
    with progress("drilling the example"):
        hole = make_hole(drill, prior, steps_of(drill), seed=3)
    common.list_files([common.write_file(log, csv_text(hole))])


def _show(found: Profile) -> None:
    from percussion_model.interface import identify_text
    from percussion_model.interface.tables import airy_table, print_notes, print_table

    table = airy_table(list(identify_text.LAYER_HEADS), (), pad_edge=False)
    for row in identify_text.layer_rows(found):
        table.add_row(*row)
    print_table(table)
    rest = airy_table(["", "value", "95 %", ""], (), pad_edge=False)
    for row in identify_text.unknown_rows(found):
        rest.add_row(*row)
    print_table(rest)
    print_notes([identify_text.rows_said(found), *identify_text.notes(found)])
