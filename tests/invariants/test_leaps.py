"""Leaps of the waves over quiet phases must not change the motion."""

from __future__ import annotations

import numpy as np
import pytest

from percussion_model import BLOW, Scene, Simulation

# At the power of the reference, and as it is: the bit still rings at impact. There the
# motion is aperiodic and rounding grows tenfold a blow: a start velocity off by its last
# digit makes other events after 0.2 s, so that a few blows are compared.
SCENES = {
    "reference": {},
    "short stroke": {"drive.reversal_distance": 0.004},
    "short stroke, same power": {
        "drive.reversal_distance": 0.004,
        "drive.force": 3000.0 * 10 ** (1 / 3),
    },
}
ENDS = {"reference": 0.3, "short stroke": 0.06, "short stroke, same power": 0.04}
# Of the blow table's columns and of the stress in the bars, by the greatest of each.
BOUND = 1e-6
FORCE, SPEED = 1.1e6, 10.0  # of an impact at 10 m/s [N], [m/s]


@pytest.mark.parametrize("name", SCENES)
def test_leaps_change_nothing_but_the_time_it_takes(name):
    times = np.linspace(0.0, ENDS[name], 101)[1:]
    runs = []
    for leaps in (True, False):
        changes = SCENES[name] | {"solver.leaps": leaps}
        simulation = Simulation(Scene().computed_by("wave", **changes))
        fields = []
        for t in times:
            simulation.advance(float(t))
            # at a grid point: a field is that of the last or the next one
            grid = simulation.solver.grid_point_after(simulation.save().state, float(t))
            simulation.advance(grid)
            fields.append(simulation.fields())
        runs.append((simulation, fields))
    (leaping, there), (stepping, here) = runs
    assert leaping.statistics()["leaps"] > 0
    assert stepping.statistics()["leaps"] == 0
    np.testing.assert_array_equal(leaping.events["kind"], stepping.events["kind"])
    worst = {}
    for column in BLOW.names:
        a, b = leaping.blows[column], stepping.blows[column]
        np.testing.assert_array_equal(np.isnan(a), np.isnan(b))
        known = np.isfinite(b)
        scale = np.abs(b[known]).max(initial=1e-300)
        worst[column] = np.abs(a - b)[known].max(initial=0.0) / scale
    for key in here[0]:
        a, b = (np.array([fields[key] for fields in run]) for run in (there, here))
        worst[key] = np.abs(a - b).max() / (FORCE if key.endswith("force") else SPEED)
    # read between checkpoints of leaps or of steps, which ringing in a short one shows
    standstill = worst.pop("standstill_force")
    assert name != "reference" or standstill < 1e-4
    assert max(worst.values()) < BOUND, worst
    for one in (leaping, stepping):
        assert abs(one.energy()["residual_relative"]) < 1e-11
