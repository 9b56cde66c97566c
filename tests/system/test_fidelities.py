"""The loop with a hammer of waves, whose fidelity is a parameter."""

from __future__ import annotations

import numpy as np
import pytest
from momentum import missing_momentum

from fmu_src.system.archive import (
    SYSTEMS,
    SystemPlanError,
    build_fmus,
    find_plan,
    read_plan,
    write_system,
)
from percussion_model import Scene
from percussion_model.coupling import Coupling, CouplingError
from percussion_model.coupling.coupled_run import known_signals, summary

DURATION = 1.5  # [s]: some thirty blows
ONE_ROCK = {
    "rock.layers[1].loading_stiffness": 7.5e8,
    "rock.layers[2].top": -1.0,
    "rock.layers[3].top": -1.0,
}
FIDELITY = "hammer.solver.fidelity"
START = 9.0  # of the piston [m/s]


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    """The feed-controlled system with a hammer of waves."""
    folder = tmp_path_factory.mktemp("waves")
    scene = folder / "waves.toml"
    Scene().replace(**{"start.piston_velocity": START}).to_toml(scene)
    plan = read_plan(SYSTEMS / "feed_control.toml", hammer=str(scene))
    return write_system(plan, build_fmus(plan, folder), folder / "FeedControl.ssp")


def test_energy_and_momentum_balance(system):
    coupling = Coupling(system, ONE_ROCK | {FIDELITY: "wave"})
    run = coupling.run(DURATION, 1e-3, known_signals(coupling.outputs))
    assert run.error == ""
    found = summary(run)
    assert run.verdict.word == "balanced"
    assert found["string_energy_residual"] < 0.01
    assert found["hammer_energy_residual"] < 0.01
    assert found["shoulder_by_blows"] > -0.005
    missing = missing_momentum(run, START)
    assert len(missing) > 500
    assert np.max(np.abs(missing)) < 0.01 * run["hammer.bit.impulse"][-1]


def test_an_unknown_word_is_refused_with_those_there_are(system):
    with pytest.raises(CouplingError, match=r"solver\.fidelity = wvae: must be wave, rigid"):
        Coupling(system, {FIDELITY: "wvae"}).run(1e-3)


def test_the_blow_map_is_retired(system, tmp_path):
    with pytest.raises(CouplingError, match="the blow map is retired"):
        Coupling(system, {FIDELITY: "blow-map"}).run(1e-3)
    path = tmp_path / "mine.toml"
    for word, told in (("wave", ""), ("blow-map", "the blow map is retired")):
        path.write_text(f'base = "feed_control"\nfidelity = "{word}"\n')
        if told:
            with pytest.raises(SystemPlanError, match=told):
                read_plan(path)
        else:
            assert read_plan(path) == read_plan(SYSTEMS / "feed_control.toml")
    with pytest.raises(SystemPlanError, match=r"did you mean .*the blow map is retired"):
        find_plan(type(path)("FeedControlMap"))
