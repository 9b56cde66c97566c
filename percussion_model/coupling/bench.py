"""Bench of controllers of feed and pressure: standard runs and their scores."""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from percussion_model.coupling.component import CouplingError
from percussion_model.coupling.coupled_run import CoupledRun
from percussion_model.coupling.fresh import REMEDY, kept_values
from percussion_model.coupling.master import Coupling
from percussion_model.coupling.port import OnWay
from percussion_model.coupling.python_part import Given
from percussion_model.scene.hammers import CHAMBER_FILES
from percussion_model.scene.text import read_toml
from percussion_model.simulation.uncertain import in_digits

STEP = 1e-3  # of the runs; rows are as often, since peaks are those of a step [s]
# Held values have an error of first order in the step: twice what half of it changes.
FINER, ERROR_FACTOR = 0.5, 2.0
# At least this share of a number: within a blow, which is shorter than both steps, the damper of
# the shoulder brakes the bit, and neither sees it (docs/system.md, section 4: 1 to 2 %).
WITHIN_A_BLOW = 0.02
# And at least a blow's share of what comes and goes with blows: one halving of the step may
# happen to change hardly anything.
BY_BLOWS = ("depth", "energy_per_metre", "time_off_bottom", "dry_blows")
FEED = 3000.0  # what is wanted [N]
# Limits of the rig: beyond them a second counts as a violation.
HIGHEST_FEED, HIGHEST_TORQUE = 4000.0, 250.0  # [N], [N m]
# A run fails where it ends early, or has more of these than so: share of its time in
# violation, mean distance of the feed from what is wanted.
MOST_VIOLATION, MOST_ERROR = 0.1, 0.25
# Time before the feed is judged: the drill string has to come to rest [s].
SETTLING = 0.5
LATE = 1.0  # the last part of a run, in which the swing of the feed is measured [s]
# Of the sensors: share of the value, time, time between samples [s].
NOISE, DELAY, SAMPLING = 0.05, 0.03, 1e-3

SIGNALS = (
    "string.lifted", "string.bit_impulse", "hammer.bit.force_peak", "hammer.blow_count",
    "hammer.off_bottom", "rig.energy", "supply.energy", "controller.force_command",
    "rock.in_void",
)  # fmt: skip


@dataclass(frozen=True)
class StandardRun:
    """A standard run: parameters of the system, and disturbances of its signals."""

    name: str
    text: str
    duration: float
    parameters: Mapping[str, Any] = field(default_factory=dict)
    on_way: Callable[[], OnWay] | None = None


def _pressure_loss() -> OnWay:
    def change(signal: str, time: float, value: Any) -> Any:
        lost = signal == "hammer.supply_pressure" and 1.5 <= time < 3.0
        return 0.5 * value if lost else value

    return change


def _bad_sensors() -> OnWay:
    chance = random.Random(1)
    waiting: dict[str, deque[Any]] = {}
    sampled: dict[str, tuple[int, Any]] = {}

    def change(signal: str, time: float, value: Any) -> Any:
        if not signal.startswith("controller.") or isinstance(value, bool):
            return value
        # a sensor has its own clock, whatever the communication step
        count = math.floor(time / SAMPLING + 1e-6)
        if signal in sampled and sampled[signal][0] == count:
            return sampled[signal][1]
        queue = waiting.setdefault(signal, deque())
        queue.append(value)
        late = queue.popleft() if len(queue) > round(DELAY / SAMPLING) else queue[0]
        sampled[signal] = count, late * (1.0 + NOISE * chance.gauss(0.0, 1.0))
        return sampled[signal][1]

    return change


def _layer(number: int, top: float, **values: float) -> dict[str, float]:
    return {f"rock.layers[{number}].{name}": value for name, value in values.items()} | {
        f"rock.layers[{number}].top": top
    }


def _motor_stops() -> OnWay:
    def change(signal: str, time: float, value: Any) -> Any:
        stops = signal == "hammer.rotation.speed" and 1.5 <= time < 2.0
        return 0.0 if stops else value

    return change


_ONE_ROCK = {**_layer(1, 0.0, loading_stiffness=7.5e8), **_layer(2, -1.0), **_layer(3, -1.0)}
# A wide bit, whose motor has little torque to spare: once it stands, it needs more to begin.
_TURNING = {
    "hammer.effects.breaking": True,
    "hammer.hole_diameter": 0.0826,
    "hammer.breaking.buttons": 10,
    "hammer.effects.rotation": True,
    "hammer.rotation.mean_radius": 0.08,
    "hammer.rotation.friction": 0.8,
    "hammer.rotation.stall_torque": 265.0,
    "hammer.rotation.full_torque": 255.0,
}
# Chambers of the nearest size, a head whose weight bears their reaction at the start, and a supply
# that gives 0.7 of the 0.18 kg/s that they take at 20 bar.
_CHAMBERS = read_toml(CHAMBER_FILES / "sandvik-3-5-inch.toml")["pneumatic"]
_OF_AIR = {
    "hammer.effects.drive": "pneumatic",
    **{f"hammer.pneumatic.{name}": value for name, value in _CHAMBERS.items()},
    "string.head.mass": 530.0,
    "supply.medium": "air",
    "supply.compressor.flow_limit": 0.126,
    "supply.receiver.volume": 0.05,
}
STANDARD_RUNS = (
    StandardRun(
        "collaring", "the feed begins at a third", 3.0,
        {**_ONE_ROCK, "string.start.feed_force": 1000.0},
    ),
    StandardRun(
        "hard", "rock three times as stiff", 4.0,
        {**_ONE_ROCK, **_layer(1, 0.0, loading_stiffness=4e8),
         **_layer(2, 0.035, loading_stiffness=1.2e9)},
    ),
    StandardRun(
        "soft", "rock a third as stiff", 4.0,
        {**_ONE_ROCK, **_layer(1, 0.0, loading_stiffness=1.2e9),
         **_layer(2, 0.02, loading_stiffness=4e8)},
    ),
    StandardRun(
        "void", "twenty centimetres of filling with 1 kN/mm", 4.0,
        {**_ONE_ROCK, **_layer(2, 0.02, loading_stiffness=1e6),
         **_layer(3, 0.22, loading_stiffness=7.5e8)},
    ),
    StandardRun(
        "pressure", "half of the pressure is lost for 1.5 s", 4.0, _ONE_ROCK, _pressure_loss,
    ),
    StandardRun("rod", "a rod is added", 4.0, {**_ONE_ROCK, "string.start.rod_left": 0.03}),
    StandardRun("sensors", "5 % of noise, 30 ms late", 4.0, _ONE_ROCK, _bad_sensors),
    StandardRun(
        "jam", "a centimetre of rock that holds the bit", 4.0,
        {**_ONE_ROCK, **_layer(2, 0.03, torque_factor=3.0), **_layer(3, 0.04)},
    ),
    StandardRun(
        "rotation", "the motor of the rotation stops for 0.5 s", 5.0,
        {**_ONE_ROCK, **_layer(1, 0.0, torque_factor=0.0), **_TURNING}, _motor_stops,
    ),
    StandardRun(
        "air", "chambers of air, with a compressor that is too small", 4.0,
        {**_ONE_ROCK, **_OF_AIR},
    ),
)  # fmt: skip


@dataclass
class Score:
    """Score of a run.

    Attributes
    ----------
    points : float
        0 to 100: the share of the wanted feed that the feed differs from it, on average and
        outside of voids, is lost, and so is the share of the time in violation; 0 where the run
        has failed.
    numbers : dict
        depth [m], energy_per_metre [J/m], overshoot [1], time_off_bottom [s], dry_blows,
        peak_force [N], violations [s], feed_error [1], swing [1].
    faults : list of str
        Why the run has failed; empty if it has not.
    points_error : float or None
        By the communication step; None where that was not estimated.
    errors : dict
        The same of the numbers; empty where that was not estimated.
    doubt : str
        What half the step does in another way, so that it is not known whether the run fails.
    """

    trial: str
    points: float
    numbers: dict[str, float]
    error: str
    run: CoupledRun = field(repr=False)
    faults: list[str] = field(default_factory=list)
    points_error: float | None = None
    errors: dict[str, float] = field(default_factory=dict)
    doubt: str = ""


def judge(trial: StandardRun, run: CoupledRun) -> Score:
    """Score of a run."""
    time = run["time"]
    steps = np.diff(time, prepend=0.0)
    feed = run["string.feed_force_mean"]
    torque = run["rock.rotation_torque"]
    # nobody can keep a feed against nothing
    judged = (time >= SETTLING) & (run["rock.in_void"] == 0.0)
    error = float(np.mean(np.abs(feed[judged] / FEED - 1.0))) if judged.any() else 1.0
    off = (run["string.lifted"] > 0.0) | (run["hammer.off_bottom"] > 0.0)
    wrong = (feed > HIGHEST_FEED) | (torque > HIGHEST_TORQUE)
    depth = float(run["hammer.bit.position"][-1])
    blows = np.diff(run["hammer.blow_count"], prepend=0.0)
    numbers = {
        "depth": depth,
        "energy_per_metre": float(run["rig.energy"][-1] + run["supply.energy"][-1])
        / max(depth, 1e-6),
        "overshoot": max(0.0, float(np.max(feed) / FEED - 1.0)),
        "time_off_bottom": float(np.sum(steps[run["string.lifted"] > 0.0])),
        "dry_blows": float(np.sum(blows[off & (run["rock.in_void"] > 0.0)])),
        "peak_force": float(np.max(run["hammer.bit.force_peak"])),
        "violations": float(np.sum(steps[wrong])),
        "feed_error": error,
        "swing": float(0.5 * np.ptp(feed[time >= time[-1] - LATE]) / FEED),
    }
    share = numbers["violations"] / max(float(time[-1]), LATE)
    faults = _faults(numbers, share, run.error)
    points = 0.0 if faults else float(100.0 * (1.0 - error) * (1.0 - share))
    return Score(trial.name, points, numbers, run.error, run, faults)


def _faults(numbers: Mapping[str, float], share: float, error: str) -> list[str]:
    """Why a run has failed, with the share of its time in violation."""
    if error:
        return [f"ended early, {error}"]
    found = []
    if share > MOST_VIOLATION:
        found.append(f"{in_digits(numbers['violations'], 2)} s beyond the limits of feed or torque")
    if numbers["feed_error"] > MOST_ERROR:
        found.append(f"the feed is off by {100.0 * numbers['feed_error']:.0f} % on average")
    return found


def with_step_error(score: Score, finer: Score) -> Score:
    """A score with its errors by the communication step.

    Parameters
    ----------
    score, finer : Score
        Of the same run, with the usual step and with `FINER` of it.
    """
    of_a_blow = _shares_of_a_blow(score)
    errors = {
        name: max(
            ERROR_FACTOR * abs(finer.numbers[name] - value),
            WITHIN_A_BLOW * abs(value),
            # what neither step has at all is known
            of_a_blow.get(name, 0.0) if value or finer.numbers[name] else 0.0,
        )
        for name, value in score.numbers.items()
    }
    change = abs(finer.points - score.points)
    if bool(score.faults) == bool(finer.faults):
        lost = 0.0 if score.faults else 100.0 - score.points
        points = max(ERROR_FACTOR * change, WITHIN_A_BLOW * lost)
        return replace(score, points_error=points, errors=errors)
    failed = "; ".join(finer.faults)
    doubt = (
        f"at half the step it fails: {failed}" if failed else "at half the step it does not fail"
    )
    # a run that ended early has numbers of another stretch
    known = {} if score.error or finer.error else errors
    return replace(score, points_error=change, errors=known, doubt=doubt)


def _shares_of_a_blow(score: Score) -> dict[str, float]:
    """What one blow more or less makes of the numbers `BY_BLOWS`."""
    blows = max(1.0, float(score.run["hammer.blow_count"][-1]))
    whole = {**score.numbers, "time_off_bottom": float(score.run["time"][-1]), "dry_blows": blows}
    return {name: whole[name] / blows for name in BY_BLOWS}


class Watch(Protocol):
    """What is told how far a bench has come."""

    def stage(self, name: str, end: float, before: float, whole: float) -> None:
        """Take the run that begins; simulated times of it, of those before it, of all [s]."""

    def __call__(self, t: float) -> None:
        """Take the time that it has reached [s]."""


def bench(
    system: str | Path,
    controller: str | Path | Given | None = None,
    parameters: Mapping[str, Any] | None = None,
    trials: Sequence[str] = (),
    progress: Callable[[Score], None] | None = None,
    trust: bool = False,
    watch: Watch | None = None,
    check_step: bool = True,
    tell: Callable[[str], object] | None = None,
) -> list[Score]:
    """Put a controller through the standard runs.

    Parameters
    ----------
    system : str or Path
        Archive of the feed-controlled system.
    controller : optional
        An FMU, or a Python controller; the one of the archive if left out. Each run has a fresh
        one: a class and a factory are called, an object with `reset` is reset, any other
        object is copied. A function may keep nothing.
    parameters : mapping, optional
        Values of the controller, by `controller.variable`.
    trials : sequence of str, optional
        Names of runs; all if left out.
    progress : callable, optional
        Called with each score.
    trust : bool
        As for `Coupling`.
    watch : optional
        Is told by its `stage` which run begins, with the simulated times of it, of those before
        it and of all, and called with the time reached [s].
    check_step : bool
        Whether each run is done with half the communication step as well, which tells the
        error of its score.
    tell : callable, optional
        As for `Coupling.run`.
    """
    names = [trial.name for trial in STANDARD_RUNS]
    for name in trials:
        if name not in names:
            raise CouplingError(f"there is no run {name}: there are {', '.join(names)}")
    chosen = [trial for trial in STANDARD_RUNS if not trials or trial.name in trials]
    steps = (STEP, FINER * STEP) if check_step else (STEP,)
    whole = len(steps) * sum(trial.duration for trial in chosen)
    kept = kept_values(controller)
    before = 0.0
    found: list[Score] = []
    for k, trial in enumerate(chosen, 1):
        runs = []
        for step in steps:
            if watch is not None:
                again = "" if step == STEP else ", with half the step"
                name = f"run {k} of {len(chosen)}, {trial.name}{again}"
                watch.stage(name, trial.duration, before, whole)
            before += trial.duration
            coupling = Coupling(
                system,
                {**trial.parameters, **(parameters or {})},
                replaced=None if controller is None else {"controller": controller},
                on_way=None if trial.on_way is None else trial.on_way(),
                trust=trust,
            )
            _refuse_other_system(coupling)
            coupling.start = 0.0  # disturbances and scores count from there
            run = coupling.run(trial.duration, step, SIGNALS, step, progress=watch, tell=tell)
            runs.append(judge(trial, run))
            _refuse_changed(controller, kept)
        found.append(with_step_error(*runs) if check_step else runs[0])
        if progress is not None:
            progress(found[-1])
    return found


def _refuse_other_system(coupling: Coupling) -> None:
    """Raise `CouplingError` for a system without the signals that scores are made of."""
    outputs = coupling.outputs
    wanted = [signal.split(".", 1) for signal in SIGNALS]
    lacking = [
        f"{part}.{name}"
        for part, name in wanted
        if part != "controller" and name not in outputs.get(part, ())
    ]
    if lacking:
        coupling.free()
        raise CouplingError(
            f"{coupling.path.name} has no {', '.join(lacking)}: the bench needs FeedControl or "
            "FeedControlRigid"
        )


def _refuse_changed(controller: Any, before: Mapping[str, bytes]) -> None:
    """Raise `CouplingError` for a function that carries values from one run to the next."""
    after = kept_values(controller)
    changed = sorted(name for name in after if after[name] != before.get(name))
    if changed:
        raise CouplingError(
            f"controller: {controller.__name__} keeps values from one run to the next "
            f"({', '.join(changed)}): {REMEDY}"
        )


def mean_points(scores: Sequence[Score]) -> float:
    """Mean of the points."""
    return float(np.mean([score.points for score in scores])) if scores else 0.0


def mean_points_error(scores: Sequence[Score]) -> float | None:
    """Mean of the errors of the points, which are of one cause; None where one is not known."""
    errors = [score.points_error for score in scores]
    known = [error for error in errors if error is not None]
    return float(np.mean(known)) if known and len(known) == len(errors) else None
