"""References with error bars, made by solvers that share no motion, stored as JSON.

Waves, explicit and implicit elements are each refined three times and extrapolated
(Richardson); modes are refined as well. A number is called a reference where the two surest
limits agree within their bars or nearly so. Its bar covers the distance of the two and, since
a motion near a threshold is another one on other meshes, all that the modes found.
"""

from __future__ import annotations

import hashlib
import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.files import staged_file
from percussion_model.verification.accuracy.explicit import ExplicitSolver
from percussion_model.verification.accuracy.ladders import (
    Rung,
    affordable_modes,
    fem_scene,
    modal_rung,
    peer_rung,
    total_length,
    wave_rung,
)
from percussion_model.verification.accuracy.problems import (
    APERIODIC,
    CONTACT_HISTORY,
    HISTORIES,
    Answer,
    Problem,
    Run,
    default_solver,
)

STORE = "references.json"
FORMAT = 2
# Digits of a stored history.
DIGITS = 6
# Orders that extrapolation assumes: about the least that was measured; the mesh of the
# implicit elements, with a penalty that goes along, is of second order.
ORDERS = {"wave": 1.0, "explicit": 1.0, "fem": 2.0}
# Steps of waves through piston and bit together, coarse to fine; elements likewise.
WAVE_LEVELS, WAVE_LEVELS_QUICK = (172.0, 258.0, 430.0), (86.0, 129.0, 172.0)
EXPLICIT_LEVELS, EXPLICIT_LEVELS_QUICK = (602.0, 860.0, 1204.0), (108.0, 151.0, 215.0)
FEM_LEVELS, FEM_LEVELS_QUICK = (108.0, 151.0, 215.0), (65.0, 86.0, 108.0)
# Modes in the bar of the shortest transit time. They come near their limit first, so that what
# they find on the way is no error of theirs but another motion: the bar covers it.
MODES, MODES_QUICK = (20, 28, 40, 56, 80), (20, 28, 40)
# Modes whose rates differ by more than this [relative] find more than one motion.
NEAR_THRESHOLD = 1e-3
# Levels that come closer to their limit change less, or not much more: else there is no order.
GROWTH = 3.0
# A penalty rings: its contact force is no witness.
RINGING = {"fem": ("peak_contact_force", CONTACT_HISTORY)}
# Steps in the piston of a drill string, elements likewise.
STRING_LEVELS = (30, 45, 70)
# Simulated time of aperiodic references, by the scene's duration.
LONG = 20.0
LONG_CELLS = 40
LONG_MODES = 24
# Elements in the piston of a string, which is long.
LONG_MESH = 24
# Limits that are relatively closer than this make a reference whatever their bars say.
CLOSE = 2e-3


@dataclass(frozen=True)
class Bar:
    """A number with its bar."""

    value: float  # reference, SI units; of a history 1
    error: float  # its bar; of a history that of its L1 norm
    # limit of each solver and its own bar; of a history by L1 distance to the waves
    limits: dict[str, tuple[float, float]]
    agreed: bool  # whether it is a reference
    # whether modes that are refined find another motion: then the value is the middle of all that
    # they and the surest limit found, and the bar covers it
    threshold: bool = False

    @classmethod
    def from_dict(cls, tree: dict[str, Any]) -> Bar:
        """Read plain values."""
        limits = {name: (limit[0], limit[1]) for name, limit in tree["limits"].items()}
        return cls(
            tree["value"], tree["error"], limits, tree["agreed"], tree.get("threshold", False)
        )

    @property
    def doubt(self) -> str:
        """Why it is no reference; empty where it is one."""
        if self.agreed:
            return ""
        return "the limits disagree" if len(self.limits) > 1 else "one method alone gives it"

    @property
    def apart(self) -> float:
        """Distance of the two surest limits, relative; NaN where there is one."""
        first, *others = self.surest
        return abs(first[0] - others[0][0]) / abs(self.value) if others else math.nan

    @property
    def surest(self) -> list[tuple[float, float]]:
        """The two limits with the smallest bars, the surest first."""
        return sorted(self.limits.values(), key=lambda limit: limit[1])[:2]


@dataclass(frozen=True)
class Reference:
    """Reference answer of a scene.

    Attributes
    ----------
    title : str
    kind : str
        Of the problem.
    bars : dict of Bar
        By the names of `QUANTITIES`.
    histories : dict of ndarray
        As in `Answer`, by the finest waves.
    made : dict
        How, with which versions, when.
    """

    title: str
    kind: str
    bars: dict[str, Bar] = field(repr=False)
    histories: dict[str, np.ndarray] = field(repr=False)
    made: dict[str, Any] = field(default_factory=dict, repr=False)

    @property
    def values(self) -> dict[str, float]:
        """Values that are references."""
        return {name: bar.value for name, bar in self.bars.items() if bar.agreed}

    def floor(self, key: str) -> float:
        """Relative bar: errors near it are not resolved. NaN where there is no reference."""
        bar = self.bars.get(key)
        if bar is None or not bar.agreed or not bar.value:
            return math.nan
        return abs(bar.error / bar.value)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "title": self.title,
            "kind": self.kind,
            "bars": {name: asdict(bar) for name, bar in self.bars.items()},
            "histories": {
                name: " ".join(f"{value:.{DIGITS}g}" for value in history)
                for name, history in self.histories.items()
            },
            "made": self.made,
        }

    @classmethod
    def from_dict(cls, tree: dict[str, Any]) -> Reference:
        """Read what `to_dict` gave."""
        return cls(
            tree["title"],
            tree["kind"],
            {name: Bar.from_dict(bar) for name, bar in tree["bars"].items()},
            {name: np.array(text.split(), float) for name, text in tree["histories"].items()},
            tree["made"],
        )


def fingerprint(scene: Scene) -> str:
    """Tell scenes apart by what changes their motion: values that are not the defaults.

    Title, hole diameter, solver and, but for a drop, run times do not count; so parameters that
    come later, at their defaults, leave the fingerprint as it is.
    """
    tree, usual = (asdict(one) for one in (scene, Scene()))
    apart = {"title", "hole_diameter", "solver", "fem"}
    if scene.piston.model != "absent":
        apart.add("run")
    found = {
        f"{group}.{key}": value
        for group, entries in tree.items()
        if group not in apart
        for key, value in entries.items()
        if value != usual[group][key] and value is not None
    }
    return hashlib.sha256(json.dumps(found, sort_keys=True).encode()).hexdigest()[:16]


def load_references(path: Path | None = None) -> dict[str, Reference]:
    """References of a file, by fingerprint; those of the package if left out."""
    path = package_store() if path is None else path
    if not path.exists():
        return {}
    tree = json.loads(path.read_text(encoding="utf-8"))
    return {key: Reference.from_dict(entry) for key, entry in tree["references"].items()}


def package_store() -> Path:
    """Where the references of the package are kept."""
    return Path(str(files("percussion_model.verification.accuracy").joinpath(STORE)))


def save_references(path: Path, references: dict[str, Reference]) -> None:
    """Write references to a file."""
    tree = {
        "format": FORMAT,
        "references": {key: one.to_dict() for key, one in sorted(references.items())},
    }
    staged_file(path, json.dumps(tree, indent=1, allow_nan=True) + "\n")


def find_reference(
    problem: Problem, scene: Scene, progress: Callable[[str], None] = lambda text: None
) -> Reference:
    """Return the stored reference of a scene, or make a quicker one now."""
    known = load_references().get(fingerprint(scene))
    if known is not None:
        return known
    return make_reference(problem, scene, quick=True, progress=progress)


def make_reference(
    problem: Problem,
    scene: Scene,
    quick: bool = False,
    progress: Callable[[str], None] = lambda text: None,
) -> Reference:
    """Refine both solvers on a problem and extrapolate.

    Parameters
    ----------
    problem : Problem
    scene : Scene
        The scene that the problem was made of.
    quick : bool
        Whether coarser levels will do.
    progress : callable
        Called with what is being computed.
    """
    levels = _levels(problem, quick)
    answers: dict[str, list[Answer]] = {}
    for solver, chosen in levels.items():
        answers[solver] = []
        for level in chosen:
            first = "compiling or loading " if level is chosen[0] else ""
            progress(f"reference: {first}{level.name}")
            answers[solver].append(_answer(problem, level))
    bars = {}
    for key in problem.quantities:
        heard = [
            name
            for name in levels
            if key not in RINGING.get(name, ())
            and all(key in HISTORIES or key in answer.values for answer in answers[name])
        ]
        if key in HISTORIES:
            bars[key] = _history_bar(levels, answers, key)
        elif problem.kind == APERIODIC:
            last = {name: answers[name][-1] for name in heard}
            bars[key] = _agree({n: (one.values[key], one.errors[key]) for n, one in last.items()})
        else:
            limits = {n: _limit(answers[n], levels[n], key, ORDERS.get(n)) for n in heard}
            # peaks converge too slowly to tell another motion
            told = () if key.startswith("peak") else answers.get("modal", ())
            seen = [answer.values[key] for answer in told]
            bars[key] = _agree(limits, seen)
    made = {
        **{name: [level.name for level in chosen] for name, chosen in levels.items()},
        "date": time.strftime("%Y-%m-%d"),
        "version": version("percussion_model"),
        "numpy": version("numpy"),
        "numba": version("numba"),
        "quick": quick,
    }
    base = next(iter(levels))
    return Reference(scene.title, problem.kind, bars, answers[base][-1].histories, made)


def _levels(problem: Problem, quick: bool) -> dict[str, list[Rung]]:
    """Levels of each solver, coarse to fine."""
    scene, lengths = problem.scene, total_length(problem.scene)
    waves = WAVE_LEVELS_QUICK if quick else WAVE_LEVELS
    explicit = EXPLICIT_LEVELS_QUICK if quick else EXPLICIT_LEVELS
    fem = FEM_LEVELS_QUICK if quick else FEM_LEVELS
    if scene.effects.string:
        return _string_levels(problem, quick)
    if problem.kind == APERIODIC:
        counts, meshes = [LONG_CELLS], [LONG_CELLS]
    else:
        counts = [max(2, round(target / lengths)) for target in waves]
        meshes = [max(3, round(target / lengths)) for target in explicit]
    found = {"wave": [wave_rung(scene, count) for count in counts]}
    if default_solver(scene) == "modal":
        wished = MODES_QUICK if quick else MODES
        modes = affordable_modes(scene, (LONG_MODES,) if problem.kind == APERIODIC else wished)
        found["modal"] = [modal_rung(scene, count) for count in modes]
    try:
        ExplicitSolver(scene, meshes[0])
        found["explicit"] = [peer_rung("explicit", scene, count) for count in meshes]
        if quick or problem.kind == APERIODIC:
            return found
    except SceneError:
        pass
    finest = FEM_LEVELS[0] / lengths
    found["fem"] = [
        _fem_level(scene, count, 2.5e13 * (count / finest) ** 2)
        for count in (max(3, round(target / lengths)) for target in fem)
    ]
    return found


def _string_levels(problem: Problem, quick: bool) -> dict[str, list[Rung]]:
    """Levels where bars lie between piston and bit: of waves and of explicit elements."""
    scene, counts = problem.scene, STRING_LEVELS[: 2 if quick else 3]
    steps, meshes = counts, counts
    if problem.kind == APERIODIC:
        steps, meshes = (LONG_CELLS,), (LONG_MESH,)
    found = {"wave": [wave_rung(scene, count) for count in steps]}
    try:
        ExplicitSolver(scene, meshes[0])
    except SceneError:
        return found
    return found | {"explicit": [peer_rung("explicit", scene, count) for count in meshes]}


def _fem_level(scene: Scene, count: int, stiffness: float) -> Rung:
    label = f"{count} elements, CFL 1, K_C {stiffness:.3g} N/m"
    return Rung("fem", label, 1.0 / count, fem_scene(scene, count, 1.0, stiffness))


def _answer(problem: Problem, level: Rung) -> Answer:
    if problem.kind == APERIODIC:
        problem = replace(problem, duration=LONG * problem.duration)
    return Run(problem, level.scene, level.peer).answer()


def _limit(
    answers: Sequence[Answer], levels: Sequence[Rung], key: str, order: float | None
) -> tuple[float, float]:
    """Extrapolate the last two levels; the bar is what the last two steps of it changed.

    Half the change from the level before to the finest is a bound as well: where answers
    jump from level to level, extrapolation would promise too much. Where changes do not fall
    the finest is taken, and the greater change is the bar; of modes, which have no order, the
    finest and the range of their finer half.
    """
    values = [answer.values[key] for answer in answers]
    if order is None:
        finer = values[len(values) // 2 :]
        return values[-1], max(max(finer) - min(finer), abs(values[-1] - values[-2]))
    change = abs(values[-1] - values[-2])
    before = abs(values[-2] - values[-3]) if len(values) > 2 else math.inf
    if change > GROWTH * before:
        return values[-1], max(change, before)
    limits = [
        values[k + 1] + _remains(levels[k : k + 2], order) * (values[k + 1] - values[k])
        for k in range(len(values) - 1)
    ]
    return limits[-1], max(abs(limits[-1] - limits[-2]), 0.5 * change)


def _remains(levels: Sequence[Rung], order: float) -> float:
    """Error of the finer of two levels by the change between them."""
    return 1.0 / ((levels[0].size / levels[1].size) ** order - 1.0)


def _agree(limits: dict[str, tuple[float, float]], seen: Sequence[float] = ()) -> Bar:
    """Take the surest limit; the bar is its own, or the distance of the next one to it.

    It covers what else was seen too: all that modes found on the way to their limit. Where
    that is more than one motion, no solver can be called right.

    They agree where they lie within the sum of their bars, or so closely that the distance
    tells enough. One alone is no reference.
    """
    (value, error), *others = Bar(1.0, 0.0, limits, True).surest
    if not others:
        return Bar(value, error, limits, False)
    other, error_of_other = others[0]
    off = abs(value - other)
    agreed = off <= error + error_of_other or off <= CLOSE * abs(value)
    ends = min((value, *seen)), max((value, *seen))
    if seen and max(seen) - min(seen) > NEAR_THRESHOLD * abs(value):
        half = 0.5 * (ends[1] - ends[0])
        return Bar(ends[0] + half, max(error, off, half), limits, True, True)
    spread = max(ends[1] - value, value - ends[0])
    return Bar(value, max(error, off, spread), limits, agreed)


def _history_bar(levels: dict[str, list[Rung]], answers: dict[str, list[Answer]], key: str) -> Bar:
    """L1 distance of the finest waves to the second solver, the modes, or the waves before.

    The limits carry what is left of their error, which decides whether they agree.
    """
    base = next(iter(levels))
    finest = {name: found[-1].histories[key] for name, found in answers.items()}
    whole = float(np.sum(np.abs(finest[base])))

    def apart(a: np.ndarray, b: np.ndarray) -> float:
        return float(np.sum(np.abs(a - b))) / whole

    second = next((name for name in levels if name not in (base, "modal")), "")
    if not second:
        moved = apart(finest[base], answers[base][-2].histories[key])
        return Bar(1.0, moved, {base: (1.0, moved)}, False)
    change = {
        name: apart(finest[name], answers[name][-2].histories[key]) for name in (base, second)
    }
    left = {n: _remains(levels[n][-2:], ORDERS[n]) * moved for n, moved in change.items()}
    off = apart(finest[base], finest[second])
    limits = {base: (1.0, left[base]), second: (1.0 + off, left[second])}
    agreed = off <= max(sum(left.values()), CLOSE)
    modes = apart(finest[base], finest["modal"]) if "modal" in finest else 0.0
    return Bar(1.0, max(change[base], off, modes), limits, agreed)
