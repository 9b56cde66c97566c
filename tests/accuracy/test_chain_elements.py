"""Chains of bars: waves against explicit elements, which share nothing but the law of the rock."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest

from percussion_model import Scene, Simulation
from percussion_model.engine.solvers import WaveSolver
from percussion_model.physics.ledger import complete_ledger, energies
from percussion_model.physics.records import BLOW, EVENT, READING
from percussion_model.solvers.wave.records import Has
from percussion_model.verification.accuracy.explicit import ExplicitSolver
from percussion_model.verification.accuracy.explicit_joints import POSITION

SPEED, AREA = 10.0, 1.1e-3
# When the first wave has left the rock again, and after the wave between the rod's ends.
TIMES = (4e-4, 1e-3)
JOINTS = {
    "perfect": {"joint": "perfect"},
    "contact": {"joint": "contact"},
    "contact with a gap": {"joint": "contact", "gap": 2e-4},
    "lossy": {"joint": "lossy", "transmission": 0.9, "relaxation": 5e-4},
    "lossy and quick": {"joint": "lossy", "transmission": 0.5, "relaxation": 5e-5},
    "threaded": {"joint": "threaded", "preload": 4e4, "thread_stiffness": 2e9},
    "loose thread": {"joint": "threaded", "preload": 4e4, "thread_stiffness": 0.0},
}
DAMPER = {"stiffness": 1e7, "damping": 2e4, "preload": 1e4, "casing_mass": 150.0}
# Without any loss the elements would ring.
LOSS_TIME = 2e-8
# Cells of the piston for waves, which change nothing above 3e-4 any more, and two meshes.
CELLS, MESHES = 240, (60, 240)
# Largest error of elements of the finer mesh; about twice what it is.
TOLERANCE = 4e-3


def bar(*rows: tuple[float, float], **joint: object) -> dict[str, object]:
    """A bar of sections of length [m] and area [m^2], and its joint to the one below."""
    return {"sections": [{"length": length, "area": area} for length, area in rows]} | joint


PISTON, BIT = bar((0.3, 1.2e-3)), bar((0.1, AREA), (0.1, 2.5e-3))


def chain_of(joint: dict[str, object], bars: object = None, **tables: object) -> Scene:
    """A short hammer with a rod, a joint and a bit, or of other bars."""
    start = {"piston_velocity": SPEED, "gap": 0.0}
    return Scene(
        bars=bars or [PISTON, bar((0.1, 1.8e-3), (0.4, AREA), **joint), BIT],
        drive={"force": 7690.0, "reversal_distance": 0.01875}, feed={"force": 1e4},
        rock={
            "loading_stiffness": 4e8, "barrier_energy": 0.5, "barrier_damping": 1e4,
            "unloading_ratio": 5.0,
        },
        start=start, **{"loss": {"time": LOSS_TIME}, "run": {"settle": 0.0}} | tables,
    )  # fmt: skip


class Seen(NamedTuple):
    """A chain at some time: a reading, and extremes of the force in its joint so far [N]."""

    reading: np.ndarray
    greatest: float
    least: float

    @property
    def work(self) -> float:
        """Energy that went into the rock, or is stored there [J]."""
        e = energies(self.reading)
        return float(e["crushing"] + e["barrier"] + e["standstill"] + e["recoverable"])


def read(solver, state, time, greatest, least):
    reading = np.zeros(1, READING)
    solver.read(state, time, reading)
    return Seen(reading, float(greatest), float(least))


def seen_by_waves(scene: Scene, times=TIMES) -> list[Seen]:
    """By waves; they keep the force in a joint for one step alone."""
    solver = WaveSolver(scene.replace(**{"solver.cells": CELLS}))
    state, blows, events = solver.new_state(), np.zeros(9, BLOW), np.zeros(999, EVENT)
    found, step, greatest, least = [], 0, -math.inf, math.inf
    for time in times:
        while (step + 1) * solver.time_step <= time:
            step += 1
            solver.advance(state, (step + 1e-3) * solver.time_step, blows, events, False)
            force = state.arrays[1][Has.FORCE, 0]
            greatest, least = max(greatest, force), min(least, force)
        found.append(read(solver, state, time, greatest, least))
    return found


def seen_by_elements(scene: Scene, elements: int, times=TIMES) -> list[Seen]:
    """By explicit elements."""
    solver = ExplicitSolver(scene, elements)
    state, blows, events = solver.new_state(), np.zeros(9, BLOW), np.zeros(999, EVENT)
    found = []
    for time in times:
        solver.advance(state, time, blows, events, False)
        _, least, greatest = solver.joint_forces(state)[:, 1]
        found.append(read(solver, state, time, greatest, least))
    return found


def figures(one: Seen) -> dict[str, float]:
    """What is compared, each by its scale in this hammer."""
    row = one.reading[0]
    return {
        "work on the rock": one.work / 80.0,
        "end of the bit": row["bit_end_position"] / 0.5e-3,
        "velocity of the bit": row["bit_velocity"] / SPEED,
        "piston": row["piston_velocity"] / SPEED,
        "relative displacement": row["relative_displacement"] / 0.5e-3,
        "impulse of the piston": row["contact_impulse"] / 28.0,
        "impulse on the rock": row["bit_impulse"] / 40.0,
        "greatest force in the joint": one.greatest / 3e5,
        "least force in the joint": one.least / 3e5,
    }


def errors(scene: Scene) -> list[dict[str, float]]:
    """Largest difference from waves of each figure, for each mesh."""
    waves = [figures(one) for one in seen_by_waves(scene)]
    found = []
    for elements in MESHES:
        seen = [figures(one) for one in seen_by_elements(scene, elements)]
        found.append(
            {
                name: max(abs(a[name] - b[name]) for a, b in zip(seen, waves, strict=True))
                for name in waves[0]
            }
        )
    return found


def check(scene: Scene) -> None:
    coarse, fine = errors(scene)
    assert max(fine.values()) < TOLERANCE, fine
    # of the first order or better: four times the elements leave a quarter of the error
    rms = [math.sqrt(np.mean(np.square(list(one.values())))) for one in (coarse, fine)]
    assert rms[1] < 0.45 * rms[0], (coarse, fine)


@pytest.mark.slow
def test_loss_of_the_ends_themselves():
    """Of ten times the loss, ends of the impedance Z would miss 1e-3 of the work on the rock."""
    fine = errors(chain_of({"joint": "perfect"}, loss={"time": 10.0 * LOSS_TIME}))[-1]
    assert fine["work on the rock"] < 1e-4


@pytest.mark.parametrize("joint", JOINTS)
def test_first_blow_through_a_joint(joint):
    """Forces, motion and work of the first blow agree, and better with more elements."""
    check(chain_of(JOINTS[joint]))


@pytest.mark.parametrize("damping", [2e4, 2e5])
def test_first_blow_with_a_damper(damping):
    """So they do where feed and recoil act on a casing."""
    damper = DAMPER | {"damping": damping}
    check(chain_of(JOINTS["threaded"], damper=damper, effects={"damper": True}))


def test_first_blow_from_a_distance():
    """And where all gaps are open at the start, and the drive turns soon."""
    scene = chain_of(JOINTS["threaded"]).replace(
        **{
            "start.gap": 1e-3, "start.rock_gap": 2e-4, "start.bit_velocity": 0.5,
            "drive.reversal_distance": 1e-3,
        }
    )  # fmt: skip
    check(scene)


def test_later_impacts_on_the_rock():
    """Five milliseconds in, after some ten contacts with the rock, a lossy chain still agrees."""
    scene = chain_of(JOINTS["lossy"])
    (waves,) = seen_by_waves(scene, (5e-3,))
    (elements,) = seen_by_elements(scene, MESHES[1], (5e-3,))
    assert elements.work == pytest.approx(waves.work, rel=1e-3)
    assert elements.reading["hole_depth"][0] == pytest.approx(
        waves.reading["hole_depth"][0], rel=3e-3
    )


@pytest.mark.parametrize("name", ["threaded", "lossy", "contact with a gap"])
def test_ledger_of_elements_closes(name):
    """What the ends take is booked end by end, what bars hold is summed at the end: no rest."""
    for damper in (False, True):
        scene = chain_of(JOINTS[name], damper=DAMPER, effects={"damper": damper})
        numerical = []
        for elements in (20, 80):
            (seen,) = seen_by_elements(scene, elements, (0.03,))
            ledger = complete_ledger(energies(seen.reading))
            assert abs(ledger["residual_relative"]) < 1e-10
            assert abs(ledger["overshoot_relative"]) < 1e-3
            assert ledger["joints"] >= 0.0
            numerical.append(ledger["numerical_relative"])
        assert 0.0 < numerical[1] < 0.5 * numerical[0]


@pytest.mark.parametrize(("stiffness", "damping"), [(2e6, 1e4), (1e8, 2e5)])
def test_ledger_of_waves_is_that_of_elements(stiffness, damping):
    """Where the damper parts and closes some times: entry by entry."""
    damper = DAMPER | {"stiffness": stiffness, "damping": damping, "casing_mass": 100.0}
    scene = chain_of(JOINTS["lossy"], damper=damper, effects={"damper": True})
    (elements,) = seen_by_elements(scene, 2 * MESHES[1], (8e-3,))
    (waves,) = seen_by_waves(scene, (8e-3,))
    wanted, ledger = (complete_ledger(energies(one.reading)) for one in (elements, waves))
    given = wanted["initial"] + wanted["input"]
    for name in ("input", "crushing", "joints", "stored"):
        assert ledger[name] == pytest.approx(wanted[name], abs=2e-3 * given), name
        assert abs(ledger["numerical"]) < 1e-3 * given
    joints = ledger["joints"] / wanted["joints"]
    assert joints == pytest.approx(1.0, rel=1e-2)


def test_means_are_those_of_the_nodes():
    """Means that follow from impulses do not drift off the nodes, which many contacts move."""
    scene = chain_of(JOINTS["threaded"])
    solver = ExplicitSolver(scene, 20)
    state = solver.new_state()
    solver.advance(state, 0.1, np.zeros(99, BLOW), np.zeros(999, EVENT), False)
    rows, means, _ = state.arrays
    w, v = rows[int(state.record[0]["flip"])], rows[2]
    node = 0
    for name, place in zip(solver.cells, means[POSITION], strict=True):
        total = 0.0
        for run in solver._runs_of(name):
            moved = w[node : node + run["n"] + 1] - LOSS_TIME * v[node : node + run["n"] + 1]
            total += run["half"] * (moved[:-1] + moved[1:]).sum()
            node += run["n"] + 1
        assert total / solver.grid_of(name).mass.sum() == pytest.approx(place, abs=1e-12)


def test_perfect_joint_is_a_bar_that_goes_on():
    """A rod cut in two is the same elements: the same motion to rounding."""
    off = {"feed": False, "gravity": False}
    upper, lower = (bar(row, joint="perfect") for row in ((0.1, 1.8e-3), (0.4, AREA)))
    whole = chain_of(JOINTS["perfect"], effects=off)
    cut = chain_of({}, [PISTON, upper, lower, BIT], effects=off)
    a, b = (seen_by_elements(scene, 40)[-1].reading[0] for scene in (whole, cut))
    for name in ("bit_end_position", "bit_velocity", "bit_impulse", "piston_velocity"):
        assert a[name] == pytest.approx(b[name], rel=1e-9), name


def test_equal_bars_pass_half_the_impact_velocity():
    """Three bars of one section: Z v / 2 in every joint, and then the piston is at rest."""
    scene = chain_of(
        {},
        [bar((0.3, AREA)), bar((0.5, AREA), joint="perfect"), bar((0.6, AREA))],
        effects={"gravity": False, "feed": False, "drive": "none", "rock": "none"},
        loss={"time": 2e-7},
    )
    steel = scene.piston.sections[0]
    z = AREA * math.sqrt(steel.youngs_modulus * steel.density)
    # the pulse has passed the joint, and has not come back
    (seen,) = seen_by_elements(scene, 80, (2.4e-4,))
    assert seen.greatest == pytest.approx(0.5 * z * SPEED, rel=1e-3)
    assert seen.reading["piston_velocity"][0] == pytest.approx(0.0, abs=0.03)
    assert seen.reading["contact_impulse"][0] == pytest.approx(scene.piston.mass * SPEED, rel=3e-3)


def test_bit_cut_in_two_is_a_bit():
    """Kernels of two bars leave out what chains book; in two parts a bit gives the same blow."""
    off, upper, lower, area = [], 0.09625, 0.105, 5.0 * AREA
    effects = {"feed": False}  # it acts on the bar that is struck
    whole = Scene(bit=bar((upper + lower, area)), effects=effects)
    whole = whole.replace(**{"piston.sections": bar((0.175, area))["sections"]})
    joined = bar((upper, area), joint="perfect")
    cut = Scene(bars=[bar((0.175, area)), joined, bar((lower, area))], effects=effects)
    for elements in (20, 80):
        runs = [
            Simulation(scene, record_events=False, solver=ExplicitSolver(scene, elements))
            for scene in (whole, cut)
        ]
        for run in runs:
            run.advance(0.1)
        blows = [run.result(0.0).blows[:1] for run in runs]
        names = "rock_energy", "hole_advance", "impact_velocity", "contact_impulse", "period"
        off.append(max(float(np.max(abs(blows[1][k] / blows[0][k] - 1.0))) for k in names))
    assert off[1] < 3e-4, off
    assert off[1] < 0.3 * off[0], off
