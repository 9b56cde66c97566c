"""Make the figures and tables of docs/accuracy.md: `python -m docs.make_accuracy`.

Names of scenes as arguments make only theirs; `page` only puts the page together again
from docs/accuracy/*.json. All of it takes some ten minutes of one core.
"""

from __future__ import annotations

import json
import math
import re
import sys
from pathlib import Path
from typing import Any

import matplotlib

from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.error_against_time import draw_accuracy, draw_quantities
from percussion_model.verification.accuracy import Study
from percussion_model.verification.accuracy.ladders import LADDERS
from percussion_model.verification.accuracy.problems import HISTORY, QUANTITIES

HERE = Path(__file__).resolve().parent
PAGE, DATA, IMAGES = HERE / "accuracy.md", HERE / "accuracy", HERE / "images"
SCENARIOS = HERE.parent / "scenarios"
# The methods of each scene; the reference scene gets all of them.
SCENES: dict[str, tuple[str, ...] | None] = {
    "reference": None,
    "drop_test": ("wave", "fem", "fem-time", "rigid", "lsoda"),
    "stiff_rock": ("wave", "fem", "rigid"),
    "chatter": ("wave", "fem", "fem-time", "rigid"),
    "top_hammer": ("wave", "fem", "rigid"),
    "aperiodic": ("wave", "fem", "rigid"),
}
SHORT = {
    "rate_of_penetration": "rate",
    "blow_period": "period",
    "impact_velocity": "impact",
    "rebound_velocity": "rebound",
    "rock_energy": "energy",
    "peak_bit_force": "peak force",
    "resting_place": "resting place",
    HISTORY: "force, L1",
}
DPI = 110
CLOSED_WAVE, CLOSED_FEM = (5, 20, 40), (20, 40, 80)


def measure(name: str) -> None:
    """Study a scene; keep its numbers and its figures."""
    from percussion_model import Scene
    from percussion_model.verification.accuracy import study

    scene = Scene.from_toml(SCENARIOS / f"{name}.toml")
    found = study(scene, False, SCENES[name], lambda share, text: say(f"{name}: {text}"))
    keep(name, found.to_dict())
    draw(name, found)


def draw(name: str, found: Study) -> None:
    """Draw a study, small enough for a page."""
    with matplotlib.rc_context(style.STYLE):
        draw_accuracy(found).savefig(IMAGES / f"accuracy_{name}.png", dpi=DPI)
        if name == "reference":
            draw_quantities(found).savefig(IMAGES / f"accuracy_quantities_{name}.png", dpi=DPI)


def measure_closed_forms() -> None:
    """Errors of both solvers at closed forms."""
    from percussion_model.verification.accuracy.closed_forms import closed_forms, solver_error

    rows = []
    for case in closed_forms():
        say(case.name)
        wave = [solver_error(case, "wave", count) for count in CLOSED_WAVE]
        fem = [solver_error(case, "fem", count) for count in CLOSED_FEM]
        rows.append({"name": case.name, "value": case.value, "wave": wave, "fem": fem})
    keep("closed_forms", {"rows": rows})


def measure_steps() -> None:
    """Error and time against communication step."""
    from scenarios.communication_step import draw, study
    from scenarios.harness import built

    found = study(built(), say=say)
    keep("communication_step", found)
    draw(found, IMAGES / "communication_step.png")


def keep(name: str, tree: dict[str, Any]) -> None:
    """Write a file of data."""
    DATA.mkdir(exist_ok=True)
    text = json.dumps(tree, indent=1).replace("NaN", "null")
    (DATA / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def say(text: str) -> None:
    """Tell what is being done."""
    print(text, file=sys.stderr, flush=True)


def page() -> None:
    """Put the tables into the page, between their marks."""
    text = PAGE.read_text(encoding="utf-8")
    for mark in re.findall(r"<!-- begin (\w+ \w+) -->", text):
        what, name = mark.split()
        path = DATA / f"{name}.json"
        if not path.exists():
            continue
        body = BLOCKS[what](json.loads(path.read_text(encoding="utf-8")))
        text = re.sub(
            rf"(<!-- begin {mark} -->\n).*?(<!-- end -->)",
            lambda found, body=body: f"{found[1]}{body}\n{found[2]}",
            text,
            count=1,
            flags=re.DOTALL,
        )
    PAGE.write_text(text, encoding="utf-8")


def table(head: list[str], rows: list[list[str]]) -> str:
    """Markdown of a table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def power(value: float | None) -> str:
    """Two digits, as 1.2·10⁻³."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    digits, exponent = f"{value:.1e}".split("e")
    raised = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{digits}·10{raised}"


def bars(tree: dict[str, Any]) -> str:
    """Reference with its bars."""
    rows = []
    for key, bar in tree["reference"]["bars"].items():
        one = QUANTITIES[key]
        label = f"{one.label}, {one.unit}" if one.unit else one.label
        value = "–" if key == HISTORY else f"{one.factor * bar['value']:.7g}"
        apart = abs(bar["wave"] - bar["fem"]) / abs(bar["value"])
        verdict = "yes" if bar["agreed"] else "no: the limits disagree"
        share = power(abs(bar["error"] / bar["value"]))
        rows.append([label, value, share, power(apart), verdict])
    return table(["quantity", "value", "bar, relative", "solvers apart", "a reference?"], rows)


def points(tree: dict[str, Any]) -> str:
    """Every rung: errors and times."""
    keys = list(next(point["errors"] for point in tree["points"] if point["errors"]))
    rows = []
    for point in tree["points"]:
        label = point["label"] + (" *" if point["fit"] > 1e-6 else "")
        title = LADDERS[point["ladder"]].title
        if point["note"]:
            rows.append([title, label, *["–"] * len(keys), point["note"], ""])
            continue
        errors = [power(point["errors"].get(key)) for key in keys]
        times = [f"{1e3 * point[key]:.3g}" for key in ("second", "setup")]
        rows.append([title, label, *errors, *times])
    head = ["method", "", *(SHORT[key] for key in keys), "ms a simulated second", "set-up, ms"]
    return table(head, rows)


def orders(tree: dict[str, Any]) -> str:
    """Measured orders."""
    keys = list(next(point["errors"] for point in tree["points"] if point["errors"]))
    rows = []
    for name in tree["ladders"]:
        found = tree["orders"].get(name, {})
        cells = []
        for key in keys:
            one = found.get(key)
            cells.append("–" if one is None else f"{one['value']:.1f} ± {one['error']:.1f}")
        knob = "simulated time" if tree["kind"] == "aperiodic" else LADDERS[name].knob or "–"
        rows.append([LADDERS[name].title, knob, *cells])
    return table(["method", "against", *(SHORT[key] for key in keys)], rows)


def costs(tree: dict[str, Any]) -> str:
    """What an accuracy costs, by method."""
    from percussion_model.verification.accuracy.orders import cost_at

    key = next(iter(tree["reference"]["bars"]))
    general = [name for name in tree["ladders"] if LADDERS[name].title.startswith("scipy")]
    elements = [name for name in tree["ladders"] if name.startswith("fem")]

    def cost(name: str, wanted: float) -> float:
        rungs = [point for point in tree["points"] if point["ladder"] == name]
        rungs = [point for point in rungs if not point["note"]]
        errors = [point["errors"].get(key) for point in rungs]
        known = [math.nan if error is None else error for error in errors]
        return cost_at([point["second"] for point in rungs], known, wanted)

    rows = []
    for wanted in (1e-2, 5e-3, 2e-3, 1e-3, 5e-4):
        wave = cost("wave", wanted)
        row = [f"{100 * wanted:g} %", f"{1e3 * wave:.3g}" if math.isfinite(wave) else "–"]
        for family in (elements, general):
            found = [(cost(name, wanted), name) for name in family]
            found = [pair for pair in found if math.isfinite(pair[0])]
            if not found:
                row += ["–", "–"]
                continue
            least, name = min(found)
            row.append(f"{1e3 * least:.3g} ({LADDERS[name].title})")
            row.append(f"{least / wave:.3g}" if math.isfinite(wave) else "–")
        rows.append(row)
    head = ["error", "wave, ms", "best of fem, ms", "by wave", "best of scipy, ms", "by wave"]
    return table(head, rows)


def advice(tree: dict[str, Any]) -> str:
    """What to take."""
    return "\n".join(f"- {text}" for text in tree["advice"])


def machine(tree: dict[str, Any]) -> str:
    """Where the figures come from."""
    here = tree["machine"]
    starts = ", ".join(f"{name} {time:.2g} s" for name, time in tree["compilation"].items())
    return (
        f"{here['date']}, {here['processor']}, {here['cores']} cores, load {here['load']:.0f}; "
        f"Python {here['python']}, numba {here['numba']}, scipy {here['scipy']}. "
        f"First set-up in the process, from the cache of compiled kernels: {starts}."
    )


def closed(tree: dict[str, Any]) -> str:
    """Errors at closed forms."""
    rows = [
        [row["name"], *(power(error) for error in (*row["wave"], *row["fem"]))]
        for row in tree["rows"]
    ]
    head = [f"waves, {count} cells" for count in CLOSED_WAVE]
    return table(["motion", *head, *(f"elements, {count}" for count in CLOSED_FEM)], rows)


def steps(tree: dict[str, Any]) -> str:
    """Error and time against communication step."""
    from scenarios.communication_step import table as step_table

    clean = {
        case: [{k: math.nan if v is None else v for k, v in row.items()} for row in rows]
        for case, rows in tree.items()
    }
    return step_table(clean)


BLOCKS = {
    "bars": bars,
    "points": points,
    "orders": orders,
    "costs": costs,
    "advice": advice,
    "machine": machine,
    "closed": closed,
    "steps": steps,
}


def main(words: list[str]) -> None:
    """Measure what is named, all if nothing is, and write the page."""
    extra = {"closed_forms": measure_closed_forms, "communication_step": measure_steps}
    for word in words or [*SCENES, *extra]:
        if word in SCENES:
            measure(word)
        elif word in extra:
            extra[word]()
        elif word != "page":
            sys.exit(f"{word}: one of {', '.join([*SCENES, *extra, 'page'])}")
    page()


if __name__ == "__main__":
    main(sys.argv[1:])
