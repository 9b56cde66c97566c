"""The same loop with the waves and with the blow map, chosen by a parameter of the hammer."""

from __future__ import annotations

import numpy as np
import pytest
from blow_map_scenes import RANGES, mapped
from momentum import missing_momentum

from fmu_src.system.archive import SYSTEMS, build_fmus, read_plan, write_system
from percussion_model.coupling import Coupling, CouplingError
from percussion_model.coupling.coupled_run import known_signals, summary

DURATION = 1.5  # [s]: some thirty blows
ONE_ROCK = {
    "rock.layers[1].loading_stiffness": 7.5e8,
    "rock.layers[2].top": -1.0,
    "rock.layers[3].top": -1.0,
}
FIDELITY = "hammer.solver.fidelity"


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    """The feed-controlled system on a small map, which the waves can take as well."""
    folder = tmp_path_factory.mktemp("map")
    scene = folder / "small.toml"
    scene.write_text(mapped(solver__fidelity="wave").to_toml(), encoding="utf-8")
    plan = read_plan(SYSTEMS / "feed_control.toml", hammer=str(scene), fidelity="blow-map")
    return write_system(plan, build_fmus(plan, folder), folder / "FeedControlMap.ssp")


@pytest.fixture(scope="module")
def runs(system):
    found = {}
    for word in ("wave", "blow-map"):
        coupling = Coupling(system, ONE_ROCK | {FIDELITY: word})
        signals = [*known_signals(coupling.outputs), "hammer.blow_position", "hammer.blow_time"]
        found[word] = coupling.run(DURATION, 1e-3, signals)
        assert found[word].error == ""
    return found


def whole_blows(run):
    """Rate over the whole blows [m/s]."""
    return run["hammer.blow_position"][-1] / run["hammer.blow_time"][-1]


def test_rate_and_feed_agree_within_the_map_s_accuracy(runs):
    """docs/fidelity.md: the rate within 1.3 %; the feed is the controller's."""
    wave, table = runs["wave"], runs["blow-map"]
    assert whole_blows(table) == pytest.approx(whole_blows(wave), rel=0.013)
    assert not np.array_equal(table["hammer.bit.position"], wave["hammer.bit.position"])
    late = wave["time"] > 0.5
    feeds = [run["string.feed_force_mean"][late].mean() for run in (wave, table)]
    assert feeds[1] == pytest.approx(feeds[0], rel=0.005)
    frequencies = [run["hammer.blow_frequency"][-1] for run in (wave, table)]
    assert frequencies[1] == pytest.approx(frequencies[0], rel=0.01)


@pytest.mark.parametrize("word", ["wave", "blow-map"])
def test_energy_and_momentum_balance(runs, word):
    run = runs[word]
    found = summary(run)
    assert run.by_map == (word == "blow-map")
    assert run.verdict.word == "balanced"
    assert found["string_energy_residual"] < 0.01
    assert found["hammer_energy_residual"] < 0.01
    assert found["shoulder_by_blows"] > -0.005
    missing = missing_momentum(run, 9.0)
    # within a blow the map has no forces: the whole impulse comes with the impact
    between = (
        run["hammer.bit.velocity"] == 0.0 if word == "blow-map" else np.full(len(missing), True)
    )
    assert between.sum() > 500
    assert np.max(np.abs(missing[between])) < 0.01 * run["hammer.bit.impulse"][-1]


def test_rock_beyond_the_map_ends_the_run_with_what_there_is(system):
    softer = {"rock.layers[2].top": 0.01, "rock.layers[2].loading_stiffness": 1e6}
    run = Coupling(system, ONE_ROCK | softer).run(3.0, 1e-3)
    assert "hammer: " in run.error
    assert f"the blow map covers {RANGES['stiffness'][0]:g} to" in run.error
    assert "blow_map.stiffness_from widens it" in run.error
    assert 0.01 <= run["hammer.bit.position"][-1] < 0.012
    assert run.steps == len(run["time"]) - 1 > 300


def test_an_unknown_word_is_refused_with_those_there_are(system):
    with pytest.raises(CouplingError, match=r"solver\.fidelity = wvae: must be .*wave.*blow-map"):
        Coupling(system, {FIDELITY: "wvae"}).run(1e-3)
