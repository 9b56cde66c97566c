"""What a blow map is made of: flights against closed forms, single blows against runs."""

from __future__ import annotations

import itertools
import math

import pytest
from blow_map_scenes import mapped, run_by_hand

from percussion_model import Simulation, piston_cycle
from percussion_model.solvers.blow_map.records import Entry
from percussion_model.solvers.blow_map.single_blow import SingleBlow

# ------------------------------------------------------------------------- flight


def test_flight_is_the_closed_form_of_the_paper():
    """With a constant restitution, a bit that stays and no weight: eq. 12 of the paper."""
    scene = mapped(effects__gravity=False)
    simulation = run_by_hand(scene, 3.0, rebound=-0.37)
    blows = simulation.blows
    assert len(blows) > 50
    for blow, following in itertools.pairwise(blows):
        expected = piston_cycle(
            scene.drive.force,
            scene.drive.reversal_distance,
            scene.piston.mass,
            -0.37 * blow["impact_velocity"],
        )
        assert following["impact_velocity"] == pytest.approx(expected.impact_velocity, rel=1e-12)
        assert blow["period"] == pytest.approx(expected.flight_time, rel=1e-12)
        assert blow["stroke"] == pytest.approx(expected.stroke, rel=1e-12)


def test_a_bit_that_sinks_lengthens_the_flight_by_its_way():
    """The drive turns by the bit's place of that time, the piston falls to its last one."""
    scene = mapped(effects__gravity=False)
    sunk = 1e-4
    entries = {"rebound": -0.37, "penetration": sunk}
    simulation = run_by_hand(scene, 1.0, **entries)
    blow, following = simulation.blows[-2:]
    m, f, v = scene.piston.mass, scene.drive.force, blow["impact_velocity"]
    down = v * sunk
    # the path of the table is zero until its last time, and the drive turns before that
    turn = scene.drive.reversal_distance
    square = (0.37 * v) ** 2 + 2 * f / m * (turn + turn + down)
    assert following["impact_velocity"] == pytest.approx(math.sqrt(square), rel=1e-9)
    assert blow["penetration"] == pytest.approx(down, rel=1e-12)


# -------------------------------------------------------------------- single blows


def test_a_single_blow_is_that_of_a_run(reference_by_waves):
    """A blow of the settled reference by waves: its bit rings by 1e-7 m before and after."""
    scene = mapped()
    blow = reference_by_waves.blows[-1]
    load = scene.feed.force + scene.bit.mass * scene.gravity.acceleration
    v = float(blow["impact_velocity"])
    single = SingleBlow(scene, scene.rock.loading_stiffness)
    found = single.entries(v, load, scene.drive.force)
    assert v * found[Entry.PENETRATION] == pytest.approx(blow["penetration"], rel=1e-3)
    assert v * found[Entry.PEAK_BIT] == pytest.approx(blow["peak_bit_force"], rel=1e-4)
    assert v * found[Entry.PEAK_CONTACT] == pytest.approx(blow["peak_contact_force"], rel=1e-4)
    a = scene.gravity.acceleration - scene.drive.force / scene.piston.mass
    rebound = v * found[Entry.REBOUND] + a * found[Entry.OPENED]
    assert rebound == pytest.approx(blow["rebound_velocity"], rel=1e-3)
    rock = sum(found[e] for e in (Entry.CRUSHING, Entry.BARRIER, Entry.STANDSTILL))
    assert v * v * rock == pytest.approx(blow["rock_energy"], rel=1e-3)
    assert (found[Entry.CONTACTS], found[Entry.CYCLES]) == (2, 5)


def test_a_single_blow_is_that_of_a_run_whose_bit_has_come_to_rest():
    """Half a second of flight lets the vibration die that the feed makes at the start."""
    scene = mapped(effects__gravity=False)
    v, way = 8.6, 5.0
    start = {"start.piston_velocity": v, "start.gap": way, "start.rock_gap": 0.0}
    elastic = scene.computed_by("wave", **start, **{"effects.drive": "none"})
    at = Simulation(elastic).sample([way / v - 1e-5, way / v + 0.1])
    advance = at["bit_position"][1] - at["bit_position"][0]
    single = SingleBlow(scene, scene.rock.loading_stiffness)
    found = single.entries(v, scene.feed.force, 0.0)
    # the bit still rings by some 1e-7 m when its place is read
    assert v * found[Entry.PENETRATION] == pytest.approx(advance, rel=1e-3)
    assert v * found[Entry.REBOUND] == pytest.approx(at["piston_velocity"][1], rel=1e-9)


def test_a_single_blow_keeps_energy_and_momentum():
    scene = mapped()
    v, load, drive = 8.0, 3000.0, 2800.0
    found = SingleBlow(scene, 7e8).entries(v, load, drive)
    m, g = scene.piston.mass, scene.gravity.acceleration
    feed = load - scene.bit.mass * g
    start, offset = v * found[Entry.REBOUND], v * found[Entry.OFFSET]
    down = v * found[Entry.PENETRATION]
    # the flight begins with `start` at `offset`: what has been put in until then
    put_in = 0.5 * m * v**2 + (m * g - drive) * offset + load * down
    gone = v * v * found[[Entry.CRUSHING, Entry.BARRIER, Entry.STANDSTILL]].sum()
    gone += v * v * (found[Entry.LOSS] + found[Entry.NUMERICAL])
    assert feed > 0
    assert put_in - gone == pytest.approx(0.5 * m * start**2, abs=1e-4 * put_in)


def test_a_blow_scales_with_its_velocity_without_a_barrier():
    """Elastic bars on bilinear rock know no scale: forces, lengths and speeds go together."""
    scene = mapped(effects__barrier=False, effects__gravity=False)
    single = SingleBlow(scene, 7.5e8)
    one, two = single.entries(4.0, 1000.0, 1500.0), single.entries(8.0, 2000.0, 3000.0)
    assert two[Entry.PENETRATION] == pytest.approx(one[Entry.PENETRATION], rel=1e-3)
    # the dead band of the rock law, 1e-9 m/s, does not scale
    assert two[Entry.REBOUND] == pytest.approx(one[Entry.REBOUND], rel=1e-8)
    assert two[Entry.PEAK_BIT] == pytest.approx(one[Entry.PEAK_BIT], rel=1e-8)
