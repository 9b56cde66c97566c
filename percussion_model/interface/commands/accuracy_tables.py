"""Tables of an accuracy study."""

from __future__ import annotations

import math
from math import isfinite

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from percussion_model.verification.accuracy.ladders import LADDERS
from percussion_model.verification.accuracy.problems import APERIODIC, HISTORY, QUANTITIES
from percussion_model.verification.accuracy.references import Reference
from percussion_model.verification.accuracy.study import FITS, WANTED, Study

_SHORT = {
    "rate_of_penetration": "rate",
    "blow_period": "period",
    "impact_velocity": "impact",
    "rebound_velocity": "rebound",
    "rock_energy": "energy",
    "peak_bit_force": "peak",
    "resting_place": "rest",
    HISTORY: "force L1",
}
# Narrower, and numbers would be cut short.
LEAST_WIDTH = 98
_GENERAL = ("lsoda", "lsoda-tol", "radau", "rk45", "dop853", "bdf")
_ELEMENTS = ("fem", "fem-time", "fem-paper", "fem-gauss")


def show_study(found: Study) -> None:
    """Print reference, points, orders, what accuracies cost, and advice."""
    # room for all columns, however narrow the terminal
    console = Console(width=max(Console().width, LEAST_WIDTH))
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
            "" if key == HISTORY else f"{quantity.factor * bar.value:.7g}",
            _number(abs(bar.error / bar.value)),
            _number(abs(bar.wave - bar.fem) / abs(bar.value)),
            "" if bar.agreed else "no reference: the limits disagree",
        )
    (console or Console()).print(table)


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
    what = "Relative standard error" if found.problem.kind == APERIODIC else "Relative error"
    table = _table(f"{what}; ms to compute a simulated second; ms of set-up", "method")
    for heading in (*(_SHORT[key] for key in found.problem.quantities), "ms/s", "set-up"):
        table.add_column(heading, justify="right", no_wrap=True)
    for name in found.names:
        table.add_row(f"[bold]{LADDERS[name].title}[/bold]")
        for point in found.ladder(name):
            label = point.label + (" *" if point.fit > FITS else "")
            errors = [_number(point.errors.get(key, math.nan)) for key in found.problem.quantities]
            times = [f"{1e3 * value:.3g}" for value in (point.second, point.setup)]
            table.add_row(f" {label}", *errors, *times)
    console.print(table)
    per_blow = found.problem.period
    console.print(f"A blow takes {per_blow:.4g} s; its cost is that part of ms/s.", highlight=False)
    if any(point.fit > FITS for point in found.points):
        console.print(
            "* Lengths that fit no common cell: the wave speed is off, the rung lies off the "
            "ladder and is not in its order.",
            highlight=False,
        )


def _show_orders(found: Study, console: Console) -> None:
    table = _table("Measured orders, each against what the method refines", "method")
    for key in found.problem.quantities:
        table.add_column(_SHORT[key], justify="right", no_wrap=True)
    for name in found.names:
        cells = []
        for key in found.problem.quantities:
            order = found.order(name, key)
            cells.append("-" if order is None else f"{order.value:.1f}±{order.error:.1f}")
        table.add_row(LADDERS[name].title, *cells)
    console.print(table)
    if "rigid" in found.names and found.problem.kind != APERIODIC:
        console.print(f"rigid: {LADDERS['rigid'].note}.", highlight=False)


def _show_costs(found: Study, console: Console) -> None:
    """Print the cost of accuracies of the first quantity, best of each family."""
    key = found.problem.main
    table = _table(f"ms to compute a simulated second, for an error in {_SHORT[key]}", "error")
    for heading in ("wave", "best fem", "by wave", "best of scipy", "by wave"):
        table.add_column(heading, justify="right", no_wrap=True)
    for wanted in (1e-2, 5e-3, 2e-3, 1e-3, 5e-4):
        wave = found.cost("wave", key, wanted)
        cells = [f"{1e3 * wave:.3g}" if isfinite(wave) else "-"]
        for family in (_ELEMENTS, _GENERAL):
            name, cost = found.cheapest(list(family), key, wanted)
            known = isfinite(cost)
            cells.append(f"{1e3 * cost:.3g} ({LADDERS[name].title})" if known else "-")
            cells.append(f"{cost / wave:.3g}" if known and isfinite(wave) else "-")
        table.add_row(f"{100 * wanted:g} %", *cells)
    console.print(table)
