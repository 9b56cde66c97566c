"""Warnings of what does not go with the strength of the rock, the motor and the casing."""

from __future__ import annotations

import re

import pytest

from percussion_model import simulate
from percussion_model.scene.hammers import hammer
from percussion_model.scene.rocks import read_rock
from percussion_model.scene.rocks.breaking import parameters_under
from percussion_model.simulation.validity import specific_energy_note
from percussion_model.simulation.warnings import find_warnings

PRESSED_IN = {"effects.breaking": False, "effects.rotation": False}
WARNED = {
    "as it is": ("kuru-granite", {}, ""),
    "pressed in": ("kuru-granite:10", PRESSED_IN, "0.2[0-9] times the compressive strength"),
    "pressed in by the power law": (
        "model-granite-round-power:10", PRESSED_IN, "0.2[0-9] times the compressive strength",
    ),
    "rock that hardly breaks": (
        "kuru-granite", {"breaking.crushing_energy": 1e9}, "blows hardly break it",
    ),
    "a bit that hardly turns": ("kuru-granite", {"rotation.speed": 0.05}, "blows hardly break it"),
    "more than is pressed in": (
        "kuru-granite", {"breaking.crushing_energy": 1e6}, "volume broken is not gained",
    ),
    "a weak motor": (
        "kuru-granite", {"feed.force": 4e4, "rotation.stall_torque": 300.0}, "rotation has jammed",
    ),
    "too little feed": ("kuru-granite", {"feed.force": 3e3}, "does not hold the casing"),
}  # fmt: skip


@pytest.mark.parametrize("name", WARNED)
def test_what_a_driller_would_not_believe_is_told(name):
    rock, changes, wanted = WARNED[name]
    scene = hammer("dth5").replace(**{key: changes[key] for key in PRESSED_IN if key in changes})
    scene = scene.replace(**{**parameters_under(read_rock(rock), scene), **changes})
    result = simulate(scene, 4.0, settle=1.0, error_estimate=False)
    found = " ".join(find_warnings(result))
    assert re.search(wanted, found)
    if not wanted:
        assert not re.search("strength|jammed|casing|not gained", found)


@pytest.mark.parametrize(("share", "told"), [(0.29, 1), (0.31, 0), (4.9, 0), (5.1, 1)])
def test_energies_from_a_third_to_five_times_the_strength_are_usual(share, told):
    assert len(list(specific_energy_note(share * 2e8, "granite", 2e8))) == told
