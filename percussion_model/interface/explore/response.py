"""Stationary response of a scene as the explorer shows it: numbers, one blow, its waves."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from percussion_model.analysis.stationary import Settled, settled
from percussion_model.interface.plotting.window import (
    NotRepeatable,
    StressField,
    Window,
    blow_window,
    stress_fields,
)
from percussion_model.interface.terminal import RATE, SHOWN, on_other_grids, settled_error
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.driller_numbers import DRILLER_NUMBERS, driller_text
from percussion_model.simulation.simulate import SimulationError
from percussion_model.simulation.uncertain import UNDECIDED, mean_text, rate_text

# Processor time after which a response that has not settled is given up [s].
MOST_TIME = 2.0
# What has taken so long gives way to a newer wish; less would leave a moved slider without
# any picture until it rests [s].
PATIENCE = 0.5
# Steps of the solver from sample to sample of the forces, and from column to column of the
# stress: fewer points cannot be told from all.
SAMPLES, COLUMNS = 4, 3


class Overtaken(Exception):
    """Something newer is wanted."""


@dataclass(frozen=True)
class Response:
    """What a scene does once it has settled.

    Attributes
    ----------
    scene : Scene
    found : Settled or None
        None where there is no stationary response, which `refusal` says.
    window : Window or None
        One blow.
    fields : dict of StressField
        Stress in the elastic bars.
    refusal : str
        Why there is nothing to show; else empty.
    taken : float
        Time that it took [s].
    """

    scene: Scene
    found: Settled | None = None
    window: Window | None = None
    fields: dict[str, StressField] = field(default_factory=dict)
    refusal: str = ""
    taken: float = math.nan


def refuse_scene(scene: Scene) -> None:
    """Raise `SceneError` for a scene whose response does not follow a slider."""
    if scene.piston.model == "absent":
        raise SceneError('piston.model = "absent": a bit alone has no blows; take `percussion run`')
    if scene.effects.string:
        raise SceneError(
            "effects.string = true: blows of a drill string settle too slowly to follow a slider; "
            "take `percussion run`"
        )


def respond(
    scene: Scene,
    is_overtaken: Callable[[], bool] = lambda: False,
    most_time: float = MOST_TIME,
) -> Response:
    """Find the stationary response of a scene, with the numbers of `percussion settled`.

    Parameters
    ----------
    scene : Scene
    is_overtaken : callable
        Whether something newer is wanted.
    most_time : float
        Processor time after which it is given up [s].

    Returns
    -------
    Response

    Raises
    ------
    Overtaken
        If something newer was wanted after `PATIENCE`.
    """
    began, used = time.perf_counter(), time.thread_time()

    def look(_: float = 0.0) -> None:
        if time.perf_counter() - began > PATIENCE and is_overtaken():
            raise Overtaken

    try:
        refuse_scene(scene)
        found = settled(scene, progress=look, most_time=most_time, error_estimate=True)
        look()
        # the run stopped where its last blow ended: a whole one more is sure to end it again
        after = float(found.blows[-1]["period"]) if len(found.blows) else 0.0
        window = blow_window(scene, found.blows, found.duration + after, SAMPLES)
        look()
        fields = stress_fields(window, COLUMNS)
    except (SceneError, SimulationError, NotRepeatable) as error:
        text = str(error)
        if time.thread_time() - used > most_time:
            text = (
                f"No stationary response within {most_time:g} s of computing, which is the limit "
                "here: `percussion settled` of this scene may take longer."
            )
        return Response(scene, refusal=text, taken=time.perf_counter() - began)
    return Response(scene, found, window, fields, taken=time.perf_counter() - began)


def numbers(found: Settled) -> dict[str, str]:
    """Numbers of a response as text with units and errors, those of `percussion settled`.

    What is undecided has no value; what is not defined is left out.
    """
    summary = found.summary()
    shown: dict[str, str] = {}
    if summary[RATE[1]] is not None:
        shown[RATE[0]] = (
            UNDECIDED
            if found.rate_of_penetration_undecided
            else f"{rate_text(summary)} {RATE[3]}{_in_driller_unit(summary, RATE[1], '; ')}"
        )
    for name, key, factor, unit in SHOWN:
        if summary.get(key) is not None:
            text = mean_text(summary, key, factor)
            behind = _in_driller_unit(summary, key, "; ")
            shown[name] = UNDECIDED if text.startswith(UNDECIDED) else f"{text} {unit}{behind}"
    for key, one in DRILLER_NUMBERS.items():
        if not one.behind and summary.get(key) is not None:
            text = _in_driller_unit(summary, key)
            shown[one.name] = UNDECIDED if text.startswith(UNDECIDED) else text
    return shown


def _in_driller_unit(summary: Mapping[str, Any], key: str, before: str = "") -> str:
    """A number in the unit of drillers; empty where they have no other."""
    if key not in DRILLER_NUMBERS:
        return ""
    return f"{before}{driller_text(summary, key)} {DRILLER_NUMBERS[key].unit}"


def motion(found: Settled) -> str:
    """Say how the blows follow each other."""
    return f"{found.motion}{on_other_grids(found)}"


def verdict(found: Settled) -> list[str]:
    """Say in words where there is no rate, where it is undecided, and where blows differ."""
    told = []
    if found.kind == "stalled":
        told.append("The blows have ceased: there is no rate and no period.")
    if found.kind == "aperiodic":
        told.append(f"The blows do not repeat: numbers are means over {len(found.counted)} blows.")
    if found.rate_of_penetration_undecided:
        told.append(
            "Without structural loss the rate depends on the resolution: it is undecided."
            if found.depends_on_cells
            else "The error of the rate is no smaller than the rate: it is undecided."
        )
    return told


def notes(found: Settled) -> list[str]:
    """Say what ± is of, and the warnings."""
    of_what = [settled_error(found)] if found.error_of else []
    return [*of_what, *(f"Warning: {text}" for text in found.warnings)]
