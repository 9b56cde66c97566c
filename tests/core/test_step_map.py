"""What a step loses by its own formulas is what its map takes from the energy.

Leaps book the structural loss as energy before less energy after; that this
equals the quadratic form of the loss operator, summed over the steps, follows
from this identity of one step.
"""

import numpy as np
import pytest

from percussion_model import Scene
from percussion_model.solvers.wave.leaps.operators import _alone
from percussion_model.solvers.wave.leaps.step_map import Configuration, step_forms, step_map
from percussion_model.solvers.wave.solver import WaveSolver

LOADS = {"free": (0.0, 0.0), "FC": (7.5e8, 0.0), "SS": (3.75e9, 1e4)}


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("cells", [7, 20, 120])
@pytest.mark.parametrize("loss", [True, False])
def test_forms_of_a_step_are_the_energy_it_takes(load, cells, loss):
    scene = Scene().replace(**{"solver.cells": cells, "solver.leaps": False, "effects.loss": loss})
    solver = WaveSolver(scene)
    stiffness, damping = LOADS[load]
    par = _alone(solver._par)
    if stiffness:
        par["rock"] = solver._par["rock"]
    bar = Configuration(par, solver.grid_of("bit"), solver._cb, stiffness, damping)
    by_column = step_map(bar)
    mass = solver.grid_of("bit").mass
    energy = np.diag([*mass, *mass, 0.5 * stiffness][: bar.size])
    taken = energy - by_column @ energy @ by_column.T
    lost = sum(step_forms(bar, by_column))
    scale = np.sqrt(np.outer(np.diag(energy), np.diag(energy)))
    np.testing.assert_allclose(0.5 * (lost + lost.T) / scale, taken / scale, atol=1e-11)


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
