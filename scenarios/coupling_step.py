"""Error of a coupled run against the communication step: `python -m scenarios.coupling_step`.

The feed-controlled system with the rigid hammer, in its first rock, twice. *One blow*: from the
first impact to just before the second one. Nothing there depends on where the bit happens to
be, so what the coupling does to feed, casing and bit goes to a limit, and its order shows.
*Eight blows*: the rate over whole blows, and the energy that the coupling takes or makes in
the shoulder.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from percussion_model.coupling import Coupling
from percussion_model.coupling.coupled_run import known_signals, summary
from percussion_model.interface.progress import progress
from percussion_model.simulation.markdown import table
from percussion_model.simulation.uncertain import change_text, with_error
from percussion_model.verification.accuracy.orders import Order, fitted_order

from .coupled import whole
from .drawing import in_style
from .results import command_line, system, tell

NAME = "coupling_step"
ONE_BLOW, EIGHT_BLOWS = 0.04, 0.4  # [s]
STEPS = (1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2)  # [s]
ORDERS = ("jacobi", "gauss-seidel")
NAMES = {"jacobi": "Jacobi", "gauss-seidel": "Gauss–Seidel"}
REFERENCE = 2.5e-6  # of one blow [s]
# Up to here shoulder and damper are as they are given (docs/system.md, section 4) [s].
UNCHANGED = 1e-3

# What is compared after one blow, and the unit of its column.
QUANTITIES = {
    "string.bit_impulse": ("impulse of the feed", "N s", 1.0),
    "string.casing_position": ("way of the casing", "mm", 1e3),
    "hammer.bit.position": ("penetration", "mm", 1e3),
    "string.head_impulse": ("impulse of the rig", "N s", 1.0),
    "string.energy.shoulder": ("energy of the shoulder", "J", 1.0),
}


@dataclass(frozen=True)
class OneBlow:
    """State after one blow."""

    order: str
    step: float
    values: dict[str, float]


@dataclass(frozen=True)
class EightBlows:
    """Rate [m/s], mean feed [N], and the shoulder's energy by that of the blows [1]."""

    order: str
    step: float
    rate: float
    feed: float
    shoulder: float


def one_blow(archive: Path, order: str, step: float) -> OneBlow:
    """Run the system to just before the second blow."""
    coupling = Coupling(archive, order=order)
    run = whole(coupling.run(ONE_BLOW, step, list(QUANTITIES), interval=ONE_BLOW, tell=tell))
    return OneBlow(order, step, {name: float(run[name][-1]) for name in QUANTITIES})


def eight_blows(archive: Path, order: str, step: float) -> EightBlows:
    """Run the system for eight blows."""
    coupling = Coupling(archive, order=order)
    signals = [*known_signals(coupling.outputs), "hammer.blow_position", "hammer.blow_time"]
    run = whole(coupling.run(EIGHT_BLOWS, step, signals, interval=max(step, 1e-2), tell=tell))
    rate = float(run["hammer.blow_position"][-1] / run["hammer.blow_time"][-1])
    feed = float(run["string.bit_impulse"][-1]) / EIGHT_BLOWS
    return EightBlows(order, step, rate, feed, summary(run)["shoulder_by_blows"])


def errors(rows: Sequence[OneBlow], exact: OneBlow, name: str) -> np.ndarray:
    """Error of a quantity in each row, by its value in the limit."""
    return np.array([row.values[name] / exact.values[name] - 1.0 for row in rows])


def error_of_limit(step: float, change: float, reference: float) -> float:
    """What a reference of a short step is off itself, by the change of another, of first order."""
    return abs(change) * reference / (step - reference)


def errors_of_limits(rows: Sequence[OneBlow], exact: OneBlow) -> dict[str, float]:
    """Relative error of each quantity in the reference, by the rows of the shortest step."""
    least = min(row.step for row in rows)
    shortest = [row for row in rows if row.step == least]
    return {
        name: error_of_limit(least, np.max(np.abs(errors(shortest, exact, name))), exact.step)
        for name in QUANTITIES
    }


def order_of(rows: Sequence[OneBlow], exact: OneBlow, name: str) -> Order | None:
    """Slope of log error over log step, where the shoulder is as it is given."""
    chosen = [row for row in rows if row.step <= UNCHANGED]
    return fitted_order([row.step for row in chosen], np.abs(errors(chosen, exact, name)).tolist())


def table_of_one(rows: Sequence[OneBlow], exact: OneBlow) -> str:
    """Markdown: relative errors, and the order of each quantity in the last row."""
    words = (f"{text} [{unit}]" for text, unit, _ in QUANTITIES.values())
    unsure = errors_of_limits(rows, exact)
    found = [
        with_error(factor * exact.values[name], factor * abs(exact.values[name]) * unsure[name])
        for name, (_, _, factor) in QUANTITIES.items()
    ]
    lines = [["limit", "", *found]]
    for order in dict.fromkeys(row.order for row in rows):
        chosen = [row for row in rows if row.order == order]
        columns = [errors(chosen, exact, name) for name in QUANTITIES]
        for row, sizes in zip(chosen, np.transpose(columns), strict=True):
            shown = map(change_text, sizes, unsure.values())
            lines.append([order, f"{1e3 * row.step:g}", *shown])
        slopes = (str(order_of(chosen, exact, name) or "-") for name in QUANTITIES)
        lines.append([order, f"slope to {1e3 * UNCHANGED:g}", *slopes])
    return table(("order", "step [ms]", *words), lines)


def table_of_eight(rows: Sequence[EightBlows]) -> str:
    """Markdown: changes of the rate against that of the shortest step."""
    exact = min(rows, key=lambda row: row.step)
    head = (
        *("order", "step [ms]", "rate [mm/s]", f"change from {1e3 * exact.step:g} ms [%]"),
        *("mean feed [N]", "shoulder divided by blows [%]"),
    )
    lines = [
        (
            row.order, f"{1e3 * row.step:g}", f"{1e3 * row.rate:.2f}",
            change_text(row.rate / exact.rate - 1.0, None), f"{row.feed:.0f}",
            f"{100 * row.shoulder:+.2f}",
        )
        for row in rows
    ]  # fmt: skip
    return table(head, lines)


@in_style
def draw(ones: Sequence[OneBlow], exact: OneBlow, eights: Sequence[EightBlows], path: Path) -> Path:
    """Draw errors of one blow over the step, and what the shoulder takes in eight."""
    from matplotlib.figure import Figure

    from percussion_model.interface.plotting.style import RULE_COLOUR, head, label, save_png

    figure = Figure(figsize=(9.0, 7.6), layout="constrained")
    panels = figure.subplot_mosaic([[*ORDERS], ["eight", "eight"]])
    eight = panels["eight"]
    for order in ORDERS:
        ax = panels[order]
        rows = [row for row in ones if row.order == order]
        steps = [1e3 * row.step for row in rows]
        for name, (text, _, _) in QUANTITIES.items():
            ax.loglog(steps, 100.0 * np.abs(errors(rows, exact, name)), "o-", ms=4, label=text)
        guide = np.array([1e-2, 1.0])
        ax.loglog(guide, 0.2 * guide, "k--", linewidth=0.8, label="first order")
        label(ax, "communication step [ms]", "error [%]", f"One blow, {NAMES[order]}")
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    shortest = min(eights, key=lambda row: row.step).rate
    for order, dashes in zip(ORDERS, ("-", "--"), strict=True):
        chosen = [row for row in eights if row.order == order]
        steps = [1e3 * row.step for row in chosen]
        change = [100.0 * (row.rate / shortest - 1.0) for row in chosen]
        shoulder = [100.0 * row.shoulder for row in chosen]
        for values, colour, mark, words in (
            (change, "#0072B2", "o", "change of the rate"),
            (shoulder, "#D55E00", "s", "energy of the shoulder / of the blows"),
        ):
            eight.semilogx(steps, values, color=colour, linestyle=dashes, marker=mark, ms=4,
                           label=f"{words}, {NAMES[order]}")  # fmt: skip
    label(eight, "communication step [ms]", "share [%]", "Eight blows")
    eight.axhline(0.0, color="k", linewidth=0.6)
    eight.legend(loc="upper left")
    for ax in panels.values():
        ax.axvline(1e3 * UNCHANGED, color=RULE_COLOUR, linewidth=1.0, linestyle=":")
    eight.annotate("default", (1e3 * UNCHANGED, 0.4), (4, 0), xycoords=(
        "data", "axes fraction"), textcoords="offset points", va="bottom")  # fmt: skip
    head(figure, "Error of a coupled run against its communication step")
    return save_png(figure, path, 110)


def measure(archive: Path) -> tuple[OneBlow, list[OneBlow], list[EightBlows]]:
    """Run one blow as the reference, and one and eight blows with every order and step."""
    with progress("one blow with every step"):
        exact = one_blow(archive, "jacobi", REFERENCE)
        ones = [one_blow(archive, order, step) for order in ORDERS for step in STEPS]
    with progress("eight blows with every step"):
        eights = [eight_blows(archive, order, step) for order in ORDERS for step in STEPS]
    return exact, ones, eights


def main(paths: Sequence[Path], folder: Path) -> list[Path]:
    """Run everything, print the tables, draw the figure."""
    (archive,) = paths
    exact, ones, eights = measure(archive)
    print(f"One blow: limits by a run at {1e3 * REFERENCE:g} ms, and errors in % against it; ± is")
    print("what that run may be off itself, by the shortest of the others and first order")
    print(table_of_one(ones, exact), flush=True)
    print("Eight blows")
    print(table_of_eight(eights))
    return [draw(ones, exact, eights, folder / f"{NAME}.png")]


if __name__ == "__main__":
    command_line(NAME, __doc__, [system("FeedControlRigid")], main)
