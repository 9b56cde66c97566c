"""Fronts of the piston/bit contact: their impulse does not depend on steps."""

from __future__ import annotations

import pytest

from percussion_model import Scene, simulate


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
    # 24 steps, the default, are off by 6e-5; 20 by 4e-4
    assert impulse(24, 1e-5) == pytest.approx(fine, rel=1e-4)
    assert impulse(80, 1e-5) == pytest.approx(fine, rel=2e-5)


def test_impulse_does_not_depend_on_where_in_a_step_the_gap_would_close() -> None:
    step = Scene().piston.transit_time / 20
    # the first and the last are not worth a cut
    places = (5e-4, 0.1, 0.5, 0.9, 0.9995)
    found = [impulse(20, 8.0 * step * (3.0 + place)) for place in places]
    assert found == pytest.approx([found[0]] * 5, rel=2e-6)
