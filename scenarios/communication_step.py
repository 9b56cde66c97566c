"""Error and time against communication step: `python -m scenarios.communication_step`.

Three loops over the same eighth of a second, some three blows, with steps from 8e-6 to 1.6e-2 s:

- *constant*: inputs stay as they are. Nothing depends on the step, to the last bit.
- *ramp*: the feed force rises steadily. Between two communication points an input is
  held, so the hammer feels a staircase that lags by half a step: an error of first order.
- *coupled*: the feed comes through a drill string, a spring whose upper end is lowered
  steadily. The host reads the bit and sets the force: explicit coupling, of first order
  as well.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from percussion_model.interface.progress import progress
from percussion_model.simulation import markdown
from percussion_model.simulation.files import staged_file

from .drawing import in_style
from .harness import Instance, fmu
from .results import command_line

NAME = "communication_step"
# Powers of two add up without rounding, so that all loops end at the same time, to the bit.
STEPS = tuple(2.0**-k for k in (17, 15, 13, 11, 9, 7, 6))  # 8e-6 to 1.6e-2 s
DURATION = 0.125  # a whole number of each [s]
# Errors are against a step shorter than the shortest by this, extrapolated to none.
FINER = 2.0
RAMP = 1500.0, 4000.0  # feed at the start and the end [N]
# Drill string: stiffness [N/m], speed of the upper end [m/s], load at the start [N].
STRING = {"stiffness": 2e5, "lowering": 0.0165, "load": 2500.0}
READ = ("bit.position", "bit.impulse", "piston.velocity", "blow_count")
CASES = ("constant", "ramp", "coupled")
WORDS = {
    "constant": "constant inputs",
    "ramp": "ramp: feed rises with time",
    "coupled": "coupled: feed through a spring, by the bit's position",
}
# The coupling is lost once the bit is further off than this [m].
LOST = 0.1

Feed = Callable[[Instance, float], float]


def ramp_feed(instance: Instance, t: float) -> float:
    """Feed force that rises with time alone [N]."""
    return RAMP[0] + (RAMP[1] - RAMP[0]) * t / DURATION


def string_feed(instance: Instance, t: float) -> float:
    """Feed force of the drill string on the bit as it is now [N]."""
    stretch = STRING["lowering"] * t - float(instance.get("bit.position"))
    return STRING["load"] + STRING["stiffness"] * stretch


FEEDS: dict[str, Feed | None] = {"constant": None, "ramp": ramp_feed, "coupled": string_feed}


def simulate(hammer: Path, case: str, step: float) -> dict[str, Any]:
    """Run one loop with one communication step.

    Returns
    -------
    dict
        `READ` at the end, and the time of the loop per simulated second [s]; of a loop
        that lost its bit the numbers are NaN.
    """
    feed = FEEDS[case]
    with Instance(hammer) as instance:
        start = {"ramp": {"feed_force": RAMP[0]}}.get(case, {})
        instance.start(**start)
        count = round(DURATION / step)
        began = time.process_time()
        lost = False
        for k in range(count):
            instance.time = k * step
            if feed is not None:
                force = feed(instance, k * step)
                lost = abs(force) > STRING["stiffness"] * LOST
                if lost:
                    break
                instance.set({"feed_force": force})
            instance.step(step)
        cost = (time.process_time() - began) / DURATION
        values = [math.nan] * len(READ) if lost else instance.values(READ)
    return {**dict(zip(READ, values, strict=True)), "step": step, "cost": cost}


def study(
    hammer: Path,
    steps: Sequence[float] = STEPS,
    cases: Sequence[str] = CASES,
    say: Callable[[str], None] = lambda text: None,
) -> dict[str, list[dict[str, Any]]]:
    """Run all loops with all steps; `error` is that of the bit's advance, relative."""
    found = {}
    for case in cases:
        rows = []
        for step in (min(steps) / FINER, *steps):
            say(f"{case}, {step:g} s")
            rows.append(simulate(hammer, case, step))
        # First order: the limit is as far from the finest as that from twice its step.
        finest, next_one = rows[0]["bit.position"], rows[1]["bit.position"]
        limit = finest if case == "constant" else 2.0 * finest - next_one
        for row in rows:
            row["error"] = abs(row["bit.position"] / limit - 1.0)
            row["same_bits"] = all(row[name] == rows[0][name] for name in READ)
        found[case] = rows[1:]
    return found


def table(found: dict[str, list[dict[str, Any]]]) -> str:
    """Text of a table, Markdown."""
    lines = []
    for case, rows in found.items():
        for row in rows:
            if row["same_bits"]:
                error = "none, same bits"
            elif math.isnan(row["error"]):
                error = "unstable"
            else:
                error = f"{row['error']:.1e}"
            blows = "–" if math.isnan(row["blow_count"]) else f"{row['blow_count']:.0f}"
            lines.append((case, f"{row['step']:.2g}", error, blows, f"{row['cost']:.3g}"))
    head = ("loop", "step, s", "error of the advance", "blows", "time a simulated second, s")
    return markdown.table(head, lines)


@in_style
def draw(found: dict[str, list[dict[str, Any]]], path: Path) -> Path:
    """Draw error and time against step."""
    from matplotlib.figure import Figure

    from percussion_model.interface.plotting.style import RULE_COLOUR, head, label, save_png

    figure = Figure(figsize=(10.0, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    marks = {"constant": ("#595959", "x"), "ramp": ("#0072B2", "o"), "coupled": ("#D55E00", "s")}
    for case, rows in found.items():
        colour, marker = marks[case]
        good = [row for row in rows if row["error"] > 0 and not row["same_bits"]]
        name = WORDS[case] + (", the same bits at every step" if not good else "")
        left.plot(
            [row["step"] for row in good], [row["error"] for row in good],
            color=colour, marker=marker, label=name,
        )  # fmt: skip
        known = [row for row in rows if not math.isnan(row["error"])]
        right.plot(
            [row["step"] for row in known], [row["cost"] for row in known],
            color=colour, marker=marker,
        )  # fmt: skip
    steps = [min(STEPS), max(STEPS)]
    ramp = [row for row in found.get("ramp", ()) if row["error"] > 0]
    if ramp:
        scale = ramp[-1]["error"] / ramp[-1]["step"]
        left.plot(steps, [scale * s for s in steps], "--", color=RULE_COLOUR, label="first order")
    for ax in (left, right):
        ax.set(xscale="log", yscale="log")
    step = "communication step [s]"
    label(left, step, "relative error of the bit's advance [–]", "An input that is held lags")
    label(right, step, "computing time of a simulated second [s]", "Short steps cost time")
    head(figure, "What a communication step of the FMU makes of the result, and what it costs")
    figure.legend(loc="outside lower center", ncols=2)
    return save_png(figure, path, 120)


def main(paths: Sequence[Path], folder: Path) -> list[Path]:
    """Print the table, draw the figure, write JSON beside it."""
    with progress("one run with every step"):
        found = study(*paths, say=lambda text: print(text, flush=True))
    print(table(found))
    figure = draw(found, folder / f"{NAME}.png")
    text = json.dumps(found, indent=1).replace("NaN", "null")
    staged_file(figure.with_suffix(".json"), text + "\n")
    return [figure, figure.with_suffix(".json")]


if __name__ == "__main__":
    command_line(NAME, __doc__, [fmu("HAMMER.fmu")], main)
