"""Study of effects: a scene with one effect at a time turned off, or on."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from percussion_model.analysis.change import Change, change_of
from percussion_model.components import COMPONENTS, Component
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.error_estimate import LARGE
from percussion_model.simulation.rate import LEAST_BLOWS
from percussion_model.simulation.result import Result
from percussion_model.simulation.simulate import Simulation, simulate
from percussion_model.simulation.uncertain import known_error, known_scatter
from percussion_model.simulation.warnings import unused_note

__all__ = [
    "NOISE",
    "EffectsStudy",
    "Variant",
    "VariantRun",
    "effect_variants",
    "step_costs",
    "study_effects",
]

# A step whose cost differs by this much from the scene's differs by more than noise.
NOISE = 1.05

# Free flight, in which a step meets nothing: gaps that are not crossed in so
# many steps [m], however short the stroke.
FLIGHT: dict[str, Any] = {
    "start.gap": 100.0,
    "start.rock_gap": 100.0,
    "start.piston_velocity": 0.0,
    "start.bit_velocity": 0.0,
    "solver.leaps": False,
}
FLIGHT_STEPS = 4_000
# Measurements of a step; noise only adds, so the least is taken.
ROUNDS = 40
# A run shorter than this is timed again, so often at most [s].
SHORT_RUN = 1.5
MOST_RUNS = 7

# Name of the variant of an accelerator, which changes no number.
LEAPS = "leaps"
# Words of warnings of what stands beside a rate as its error.
OF_THE_ERROR = (LARGE, "standard error")
# Numbers of a summary whose change is shown.
CHANGED = ("rate_of_penetration", "blow_period", "peak_bit_force")
# The same of a bit that falls without a piston.
CHANGED_OF_FALL = ("depth", "rebound_velocity", "rest_time")
# What is said of a bit that has none.
NO_DEPTH = "it has no depth"

_NO_ROCK = "the bit meets no rock: it flies, and drills nothing"
_NO_DRIVE = "nothing throws the piston: what moves is left from the start and comes to rest"
_NO_PISTON = "there is no piston, so no blows that a rate or a period could be taken from"
_NO_REBOUND = "the bit does not leave the rock"
_NO_REST = "the bit has not come to rest when the run ends"
_NO_CRUSHING = "a linear spring gives all back: nothing is crushed"
_BARRIER = ("rock.barrier_energy", "rock.barrier_damping")
# Parts of the power law: their key, its value without them and with, and words for both.
_PARTS_OF_POWER: dict[str, tuple[str, float, float, str, str]] = {
    "loading": ("rock.loading_exponent", 1.0, 1.5, "n = 1", "n = 1.5"),
    "unloading": ("rock.unloading_exponent", 0.0, 0.5, "q = 0", "q = 0.5"),
    "chipping": ("rock.chipping_penetration", 0.0, 1e-4, "off", "by 0.1 mm"),
}
_HALF_REMOVED = {"rock.removed_share": 0.5, "rock.removal_exponent": 1.0}


@dataclass(frozen=True)
class Variant:
    """One effect changed.

    Attributes
    ----------
    effect : str
        Its name; empty for the scene as it is.
    setting : str
        "off", "on", or what takes its place.
    changes : dict
        Values by dotted key.
    off : bool
        Whether something is left out, so that nothing may cost more.
    no_penetration : str
        Why the rate of penetration means nothing then; may be empty.
    no_blows : str
        Why nothing that is counted by blows means anything; may be empty.
    """

    effect: str
    setting: str
    changes: dict[str, Any] = field(default_factory=dict)
    off: bool = False
    no_penetration: str = ""
    no_blows: str = ""

    @property
    def name(self) -> str:
        """Effect and setting."""
        between = " " if self.setting in ("on", "off") or not self.effect else ": "
        return f"{self.effect}{between}{self.setting}".strip()

    def apply(self, scene: Scene) -> Scene:
        """Return the scene with the effect changed; `SceneError` where it cannot be."""
        if self.changes.get("solver.name") == "rigid":
            rest = {key: value for key, value in self.changes.items() if key != "solver.name"}
            return scene.computed_by("rigid", **rest)
        return scene.replace(**self.changes)


def by_one_solver(scene: Scene) -> Scene:
    """Return the scene for waves where it names no solver: they compute it without loss too."""
    chosen = scene.solver.name == "auto" and scene.solver_name == "modal"
    return scene.computed_by("wave") if chosen else scene


def effect_variants(scene: Scene) -> Iterator[Variant]:
    """Go through the scene as it is, then one effect after the other."""
    effects = scene.effects
    yield Variant("", "as it is", no_penetration=_NO_CRUSHING if effects.rock == "spring" else "")
    for name in ("gravity", "feed", *(one.name for one in COMPONENTS if _can_turn(scene, one))):
        yield _switched(name, getattr(effects, name))
    yield from _drive(scene)
    yield from _rock(scene)
    yield from _bars(scene)
    yield from _string(scene)
    if scene.solver_name == "modal":
        is_on = scene.solver.leaps
        # Leaps are no effect but an accelerator: a step without them is the same step.
        yield Variant(LEAPS, "off" if is_on else "on", {"solver.leaps": not is_on})


def _can_turn(scene: Scene, one: Component) -> bool:
    """Whether a component can be turned: it is on, or acts and has all that it needs."""
    if one.is_drive:
        return False
    if scene[f"effects.{one.name}"]:
        return True
    acts = all(scene[key] in values for key, values in one.needs.items())
    needed = [name for name, (default, *_) in one.parameters.items() if default is None]
    known = [scene[f"{one.name}.{name}"] for name in needed]
    return acts and None not in known and (one.gained is None or scene.hole_diameter is not None)


def _switched(
    effect: str, is_on: bool, needs: Mapping[str, Any] | None = None, words: str = "on"
) -> Variant:
    """An effect turned off; or on, with values that it needs."""
    key = f"effects.{effect}"
    if is_on:
        return Variant(effect, "off", {key: False}, off=True)
    return Variant(effect, words, {key: True, **(needs or {})})


def _drive(scene: Scene) -> Iterator[Variant]:
    if scene.effects.drive != "none":
        yield Variant("drive", "off", {"effects.drive": "none"}, off=True, no_blows=_NO_DRIVE)
    elif scene.piston.model != "absent":
        yield Variant("drive", "on", {"effects.drive": "pressure"})


def _rock(scene: Scene) -> Iterator[Variant]:
    rock = scene.effects.rock
    if scene.matters("rock.unloading_ratio"):
        yield _switched("barrier", scene.barrier_on, _not_zero(scene, _BARRIER))
        other = "paper" if scene.effects.standstill_tension == "release" else "release"
        words = "as in the paper" if other == "paper" else "released"
        yield Variant("standstill tension", words, {"effects.standstill_tension": other})
        yield from _power_law(scene)
        yield _switched("cuttings", scene.cuttings_on, _HALF_REMOVED, "half removed")
        yield Variant(
            "rock law",
            "linear spring",
            {
                "effects.rock": "spring",
                "effects.barrier": False,
                # a spring has no buttons
                "rock.loading_stiffness": scene.loading_stiffness,
            },
            off=True,
            no_penetration=_NO_CRUSHING,
        )
    if rock == "none":
        yield Variant("rock", "on", {"effects.rock": "bilinear"})
    else:
        changes = {"effects.rock": "none", "effects.barrier": False}
        yield Variant("rock", "off", changes, off=True, no_blows=_NO_ROCK)


def _power_law(scene: Scene) -> Iterator[Variant]:
    """Parts of the power law, one by one: without any it is the bilinear law."""
    plain: dict[str, Any] = {}
    if scene.effects.rock == "bilinear":
        plain = {key: without for key, without, *_ in _PARTS_OF_POWER.values()}
        plain |= {"effects.rock": "power", "rock.buttons": 1}
    for effect, (key, without, value, off, on) in _PARTS_OF_POWER.items():
        is_on = not plain and scene[key] != without
        changes = {**plain, key: without if is_on else value}
        yield Variant(effect, off if is_on else on, changes, off=is_on)


def _bars(scene: Scene) -> Iterator[Variant]:
    if scene.bit.model == "elastic":
        yield _switched("loss", scene.loss_on, _not_zero(scene, ("loss.time",)))
        if scene.piston.model == "elastic":
            yield Variant("piston", "rigid", {"piston.model": "rigid"}, off=True)
        elif scene.piston.model == "rigid":
            yield Variant("piston", "elastic", {"piston.model": "elastic"})
        if not scene.effects.string:
            yield Variant("piston and bit", "rigid", {"solver.name": "rigid"}, off=True)
        return
    changes = {"bit.model": "elastic", "solver.name": "wave"}
    if scene.piston.model == "rigid":
        changes["piston.model"] = "elastic"
    yield Variant("piston and bit", "elastic", changes)


def _string(scene: Scene) -> Iterator[Variant]:
    """Effects of a drill string."""
    if scene.effects.string:
        if any(rod.joint != "perfect" for rod in scene.string.rods):
            yield _switched("joints", scene.effects.joints)
        yield _switched("damper", scene.effects.damper)


def _not_zero(scene: Scene, keys: tuple[str, ...]) -> dict[str, Any]:
    """Defaults for what the scene sets to zero, which would keep the effect off."""
    return {key: scene.row_of(key).default for key in keys if scene[key] == 0}


@dataclass(frozen=True)
class VariantRun:
    """One variant of a scene.

    Attributes
    ----------
    variant : Variant
        What was changed; that of the scene itself changes nothing.
    result : Result
        Of the whole run.
    wall_time : float
        Time of the whole run, the least of several, without compilation and
        set-up [s].
    step : float or None
        Processor time of a time step in free flight, without leaps [s]; None
        where the solver has no step.
    """

    variant: Variant
    result: Result
    wall_time: float
    step: float | None

    @property
    def reason(self) -> str:
        """Why there is no rate of penetration, or why it must not be trusted; may be empty."""
        return "; ".join(self.reasons)

    @property
    def reasons(self) -> list[str]:
        """Parts of `reason`."""
        if self.variant.no_blows or self.variant.no_penetration:
            return [self.variant.no_blows or self.variant.no_penetration]
        if self.falls:
            fall = self.result.fall
            if not any(fall.values()):
                return [_NO_PISTON]
            has_none = [text for text in self.result.warnings if NO_DEPTH in text]
            missing = {"rebound_velocity": _NO_REBOUND, "rest_time": _NO_REST}
            return has_none or [why for name, why in missing.items() if name not in fall]
        reasons = [text for text in self.result.warnings if "trusted" in text]
        if len(self.result.counted) < LEAST_BLOWS:
            reasons += [text for text in self.result.warnings if "whole blow" in text][:1]
        elif self.undecided and not reasons:
            reasons += [
                "the motion is aperiodic, and the run too short to determine its rate of "
                "penetration"
            ]
        return reasons

    @property
    def falls(self) -> bool:
        """Whether a bit falls without a piston."""
        return self.result.scene.piston.model == "absent"

    @property
    def undecided(self) -> bool:
        """Whether scatter hides the rate of penetration, or it is one of the cells."""
        return self.result.rate_of_penetration_undecided

    def numbers(self) -> dict[str, Any]:
        """What was found, as plain values; None is what is not defined."""
        summary = self.result.summary()
        blows = summary["blows"]
        found = {name: summary[name] for name in (*CHANGED, "drilling_cycles_per_blow")}
        found |= {f"{name}_error": known_error(summary, name) for name in CHANGED}
        found |= {f"{name}_standard_error": known_scatter(summary, name) for name in CHANGED}
        found["rate_of_penetration_undecided"] = self.undecided
        if self.falls:
            found |= self._fall(summary)
        if self.variant.no_penetration:
            found |= dict.fromkeys(key for key in found if key.startswith(CHANGED[0]))
        if self.variant.no_blows:
            found = dict.fromkeys(found)
            blows = None
        return {
            "effect": self.variant.effect,
            "turned": self.variant.setting,
            "step_time": self.step,
            "wall_time": self.wall_time,
            "blow_time": self.wall_time / blows if blows else None,
            "events": summary["events"],
            "blows": blows,
            "steps": summary["statistics"].get("steps"),
            **found,
            "reason": self.reason,
            "warnings": summary["warnings"],
        }

    def _fall(self, summary: dict[str, Any]) -> dict[str, Any]:
        """Numbers of a fall, which happens once: nothing scatters."""
        found: dict[str, Any] = {}
        for name in CHANGED_OF_FALL:
            found[name] = summary["fall"].get(name)
            found[f"{name}_error"] = known_error(summary, name)
            found[f"{name}_standard_error"] = None if found[name] is None else 0.0
        return found


@dataclass(frozen=True)
class EffectsStudy:
    """A scene and its variants, one effect changed in each.

    Attributes
    ----------
    scene : Scene
    base : VariantRun
        The scene as it is.
    trials : list of VariantRun
    refused : dict of str
        Effects that cannot be changed in this scene, and why.
    """

    scene: Scene
    base: VariantRun = field(repr=False)
    trials: list[VariantRun] = field(repr=False)
    refused: dict[str, str] = field(repr=False)

    @property
    def changed(self) -> tuple[str, ...]:
        """Numbers whose change is shown: `CHANGED`, or `CHANGED_OF_FALL`."""
        return CHANGED_OF_FALL if self.base.falls else CHANGED

    def change(self, trial: VariantRun, name: str) -> Change:
        """Change of a number of `changed` against the scene itself.

        Leaps go over the same grid: whatever it puts off is in both runs, and scatter is left.
        """
        found = change_of(trial.numbers(), self.base.numbers(), name, trial.variant.effect == LEAPS)
        both = trial, self.base
        if name == CHANGED[0] and any(one.undecided for one in both):
            return replace(found, hidden=True)
        return found

    def changes(self, trial: VariantRun) -> dict[str, float | None]:
        """Relative change of each number of `changed`; None where there is none that counts."""
        found = {name: self.change(trial, name) for name in self.changed}
        return {name: None if one.hidden else one.value for name, one in found.items()}

    def change_errors(self, trial: VariantRun) -> dict[str, float | None]:
        """Errors of `changes`, by grid and scatter of both runs; None where it is not known."""
        return {name: self.change(trial, name).error for name in self.changed}

    def undecided(self, trial: VariantRun) -> list[str]:
        """Numbers of `changed` whose change is within what is known of its error."""
        return [name for name in self.changed if self.change(trial, name).is_undecided]

    def warnings(self) -> list[str]:
        """Warnings of the scene, and others of its variants behind their names.

        Not those of a large error, which stands beside the rate, and what `reason` says.
        """
        texts = list(self.base.result.warnings)
        said = {_words(text) for text in texts}
        for trial in self.trials:
            if trial.variant.no_blows:
                continue
            known = said | {
                *map(_words, trial.reasons),
                _words(unused_note(trial.result.scene.given_in_vain)),
            }
            texts += [
                f"{trial.variant.name}: {text}"
                for text in trial.result.warnings
                if _words(text) not in known and not any(word in text for word in OF_THE_ERROR)
            ]
        return texts

    def is_costlier(self, trial: VariantRun) -> bool:
        """Whether turning an effect off made a step costlier, beyond noise."""
        if not trial.variant.off or trial.step is None or self.base.step is None:
            return False
        return trial.step > NOISE * self.base.step

    def to_dict(self) -> dict[str, Any]:
        """All numbers as plain values for JSON, SI units."""
        return {
            "title": self.scene.title,
            "solver": self.base.result.solver,
            "cells": self.base.result.cells or None,
            "duration": self.base.result.duration,
            "settle": self.base.result.settle,
            "scene": self.base.numbers(),
            "effects": [
                {
                    **trial.numbers(),
                    "changes": self.changes(trial),
                    "change_errors": self.change_errors(trial),
                    "undecided": self.undecided(trial),
                    "step_dearer": self.is_costlier(trial),
                }
                for trial in self.trials
            ],
            "refused": self.refused,
        }


def _words(text: str) -> str:
    """A text without its numbers."""
    return re.sub(r"[\d.e+-]*\d", "", text)


def study_effects(
    scene: Scene,
    duration: float | None = None,
    settle: float | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> EffectsStudy:
    """Turn each effect of a scene off, or on where it is off, and run all of them.

    Parameters
    ----------
    scene : Scene
    duration, settle : float, optional
        Simulated time, and the time before blows count [s]; default those of
        the scene.
    progress : callable, optional
        Called with what is done next and the share of the whole that is done.

    Returns
    -------
    EffectsStudy

    Raises
    ------
    SceneError, SimulationError
        If the scene itself cannot be computed.
    """
    scene = by_one_solver(scene)
    base, *rest = effect_variants(scene)
    cases = [(base, scene)]
    refused = {}
    for variant in rest:
        try:
            cases.append((variant, variant.apply(scene)))
        except SceneError as error:
            refused[variant.name] = str(error)
    found = []
    for k, (variant, changed) in enumerate(cases):
        if progress is not None:
            progress(variant.name if variant.effect else "the scene as it is", k / (len(cases) + 1))
        found.append(_best_run(changed, duration, settle))
    if progress is not None:
        progress("time steps", len(cases) / (len(cases) + 1))
    steps = step_costs([changed for _, changed in cases])
    trials = [
        VariantRun(variant, result, wall, step)
        for (variant, _), (result, wall), step in zip(cases, found, steps, strict=True)
    ]
    return EffectsStudy(scene, trials[0], trials[1:], refused)


def _best_run(scene: Scene, duration: float | None, settle: float | None) -> tuple[Result, float]:
    """Run a scene, a short one several times; the least wall time [s]."""
    result = simulate(scene, duration, settle, error_estimate=True)
    walls = [result.wall_time]
    while sum(walls) < SHORT_RUN and len(walls) < MOST_RUNS:
        walls.append(simulate(scene, duration, settle, error_estimate=False).wall_time)
    return result, min(walls)


def step_costs(scenes: Sequence[Scene], rounds: int = ROUNDS) -> list[float | None]:
    """Processor time of one time step in free flight, without leaps, of each scene [s].

    Short stretches taken in turn, so that a machine that slows down slows all
    of them. None where a solver goes from event to event and makes no steps in flight.
    """
    flights = []
    for scene in scenes:
        changes = {key: value for key, value in FLIGHT.items() if scene.matters(key)}
        flights.append(Simulation(scene.replace(**changes), record_events=False))
    best = [math.inf if flight.solver.time_step else None for flight in flights]
    for _ in range(rounds):
        for k, flight in enumerate(flights):
            step, least = flight.solver.time_step, best[k]
            if step is not None and least is not None:
                best[k] = min(least, _cost_of_step(flight, FLIGHT_STEPS * step))
    return [cost if cost is not None and math.isfinite(cost) else None for cost in best]


def _cost_of_step(simulation: Simulation, duration: float) -> float:
    """Advance a simulation; processor time by the steps that it took [s], infinite without one."""
    before = simulation.statistics()["steps"]
    began = time.process_time()
    simulation.advance(simulation.time + duration)
    cost = time.process_time() - began
    steps = simulation.statistics()["steps"] - before
    return cost / steps if steps else math.inf
