"""Breaking, rotation and the casing against their closed forms (docs/model.md, section 6)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from percussion_model import Scene, Simulation, simulate
from percussion_model.components.rotation import next_blow as turn_on
from percussion_model.physics.feed import Throttled, feed_on_bit, note_recoil, throttle
from percussion_model.physics.place import kept_of, lift_bit, move_place
from percussion_model.physics.records import Cuttings, Mode, RockKind
from percussion_model.physics.rock import (
    close_interface,
    crush,
    end_loading,
    hole_depth,
    resume_cycle,
    spring_force,
)
from percussion_model.scene.bits import bit
from percussion_model.scene.hammers import with_chambers
from percussion_model.solvers.wave.records import WAVE_PAR, WAVE_STATE

K, GAMMA, AREA = 6e8, 4.0, 0.0154
CRUSHING = 0.5 * K * (1.0 - 1.0 / GAMMA)  # energy by the square of the greatest penetration
BUTTONS, LEAST, ENERGY, ETA = 17.0, 5.0, 5.5e7, 0.64
RADIUS, LAMBDA, SPEED = 0.05, 2e-3, 5.0


def make(**changes):
    """Parameters and state of a bit right above bilinear rock, which breaks and turns."""
    par, s = np.zeros(1, WAVE_PAR)[0], np.zeros(1, WAVE_STATE)[0]
    par["rock"], par["exponent"], par["buttons"], par["reference_penetration"] = (
        RockKind.BILINEAR,
        1.0,
        1.0,
        1e-3,
    )
    par["places"], par["with_breaking"], par["with_rotation"], par["hole_area"] = 1, 1, 1, AREA
    par["mass_b"], par["mass_p"], par["gravity"] = 16.0, 15.0, 9.81
    numbers = {
        "breaking_buttons": BUTTONS, "breaking_crushing_energy": ENERGY,
        "breaking_threshold": LEAST, "breaking_efficiency": ETA, "breaking_worn": 0.55,
        "rotation_mean_radius": RADIUS, "rotation_renewal_length": LAMBDA,
        "rotation_friction": 0.4,
    }  # fmt: skip
    for name, value in (numbers | changes).items():
        par[name] = value
    if par["rotation_old_line"]:
        par["power"], par["cuttings"], par["left"] = 1, Cuttings.INDEXED, 1
    s["mode"], s["k_r"], s["next_k_r"], s["gamma"], s["next_gamma"] = Mode.FF, K, K, GAMMA, GAMMA
    s["rotation_speed"] = s["rotation_turning_speed"] = SPEED
    s["breaking_crushing_energy"] = par["breaking_crushing_energy"]
    s["feed"] = 3000.0
    return par, s


def load(par, s, force):
    """Push the bit on to a force of fresh rock, then let it turn; the depth pressed in."""
    before = s["p"]
    s["p"] = force / K
    crush(par, s, before)
    end_loading(par, s)


def drop(par, s, energy):
    """A loading from nothing that crushes an energy, after which the bit leaves the rock."""
    close_interface(par, s, 1.0)
    load(par, s, K * math.sqrt(energy / CRUSHING))
    s["mode"], s["p"] = Mode.FF, s["p_u"]


def turn(par, s, period=0.03):
    """The next blow begins after a period."""
    move_place(par, s, float(s["place_time"]) + period)


# -------------------------------------------------------------------- volume and advance


@pytest.mark.parametrize("energy", [60.0, 90.0, 500.0])
def test_a_drop_breaks_what_its_energy_beyond_the_threshold_pays(energy):
    par, s = make()
    drop(par, s, energy)
    volume = ETA * max(energy - BUTTONS * LEAST, 0.0) / ENERGY
    assert s["e_crushing"] == pytest.approx(energy, rel=1e-12)
    assert s["breaking_volume"] == pytest.approx(volume, rel=1e-12, abs=1e-24)
    assert hole_depth(par, s) == pytest.approx(volume / AREA, rel=1e-9, abs=1e-18)
    peak = math.sqrt(energy / CRUSHING)
    pressed = peak * (1.0 - 1.0 / GAMMA)
    assert s["pit"] == pytest.approx(pressed - volume / AREA, rel=1e-12)


def test_the_hole_gains_no_more_than_is_pressed_in():
    par, s = make(breaking_crushing_energy=1e5)
    drop(par, s, 500.0)
    pressed = math.sqrt(500.0 / CRUSHING) * (1.0 - 1.0 / GAMMA)
    assert hole_depth(par, s) == pytest.approx(pressed, rel=1e-12)
    volume = ETA * (500.0 - BUTTONS * LEAST) / 1e5
    assert s["breaking_limited"] == pytest.approx(volume - pressed * AREA, rel=1e-12)
    assert s["pit"] == pytest.approx(0.0, abs=1e-18)


@pytest.mark.parametrize("threshold", [LEAST, 0.0, 1e4])
def test_without_a_crushing_energy_all_that_is_pressed_in_is_gained(threshold):
    par, s = make(breaking_crushing_energy=0.0, breaking_threshold=threshold)
    drop(par, s, 500.0)
    pressed = math.sqrt(500.0 / CRUSHING) * (1.0 - 1.0 / GAMMA)
    assert hole_depth(par, s) == pytest.approx(pressed, rel=1e-12)
    assert s["pit"] == 0.0


def test_a_threshold_above_the_blow_leaves_no_advance():
    par, s = make(breaking_threshold=500.1 / BUTTONS)
    drop(par, s, 500.0)
    assert (hole_depth(par, s), s["breaking_volume"]) == (pytest.approx(0.0, abs=1e-18), 0.0)


@pytest.mark.parametrize("start", [0.0, 3e-8, 4e-6])
def test_a_bit_that_is_found_below_the_surface_has_not_drilled(start):
    """Steps find the rock a little late: the way into it is none that the hole gains."""
    par, s = make(breaking_threshold=1e4)
    s["p"] = start
    close_interface(par, s, 1.0)
    load(par, s, 1e5)
    assert hole_depth(par, s) == pytest.approx(0.0, abs=1e-18)
    assert s["pit"] == pytest.approx(start + 1e5 / K * (1.0 - 1.0 / GAMMA), rel=1e-12)


@pytest.mark.parametrize("limit", [1e-6, 1e-4])
def test_flushing_takes_so_much_of_the_volume_of_a_blow(limit):
    """g(V) = V/(1 + V/V_fl), of the whole blow in however many loadings."""
    par, s = make(breaking_flushed_volume=limit, rotation_renewal_length=0.0)
    drop(par, s, 300.0)
    drop(par, s, 500.0)
    volume = ETA * (500.0 + 300.0 * (1.0 - 1.0 / GAMMA) - BUTTONS * LEAST) / ENERGY
    assert s["breaking_under_way"] == pytest.approx(volume, rel=1e-9)
    first = volume / (1.0 + volume / limit)
    assert s["breaking_volume"] == pytest.approx(first, rel=1e-9)
    turn(par, s)
    assert s["breaking_blow_volume"] == pytest.approx(volume, rel=1e-9)
    drop(par, s, 500.0)  # the next blow begins anew
    volume = ETA * (500.0 - BUTTONS * LEAST) / ENERGY
    second = volume / (1.0 + volume / limit)
    assert s["breaking_volume"] == pytest.approx(first + second, rel=1e-9)


@pytest.mark.parametrize("drilled", [0.0, 30.0, 1e5])
def test_wear_takes_from_the_efficiency_by_the_hole_drilled(drilled):
    par, s = make(breaking_wear_length=100.0, breaking_drilled=drilled)
    drop(par, s, 500.0)
    share = 0.55 + 0.45 * math.exp(-drilled / 100.0)
    volume = share * ETA * (500.0 - BUTTONS * LEAST) / ENERGY
    assert s["breaking_volume"] == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize("unloaded", [0.5, 1.0])
@pytest.mark.parametrize("first", [0.2, 0.9])
@pytest.mark.parametrize("old_line", [0, 1])
def test_a_loading_cut_in_two_has_the_volume_of_one(old_line, first, unloaded):
    """Its energy comes in two parts, without a turn: the second has what the rock gave back."""
    one, two = make(rotation_old_line=old_line), make(rotation_old_line=old_line)
    force = K * math.sqrt(500.0 / CRUSHING)
    close_interface(*one, 1.0)
    load(*one, force)
    par, s = two
    close_interface(par, s, 1.0)
    load(par, s, first * force)
    back = 0.5 * (first * force) ** 2 / (GAMMA * K)
    s["p"] -= unloaded * (s["p"] - s["p_u"])
    lower = float(spring_force(par, s))
    back -= 0.5 * lower**2 / (GAMMA * K)
    if unloaded < 1.0:
        resume_cycle(par, s)
    else:
        s["mode"], s["p"] = Mode.FF, s["p_u"]
        close_interface(par, s, 1.0)
    assert spring_force(par, s) == pytest.approx(lower, rel=1e-9)
    work = 0.5 * force**2 * (1.0 - first**2) / K + back
    before = float(s["p"])
    # on its old line rock comes to the same force; fresh rock takes the work from here on
    peak = force if old_line else math.sqrt(lower**2 + 2.0 * K * work)
    s["p"] = peak / K
    crush(par, s, before)
    end_loading(par, s)
    assert s["breaking_volume"] == pytest.approx(one[1]["breaking_volume"], rel=1e-9)
    assert hole_depth(par, s) == pytest.approx(hole_depth(*one), rel=1e-9)
    assert s["breaking_crushed"] == pytest.approx(500.0, rel=1e-9)
    if old_line:
        assert s["pit"] == pytest.approx(one[1]["pit"], rel=1e-9)
    else:
        assert s["pit"] > one[1]["pit"]


@pytest.mark.parametrize("second", [50.0, 124.0, 125.0])
@pytest.mark.parametrize("old_line", [0, 1])
def test_a_loading_that_only_reloads_its_place_breaks_nothing(old_line, second):
    """Rock of gamma gives back 1/(gamma - 1) of what was crushed: a bounce has no more."""
    par, s = make(rotation_old_line=old_line)
    drop(par, s, 500.0)
    depth, volume = float(hole_depth(par, s)), float(s["breaking_volume"])
    close_interface(par, s, 1.0)
    load(par, s, K * math.sqrt(second / CRUSHING))
    assert s["breaking_volume"] == pytest.approx(volume, rel=1e-12)
    assert hole_depth(par, s) == pytest.approx(depth, rel=1e-9)
    assert s["breaking_crushed"] == pytest.approx(500.0, rel=1e-9)


def test_a_second_loading_adds_what_is_left_after_reloading():
    par, s = make()
    drop(par, s, 500.0)
    drop(par, s, 300.0)
    crushed = 500.0 + 300.0 - 500.0 / GAMMA
    assert s["breaking_crushed"] == pytest.approx(crushed, rel=1e-9)
    volume = ETA * (crushed - BUTTONS * LEAST) / ENERGY
    assert s["breaking_volume"] == pytest.approx(volume, rel=1e-9)


def test_two_loadings_that_follow_at_one_force_have_the_volume_of_one():
    par, s = make()
    close_interface(par, s, 1.0)
    load(par, s, 2e5)
    resume_cycle(par, s)
    load(par, s, 8e5)
    energy = CRUSHING * (8e5 / K) ** 2
    assert s["breaking_volume"] == pytest.approx(
        ETA * (energy - BUTTONS * LEAST) / ENERGY, rel=1e-12
    )


# -------------------------------------------------------------------- places


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_craters_keep_a_share_by_the_arc_however_it_is_cut(exponent):
    """The energy keeps exp(-s/lambda), the depth its root of degree n + 1."""
    par, s = make(exponent=exponent)
    arc = RADIUS * SPEED * 0.03
    kept = float(kept_of(par, s, 0.03))
    assert kept ** (exponent + 1.0) == pytest.approx(math.exp(-arc / LAMBDA), rel=1e-12)
    parts = [float(kept_of(par, s, share * 0.03)) for share in (0.1, 0.2, 0.3, 0.4)]
    assert math.prod(parts) == pytest.approx(kept, rel=1e-12)
    par["rotation_renewal_length"] = 0.0
    assert kept_of(par, s, 0.03) == 0.0


def test_a_place_that_was_met_before_breaks_less():
    """What is kept of the craters' energy has to be crushed again, which breaks nothing."""
    par, s = make()
    for kept in (1.0, 0.5):
        s["breaking_taken"], s["breaking_crushed"], s["breaking_volume"] = 0.0, 0.0, 0.0
        drop(par, s, 500.0)
        s["rotation_turning_speed"] = -LAMBDA * math.log(kept) / (RADIUS * 0.03)
        turn(par, s)
        assert s["breaking_taken"] == pytest.approx(kept * 500.0, rel=1e-9)
        first = float(s["breaking_volume"])
        drop(par, s, 600.0)
        volume = ETA * (600.0 - max(kept * 500.0, BUTTONS * LEAST)) / ENERGY
        assert s["breaking_volume"] - first == pytest.approx(volume, rel=1e-9)
        s["breaking_crushed"] = s["breaking_taken"] = 0.0


def test_what_is_kept_does_not_depend_on_into_how_many_blows_an_arc_is_cut():
    whole, cut = make(), make()
    for par, s in (whole, cut):
        drop(par, s, 500.0)
    turn(*whole, 0.03)
    for _ in range(3):
        turn(*cut, 0.01)
    assert cut[1]["breaking_taken"] == pytest.approx(whole[1]["breaking_taken"], rel=1e-12)
    # on the old line the rest of the pit stays, and all of it is climbed in the end
    whole, cut = make(rotation_old_line=1), make(rotation_old_line=1)
    for par, s in (whole, cut):
        drop(par, s, 500.0)
    turn(*whole, 0.03)
    for _ in range(3):
        turn(*cut, 0.01)
    for name in ("breaking_taken", "breaking_crushed", "pit", "climb", "p_u"):
        assert cut[1][name] == pytest.approx(whole[1][name], rel=1e-9), name


def test_the_bit_climbs_out_of_what_the_hole_did_not_gain():
    par, s = make()
    drop(par, s, 500.0)
    pit, depth = float(s["pit"]), float(hole_depth(par, s))
    kept = math.sqrt(math.exp(-RADIUS * SPEED * 0.03 / LAMBDA))
    s["i_drive"] = 0.03 * 8000.0
    turn(par, s)
    force = 3000.0 + 8000.0 + 31.0 * 9.81
    assert s["climb"] == pytest.approx(pit, rel=1e-12)
    assert s["pit"] == pytest.approx(0.0, abs=1e-18)
    arc, rest = RADIUS * SPEED * 0.03, 3000.0 + 16.0 * 9.81
    torque = RADIUS * (force * (1.0 - kept) * pit / arc + 0.4 * rest)
    assert s["rotation_torque"] == pytest.approx(torque, rel=1e-12)
    assert s["e_climb"] == pytest.approx(force * (1.0 - kept) * pit, rel=1e-12)
    assert s["e_refill"] == pytest.approx(force * kept * pit, rel=1e-12)
    assert -(s["e_feed"] + s["e_drive"] + s["e_gravity"]) == pytest.approx(force * pit, rel=1e-12)
    assert hole_depth(par, s) == pytest.approx(depth, rel=1e-12)


def test_on_the_old_line_pits_and_the_energy_in_them_stay():
    par, s = make(rotation_old_line=1)
    drop(par, s, 500.0)
    pit, left = float(s["pit"]), float(s["p_u"])
    kept = math.sqrt(math.exp(-RADIUS * SPEED * 0.03 / LAMBDA))
    turn(par, s)
    assert s["pit"] == pytest.approx(kept * pit, rel=1e-12)
    assert s["p_u"] == pytest.approx(kept * left, rel=1e-12)
    assert s["e_refill"] == 0.0
    # on the line of what is left, up to the peak that is left, nothing is crushed and broken
    first = float(s["breaking_volume"])
    close_interface(par, s, 1.0)
    load(par, s, 0.99 * kept * K * math.sqrt(500.0 / CRUSHING))
    assert s["breaking_volume"] == first
    assert s["e_crushing"] == pytest.approx(500.0, rel=1e-9)
    s["mode"], s["p"] = Mode.FF, s["p_u"]
    drop(par, s, 600.0)
    volume = ETA * (600.0 - max(kept**2 * 500.0, BUTTONS * LEAST)) / ENERGY
    assert s["breaking_volume"] - first == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize("share", [0.1, 0.8])
def test_what_carries_the_bit_is_left_where_it_turns(share):
    """Its force and place stay; of the crater there is at least what the force tells."""
    par, s = make(rotation_old_line=1)
    close_interface(par, s, 1.0)
    peak = 8e5 / K
    load(par, s, 8e5)
    left = float(s["p_u"])
    s["p"] = left + share * (s["p"] - left)
    force, place = float(spring_force(par, s)), float(s["x_r"] + s["p"])
    pit = float(s["pit"])
    s["rotation_turning_speed"] = 2.0 * LAMBDA * math.log(2.0) / (RADIUS * 0.03)  # half the depth
    turn(par, s)
    now = max(0.5, share)
    assert spring_force(par, s) == pytest.approx(force, rel=1e-9)
    assert s["x_r"] + s["p"] == pytest.approx(place, rel=1e-12)
    assert s["p_u"] == pytest.approx(now * peak * (1.0 - 1.0 / GAMMA), rel=1e-9)
    assert s["pit"] == pytest.approx(now * pit, rel=1e-9)


def test_the_hole_gets_deeper_while_rock_is_loaded():
    par, s = make()
    close_interface(par, s, 1.0)
    depths = []
    for energy in (50.0, 100.0, 300.0, 500.0):
        before, s["p"] = float(s["p"]), math.sqrt(energy / CRUSHING)
        crush(par, s, before)
        depths.append(float(hole_depth(par, s)))
        wanted = ETA * max(energy - BUTTONS * LEAST, 0.0) / ENERGY / AREA
        assert depths[-1] == pytest.approx(wanted, rel=1e-9, abs=1e-18)
    end_loading(par, s)
    assert hole_depth(par, s) == pytest.approx(depths[-1], rel=1e-9)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_a_loading_is_parted_where_the_next_blow_begins(share):
    """The bit climbs out of what the hole has not gained yet; both parts break what one does."""
    one, two = make(), make()
    force = K * math.sqrt(500.0 / CRUSHING)
    close_interface(*one, 1.0)
    load(*one, force)
    par, s = two
    close_interface(par, s, 1.0)
    s["p"] = share * force / K
    crush(par, s, 0.0)
    part, depth = share**2 * 500.0, float(hole_depth(par, s))
    pressed = share * force / K * (1.0 - 1.0 / GAMMA)
    turn(par, s)
    assert hole_depth(par, s) == pytest.approx(depth, rel=1e-9, abs=1e-18)
    assert spring_force(par, s) == pytest.approx(share * force, rel=1e-12)
    assert s["climb"] == pytest.approx(pressed - depth, rel=1e-9)
    assert s["pit"] == pytest.approx(0.0, abs=1e-18)
    volume = ETA * max(part - BUTTONS * LEAST, 0.0) / ENERGY
    assert s["breaking_blow_volume"] == pytest.approx(volume, rel=1e-9, abs=1e-24)
    assert s["breaking_under_way"] == 0.0
    arc = RADIUS * SPEED * 0.03
    assert s["breaking_taken"] == pytest.approx(part * math.exp(-arc / LAMBDA), rel=1e-9)
    load(par, s, force)
    assert s["breaking_volume"] == pytest.approx(one[1]["breaking_volume"], rel=1e-9)
    assert hole_depth(par, s) == pytest.approx(hole_depth(*one), rel=1e-9)
    assert s["pit"] + s["climb"] == pytest.approx(one[1]["pit"], rel=1e-9)


def test_a_loading_on_the_old_line_is_not_parted():
    par, s = make(rotation_old_line=1)
    close_interface(par, s, 1.0)
    s["p"] = 5e5 / K
    crush(par, s, 0.0)
    before = s.copy()
    turn(par, s)
    assert s == before


def test_lifting_a_bit_costs_what_holds_it_down():
    par, s = make()
    s["pit"] = 3e-4
    work = lift_bit(par, s, 3000.0, 8000.0, 1e-4)
    assert work == pytest.approx((11000.0 + 31.0 * 9.81) * 1e-4, rel=1e-12)
    assert (s["pit"], s["climb"]) == (pytest.approx(2e-4), 1e-4)


# -------------------------------------------------------------------- torque and motor


@pytest.mark.parametrize("climb", [0.0, 4e-4])
def test_torque_lifts_the_bit_and_rubs(climb):
    par, s = make()
    turn_on(par, s, 0.03, 0.1, 3000.0, 11000.0, climb)
    arc = RADIUS * SPEED * 0.03
    torque = RADIUS * (11000.0 * climb / arc + 0.4 * 3000.0)
    assert s["rotation_torque"] == pytest.approx(torque, rel=1e-12)
    assert s["rotation_index"] == pytest.approx(arc, rel=1e-12)
    assert s["e_turning"] == pytest.approx(0.4 * 3000.0 * arc, rel=1e-12)
    # the work of the torque over its angle is climb and friction
    assert torque * SPEED * 0.03 == pytest.approx(11000.0 * climb + s["e_friction"], rel=1e-12)


def test_a_bit_at_rest_needs_the_torque_at_which_it_would_begin_to_climb():
    """The slope of the first way: of a pit c the share s/(2 lambda) is left in a small arc."""
    par, s = make()
    s["pit"], s["rotation_turning_speed"] = 4e-4, 0.0
    turn_on(par, s, 0.03, 1.0, 3000.0, 11000.0, 0.0)
    at_rest = float(s["rotation_needed_torque"])
    slope = 4e-4 / (2.0 * LAMBDA)
    assert at_rest == pytest.approx(RADIUS * (11000.0 * slope + 0.4 * 3000.0), rel=1e-12)
    s["rotation_turning_speed"] = 1e-6
    climb = 4e-4 * (1.0 - float(kept_of(par, s, 0.03)))
    turn_on(par, s, 0.03, 1.0, 3000.0, 11000.0, climb)
    assert s["rotation_needed_torque"] == pytest.approx(at_rest, rel=1e-4)


@pytest.mark.parametrize(
    ("stall", "full", "speed"),
    [(0.0, 0.0, 5.0), (500.0, 500.0, 5.0), (280.0, 100.0, 5.0 * (280.0 - 204.0) / 180.0),
     (200.0, 100.0, 0.0), (200.0, 200.0, 0.0)],
)  # fmt: skip
def test_the_motor_slows_with_the_torque(stall, full, speed):
    par, s = make(rotation_stall_torque=stall, rotation_full_torque=full)
    arc = RADIUS * SPEED * 0.03
    climb = (204.0 / RADIUS - 0.4 * 3000.0) / 11000.0 * arc
    turn_on(par, s, 0.03, 0.1, 3000.0, 11000.0, climb)
    assert s["rotation_needed_torque"] == pytest.approx(204.0, rel=1e-12)
    assert s["rotation_torque"] == pytest.approx(min(204.0, stall or 1e9), rel=1e-12)
    assert s["rotation_turning_speed"] == pytest.approx(speed, rel=1e-12)


def test_the_speed_follows_in_its_time():
    par, s = make(rotation_response=0.1)
    s["rotation_speed"] = 8.0
    turn_on(par, s, 0.03, 0.1, 0.0, 0.0, 0.0)
    wanted = 8.0 - 3.0 * math.exp(-0.3)
    assert s["rotation_turning_speed"] == pytest.approx(wanted, rel=1e-12)


def test_rows_of_a_run_have_the_torque_of_its_formula():
    """T = r (F c/s + mu F_0), with the climb from the ledger and the forces from the scene."""
    scene = Scene().replace(**bit("dth-90").parameters).computed_by("rigid")
    simulation = Simulation(scene)
    simulation.advance(0.5)
    blows, found = simulation.blows, []
    weight = scene.gravity.acceleration
    rest = scene.feed.force + scene.bit.mass * weight
    for blow in blows:
        around = [blow["time"] + blow["period"] + h for h in (-1e-9, 1e-9)]
        again, climbed = Simulation(scene), []
        for t in around:
            again.advance(float(t))
            climbed.append(again.energy()["climb"])
        force = rest + scene.piston.mass * weight + blow["drive_impulse"] / blow["period"]
        way = (climbed[1] - climbed[0]) / force
        slope = way / blow["rotation_index"]
        rubbing = scene["rotation.friction"] * rest
        found.append(scene["rotation.mean_radius"] * (force * slope + rubbing))
    assert len(found) > 8
    # of the first blow the period counts from the start of the run
    np.testing.assert_allclose(blows["rotation_torque"][1:], found[1:], rtol=1e-7)


# -------------------------------------------------------------------- feed on the casing


def test_the_casing_passes_on_what_the_drive_leaves():
    par, s = make(on_casing=1, casing_weight=600.0, throttled=Throttled.FORCE)
    s["feed"], s["drive_force"] = 11000.0, 12000.0
    assert feed_on_bit(par, s) == 11600.0  # before the first blow there is no recoil
    note_recoil(par, s, 8400.0)
    assert feed_on_bit(par, s) == pytest.approx(3200.0, rel=1e-12)
    assert throttle(par, s) == 1.0
    s["feed"] = 6400.0
    assert (feed_on_bit(par, s), throttle(par, s)) == (0.0, pytest.approx(7000.0 / 8400.0))
    # a throttled drive of the same shape has the same recoil by its force
    note_recoil(par, s, 7000.0)
    assert s["recoil_share"] * 12000.0 == pytest.approx(8400.0, rel=1e-12)
    s["feed"] = -1000.0
    assert (feed_on_bit(par, s), throttle(par, s)) == (0.0, 0.0)


def test_a_casing_of_no_recoil_is_a_feed_on_the_bit():
    """Without a drive that switches, and none at all, the casing hangs on the bit."""
    base = {"effects.drive": "none", "start.bit_velocity": 5.0, "run.settle": 0.0}
    scene = Scene().computed_by("rigid", **base, **{"piston.model": "absent"})
    on = scene.replace(**{"feed.on": "casing", "feed.casing_mass": 30.0})
    push = scene.feed.force + 30.0 * scene.gravity.acceleration
    one, other = simulate(on, 0.05), simulate(scene.replace(**{"feed.force": push}), 0.05)
    assert one.end["hole_depth"] == pytest.approx(other.end["hole_depth"], rel=1e-12)


@pytest.mark.parametrize(("force", "flow"), [(1000.0, 0.0), (3000.0, 0.0), (3000.0, 10.0)])
def test_air_has_less_pressure_where_the_casing_lifts_off(force, flow):
    """So much that the mean force of air on piston and bit is what holds the casing."""
    changes = {"feed.force": force, "pneumatic.supply_flow": flow}
    scene = with_chambers("dth4", 24e5).computed_by("rigid", **changes)
    simulation, impulses = Simulation(scene), []
    for t in (2.0, 6.0):
        impulses.append(simulation.sample(np.array([t]))["recoil_impulse"][0])
    held = force + scene.feed.casing_mass * scene.gravity.acceleration
    assert (impulses[1] - impulses[0]) / 4.0 == pytest.approx(held, rel=0.01)
    lifted = Simulation(scene.replace(**{"feed.force": -1000.0}))
    lifted.advance(1.0)
    assert len(lifted.blows) <= 1  # the recoil is not known before one
