"""Tables of an accuracy study."""

from __future__ import annotations

import math
from math import isfinite

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from percussion_model.interface.tables import airy_table, print_table
from percussion_model.simulation.uncertain import in_digits, with_error
from percussion_model.verification.accuracy.advantage import (
    UNDECIDED,
    Bounds,
    Contest,
    contest,
    summary,
)
from percussion_model.verification.accuracy.ladders import LADDERS
from percussion_model.verification.accuracy.orders import AT_LEAST, AT_MOST, Cost
from percussion_model.verification.accuracy.problems import (
    APERIODIC,
    HISTORIES,
    QUANTITIES,
)
from percussion_model.verification.accuracy.references import Bar, Reference
from percussion_model.verification.accuracy.study import WANTED, Point, Study

ABOUT_BOUNDS = (
    "≤ and ≥: a bound, of a method that meets the error with its coarsest setting, or misses it "
    "with its finest."
)
# Families of methods of which the best is shown.
FAMILIES = {
    "peer": "best of explicit\nand exact",
    "fem": "best of implicit\nelements",
}


def show_study(found: Study) -> None:
    """Print reference, points, orders, what accuracies cost, and advice."""
    show_bars(found.reference)
    _show_points(found)
    _show_orders(found)
    _show_costs(found)
    for wanted in WANTED:
        _say(found.advice(wanted))
    for point in found.points:
        if point.note:
            _say(f"{LADDERS[point.ladder].title}, {point.label}: {escape(point.note)}")
    console = Console()
    starts = ", ".join(f"{name} {two(time)} s" for name, time in found.compilation.items())
    console.print(f"First set-up in this process, compilation or its cache included: {starts}.")
    here = found.machine
    load = "" if here["load"] is None else f", load {here['load']:.1f}"
    console.print(f"{here['processor']}, {here['cores']} cores{load}; Python {here['python']}.")


def show_bars(reference: Reference) -> None:
    """Print a reference with its bars, and by how much the limits of the two solvers differ."""
    table = _table("quantity", "value", "bar,\nrelative", "solvers differ\nby, relative")
    table.add_column("")
    for key, bar in reference.bars.items():
        quantity = QUANTITIES[key]
        label = f"{quantity.label}, {quantity.unit}" if quantity.unit else quantity.label
        table.add_row(
            label,
            "" if key in HISTORIES else within_bar(quantity.factor, bar),
            _number(abs(bar.error / bar.value)),
            _number(bar.apart),
            f"no reference: {bar.doubt}" if bar.doubt else "",
        )
    _print(f"Reference: {reference.title}", table)
    promise = (
        "The bar is the standard error of the reference: the true value may lie outside of it."
        if reference.kind == APERIODIC
        else "The true value lies within the bar of the reference."
    )
    _say(
        f"{promise} Histories, through a blow, have no "
        "one value: theirs is the mean distance divided by the mean size."
    )


def within_bar(factor: float, bar: Bar) -> str:
    """A value to the second digit of its bar."""
    return with_error(factor * bar.value, factor * bar.error).split(" ± ")[0]


def _print(title: str, table: Table, keys: int = 1) -> None:
    """Print a table below its title, which may be wider than a table of few columns."""
    Console().print(escape(title), style="italic", highlight=False)
    print_table(table, keys=keys)


def _say(text: str) -> None:
    """Print a text as it is."""
    Console().print(text, highlight=False)


def _table(first: str, *numbers: str) -> Table:
    """A table of numbers, which need the room."""
    return airy_table((first, *numbers), [first], padding=(0, 1, 0, 0))


def _number(value: float) -> str:
    """Two digits, in few characters."""
    return f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e+") if isfinite(value) else "-"


def _error(found: Study, point: Point, key: str) -> str:
    """Error of a point; of one below the bar of the reference only that it is no larger."""
    error, floor = point.errors.get(key, math.nan), found.floor(key)
    return f"<{_number(floor)}" if error <= floor and floor > 0.0 else _number(error)


def _show_points(found: Study) -> None:
    what = "Relative standard error" if found.kind == APERIODIC else "Relative error"
    keys = found.quantities
    headings = ("ms/s", "±, %", "set-up", *(QUANTITIES[key].short for key in keys))
    table = _table("method", *(heading.replace(" ", "\n") for heading in headings))
    for name in found.names:
        table.add_row(f"[bold]{LADDERS[name].title}[/bold]")
        for point in found.ladder(name):
            errors = [_error(found, point, key) for key in keys]
            spread = two(100 * point.spread) if isfinite(point.spread) else "-"
            times = [two(1e3 * point.second), spread, two(1e3 * point.setup)]
            table.add_row(f" {point.label}", *times, *errors)
    _print(f"{what}; ms to compute a simulated second; ms of set-up", table)
    _say(
        f"A blow takes {found.period:.4g} s; its cost is that part of ms/s. ± is half the range of "
        "repeated times; what has none, and every set-up, was timed once."
    )
    if any(found.floor(key) for key in keys):
        _say("< Below the bar of the reference, which shows no more.")


def _show_orders(found: Study) -> None:
    keys = [key for key in found.quantities if any(found.order(name, key) for name in found.names)]
    if not keys:
        _say(
            "Measured orders: none; one takes three settings of a method with errors above the "
            "bar of the reference."
        )
        return
    table = _table("method", *(QUANTITIES[key].short.replace(" ", "\n") for key in keys))
    for name in found.names:
        orders = [found.order(name, key) for key in keys]
        cells = ["-" if one is None else str(one).replace(" ", "") for one in orders]
        table.add_row(LADDERS[name].title, *cells)
    _print("Measured orders, each against what the method refines", table)
    if "rigid" in found.names and found.kind != APERIODIC:
        _say(f"rigid: {LADDERS['rigid'].note}.")


def _show_costs(found: Study) -> None:
    """Print what errors of the first quantity cost own solvers, and the best of each family."""
    own = dict.fromkeys((found.own, "wave"))
    ladders = [name for name in own if name in found.names]
    here = {LADDERS[name].family for name in found.names}
    families = {family: title for family, title in FAMILIES.items() if family in here}
    if not ladders and not families:
        return
    titles = [LADDERS[name].title.replace(", ", ",\n") for name in ladders]
    table = _table("error", *titles, *families.values())
    bounds = ""
    for wanted in WANTED:
        costs = [found.cost(name, found.main, wanted) for name in ladders]
        bests = [found.best((family,), found.main, wanted) for family in families]
        if any(cost is not None and cost.is_bound for cost in (*costs, *bests)):
            bounds = "≤: all settings meet the error, and coarser ones might cost less. "
        cells = [_cost_text(cost) for cost in costs]
        for best in bests:
            cells.append(
                "-" if best is None else f"{_cost_text(best)}\n{LADDERS[best.ladder].title}"
            )
        table.add_row(f"{100 * wanted:g} %", *cells)
    _print(f"ms to compute {found.timed} at an error in the {_compared(found)}", table)
    _say(
        "Read off between the settings above, from where on the error is met for good, with the "
        f"range by the bar of the reference and the spread of the times. {bounds}What to "
        "take is one of the settings themselves:"
    )


def _compared(found: Study) -> str:
    """What the errors of a study are those of."""
    return QUANTITIES[found.main].label


def show_contests(studies: dict[str, Study]) -> None:
    """Print default solvers against the best of their peers: a table of all scenes, and ratios."""
    table = _table("scene", "error", "solver", "set-up", "best peer", "set-up", "ratio")
    table.add_column("the peer")
    found = [[contest(one, wanted) for wanted in WANTED] for one in studies.values()]
    whys = []
    for (name, study), contests in zip(studies.items(), found, strict=True):
        for k, one in enumerate(contests):
            heads = (name, LADDERS[study.own].title)
            first = escape(heads[k]) if k < len(heads) else ""
            table.add_row(first, f"{100 * one.wanted:g} %", *_contest_cells(study, one))
        table.add_section()
        whys += [(name, one) for one in contests if one.why]
    _print("The same error by the default solver and peers: ms to compute", table, keys=2)
    for name, one in whys:
        _say(escape(f"{name}, {100 * one.wanted:g} %: {why_text(one)}."))
    for what in dict.fromkeys((_compared(one), one.timed) for one in studies.values()):
        names = [name for name, one in studies.items() if (_compared(one), one.timed) == what]
        _say(escape(f"{', '.join(names)}: error in the {what[0]}, ms to compute {what[1]}."))
    _say(ABOUT_BOUNDS)
    for column in zip(*found, strict=True):
        told = summary(column)
        text = f"{100 * told.wanted:g} %: no scene is decided."
        if told.undecided < told.scenes:
            text = (
                f"{100 * told.wanted:g} %: ratio {bounds_text(told.luckiest)} at the luckiest, "
                f"{bounds_text(told.median)} at the median, {bounds_text(told.worst)} at the "
                f"worst of {told.scenes - told.undecided} scenes; {told.undecided} undecided."
            )
        _say(text)


def _contest_cells(found: Study, one: Contest) -> tuple[str, ...]:
    """Times and set-ups of the solver and of the best peer, the ratio; the peer's name."""
    peer, name, before = "-", "", "-"
    if one.peer is not None:
        peer, name = _cost_text(one.peer), LADDERS[one.peer.ladder].title
        before = _setup_text(found, one.peer)
    own = _setup_text(found, one.own)
    return _cost_text(one.own), own, peer, before, ratio_text(one), name


def _setup_text(found: Study, cost: Cost) -> str:
    setup = found.setup(cost)
    return two(1e3 * setup) if isfinite(setup) else "-"


def why_text(one: Contest) -> str:
    """Why a contest is undecided, or which peer is faster and why."""
    if one.outcome == UNDECIDED:
        return f"{UNDECIDED}, {one.why}"
    if one.peer is None:
        return one.why
    return f"{LADDERS[one.peer.ladder].title} win, {one.why}"


def ratio_text(one: Contest, strong: str = "") -> str:
    """Ratio of a contest with its range, or its bound with what that is for sure.

    Parameters
    ----------
    strong : str
        What stands around the ratio.
    """
    if one.outcome == UNDECIDED:
        return one.outcome
    text = bounds_text(Bounds(one.least, one.most))
    sure = bounds_text(Bounds(one.low, one.high), "-" if not strong else " to ")
    shown = f"{strong}{text}{strong}"
    # the bound of what misses the error has no range
    return shown if sure == text else f"{shown} ({sure})"


def bounds_text(ratio: Bounds, to: str = " to ") -> str:
    """A ratio, its bound, or its two bounds."""
    if not ratio.decided:
        return UNDECIDED
    if ratio.least == ratio.most:
        return two(ratio.least)
    if math.isinf(ratio.most):
        return f"{AT_LEAST}{two(ratio.least)}"
    if ratio.least == 0.0:
        return f"{AT_MOST}{two(ratio.most)}"
    return f"{two(ratio.least)}{to}{two(ratio.most)}"


def _cost_text(cost: Cost) -> str:
    """Milliseconds with their range; what the reference cannot tell is undecided."""
    if isfinite(cost.value) and isfinite(cost.high):
        return f"{cost.sign}{two(1e3 * cost.value)} ({two(1e3 * cost.low)}-{two(1e3 * cost.high)})"
    return "undecided" if isfinite(cost.low) else "not met"


def two(value: float) -> str:
    """Two digits without exponent."""
    return in_digits(value, 2)
