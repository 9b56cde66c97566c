"""Steps that are taken back: what they give, what they cost, and what they need."""

from __future__ import annotations

import numpy as np
import pytest

from percussion_model.coupling import Coupling, CouplingError

LONGEST = 2.0**-10  # [s]: its halves and their sums are exact
ONE_BLOW = 40 * LONGEST  # from the first impact to just before the second one [s]


def run(system, step, **choice):
    return Coupling(system).run(ONE_BLOW, step, interval=LONGEST, **choice)


def test_where_none_is_taken_back_the_halves_are_a_run_at_half_the_step(feed_control):
    """Bit for bit: so every part comes back to the very state that it was in."""
    halves, whole = run(feed_control, LONGEST, tolerance=1e9), run(feed_control, 0.5 * LONGEST)
    assert (halves.steps, halves.rejected) == (80, 0)
    assert halves.tried == 40
    for name, column in whole.columns.items():
        np.testing.assert_array_equal(halves[name], column, err_msg=name)


def test_steps_are_shortened_where_it_matters(feed_control):
    exact = run(feed_control, LONGEST / 40)["hammer.bit.position"][-1]
    chosen = run(feed_control, LONGEST, tolerance=1e-2)
    assert chosen.error == ""
    assert chosen.rejected > 0
    # at the blow, not on all of the way: fewer steps than the shortest size everywhere
    assert 80 < chosen.steps < 1500
    plain = run(feed_control, 0.5 * LONGEST)["hammer.bit.position"][-1]
    assert abs(chosen["hammer.bit.position"][-1] / exact - 1.0) < 0.2 * abs(plain / exact - 1.0)


def test_the_shortest_steps_are_kept_whatever_their_error(feed_control):
    """Halves of 1/64 of the communication step: docs/system.md, section 4."""
    found = Coupling(feed_control).run(2 * LONGEST, LONGEST, tolerance=1e-300)
    assert found.error == ""
    assert (found.steps, found.rejected) == (2 * 128, 6)


def test_a_part_that_cannot_be_saved_is_named(feed_control):
    def controller(inputs, time, step):
        return {"force_command": -800.0, "pressure_command": 2e6, "percussion_on": True}

    coupling = Coupling(feed_control, replaced={"controller": controller})
    with pytest.raises(CouplingError, match="controller: cannot save and restore a state"):
        coupling.run(ONE_BLOW, LONGEST, tolerance=1e-3)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan")])
def test_the_tolerance_is_checked(feed_control, tolerance):
    with pytest.raises(CouplingError, match="tolerance = "):
        run(feed_control, LONGEST, tolerance=tolerance)
