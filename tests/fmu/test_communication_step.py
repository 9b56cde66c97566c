"""Held inputs: nothing with constant inputs, first order in the communication step else."""

from __future__ import annotations

import math

import pytest

from scenarios import communication_step

# Far apart: between nearby ones a drilling cycle more or less hides the order [s].
STEPS = (2.0**-13, 2.0**-7)


@pytest.fixture(scope="module")
def found(hammer):
    return communication_step.study(hammer, STEPS)


def test_constant_inputs_give_the_same_bits_at_any_step(found):
    assert all(row["same_bits"] and row["error"] == 0.0 for row in found["constant"])


@pytest.mark.parametrize("case", ["ramp", "coupled"])
def test_what_is_held_is_off_by_less_in_shorter_steps(found, case):
    short, long = found[case]
    assert not long["same_bits"]
    assert 0 < short["error"] < 0.6 * long["error"]
    assert short["cost"] > long["cost"]


def test_table_and_figure(found, tmp_path):
    text = communication_step.table(found)
    assert "none, same bits" in text
    assert len(text.splitlines()) == 2 + 3 * len(STEPS)
    path = communication_step.draw(found, tmp_path / "step.png")
    assert path.stat().st_size > 10_000


def test_a_lost_coupling_is_called_unstable():
    row = {"step": 1e-2, "cost": 1.0, "error": math.nan, "same_bits": False, "blow_count": math.nan}
    assert "unstable" in communication_step.table({"coupled": [row]})
