"""The shoulder between casing and bit stays passive at any step; the string keeps its momentum."""

from __future__ import annotations

import math

import numpy as np
import pytest
from models import make_model, start_inputs
from scipy.linalg import expm

from fmu_src.parts.drill_string import TABLE

VALUES = {name: entry[3] for name, entry in TABLE.parameters.items()}

# The shoulder, coupled by Jacobi to a struck bit: free, or on rock that loses little.
MASS, SPEED, PUSH = 8.69, 0.5, 2500.0


def struck_bit(step, rock, damping_ratio, **values):
    """Energies of the bit after each step [J], and the string."""
    string = make_model("DrillString", friction__viscosity=0.0, **values)
    inputs = start_inputs("DrillString")
    inputs["head_force"] = PUSH - string.outputs()["weight"]
    turn = 2.0 * damping_ratio * math.sqrt(rock / MASS)
    push = expm(step * np.array([[0, 1, 0], [-rock / MASS, -turn, 1 / MASS], [0, 0, 0]]))
    # without rock a constant force holds against the feed
    rest, against = (PUSH / rock, 0.0) if rock else (0.0, PUSH)
    state, energies = np.array([rest, SPEED]), []
    force = string.outputs()["feed_force"]
    # a long step makes a soft shoulder, which swings slowly
    for _ in range(round(0.4 / step) + 250):
        moved = push @ [*state, force - against]
        inputs["bit_position"] = state[0]
        string.step(inputs, step)
        state, force = moved[:2], string.outputs()["feed_force"]
        energies.append(0.5 * MASS * state[1] ** 2 + 0.5 * rock * (state[0] - rest) ** 2)
    return np.array(energies), string


@pytest.mark.parametrize("step", [1e-3, 2e-3, 5e-3, 1e-2])
@pytest.mark.parametrize("rock", [0.0, 1e7, 7.5e8])
def test_a_struck_bit_comes_to_rest_at_any_step(step, rock):
    energies, string = struck_bit(step, rock, 0.05)
    at_first = 0.5 * MASS * SPEED**2
    assert energies.max() < 1.5 * at_first
    last = round(0.1 / step)
    assert energies[-last:].max() < 0.2 * at_first
    assert string.outputs()["feed_force_mean"] == pytest.approx(PUSH, rel=0.02)


def test_it_is_the_limit_that_brings_the_bit_to_rest():
    """The same stiffness held over 10 ms with a delay throws a free bit about."""
    given = {"shoulder__damping": 200.0, "shoulder__passive": False}
    energies, string = struck_bit(1e-2, 0.0, 0.0, **given)
    assert energies[-10:].mean() > 100.0 * 0.5 * MASS * SPEED**2
    assert string.outputs()["energy.shoulder"] < -100.0


def test_a_short_step_leaves_the_shoulder_as_it_is():
    string = make_model("DrillString")
    inputs = start_inputs("DrillString")
    for step, as_given in ((1e-4, True), (1e-3, True), (1e-2, False)):
        string.step(inputs, step)
        found = string.outputs()["shoulder_stiffness"]
        assert (found == VALUES["shoulder.stiffness"]) == as_given
        assert found <= VALUES["shoulder.stiffness"]


@pytest.mark.parametrize("model", ["waves", "lumped"])
@pytest.mark.parametrize("step", [1e-5, 1e-4, 1e-3])
def test_momentum_of_the_string_is_its_impulses(model, step):
    """Head, bit, weight, wall: to the last digits, at any step, with the drive's reaction."""
    string = make_model("DrillString", model=model, friction__force=20.0)
    inputs = start_inputs("DrillString")
    inputs["head_force"] = 2500.0 - string.outputs()["weight"]
    impulse = 0.0
    for k in range(round(0.1 / step)):
        inputs["casing_impulse"] = impulse
        string.step(inputs, step)
        impulse += 3000.0 * math.sin(2.0 * math.pi * 22.0 * k * step) * step
    found, state = string.outputs(), string.state
    due = state["head_impulse_due"] + state["casing_impulse_due"]
    weight = found["weight"] * (state["time"] - state["lag"])
    wanted = found["head_impulse"] - found["bit_impulse"] + inputs["casing_impulse"] + weight - due
    assert found["momentum"] + found["wall_momentum"] == pytest.approx(wanted, abs=1e-6)
