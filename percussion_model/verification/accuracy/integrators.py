"""General integrators: one blow by scipy's `solve_ivp`, restarted at each event."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from percussion_model.physics.records import READING, Mode
from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import Simulation
from percussion_model.solvers.fem.records import Node
from percussion_model.verification.accuracy.problems import (
    AHEAD,
    DROP,
    HISTORY,
    RATE,
    SETTLING_BLOWS,
    Answer,
    Problem,
)
from percussion_model.verification.accuracy.semidiscrete import DRIVE, GAP, Drill

__all__ = ["INTEGRATORS", "Course", "GeneralRun", "integrate"]

INTEGRATORS = ("LSODA", "DOP853", "RK45", "RK23", "Radau", "BDF")
# Absolute tolerances by the relative one: displacement [m], velocity [m/s], work and energy [J].
ABSOLUTE = (1e-5, 10.0, 1e-2, 1.0)
# An implicit method must not pass over a contact: steps of at most so many bar transits.
LONGEST = 2.0
# After an event the state advances by so much before the integrator starts anew [s].
NUDGE = 1e-9
_IMPLICIT = ("Radau", "BDF", "LSODA")


@dataclass
class Course:
    """Result of an integration.

    Attributes
    ----------
    time : float
        Where it ended: the start of the next blow, or the end asked for [s].
    started : float
        Start of the first blow [s]; NaN without a piston.
    start_position : float
        Mean position of the bit there [m].
    start_energy : float
        Energy given to the rock before [J].
    events, calls : int
        Events, and evaluations of the slope.
    cost : float
        Processor time from the start of the blow on [s].
    rebound_velocity : float
        Mean velocity of the piston when the last contact opened [m/s].
    samples : ndarray
        Force on the rock at the times asked for [N].
    """

    time: float = 0.0
    started: float = np.nan
    start_position: float = 0.0
    start_energy: float = 0.0
    events: int = 0
    calls: int = 0
    cost: float = 0.0
    rebound_velocity: float = np.nan
    samples: np.ndarray = field(default_factory=lambda: np.zeros(0))


def integrate(
    drill: Drill,
    method: str,
    relative: float,
    end: float,
    offsets: np.ndarray | None = None,
    patience: float = np.inf,
) -> Course:
    """Integrate to the start of the next blow, at most to `end`.

    Parameters
    ----------
    drill : Drill
        Is left in the state at the end.
    method : str
        Of `solve_ivp`.
    relative : float
        Relative tolerance.
    end : float
        [s]
    offsets : ndarray, optional
        Times since the start of the blow, or of the run without a piston,
        at which to note the force on the rock [s].
    patience : float
        Processor time after which to give up [s].

    Raises
    ------
    OutOfTime
        If it takes longer.
    RuntimeError
        If the integrator fails.
    """
    n = drill.n
    scene: Scene = drill.scene
    options: dict[str, Any] = {
        "rtol": relative,
        "atol": relative * np.repeat(ABSOLUTE, (n, n, 1, 1)),
    }
    if method in _IMPLICIT:
        options["jac"] = drill.jacobian
        options["max_step"] = LONGEST * scene.bit.transit_time
    found = Course(samples=np.zeros(0 if offsets is None else len(offsets)))
    times = np.zeros(0)
    if offsets is not None and not drill.n_p:
        times = offsets
    armed = drill.alpha > 0
    drill.deadline = time.process_time() + patience
    began = time.process_time()
    noted = 0
    while found.time < end:
        candidates = drill.event_functions()
        here = times[noted:]
        here = here[(here >= found.time) & (here <= end)]
        step = solve_ivp(
            drill.slope,
            (found.time, end),
            drill.y,
            method,
            t_eval=np.append(here, end) if len(here) and here[-1] < end else [*here, end],
            events=[function for _, function in candidates],
            **options,
        )
        if step.status < 0:
            raise RuntimeError(f"{method}: {step.message}")
        seen = len(step.t) - (step.status == 0)
        if seen > 0:
            found.samples[noted : noted + seen] = drill.bit_force(step.y[:, :seen])
            noted += seen
        if step.status == 0:
            found.time, drill.y = end, step.y[:, -1].copy()
            break
        which = next(k for k, hits in enumerate(step.t_events) if len(hits))
        found.time = float(step.t_events[which][-1])
        drill.y = step.y_events[which][-1].copy()
        events = [candidates[which][0]]
        drill.process_event(events[0])
        events += drill.step_off(found.time, NUDGE)
        found.events += len(events)
        if GAP in events and drill.closed and armed:
            if not np.isnan(found.started):
                break
            armed = False
            found.started, began = found.time, time.process_time()
            found.start_position = drill.mean(drill.y[:n], True)
            found.start_energy = float(drill.y[-1])
            if offsets is not None:
                times = found.started + NUDGE + offsets
        if GAP in events and not drill.closed:
            found.rebound_velocity = drill.mean(drill.y[n : 2 * n], False)
        if DRIVE in events and drill.alpha > 0:
            armed = True
        found.time += NUDGE
    found.calls, found.cost = drill.calls, time.process_time() - began
    return found


def start_periodic(drill: Drill, problem: Problem) -> None:
    """Start a drill in the periodic motion of the finite elements on the same mesh.

    Some time before a blow; what the mesh does to the motion is in it already.
    """
    simulation = Simulation(drill.scene, record_events=False)
    simulation.advance(SETTLING_BLOWS * problem.period)
    before = simulation.save()
    simulation.advance(problem.duration)
    last = simulation.blows[-1]
    simulation.restore(before)
    simulation.advance(float(last["time"] - AHEAD * last["period"]))
    state = simulation.solver.read(simulation.save().state, simulation.time, np.zeros(1, READING))
    record, nodes = state.record[0], state.arrays[0]
    drill.y[: drill.n], drill.y[drill.n : 2 * drill.n] = nodes[Node.U], nodes[Node.V]
    drill.y[: drill.n] += float(record["far"])
    drill.y[-2:] = float(record["w"]), 0.0
    drill.mode, drill.closed = Mode(int(record["mode"])), bool(record["closed"])
    drill.alpha, drill.p_u = int(record["alpha"]), float(record["p_u"])


class GeneralRun:
    """A general integrator on a problem: one blow of the periodic motion, or a drop.

    Parameters
    ----------
    problem : Problem
    scene : Scene
        That of the problem, with the mesh chosen.
    method : str
        Of `INTEGRATORS`.
    relative : float
        Tolerance.
    patience : float
        Processor time after which to give up [s].

    Raises
    ------
    OutOfTime, RuntimeError
        If the integrator takes longer or fails.
    """

    def __init__(
        self, problem: Problem, scene: Scene, method: str, relative: float, patience: float
    ) -> None:
        self.problem = problem
        began = time.process_time()
        drill = Drill(scene)
        drop = problem.kind == DROP
        if not drop:
            start_periodic(drill, problem)
        self.setup_time = time.process_time() - began
        end = problem.duration if drop else (1.0 + 2.0 * AHEAD) * problem.period
        self.course = integrate(drill, method, relative, end, problem.offsets, patience)
        self.drill = drill
        if not drop and not (self.course.time > self.course.started + 0.5 * problem.period):
            raise RuntimeError(f"{method}: the next blow was not found")

    def cost(self, duration: float | None = None) -> float:
        """Processor time of the blow or drop, computed once [s]."""
        return self.course.cost

    def answer(self) -> Answer:
        """What the integrator finds."""
        drill, course, n = self.drill, self.course, self.drill.n
        peak = float(course.samples.max())
        if self.problem.kind == DROP:
            place = float(drill.y[n - 1])
            values = {"resting_place": place, "peak_bit_force": peak, "rock_energy": drill.y[-1]}
            return Answer(values, histories={HISTORY: course.samples})
        period = course.time - course.started
        advance = drill.mean(drill.y[:n], True) - course.start_position
        impact, into_rock = (
            drill.mean(drill.y[n : 2 * n], False),
            float(drill.y[-1]) - course.start_energy,
        )
        values = {
            RATE: advance / period,
            "blow_period": period,
            "impact_velocity": impact,
            "rebound_velocity": course.rebound_velocity,
            "rock_energy": into_rock,
            "rock_share": into_rock / (0.5 * drill.scene.piston.mass * impact**2),
            "peak_bit_force": peak,
        }
        return Answer(values, histories={HISTORY: course.samples}, blows=1.0)
