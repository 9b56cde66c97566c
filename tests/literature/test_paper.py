"""Section 4 of the paper, as `percussion paper` checks it: the cheap part of it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from percussion_model import simulate
from percussion_model.interface.plotting.window import last_blow_window
from percussion_model.verification.paper.runs import (
    SWEEPS,
    Sweep,
    along,
    force_at_constant_power,
    maxima,
    paper_scene,
    power_law,
    run_drops,
    run_sweep,
    straight_line,
)
from percussion_model.verification.paper.statements import (
    SAME_EXPONENT,
    about_cycle,
    about_drops,
    about_sweeps,
)


def test_fits_find_what_was_put_in():
    x = np.geomspace(1.0, 100.0, 9)
    exponent, factor = power_law(x, 3.0 * x**-0.55)
    assert (exponent, factor) == pytest.approx((-0.55, 3.0))
    slope, intercept, explained = straight_line(x, 2.0 * x + 1.0)
    assert (slope, intercept, explained) == pytest.approx((2.0, 1.0, 1.0))
    assert straight_line(x, np.sin(40.0 * x))[2] < 0.5
    failed = np.where(x == x[3], np.nan, 1.0)
    assert power_law(x, failed * 3.0 * x**-0.55) == pytest.approx((-0.55, 3.0))
    assert straight_line(x, failed * (2.0 * x + 1.0)) == pytest.approx((2.0, 1.0, 1.0))
    assert maxima(np.arange(6.0), np.array([0.0, 2.0, 1.0, 1.5, 1.0, 3.0])).tolist() == [1.0, 3.0]


def test_power_is_kept():
    """Eq. 14 of the paper: F_0^3 D_1 does not change."""
    distance = np.array([0.001, 0.04, 0.1])
    force = force_at_constant_power(paper_scene(), distance)
    assert force**3 * distance == pytest.approx(np.full(3, 3000.0**3 * 0.04))


def agree(said, count):
    """All of so many statements agree, and are plain values."""
    assert len(said) == count
    for one in said:
        assert one.agrees, f"{one.says}: {one.found}"
    json.dumps([one.to_dict() for one in said])


def test_statements_about_sweeps_are_plain_values(tmp_path):
    """Of short sweeps: whether the paper agrees takes long ones, `percussion paper`."""
    found = {}
    for sweep in SWEEPS:
        few = replace(sweep, values=sweep.values[:: len(sweep.values) // 6], solver="rigid")
        few = replace(few, changes={})
        found[sweep.name] = run_sweep(paper_scene(), few, tmp_path / sweep.name, processes=1)
    said = list(about_sweeps(found))
    assert len(said) == 2 + 3 * 3 + 3 + 3
    json.dumps([one.to_dict() for one in said])


def test_drop_tests_show_what_section_4_2_says():
    agree(list(about_drops(run_drops(paper_scene()))), 4)


def test_the_stationary_blow_is_that_of_section_4_3():
    result = simulate(paper_scene(), 2.0, 1.0)
    window = last_blow_window(result)
    agree(list(about_cycle(result, window.samples, window.origin)), 7)


@pytest.mark.parametrize(
    ("key", "values", "exponent"),
    [
        ("rock.loading_stiffness", np.geomspace(1e8, 1e10, 9), -0.55),
        ("drive.reversal_distance", np.geomspace(8e-3, 0.1, 7), -0.36),
    ],
)
def test_exponents_of_section_4_4(key, values, exponent, tmp_path):
    found = run_sweep(paper_scene(), Sweep("x", key, values), tmp_path / "x", processes=1)
    x, rate, _periodic = along(found)
    assert power_law(x, rate)[0] == pytest.approx(exponent, abs=SAME_EXPONENT)
