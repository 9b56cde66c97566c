"""Button bits by name: what is stored, --bit, --rock under a bit, and contradictions."""

from __future__ import annotations

import json
import math
import re

import pytest

from percussion_model import Scene, SceneError
from percussion_model.interface.commands import common
from percussion_model.scene.bits import bit, bit_of, bits
from percussion_model.scene.hammers import hammer, hammers
from percussion_model.scene.parameters import rows_by_key
from percussion_model.scene.rocks import KINDS, STIFFNESS, read_rock, rock, rocks
from percussion_model.scene.rocks.breaking import (
    breaking_numbers,
    energy_by_strength,
    on_bottom,
    parameters_under,
)
from percussion_model.scene.typical import unusual_values
from tests.commands import percussion

COUNT, SHARE = "breaking.buttons", 0.5
UNDER_BIT = Scene().replace(**bit("dth-140").parameters)
ENERGY, THRESHOLD = "breaking.crushing_energy", "breaking.threshold"


@pytest.fixture(autouse=True)
def every_hint(monkeypatch):
    monkeypatch.setattr(common, "_hinted", set())


# ------------------------------------------------------------------- what is stored


def test_there_are_bits_for_holes_from_45_to_254_mm():
    assert len(bits()) >= 12
    sizes = [bit(name).diameter for name in bits()]
    assert min(sizes) <= 0.045
    assert max(sizes) >= 0.25
    assert all(f"{1e3 * bit(name).diameter:.0f}" == name.split("-")[1] for name in bits())


@pytest.mark.parametrize("name", bits())
def test_a_bit_lies_in_its_intervals_and_the_bounds_and_tells_its_source(name):
    one = bit(name)
    scene = Scene().replace(**one.parameters)
    assert not set(one.parameters) & set(scene.unused)
    assert list(unusual_values(scene)) == []
    assert bit_of(scene) == name
    for number in (one.buttons, one.mean_radius):
        assert number.low <= number.value <= number.high
        assert number.low < number.high
        assert number.kind in KINDS
        assert number.why
    assert set(one.source) == {"cited", "read_in"}
    assert all(one.source.values())
    for key, value in one.parameters.items():
        assert rows_by_key()[key].allows(value) or isinstance(value, bool), key


@pytest.mark.parametrize("name", bits())
def test_numbers_of_a_bit_fit_each_other(name):
    """Buttons fit on the face, and their mean radius is that of a ring and an even disc."""
    one = bit(name)
    count, ring = round(one.buttons.value), 0.5 * (one.diameter - one.gauge_button_diameter)
    assert 0 < one.gauge_buttons < count
    assert one.gauge_buttons * one.gauge_button_diameter < 2.0 * math.pi * ring
    sizes = (one.gauge_button_diameter, one.front_button_diameter)
    steel = one.gauge_buttons * sizes[0] ** 2 + (count - one.gauge_buttons) * sizes[1] ** 2
    assert steel < one.diameter**2
    inside = ring - 0.5 * one.gauge_button_diameter
    even = 2.0 / 3.0 * inside
    mean = (one.gauge_buttons * ring + (count - one.gauge_buttons) * even) / count
    assert one.mean_radius.value == pytest.approx(mean, rel=0.1)
    assert one.mean_radius.high < ring
    # the makers' rule, 300 by inches
    rpm = one.usual_speed * 60.0 / (2.0 * math.pi)
    assert rpm * one.diameter / 0.0254 == pytest.approx(300.0, rel=1e-12)


@pytest.mark.parametrize("name", hammers())
def test_a_hammer_has_a_bit_of_its_hole(name):
    scene = hammer(name)
    own = bit_of(scene)
    assert bit(own).diameter == scene.hole_diameter
    assert scene["effects.breaking"]
    assert scene["effects.rotation"]
    assert own.split("-")[0] == ("dth" if name.startswith("dth") else "th")


def test_a_scene_without_them_has_no_bit():
    assert bit_of(Scene()) == ""
    changed = UNDER_BIT.replace(**{"rotation.mean_radius": 0.04})
    assert bit_of(changed) == ""
    with pytest.raises(SceneError, match=r"dth-14: there is none .* did you mean dth-140\?"):
        bit("dth-14")


# ------------------------------------------------------------------- rock under a bit


@pytest.mark.parametrize("name", rocks())
def test_a_rock_under_a_bit_has_half_the_stiffness_of_its_buttons_and_its_craters(name):
    one = rock(name)
    found = parameters_under(one, UNDER_BIT)
    full = one.number(STIFFNESS).value
    if one.buttons is not None:
        full *= SHARE * (1.0 if one.law == "power" else 17 / one.buttons)
    assert found[STIFFNESS] == pytest.approx(full, rel=1e-12)
    assert found[COUNT] == 17
    numbers = breaking_numbers(one)
    own = {number.key: number.value for number in numbers}
    own[THRESHOLD] *= (bit("dth-140").button_diameter / 17.02e-3) ** 3
    assert own.keys() <= found.keys()
    for key, value in own.items():
        assert found[key] == pytest.approx(value, rel=1e-12), key
    for number in numbers:
        assert number.low <= number.value <= number.high
        assert number.kind in KINDS
        assert number.why
    assert not set(found) & set(UNDER_BIT.replace(**found).unused)


@pytest.mark.parametrize("name", [name for name in rocks() if rock(name).buttons])
def test_so_many_buttons_asked_for_are_as_many_of_the_bit(name):
    asked = parameters_under(read_rock(f"{name}:10"), UNDER_BIT)
    ten = parameters_under(rock(name), UNDER_BIT.replace(**{COUNT: 10}))
    assert set(asked) == set(ten)
    # no bit of a name has ten buttons, so no size of them is known
    assert ten[THRESHOLD] == 5.0
    for key, value in ten.items():
        assert asked[key] == (value if isinstance(value, str) else pytest.approx(value)), key
    assert on_bottom(read_rock(f"{name}:10"), 10).number(STIFFNESS).value == pytest.approx(
        on_bottom(rock(name), 10).number(STIFFNESS).value
    )


def test_without_a_bit_a_rock_is_what_it_was():
    one = rock("kuru-granite")
    assert parameters_under(one, Scene()) == one.parameters
    only = UNDER_BIT.replace(**{"effects.rotation": False})
    assert not [key for key in parameters_under(one, only) if key.startswith("rotation.")]


def test_crushing_energy_grows_with_strength_as_measured_drills_did():
    """Of single craters it is 55 MJ/m^3 at the mean strength of granite and limestone."""
    assert energy_by_strength(164e6) == pytest.approx(55e6, rel=1e-12)
    ratio = energy_by_strength(200e6) / energy_by_strength(50e6)
    assert ratio == pytest.approx(209.0 / 119.0, rel=0.02)  # of the line of nine rocks


# ------------------------------------------------------------------- the command line


def explained(capsys, *words):
    """Scene that the command line makes, and what it says on stderr."""
    capsys.readouterr()
    assert percussion("new", "one.toml", "--force", *words) == 0
    return Scene.from_toml("one.toml"), " ".join(capsys.readouterr().err.split())


def test_bit_and_rock_on_the_command_line(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene, said = explained(capsys, "--bit", "dth-140", "--rock", "kuru-granite")
    assert bit_of(scene) == "dth-140"
    one = rock("kuru-granite").number(STIFFNESS).value
    assert scene[STIFFNESS] == pytest.approx(0.5 * 17 * one, rel=1e-12)
    assert scene[ENERGY] == 55e6
    assert "hint" not in said
    scene, said = explained(capsys, "--bit", "dth-140", "--rock", "kuru-granite:10")
    assert scene[STIFFNESS] == pytest.approx(0.5 * 10 * one, rel=1e-12)
    assert scene[COUNT] == 10
    assert "kuru-granite:10 takes a bit of 10 buttons in place of 17" in said
    _, said = explained(capsys, "--bit", "dth-140", "--rock", "kuru-granite:17")
    assert "hint" not in said


def test_without_a_bit_the_hint_at_its_buttons_stays(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene, said = explained(capsys, "--rock", "kuru-granite")
    assert scene[STIFFNESS] == rock("kuru-granite").number(STIFFNESS).value
    assert not scene["effects.breaking"]
    assert "its stiffness is that of 1 button" in said


def test_set_wins_over_bit_and_rock(capsys):
    words = ("--bit", "dth-140", "--rock", "kuru-granite", "--set", "rotation.speed=2")
    assert percussion("run", "rigid", *words, "--duration", "0.3", "--settle", "0") == 0
    capsys.readouterr()
    assert percussion("explain", "rigid", *words, "--json", "-") == 0
    told = json.loads(capsys.readouterr().out)
    assert {"breaking", "rotation"} <= set(told["effects_on"])


def test_the_list_names_all_and_a_name_tells_of_one(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert percussion("bits") == 0
    shown = capsys.readouterr().out
    assert all(re.search(rf"{name}\b", shown) for name in bits())
    assert all(len(line) <= 80 for line in shown.splitlines())
    assert percussion("bits", "dth-140", "--json", "-") == 0
    told = json.loads(capsys.readouterr().out)["dth-140"]
    assert told["parameters"] == bit("dth-140").parameters
    assert percussion("bits", "dth-140") == 0
    assert "17 (16 to 18), 8 of them on the gauge" in " ".join(capsys.readouterr().out.split())
    assert percussion("bits", "dth-14") == common.BAD_INPUT
    assert "did you mean dth-140?" in capsys.readouterr().err


def test_every_command_that_takes_a_rock_takes_a_bit():
    import typer

    from percussion_model.interface.cli import app

    found = []
    for name, command in typer.main.get_command(app).commands.items():
        options = {word for one in command.params for word in one.opts}
        if "--rock" in options:
            assert "--bit" in options, name
            found.append(name)
    assert len(found) > 5


# ------------------------------------------------------------------- contradictions

WHOLE = {"hole_diameter": 0.1, "breaking.buttons": 10, "rotation.mean_radius": 0.03}
CONTRADICTIONS = {
    "no hole": (
        {"effects.breaking": True, "breaking.buttons": 10},
        "effects.breaking = true needs hole_diameter",
    ),
    "no buttons": (
        {"effects.breaking": True, "hole_diameter": 0.1},
        "effects.breaking = true needs breaking.buttons",
    ),
    "no radius": ({"effects.rotation": True}, "effects.rotation = true needs rotation.mean_radius"),
    "cuttings": (
        {"effects.rotation": True, "rotation.old_line": True, "effects.cuttings": True, **WHOLE},
        "effects.rotation and effects.cuttings both say",
    ),
    "motor": (
        {
            "effects.rotation": True, "rotation.full_torque": 500.0,
            "rotation.stall_torque": 400.0, **WHOLE,
        },
        r"rotation.full_torque = 500.0 N m: must be at most rotation.stall_torque = 400.0 N m",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_a_contradiction_is_refused_with_its_cure(name):
    changes, told = CONTRADICTIONS[name]
    with pytest.raises(SceneError) as caught:
        Scene().replace(**changes)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)
    # rock that is not crushed takes no notice
    Scene().replace(**changes, **{"effects.rock": "wall", "effects.barrier": False})


def test_a_casing_under_the_feed_and_a_damper_exclude_each_other():
    string = hammer("t38", 1)
    with pytest.raises(SceneError, match=r'feed.on = "casing" and effects.damper = true'):
        string.replace(**{"feed.on": "casing", "effects.damper": True})
    string.replace(**{"feed.on": "casing", "effects.damper": False})
    string.replace(**{"feed.on": "casing", "effects.damper": True, "effects.feed": False})
