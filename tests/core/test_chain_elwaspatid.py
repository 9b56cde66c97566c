"""Chains of bars against elwaspatid, a program of others for waves in elastic bars.

It is no dependency: `pip install elwaspatid` (LGPL) brings it, and these tests are skipped where
it is missing. It moves waves through cells of equal transit time as the method of characteristics
does, so that both are exact before a free end or a joint that opens comes in.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from percussion_model import Scene, Simulation

E, RHO, SPEED = 210e9, 7850.0, 10.0
C0 = math.sqrt(E / RHO)


@pytest.fixture(scope="module")
def elwaspatid():
    """The program; it imports pyplot, which needs no screen here."""
    pytest.importorskip("matplotlib").use("Agg")
    return pytest.importorskip("elwaspatid")


def peer_forces(elwaspatid, areas, lengths, cells, steps):
    """Forces in all cells of the struck bar over time, compression positive, and its time step."""
    diameters = [math.sqrt(4 * area / math.pi) for area in areas]
    bars = elwaspatid.BarSet([E] * 2, [RHO] * 2, list(lengths), diameters, nmin=cells)
    found = elwaspatid.WP2(bars, nstep=steps, left="free", right="infinite", Vinit=SPEED)
    return -np.array(found.bar.seg[1].Force), float(bars.dt), list(bars.nelt)


@pytest.mark.parametrize("ratio", [0.3, 0.7, 1.0, 2.2, 4.0])
def test_striker_on_a_bar_of_other_impedance(elwaspatid, ratio):
    """The same steps of force travel down the bar, until the striker would pull.

    A striker of lower impedance than the bar bounces off after one transit; one of higher
    impedance pushes for good. The bar is long enough that nothing returns.
    """
    cells, long = 20, 200
    area, lengths = 2.5e-3, (0.2, 2.0)
    transits = 2 * cells if ratio <= 1 else 160
    peer, dt, counts = peer_forces(elwaspatid, (ratio * area, area), lengths, cells, transits + 5)
    assert counts == [cells, long]
    bars = [
        {"sections": [{"length": length, "area": one}]}
        for length, one in zip((*lengths, 0.5), (ratio * area, area, area), strict=True)
    ]
    off = {"drive": "none", "gravity": False, "feed": False, "loss": False, "rock": "none"}
    simulation = Simulation(
        Scene(
            bars=bars, effects=off, start={"gap": 0.0, "piston_velocity": SPEED},
            solver={"cells": cells}, run={"settle": 0.0},
        )
    )  # fmt: skip
    assert simulation.solver.time_step == pytest.approx(dt, rel=1e-12)
    z = area * math.sqrt(E * RHO)
    for steps in (1, 7, cells, 2 * cells - 1, transits):
        simulation.advance(steps * simulation.solver.time_step)
        force = simulation.fields()["rod 1_force"]
        # its nodes stand at the upper ends of the cells
        np.testing.assert_allclose(force, peer[steps, :long], atol=1e-10 * z * SPEED)
        assert force[steps - 1] > 0.1 * z * SPEED > force[steps]
