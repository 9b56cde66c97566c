"""Damped modes as pairs: the motion, what a dashpot takes, and runs that go by them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.linalg import expm

from percussion_model import Scene, Simulation, simulate
from percussion_model.engine.solvers import ModalSolver
from percussion_model.solvers.modal.damped import damped_pairs
from percussion_model.solvers.modal.modes import bar_modes, shape_low
from tests.engine_views import Tables

STEEL = 2.1e11, 7850.0
UNIFORM = np.array([[0.2, 5.5e-3, *STEEL]])
STEPPED = np.array([[0.08, 5.5e-3, *STEEL], [0.05, 2.5e-3, *STEEL], [0.11, 4e-3, 1.1e11, 4500.0]])
ETA = 2e-7


def generator(modes, dashpot):
    """Matrix of offsets and velocities: what eq. 4 of docs/modal.md says."""
    n, w, low = len(modes.frequency), modes.frequency, shape_low(modes)
    damping = np.diag(ETA * w**2) + dashpot * np.outer(low, low)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(w**2), -damping]])


def scaled(modes, matrix):
    """The same with offsets as velocities, so that entries are of one size."""
    scale = np.append(modes.frequency, np.ones(len(modes.frequency)))
    return scale[:, None] * matrix / scale


@pytest.mark.parametrize("bar", [UNIFORM, STEPPED])
@pytest.mark.parametrize("spring", [5e8, 1e10])
@pytest.mark.parametrize("dashpot", [-50.0, 1e4, 5e4])
def test_pairs_move_as_the_equations_do(bar, spring, dashpot):
    modes = bar_modes(bar, 24, spring)
    pairs = damped_pairs(modes.frequency, shape_low(modes), ETA, dashpot)
    n, time = 24, 1.7e-5
    out, into = pairs.out.T, pairs.into.T
    own = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(pairs.square), -np.diag(pairs.decay)]])
    truth = expm(generator(modes, dashpot) * time)
    moved = out @ expm(own * time) @ into
    np.testing.assert_allclose(scaled(modes, moved), scaled(modes, truth), atol=1e-9)
    np.testing.assert_allclose(scaled(modes, out @ into), np.eye(2 * n), atol=1e-10)


def test_modes_that_only_creep_make_pairs_too():
    """With much loss the highest modes are overdamped: two real roots each."""
    modes, loss = bar_modes(UNIFORM, 16, 1e9), 4e-6
    assert 0.5 * loss * modes.frequency[-1] > 1.0 > 0.5 * loss * modes.frequency[0]
    pairs = damped_pairs(modes.frequency, shape_low(modes), loss, 2e4)
    assert np.any(pairs.decay**2 > 4.0 * pairs.square)
    np.testing.assert_allclose(scaled(modes, pairs.out.T @ pairs.into.T), np.eye(32), atol=1e-9)


def test_what_a_dashpot_takes_is_its_integral():
    modes, dashpot = bar_modes(STEPPED, 12, 1e9), 3e4
    pairs = damped_pairs(modes.frequency, shape_low(modes), ETA, dashpot)
    start = np.random.default_rng(4).standard_normal(24)
    start[:12] /= modes.frequency
    times = np.linspace(0.0, 2e-4, 8001)
    step, state = expm(generator(modes, dashpot) * times[1]), start
    speeds = []
    for _ in times:
        speeds.append(shape_low(modes) @ state[12:])
        last, state = state, step @ state
    integral = cumulative_simpson(np.square(speeds), x=times)[-1]
    first, then = pairs.into.T @ start, pairs.into.T @ last
    taken = first @ pairs.taken @ first - then @ pairs.taken @ then
    assert taken == pytest.approx(integral, rel=1e-6)


@pytest.mark.parametrize("share", [1.0, 3.0])
def test_a_dashpot_that_swallows_waves_makes_no_pairs(share):
    """Of the bar's own impedance, or more: modes cannot be told apart, and steps are made."""
    modes = bar_modes(UNIFORM, 24, 5e8)
    impedance = 5.5e-3 * np.sqrt(STEEL[0] * STEEL[1])
    assert len(damped_pairs(modes.frequency, shape_low(modes), ETA, share * impedance).square) == 0


def modal(**changes):
    return Scene().replace(**{"solver.name": "modal", "solver.cells": 20, **changes})


def test_a_strong_dashpot_is_stepped_and_drills_as_by_waves():
    changes = {"rock.barrier_damping": 4e5, "rock.barrier_energy": 0.5}
    tables = Tables(ModalSolver(modal(**changes)))
    assert tables.laws.sizes[2] > 0  # loading without the dashpot
    assert tables.laws.sizes[3] == 0
    finer = modal(**changes, **{"solver.cells": 40})
    ours = simulate(finer, error_estimate=False).rate_of_penetration
    waves = Scene().replace(**changes, **{"solver.cells": 80})
    assert ours == pytest.approx(
        simulate(waves, error_estimate=False).rate_of_penetration, rel=2e-3
    )


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"rock.loading_stiffness": 1.8e9},
        {"rock.barrier_damping": 1e5, "rock.barrier_energy": 1.0},
        {"bit.sections": [
            {"length": 0.12, "area": 5.5e-3, "youngs_modulus": 2.1e11, "density": 7850.0},
            {"length": 0.07, "area": 3e-3, "youngs_modulus": 2.1e11, "density": 7850.0},
        ]},
    ],
    ids=["reference", "stiff rock", "dashpot", "stepped"],
)  # fmt: skip
def test_steps_and_pairs_tell_the_same_of_a_blow(changes):
    """The ledger too: dashpots are summed over steps by one, and in closed form by the other."""
    scene = modal(**changes)
    exact = Simulation(scene, record_events=False)
    exact.advance(0.03)
    stepped = Simulation(scene, record_events=False)
    sizes = Tables(stepped.solver).laws.sizes
    sizes[:], kept = 0, sizes.copy()
    try:
        stepped.advance(0.03)
    finally:
        sizes[:] = kept
    assert stepped.statistics()["steps"] > exact.statistics()["steps"]
    one, other = exact.energy(), stepped.energy()
    assert abs(one["residual_relative"]) < 1e-12
    size = one["crushing"]
    for name in ("crushing", "barrier", "standstill", "loss", "kinetic", "elastic"):
        assert one[name] == pytest.approx(other[name], rel=5e-3, abs=2e-4 * size), name
    assert one["barrier"] == pytest.approx(other["barrier"], rel=2e-2)


def test_changes_of_mode_in_one_product_are_those_by_way_of_the_modes():
    """First blows, before bounces make much of rounding; the ledger closes either way.

    With the reference's 2.5 kN the last of them uses up the barrier or does not, by rounding.
    """
    scene = modal(**{"feed.force": 3000.0})
    direct = Simulation(scene)
    direct.advance(8e-3)
    way = Tables(direct.solver).laws.way
    assert np.count_nonzero(way >= 0) == 14
    kept = way.copy()
    by_modes = Simulation(scene)
    way[:] = -1
    try:
        by_modes.advance(8e-3)
    finally:
        way[:] = kept
    one, other = direct.events, by_modes.events
    assert len(one) > 20
    np.testing.assert_array_equal(one["kind"], other["kind"])
    np.testing.assert_allclose(one["time"], other["time"], rtol=2e-4)
    for run in (direct, by_modes):
        assert abs(run.energy()["residual_relative"]) < 1e-12
    for name, value in direct.energy().items():
        assert value == pytest.approx(by_modes.energy()[name], rel=1e-3, abs=1e-3), name


@pytest.mark.parametrize("end", [1e-4, 3.3e-4, 7.7e-4, 1.7e-3])
def test_a_leap_that_is_cut_short_tells_the_same(end):
    """A reading on the way goes by pieces of the leap that the run makes later."""
    run, cut = Simulation(modal()), Simulation(modal())
    for time in np.linspace(0.0, end, 23)[1:-1]:
        cut.sample([time])
    fine, once = cut.sample([end]), run.sample([end])
    for name, value in once.items():
        assert fine[name][0] == pytest.approx(value[0], rel=1e-6, abs=1e-9), name


def test_observing_changes_no_bit():
    watched, alone = (Simulation(modal(), record_events=False) for _ in range(2))
    for k in range(1, 400):
        watched.advance(0.05 * k / 400)
        watched.energy()
    watched.advance(0.05)
    alone.advance(0.05)
    assert watched.energy() == alone.energy()


def test_events_are_recorded_while_a_state_is_read():
    """A reading goes on to its time, also where the run keeps a list of events."""
    kept, none = (Simulation(modal(), record_events=keep) for keep in (True, False))
    for run in (kept, none):
        run.advance(1.23456e-3)
    assert kept.energy() == none.energy()
