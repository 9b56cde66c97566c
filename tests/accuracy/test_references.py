"""Stored references: of the shipped scenes, and backed by two solvers or a closed form."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from percussion_model import Scene
from percussion_model.interface.commands.common import rock_changes
from percussion_model.scene.hammers import hammer
from percussion_model.verification.accuracy.closed_forms import closed_forms, solver_error
from percussion_model.verification.accuracy.problems import (
    DROP,
    HISTORIES,
    HISTORY,
    PERIODIC,
    QUANTITIES,
    RATE,
    STRESS_HISTORY,
    Run,
    pose,
    relative_error,
)
from percussion_model.verification.accuracy.references import (
    CLOSE,
    Reference,
    _agree,
    fingerprint,
    load_references,
    package_store,
    save_references,
)

SCENARIOS = Path(__file__).parents[2] / "scenarios"
DRAWN = tuple(f"drawn/drawn_{k}" for k in (1, 2, 3, 4))
HAMMERS = {
    "dth4_kuru": ("dth4", "kuru-granite:10"),
    "dth5_st_anne": ("dth5", "st-anne-limestone:12"),
    "t38_rods": ("t38", None),
}
SCENES = (
    *("reference", "drop_test", "stiff_rock", "chatter", "top_hammer", *DRAWN, "aperiodic"),
    *(f"hammers/{name}" for name in HAMMERS),
)
STORED = load_references()
CLOSED = {case.name: case for case in closed_forms()}


def reference(name: str) -> Reference:
    return STORED[fingerprint(Scene.from_toml(SCENARIOS / f"{name}.toml"))]


@pytest.mark.parametrize("name", SCENES)
def test_each_scene_has_a_reference_that_says_how_it_was_made(name):
    found = reference(name)
    own = {"wave"} if name.endswith("t38_rods") else {"wave", "modal"}
    assert own | {"explicit", "date", "version"} <= set(found.made)
    assert not found.made["quick"]
    for key, bar in found.bars.items():
        assert key in QUANTITIES
        assert bar.error > 0
        (first, error), (second, error_of_second) = bar.surest
        off = abs(first - second)
        close = off <= error + error_of_second or off <= CLOSE * abs(bar.value)
        assert bar.error >= off * (1.0 - 1e-9)
        if key not in HISTORIES:
            assert bar.agreed == (close or bar.threshold)
    for history in found.histories.values():
        assert np.all(np.isfinite(history))


@pytest.mark.parametrize("name", SCENES[:5])
def test_periodic_scenes_have_a_reference_in_what_matters_most(name):
    found = reference(name)
    main = "resting_place" if found.kind == DROP else RATE
    assert found.bars[main].agreed
    # near a threshold the bar covers two motions
    assert found.floor(main) < (7e-3 if name == "stiff_rock" else 5e-4)


@pytest.mark.parametrize("name", SCENES[:5])
def test_forces_and_stress_have_references(name):
    found = reference(name)
    for key in HISTORIES if found.kind == PERIODIC else (HISTORY, STRESS_HISTORY):
        assert found.floor(key) < 1e-2
        assert len(found.histories[key]) > 100


@pytest.mark.parametrize("name", [*SCENES[:5], *DRAWN, "hammers/dth4_kuru", "hammers/dth5_st_anne"])
def test_stress_by_waves_and_by_elements_differs_by_what_is_left_of_their_errors(name):
    """Waves told it half the loss time early, 0.4 to 0.9 % of its mean."""
    bar = reference(name).bars[STRESS_HISTORY]
    assert bar.apart < sum(left for _, left in bar.limits.values())
    assert bar.apart < 5e-4


def test_a_bar_near_a_threshold_covers_both_motions():
    """Six cycles a blow with 20 to 40 modes, five with 56 and more; no other scene has that."""
    bar = reference("stiff_rock").bars[RATE]
    assert bar.threshold
    assert bar.value - bar.error < 10.22e-3
    assert bar.value + bar.error > 10.34e-3
    assert not reference("reference").bars[RATE].threshold


def test_the_bar_of_the_reference_scene_covers_its_limit():
    """Limit of three solvers with up to 800 cells, docs/data/modes.md, section 3: 16.3505(4)."""
    bar = reference("reference").bars[RATE]
    assert abs(bar.value - 16.3505e-3) < bar.error + 0.0004e-3
    assert bar.error < 1e-4 * bar.value


def test_what_modes_find_is_in_the_bar():
    """A spread below a thousandth widens it; a larger one is another motion."""
    limits = {"wave": (1.0, 1e-5), "modal": (1.0001, 1e-5)}
    near = _agree(limits, [1.0003, 1.0001])
    assert (near.value, near.error, near.threshold) == (1.0, pytest.approx(3e-4), False)
    other = _agree(limits, [1.0, 0.98, 0.98])
    assert (other.value, other.error) == (pytest.approx(0.99), pytest.approx(0.01))
    assert other.threshold
    assert other.agreed


@pytest.mark.parametrize("name", HAMMERS)
def test_scenes_of_hammers_are_the_presets_with_their_rocks(name):
    preset, rock = HAMMERS[name]
    scene = Scene.from_toml(SCENARIOS / "hammers" / f"{name}.toml")
    # peers know neither breaking nor a casing
    found = hammer(preset)
    own = ("effects.breaking", "effects.rotation", "feed.on", "feed.casing_mass")
    own += tuple(key for key in found.given if key.startswith(("breaking.", "rotation.")))
    plain = found.replace(**dict.fromkeys(own))
    assert fingerprint(scene) == fingerprint(plain.replace(**rock_changes(rock, plain)))


def test_no_reference_is_taken_where_the_solvers_disagree():
    found = reference("reference")
    bars = dict(found.bars)
    bar = bars[RATE]
    bars[RATE] = type(bar)(**{**bar.__dict__, "agreed": False})
    other = Reference(found.title, found.kind, bars, {})
    assert RATE not in other.values
    assert math.isnan(other.floor(RATE))


def test_the_reference_scene_is_known_by_what_it_says_not_by_how_it_is_written():
    written = Scene.from_toml(SCENARIOS / "reference.toml")
    assert fingerprint(written) == fingerprint(Scene(title="another name"))
    assert fingerprint(written) == fingerprint(written.computed_by("fem"))
    assert fingerprint(written) != fingerprint(written.replace(**{"feed.force": 2501.0}))


def test_references_survive_their_file(tmp_path):
    path = tmp_path / "references.json"
    save_references(path, STORED)
    assert json.loads(path.read_text()) == json.loads(package_store().read_text())
    assert load_references(path).keys() == STORED.keys()
    assert load_references(tmp_path / "none.json") == {}


def test_the_waves_find_the_reference_scene():
    """40 cells, from a start near the periodic motion; docs/data/waves.md says 0.01 %."""
    scene = Scene.from_toml(SCENARIOS / "reference.toml")
    problem, found = pose(scene), reference("reference")
    assert problem.kind == PERIODIC
    answer = Run(problem, problem.scene.replace(**{"solver.cells": 40})).answer()
    assert relative_error(answer, found.values, found.histories, RATE) < 3e-4
    assert relative_error(answer, found.values, found.histories, HISTORY) < 5e-3


@pytest.mark.parametrize("name", CLOSED)
def test_waves_meet_closed_forms(name):
    """No loss, one section: nothing but the start of the front is averaged."""
    assert solver_error(CLOSED[name], "wave", 20) < 1e-7


@pytest.mark.parametrize("name", CLOSED)
def test_elements_come_closer_to_closed_forms_with_the_mesh(name):
    errors = [solver_error(CLOSED[name], "fem", count) for count in (20, 80)]
    assert errors[1] < 0.75 * errors[0]
    assert errors[1] < 1e-2


def test_one_witness_makes_no_reference():
    """As the peak of the contact force where explicit elements refuse a rock law."""
    bar = _agree({"wave": (2.0, 0.1)})
    assert (bar.value, bar.error, bar.agreed, bar.doubt) == (
        2.0, 0.1, False, "one method alone gives it",
    )  # fmt: skip
    assert math.isnan(bar.apart)
    assert _agree({"wave": (2.0, 0.1), "fem": (4.0, 0.1)}).doubt == "the limits disagree"
    assert _agree({"wave": (2.0, 0.1), "fem": (2.1, 0.1)}).doubt == ""
