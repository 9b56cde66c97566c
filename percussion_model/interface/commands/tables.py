"""Tables of the commands that set solvers, cases or statements side by side."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from percussion_model.interface.terminal import ONLY_WHERE_KNOWN, SHOWN, number, show_warnings

if TYPE_CHECKING:
    from percussion_model.analysis.comparison import Comparison
    from percussion_model.verification.hard_cases import Collection
    from percussion_model.verification.paper.statements import Statement


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
    for label, key, factor, unit in SHOWN:
        if key in ONLY_WHERE_KNOWN:
            continue
        cells = []
        for name, summary in summaries.items():
            cells.append(number(summary[key], factor))
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
    show_warnings(console, found.warnings())


# How dear a run was and how true to its ledger: name, and where in a summary.
_EFFORT: dict[str, Callable[[dict[str, Any]], float | None]] = {
    "Computed in, s": lambda summary: summary["wall_time"],
    "Times real time": lambda summary: summary["real_time_factor"],
    "Ledger: numerical": lambda summary: summary["energy"]["numerical_relative"],
    "Ledger: residual": lambda summary: summary["energy"]["residual_relative"],
}


def show_stability(found: Collection) -> None:
    """Print what each solver made of each hard case, and what does not hold."""
    table = Table()
    for name in ("case", "solver"):
        table.add_column(name, no_wrap=True)
    for name in ("mm/s", "residual", "momentum", "events/s", "guards", "s"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in found.rows:
        table.add_row(
            row["case"],
            row["solver"],
            number(row["rate"], 1e3, 4),
            *(number(row[key], 1.0, 2) for key in ("residual", "momentum", "events_per_second")),
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


def show_statements(said: list[Statement]) -> None:
    """Print what the paper says beside what was found."""
    table = Table(show_lines=True)
    for heading in ("section", "the paper says", "found here", ""):
        table.add_column(heading)
    for one in said:
        verdict = "[green]agrees[/green]" if one.agrees else "[yellow]differs[/yellow]"
        table.add_row(one.place, escape(one.says), escape(one.found), verdict)
    console = Console()
    console.print(table)
    for one in said:
        if one.why and not one.agrees:
            console.print(f"{one.place}: {escape(one.why)}", highlight=False)
