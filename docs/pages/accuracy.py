"""Accuracy by time: what is named is measured, all if nothing is; `page` only writes pages.

They follow from docs/accuracy/*.json, README.md included. All takes some ten minutes of one core.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator
from typing import Any

from matplotlib.figure import Figure

from docs.accuracy_page import (
    BLOCKS,
    COMPARED,
    DATA,
    FILLED,
    OTHERS,
    load,
    load_studies,
    scene_page,
)
from docs.blocks import IMAGES, Made
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.error_against_time import (
    draw_accuracy,
    draw_quantities,
)

# The methods of each scene; the reference scene gets all of them.
PEERS = ("modal", "wave", "explicit", "exact-flow", "fem", "rigid")
METHODS: dict[str, tuple[str, ...] | None] = {
    **dict.fromkeys((*COMPARED, *OTHERS), PEERS),
    "reference": None,
    "t38_rods": ("wave", "explicit"),
}
DPI, DPI_OF_MANY = 110, 72
CLOSED_WAVE, CLOSED_FEM = (5, 20, 40), (20, 40, 80)


def measure(name: str) -> None:
    """Study a scene and keep its numbers."""
    from percussion_model import Scene
    from percussion_model.scene.presets import scene_presets
    from percussion_model.verification.accuracy import study

    scene = Scene.from_toml(scene_presets()[name])
    found = study(scene, False, METHODS[name], lambda text, share: say(f"{name}: {text}"))
    keep(name, found.to_dict())


def measure_closed_forms() -> None:
    """Errors of both solvers at closed forms."""
    from percussion_model.verification.accuracy.closed_forms import closed_forms, solver_error

    rows = []
    for case in closed_forms():
        say(case.name)
        wave = [solver_error(case, "wave", count) for count in CLOSED_WAVE]
        fem = [solver_error(case, "fem", count) for count in CLOSED_FEM]
        rows.append({"name": case.name, "value": case.value, "wave": wave, "fem": fem})
    keep("closed_forms", {"steps": CLOSED_WAVE, "elements": CLOSED_FEM, "rows": rows})


def measure_steps() -> None:
    """Error and time of the FMU against communication step."""
    from scenarios.communication_step import study
    from scenarios.harness import built

    found = study(built(), say=say)
    keep("communication_step", found)


def draw_steps() -> None:
    """Draw error and time of the FMU against communication step, from the data."""
    from scenarios.communication_step import draw

    found = load("communication_step")
    for rows in found.values():
        for row in rows:
            row |= {name: math.nan for name, value in row.items() if value is None}
    draw(found, IMAGES / "communication_step.png")


def measure_coupled() -> None:
    """Coupled runs by waves and explicit elements."""
    from benchmarks.error_of_runs import coupled

    keep("coupled", coupled(say))


def measure_map() -> None:
    """A map by waves and explicit elements."""
    from benchmarks.error_of_runs import points_map

    keep("map", points_map(say))


def keep(name: str, tree: dict[str, Any]) -> None:
    """Write a file of data."""
    DATA.mkdir(exist_ok=True)
    text = json.dumps(shortened(tree), indent=1).replace("NaN", "null")
    (DATA / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def shortened(tree: Any) -> Any:
    """Numbers with eight digits, more than anything here is known to."""
    if isinstance(tree, dict):
        return {key: shortened(value) for key, value in tree.items()}
    if isinstance(tree, (list, tuple)):
        return [shortened(value) for value in tree]
    return float(f"{tree:.8g}") if isinstance(tree, float) else tree


def say(text: str) -> None:
    """Tell what is being done."""
    print(text, file=sys.stderr, flush=True)


def figures() -> Iterator[tuple[str, Figure]]:
    """All figures, drawn from the data."""
    studies = load_studies((*COMPARED, *OTHERS))
    yield from ((f"accuracy_{name}", draw_accuracy(found)) for name, found in studies.items())
    figure = draw_quantities(studies["reference"])
    style.save_png(figure, IMAGES / "accuracy_quantities_reference.png", DPI_OF_MANY)
    draw_steps()


def pages() -> Made:
    """All pages and figures from the data."""
    scenes = {f"accuracy/{name}.md": scene_page(name) for name in (*COMPARED, *OTHERS)}
    return Made(FILLED, BLOCKS, scenes, figures, DPI)


EXTRA = {
    "closed_forms": measure_closed_forms,
    "communication_step": measure_steps,
    "coupled": measure_coupled,
    "map": measure_map,
}


def made(*words: str) -> Made:
    """Measure what is named, all if nothing is."""
    for word in words or (*METHODS, *EXTRA):
        if word in METHODS:
            measure(word)
        elif word != "page":
            EXTRA[word]()
    return pages()
