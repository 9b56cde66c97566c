"""One FMU that runs waves, rigid bodies or the blow map, by a parameter."""

from __future__ import annotations

import numpy as np
import pytest
from blow_map_scenes import mapped

from fmu_src.hammer.build import build_hammer
from percussion_model import Scene, Simulation
from percussion_model.analysis.blow_maps import make_map
from percussion_model.scene.scene import SceneError
from scenarios.harness import Instance

WAVE, RIGID, BLOW_MAP = 1, 2, 3  # of the enumeration


@pytest.fixture(scope="module")
def scene():
    """A scene of elastic waves, whose FMU brings a small map along."""
    return mapped().replace(**{"solver.fidelity": "wave"})


@pytest.fixture(scope="module")
def ladder(scene, built_library, tmp_path_factory):
    """Folder of the unpacked FMU."""
    from fmpy import extract

    folder = tmp_path_factory.mktemp("ladder")
    build_hammer(scene, folder / "Ladder.fmu", make_map(scene, workers=1))
    return extract(str(folder / "Ladder.fmu"), str(folder / "unpacked"))


@pytest.fixture
def make(ladder):
    made = []

    def one(fidelity, **values):
        instance = Instance(ladder, name=f"ladder{len(made)}")
        made.append(instance)
        instance.start(solver__fidelity=fidelity, **values)
        return instance

    yield one
    for instance in made:
        instance.free()


def test_the_map_gives_the_blows_of_the_library(make, scene):
    instance = make(BLOW_MAP)
    library = Simulation(scene.replace(**{"solver.fidelity": "blow-map"}))
    rng = np.random.default_rng(7)
    for k, step in enumerate(rng.uniform(1e-4, 5e-3, 300)):
        if k == 100:
            instance.set({"feed_force": 3000.0, "rock.loading_stiffness": 8e8})
            library.set_inputs(feed_force=3000.0, loading_stiffness=8e8)
        instance.step(float(step))
        library.advance(instance.time)
        now = library.observe()
        assert instance.get("bit.position") == now["bit_position"]
        assert instance.get("hole_depth") == now["hole_depth"]
        assert instance.get("piston.position") == now["piston_position"]
        assert instance.get("bit.impulse") == now["bit_impulse"]
    assert instance.get("blow_count") == len(library.blows) > 10
    blow = library.blows[-1]
    assert instance.get("penetration_per_blow") == blow["hole_advance"]
    assert instance.get("impact_velocity") == blow["impact_velocity"]
    assert abs(instance.get("energy_residual")) < 2e-3


def test_peaks_belong_to_the_step_of_the_impact(make):
    instance = make(BLOW_MAP)
    peaks = []
    for _ in range(200):
        instance.step(1e-3)
        peaks.append(instance.get("bit.force_peak"))
    high = np.array(peaks) > 4e5
    assert high.sum() == instance.get("blow_count") + 1


def test_every_rung_answers_in_one_fmu(make, scene):
    rates = {}
    for name, fidelity in (("wave", WAVE), ("rigid", RIGID), ("blow-map", BLOW_MAP)):
        instance = make(fidelity)
        instance.step(0.6)
        library = Simulation(scene.replace(**{"solver.fidelity": name}))
        library.advance(0.6)
        assert instance.get("blow_time") == library.blows["time"][-1]
        rates[name] = instance.get("rate_of_penetration")
    assert rates["blow-map"] == pytest.approx(rates["wave"], rel=0.02)
    assert rates["rigid"] != pytest.approx(rates["wave"], rel=0.02)


def test_states_go_back_and_repeat(make):
    instance = make(BLOW_MAP)
    for _ in range(130):
        instance.step(1e-3)
    saved, time = instance.save(), instance.time
    seen = []
    for _ in range(2):
        instance.restore(saved, time)
        for _ in range(200):
            instance.step(1e-3)
        seen.append([instance.get(name) for name in ("bit.position", "bit.impulse", "blow_time")])
    assert seen[0] == seen[1]


def test_outside_the_map_the_step_fails_with_the_reason(make):
    instance = make(BLOW_MAP)
    instance.step(0.1)
    instance.set({"feed_force": 20.0})
    with pytest.raises(Exception, match="DoStep"):
        instance.step(0.1)
    assert any("feed.force = 20 N: the blow map covers" in text for text in instance.messages)


def test_parameters_that_the_map_does_not_know_are_refused(make):
    with pytest.raises(Exception, match="Initialization"):
        make(BLOW_MAP, loss__time=1e-7)


def test_an_fmu_without_a_map_says_so(hammer):
    instance = Instance(hammer, name="bare")
    try:
        with pytest.raises(Exception, match="Initialization"):
            instance.start(solver__fidelity=BLOW_MAP)
        assert any("brings no blow map" in text for text in instance.messages)
    finally:
        instance.free()


def test_a_map_of_another_scene_is_not_packed(scene, tmp_path):
    with pytest.raises(SceneError, match="made for"):
        build_hammer(Scene().replace(**{"loss.time": 1e-7}), tmp_path / "A.fmu", make_map(scene))
