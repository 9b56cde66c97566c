"""Structural loss: decay of free modes, no creep under static load, never a gain."""

from __future__ import annotations

import numpy as np
import pytest

from percussion_model import Mode, Scene, SceneError, Section, Simulation
from percussion_model.engine.solvers import WaveSolver
from percussion_model.physics.kernel import entry_of
from percussion_model.physics.records import BLOW, EVENT
from percussion_model.solvers.wave.records import Place, Steel
from percussion_model.solvers.wave.taps import on_the_way, width_of
from tests.engine_views import chain_of

L = 0.20125
ETA = Scene().loss.time
UNIFORM = (Section(length=L, area=5.5e-3),)
STEPPED = (Section(length=L / 3, area=5.5e-3), Section(length=2 * L / 3, area=2e-3))
THREE = tuple(Section(length=L / 3, area=area) for area in (3e-3, 6e-3, 2e-3))
BARS = {"uniform": UNIFORM, "stepped": STEPPED, "three": THREE}


def free_bar(sections, cells, eta=ETA):
    """Solver of a free bar."""
    changes = {
        "effects.drive": "none", "effects.gravity": False, "effects.feed": False,
        "effects.rock": "none", "effects.barrier": False, "effects.loss": eta > 0.0,
        "piston.model": "absent", "bit.sections": sections, "solver.cells": cells,
        "loss.time": eta,
    }  # fmt: skip
    return WaveSolver(Scene().computed_by("wave", **changes))


def under_way(solver, step):
    """Both places in the rings of each wave that is under way; its energy at 1 m/s [J]."""
    first, second, worth = [], [], []
    chain = chain_of(solver)
    for place, steel in zip(chain.places, chain.steel, strict=True):
        ring, size, delay, taps, weight = (
            int(place[row])
            for row in (Place.RING, Place.SIZE, Place.DELAY, Place.TAPS, Place.WEIGHTS)
        )
        left = np.ones(delay + taps)
        if taps > 1:  # the newest weight is the last
            left[delay + 1 :] -= np.cumsum(chain.weights[0, weight + taps - 1 : weight : -1])
        for way in range(2):
            here = ring + 2 * size * way + ((step - np.arange(delay + taps)) & (size - 1))
            first.append(here)
            second.append(here + size)
            worth.append(steel[Steel.IMPEDANCE] * solver.time_step * left)
    return np.concatenate(first), np.concatenate(second), np.concatenate(worth)


def one_step(solver, waves):
    """Waves after a step, and what the step booked as lost [J]."""
    state = solver.new_state()
    first, second, _ = under_way(solver, 0)
    rings = state.arrays[-1]
    rings[0, first] = rings[0, second] = waves
    solver.advance(state, solver.time_step, np.zeros(1, BLOW), np.zeros(64, EVENT), False)
    s = state.record[0]
    assert s["step"] == 1
    return rings[0, under_way(solver, 1)[0]].copy(), s["e_loss"] + s["e_numerical"]


def step_map(solver):
    """What a step makes of the waves, and their energies at 1 m/s [J]."""
    worth = under_way(solver, 0)[2]
    return np.array([one_step(solver, row)[0] for row in np.eye(len(worth))]).T, worth


def decay_of_modes(sections, cells, most, eta=ETA):
    """Undamped angular frequency and decay rate of the lowest modes [1/s], and the time step."""
    solver = free_bar(sections, cells, eta)
    values = np.linalg.eigvals(step_map(solver)[0]).astype(complex)
    # the finest waves are gone after a few steps
    rates = np.log(values[np.abs(values) > 0.7]) / solver.time_step
    rates = rates[rates.imag > 1e3]
    rates = rates[np.argsort(rates.imag)][:most]
    return np.abs(rates), -rates.real, solver.time_step


def error_of_decay(sections, cells, eta):
    """Of the decay rate by mode, which is eta omega^2/2, per (omega dt)^2."""
    omega, decay, dt = decay_of_modes(sections, cells, 3, eta)
    error = decay / (0.5 * eta * omega**2) - 1.0
    return error / (omega * dt) ** 2


@pytest.mark.parametrize("bar", BARS)
@pytest.mark.parametrize("viscous", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("cells", [48, 96])
def test_decay_of_free_modes_is_of_second_order(bar, viscous, cells):
    """At the same eta/dt the error stays below a share of (omega dt)^2."""
    eta = viscous * Scene().bit.transit_time / cells
    assert np.abs(error_of_decay(BARS[bar], cells, eta)).max() < 1 / 12


@pytest.mark.parametrize("bar", BARS)
@pytest.mark.parametrize("cells", [12, 24, 48, 96])
def test_decay_of_free_modes_at_the_reference(bar, cells):
    """At the loss of the reference the error stays below (omega dt)^2/12."""
    assert np.abs(error_of_decay(BARS[bar], cells, ETA)).max() < 1 / 12


@pytest.mark.parametrize("bar", BARS)
def test_undamped_modes_are_exact(bar):
    """Without loss the waves of the uniform bar return after 2 L/c, step for step."""
    omega, decay, _ = decay_of_modes(BARS[bar], 24, 3, eta=0.0)
    assert np.abs(decay).max() < 1e-9 * omega[0]
    if bar == "uniform":
        first = np.pi / UNIFORM[0].transit_time
        np.testing.assert_allclose(omega, first * np.arange(1, 4), rtol=1e-11)


@pytest.mark.parametrize("bar", BARS)
@pytest.mark.parametrize(
    ("cells", "eta"),
    [(12, 0.0), (25, 0.0), (12, ETA), (25, ETA), (96, ETA), (12, 1e-6), (25, 1e-6)],
)
def test_loss_never_gains(bar, cells, eta):
    """No waves grow, and what a step takes of any is what it books; 25 fit no third of a bar."""
    solver = free_bar(BARS[bar], cells, eta)
    by_step, worth = step_map(solver)
    assert np.abs(np.linalg.eigvals(by_step)).max() < 1.0 + 1e-9
    gone = np.diag(worth) - by_step.T @ (worth[:, None] * by_step)
    for waves in np.random.default_rng(cells).normal(size=(20, len(worth))):
        booked = one_step(solver, waves)[1]
        assert booked == pytest.approx(waves @ gone @ waves, abs=1e-12 * (waves**2 @ worth))


def resting_bit(**changes):
    """A bit that is set down on the rock, then held by feed and weight alone."""
    return Scene().computed_by(
        "wave",
        **{"piston.model": "absent", "effects.drive": "none", "run.settle": 0.0} | changes,
    )


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"feed.force": 2e4},
        {"bit.sections": STEPPED},
        {"solver.cells": 100},
        {"effects.standstill_tension": "paper"},
    ],
    ids=["reference", "feed", "stepped", "fine", "paper"],
)
def test_static_load_never_creeps(changes):
    """A second at rest moves the bit by less than 1e-11 m."""
    simulation = Simulation(resting_bit(**changes))
    simulation.advance(0.15)
    early = simulation.observe()
    assert early["drilling_mode"] == Mode.SS
    simulation.advance(1.15)
    late = simulation.observe()
    for name in ("bit_end_position", "bit_position"):
        assert abs(late[name] - early[name]) < 1e-11
    scene = simulation.scene
    weight = scene.feed.force + scene.bit.mass * scene.gravity.acceleration
    assert late["bit_force"] == pytest.approx(weight, rel=1e-7)


def test_a_force_keeps_its_digits_in_a_long_run():
    """A reading at a grid point is no difference of impulses that grew large."""
    simulation = Simulation(resting_bit())
    simulation.advance(20.0)
    solver, state = simulation.solver, simulation.save().state
    grid = solver.grid_point_after(state, 20.0 + solver.time_step)
    seen = simulation.sample(grid + solver.time_step * np.array([0.0, 0.5, 1.0, 1.3]))
    scene = simulation.scene
    weight = scene.feed.force + scene.bit.mass * scene.gravity.acceleration
    np.testing.assert_allclose(seen["bit_force"], weight, rtol=1e-6)


def test_static_load_keeps_its_waves():
    """From rest, down to the last digit."""
    simulation = Simulation(resting_bit())
    simulation.advance(0.5)
    early, before = simulation.observe()["bit_end_position"], simulation.fields()
    simulation.advance(1.0)
    moved = simulation.observe()["bit_end_position"] - early
    assert moved == 0.0
    for name, values in simulation.fields().items():
        scale = 1e-12 * np.abs(before[name]).max() if "force" in name else 1e-15
        np.testing.assert_allclose(values, before[name], atol=scale, rtol=0)


@pytest.mark.parametrize(
    ("transit", "eta"), [(1.4, 0.1), (24.0, 0.14), (24.4, 0.14), (60.0, 1.0), (240.4, 2.0)]
)
def test_waves_in_cells_are_as_late_and_as_wide_as_their_way_makes_them(transit, eta):
    """exp(-s x / sqrt(1 + eta s)), of stress by sqrt(1 + eta s): the first two cumulants."""
    cells = max(1, round(transit))
    weights, reach = entry_of(on_the_way)(cells, transit, eta, eta)
    rows = weights.reshape(2, cells, entry_of(width_of)(reach))
    late = reach + 1.0 - np.arange(rows.shape[2])
    way = (np.arange(cells) + 0.5) * transit / cells
    mean = rows @ late
    variance = rows @ late**2 - mean**2
    np.testing.assert_allclose(rows.sum(axis=2), 1.0, rtol=1e-12)
    for k, (more, wider) in enumerate([(0.0, 0.0), (eta / 2, eta**2 / 2)]):
        wanted = way - (np.arange(cells) + 0.5) + more
        np.testing.assert_allclose(mean[k], wanted, rtol=0.0, atol=0.01 * max(1.0, eta))
        np.testing.assert_allclose(variance[k], eta * way + wider, rtol=0.02)


@pytest.mark.parametrize(
    "changes",
    [
        {"loss.time": 1.94e-5},  # more than half a transit time
        {"loss.time": 2e-6, "solver.cells": 24},
        {"loss.time": 2e-6, "bit.sections": (Section(length=0.02, area=5.5e-3),)},
    ],
    ids=["much", "fine", "short"],
)
def test_loss_that_bars_cannot_have_is_refused(changes):
    """Waves had none of it at the ends then: 31 mm/s in place of 15, or a stalled hammer."""
    with pytest.raises(SceneError, match=r"loss\.time = .* s: too long for waves in 0\."):
        WaveSolver(Scene().computed_by("wave", **changes))
