"""Random scenes of two bars, by waves: what holds for every solver."""

from __future__ import annotations

import pytest

from percussion_model import SceneError
from percussion_model.solvers.base import make_solver
from tests.properties import checks
from tests.properties.scenes import draw_case
from tests.properties.source import Generator

SEED, COUNT, GROUPS = 47, 75, 4


def by_waves(index):
    """A case of two bars by waves; None where it is another one, or refused."""
    case = draw_case(Generator(SEED, index))
    if case.scene.solver_name not in ("wave", "modal"):
        return None
    case.scene = case.scene.computed_by("wave")
    try:
        make_solver(case.scene)
    except SceneError:  # too much loss for short sections
        return None
    return case


@pytest.mark.parametrize("group", range(GROUPS))
def test_random_scenes_of_two_bars(group):
    cases = [by_waves(group * COUNT + k) for k in range(COUNT)]
    found = [case for case in cases if case is not None]
    assert len(found) > COUNT // 5
    for case in found:
        checks.check_case(case)
