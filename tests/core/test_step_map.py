"""What a step loses by its own formulas is what its map takes from the energy.

Leaps book sums of these forms, so that the residual of the ledger compares them
with the energies.
"""

import numpy as np
import pytest
from percussion_model.solvers.wave.leaps.linear import DIGITS, carry_and_sum
from percussion_model.solvers.wave.leaps.operators import alone, fill_powers, fill_sums, padded
from percussion_model.solvers.wave.leaps.step_map import (
    Configuration,
    _reach,
    loss_of_step,
    size_of,
    square_at_end,
    step_map,
)

from percussion_model import Scene
from percussion_model.solvers.wave.solver import WaveSolver

LOADS = {"free": (0.0, 0.0), "FC": (7.5e8, 0.0), "SS": (3.75e9, 1e4)}


def forms_of_a_step(load, cells, loss_time):
    """Configuration, its step map, its forms of loss and of the end's work, its energy [J]."""
    scene = Scene().replace(
        **{"solver.cells": cells, "solver.leaps": False, "loss.time": loss_time}
    )
    solver = WaveSolver(scene)
    stiffness, damping = LOADS[load]
    par = alone(solver._par)
    if stiffness:
        par["rock"] = solver._par["rock"]
    bar = Configuration(par, solver.grid_of("bit"), solver._cb, stiffness, damping)
    by_column, faces = step_map(bar)
    loss, squares = loss_of_step(bar, by_column, faces), square_at_end(bar, faces)
    path, square = _reach(bar)
    numerical = par[0]["z_b"] * (square - path * path / par[0]["dt"])
    mass = solver.grid_of("bit").mass
    energy = np.diag([*mass, *mass, 0.5 * stiffness][: size_of(bar)])
    return by_column, loss, (damping * square + numerical) * squares, energy


# From none to so much that a step does it in seven hundred parts.
@pytest.mark.parametrize("loss_time", [0.0, 1.937e-7, 8e-7, 1e-5, 1e-4])
@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("cells", [7, 20, 120])
def test_forms_of_a_step_are_the_energy_it_takes(load, cells, loss_time):
    by_column, loss, at_end, energy = forms_of_a_step(load, cells, loss_time)
    taken = energy - by_column @ energy @ by_column.T
    lost = loss + at_end
    scale = np.sqrt(np.outer(np.diag(energy), np.diag(energy)))
    np.testing.assert_allclose(0.5 * (lost + lost.T) / scale, taken / scale, atol=2e-14)


@pytest.mark.parametrize("steps", [1, 3, 4, 7, 44, 63, 64, 200, 255])
def test_forms_of_a_leap_are_those_of_its_steps(steps):
    by_column, loss, squares, _ = forms_of_a_step("SS", 7, 1e-6)
    size = padded(len(by_column))
    powers, lost, squared = np.zeros((3, 4 * DIGITS, size, size))
    fill_powers(by_column, powers)
    fill_sums(loss, powers, lost)
    fill_sums(squares, powers, squared)
    x = np.random.default_rng(steps).normal(size=size)
    x[len(by_column) :] = 0.0
    x[len(by_column) - 1] *= 1e-5  # a length among velocities
    y = x[: len(by_column)].copy()
    expected = np.zeros(2)
    for _ in range(steps):
        expected += y @ loss @ y, y @ squares @ y
        y = y @ by_column
    found = carry_and_sum(powers, lost, squared, True, True, steps, x, 0 * x, size)
    assert found == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(x[: len(y)], y, atol=1e-13)


@pytest.mark.parametrize(
    ("key", "value", "shared"),
    [
        ("feed.force", 3e3, True),
        ("drive.reversal_distance", 0.02, True),
        ("rock.barrier_energy", 0.1, True),
        ("rock.loading_stiffness", 7e8, False),
        ("rock.unloading_ratio", 6.0, False),
        ("rock.barrier_damping", 2e4, False),
        ("loss.time", 2e-7, False),
        ("bit.sections.0.area", 5e-3, False),
        ("piston.sections.0.density", 7800.0, False),
        ("solver.cells", 10, False),
    ],
)
def test_scenes_share_the_operators_that_they_have_in_common(key, value, shared):
    scene = Scene().replace(**{"solver.cells": 5})
    one, other = WaveSolver(scene), WaveSolver(scene.replace(**{key: value}))
    assert (one._operators.bit is other._operators.bit) == shared
