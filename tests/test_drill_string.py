"""Reports on drill strings: against closed forms of waves, and their figures."""

from __future__ import annotations

import math

import numpy as np
import pytest

from percussion_model import Scene, SceneError, SimulationError
from percussion_model.analysis.drill_string import string_report
from percussion_model.interface.plotting.drill_string import draw_string
from percussion_model.interface.plotting.style import save_figures
from percussion_model.interface.terminal import _cells_of_bars
from percussion_model.scene.hammers import hammer

AREA, E, RHO = 1.5e-3, 206e9, 7850.0
C0 = math.sqrt(E / RHO)
PISTON, ROD, BIT = 0.4, 3.0, 0.2  # lengths [m]
GAUGE = ("rod 2", 1.5)


def bar(length, **joint):
    section = {"length": length, "area": AREA, "youngs_modulus": E, "density": RHO}
    return {"sections": [section], **joint}


def string(**joint):
    """Bars of one section each, without damper, weight and much loss."""
    bars = [bar(PISTON), bar(ROD, **joint), bar(ROD), bar(BIT)]
    return Scene(
        title="Bars of one section", bars=bars, effects={"gravity": False},
        drive={"force": 8000.0, "reversal_distance": 0.018}, feed={"force": 8000.0},
        loss={"time": 1e-8}, rock={"loading_stiffness": 4e8, "barrier_energy": 0.5},
        start={"piston_velocity": 9.0}, run={"duration": 0.7, "settle": 0.3},
    )  # fmt: skip


@pytest.fixture(scope="module")
def perfect():
    return string_report(string(), gauges=[GAUGE, ("piston", 0.2)])


@pytest.fixture(scope="module")
def shipped():
    scene = hammer("t38", 2)
    return string_report(scene, 0.6, gauges=[("rod 2", 1.8), ("rod 3", 1.8), ("bit", 0.05)])


def test_a_perfect_joint_of_equal_bars_lets_all_pass(perfect):
    one = perfect.joints["rod 1 / rod 2"]
    assert one.passed == pytest.approx(one.came, rel=1e-3)  # but for the feed
    assert list(perfect.joints) == ["rod 1 / rod 2", "rod 2 / bit"]
    # what went down each joint for good reaches the rock, but for structural loss
    upper, lower = (joint.net for joint in perfect.joints.values())
    assert upper > lower
    assert lower == pytest.approx(perfect.rock.work, rel=0.01)
    assert upper < 1.1 * lower


@pytest.mark.parametrize("share", [0.8, 0.5])
def test_a_lossy_joint_returns_what_its_transmission_leaves(share):
    """A wave far shorter than the relaxation: 1 - s of its force, (1 - s)^2 of its energy."""
    scene = string(joint="lossy", transmission=share, relaxation=0.02)
    found = string_report(scene).joints["rod 1 / rod 2"]
    assert found.efficiency == pytest.approx(1.0 - (1.0 - share) ** 2, abs=0.01)


def test_efficiency_of_the_first_wave_at_a_perfect_joint(perfect):
    assert perfect.joints["rod 1 / rod 2"].efficiency == pytest.approx(1.0, abs=1e-6)


def test_the_rock_gets_what_does_not_return(perfect, shipped):
    for report in (perfect, shipped):
        rock = report.rock
        assert rock.incident - rock.reflected == pytest.approx(rock.work, rel=0.02)
        assert report.efficiency == pytest.approx(rock.work / report.blow_energy)
        assert 0.3 < rock.first_share <= 1.0
        last = list(report.joints.values())[-1]
        assert last.net == pytest.approx(rock.work, rel=0.03)


def test_a_gauge_sees_the_wave_of_the_impact(perfect):
    """Stress rho c v / 2 for 2 L/c, from when the front has come."""
    time, stress = perfect.watched.time, perfect.gauges[GAUGE]
    arrival, length = (ROD + GAUGE[1]) / C0, 2.0 * PISTON / C0
    speed = math.sqrt(2.0 * perfect.blow_energy / (RHO * AREA * PISTON))
    inside = (time > arrival + 0.2 * length) & (time < arrival + 0.8 * length)
    assert inside.sum() > 5
    before = stress[time < arrival - 0.1 * length]
    wave = RHO * C0 * speed / 2.0
    assert np.abs(stress[inside] - wave).max() < 0.02 * wave + np.abs(before).max()
    assert perfect.bars["rod 1"].compression.value > 0.97 * wave
    assert perfect.transit_time == pytest.approx((2.0 * ROD + BIT) / C0)


def test_extremes_are_those_of_the_watched_blow(shipped):
    for name, one in shipped.bars.items():
        stress = shipped.watched.stress(name)
        assert one.compression.value == stress.max()
        assert one.tension.value == stress.min()
        step = np.searchsorted(shipped.watched.time, one.tension.time)
        assert shipped.watched.gauge(name, one.tension.place)[step] == one.tension.value
    # a thread that has parted holds with more than its preload
    assert all(joint.least_force < 0.0 for joint in shipped.joints.values())


def test_the_watched_blow_begins_with_the_impact(shipped):
    watched = shipped.watched
    assert 0.0 <= watched.time[0] < 2e-5
    assert watched.contacts[0][0] == pytest.approx(0.0, abs=1e-6)
    assert watched.time[-1] == pytest.approx(shipped.period, rel=0.05)
    start = watched.kinetic["piston"][0] + watched.elastic["piston"][0]
    assert start == pytest.approx(shipped.blow_energy, rel=0.15)
    # the wave is in the second rod half a transit of it after it came there
    assert watched.kinetic["rod 2"].max() > 0.3 * shipped.blow_energy
    assert len(repr(shipped)) < 4000
    assert "array" not in repr(shipped)


def test_what_cannot_be_reported_is_refused():
    with pytest.raises(SceneError, match="needs a drill string"):
        string_report(Scene())
    with pytest.raises(SimulationError, match="whole blows"):
        string_report(string(), 0.05)
    with pytest.raises(SimulationError, match="rod 9"):
        string_report(string(), gauges=[("rod 9", 0.1)])
    with pytest.raises(SimulationError, match="3 m long"):
        string_report(string(), gauges=[("rod 2", 3.5)])


def test_figures_name_their_axes_and_units(shipped, tmp_path):
    drawn = dict(draw_string(shipped))
    assert list(drawn) == ["string_waves", "string_energy", "string_gauges"]
    for fig in drawn.values():
        for ax in fig.axes:
            texts = [ax.get_ylabel(), ax.get_xlabel()]
            assert any("[" in text for text in texts if text), texts
    told = {text.get_text() for text in drawn["string_waves"].axes[0].texts}
    assert {"piston", "rod 1, the shank", "rod 2", "rod 3", "bit", "rock"} <= told
    files = save_figures(lambda: draw_string(shipped), tmp_path)
    assert len(files) == 6
    assert all(path.stat().st_size > 1000 for path in files)


@pytest.mark.parametrize(("count", "names"), [(5, "shank, 4 rods"), (2, "shank, 1 rod")])
def test_rods_are_counted_as_they_are_asked_for(count, names):
    cells = {"piston": 16, **{f"rod {k + 1}": 12 for k in range(count)}, "bit": 4}
    assert _cells_of_bars(cells, has_shank=True)[1] == f"piston, {names}, bit"
    assert _cells_of_bars(cells, has_shank=False)[1] == f"piston, {count} rods, bit"
