"""Breaking and rotation over solvers: limits to the last bit, ledger, torque, split calls."""

from __future__ import annotations

import math

import numpy as np
import pytest

from percussion_model import Scene, Simulation, simulate
from percussion_model.scene.bits import bit
from percussion_model.scene.hammers import hammer
from percussion_model.scene.rocks import rock
from percussion_model.scene.rocks.breaking import parameters_under
from tests.state_bits import run_bits

BIT = bit("dth-90").parameters
FRESH = {"breaking.crushing_energy": 0.0, "breaking.threshold": 0.0, "rotation.renewal_length": 0.0}
SOLVERS = {"modal": 0.4, "wave": 0.4, "rigid": 0.6, "fem": 0.06}
KINDS = {
    "rock is crushed again": {},
    "rock on its old line": {"rotation.old_line": True},
    "breaking alone": {"effects.rotation": False},
    "rotation alone": {"effects.breaking": False},
    "feed on the casing": {"feed.on": "casing", "feed.casing_mass": 40.0, "feed.force": 4000.0},
    "a motor that slows": {"rotation.stall_torque": 60.0, "rotation.full_torque": 5.0},
    "a string that twists": {
        "rotation.string_stiffness": 300.0, "rotation.inertia": 0.05, "rotation.speed": 9.0,
    },
    "curved rock": {
        "effects.rock": "power", "rock.loading_exponent": 1.5, "rotation.old_line": True,
    },
    "flushing and wear": {"breaking.flushed_volume": 2e-6, "breaking.wear_length": 1.0},
}  # fmt: skip


# Those in which a part of the craters stays, on whose cuttings the bit rests.
REFILLED = {
    "rock is crushed again",
    "feed on the casing",
    "a motor that slows",
    "a string that twists",
    "flushing and wear",
}


def scene_of(solver, **changes):
    """The reference with a button bit, by a solver."""
    short = {"run.settle": 0.0, "breaking.threshold": 2.0}
    if solver == "fem":
        short["fem.elements"] = 20
    return Scene().computed_by(solver, **{**BIT, **short, **changes})


def run(solver, **changes):
    """A run of a few blows."""
    simulation = Simulation(scene_of(solver, **changes))
    simulation.advance(SOLVERS[solver])
    return simulation


@pytest.mark.parametrize("barrier", [True, False])
@pytest.mark.parametrize("solver", SOLVERS)
def test_fresh_rock_that_costs_nothing_is_the_law_without_them_to_the_last_bit(solver, barrier):
    off = {"effects.breaking": False, "effects.rotation": False, "effects.barrier": barrier}
    plain = run(solver, **off)
    free = run(solver, **FRESH, **{"effects.barrier": barrier})
    assert len(plain.blows) > 0
    assert free.events.tobytes() == plain.events.tobytes()
    of_place = [name for name in plain.blows.dtype.names if name.startswith(("breaking", "rot"))]
    others = [name for name in plain.blows.dtype.names if name not in of_place]
    for name in others:
        assert free.blows[name].tobytes() == plain.blows[name].tobytes(), name
    ends = plain.observe(), free.observe()
    for name, value in ends[0].items():
        if not name.startswith(("breaking", "rotation")):
            assert np.array_equal(value, ends[1][name], equal_nan=True), name
    assert free.blows["rotation_index"].all()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_the_ledger_closes_with_the_work_of_rotation(solver, kind):
    simulation = run(solver, **KINDS[kind])
    ledger = simulation.energy()
    assert abs(ledger["residual_relative"]) < 1e-9
    # without breaking the hole gains all that is pressed in; without rotation rock is fresh
    assert (ledger["climb"] > 0.0) == (kind != "rotation alone")
    assert (ledger["refill"] > 0.0) == (kind in REFILLED)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_the_torque_does_the_work_of_climb_and_friction(solver, kind):
    """Torque of each row times its angle, the index by the mean radius."""
    if kind == "breaking alone":
        pytest.skip("nothing turns")
    if kind == "a string that twists":
        pytest.skip("the motor turns another angle: tests/core/test_twist.py")
    simulation = run(solver, **KINDS[kind], **{"rotation.friction": 0.3})
    blows, ledger, seen = simulation.blows, simulation.energy(), simulation.observe()
    radius = simulation.scene["rotation.mean_radius"]
    if kind == "a motor that slows":
        assert seen["rotation_turning_speed"] < 0.97 * simulation.scene["rotation.speed"]
        assert blows["rotation_torque"].max() < 60.0
    work = (blows["rotation_torque"] * blows["rotation_index"]).sum() / radius
    angle = blows["rotation_index"].sum() / radius
    # a first place is left before the first blow begins, of which there is no row
    start = first_place(simulation)
    assert angle + start["angle"] == pytest.approx(seen["rotation_angle"], rel=1e-12)
    given = ledger["climb"] + ledger["turning"]
    assert work + start["work"] == pytest.approx(given, rel=1e-9)
    assert ledger["turning"] == ledger["friction"]


def first_place(simulation):
    """Angle and work of the rotation until the first blow has begun."""
    again = Simulation(simulation.scene)
    first = simulation.blows[0]
    again.advance(float(first["time"] + 0.5 * first["period"]))
    ledger = again.energy()
    return {
        "angle": again.observe()["rotation_angle"],
        "work": ledger["climb"] + ledger["turning"],
    }


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_no_blow_breaks_more_than_it_crushed(solver, kind):
    scene = scene_of(solver, **KINDS[kind])
    if not scene["effects.breaking"]:
        pytest.skip("nothing breaks")
    blows = run(solver, **KINDS[kind]).blows
    simulation, crushed, volume = Simulation(scene), [], []
    for t in [*blows["time"], blows["time"][-1] + blows["period"][-1]]:
        simulation.advance(float(t) + 1e-9)
        crushed.append(simulation.energy()["crushing"])
        volume.append(simulation.observe()["breaking_volume"])
    paid = scene["breaking.efficiency"] * np.diff(crushed)
    spent = scene["breaking.crushing_energy"] * np.diff(volume)
    assert paid.min() > 0.0
    assert np.all(spent <= paid * (1.0 + 1e-6))
    assert spent.max() > 0.1 * paid.max()
    area = 0.25 * math.pi * scene.hole_diameter**2
    np.testing.assert_allclose(blows["hole_advance"] * area, np.diff(volume), rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_split_calls_and_restarts_give_the_same_bits(solver, kind):
    whole = run(solver, **KINDS[kind])
    divided, rng, saved = Simulation(whole.scene), np.random.default_rng(3), []
    for k, t in enumerate(np.sort(rng.uniform(0.0, SOLVERS[solver], 500))):
        divided.advance(float(t))
        if k % 25 == 0:
            divided.observe()
            divided.energy()
            saved.append(divided.save())
    divided.advance(SOLVERS[solver])
    assert run_bits(divided) == run_bits(whole)
    for snapshot in saved[::5]:
        again = Simulation(whole.scene)
        again.restore(snapshot)
        again.advance(SOLVERS[solver])
        assert run_bits(again) == run_bits(whole)


def test_solvers_agree_on_the_rate_within_their_errors():
    """Those of waves by what finer meshes change, and by the scatter of blows."""
    base = hammer("dth5")
    scene = base.replace(**parameters_under(rock("kuru-granite"), base))
    rates = {}
    for name in ("modal", "wave", "fem"):
        duration = 1.0 if name == "fem" else 3.0
        one = scene.computed_by(name, **({"fem.elements": 40} if name == "fem" else {}))
        result = simulate(one, duration, settle=0.4, record_events=False)
        rates[name] = result.rate_of_penetration, result.rate_of_penetration_error
    for name, (rate, error) in rates.items():
        assert math.isfinite(error), name
        off = abs(rate - rates["wave"][0])
        assert off <= 2.0 * math.hypot(error, rates["wave"][1]) + 1e-12, (name, rates)


def test_an_input_turns_the_bit_at_another_speed():
    """Craters that are met again at once break next to nothing."""
    simulation = Simulation(scene_of("rigid"))
    simulation.advance(0.5)
    before = simulation.blows["hole_advance"][2:].mean()
    simulation.set_inputs(rotation_speed=1e-3)
    simulation.advance(1.5)
    after = simulation.blows["hole_advance"][-5:].mean()
    assert after < 0.05 * before
    assert abs(simulation.energy()["residual_relative"]) < 1e-9
