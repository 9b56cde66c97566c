"""Tables and sentences of docs/data/accuracy.md and README.md on accuracy, from the stored studies.

Nothing is measured here: what is told follows from docs/accuracy/*.json alone, and
tests/accuracy/test_accuracy_page.py holds the pages to it.
"""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Callable, Sequence
from typing import Any

from docs.blocks import DOCS
from percussion_model.interface.commands.accuracy_tables import (
    bounds_text,
    ratio_text,
    two,
    why_text,
    within_bar,
)
from percussion_model.simulation.markdown import table
from percussion_model.simulation.uncertain import in_digits
from percussion_model.verification.accuracy import Study
from percussion_model.verification.accuracy.advantage import (
    UNDECIDED,
    Contest,
    Summary,
    contest,
    summary,
)
from percussion_model.verification.accuracy.ladders import LADDERS
from percussion_model.verification.accuracy.orders import Cost
from percussion_model.verification.accuracy.problems import (
    APERIODIC,
    CONTACT_HISTORY,
    HISTORIES,
    HISTORY,
    PERIODIC,
    QUANTITIES,
    RATE,
    STRESS_HISTORY,
)
from percussion_model.verification.accuracy.study import WANTED, Point

DATA = DOCS / "accuracy"
# Scenes of the comparison: all shipped ones whose blows are alike, and those drawn by seed.
COMPARED = (
    *("reference", "stiff_rock", "chatter", "top_hammer"),
    *("drawn_1", "drawn_2", "drawn_3", "drawn_4"),
    *("dth4_kuru", "dth5_st_anne", "t38_rods"),
)
OTHERS = ("drop_test", "aperiodic")
# Between two bounds of one ratio.
DASH = "–"
# Errors that sentences state.
STATED = (1e-2, 1e-3)
# Run that sentences with set-up are about [s].
RUN = 4.0
# Forces and stress that are compared beside the rate, and at which errors.
FORCES = (HISTORY, CONTACT_HISTORY, STRESS_HISTORY)
FORCE_ERRORS = (3e-2, 1e-2)
QUANTITIES_FIGURE = "\n![All quantities](../images/accuracy_quantities_reference.png)\n"


def load(name: str) -> Any:
    """Tree of a file of data."""
    return json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))


def load_studies(names: Sequence[str] = COMPARED) -> dict[str, Study]:
    """Stored studies, by scene."""
    return {name: Study.from_dict(load(name)) for name in names}


# numbers


def power(value: float) -> str:
    """Two digits, as 1.2·10⁻³."""
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    digits, exponent = f"{value:.1e}".split("e")
    raised = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{digits}·10{raised}"


def percent(wanted: float) -> str:
    """An error in per cent."""
    return f"{100 * wanted:g} %"


# the default solver against peers


def contests(
    studies: Sequence[Study], key: str = RATE, ladder: str = "", duration: float = math.inf
) -> dict[float, list[Contest]]:
    """Contests of all scenes, by error; of runs so long [s], if set-up counts."""
    errors = WANTED if key == RATE else FORCE_ERRORS
    return {w: [contest(one, w, key, ladder, duration) for one in studies] for w in errors}


def contest_cell(one: Contest) -> str:
    """Ratio with its range, and the two times."""
    times = f"{milliseconds(one.own)} / {'–' if one.peer is None else milliseconds(one.peer)}"
    if one.peer is not None and one.peer.ladder != "explicit":
        times += f" {LADDERS[one.peer.ladder].title}"
    return f"{ratio_text(one, strong='**')}<br>{times}"


def setup_cell(study: Study, one: Contest) -> str:
    """Set-up of the solver and of the best peer [ms]."""
    costs = (one.own, one.peer)
    setups = (math.nan if cost is None else study.setup(cost) for cost in costs)
    return " / ".join(two(1e3 * setup) if math.isfinite(setup) else "–" for setup in setups)


def reasons(names: Sequence[str], found: dict[float, list[Contest]]) -> str:
    """Where a peer wins, and what is undecided, each with its reason."""
    told: dict[tuple[str, str], list[str]] = {}
    for k, name in enumerate(names):
        for wanted, column in found.items():
            if (one := column[k]).why:
                told.setdefault((name, why_text(one)), []).append(percent(wanted))
    rows = (f"- {name}, {', '.join(errors)}: {why}." for (name, why), errors in told.items())
    return "\n".join(rows)


def milliseconds(cost: Cost) -> str:
    """Time to compute a simulated second, or why there is none."""
    if math.isfinite(cost.value):
        return f"{cost.sign}{two(1e3 * cost.value)}"
    return "?" if math.isfinite(cost.low) else "not met"


def contest_table() -> str:
    """All scenes and errors, and what they come to."""
    studies = load_studies()
    found = contests(list(studies.values()))
    rows = []
    for k, (name, one) in enumerate(studies.items()):
        bar = one.reference.floor(RATE)
        shown = power(bar) if math.isfinite(bar) else "none"
        cells = [contest_cell(column[k]) for column in found.values()]
        setups = setup_cell(one, found[STATED[-1]][k])
        link = f"[{name}](../accuracy/{name}.md), {LADDERS[one.own].title}"
        rows.append([link, shown, *cells, setups])
    sums = [summary(column) for column in found.values()]
    for label in ("luckiest", "median", "worst"):
        rows.append([f"**{label}**", "", *(bounds_text(getattr(one, label)) for one in sums), ""])
    rows.append(["undecided", "", *(f"{one.undecided} of {one.scenes}" for one in sums), ""])
    setups = f"set-up at {percent(STATED[-1])}, ms"
    head = ["scene", "bar of the reference", *(percent(wanted) for wanted in found), setups]
    return f"{table(head, rows)}\n\n{reasons(list(studies), found)}"


def force_table() -> str:
    """Ratios for the forces and the stress, over the same scenes."""
    studies = [study for study in load_studies().values() if study.kind == PERIODIC]
    rows = []
    for key in FORCES:
        for one in (summary(column) for column in contests(studies, key).values()):
            ratios = [bounds_text(value) for value in (one.luckiest, one.median, one.worst)]
            what = QUANTITIES[key].short, percent(one.wanted)
            rows.append([*what, *ratios, f"{one.undecided} of {one.scenes}"])
    return table(["quantity", "error", "luckiest", "median", "worst", "undecided"], rows)


def summary_text(one: Summary) -> str:
    """Range and median of a summary."""
    decided = one.scenes - one.undecided
    if not decided:
        return f"undecided ({one.scenes} scenes)"
    ends = f"{bounds_text(one.worst, DASH)} to {bounds_text(one.luckiest, DASH)}"
    return f"{bounds_text(one.median, DASH)} ({ends}; {decided} scenes)"


def lost(names: Sequence[str], found: dict[float, list[Contest]]) -> str:
    """Where a peer is faster, and why."""
    told = [
        f"{name} at {percent(wanted)} ({why_text(one)})"
        for wanted in STATED
        for name, one in zip(names, found[wanted], strict=True)
        if one.outcome != UNDECIDED and one.ratio < 1.0
    ]
    if not told:
        faster = "At these errors no peer is faster than the default solver."
        return f"{faster} The last row is of waves, the second method, which peers can beat."
    return f"A peer is faster in {'; '.join(told)}."


def advantage() -> str:
    """What the default solver gains over the best of its peers."""
    studies = load_studies()
    waved = [study for study in studies.values() if study.ladder("wave")]

    def row(
        name: str, chosen: Sequence[Study], ladder: str = "", duration: float = math.inf
    ) -> list[str]:
        found = contests(chosen, ladder=ladder, duration=duration)
        return [name, *(summary_text(summary(found[wanted])) for wanted in STATED)]

    every = list(studies.values())
    rows = (
        row("**the default solver**", every),
        row(f"with set-up, runs of {RUN:g} s", every, duration=RUN),
        row("waves", waved, "wave"),
    )
    text = (
        "Processor time of the best compiled peer, mostly explicit elements with hard contact, "
        "divided by that of the default solver (modes; in drill strings waves) for the same "
        "error of the rate: median, range and scenes. Below 1 the peer is faster. ≥ and ≤ are "
        "bounds, where no setting was so coarse that it misses the error, or so fine that it "
        f"meets it; a{DASH}b is one ratio between these bounds. "
        f"{lost(list(studies), contests(every))}"
    )
    text = textwrap.fill(text, 88, break_long_words=False, break_on_hyphens=False)
    shown = table(["", *(f"error of {percent(wanted)}" for wanted in STATED)], rows)
    return f"{text}\n\n{shown}"


def modes_table() -> str:
    """Errors of the rate by modes, scene by scene."""
    studies = {
        name: one
        for name, one in load_studies().items()
        if one.kind == PERIODIC and one.ladder("modal")
    }
    labels = sorted(
        {point.label for one in studies.values() for point in one.ladder("modal")},
        key=lambda label: int(label.split()[0]),
    )
    rows = []
    for name, one in studies.items():
        by: dict[str, Point] = {point.label: point for point in one.ladder("modal")}
        bar = one.reference.bars[RATE]
        cells = [
            bounded(by[label].errors.get(RATE, math.nan), one.floor(RATE)) if label in by else "–"
            for label in labels
        ]
        least, most = (f(1e3 * p.values[RATE] for p in by.values()) for f in (min, max))
        note = f"{power(one.reference.floor(RATE))}{', near a threshold' if bar.threshold else ''}"
        link = f"[{name}](../accuracy/{name}.md)"
        rows.append([link, *cells, f"{least:.4f} to {most:.4f}", note])
    return table(["scene", *labels, "rates, mm/s", "bar of the reference"], rows)


# runs that are not ladders


def coupled() -> str:
    """Error and cost of a coupled run, by method and communication step."""
    tree = load("coupled")
    methods = list(dict.fromkeys(row["method"] for row in tree["rows"]))
    steps = list(dict.fromkeys(row["step"] for row in tree["rows"]))
    by = {(row["method"], row["step"]): row for row in tree["rows"]}
    rows = []
    for step in steps:
        cells = []
        for method in methods:
            row = by[method, step]
            cells.append(f"{bounded(row['error'], tree['bar'])}, {two(row['second'])} s")
        rows.append([f"{step:.2g} s", *cells])
    return table(["communication step", *methods], rows) + (
        f"\n\nErrors of the advance over {tree['duration']:g} s; bar of the reference "
        f"{power(tree['bar'])}; times are those of a simulated second."
    )


def bounded(error: float, bar: float) -> str:
    """An error, or that the reference does not resolve it."""
    return f"within {power(bar)}" if error <= bar and bar > 0.0 else power(error)


def points_map() -> str:
    """Error and cost of a map, by method."""
    tree = load("map")
    rows = [
        [
            row["method"],
            two(row["core_seconds"]),
            bounded(row["median"], tree["bar"]),
            bounded(row["greatest"], tree["bar"]),
            f"{row['above']} of {row['points']}",
        ]
        for row in tree["rows"]
    ]
    head = ["method", "core-seconds for the map", "median error", "greatest", "above 1 %"]
    return table(head, rows) + (
        f"\n\n{tree['points']} points, {tree['left_out']} of them omitted because their blows are "
        f"not alike or the two references differ by more than {percent(tree['most_apart'])}; "
        f"median bar of the reference {power(tree['bar'])}."
    )


def closed() -> str:
    """Errors at closed forms."""
    tree = load("closed_forms")
    rows = [
        [row["name"], *(power(error) for error in (*row["wave"], *row["fem"]))]
        for row in tree["rows"]
    ]
    head = [f"waves, {count} steps" for count in tree["steps"]]
    head += [f"elements, {count}" for count in tree["elements"]]
    return table(["motion", *head], rows)


def steps() -> str:
    """Error and time of the FMU against communication step."""
    from scenarios.communication_step import table as step_table

    tree = load("communication_step")
    return step_table(
        {
            case: [{k: math.nan if v is None else v for k, v in row.items()} for row in rows]
            for case, rows in tree.items()
        }
    )


def reference_orders() -> str:
    """Orders of the main ladders on the reference scene."""
    study = load_studies(("reference",))["reference"]
    return orders(study, [RATE, *FORCES])


def machine() -> str:
    """Where the figures come from."""
    here = load("reference")["machine"]
    return (
        f"{here['date']}, {here['processor']}, {here['cores']} cores, load {here['load']:.0f}; "
        f"Python {here['python']}, numba {here['numba']}, scipy {here['scipy']}."
    )


# a page for each scene


def bars(study: Study) -> str:
    """Reference with its bars."""
    rows = []
    for key, bar in study.reference.bars.items():
        one = QUANTITIES[key]
        label = f"{one.label}, {one.unit}" if one.unit else one.label
        value = "–" if key in HISTORIES else within_bar(one.factor, bar)
        verdict = f"no: {bar.doubt}" if bar.doubt else "yes"
        if bar.threshold:
            verdict += ", near a threshold: the bar covers what refined modes found"
        rows.append([label, value, power(abs(bar.error / bar.value)), power(bar.apart), verdict])
    return table(
        ["quantity", "value", "bar, relative", "solvers differ by, relative", "a reference?"], rows
    )


def orders(study: Study, keys: Sequence[str]) -> str:
    """Measured orders."""
    rows = []
    for name in study.names:
        found = [study.order(name, key) for key in keys]
        if not any(found):
            continue
        cells = ["–" if one is None else str(one) for one in found]
        knob = "simulated time" if study.kind == APERIODIC else LADDERS[name].knob
        rows.append([LADDERS[name].title, knob, *cells])
    return table(["method", "against", *(QUANTITIES[key].short for key in keys)], rows)


def rungs(study: Study) -> str:
    """Every rung: errors and times."""
    rows = []
    for point in study.points:
        label = point.label
        title = LADDERS[point.ladder].title
        if point.note:
            rows.append([title, label, point.note, *[""] * (len(study.quantities) + 1)])
            continue
        errors = [
            bounded(point.errors.get(key, math.nan), study.floor(key)) for key in study.quantities
        ]
        spread = f" ± {two(100 * point.spread)} %" if math.isfinite(point.spread) else ""
        times = [f"{in_digits(1e3 * point.second)}{spread}", in_digits(1e3 * point.setup)]
        rows.append([title, label, *errors, *times])
    head = [QUANTITIES[key].short for key in study.quantities]
    return table(["method", "", *head, "ms a simulated second", "set-up, ms"], rows)


def scene_page(name: str) -> str:
    """Markdown of the page of a scene."""
    study = load_studies((name,))[name]
    made = "; ".join(
        ", ".join(study.reference.made[solver])
        for solver in ("modal", "wave", "explicit", "fem")
        if solver in study.reference.made
    )
    more = QUANTITIES_FIGURE if name == "reference" else ""
    what = "Relative standard errors" if study.kind == APERIODIC else "Relative errors"
    return f"""# {study.title}

Made by `python -m docs.make accuracy`; [accuracy.md](../data/accuracy.md) says what the columns
mean.

![Error against time](../images/accuracy_{name}.png)
{more}
## Reference

From {made}.

{bars(study)}

## Orders

{orders(study, study.quantities)}

## All rungs

{what}; ± half the range of repeated times; "within" the bar of the reference, which shows no more.

{rungs(study)}
"""


BLOCKS: dict[str, Callable[[], str]] = {
    "advantage": advantage,
    "contests": contest_table,
    "modes": modes_table,
    "forces": force_table,
    "coupled": coupled,
    "map": points_map,
    "closed": closed,
    "steps": steps,
    "orders": reference_orders,
    "machine": machine,
}
FILLED = ("data/accuracy.md", "data/costs.md", "data/modes.md", "accuracy.md", "../README.md")
