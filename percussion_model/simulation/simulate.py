"""The one time loop above the kernels: `Simulation` and `simulate`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Literal

import numpy as np

from percussion_model.physics.records import SAMPLE_FIELDS
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.accuracy import LONGEST, meet, time_needed
from percussion_model.simulation.result import Result
from percussion_model.simulation.stepping import Simulation, Snapshot
from percussion_model.simulation.time_loop import run_in_chunks, sampling_times, stop_on_interrupt

__all__ = ["Simulation", "SimulationError", "Snapshot", "simulate"]

# Share of the duration that settles where the scene's settling time is too long.
_SETTLING_SHARE = 0.25

_NO_TIMES = np.zeros(0)


def simulate(
    scene: Scene,
    duration: float | None = None,
    settle: float | None = None,
    trace: float | None = None,
    windows: Iterable[tuple[float, float]] = (),
    record_events: bool = True,
    progress: Callable[[float], None] | None = None,
    on_interrupt: Literal["raise", "keep"] = "raise",
    accuracy: float | None = None,
    check: bool | None = None,
) -> Result:
    """Run a scene from its start.

    Parameters
    ----------
    scene : Scene
    duration, settle : float, optional
        Simulated time, and the time before blows count [s]; default those of
        the scene.
    trace : float, optional
        Sampling interval of a trace [s].
    windows : iterable of (float, float)
        Intervals in which the trace has every time step [s].
    record_events : bool
        Whether to keep the event list.
    progress : callable, optional
        Called now and then with the time reached [s].
    on_interrupt : {"raise", "keep"}
        What Ctrl-C does: raise KeyboardInterrupt, or return what is finished,
        with a warning.
    accuracy : float, optional
        Wanted relative error of the rate of penetration, in place of cells;
        default that of the scene, which may be none. Where motion is aperiodic
        it is the standard error, and the run lasts up to a hundred times as
        long as its duration.
    check : bool, optional
        Whether to verify it by runs at half the step; default that of the scene.

    Returns
    -------
    Result

    Raises
    ------
    SceneError, SimulationError
        If the arguments make no sense or the run cannot go on.
    """
    scene, notes = _with_run_times(scene, duration, settle)
    scene = _with_request(scene, accuracy, check)
    windows = tuple(windows)
    sampling_times(scene.run.duration, None, trace, windows)  # refuses before anything is compiled
    wanted = scene.solver.accuracy

    def once(chosen: Scene, longer: bool) -> Result:
        grow = wanted if longer else None
        return _run_once(chosen, trace, windows, record_events, progress, on_interrupt, grow)

    result = once(scene, False) if wanted is None else meet(scene, once)
    result.warnings.extend(notes)
    return result


def _run_once(
    scene: Scene,
    trace: float | None,
    windows: Iterable[tuple[float, float]],
    record_events: bool,
    progress: Callable[[float], None] | None,
    on_interrupt: Literal["raise", "keep"],
    wanted: float | None,
) -> Result:
    """Run a scene as it is; on and on until the standard error is as `wanted`, if given."""
    end = scene.run.duration
    longest = LONGEST * end
    simulation = Simulation(scene, record_events)
    times = sampling_times(end, simulation.solver.time_step, trace, windows)
    with stop_on_interrupt(on_interrupt == "keep") as stop:
        rows = run_in_chunks(simulation, end, times, progress, stop)
        while wanted is not None and not stop():
            end = min(time_needed(simulation.result(), wanted), longest)
            if end <= simulation.time:
                break
            run_in_chunks(simulation, end, _NO_TIMES, progress, stop)
    columns = None
    if len(times):
        columns = {name: rows[:, k].copy() for k, name in enumerate(SAMPLE_FIELDS)}
    result = simulation.result(trace=columns)
    if result.cut_short:
        result.warnings.append(f"interrupted at t = {simulation.time:.6g} s")
    return result


def _with_request(scene: Scene, accuracy: float | None, check: bool | None) -> Scene:
    """Return the scene with what is asked of its accuracy."""
    changes = {"solver.accuracy": accuracy, "run.check": check}
    given = {key: value for key, value in changes.items() if value is not None}
    scene = scene.replace(**given) if given else scene
    if scene.run.check and scene.solver.accuracy is None:
        raise SceneError("run.check = true verifies solver.accuracy: set that too")
    return scene


def _with_run_times(
    scene: Scene, duration: float | None, settle: float | None
) -> tuple[Scene, list[str]]:
    """Return the scene with its run times replaced, and what to warn of."""
    changes = {"run.duration": duration, "run.settle": settle}
    given = {key: value for key, value in changes.items() if value is not None}
    notes = []
    longest = scene.run.settle
    if settle is None and isinstance(duration, (int, float)) and 0 < duration <= longest:
        given["run.settle"] = _SETTLING_SHARE * duration
        notes.append(
            f"run.settle = {longest!r} s is not below the duration of {duration!r} s: "
            f"blows count from {_SETTLING_SHARE * duration!r} s on"
        )
    return (scene.replace(**given) if given else scene), notes
