"""The walk over what the data allow: its intervals against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import chi2

from percussion_model import Scene
from percussion_model.analysis.fitting.found import DAMPING, ENERGY
from percussion_model.analysis.fitting.likelihood import RATIO, STIFFNESS, Likelihood, Series
from percussion_model.analysis.fitting.sampling import (
    Walk,
    profiles_of,
    pushed_out,
    steps_wanted,
    walk,
)

KEYS = (STIFFNESS, RATIO, DAMPING, ENERGY)
CENTRE = np.log([1e9, 5.0, 1e4, 0.1])


def likelihood(residuals, free, room=5.0):
    """Of residuals as a function of the distance from a centre, in the logarithm."""
    names, centre = KEYS[:free], CENTRE[:free]

    def model(scene):
        return residuals(np.log([scene[name] for name in names]) - centre)

    data = np.zeros(len(residuals(np.zeros(free))))
    ranges = centre[:, None] + room * np.array([-1.0, 1.0])
    return Likelihood(Scene(), [Series("x", data, 1.0, model)], names, ranges, lambda: None)


def walked_from(like, offset, spread, threshold):
    start = like.at(CENTRE[: len(offset)] + offset)
    steps = steps_wanted(len(offset))
    return walk(like, start, spread, threshold, steps, np.random.default_rng(0))


@pytest.mark.parametrize("free", [1, 2, 3, 4])
def test_ends_are_those_of_the_ellipsoid_where_the_deviance_is_a_parabola(free):
    """Its extent along an axis is the root of threshold times variance."""
    slopes = 50.0 * (np.eye(free) + np.tril(np.ones((free, free))))
    like = likelihood(lambda x: slopes @ x, free)
    spread = np.linalg.inv(slopes.T @ slopes)
    threshold = float(chi2.ppf(0.95, free))
    # begun at the rim and with steps that are far too short in all directions but one
    walked = walked_from(like, 1e-3 * np.ones(free), 1e-4 * np.diag(np.diag(spread)), threshold)
    exact = np.sqrt(threshold * np.diag(spread))
    for k, found in enumerate(profiles_of(like, walked, threshold)):
        ends = np.array([found.low, found.high]) - CENTRE[k]
        assert 0.8 * exact[k] < -ends[0] < 1.02 * exact[k]
        assert 0.8 * exact[k] < ends[1] < 1.02 * exact[k]
        assert found.gap is None


def test_dips_that_are_less_deep_than_the_threshold_do_not_hold_the_walk():
    """A parabola with ripples: from a dip at its side all the others are found."""
    width, depth, ripples = 0.02, 6.0, 40.0

    def residuals(x):
        return np.array([x[0] / width, math.sqrt(depth) * math.sin(ripples * x[0] / width)])

    like = likelihood(residuals, 1)
    threshold = 8.0
    walked = walked_from(like, np.array([1.5 * width]), np.array([[1e-8]]), threshold)
    (found,) = profiles_of(like, walked, threshold)
    x = width * np.linspace(-4.0, 4.0, 20001)
    deviance = (x / width) ** 2 + depth * np.sin(ripples * x / width) ** 2
    allowed = x[deviance < threshold]
    assert found.low - CENTRE[0] == pytest.approx(allowed[0], rel=0.2)
    assert found.high - CENTRE[0] == pytest.approx(allowed[-1], rel=0.2)


@pytest.mark.parametrize(("half", "is_open"), [(2.0, False), (9.0, True)])
def test_an_end_where_the_walk_stopped_is_pushed_to_where_the_data_end(half, is_open):
    """Flat within half a width; the walk has seen the middle of it only."""
    like = likelihood(lambda x: np.array([10.0 * max(abs(x[0]) - half, 0.0)]), 1)
    walked = Walk.of([like.at(CENTRE[:1] + x) for x in np.linspace(-0.5, 0.5, 50)])
    threshold = 4.0
    beyond = pushed_out(like, walked, threshold, lambda at, free: like.at(at))
    (found,) = profiles_of(like, walked.joined(Walk.of(beyond)), threshold)
    if is_open:
        assert (found.low, found.high) == (-math.inf, math.inf)
    else:
        # steps double, so the end is met within a factor of two of the way
        assert 1.0 < CENTRE[0] - found.low <= half + 0.2
        assert 1.0 < found.high - CENTRE[0] <= half + 0.2
        assert beyond[-1].deviance > threshold


def test_a_wide_gap_between_minima_is_told():
    def residuals(x):
        return np.array([(abs(x[0]) - 1.0) / 0.01])

    like = likelihood(residuals, 1)
    both = [walked_from(like, np.array([side]), np.array([[1e-4]]), 4.0) for side in (-1.0, 1.0)]
    (found,) = profiles_of(like, both[0].joined(both[1]), 4.0)
    ends = np.array(found.gap) - CENTRE[0]
    assert ends == pytest.approx([-0.98, 0.98], abs=0.01)
    assert profiles_of(like, both[0], 4.0)[0].gap is None


def test_what_reaches_the_edge_of_the_range_is_open_there():
    def residuals(x):
        return np.array([min(x[0], 0.0) / 0.1])

    like = likelihood(residuals, 1, room=2.0)
    (found,) = profiles_of(like, walked_from(like, np.array([0.0]), np.array([[1.0]]), 4.0), 4.0)
    assert found.high == math.inf
    assert found.low - CENTRE[0] == pytest.approx(-0.2, rel=0.15)


def test_a_profile_has_the_lowest_deviance_that_was_met():
    like = likelihood(lambda x: x / 0.1, 2)
    walked = walked_from(like, np.zeros(2), 1e-2 * np.eye(2), 6.0)
    first = profiles_of(like, walked, 6.0)[0]
    assert (np.diff(first.values) > 0.0).all()
    alone = ((first.values - CENTRE[0]) / 0.1) ** 2
    assert (first.deviance >= alone * (1.0 - 1e-9)).all()
    assert np.median(first.deviance - alone) < 0.5
    assert walked.best == pytest.approx(CENTRE[:2], abs=0.02)
    assert Walk.of([like.at(CENTRE[:2])]).deviance == pytest.approx([0.0])
