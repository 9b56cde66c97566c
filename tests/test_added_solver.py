"""A solver that stands outside the package: registered, it is one like any other."""

from __future__ import annotations

import numpy as np
import pytest

from percussion_model import Scene, SceneError, compare, simulate
from percussion_model.analysis.effect_study import study_effects
from percussion_model.scene.solver_names import BODIES, SOLVER_NAMES
from percussion_model.solvers import base

SCENE = Scene().replace(**{"run.duration": 1.0, "run.settle": 0.2})


@pytest.fixture(autouse=True)
def _euler():
    base.register("euler", "tests.euler_solver", "EulerSolver", "rigid")
    yield
    SOLVER_NAMES.remove("euler")
    del BODIES["euler"], base._REGISTRY["euler"]


def test_it_is_compared_with_the_solvers_of_the_package():
    found = compare(SCENE, ["rigid", "euler"])
    rates = [result.rate_of_penetration for result in found.results.values()]
    # its law has no energy barrier, and its steps are coarse
    assert rates[1] == pytest.approx(rates[0], rel=0.15)
    assert not any("loss is off" in text for text in found.results["euler"].warnings)
    assert len(found.results["euler"].blows) == pytest.approx(len(found.results["rigid"].blows), 1)


def test_its_effects_are_studied():
    study = study_effects(SCENE.computed_by("euler", **{"run.duration": 0.2, "run.settle": 0.05}))
    found = {trial.variant.effect: trial for trial in study.trials}
    assert study.base.result.solver == "euler"
    still = found["feed"].result.blows
    assert len(still)
    assert still["penetration"].sum() < study.base.result.blows["penetration"].sum()


def test_an_fmu_takes_it_along(tmp_path):
    from fmpy import simulate_fmu

    from fmu_src.hammer.build import build_hammer

    scene = SCENE.computed_by("euler")
    path = tmp_path / "PercussiveHammer.fmu"
    build_hammer(scene, path)
    outputs = ["blow_count", "blow_time", "impact_velocity"]
    found = simulate_fmu(str(path), stop_time=0.5, step_size=1e-3, output=outputs)
    blows = simulate(scene, 0.5, settle=0.0).blows
    assert found["blow_count"][-1] == len(blows) > 5
    _, first = np.unique(found["blow_count"], return_index=True)
    for output, column in (("blow_time", "time"), ("impact_velocity", "impact_velocity")):
        np.testing.assert_array_equal(found[output][first[1:]], blows[column])


def test_its_name_is_checked_like_the_others():
    with pytest.raises(SceneError, match=r'solver.name = "eulr": must be one of .*"euler"'):
        Scene().replace(**{"solver.name": "eulr"})
    with pytest.raises(ValueError, match="there is a solver of this name"):
        base.register("wave", "tests.euler_solver", "EulerSolver")
