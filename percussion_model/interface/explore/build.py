"""One file from the sources of the page, the engine for browsers, and the package's tables."""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from percussion_model.analysis.rock_interval import (
    DURATION,
    ENDS,
    SAMPLES,
    SETTLE,
    sample_shares,
    uncertain_numbers,
)
from percussion_model.analysis.stationary import (
    FEWEST_JUDGED,
    JUDGED_SHARE,
    MEANS,
    ROUNDING,
    SETTLING_SHARE,
)
from percussion_model.components import COMPONENTS
from percussion_model.engine import library, wasm
from percussion_model.engine.compiler import Report
from percussion_model.engine.web_table import PRESSURES, scene_as_json, table
from percussion_model.interface.plotting.window import TRANSITS_SHOWN
from percussion_model.scene.bits import bit, bits
from percussion_model.scene.hammers import AIR, CHAMBERS, hammer, hammers, with_chambers
from percussion_model.scene.parameters import parameter_table
from percussion_model.scene.rocks import rock, rocks
from percussion_model.scene.rocks.breaking import parameters_under
from percussion_model.scene.scene import Scene
from percussion_model.scene.typical import FAR, hint_of
from percussion_model.scene.writing import write_whole
from percussion_model.simulation import validity
from percussion_model.simulation.error_estimate import FLOOR_SHARE
from percussion_model.simulation.means import RATIOS, STRETCHES
from percussion_model.simulation.rate import LEAST_BLOWS, STRETCH
from percussion_model.simulation.templates import Fact, only
from percussion_model.simulation.warnings import THROTTLED

HERE = Path(__file__).parent
NAME = "explore.html"
BROUGHT = HERE / NAME
# Where a clone has the engine for browsers.
FOLDER = HERE.parents[2] / "dist" / "web"
# Modules of page and worker, each after those that it takes from.
PAGE = ("words", "numbers", "own", "scene", "pictures", "plot", "figures", "drawing", "inputs",
        "result", "player", "judge", "notes", "pool", "main")  # fmt: skip
WORKER = ("settle", "kept", "picture", "worker")
# Bits that go with a hammer, by the diameter of its hole; the reference bores 3 1/4 inches.
LEAST_HOLE, MOST_HOLE, REFERENCE_HOLE = 0.85, 1.35, 0.0826
IMPORT = re.compile(r'^import \{(.*?)\} from "[./\w]*?(\w+)\.js";\n', re.M | re.S)
# Where the page holds a scene to begin with, and how one without a title is called.
OWN, OWN_TITLE = '<script id="own" type="text/plain"></script>', "Your own scene"
HUGE = 1e300  # is usual for nothing
# Most numbers of rock and bit that are known by intervals.
MOST_UNCERTAIN = 8


def is_at_hand() -> bool:
    """Whether the engine for browsers is there, made of the present sources."""
    kept = FOLDER / "table.json"
    return kept.is_file() and json.loads(kept.read_text("utf-8"))["stamp"] == library.stamp()


def engine_folder(report: Report | None = None) -> Path:
    """Folder with the engine for browsers, which is made where it is old.

    Raises
    ------
    NoCompilerError
        If nothing here compiles for browsers.
    """
    if not is_at_hand():
        wasm.write(FOLDER, report)
    return FOLDER


def page_file(report: Report | None = None) -> Path:
    """The page: as a wheel brings it, or else made of what is in a clone.

    Raises
    ------
    NoCompilerError
        If nothing here compiles for browsers.
    """
    if BROUGHT.is_file():
        return BROUGHT
    engine = engine_folder(report)
    file = engine / NAME
    write_whole(file, page(engine))
    return file


def page(engine: Path) -> str:
    """The whole page as HTML.

    Parameters
    ----------
    engine : Path
        Folder with `engine.wasm`.
    """
    packed = gzip.compress((engine / "engine.wasm").read_bytes(), 9, mtime=0)
    own = wasm.SCRIPT.read_text("utf-8")
    parts = {
        "STYLE": source("figures.css") + source("style.css"),
        "TABLE": as_json(_less(table())),
        "CATALOGUE": as_json(catalogue()),
        "ENGINE": base64.b64encode(packed).decode(),
        "WORKER": joined({"engine": own} | {name: source(f"{name}.js") for name in WORKER}),
        "PAGE": joined({"engine": own} | {name: source(f"{name}.js") for name in PAGE}),
    }
    return re.sub(r"/\*([A-Z]+)\*/", lambda found: parts[found[1]], source("index.html"))


def as_json(value: Any) -> str:
    """A value for use within a page."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c")


def _less(whole: dict[str, Any]) -> dict[str, Any]:
    """The table without what the page does not show."""
    kept = {name for name, *_ in _hammers()}
    return whole | {
        "presets": {name: one for name, one in whole["presets"].items() if name in kept}
    }


def with_scene(page: str, scene: Scene) -> str:
    """A page that begins with a scene.

    Parameters
    ----------
    page : str
        As of `page`, as HTML.
    scene : Scene
    """
    return page.replace(OWN, OWN.replace("><", f">{own_link(scene)}<"))


def own_link(scene: Scene) -> str:
    """A scene as the part of an address after the number sign."""
    title = scene.title or OWN_TITLE
    whole = {"preset": scene_as_json(scene), "hammer": _hammer(scene, title)}
    letters = base64.urlsafe_b64encode(json.dumps(whole, separators=(",", ":")).encode())
    return f"own={letters.decode().rstrip('=')}"


def packed(values: np.ndarray, kind: str = "<f4") -> str:
    """Numbers in letters, as precise as an eye can tell unless another kind is asked for."""
    return base64.b64encode(np.ascontiguousarray(values, kind).tobytes()).decode()


def source(name: str) -> str:
    """Text of a file of the page."""
    return (HERE / name).read_text("utf-8")


def joined(modules: dict[str, str]) -> str:
    """Modules by name, each after those that it takes from, as one script of scopes."""
    taken: dict[str, set[str]] = {name: set() for name in modules}
    for text in modules.values():
        for names, source in IMPORT.findall(text):
            taken[source] |= {one.strip() for one in names.split(",")}
    scopes = []
    for name, text in modules.items():
        inside = IMPORT.sub(r"const {\1} = from_\2;\n", text)
        inside = re.sub(r"^export ", "", inside, flags=re.M)
        given = ", ".join(sorted(taken[name]))
        scopes.append(f"const from_{name} = (() => {{\n{inside}\nreturn {{ {given} }};\n}})();\n")
    return "".join(scopes)


def catalogue() -> dict[str, Any]:
    """What the page must know besides the engine's table."""
    try:
        own = version("percussion_model")
    except PackageNotFoundError:
        own = "0"
    return {
        "version": own,
        "hammers": {name: _hammer(scene, title) for name, title, scene in _hammers()},
        "bits": {name: _bit(name) for name in bits()},
        "uncertain": {name: _uncertain(name) for name in bits()},
        "shares": {count: sample_shares(SAMPLES, count) for count in range(1, MOST_UNCERTAIN + 1)},
        "transits": TRANSITS_SHOWN,
        "settled": _settled(),
        "notes": _notes(),
        "interval": {"duration": DURATION, "settle": SETTLE, "ends": ENDS[0]},
    }


def _settled() -> dict[str, Any]:
    """What judges a settled motion as `settled` does."""
    ratios = {name: RATIOS[name] for name in MEANS if name in RATIOS}
    ratios |= {"blow_period": ("period", "one"), "blow_frequency": ("one", "period"),
               "impact_velocity": ("impact_velocity", "one")}  # fmt: skip
    steps = {one.name: one.parameters["step"] for one in COMPONENTS if "step" in one.parameters}
    return {
        # columns of blows, stretches, fewest blows
        "numbers": {"rate_of_penetration": ("hole_advance", "period", (STRETCH,), LEAST_BLOWS)}
        | {name: (*columns, STRETCHES, 1) for name, columns in ratios.items()},
        "settlingOf": {"blow_period": ("period", "one", (STRETCH,), 1)},
        "steps": {f"{name}.step": longest for name, (*_, longest) in steps.items()},
        "fewest": FEWEST_JUDGED,
        "judged": JUDGED_SHARE,
        "settling": SETTLING_SHARE,
        "rounding": ROUNDING,
        "floor": FLOOR_SHARE,
    }


def _notes() -> dict[str, Any]:
    """Texts of notes, with places for numbers, and the limits beyond which they are told."""
    one, much = Fact(0, 1.0), Fact(0, 1e9)
    return {
        "texts": {
            "button": only(validity.button_note(one, 1.0)),
            "rate": only(validity.rate_note(one)),
            "limit": only(validity.limit_note(one, 0.0)).replace("100 %", "{0:.3g} %"),
            "jam": only(validity.jam_note(much, Fact(1, 1.0))),
            "lifted": only(validity.recoil_note(1e9, one, True)),
            "recoil": only(validity.recoil_note(1e9, one, False)),
        },
        "limits": {
            "depth": validity.BUTTON_LENGTH,
            "rate": validity.MOST_RATE,
            "limited": validity.MOST_LIMITED,
            "held": validity.HELD,
        },
        "throttled": THROTTLED,
        "usual": {
            row.key: {
                "low": row.typical[0] / FAR,
                "high": row.typical[1] * FAR,
                "text": hint_of(row.key, [Fact(0, HUGE)]),
            }
            for row in parameter_table()
            if row.typical and "*" not in row.key
        },
    }


def _hammers() -> Iterator[tuple[str, str, Scene]]:
    """Presets of the table with their titles."""
    yield "reference", "Reference, 3¼ inch", Scene()
    for scene, name in sorted(((hammer(name), name) for name in hammers()), key=_is_string):
        title, _, rods = scene.title.replace("Down-the-hole hammer of", "Down the hole,").partition(
            ", " if scene.effects.string else "\n"
        )
        title += f", {rods.split()[0]}" if rods else ""
        yield name, title, scene
        if name in CHAMBERS:
            drive, what = ("pneumatic", "air") if name in AIR else ("hydraulic", "oil")
            yield f"{name} chambers", f"{title}, {what}", with_chambers(name, PRESSURES[drive])


def _is_string(one: tuple[Scene, str]) -> bool:
    return one[0].effects.string


def _hammer(scene: Scene, title: str) -> dict[str, Any]:
    kind = "th-" if scene.effects.string else "dth-"
    hole = scene.hole_diameter or REFERENCE_HOLE
    return {
        "title": title,
        "air": scene.effects.drive == "pneumatic",
        "toml": scene.to_toml(),
        "hole": hole,
        "bits": [name for name in bits() if name.startswith(kind)
                 and LEAST_HOLE < bit(name).diameter / hole < MOST_HOLE],
    }  # fmt: skip


def _bit(name: str) -> dict[str, Any]:
    one = bit(name)
    count = round(one.buttons.value)
    return {"diameter": one.diameter, "buttons": count, "gauge": one.gauge_buttons}


def _uncertain(name: str) -> dict[str, list[tuple[str, float, float, float]]]:
    """Numbers of each rock and a bit that are known by intervals: key, value, low and high."""
    plain, found = Scene().replace(**bit(name).parameters), {}
    for one in map(rock, rocks()):
        _, numbers = uncertain_numbers(plain.replace(**parameters_under(one, plain)))
        found[one.name] = [(n.key, n.value, n.low, n.high) for n in numbers]
    return found
