"""Tables of an accuracy study."""

from __future__ import annotations

import math
from math import isfinite

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from percussion_model.interface.tables import print_table
from percussion_model.verification.accuracy.advantage import (
    MET,
    MISSED,
    PEER_MISSES,
    Contest,
    contest,
    summary,
)
from percussion_model.verification.accuracy.ladders import FITS, LADDERS
from percussion_model.verification.accuracy.orders import Cost
from percussion_model.verification.accuracy.problems import (
    APERIODIC,
    CONTACT_HISTORY,
    HISTORIES,
    HISTORY,
    QUANTITIES,
    STRESS_HISTORY,
)
from percussion_model.verification.accuracy.references import Reference
from percussion_model.verification.accuracy.study import WANTED, Study

SHORT = {
    "rate_of_penetration": "rate",
    "blow_period": "period",
    "impact_velocity": "impact",
    "rebound_velocity": "rebound",
    "rock_energy": "energy",
    "peak_bit_force": "bit peak",
    "peak_contact_force": "contact peak",
    "peak_stress": "stress peak",
    "resting_place": "rest",
    HISTORY: "bit L1",
    CONTACT_HISTORY: "contact L1",
    STRESS_HISTORY: "stress L1",
}


def show_study(found: Study) -> None:
    """Print reference, points, orders, what accuracies cost, and advice."""
    console = Console()
    show_bars(found.reference, console)
    _show_points(found, console)
    _show_orders(found, console)
    _show_costs(found, console)
    for wanted in WANTED:
        console.print(found.advice(wanted), highlight=False)
    for point in found.points:
        if point.note:
            title = LADDERS[point.ladder].title
            console.print(f"{title}, {point.label}: {escape(point.note)}", highlight=False)
    starts = ", ".join(f"{name} {time:.2g} s" for name, time in found.compilation.items())
    console.print(f"First set-up in this process, compilation or its cache included: {starts}.")
    here = found.machine
    load = "" if here["load"] is None else f", load {here['load']:.1f}"
    console.print(f"{here['processor']}, {here['cores']} cores{load}; Python {here['python']}.")


def show_bars(reference: Reference, console: Console | None = None) -> None:
    """Print a reference with its bars, and how far apart the limits of the two solvers are."""
    table = _table(f"Reference: {escape(reference.title)}", "quantity")
    for heading in ("value", "bar", "apart"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("")
    for key, bar in reference.bars.items():
        quantity = QUANTITIES[key]
        label = f"{quantity.label}, {quantity.unit}" if quantity.unit else quantity.label
        table.add_row(
            label,
            "" if key in HISTORIES else f"{quantity.factor * bar.value:.7g}",
            _number(abs(bar.error / bar.value)),
            _number(bar.apart),
            "" if bar.agreed else "no reference: the limits disagree",
        )
    print_table(table, console)


def _table(title: str, first: str) -> Table:
    """An airy table: the columns of numbers need the room."""
    table = Table(
        title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False
    )
    table.add_column(first, no_wrap=True)
    return table


def _number(value: float) -> str:
    """Two digits, in few characters."""
    return f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e+") if isfinite(value) else "-"


def _show_points(found: Study, console: Console) -> None:
    what = "Relative standard error" if found.kind == APERIODIC else "Relative error"
    keys = found.quantities
    table = _table(f"{what}; ms to compute a simulated second; ms of set-up", "method")
    for heading in ("ms/s", "set-up", *(SHORT[key] for key in keys)):
        table.add_column(heading.replace(" ", "\n"), justify="right", no_wrap=True)
    for name in found.names:
        table.add_row(f"[bold]{LADDERS[name].title}[/bold]")
        for point in found.ladder(name):
            label = point.label + (" *" if point.fit > FITS else "")
            errors = [_number(point.errors.get(key, math.nan)) for key in keys]
            times = [two(1e3 * value) for value in (point.second, point.setup)]
            table.add_row(f" {label}", *times, *errors)
    print_table(table, console)
    console.print(
        f"A blow takes {found.period:.4g} s; its cost is that part of ms/s.", highlight=False
    )
    if any(point.fit > FITS for point in found.points):
        console.print(
            "* Lengths that fit no common cell: the wave speed is off, the rung lies off the "
            "ladder and is not in its order.",
            highlight=False,
        )


def _show_orders(found: Study, console: Console) -> None:
    keys = [key for key in found.quantities if any(found.order(name, key) for name in found.names)]
    table = _table("Measured orders, each against what the method refines", "method")
    for key in keys:
        table.add_column(SHORT[key].replace(" ", "\n"), justify="right", no_wrap=True)
    for name in found.names:
        orders = [found.order(name, key) for key in keys]
        cells = ["-" if one is None else f"{one.value:.1f}±{one.error:.1f}" for one in orders]
        table.add_row(LADDERS[name].title, *cells)
    print_table(table, console)
    if "rigid" in found.names and found.kind != APERIODIC:
        console.print(f"rigid: {LADDERS['rigid'].note}.", highlight=False)


def _show_costs(found: Study, console: Console) -> None:
    """Print what errors of the first quantity cost the waves, and the best of each family."""
    table = _table(
        f"ms to compute a simulated second, for an error in {SHORT[found.main]}", "error"
    )
    for heading in ("wave", "without\nleaps", "best peer", "best fem", "best of scipy"):
        table.add_column(heading, justify="right", no_wrap=True)
    for wanted in WANTED:
        costs = [found.cost(name, found.main, wanted) for name in ("wave", "wave-steps")]
        cells = [f"{1e3 * cost.value:.3g}" if isfinite(cost.value) else "-" for cost in costs]
        for family in ("peer", "fem", "scipy"):
            best = found.best((family,), found.main, wanted)
            title = "" if best is None else LADDERS[best.ladder].title
            cells.append("-" if best is None else f"{1e3 * best.value:.3g} ({title})")
        table.add_row(f"{100 * wanted:g} %", *cells)
    print_table(table, console)


def show_contests(studies: dict[str, Study]) -> None:
    """Print waves against the best of their peers, all scenes in one table, and the ratios."""
    console = Console()
    table = _table("The same error in rate: ms to compute a simulated second", "scene")
    for heading in ("error", "wave", "best peer", "ratio"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("the peer")
    found = [[contest(one, wanted) for wanted in WANTED] for one in studies.values()]
    for name, contests in zip(studies, found, strict=True):
        for k, one in enumerate(contests):
            table.add_row(
                escape(name) if k == 0 else "", f"{100 * one.wanted:g} %", *_contest_cells(one)
            )
        table.add_section()
    print_table(table, console, keys=2)
    for column in zip(*found, strict=True):
        told = summary(column)
        text = f"{100 * told.wanted:g} %: no scene is decided."
        if isfinite(told.median):
            text = (
                f"{100 * told.wanted:g} %: ratio {two(told.luckiest)} at the luckiest, "
                f"{two(told.median)} at the median, {two(told.worst)} at the worst of "
                f"{told.scenes - told.undecided} scenes; {told.undecided} undecided."
            )
        console.print(text, highlight=False)


def _contest_cells(one: Contest) -> tuple[str, str, str, str]:
    """Times of the waves and of the best peer, the ratio, each with its range; the peer's name."""
    peer, name = "-", ""
    if one.peer is not None:
        peer, name = _cost_text(one.peer), LADDERS[one.peer.ladder].title
    ratio = {
        MET: f"{two(one.ratio)} ({two(one.low)}-{two(one.high)})",
        PEER_MISSES: f"above {two(one.ratio)}",
        MISSED: f"below {two(one.ratio)}",
    }
    return _cost_text(one.wave), peer, ratio.get(one.outcome, one.outcome), name


def _cost_text(cost: Cost) -> str:
    """Milliseconds with their range; what the reference cannot tell is undecided."""
    if isfinite(cost.value) and isfinite(cost.high):
        return f"{two(1e3 * cost.value)} ({two(1e3 * cost.low)}-{two(1e3 * cost.high)})"
    return "undecided" if isfinite(cost.low) else "not met"


def two(value: float) -> str:
    """Two digits without exponent."""
    return f"{float(f'{value:.2g}'):.0f}" if value >= 10.0 else f"{value:.2g}"
