"""Fronts of the piston/bit contact: when they start and how wide they are."""

from __future__ import annotations

import numpy as np
import pytest
from percussion_model.solvers.wave.cutting import place_of_closure

from percussion_model import Scene, simulate


@pytest.mark.parametrize("variance", [1e-3, 0.02, 0.1, 0.5, 3.0])
def test_width_is_that_of_means_over_cells(variance: float) -> None:
    # f (1 - f), with f what is left over whole cells of a Gaussian of that variance
    place = np.linspace(-9.0, 9.0, 360_001) * np.sqrt(variance)
    left = place - np.floor(place)
    density = np.exp(-0.5 * place**2 / variance)
    expected = np.sum(left * (1.0 - left) * density) / np.sum(density)
    found = place_of_closure(variance)
    assert found * (1.0 - found) == pytest.approx(expected, abs=4e-4)


def test_front_stays_sharp_without_loss() -> None:
    assert place_of_closure(0.0) == 0.0
    assert place_of_closure(1e-6) < 1e-3
    assert place_of_closure(50.0) == pytest.approx(0.5 - np.sqrt(1.0 / 12.0))


def impulse(cells: int, gap: float) -> float:
    """Impulse of the first contact of two free bars that meet at 8 m/s [N s]."""
    scene = Scene().replace(
        **{
            "solver.name": "wave",
            "solver.cells": cells,
            "start.piston_velocity": 8.0,
            "start.gap": gap,
            "effects.drive": "none",
            "effects.gravity": False,
            "effects.feed": False,
        }
    )
    result = simulate(scene, duration=2e-4, settle=0.0, trace=1e-6)
    assert result.trace is not None
    return float(result.trace["contact_impulse"][-1])


def test_impulse_of_a_contact_does_not_depend_on_cells() -> None:
    fine = impulse(160, 1e-5)
    # with fronts that start sharp 20 cells are off by 3e-4, and 60 by 4e-5
    assert impulse(20, 1e-5) == pytest.approx(fine, rel=1e-4)
    assert impulse(80, 1e-5) == pytest.approx(fine, rel=2e-5)


def test_impulse_does_not_depend_on_where_in_a_step_the_gap_would_close() -> None:
    step = Scene().piston.transit_time / 20
    # the second and the third are not worth a cut
    places = (0.1, 0.2112, 0.2115, 0.5, 0.9)
    found = [impulse(20, 8.0 * step * (3.0 + place)) for place in places]
    assert found == pytest.approx([found[0]] * 5, rel=2e-6)
