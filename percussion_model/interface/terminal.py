"""Terminal output of the command line: tables and warnings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from itertools import groupby
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from percussion_model.interface.messages import wrapped
from percussion_model.interface.tables import airy_table, named_table, print_notes, print_table
from percussion_model.physics.gas import FREE_AIR
from percussion_model.scene.solver_names import counted
from percussion_model.simulation.driller_numbers import DRILLER_NUMBERS, driller_text
from percussion_model.simulation.uncertain import (
    ABOUT,
    ABOUT_CHANGE,
    ABOUT_NUMBER,
    NOT_THE_MODEL,
    TIMED,
    UNDECIDED,
    about_errors,
    in_digits,
    mean_text,
    of_the_cells,
    rate_text,
    with_error,
)

if TYPE_CHECKING:
    from percussion_model.analysis.comparison import Comparison
    from percussion_model.analysis.cost import Forecast
    from percussion_model.analysis.stationary import Settled
    from percussion_model.analysis.study import Study
    from percussion_model.scene.scene import Scene
    from percussion_model.simulation.result import Result
    from percussion_model.solvers.base import Solver
    from percussion_model.verification.hard_cases import Collection
    from percussion_model.verification.paper.statements import Statement

RATE = ("Rate of penetration", "rate_of_penetration", 1e3, "mm/s")
# Other rows of the table: name, key of the summary, factor, unit.
SHOWN = (
    ("Blow period", "blow_period", 1e3, "ms"),
    ("Blow frequency", "blow_frequency", 1.0, "Hz"),
    ("Impact velocity", "impact_velocity", 1.0, "m/s"),
    ("Blow energy", "blow_energy", 1.0, "J"),
    ("Energy transfer efficiency", "transfer_efficiency", 100.0, "%"),
    ("Penetration per blow", "penetration_per_blow", 1e3, "mm"),
    ("Contacts per blow", "contacts_per_blow", 1.0, ""),
    ("Drilling cycles per blow", "drilling_cycles_per_blow", 1.0, ""),
    ("Volume broken in a blow", "breaking_blow_volume", 1e6, "cm^3"),
    ("Turned in a blow, mean radius", "rotation_index", 1e3, "mm"),
    ("Torque of the rotation", "rotation_torque", 1.0, "N m"),
    ("Peak bit force", "peak_bit_force", 1e-3, "kN"),
    ("Peak contact force", "peak_contact_force", 1e-3, "kN"),
    ("Standstill bit force", "standstill_bit_force", 1e-3, "kN"),
    ("Free air (0 °C, 1 atm)", "pneumatic_air", 60.0 / FREE_AIR, "m³/min"),
    ("Oil", "hydraulic_oil", 6e4, "l/min"),
    ("Mean pressure of the oil", "hydraulic_pressure", 1e-5, "bar"),
    ("Power less the rebound", "net_percussive_power", 1e-3, "kW"),
    ("Percussive power by air power", "air_efficiency", 100.0, "%"),
)
# A smaller relative error of the wave speed is rounding.
LEAST_MISFIT = 1e-6
# The key of the number in the units of drillers that stands behind one of these.
BEHIND = {
    "rate_of_penetration": "rate_of_penetration",
    "blow_frequency": "blow_frequency",
    "blow_energy": "percussive_power",
    "transfer_efficiency": "specific_energy",
}
# Instead of them where there are no blows: name, key of `Result.fall`, factor, unit.
WITHOUT_BLOWS = (
    ("Depth of the bit's end in the rock", "depth", 1e3, "mm"),
    ("First contact with the rock", "first_contact", 1e3, "ms"),
    ("First rebound velocity of the bit", "rebound_velocity", 1.0, "m/s"),
    ("Stands still from", "rest_time", 1e3, "ms"),
    ("Peak bit force", "peak_bit_force", 1e-3, "kN"),
    ("Energy to crush rock", "crushed", 1.0, "J"),
    ("Energy transfer efficiency", "transfer_efficiency", 100.0, "%"),
)


def show_summary(result: Result) -> None:
    """Print the short table of a run, and its warnings."""
    summary = result.summary()
    table = Table(title=escape(result.scene.title) or None, show_header=False)
    table.add_column(justify="left", no_wrap=True)
    table.add_column(justify="right", no_wrap=True)
    table.add_column(justify="left")
    if len(result.blows):
        table.add_row(RATE[0], _in_two_lines(rate_text(summary)), RATE[3])
        _add_driller_row(table, summary, RATE[1])
    values = summary if len(result.blows) else summary["fall"] | {"errors": summary["errors"]}
    unknown = False
    for name, key, factor, unit in SHOWN if len(result.blows) else WITHOUT_BLOWS:
        if values.get(key) is not None:
            text = mean_text(values, key, factor)
            unknown = unknown or ABOUT in text
            table.add_row(name, _in_two_lines(text), unit)
            _add_driller_row(table, summary, key)
    energy = summary["energy"]
    for key in ("numerical", "residual"):
        share = energy[f"{key}_relative"]
        if share is not None:
            table.add_row(f"Energy ledger: {key}", f"{share:.2g}", "of input")
    table.add_section()
    if summary["hammer_pressure"] is not None:
        pressure = in_digits(1e-5 * summary["hammer_pressure"])
        table.add_row("Pressure at the hammer", pressure, "bar, at the end")
    table.add_row("Simulated", f"{result.duration:.6g}", "s")
    if result.scene.piston.model != "absent":
        after = f"{len(result.counted)} counted"
        table.add_row("Whole blows", f"{len(result.blows)}", after)
    table.add_row("Solver", result.solver, "")
    if result.cells:
        rods = result.scene.string.rods
        has_shank = len(rods) > 1 and rods[0].sections != rods[1].sections
        cells = _cells_of_bars(result.cells, has_shank)
        table.add_row(counted(result.solver).capitalize(), *cells)
    table.add_row("Prepared in", in_digits(result.setup_time, TIMED), "s")
    whose = "" if result.scene.solver.accuracy is None else ", all runs"
    table.add_row("Computed in", in_digits(result.wall_time, TIMED), f"s{whose}")
    table.add_row("Speed", in_digits(result.real_time_factor, TIMED), "× real time")
    print_table(table, keys=2)
    if len(result.counted) or result.fall:
        note = f" {ABOUT_NUMBER}." if unknown else ""
        print_notes([about_errors(summary) + note])
    show_warnings(result.warnings)


def _cells_of_bars(cells: Mapping[str, int], has_shank: bool) -> tuple[str, str]:
    """Cells of each bar and the names of the bars, of those of a drill string in short."""
    runs = [(count, len(list(same))) for count, same in groupby(cells.values())]
    counts = " + ".join(f"{many} × {count}" if many > 2 else " + ".join([str(count)] * many)
                        for count, many in runs)  # fmt: skip
    names = list(cells)
    if len(names) > 3:
        count = len(names) - 2 - has_shank
        names[1:-1] = ["shank"] * has_shank + [f"{count} rod{'s' * (count > 1)}"]
    return counts, ", ".join(names)


def _add_driller_row(table: Table, summary: Mapping[str, Any], key: str) -> None:
    """Add the number in the units of drillers that stands behind one in SI, if it is known."""
    other = BEHIND.get(key, "")
    if summary.get(other) is None:
        return
    one = DRILLER_NUMBERS[other]
    name = one.behind if other == key else one.name
    table.add_row(name, _in_two_lines(driller_text(summary, other)), one.unit)


def show_settled(found: Settled) -> None:
    """Print the stationary response of a scene."""
    summary = found.summary()
    table = named_table([("Motion", f"{found.motion}{on_other_grids(found)}")])
    if summary[RATE[1]] is not None:
        table.add_row(RATE[0], f"{rate_text(summary)} {RATE[3]}")
        one = DRILLER_NUMBERS[RATE[1]]
        table.add_row(one.behind, _with_driller_unit(summary, RATE[1]))
    if summary["blow_period"] is not None:
        for name, key, factor, unit in SHOWN:
            if summary.get(key) is not None:
                table.add_row(name, f"{mean_text(summary, key, factor)} {unit}")
    for key, one in DRILLER_NUMBERS.items():
        if key != RATE[1] and summary.get(key) is not None:
            table.add_row(one.behind or one.name, _with_driller_unit(summary, key))
    if summary["multiplier"] is not None:
        table.add_row("Stability multiplier", _deviation(found))
    table.add_row("Blows run", f"{len(found.blows)} in {found.duration:.4g} s of simulated time")
    table.add_row("Computed in", f"{in_digits(found.wall_time, TIMED)} s")
    print_table(table)
    if found.error_of:
        print_notes([settled_error(found)])
    show_warnings(found.warnings)


def _with_driller_unit(summary: Mapping[str, Any], key: str) -> str:
    return f"{driller_text(summary, key)} {DRILLER_NUMBERS[key].unit}"


def on_other_grids(found: Settled) -> str:
    """Say whether a motion is that of coarser grids; nothing where there is no grid."""
    if found.same_motion is None:
        has_grid = found.grid_errors.get(RATE[1]) != 0.0
        return "; on no second resolution tried" if has_grid else ""
    if found.same_motion:
        return "; the same on a second resolution"
    own = str(found.motion)
    seen = dict.fromkeys(text for text in map(str, found.others) if text != own)
    return f"; not the same on a second resolution: {' or '.join(seen)}"


def _deviation(found: Settled) -> str:
    """What is left of a deviation after a cycle, as far as that is known."""
    value, error = found.multiplier, found.multiplier_error
    return of_the_cells(value) if math.isnan(error) else with_error(value, error)


def settled_error(found: Settled) -> str:
    """Say what the ± of a stationary response is of, and what is not in it."""
    settling = "convergence" if found.error_of.endswith("convergence") else "the scatter of blows"
    grid = found.grid_errors.get(RATE[1])
    if grid is None:
        parts = f"{settling} alone, since the discretisation error was not estimated"
    elif grid == 0.0:
        parts = f"{settling} alone, since this solver has no grid"
    else:
        parts = f"discretisation and {settling}"
    careful = ""
    if found.same_motion is False:
        careful = (
            " Where a coarser resolution has another motion it may be many times that of a run, "
            "which is compared over its first blows."
        )
    return f"± is the numerical error, by {parts}.{careful} {NOT_THE_MODEL}"


def show_study(found: Study) -> None:
    """Print the headlines of a study."""
    print_table(named_table(found.headlines()))


def show_warnings(warnings: list[str]) -> None:
    """Print warnings, if there are any."""
    for text in warnings:
        show_note("warning", text)


def show_note(name: str, text: str) -> None:
    """Print a text behind its name in yellow, in lines that fit."""
    lines = Text(wrapped(f"{name}: {text}"))
    lines.stylize("yellow", 0, len(name) + 1)
    Console().print(lines, soft_wrap=True)


def _number(value: float | None) -> str:
    """Two digits of a number, or a dash where there is none."""
    return "-" if value is None else f"{value:.2g}"


def show_explanation(scene: Scene, found: Forecast) -> None:
    """Print what a scene computes, and its cost estimate."""
    from percussion_model.analysis.cost import FACTOR
    from percussion_model.analysis.stationary import MOST_TIME
    from percussion_model.scene.rocks.breaking import rock_of

    solver, effects = found.solver, scene.effects
    named = rock_of(scene)
    whose = f" (numbers of {named})" if named else ""
    why = f" (auto: {scene.why_solver})" if scene.why_solver else ""
    rows = [
        ("Effects on", ", ".join(scene.effects_on) or "none"),
        ("Effects off", ", ".join(scene.effects_off) or "none"),
        ("Without effect here", ", ".join(scene.unused) or "none"),
        ("Drive, rock", f"{effects.drive}, {effects.rock}{whose}"),
        ("Piston, bit", f"{scene.piston.model}, {scene.bit.model}"),
        *_scale_rows(scene),
        ("Solver", f"{solver.name}{why}"),
    ]
    table = named_table(rows, scene.title)
    if scene.solver.accuracy is not None:
        table.add_row("Wanted accuracy of the rate", f"{scene.solver.accuracy:g}")
    if solver.time_step is not None:
        cells = ", ".join(f"{count} in the {bar}" for bar, count in solver.cells.items())
        table.add_row(counted(solver.name).capitalize(), cells)
        table.add_row("Time step", f"{solver.time_step:.6g} s")
        if solver.wave_speed_error > LEAST_MISFIT:
            error = in_digits(100.0 * solver.wave_speed_error, TIMED)
            table.add_row("Wave speed error", f"{error} %")
    else:
        table.add_row("Steps", "from event to event, in closed form")
    if found.per_blow is not None:
        counts = ", ".join(f"{in_digits(value)} {name}" for name, value in found.counts.items())
        cost = in_digits(1e3 * found.per_blow, TIMED)
        table.add_row("A blow", f"{cost} ms to compute; {counts}")
    table.add_row("A simulated second", f"{in_digits(found.per_second, TIMED)} s to compute")
    runs = f", {found.runs} runs to compare" if found.runs > 1 else ""
    within = f"within a factor of {FACTOR:g}"
    if scene.solver.accuracy is not None:
        within += " if the motion is periodic"
    time = in_digits(found.wall_time, TIMED)
    whole = f"about {time} s ({within}) for {found.duration:g} s simulated{runs}"
    table.add_row("Predicted cost of the run", f"{whole}{_cost_of_errors(scene, solver)}")
    memory = (
        f"; {in_digits(solver.operator_bytes / 1e6, TIMED)} MB" if solver.operator_bytes else ""
    )
    table.add_row("To prepare", f"{in_digits(found.setup_time, TIMED)} s{memory}")
    if found.settled_time is not None and found.settled_time > MOST_TIME:
        words = (
            f"up to {in_digits(found.settled_time, TIMED)} s, and given up after {MOST_TIME:g} s "
            "(--most-time)"
        )
        table.add_row("percussion settled", words)
    if found.refused:
        table.add_row("Ceiling", found.refused)
    print_table(table)


def _cost_of_errors(scene: Scene, solver: Solver) -> str:
    """Say what the errors of the numbers of a run add to its cost; nothing if they are not asked.

    Parameters
    ----------
    scene : Scene
    solver : Solver
        Of the scene.
    """
    if scene.solver.accuracy is not None or not scene.run.error_estimate:
        return ""
    coarser = solver.coarser_scenes()
    if scene.is_undamped:
        return "; without loss its error by the cells is not known, and no run looks for it"
    if coarser is None:
        return "; its error is not estimated: no coarser runs are known for this solver"
    if not coarser:
        return "; no short runs on top, since there are no cells whose error they would show"
    return "; the short runs that show its error come on top"


# Units that scales are shown in, by SI unit.
_SHOWN_SCALES = {"s": (1e3, " ms"), "m": (1e3, " mm"), "-": (1.0, "")}


def _scale_rows(scene: Scene) -> Iterator[tuple[str, str]]:
    """Scales of a scene by name, with the paper's symbols."""
    from percussion_model.scene.scales import scales

    for name, scale in scales(scene).items():
        factor, unit = _SHOWN_SCALES[scale.unit]
        label = f"{name.replace('_', ' ').capitalize()} ({scale.symbol})"
        yield label, f"{factor * scale.value:.4g}{unit}"


def show_comparison(found: Comparison) -> None:
    """Print the numbers of several solvers, each beside its difference to the first."""
    summaries, changes = found.compared(), found.changes()
    title = escape(found.results[found.first].scene.title) or None
    off = {name: [f"{name}\noff, %"] if name in changes else [] for name in summaries}
    headings = ["", *(one for name in summaries for one in (name, *off[name]))]
    table = airy_table(headings, [""], [""], title=title, pad_edge=False, padding=0)
    shown = []
    for label, key, factor, unit in WITHOUT_BLOWS if found.is_fall else (RATE, *SHOWN):
        if all(summary[key] is None for summary in summaries.values()):
            continue
        cells = []
        for name, summary in summaries.items():
            if summary[key] is None:
                cells.append("-")
            elif key == RATE[1]:
                cells.append(_narrow(rate_text(summary)))
            else:
                cells.append(_narrow(mean_text(summary, key, factor)))
            if name in changes:
                cells.append(changes[name][key].text() if key in changes[name] else "-")
        table.add_row(f"{label}, {unit}" if unit else label, *cells)
        shown += cells
    table.add_section()
    for label, value in _EFFORT.items():
        cells = []
        for name, summary in found.summaries().items():
            found_here = value(summary)
            cells.append("-" if found_here is None else in_digits(found_here, TIMED))
            cells += [""] * (name in changes)
        table.add_row(label, *cells)
    # a solver and its changes stay together
    print_table(table, groups=[1, *[2] * len(changes)])
    print_notes(_about_comparison(found, " ".join(shown)))
    show_warnings(found.warnings())


def _about_comparison(found: Comparison, shown: str) -> Iterator[str]:
    """What the errors are of the numbers that are shown, once for solvers that are alike."""
    from percussion_model.analysis.change import SIGMAS

    told: dict[str, list[str]] = {}
    for name, result in found.results.items():
        if len(result.counted) or result.fall:
            told.setdefault(about_errors(result.summary()), []).append(name)
    for note, names in told.items():
        yield note if len(told) == 1 else f"{', '.join(names)}: {note}"
    if UNDECIDED in shown:
        yield (
            f"A difference within the errors of both numbers, or {SIGMAS:g} standard errors of "
            f"their scatter, is {UNDECIDED}."
        )
    if ABOUT in shown:
        yield ABOUT_CHANGE


def _narrow(text: str) -> str:
    """A number with its error in few characters, words in a line of their own."""
    return _in_two_lines(text).replace(" ± ", "±")


def _in_two_lines(text: str) -> str:
    """A number, and in a line of its own the word that stands before or behind it."""
    return text.replace(", ", "\n")


# Cost of a run and closure of its ledger: name, and where in a summary.
_EFFORT: dict[str, Callable[[dict[str, Any]], float | None]] = {
    "Computed in, s": lambda summary: summary["wall_time"],
    "Times real time": lambda summary: summary["real_time_factor"],
    "Ledger: numerical": lambda summary: summary["energy"]["numerical_relative"],
    "Ledger: residual": lambda summary: summary["energy"]["residual_relative"],
}


def show_stability(found: Collection) -> None:
    """Print the measures of each solver on each hard case, and the failures."""
    from percussion_model.verification.hard_cases.collection import DISAGREE, short_rate

    keys, numbers = ("case", "solver"), ("mm/s", "residual", "momentum", "events/s", "guards", "s")
    table = airy_table(keys + numbers, keys, padding=(0, 1, 0, 0))
    for row in found.rows:
        table.add_row(
            row["case"],
            row["solver"],
            short_rate(row),
            *(_number(row[key]) for key in ("residual", "momentum", "events_per_second")),
            str(row["guards"] or ""),
            in_digits(row["wall_time"], TIMED),
        )
    print_table(table, keys=2)
    show_warnings(found.failures())
    cases = len({row["case"] for row in found.rows})
    failed = len(found.failures())
    decided = [entry["decided"] for entry in found.disagreements()]
    most = f"{DISAGREE:.0%}".replace("%", " %")
    verdict = (
        f"{_counted(cases, 'case')}, {_counted(len(found.rows), 'run')}, "
        f"{_counted(failed, 'failure')}. More than {most} off the "
        f"first solver's rate: {sum(decided)}; undecided, since their errors reach so far: "
        f"{len(decided) - sum(decided)}."
    )
    errors = f"{found.about_errors()} {NOT_THE_MODEL}"
    print_notes([errors, verdict, *found.about_left_out()])


def _counted(count: int, what: str) -> str:
    """Number and word, in the plural where it is not one."""
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def show_statements(statements: list[Statement], errors: str) -> None:
    """Print what the paper says beside what was found, and what its errors are."""
    table = Table(box=None, show_header=False, padding=(0, 1, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column()
    for one in statements:
        verdict = "[green]agrees[/green]" if one.agrees else "[yellow]differs[/yellow]"
        table.add_row(verdict, f"[bold]{escape(one.place)}[/bold]")
        table.add_row("", f"the paper says: {escape(one.says)}")
        table.add_row("", f"found here: {escape(one.found)}")
        if one.agrees_if:
            table.add_row("", f"agrees if: {escape(one.agrees_if)}")
        if one.why and not one.agrees:
            table.add_row("", f"why: {escape(one.why)}")
        table.add_row("", "")
    print_table(table)
    Console().print(errors, highlight=False)
