"""Published experiments, stored beside this file as TOML: one file each.

A file holds the rig as a scene, what was measured, what is fitted to which measurements, what is
predicted then, and the criterion of each, fixed before anything was computed. Keys are those of
the classes below; values and errors carry their units.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from percussion_model.scene.rows import shortened
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.scene.text import read_toml
from percussion_model.scene.units import UnitError, in_si
from percussion_model.verification.measured.blow import SLOPE_TO
from percussion_model.verification.measured.quantities import QUANTITIES

_HERE = Path(__file__).resolve().parent
# Not an experiment: what could not be read.
WANTED = "wanted"
# Where a number comes from.
KINDS = ("measured", "computed", "mixed")
# Rock laws, and the parameters that a fit may move; SI units.
_LINES = {"rock.loading_stiffness": (1e6, 1e10), "rock.unloading_ratio": (1.001, 1e4)}
LAWS: dict[str, dict[str, tuple[float, float]]] = {
    "bilinear": _LINES,
    "power": {
        **_LINES,
        "rock.loading_exponent": (1.0, 4.0),
        "rock.unloading_exponent": (0.0, 12.0),
        "rock.chipping_penetration": (1e-6, 1e-2),
    },
}
# Parameters of a law that a fit may set, beside those that it may move.
FIXED: dict[str, tuple[str, ...]] = {
    "bilinear": (),
    "power": ("rock.reference_penetration", "rock.buttons", "rock.chipping_force"),
}
MOST_ENTRIES = 100
# A blow is over by then [s].
MOST_DURATION = 0.05
LONGEST_TEXT = 2000


class ExperimentError(ValueError):
    """An experiment that cannot be read; the message says why."""


@dataclass(frozen=True)
class Measurement:
    """One number of an experiment, SI units."""

    id: str  # by which fits name it
    quantity: str  # one of `QUANTITIES`
    value: float
    error: float  # of the measurement and of reading it, together
    kind: str  # one of `KINDS`: measured; computed by others; or points of both, not told apart
    read: str  # where and how the number was read
    speed: float | None = None  # of the piston [m/s]; None where the scene alone tells
    second_hand: bool = False  # whether it was read in a quotation, not in the publication itself
    # criterion: share of the value, or a difference where the quantity is not relative
    within: float | None = None
    no_criterion: str = ""  # why there is none

    @property
    def source_text(self) -> str:
        """Kind in words."""
        return self.kind + (", second hand" if self.second_hand else "")


@dataclass(frozen=True)
class FitPlan:
    """What is fitted to what, and what is predicted with it."""

    name: str
    law: str  # rock law, one of `LAWS`
    parameters: tuple[str, ...]  # keys that are fitted, as many as there are measurements in `to`
    to: tuple[str, ...]  # measurements by their ids, as in `predicts`
    predicts: tuple[str, ...] = ()
    start: str = ""  # fit whose parameters hold for all others; empty: those of the scene
    # parameters that were chosen before the fit, SI units
    fixed: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Variant:
    """Another rig, or another place where it is read, to see what the choice is worth."""

    name: str
    why: str
    changes: dict[str, Any] = field(default_factory=dict)  # of the scene, by dotted keys
    gauge: float | None = None  # place of the gauge in place of the experiment's [m]
    end: bool = False  # whether speeds are those of the bit's lower end in place of its mean
    # share of the greatest displacement to which the slope of indentation is taken
    slope_to: float = SLOPE_TO
    after_run: bool = False  # whether it was thought of after the experiment had been computed


@dataclass(frozen=True)
class Experiment:
    """One experiment."""

    name: str
    title: str
    rock: str
    about: str
    source: dict[str, str]  # `published`, `doi` and `read_in`
    scene: Scene  # the rig: one blow
    gauge: float | None  # from the top of the bit [m]; None: its middle
    measured: dict[str, Measurement]  # by id
    fits: tuple[FitPlan, ...]
    variants: tuple[Variant, ...] = ()


def stored() -> tuple[str, ...]:
    """Names of the experiments that are stored here."""
    return tuple(sorted(path.stem for path in _HERE.glob("*.toml") if path.stem != WANTED))


def load(names: Iterable[str] = ()) -> list[Experiment]:
    """Experiments by name, or files of them; all that are stored where none is named.

    Raises
    ------
    ExperimentError
        If there is none, or it makes no sense.
    """
    found = [_load(name) for name in list(names) or stored()]
    seen: set[str] = set()
    for one in found:
        if one.name in seen:
            raise ExperimentError(f"experiment {one.name!r}: is there twice; name files otherwise")
        seen.add(one.name)
    return found


def _load(name: str) -> Experiment:
    if name in stored():
        return read_experiment(_HERE / f"{name}.toml")
    if not name.endswith(".toml"):
        raise ExperimentError(
            f"experiment {shortened(name)!r}: must be one of {', '.join(stored())}, or a TOML file"
        )
    path = Path(name)
    if not path.exists():
        raise ExperimentError(f"{name}: there is no such file")
    return read_experiment(path)


def wanted() -> list[dict[str, str]]:
    """What could not be read: `what`, `where` and `why` of each."""
    rows = read_toml(_HERE / f"{WANTED}.toml")["wanted"]
    return [{key: str(row[key]) for key in ("what", "where", "why")} for row in rows]


def read_experiment(path: Path) -> Experiment:
    """Read a file.

    Raises
    ------
    ExperimentError
        If it cannot be read or makes no sense; one line that names the key.
    """
    try:
        tree = read_toml(path)
        return _experiment(path.stem, tree)
    except (SceneError, ExperimentError) as error:
        text = str(error)
        raise ExperimentError(text if path.name in text else f"{path}: {text}") from None


def _experiment(name: str, tree: dict[str, Any]) -> Experiment:
    texts = ("title", "rock", "about")
    _refuse_keys("", tree, (*texts, "source", "scene", "measured", "fits"), ("gauge", "variants"))
    if not isinstance(tree["scene"], dict):
        raise ExperimentError("scene: must be a table")
    scene = Scene(**tree["scene"])
    for bar, allowed in (("piston", ("elastic", "absent")), ("bit", ("elastic",))):
        if scene[f"{bar}.model"] not in allowed:
            raise ExperimentError(
                f'scene.{bar}.model = "{scene[f"{bar}.model"]}": must be {" or ".join(allowed)}'
            )
    if scene.run.duration > MOST_DURATION:
        raise ExperimentError(
            f"scene.run.duration = {scene.run.duration:g} s: must be at most {MOST_DURATION:g} s, "
            "which one blow does not take"
        )
    source = _table(tree, "source")
    _refuse_keys("source.", source, ("published", "doi", "read_in"))
    gauge = _gauge("", tree, scene)
    rows = _rows(tree, "measured")
    measured = [_measurement(f"measured.{k}", row) for k, row in enumerate(rows)]
    for k, one in enumerate(measured):
        if one.speed is not None and scene.piston.model == "absent":
            raise ExperimentError(f"measured.{k}.speed: the scene has no piston")
    by_id = {one.id: one for one in measured}
    if len(by_id) < len(measured):
        raise ExperimentError("measured: every id must be there once")
    fits: list[FitPlan] = []
    for k, row in enumerate(_rows(tree, "fits")):
        fits.append(_fit(f"fits.{k}", row, by_id, [one.name for one in fits]))
    variants = [
        _variant(f"variants.{k}", row, scene) for k, row in enumerate(_rows(tree, "variants"))
    ]
    told = {key: _text("", tree, key) for key in texts}
    return Experiment(
        name, **told, source={key: _text("source.", source, key) for key in source}, scene=scene,
        gauge=gauge, measured=by_id, fits=tuple(fits), variants=tuple(variants),
    )  # fmt: skip


def _measurement(where: str, row: dict[str, Any]) -> Measurement:
    _refuse_keys(
        f"{where}.", row, ("id", "quantity", "value", "error", "kind", "read"),
        ("speed", "second_hand", "within", "no_criterion"),
    )  # fmt: skip
    name = _choice(f"{where}.", row, "quantity", tuple(QUANTITIES))
    quantity = QUANTITIES[name]
    value = _number(f"{where}.", row, "value", quantity.si)
    error = _number(f"{where}.", row, "error", quantity.si)
    speed = _number(f"{where}.", row, "speed", "m/s") if "speed" in row else None
    if not (value > 0.0 and 0.0 < error <= value):
        raise ExperimentError(
            f"{where}: value and error must be above 0, and the error no more than the value, not "
            f"{value:g} and {error:g}"
        )
    if speed is not None and not speed > 0.0:
        raise ExperimentError(f"{where}.speed = {speed:g} m/s: must be above 0")
    if ("within" in row) == ("no_criterion" in row):
        raise ExperimentError(f"{where}: must have either within or no_criterion")
    within = _number(f"{where}.", row, "within", "-") if "within" in row else None
    if within is not None and not 0.0 < within < 1.0:
        raise ExperimentError(f"{where}.within = {within:g}: must be above 0 and below 1")
    second_hand = row.get("second_hand", False)
    if not isinstance(second_hand, bool):
        raise ExperimentError(f"{where}.second_hand = {second_hand!r}: must be true or false")
    return Measurement(
        id=_text(f"{where}.", row, "id"), quantity=name, value=value, error=error,
        kind=_choice(f"{where}.", row, "kind", KINDS), read=_text(f"{where}.", row, "read"),
        speed=speed, second_hand=second_hand, within=within,
        no_criterion=_text(f"{where}.", row, "no_criterion") if "no_criterion" in row else "",
    )  # fmt: skip


def _fit(
    where: str, row: dict[str, Any], measured: Mapping[str, Measurement], before: Sequence[str]
) -> FitPlan:
    others = ("predicts", "start", "fixed")
    _refuse_keys(f"{where}.", row, ("name", "law", "parameters", "to"), others)
    law = _choice(f"{where}.", row, "law", tuple(LAWS))
    parameters = _words(f"{where}.", row, "parameters", tuple(LAWS[law]))
    to = _words(f"{where}.", row, "to", tuple(measured))
    predicts = _words(f"{where}.", row, "predicts", tuple(measured)) if "predicts" in row else ()
    if not parameters or len(parameters) != len(to):
        raise ExperimentError(
            f"{where}: {len(parameters)} parameters to {len(to)} measurements: must be as many"
        )
    both = sorted(set(to) & set(predicts))
    if both:
        raise ExperimentError(f"{where}: {both[0]!r} is both fitted and predicted")
    start = _choice(f"{where}.", row, "start", tuple(before)) if "start" in row else ""
    name = _text(f"{where}.", row, "name")
    if name in before:
        raise ExperimentError(f"{where}.name = {name!r}: another fit has this name")
    fixed = _fixed(where, row, law, parameters)
    return FitPlan(name, law, parameters, to, predicts, start, fixed)


def _fixed(
    where: str, row: dict[str, Any], law: str, parameters: tuple[str, ...]
) -> dict[str, float]:
    """Parameters that a fit sets; a scene with them tells whether they make sense."""
    table = row.get("fixed", {})
    if not isinstance(table, dict):
        raise ExperimentError(f"{where}.fixed: must be a table")
    allowed = [key for key in (*LAWS[law], *FIXED[law]) if key not in parameters]
    _refuse_keys(f"{where}.fixed.", table, (), allowed)
    scene = Scene(effects={"rock": law}).replace(**table)
    return {key: scene[key] for key in table}


def _variant(where: str, row: dict[str, Any], scene: Scene) -> Variant:
    others = ("changes", "gauge", "end", "slope_to", "after_run")
    _refuse_keys(f"{where}.", row, ("name", "why"), others)
    changes = row.get("changes", {})
    end, after_run = row.get("end", False), row.get("after_run", False)
    if not isinstance(changes, dict) or not (isinstance(end, bool) and isinstance(after_run, bool)):
        raise ExperimentError(f"{where}: changes must be a table, end and after_run true or false")
    slope_to = _number(f"{where}.", row, "slope_to", "-") if "slope_to" in row else SLOPE_TO
    if not 0.2 <= slope_to <= 1.0:
        raise ExperimentError(f"{where}.slope_to = {slope_to:g}: must be from 0.2 to 1")
    changed = scene.replace(**changes)
    gauge = _gauge(f"{where}.", row, changed)
    name, why = (_text(f"{where}.", row, key) for key in ("name", "why"))
    return Variant(name, why, changes, gauge, end, slope_to, after_run)


def _refuse_keys(
    where: str, row: Mapping[str, Any], needed: Sequence[str], others: Sequence[str] = ()
) -> None:
    for key in row:
        if key not in (*needed, *others):
            raise ExperimentError(
                f"{where}{shortened(key)}: unknown key; must be one of "
                f"{', '.join((*needed, *others))}"
            )
    for key in needed:
        if key not in row:
            raise ExperimentError(f"{where}{key}: is missing")


def _table(tree: Mapping[str, Any], key: str) -> dict[str, Any]:
    if not isinstance(tree[key], dict):
        raise ExperimentError(f"{key}: must be a table")
    return dict(tree[key])


def _rows(tree: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
    rows = tree.get(key, [])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise ExperimentError(f"{key}: must be a list of tables")
    if len(rows) > MOST_ENTRIES:
        raise ExperimentError(f"{key}: {len(rows)} entries are more than {MOST_ENTRIES}")
    return rows


def _text(where: str, row: Mapping[str, Any], key: str) -> str:
    value = row[key]
    if not isinstance(value, str) or not 0 < len(value) <= LONGEST_TEXT or not value.isprintable():
        raise ExperimentError(
            f"{where}{key} = {shortened(repr(value))}: must be one line of text, of at most "
            f"{LONGEST_TEXT} characters"
        )
    return value


def _choice(where: str, row: Mapping[str, Any], key: str, allowed: Sequence[str]) -> str:
    value = row[key]
    if value not in allowed:
        raise ExperimentError(
            f"{where}{key} = {shortened(repr(value))}: must be one of {', '.join(allowed)}"
        )
    return str(value)


def _words(where: str, row: Mapping[str, Any], key: str, allowed: Sequence[str]) -> tuple[str, ...]:
    words = row[key]
    if not isinstance(words, list):
        raise ExperimentError(f"{where}{key}: must be a list")
    for word in words:
        if word not in allowed:
            raise ExperimentError(
                f"{where}{key}: {shortened(repr(word))} must be one of {', '.join(allowed)}"
            )
    if len(set(words)) < len(words):
        raise ExperimentError(f"{where}{key}: each may be there once")
    return tuple(words)


def _number(where: str, row: Mapping[str, Any], key: str, si: str) -> float:
    """A number in SI of a text with its unit; a plain number is in SI."""
    value = row[key]
    try:
        if isinstance(value, bool):
            raise ValueError
        number = in_si(value, si) if isinstance(value, str) else float(value)
    except (TypeError, ValueError, UnitError):
        unit = "" if si == "-" else f", with its unit or in {si}"
        raise ExperimentError(
            f"{where}{key} = {shortened(repr(value))}: must be a number{unit}"
        ) from None
    if not math.isfinite(number):
        raise ExperimentError(f"{where}{key}: must be finite")
    return number


def _gauge(where: str, row: Mapping[str, Any], scene: Scene) -> float | None:
    """Place of a gauge on the bit [m]."""
    if "gauge" not in row:
        return None
    place = _number(where, row, "gauge", "m")
    if not 0.0 < place < scene.bit.length:
        raise ExperimentError(
            f"{where}gauge = {place:g} m: must be above 0 and below {scene.bit.length:g} m, the "
            "bit's length"
        )
    return place
