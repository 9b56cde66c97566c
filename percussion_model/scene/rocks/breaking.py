"""What breaking and rotation need of a rock, and the stiffness of a bit on its own bottom.

Where no craters of a rock are known, its crushing energy follows that of two rocks by their
strength: the specific energy of percussion drilling in nine rocks grows as a + UCS, with
a = 149 MPa (Paone et al. 1969, second hand; docs/breaking.md).
"""

from __future__ import annotations

import math
from typing import Any

from percussion_model.scene.bits import MEASURED_THRESHOLD, THRESHOLD, bit, bit_of
from percussion_model.scene.rocks import (
    BUTTONS,
    LAW,
    MOST_BUTTONS,
    STIFFNESS,
    Number,
    Rock,
    rock,
    rocks,
)
from percussion_model.scene.scene import Scene

ENERGY = "breaking.crushing_energy"
RENEWAL, FRICTION, COUNT = "rotation.renewal_length", "rotation.friction", "breaking.buttons"

# A number is that of a rock if it differs by rounding alone.
SAME = 1e-9
# Of the line on which specific energy grows with strength [Pa].
_OFFSET = 149e6
# Crushing energy of single craters in two rocks [J/m^3], and the mean of their strengths [Pa].
_MEASURED, _LOW, _HIGH, _AT = 55e6, 46e6, 65e6, 164e6
# Interval of a crushing energy that follows from the strength, by its value.
ENERGY_SHARES = _LOW / _MEASURED, _HIGH / _MEASURED
# Where no strength is known.
_WIDE = (30e6, 90e6)
# A bit on the bottom that it has drilled touches with some of its buttons: stiffness by that of
# all buttons on flat rock.
CONTACT_SHARE = Number(
    "contact share",
    0.5,
    0.4,
    0.6,
    "computed",
    "bottom of a hole of 140 mm as a field of heights under 17 buttons: 11 to 13 of them touch",
)
EFFICIENCY = Number(
    "breaking.efficiency",
    0.64,
    0.4,
    0.8,
    "computed",
    "bottom of a hole of 140 mm under 17 buttons: 0.64 of isolated craters; less where worn",
)
# What a rock without own numbers has.
ASSUMED = (
    Number(
        THRESHOLD,
        MEASURED_THRESHOLD, 2.0, 10.0, "derived",
        "from craters of 7 J and 50 J on Kuru granite", second_hand=True,
    ),
    Number(
        RENEWAL, 2e-3, 1e-3, 6e-3, "computed",
        "bottom of a hole of 140 mm under 17 buttons, and makers' speeds of rotation",
    ),
    Number(
        FRICTION, 0.8, 0.4, 1.2, "derived",
        "torque of 0.41 to 0.68 of feed times diameter with a water hammer, less the climb",
        second_hand=True,
    ),
)  # fmt: skip


def energy_by_strength(strength: float) -> float:
    """Crushing energy of a volume of craters, by compressive strength [Pa] [J/m^3]."""
    return _MEASURED * (_OFFSET + strength) / (_OFFSET + _AT)


def breaking_numbers(rock: Rock) -> tuple[Number, ...]:
    """Numbers of a rock for breaking and rotation: its own, else derived or assumed."""
    own = {one.key: one for one in rock.breaking}
    return tuple(own.get(one.key, one) for one in (_energy(rock), *ASSUMED))


def _energy(rock: Rock) -> Number:
    if rock.strength is None:
        why = "no strength is known; as of granite and limestone, and twice as far to both sides"
        return Number(ENERGY, _MEASURED, *_WIDE, "assumed", why)
    low = energy_by_strength(rock.strength.low) * ENERGY_SHARES[0]
    high = energy_by_strength(rock.strength.high) * ENERGY_SHARES[1]
    why = "by the strength from craters in granite and limestone"
    value = energy_by_strength(rock.strength.value)
    return Number(ENERGY, value, low, high, "derived", why, rock.strength.second_hand)


def on_bottom(rock: Rock, buttons: int | None) -> Rock:
    """The rock under a bit of so many buttons on the bottom that it has drilled.

    Where the buttons behind the rock's numbers are not known, they are those of a whole bit.
    """
    if rock.buttons is None:
        return rock
    share = CONTACT_SHARE
    whole = rock if rock.asked else rock.of_buttons(buttons or rock.buttons)
    return whole.with_stiffness_times(share.value, share.low, share.high)


def numbers_under(rock: Rock, scene: Scene) -> tuple[Number, ...]:
    """Numbers of a rock that a scene takes, for the bit that it has."""
    if not scene["effects.breaking"]:
        return rock.numbers
    found = on_bottom(rock, rock.asked or scene["breaking.buttons"]).numbers
    kept = ("breaking.", "rotation.") if scene["effects.rotation"] else ("breaking.",)
    is_own = rock.asked in (None, scene["breaking.buttons"])
    name = bit_of(scene) if is_own else ""  # another number of buttons is another bit
    own = (_under_buttons(one, name) for one in breaking_numbers(rock))
    return (*found, *(one for one in own if one.key.startswith(kept)))


def _under_buttons(number: Number, name: str) -> Number:
    """A threshold under the buttons of a bit, where that has a name."""
    if number.key != THRESHOLD or not name:
        return number
    share = bit(name).threshold_share
    return number.times(share, share, share)


def parameters_under(rock: Rock, scene: Scene) -> dict[str, Any]:
    """Law and numbers of a rock by their dotted keys, for the bit that a scene has."""
    if not scene["effects.breaking"]:
        return rock.parameters
    buttons = rock.asked or scene["breaking.buttons"]
    found = on_bottom(rock, buttons).parameters if rock.buttons else rock.parameters
    found |= {one.key: one.value for one in numbers_under(rock, scene)}
    if BUTTONS in found:
        found[BUTTONS] = buttons
    return found | {COUNT: buttons}


def rock_of(scene: Scene, groups: tuple[str, ...] = ("rock.", "breaking.", "rotation.")) -> str:
    """Name of the rock whose law and numbers a scene has, as `read_rock` takes it; or empty.

    Parameters
    ----------
    groups : tuple of str
        Keys that have to be the rock's begin with one of these.
    """
    found = []
    for one in map(rock, rocks()):
        if scene[LAW] != one.law:
            continue
        count = _buttons_under(one, scene)
        if one.buttons is not None and not (count and 1 <= count <= MOST_BUTTONS):
            continue
        whole = one
        if count is not None and count != one.buttons and not scene["effects.breaking"]:
            whole = one.of_buttons(count)
        wanted = {**parameters_under(whole, scene), **dict.fromkeys((LAW, COUNT))}
        wanted = {key: value for key, value in wanted.items() if key.startswith(groups)}
        if all(_same(scene[key], value) for key, value in wanted.items() if value is not None):
            # the rock as it is before others with so many buttons
            found.append((whole.asked or 0, one.name if whole is one else f"{one.name}:{count}"))
    return min(found)[1] if found else ""


def _buttons_under(one: Rock, scene: Scene) -> int | None:
    """Buttons that a scene would have on a rock; None where the rock does not tell its own."""
    if one.buttons is None:
        return None
    if scene["effects.breaking"]:
        return int(scene[COUNT])
    if one.law == "power":
        return int(scene[BUTTONS])
    share = scene[STIFFNESS] / one.number(STIFFNESS).value
    return round(one.buttons * share)


def _same(value: float, other: float) -> bool:
    return math.isclose(value, other, rel_tol=SAME)
