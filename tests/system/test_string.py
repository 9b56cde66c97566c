"""The drill string is a string: waves, stretch, weight, friction, rods; and a passive shoulder."""

from __future__ import annotations

import math

import numpy as np
import pytest
from models import String, make_model, start_inputs

from fmu_src.parts import string_body as lumps
from fmu_src.parts import string_waves as waves
from fmu_src.parts.drill_string import TABLE

RODS = 6
VALUES = {name: entry[3] for name, entry in TABLE.parameters.items()} | {"start.rods": RODS}
FREE = {**VALUES, "gravity": 0.0, "friction.viscosity": 0.0}
# Ends so light that they are open: their time constant is short against a cell.
OPEN = {**FREE, "head.mass": 1e-3, "casing.mass": 1e-3, "rod.cells": 10}
# Ends that hardly move.
CLAMPED = {**OPEN, "casing.mass": 1e9}
STEP_FORCE = 1e4


class Waves(String):
    """A string of waves."""

    def __init__(self, values):
        super().__init__(TABLE, {**values, "model": "waves"})
        self.grid = waves.grid_of(self.p)
        cells = RODS * int(self.p["rod_cells"])
        self.down = self.w.moving[:cells]
        self.up = self.w.moving[self.grid.up :][:cells]

    def rest(self, bottom_force):
        waves.rest_waves(self.p, self.s, self.w, bottom_force)

    def advance(self, forces):
        """Transit times under forces on head and casing, with friction at their end."""
        for on_head, on_casing in forces:
            waves.advance_waves(self.p, self.s, self.w, self.grid, on_head, on_casing)
        waves.rub_waves(self.p, self.s, self.w, self.grid, len(forces))

    @property
    def stored(self):
        return waves.stored_in_waves(self.p, self.s, self.w)

    @property
    def momentum(self):
        return waves.momentum_of_waves(self.p, self.s)


class Lumps(String):
    """A string of lumped masses."""

    def __init__(self, values):
        super().__init__(TABLE, {**values, "model": "lumped"})
        first = lumps.lumps_of(self.p).velocities
        self.velocities = self.w.moving[first:][: RODS + 2]

    def rest(self, bottom_force):
        lumps.rest_lumps(self.p, self.s, self.w, bottom_force)

    def advance(self, head_force, casing_force, h):
        lumps.advance_lumps(self.p, self.s, self.w, head_force, casing_force, h)

    @property
    def stored(self):
        return lumps.stored_in_lumps(self.p, self.s, self.w)

    @property
    def momentum(self):
        return lumps.momentum_of_lumps(self.p, self.s, self.w)


def body(kind, values, rest=0.0):
    made = kind(values)
    made.rest(rest)
    return made


def weight_of(made):
    return lumps.weight_of(made.p, RODS, made.p["casing_mass"])


def struck(values, cells_travelled):
    """Waves after a constant force on the head for a number of cells."""
    made = body(Waves, values)
    velocities, forces = [], []
    for _ in range(cells_travelled):
        made.advance([(STEP_FORCE, 0.0)])
        velocities.append(made.down + made.up)
        forces.append(made.grid.impedance * (made.down - made.up))
    return made, np.array(velocities), np.array(forces)


def test_a_step_arrives_after_length_by_speed_of_sound():
    made, velocities, forces = struck(OPEN, 60)
    length = RODS * VALUES["rod.length"]
    speed = math.sqrt(VALUES["rod.youngs_modulus"] / VALUES["rod.density"])
    reached = np.argmax(velocities[:, -1] > 0.0) + 1  # steps until the last cell moves
    assert reached * made.grid.step == pytest.approx(length / speed, rel=1e-12)
    # behind the front: F = Z v, the whole step, no overshoot; the end mass rounds the front
    impedance = VALUES["rod.area"] * math.sqrt(VALUES["rod.youngs_modulus"] * VALUES["rod.density"])
    assert forces[40, :30] == pytest.approx(STEP_FORCE, rel=1e-2)
    assert velocities[40, :30] == pytest.approx(STEP_FORCE / impedance, rel=1e-2)
    assert forces.max() <= STEP_FORCE * (1.0 + 1e-12)
    assert np.all(forces[40, 41:] == 0.0)


@pytest.mark.parametrize(("values", "sign"), [(OPEN, -1.0), (CLAMPED, 1.0)], ids=["open", "clamp"])
def test_a_step_reflects_with_the_right_sign(values, sign):
    """An open end turns compression into tension, a clamped one doubles it."""
    _, velocities, forces = struck(values, 90)
    behind = slice(35, 60)  # where the reflected front has passed and has not yet met the head
    assert forces[-1, behind] == pytest.approx((1.0 + sign) * STEP_FORCE, abs=0.02 * STEP_FORCE)
    impedance = Waves(values).grid.impedance
    assert velocities[-1, behind] == pytest.approx(
        (1.0 - sign) * STEP_FORCE / impedance, abs=0.02 * STEP_FORCE / impedance
    )


FORCES = [(STEP_FORCE * math.sin(k), 3e3 * math.cos(0.3 * k)) for k in range(60)]


def moved(values, at_once):
    made = body(Waves, values, rest=2e3)
    for begin in range(0, len(FORCES), at_once):
        made.advance(FORCES[begin : begin + at_once])
    return made


@pytest.mark.parametrize("at_once", [2, 5, 12])  # of twelve cells
def test_several_transit_times_at_once_are_those_one_by_one(at_once):
    values = {**VALUES, "friction.viscosity": 0.0}
    slow, quick = moved(values, 1), moved(values, at_once)
    assert quick.w.moving == pytest.approx(slow.w.moving, rel=1e-11, abs=1e-12)
    for name in ("head", "casing", "head_velocity", "casing_velocity", "weight_work", "total"):
        assert getattr(quick, name) == pytest.approx(getattr(slow, name), rel=1e-11), name


@pytest.mark.parametrize("friction", ["friction.viscosity", "friction.force"])
def test_friction_that_acts_after_several_transit_times_balances(friction):
    """It acts in turn with the waves: a small error beside its effect, and no momentum is lost."""
    free = {**VALUES, "friction.viscosity": 0.0}
    values = {**free, friction: 200.0}
    slow = moved(values, 1).w.moving
    effect = np.linalg.norm(slow - moved(free, 1).w.moving)
    assert np.linalg.norm(moved(values, 3).w.moving - slow) < 0.1 * effect
    for count in (1, 12):
        made = body(Waves, values, rest=2e3)
        for begin in range(0, len(FORCES), count):
            made.advance(FORCES[begin : begin + count])
        pushed = made.grid.step * (sum(map(sum, FORCES)) + len(FORCES) * weight_of(made))
        assert made.lost_momentum != 0.0
        assert made.momentum + made.lost_momentum == pytest.approx(pushed, rel=1e-11)


def stuck(step):
    """Way of the casing under a force that friction can hold, with waves [m]."""
    values = {"friction.viscosity": 0.0, "friction.force": 1250.0, "gravity": 0.0}
    named = {key.replace(".", "__"): value for key, value in values.items()}
    string = make_model("DrillString", start__feed_force=0.0, **named)
    inputs = start_inputs("DrillString")
    inputs["bit_position"] = 1.0  # out of reach
    inputs["head_force"] = 1e4  # the wall holds 15 kN
    for _ in range(round(0.5 / step)):
        string.step(inputs, step)
    return string.outputs()["casing_position"]


def test_a_string_that_the_wall_holds_creeps_no_more_at_longer_steps():
    ways = [stuck(step) for step in (2e-4, 1e-3, 5e-3)]
    assert ways[1:] == pytest.approx([ways[0]] * 2, rel=0.02)


def settle(made, head_force, casing_force, duration):
    if isinstance(made, Waves):
        for _ in range(round(duration / made.grid.step)):
            made.advance([(head_force, casing_force)])
    else:
        for _ in range(round(duration / 1e-3)):
            made.advance(head_force, casing_force, 1e-3)
    return made


@pytest.mark.parametrize("kind", [Waves, Lumps])
def test_the_static_stretch_is_that_of_hooke(kind):
    """F L / (E A), taken up by wall friction that damps."""
    damped = {**FREE, "friction.viscosity": 2000.0}
    made = settle(body(kind, damped), STEP_FORCE, -STEP_FORCE, 3.0)
    stretch = (
        STEP_FORCE
        * RODS
        * VALUES["rod.length"]
        / (VALUES["rod.youngs_modulus"] * VALUES["rod.area"])
    )
    assert made.head - made.casing == pytest.approx(stretch, rel=1e-6)
    assert made.momentum == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("kind", [Waves, Lumps])
@pytest.mark.parametrize("fluid", [0.0, 1000.0])
def test_a_string_in_balance_stays_where_it_is(kind, fluid):
    """Weight less buoyancy is carried by the two forces: nothing moves."""
    values = {**VALUES, "fluid_density": fluid}
    made = body(kind, values, rest=2000.0)
    rods = values["rod.density"] * values["rod.area"] * values["rod.length"] * RODS
    buoyant = 1.0 - fluid / values["rod.density"]
    weight = values["gravity"] * (values["head.mass"] + buoyant * (rods + values["casing.mass"]))
    assert weight_of(made) == pytest.approx(weight, rel=1e-12)
    bottom = 2000.0 + values["gravity"] * buoyant * values["casing.mass"]
    settle(made, bottom - weight, -bottom, 1.0)
    assert abs(made.head) < 1e-9
    assert abs(made.casing) < 1e-9


@pytest.mark.parametrize("kind", [Waves, Lumps])
def test_momentum_and_energy_balance_without_friction(kind):
    made = body(kind, {**VALUES, "friction.viscosity": 0.0})
    at_rest = made.stored
    made = settle(made, 5000.0, -1000.0, 0.05)
    t = 0.05
    if kind is Waves:
        t = round(t / made.grid.step) * made.grid.step
    assert made.momentum == pytest.approx((4000.0 + weight_of(made)) * t, rel=1e-9)
    created = made.stored - at_rest - made.weight_work
    created -= 5000.0 * made.head - 1000.0 * made.casing
    scale = made.stored
    # averaging a front over a cell may take a little, and never gives
    assert -0.02 * scale < created <= 1e-9 * scale


@pytest.mark.parametrize("kind", [Waves, Lumps])
def test_the_wall_takes_what_it_should(kind):
    """Coulomb friction brings a coasting string to a stop after m v / (s L)."""
    values = {**FREE, "friction.force": 50.0, "head.mass": 1.0, "casing.mass": 0.1}
    made = body(kind, values)
    if kind is Waves:
        made.down[:] = made.up[:] = 0.05
        made.s["total"] = 0.1 * len(made.down)
        mass = made.grid.cell_mass * len(made.down) + 1.1
    else:
        made.velocities[:] = 0.1
        mass = RODS * lumps.lumps_of(made.p).rod_mass + 1.1
    made.s["head_velocity"] = made.s["casing_velocity"] = 0.1
    energy = made.stored
    length = RODS * VALUES["rod.length"]
    stop = mass * 0.1 / (50.0 * length)
    settle(made, 0.0, 0.0, 0.5 * stop)
    assert made.momentum == pytest.approx(0.5 * mass * 0.1, rel=0.02)
    settle(made, 0.0, 0.0, 2.0 * stop)
    assert made.momentum == pytest.approx(0.0, abs=1e-3 * mass * 0.1)
    assert made.friction_loss == pytest.approx(energy, rel=0.02)
    assert made.lost_momentum == pytest.approx(mass * 0.1, rel=1e-3)


def test_waves_and_lumps_agree_where_motion_is_slow():
    """A force that rises within many travel times: the same way of the head."""
    ways = []
    for kind in (Waves, Lumps):
        made = body(kind, {**VALUES, "rod.cells": 4}, rest=2000.0)
        bottom = 2000.0 + VALUES["gravity"] * VALUES["casing.mass"]
        times = np.arange(0.0, 1.0, made.grid.step if kind is Waves else 1e-4)
        for t in times:
            push = bottom - weight_of(made) + 2000.0 * math.sin(2.0 * math.pi * 2.0 * t)
            if kind is Waves:
                made.advance([(push, -bottom)])
            else:
                made.advance(push, -bottom, 1e-4)
        ways.append(made.head)
    assert ways[0] == pytest.approx(ways[1], rel=2e-3)


@pytest.mark.parametrize("model", ["waves", "lumped"])
def test_a_rod_changes_length_and_weight_and_no_force(model):
    string = make_model("DrillString", model=model, start__rod_left=0.0)
    inputs, before = start_inputs("DrillString"), string.outputs()
    inputs["head_force"] = 2500.0 - before["weight"]
    string.step(inputs, 1e-3)
    found = string.outputs()
    assert found["rod_count"] == before["rod_count"] + 1
    assert found["length"] == pytest.approx((before["rod_count"] + 1) * VALUES["rod.length"])
    rod = VALUES["rod.density"] * VALUES["rod.area"] * VALUES["rod.length"] * VALUES["gravity"]
    assert found["weight"] - before["weight"] == pytest.approx(rod)
    inputs["head_force"] = 2500.0 - found["weight"]
    for _ in range(300):
        string.step(inputs, 1e-3)
    found = string.outputs()
    assert found["feed_force"] == pytest.approx(2500.0, rel=0.05)
    assert found["rod_count"] == before["rod_count"] + 1


def test_a_rod_that_is_asked_for_comes_once():
    string = make_model("DrillString", rod__automatic=False, start__rod_left=0.0)
    inputs = start_inputs("DrillString")
    inputs["head_force"] = 2500.0 - string.outputs()["weight"]
    counts = []
    for asked in (False, True, True, False, True):
        inputs["add_rod"] = asked
        string.step(inputs, 1e-3)
        counts.append(string.outputs()["rod_count"])
    # the second one would be wanted after another rod's length only
    assert counts == [4, 5, 5, 5, 5]


@pytest.mark.parametrize("name", ["DrillString", "WaveString"])
def test_a_string_has_no_more_rods_than_it_may(name):
    with pytest.raises(ValueError, match=r"start.rods = 9: must be at most rod.most, which is 8"):
        make_model(name, rod__most=8, start__rods=9)
    string = make_model(name, rod__most=8, start__rods=8, start__rod_left=0.0)
    with pytest.raises(ValueError, match=r"has 8 rods and wants one more: rod.most must be above"):
        string.step(start_inputs(name), 1e-3)
    string = make_model(name, rod__most=8, start__rods=8)
    with pytest.raises(ValueError, match=r"the saved state has 9 rods"):
        string.change(count=9)
