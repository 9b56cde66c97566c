"""Greatest forces of an interval, against dense sampling of the same motion."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from percussion_model import SAMPLE_FIELDS, Scene, Simulation
from percussion_model.physics.records import READING, Mode

IMPULSE = SAMPLE_FIELDS.index("bit_impulse")

ELASTIC = pytest.mark.parametrize("solver", ["wave", "modal"])
# Blow, rebound and the standstill that rings after it; then only standstill and flight.
SPAN = 6e-3
# What may lie between two looks of the modes, relative to the greatest force.
UNSEEN = {"wave": 1e-9, "rigid": 1e-9, "modal": 1e-3}


def peaks(scene, points):
    """Peak of the bit and the contact force between the points, as an observer sees them."""
    simulation = Simulation(scene)
    reading = np.zeros(1, READING)
    found = []
    for begin, end in pairwise(points):
        simulation.advance(float(begin))
        simulation.solver.reset_peaks(simulation._state, float(begin))
        simulation.advance(float(end))
        simulation.solver.read(simulation._state, float(end), reading)
        found.append((reading["peak_bit_force"][0], reading["peak_contact_force"][0]))
    return np.array(found), simulation


def dense(scene, points, parts):
    """Greatest mean of the bit force over a part of each interval, leaps off.

    Returns
    -------
    most, step : ndarray
        And by how much means of neighbouring parts differ: the top is no further off.
    """
    simulation = Simulation(scene.replace(**{"solver.leaps": False}))
    found = []
    for begin, end in pairwise(points):
        times = np.linspace(begin, end, parts + 1)
        means = np.diff(simulation.sample_rows(times)[:, IMPULSE]) / np.diff(times)
        found.append((means.max(), np.abs(np.diff(means)).max()))
    return np.array(found).T


@pytest.mark.parametrize("solver", ["wave", "modal", "rigid"])
@pytest.mark.parametrize("step", [2.3e-6, 4.1e-5, 7e-4])
def test_a_peak_is_the_greatest_force_of_its_interval(solver, step):
    # without the barrier, whose dashpot acts for less than a dense sample
    scene = Scene().computed_by(solver, **{"effects.barrier": False})
    points = np.arange(0.0, min(SPAN, 200 * step), step)
    found, _ = peaks(scene, points)
    sampled, change = dense(scene, points, max(10, round(step / 2e-7)))
    scale = sampled.max()
    assert scale > 1e5
    assert np.all(found[:, 0] >= sampled - UNSEEN[solver] * scale)
    # not more than there was: what came before the interval does not count
    assert np.all(found[:, 0] <= sampled + 2.0 * change + 1e-9 * scale)
    assert np.median(change) < 0.02 * scale


@ELASTIC
def test_the_ringing_of_a_quiet_standstill_is_seen_within_its_leaps(solver):
    scene = Scene().computed_by(solver)
    run = Simulation(scene)
    run.advance(0.02)
    events = run.events
    begin = float(events["time"][events["kind"] == Mode.SS][-1]) + 5e-5
    points = begin + np.arange(0.0, 8e-4, 1e-4)
    found, simulation = peaks(scene, points)
    assert simulation._state.record[0]["mode"] == Mode.SS
    sampled, change = dense(scene, points, 300)
    still = 2500.0 + scene.bit.mass * 10.0
    assert sampled.max() > 1.02 * still  # it rings
    assert np.all(found[:, 0] >= sampled - max(UNSEEN[solver], 1e-6) * still)
    assert np.all(found[:, 0] <= sampled + 1.01 * change)
    assert change.max() < 0.01 * still


@ELASTIC
def test_watching_changes_no_bit(solver):
    scene = Scene().computed_by(solver)
    plain = Simulation(scene)
    plain.advance(0.1)
    _, watched = peaks(scene, np.arange(0.0, 0.1, 1.7e-3))
    watched.advance(0.1)
    for name in plain._state.record.dtype.names:
        own = name.startswith(("peak_", "late_", "leap_known"))  # what an observer asks for
        if not own and name not in ("n_blows", "n_events"):
            a, b = plain._state.record[name], watched._state.record[name]
            np.testing.assert_array_equal(a, b, err_msg=name)
    np.testing.assert_array_equal(plain._state.workspace, watched._state.workspace)


@ELASTIC
def test_peaks_of_intervals_make_the_peak_of_the_blow(solver):
    found, simulation = peaks(Scene().computed_by(solver), np.arange(0.0, 0.05, 1e-3))
    first = simulation.blows[0]
    assert found[:46, 0].max() == pytest.approx(first["peak_bit_force"], rel=1e-12)
    assert found[:46, 1].max() == pytest.approx(first["peak_contact_force"], rel=1e-12)


@pytest.mark.parametrize("solver", ["wave", "modal"])
def test_a_peak_of_the_contact_force_is_not_one_of_the_cells(solver):
    # behind a viscous front that several cells resolve, the waves that come to the ends overshoot
    found = []
    for cells in (20, 160):
        simulation = Simulation(Scene().computed_by(solver, **{"solver.cells": cells}))
        simulation.advance(0.1)
        found.append(float(simulation.blows["peak_contact_force"][0]))
    assert found[1] == pytest.approx(found[0], rel=5e-4)
