"""Problems on which methods are compared: quantities, answers, runs of the solvers.

A periodic scene starts near its periodic motion, so that few blows tell the answer of
four seconds; a drop is computed as a whole; an aperiodic scene by statistics.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.gauge import gauge_stress
from percussion_model.simulation.rate import rate_of_blows, ratio_of_sums
from percussion_model.simulation.simulate import Simulation, Snapshot
from percussion_model.solvers.base import Solver
from percussion_model.solvers.modal.resolution import in_first_bar

RATE = "rate_of_penetration"
HISTORY = "bit_force_history"
CONTACT_HISTORY, STRESS_HISTORY = "contact_force_history", "stress_history"
HISTORIES = (HISTORY, CONTACT_HISTORY, STRESS_HISTORY)
PERIODIC, APERIODIC, DROP = "periodic", "aperiodic", "drop"
# From a start near the periodic motion the reference comes closer by a factor of 4 a blow.
SETTLING_BLOWS, COUNTED_BLOWS = 7, 2
# A motion counts as periodic where single blows differ by less than this from their mean.
PERIODIC_WITHIN = 1e-2
# Fewer blows of the pilot run tell nothing.
LEAST_BLOWS = 6
# Histories: after the start of a blow or of a drop [s].
HISTORY_LENGTH, HISTORY_STEP = 2e-3, 2e-6
# The contact force is a mean over so long: hard contact has impulses, a penalty rings [s].
CONTACT_STEP = 1e-5
# Where before a blow a method of lines begins, as a share of the period.
AHEAD = 0.2
_MEANS = ("impact_velocity", "rebound_velocity", "rock_energy")
# Entries of the ledger that the rock takes.
INTO_ROCK = ("crushing", "barrier", "standstill", "recoverable")
# Modes in the bar of the shortest transit time of a pilot run by modes: a number that no rung
# has, since tables that are kept would hide the set-up of that rung.
PILOT_MODES = 30


@dataclass(frozen=True)
class Quantity:
    """A number that methods are compared by: its name, and how it is shown."""

    key: str
    label: str
    short: str  # for the head of a column
    factor: float
    unit: str


QUANTITIES = {
    one.key: one
    for one in (
        Quantity(RATE, "rate of penetration", "rate", 1e3, "mm/s"),
        Quantity("blow_period", "blow period", "period", 1e3, "ms"),
        Quantity("impact_velocity", "impact velocity", "impact", 1.0, "m/s"),
        Quantity("rebound_velocity", "rebound velocity", "rebound", 1.0, "m/s"),
        Quantity("peak_bit_force", "peak bit force", "bit peak", 1e-3, "kN"),
        Quantity(
            "peak_contact_force", "peak contact force (10 µs means)", "contact peak", 1e-3, "kN"
        ),
        Quantity("peak_stress", "peak stress, mid-bit", "stress peak", 1e-6, "MPa"),
        Quantity("rock_energy", "energy into rock, a blow", "energy", 1.0, "J"),
        Quantity("rock_share", "rock's share of the blow energy", "rock share", 1.0, ""),
        Quantity("loss_share", "share of the blow energy lost", "loss share", 1.0, ""),
        Quantity(
            "resting_place", "resting place of the bit's end, from its start", "rest", 1e3, "mm"
        ),
        Quantity(HISTORY, "bit force through a blow", "bit history", 1.0, ""),
        Quantity(CONTACT_HISTORY, "contact force through a blow", "contact history", 1.0, ""),
        Quantity(STRESS_HISTORY, "stress, mid-bit, through a blow", "stress history", 1.0, ""),
    )
}


@dataclass
class Answer:
    """Answer of a method.

    Histories are from the start of a blow, positive in compression: force on the rock [N] and
    elastic stress in the middle of the bit [Pa] at the problem's offsets, force between piston and
    bit [N] as means between its `contact_edges`. What a method does not tell is left out.
    """

    values: dict[str, float]  # by the names of `QUANTITIES`, SI units
    # standard errors, where the motion is aperiodic
    errors: dict[str, float] = field(default_factory=dict)
    histories: dict[str, np.ndarray] = field(default_factory=dict)  # by the names of `HISTORIES`
    blows: float = 1.0  # blows that the timed run went through


def relative_error(
    answer: Answer, values: dict[str, float], histories: dict[str, np.ndarray], key: str
) -> float:
    """Error of a quantity relative to a reference; of a history, the ratio of L1 norms.

    NaN where one of the two does not have it.
    """
    if key in HISTORIES:
        seen, meant = answer.histories.get(key), histories.get(key)
        if seen is None or meant is None or len(seen) != len(meant):
            return float("nan")
        return float(np.sum(np.abs(seen - meant)) / np.sum(np.abs(meant)))
    found, wanted = answer.values.get(key), values.get(key)
    if found is None or not wanted:
        return float("nan")
    return abs(found / wanted - 1.0)


@dataclass(frozen=True)
class Problem:
    """What every method computes of a scene."""

    scene: Scene  # to be computed by any solver; starts near its periodic motion
    kind: str  # `PERIODIC`, `APERIODIC` or `DROP`
    duration: float  # simulated time of a run [s]
    period: float  # of a blow, as the pilot run found it [s]; of a drop its duration

    @property
    def offsets(self) -> np.ndarray:
        """Times since the start of a blow at which forces are compared [s]."""
        return np.arange(0.5 * HISTORY_STEP, min(HISTORY_LENGTH, 0.5 * self.period), HISTORY_STEP)

    @property
    def contact_edges(self) -> np.ndarray:
        """Times since the start of a blow between which means of the contact force are taken.

        The start itself, where explicit elements have an impulse, lies between two.
        """
        end = min(HISTORY_LENGTH, 0.5 * self.period)
        return np.arange(-0.5 * CONTACT_STEP, end, CONTACT_STEP)

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of what is compared."""
        return quantities(self.kind)


def quantities(kind: str) -> tuple[str, ...]:
    """Names of what is compared on a kind of problem, the main one first."""
    stress = ("peak_stress", HISTORY, STRESS_HISTORY)
    if kind == DROP:
        return ("resting_place", "rock_energy", "peak_bit_force", *stress)
    means = (RATE, "blow_period", *_MEANS)
    if kind == APERIODIC:
        return (*means, "rock_share", "peak_bit_force")
    peaks = ("peak_bit_force", "peak_contact_force", "peak_stress")
    shares = ("rock_share", "loss_share")
    return (*means, *shares, *peaks, HISTORY, CONTACT_HISTORY, STRESS_HISTORY)


def default_solver(scene: Scene) -> str:
    """Solver that `solver.name = "auto"` takes for elastic bars: "modal" or "wave"."""
    return scene.computed_by("auto").solver_name


def by_modes(scene: Scene, modes: int) -> Scene:
    """Return a scene for modes, so many in the bar of the shortest transit time."""
    return scene.computed_by("modal", **{"solver.cells": in_first_bar(numbers_of(scene), modes)})


def refuse_unfit(scene: Scene) -> None:
    """Raise `SceneError` for rigid bodies, and for a loss that finite elements alone have."""
    if scene.fem.damping_ratio is not None and scene.effects.loss:
        raise SceneError(
            f"accuracy: fem.damping_ratio = {scene.fem.damping_ratio!r} is a loss that finite "
            "elements alone have, another one on each mesh: omit it and set loss.time"
        )
    rigid = [bar for bar in ("piston", "bit") if getattr(scene, bar).model == "rigid"]
    if rigid:
        given = ", ".join(f'{bar}.model = "rigid"' for bar in rigid)
        raise SceneError(
            f"accuracy: the scene has rigid bodies ({given}), but a rigid bar has closed forms and "
            f"nothing to refine: set {' and '.join(f'{bar}.model' for bar in rigid)} to "
            '"elastic"'
        )


def pose(scene: Scene) -> Problem:
    """Find the kind of motion of a scene, and where to start it.

    Raises
    ------
    SceneError
        If there is nothing to refine, or too few blows.
    """
    refuse_unfit(scene)
    if scene.piston.model == "absent":
        return Problem(scene, DROP, scene.run.duration, scene.run.duration)
    solver = default_solver(scene)
    chosen = by_modes(scene, PILOT_MODES) if solver == "modal" else scene.computed_by(solver)
    pilot = Simulation(chosen, record_events=False)
    pilot.advance(scene.run.duration)
    blows = pilot.blows
    rows = blows[blows["time"] >= scene.run.settle]
    if len(rows) < LEAST_BLOWS:
        raise SceneError(
            f"accuracy: {len(rows)} blows after run.settle = {scene.run.settle:g} s "
            f"in run.duration = {scene.run.duration:g} s; at least {LEAST_BLOWS} are needed"
        )
    rows = rows[len(rows) // 2 :]
    rates = rows["penetration"] / rows["period"]
    period = float(rows["period"].mean())
    if np.std(rates) > PERIODIC_WITHIN * abs(rates.mean()):
        return Problem(scene, APERIODIC, scene.run.duration, period)
    start = {"start.piston_velocity": float(round(rows["impact_velocity"].mean(), 4))}
    start |= {"start.drive_direction": 1} if scene.matters("start.drive_direction") else {}
    duration = (SETTLING_BLOWS + COUNTED_BLOWS + 0.5) * period
    return Problem(scene.replace(**start), PERIODIC, duration, period)


class Run:
    """A solver on a problem: its answer, and how long it takes.

    Parameters
    ----------
    problem : Problem
    scene : Scene
        That of the problem, with a solver chosen.
    peer : callable, optional
        Makes a solver that scenes do not name.

    Attributes
    ----------
    setup_time : float
        Processor time to make the solver [s]; of the first of a kind compilation included.
    """

    def __init__(
        self, problem: Problem, scene: Scene, peer: Callable[[Scene], Solver] | None = None
    ) -> None:
        self.problem = problem
        began = time.process_time()
        solver = None if peer is None else peer(scene)
        self.simulation = Simulation(scene, record_events=False, solver=solver)
        self.setup_time = time.process_time() - began
        self._start = self.simulation.save()

    def cost(self, duration: float | None = None) -> float:
        """Processor time of one run [s], without set-up and compilation."""
        self.simulation.restore(self._start)
        began = time.process_time()
        self.simulation.advance(self.problem.duration if duration is None else duration)
        return time.process_time() - began

    def answer(self) -> Answer:
        """What the solver finds."""
        self.simulation.restore(self._start)
        if self.problem.kind == PERIODIC:
            return self._periodic()
        return self._statistics() if self.problem.kind == APERIODIC else self._drop()

    def _periodic(self) -> Answer:
        simulation, problem = self.simulation, self.problem
        simulation.advance((SETTLING_BLOWS + 0.5) * problem.period)
        before = simulation.save()
        lost = simulation.energy()["loss"]
        simulation.advance(problem.duration)
        lost = simulation.energy()["loss"] - lost
        blows = simulation.blows
        rows = blows[-COUNTED_BLOWS:]
        if len(blows) < COUNTED_BLOWS + 1:
            raise SceneError(f"accuracy: only {len(blows)} blows in {problem.duration:g} s")
        values = {
            RATE: ratio_of_sums(rows["hole_advance"], rows["period"])[0],
            "blow_period": float(rows["period"].mean()),
            **{name: float(rows[name].mean()) for name in (*_MEANS, "peak_bit_force")},
            "rock_share": ratio_of_sums(rows["rock_energy"], rows["blow_energy"])[0],
        }
        if lost > 0.0:  # ledgers of explicit elements do not tell it apart
            values["loss_share"] = lost / float(rows["blow_energy"].sum())
        last = blows[-1]
        starts = [float(last["time"]), float(last["time"] + last["period"])]
        start = next((t for t in starts if t > before.time), starts[-1])
        histories = self._histories(before, start)
        if STRESS_HISTORY in histories:
            values["peak_contact_force"] = float(histories[CONTACT_HISTORY].max())
            values["peak_stress"] = float(histories[STRESS_HISTORY].max())
        blows_run = problem.duration / problem.period
        return Answer(values, histories=histories, blows=blows_run)

    def _histories(self, before: Snapshot, start: float) -> dict[str, np.ndarray]:
        """Histories from a time on [s]; of rigid bars that of the force on the rock alone."""
        simulation, times = self.simulation, start + self.problem.offsets
        simulation.restore(before)
        sample = simulation.sample(times)
        found = {HISTORY: sample["bit_force"]}
        if simulation.solver.grid_of("bit") is not None:
            if simulation.scene.piston.model != "absent":
                simulation.restore(before)
                impulse = simulation.sample(start + self.problem.contact_edges)["contact_impulse"]
                found[CONTACT_HISTORY] = np.diff(impulse) / CONTACT_STEP
            simulation.restore(before)
            found[STRESS_HISTORY] = gauge_stress(simulation, times)
        return found

    def _statistics(self) -> Answer:
        simulation, scene = self.simulation, self.problem.scene
        simulation.advance(self.problem.duration)
        rows = simulation.blows
        rows = rows[rows["time"] >= scene.run.settle]
        if len(rows) < LEAST_BLOWS:
            raise SceneError(f"accuracy: only {len(rows)} blows in {self.problem.duration:g} s")
        found = {RATE: rate_of_blows(rows)}
        for name in ("blow_period", *_MEANS, "peak_bit_force"):
            column = rows["period" if name == "blow_period" else name]
            known = column[np.isfinite(column)]
            found[name] = ratio_of_sums(known, np.ones(len(known)))
        rows = rows[np.isfinite(rows["rock_energy"])]
        found["rock_share"] = ratio_of_sums(rows["rock_energy"], rows["blow_energy"])
        return Answer(
            {name: mean for name, (mean, _) in found.items()},
            {name: error for name, (_, error) in found.items()},
            blows=float(len(simulation.blows)),
        )

    def _drop(self) -> Answer:
        simulation = self.simulation
        histories = self._histories(self._start, 0.0)
        simulation.advance(self.problem.duration)
        ledger = simulation.energy()
        values = {
            "resting_place": simulation.observe()["bit_end_position"],
            "peak_bit_force": float(histories[HISTORY].max()),
            "rock_energy": sum(ledger[name] for name in INTO_ROCK),
        }
        if STRESS_HISTORY in histories:
            values["peak_stress"] = float(histories[STRESS_HISTORY].max())
        return Answer(values, histories=histories)
