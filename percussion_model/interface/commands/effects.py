"""Command `effects`: cost and change of each effect of a scene."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from percussion_model.interface.commands import common
from percussion_model.simulation.uncertain import (
    ABOUT,
    ABOUT_CHANGE,
    UNDECIDED,
    in_digits,
    in_few_characters,
    scaled,
)

if TYPE_CHECKING:
    from percussion_model.analysis.effect_study import EffectsStudy, VariantRun


def effects(
    scene: common.SceneFile,
    duration: common.Duration = None,
    settle: common.Settle = None,
    solver: common.SolverName = None,
    cells: common.Cells = None,
    settings: common.Settings = None,
    rock: common.RockName = None,
    bit: common.BitName = None,
    out: common.OutOrDefault = None,
    json_file: common.JsonFile = None,
    force: common.Force = False,
    figures: Annotated[bool, typer.Option(help="Draw cost and change as bars.")] = True,
) -> None:
    """Turn each effect off, or on, in turn: what it costs and what it changes.

    Prints a table, and draws a figure in out/SCENE-effects.
    """
    from percussion_model.analysis.effect_study import by_one_solver, study_effects
    from percussion_model.interface.progress import progress

    chosen = common.load_scene(scene, solver, cells, settings, rock=rock, bit=bit)
    common.check_json(json_file)
    if figures:
        claimed = common.claim(
            "effects", out, Path("out") / f"{scene.stem}-effects", force,
            scene=chosen, duration=duration, settle=settle,
        )  # fmt: skip
    common.tell_of_compiling(by_one_solver(chosen).solver_name, "rigid")
    with progress("effects") as report:
        found = study_effects(chosen, duration, settle, report)
    common.write_json(json_file, found.to_dict())
    if json_file != "-":
        show_effects(found)
    if figures:
        with common.if_drawable():
            from percussion_model.interface.plotting.effect_bars import draw_effects
            from percussion_model.interface.plotting.style import save_figures

            with progress("drawing the figure"):
                files = save_figures(lambda: [("effects", draw_effects(found))], claimed.folder)
            common.list_files([*files, claimed.sign()])


# Of an effect, in characters.
LONGEST_NAME = 14
# Behind a step that turning an effect off made dearer.
DEARER = "*"

RATE = "rate_of_penetration"
# An error below this share of a rate or a depth is not shown.
LEAST_ERROR = 1e-3
NOTE = (
    "± is the numerical error, by discretisation and the scatter of the blows; a rate "
    "without it is known to 0.1 %. % is the change against the scene as it is, {undecided} where "
    "it is within the errors of both, or within {sigmas:g} standard errors of their scatter. Times "
    "are the least of several."
)
# Added where it matters.
OF_LEAPS = "Leaps keep the modes: the ± of their changes is that of the scatter."

NOTE_OF_FALL = (
    "± is the discretisation error; a depth without it is known to 0.1 %. % "
    "is the change against the scene as it is, {undecided} where it is within the errors of both. "
    "Times are the least of several."
)

# Columns: heading, and what stands in it.
Columns = dict[str, Callable[["EffectsStudy", "VariantRun", dict[str, Any]], str]]
_COSTS: Columns = {
    "step\nns": lambda study, trial, row: (
        _number(row["step_time"], 1e9, 3) + DEARER * study.is_costlier(trial)
    ),
    "run\nms": lambda study, trial, row: _number(row["wall_time"], 1e3, 2),
    "blow\nµs": lambda study, trial, row: _number(row["blow_time"], 1e6, 2),
    "events": lambda study, trial, row: f"{row['events']}",
}
_OF_BLOWS: Columns = {
    "rate\nmm/s": lambda study, trial, row: _known(row, RATE),
    "rate\n%": lambda study, trial, row: _change(study, trial, RATE),
    "period\n%": lambda study, trial, row: _change(study, trial, "blow_period"),
    "peak\n%": lambda study, trial, row: _change(study, trial, "peak_bit_force"),
}
_OF_FALL: Columns = {
    "depth\nmm": lambda study, trial, row: _known(row, "depth"),
    "depth\n%": lambda study, trial, row: _change(study, trial, "depth"),
    "rebound\n%": lambda study, trial, row: _change(study, trial, "rebound_velocity"),
    "rest\n%": lambda study, trial, row: _change(study, trial, "rest_time"),
}


def table_of(found: EffectsStudy) -> tuple[list[str], list[list[str]], dict[str, str]]:
    """Headings, rows and the reasons of what is not shown, as text."""
    columns = _COSTS | (_OF_FALL if found.base.falls else _OF_BLOWS)
    rows, reasons = [], {}
    for trial in (found.base, *found.trials):
        numbers = trial.numbers()
        name = trial.variant.name
        rows.append([name, *(show(found, trial, numbers) for show in columns.values())])
        if trial.reason:
            reasons[name] = trial.reason
    headings = ["", *columns]
    # what no row has is left out: the reasons tell why
    told = [any(row[k] not in ("", "-") for row in rows) for k in range(len(headings))]
    rows = [[cell for cell, known in zip(row, told, strict=True) if known] for row in rows]
    headings = [text for text, known in zip(headings, told, strict=True) if known]
    return headings, rows, reasons | found.refused


def show_effects(found: EffectsStudy) -> None:
    """Print the table, and why something is missing from it."""
    from rich.markup import escape

    from percussion_model.interface.tables import airy_table, print_notes, print_table
    from percussion_model.interface.terminal import show_note, show_warnings

    headings, rows, reasons = table_of(found)
    look: dict[str, Any] = {"title_justify": "left", "pad_edge": False, "padding": 0}
    table = airy_table(headings, [""], title=escape(found.scene.title) or None, **look)
    for name, *cells in rows:
        # a longer name takes several lines
        name = textwrap.fill(name, LONGEST_NAME, subsequent_indent="  ", break_long_words=False)
        table.add_row(name, *cells)
    print_table(table)
    if any(map(found.is_costlier, found.trials)):
        show_note(DEARER, "turning the effect off made a time step costlier")
    for reason in dict.fromkeys(reasons.values()):
        names = ", ".join(name for name, given in reasons.items() if given == reason)
        show_note(names, reason)
    if len(found.base.result.counted) or found.base.result.fall:
        print_notes(_notes(found, rows))
    show_warnings(found.warnings())


def _notes(found: EffectsStudy, rows: list[list[str]]) -> Iterator[str]:
    """What the errors and signs are that the rows show."""
    from percussion_model.analysis.change import SIGMAS
    from percussion_model.analysis.effect_study import LEAPS

    form = NOTE_OF_FALL if found.base.falls else NOTE
    note = form.format(undecided=UNDECIDED, sigmas=SIGMAS)
    leaps = [trial for trial in found.trials if trial.variant.effect == LEAPS]
    if any("±" in found.change(trial, name).text() for trial in leaps for name in found.changed):
        note += f" {OF_LEAPS}"
    yield note
    if any(ABOUT in cell for row in rows for cell in row):
        yield ABOUT_CHANGE


def _known(row: dict[str, Any], key: str) -> str:
    """Rate of penetration [mm/s] or depth [mm], with its error where it matters."""
    value, error = row[key], row[f"{key}_error"]
    if key == RATE and row["rate_of_penetration_undecided"] and value is not None:
        return UNDECIDED
    if value is not None and error is None:
        return ABOUT + in_digits(1e3 * value)
    return in_few_characters(scaled(1e3, value), scaled(1e3, error), LEAST_ERROR)


def _number(value: float | None, factor: float, digits: int) -> str:
    """So many digits, without an exponent where the number is large."""
    return "-" if value is None else f"{float(f'{factor * value:.{digits}g}'):g}"


def _change(found: EffectsStudy, trial: VariantRun, name: str) -> str:
    return "" if trial is found.base else found.change(trial, name).text()
