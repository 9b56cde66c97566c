"""What the command line shows: tables, and a progress bar for long runs."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from percussion_model.analysis.cost import Forecast
    from percussion_model.analysis.stationary import Settled
    from percussion_model.analysis.study import Study
    from percussion_model.scene.scene import Scene
    from percussion_model.simulation.result import Result

# A run that ends sooner shows no bar [s].
_PATIENCE = 2.0

# Rows of the table: name, key of the summary, factor, unit.
SHOWN = (
    ("Rate of penetration", "rate_of_penetration", 1e3, "mm/s"),
    ("Rate: estimated error", "rate_of_penetration_relative_error", 100.0, "%"),
    ("Blow period", "blow_period", 1e3, "ms"),
    ("Blow frequency", "blow_frequency", 1.0, "Hz"),
    ("Impact velocity", "impact_velocity", 1.0, "m/s"),
    ("Blow energy", "blow_energy", 1.0, "J"),
    ("Energy transfer efficiency", "transfer_efficiency", 100.0, "%"),
    ("Penetration per blow", "penetration_per_blow", 1e3, "mm"),
    ("Contacts per blow", "contacts_per_blow", 1.0, ""),
    ("Drilling cycles per blow", "drilling_cycles_per_blow", 1.0, ""),
    ("Peak bit force", "peak_bit_force", 1e-3, "kN"),
    ("Peak contact force", "peak_contact_force", 1e-3, "kN"),
    ("Standstill bit force", "standstill_bit_force", 1e-3, "kN"),
)

ONLY_WHERE_KNOWN = ("rate_of_penetration_relative_error",)


def show_summary(result: Result) -> None:
    """Print the short table of a run, and its warnings."""
    summary = result.summary()
    table = Table(title=escape(result.scene.title) or None, show_header=False)
    table.add_column(justify="left")
    table.add_column(justify="right")
    table.add_column(justify="left")
    for name, key, factor, unit in SHOWN:
        value = summary[key]
        if key in ONLY_WHERE_KNOWN and value is None:
            continue
        table.add_row(name, "-" if value is None else f"{factor * value:.5g}", unit)
    energy = summary["energy"]
    for key in ("numerical", "residual"):
        share = energy[f"{key}_relative"]
        shown = "-" if share is None else f"{share:.2g}"
        table.add_row(f"Energy ledger: {key}", shown, "of energy put in")
    table.add_section()
    table.add_row("Simulated", f"{result.duration:.6g}", "s")
    table.add_row("Whole blows", f"{len(result.blows)}", f"{len(result.counted)} after settling")
    table.add_row("Computed in", f"{result.wall_time:.3g}", "s")
    table.add_row("Speed", f"{result.real_time_factor:.3g}", "times real time")
    console = Console()
    console.print(table)
    show_warnings(console, result.warnings)


def show_settled(found: Settled) -> None:
    """Print the stationary response of a scene."""
    summary = found.summary()
    table = Table(show_header=False)
    order = {0: "", 1: ", every blow alike"}.get(found.order, f", {found.order} blows a cycle")
    table.add_row("Motion", f"{found.kind}{order}")
    for name, key, factor, unit in (
        ("Rate of penetration", "rate_of_penetration", 1e3, "mm/s"),
        ("  error of it", "rate_of_penetration_error", 1e3, "mm/s"),
        ("Blow period", "blow_period", 1e3, "ms"),
        ("Multiplier of the cycle", "multiplier", 1.0, ""),
    ):
        table.add_row(name, f"{number(summary[key], factor)} {unit}".rstrip())
    table.add_row("Blows run", f"{len(found.blows)} in {found.duration:.4g} s")
    Console().print(table)


def show_study(found: Study, files: list[Path]) -> None:
    """Print what a study found, in short, and where it is."""
    from percussion_model.analysis.study import headlines

    table = Table(show_header=False)
    for name, text in headlines(found):
        table.add_row(name, text)
    table.add_row("Written", ", ".join(str(path) for path in files))
    console = Console()
    console.print(table)
    failed = [k for k, text in enumerate(found.failures) if text]
    if failed:
        first = f"{found.points.changes(failed[0])}: {found.failures[failed[0]]}"
        show_warnings(console, [f"{len(failed)} points failed, the first at {first}"])


def show_warnings(console: Console, warnings: list[str]) -> None:
    """Print warnings, if there are any."""
    for text in warnings:
        console.print(f"[yellow]warning:[/yellow] {escape(text)}", highlight=False)


def number(value: float | None, factor: float, digits: int = 5) -> str:
    """Show a number in other units, `digits` of it, or a dash where there is none."""
    return "-" if value is None else f"{factor * value:.{digits}g}"


def show_explanation(scene: Scene, found: Forecast) -> None:
    """Print what would be computed and what it will cost."""
    solver = found.solver
    table = Table(title=escape(scene.title) or None, show_header=False)
    table.add_row("Effects on", ", ".join(scene.effects_on) or "none")
    table.add_row("Effects off", ", ".join(scene.effects_off) or "none")
    table.add_row("Without effect here", ", ".join(scene.unused) or "none")
    effects = scene.effects
    table.add_row("Drive, rock", f"{effects.drive}, {effects.rock}")
    table.add_row("Piston, bit", f"{scene.piston.model}, {scene.bit.model}")
    table.add_row("Solver", scene.solver_name)
    if scene.solver.accuracy is not None:
        table.add_row("Wanted accuracy of the rate", f"{scene.solver.accuracy:g}")
    if solver is None or scene.solver_name == "blow-map":
        table.add_row("Steps", "from blow to blow, out of a table")
    elif solver.time_step is not None:
        cells = ", ".join(f"{count} in the {bar}" for bar, count in solver.cells.items())
        table.add_row("Cells", cells)
        table.add_row("Time step", f"{solver.time_step:.6g} s")
        table.add_row("Wave speed error", f"{100.0 * solver.wave_speed_error:.2g} %")
    else:
        table.add_row("Steps", "from event to event, in closed form")
    if found.per_blow is not None:
        counts = ", ".join(f"{value:.3g} {name}" for name, value in found.counts.items())
        table.add_row("A blow", f"{1e3 * found.per_blow:.3g} ms; {counts}")
    if found.per_second is not None:
        table.add_row("A simulated second", f"{found.per_second:.3g} s")
    if found.wall_time is not None:
        runs = f", {found.runs} runs to compare" if found.runs > 1 else ""
        whole = f"about {found.wall_time:.2g} s for {found.duration:g} s simulated{runs}"
        table.add_row("Predicted cost of the run", whole)
    if found.blow_map is not None:
        blows, cost = found.blow_map
        words = f"not made yet: {blows:,} blows, about {cost:.2g} s of one processor"
        table.add_row("Blow map", words)
        table.add_row(
            "", "the first run makes it, or percussion blow-map; then a run can be predicted"
        )
    table.add_row("To prepare", f"{found.setup_time:.2g} s")
    Console().print(table)


@contextmanager
def progress_bar(end: float) -> Iterator[Callable[[float], None] | None]:
    """Show a bar on stderr once a run in a terminal takes long.

    Yields
    ------
    callable or None
        To be called with the simulated time reached [s].
    """
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns: list[Any] = [TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn()]
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    task = bar.add_task("Preparing (the first run compiles, about a minute)", total=None)
    starter = threading.Timer(_PATIENCE, bar.start)
    starter.daemon = True
    starter.start()
    try:
        yield _reporter(bar, task, end)
    finally:
        starter.cancel()
        starter.join()
        bar.stop()


@contextmanager
def waiting_bar() -> Iterator[None]:
    """Say on stderr that a long preparation goes on, in a terminal."""
    with progress_bar(0.0):
        yield


@contextmanager
def count_bar(what: str) -> Iterator[Callable[[int, int], None] | None]:
    """Show on stderr how many of a number of things are done, in a terminal.

    Yields
    ------
    callable or None
        To be called with the number done and that of all.
    """
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    columns: list[Any] = [BarColumn(), MofNCompleteColumn(), what, TimeRemainingColumn()]
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _reporter(bar: Progress, task: TaskID, end: float) -> Callable[[float], None]:
    def report(t: float) -> None:
        bar.update(task, completed=t, total=max(t, end), description=f"{t:.4g} s of {end:g} s")

    return report
