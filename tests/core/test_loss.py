"""Structural loss: decay of free modes, no creep under static load, never a gain."""

from __future__ import annotations

import numpy as np
import pytest
from percussion_model.solvers.wave.leaps.step_map import Configuration, loss_of_step, step_map

from percussion_model import Mode, Scene, Section, Simulation
from percussion_model.solvers.wave.records import Coef
from percussion_model.solvers.wave.solver import WaveSolver

L = 0.20125
ETA = Scene().loss.time
UNIFORM = (Section(length=L, area=5.5e-3),)
STEPPED = (Section(length=L / 3, area=5.5e-3), Section(length=2 * L / 3, area=2e-3))
THREE = tuple(Section(length=L / 3, area=area) for area in (3e-3, 6e-3, 2e-3))
BARS = {"uniform": UNIFORM, "stepped": STEPPED, "three": THREE}


def free_bar(sections, cells, eta=ETA):
    """Step map of a free bar, and its time step."""
    scene = Scene().replace(
        **{
            "effects.drive": "none",
            "effects.gravity": False,
            "effects.feed": False,
            "effects.rock": "none",
            "piston.model": "absent",
            "bit.sections": sections,
            "solver.cells": cells,
            "solver.leaps": False,
            "loss.time": eta,
        }
    )
    solver = WaveSolver(scene)
    solver._par["barrier"] = 1  # as for the leap operators: the bar by itself
    return Configuration(solver._par, solver.grid_of("bit"), solver._cb), solver.time_step


def decay_of_modes(sections, cells, most, eta=ETA):
    """Undamped angular frequency and decay rate [1/s] of the lowest `most` modes."""
    configuration, dt = free_bar(sections, cells, eta)
    values = np.linalg.eigvals(step_map(configuration)[0].T).astype(complex)
    # the finest waves are gone after a step: theirs is rounding
    rates = np.log(values[np.abs(values) > 0.9]) / dt
    rates = rates[rates.imag > 1e3]
    rates = rates[np.argsort(rates.imag)][:most]
    return np.abs(rates), -rates.real


def relative_error(sections, cells, eta=ETA):
    """Of the decay rate against eta omega^2/2, and (omega dt)^2, by mode."""
    omega, decay = decay_of_modes(sections, cells, 3, eta)
    _, dt = free_bar(sections, cells, eta)
    return decay / (0.5 * eta * omega**2) - 1, (omega * dt) ** 2


@pytest.mark.parametrize("bar", BARS)
@pytest.mark.parametrize("viscous", [0.05, 0.2, 0.5])
def test_decay_of_free_modes_is_of_second_order(bar, viscous):
    """A mode decays with eta omega^2/2; cells refined at the same eta/dt."""
    cells = np.array([24, 48, 96])
    transit = Scene().bit.transit_time
    errors = [relative_error(BARS[bar], int(n), viscous * transit / n)[0] for n in cells]
    orders = [np.polyfit(np.log(1 / cells), np.log(np.abs(e)), 1)[0] for e in np.transpose(errors)]
    assert orders == pytest.approx([2.0] * 3, abs=0.08)


@pytest.mark.parametrize("bar", BARS)
@pytest.mark.parametrize("cells", [12, 24, 48, 96, 144, 192])
def test_decay_of_free_modes_at_the_reference(bar, cells):
    """At the loss of the reference the error stays below (omega dt)^2/12."""
    error, square = relative_error(BARS[bar], cells)
    assert np.all(np.abs(error) < square / 11.5)
    if cells <= 96:  # one sub-step: (eta/dt/4 - 1/12) (omega dt)^2
        _, dt = free_bar(BARS[bar], cells)
        np.testing.assert_allclose(
            error, (ETA / dt / 4 - 1 / 12) * square, atol=0.02 * square.max()
        )


@pytest.mark.parametrize("bar", BARS)
def test_undamped_modes_are_exact(bar):
    """Without loss the waves of the uniform bar return after 2 L/c, cell for cell."""
    omega, decay = decay_of_modes(BARS[bar], 24, 3, eta=0.0)
    assert np.abs(decay).max() < 1e-9 * omega[0]
    if bar == "uniform":
        first = np.pi / UNIFORM[0].transit_time
        np.testing.assert_allclose(omega, first * np.arange(1, 4), rtol=1e-11)


@pytest.mark.parametrize("bar", BARS)
@pytest.mark.parametrize("cells", [12, 150, 240])
def test_loss_never_gains(bar, cells):
    """Its quadratic form has no negative direction, and is what the energy loses."""
    configuration, _ = free_bar(BARS[bar], cells)
    if cells == 240:
        assert configuration.par[0]["loss"] > 1
    by_column, faces = step_map(configuration)
    loss = loss_of_step(configuration, by_column, faces)
    loss = 0.5 * (loss + loss.T)
    mass = np.tile(configuration.c[Coef.MASS, : configuration.grid.n], 2)
    scaled = loss / np.sqrt(np.outer(mass, mass))
    assert np.linalg.eigvalsh(scaled).min() > -1e-12
    # energy before less energy after, of every pair of waves
    gone = np.diag(mass) - (by_column * mass) @ by_column.T
    np.testing.assert_allclose(loss, gone, rtol=0, atol=1e-10 * np.abs(gone).max())


def test_substeps_agree_with_one_step():
    """Fine cells, whose loss goes in sub-steps, decay as the others do."""
    for cells in (180, 240):
        configuration, _ = free_bar(UNIFORM, cells)
        assert configuration.par[0]["loss"] > 1
        omega, decay = decay_of_modes(UNIFORM, cells, 3)
        np.testing.assert_allclose(decay, 0.5 * ETA * omega**2, rtol=1e-3)


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
        {"solver.cells": 300},
        {"effects.standstill_tension": "paper"},
    ],
    ids=["reference", "feed", "stepped", "substeps", "paper"],
)
def test_static_load_never_creeps(changes):
    """A hundred seconds at rest move the bit by less than 1e-9 m."""
    # fine cells are stepped through one by one
    end = 0.25 if "solver.cells" in changes else 100.0
    simulation = Simulation(resting_bit(**changes))
    simulation.advance(0.15)
    early = simulation.observe()
    assert early["drilling_mode"] == Mode.SS
    simulation.advance(end)
    late = simulation.observe()
    for name in ("bit_end_position", "bit_position"):
        assert abs(late[name] - early[name]) < 1e-9
    scene = simulation.scene
    weight = scene.feed.force + scene.bit.mass * scene.gravity.acceleration
    assert late["bit_force"] == pytest.approx(weight, rel=1e-7)


def test_a_force_keeps_its_digits_in_a_long_run():
    """A reading at a grid point is no difference of impulses that grew large."""
    simulation = Simulation(resting_bit())
    simulation.advance(1000.0)
    solver, state = simulation.solver, simulation.save().state
    grid = solver.grid_point_after(state, 1000.0 + solver.time_step)
    seen = simulation.sample(grid + solver.time_step * np.array([0.0, 0.5, 1.0, 1.3]))
    scene = simulation.scene
    weight = scene.feed.force + scene.bit.mass * scene.gravity.acceleration
    np.testing.assert_allclose(seen["bit_force"], weight, rtol=1e-6)


def test_static_load_never_creeps_step_by_step():
    """The same without leaps, from rest, down to the last digit."""
    simulation = Simulation(resting_bit(**{"solver.leaps": False}))
    simulation.advance(0.5)
    early = simulation.observe()["bit_end_position"]
    workspace = simulation.save().state.workspace.copy()
    simulation.advance(1.0)
    moved = simulation.observe()["bit_end_position"] - early
    assert moved == 0.0
    after = simulation.save().state.workspace
    # the rows of loss and scratch aside, nothing that a step writes has changed
    np.testing.assert_allclose(after, workspace, atol=1e-15)
