"""What the command line shows: tables, and a progress bar for long runs."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from percussion_model.comparison import Comparison
    from percussion_model.hard_cases import Collection
    from percussion_model.result import Result
    from percussion_model.scene import Scene
    from percussion_model.solvers import Solver

# A run that ends sooner shows no bar [s].
_PATIENCE = 2.0

# Rows of the table: name, key of the summary, factor, unit.
_SHOWN = (
    ("Rate of penetration", "rate_of_penetration", 1e3, "mm/s"),
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


def show_summary(result: Result) -> None:
    """Print the short table of a run, and its warnings."""
    summary = result.summary()
    table = Table(title=escape(result.scene.title) or None, show_header=False)
    table.add_column(justify="left")
    table.add_column(justify="right")
    table.add_column(justify="left")
    for name, key, factor, unit in _SHOWN:
        value = summary[key]
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


def show_warnings(console: Console, warnings: list[str]) -> None:
    """Print warnings, if there are any."""
    for text in warnings:
        console.print(f"[yellow]warning:[/yellow] {escape(text)}", highlight=False)


def show_comparison(found: Comparison) -> None:
    """Print the numbers of several solvers, each beside its difference to the first."""
    summaries, differences = found.summaries(), found.differences()
    title = found.results[found.first].scene.title
    table = Table(title=escape(title) or None)
    table.add_column("", min_width=22)
    for name in summaries:
        table.add_column(name, justify="right", no_wrap=True)
        if name in differences:
            table.add_column("off, %", justify="right", no_wrap=True)
    for label, key, factor, unit in _SHOWN:
        cells = []
        for name, summary in summaries.items():
            cells.append(_number(summary[key], factor))
            if name in differences:
                off = differences[name].get(key)
                cells.append("-" if off is None else f"{100.0 * off:+.2f}")
        table.add_row(f"{label}, {unit}" if unit else label, *cells)
    table.add_section()
    for label, value in _EFFORT.items():
        cells = []
        for name, summary in summaries.items():
            found_here = value(summary)
            cells.append("-" if found_here is None else f"{found_here:.2g}")
            cells += [""] * (name in differences)
        table.add_row(label, *cells)
    console = Console()
    console.print(table)
    for name, result in found.results.items():
        show_warnings(console, [f"{name}: {text}" for text in result.warnings])


# How dear a run was and how true to its ledger: name, and where in a summary.
_EFFORT: dict[str, Callable[[dict[str, Any]], float | None]] = {
    "Computed in, s": lambda summary: summary["wall_time"],
    "Times real time": lambda summary: summary["real_time_factor"],
    "Ledger: numerical": lambda summary: summary["energy"]["numerical_relative"],
    "Ledger: residual": lambda summary: summary["energy"]["residual_relative"],
}


def _number(value: float | None, factor: float) -> str:
    return "-" if value is None else f"{factor * value:.5g}"


def show_stability(found: Collection) -> None:
    """Print what each solver made of each hard case, and what does not hold."""
    table = Table()
    for name in ("case", "solver"):
        table.add_column(name, no_wrap=True)
    for name in ("rate, mm/s", "residual", "momentum", "events/s", "guards", "computed in, s"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in found.rows:
        table.add_row(
            row["case"],
            row["solver"],
            _number(row["rate"], 1e3),
            *(_number(row[key], 1.0) for key in ("residual", "momentum", "events_per_second")),
            str(row["guards"] or ""),
            f"{row['wall_time']:.2g}",
        )
    console = Console()
    console.print(table)
    show_warnings(console, found.failures())
    cases = len({row["case"] for row in found.rows})
    failed = len(found.failures())
    console.print(
        f"{cases} cases, {len(found.rows)} runs, {failed} failures, "
        f"{len(found.disagreements())} rates more than 2 % off the first solver's"
    )


def show_explanation(scene: Scene, solver: Solver, cost: dict[str, float]) -> None:
    """Print what would be computed and what it costs."""
    table = Table(title=escape(scene.title) or None, show_header=False)
    table.add_row("Effects on", ", ".join(scene.effects_on) or "none")
    table.add_row("Effects off", ", ".join(scene.effects_off) or "none")
    table.add_row("Without effect here", ", ".join(scene.unused) or "none")
    effects = scene.effects
    table.add_row("Drive, rock", f"{effects.drive}, {effects.rock}")
    table.add_row("Piston, bit", f"{scene.piston.model}, {scene.bit.model}")
    table.add_row("Solver", solver.name)
    if solver.time_step is not None:
        cells = ", ".join(f"{count} in the {bar}" for bar, count in solver.cells.items())
        table.add_row("Cells", cells)
        table.add_row("Time step", f"{solver.time_step:.6g} s")
        table.add_row("Wave speed error", f"{100.0 * solver.wave_speed_error:.2g} %")
    else:
        table.add_row("Steps", "from event to event, in closed form")
    table.add_row("Measured cost", _cost(cost))
    whole = cost["wall_time"] / cost["duration"] * scene.run.duration
    table.add_row("Whole run", f"about {whole:.2g} s for {scene.run.duration:g} s simulated")
    Console().print(table)


def _cost(cost: dict[str, float]) -> str:
    text = f"{cost['wall_time'] / cost['duration']:.3g} s a simulated second"
    if cost["blows"]:
        text += f", {1e6 * cost['wall_time'] / cost['blows']:.3g} µs a blow"
    return text


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


def _reporter(bar: Progress, task: TaskID, end: float) -> Callable[[float], None]:
    def report(t: float) -> None:
        bar.update(task, completed=t, total=end, description=f"{t:.4g} s of {end:g} s")

    return report
