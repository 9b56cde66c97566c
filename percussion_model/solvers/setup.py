"""From the numbers of a scene to the fields that the records of all solvers have in common."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any

import numpy as np

from percussion_model.components import COMPONENTS, Component
from percussion_model.physics.feed import Throttled
from percussion_model.physics.records import DRIVES, DriveKind, Mode, Piston
from percussion_model.scene.bars import bar_mass, bar_transit_time
from percussion_model.scene.contradictions import ON_CASING
from percussion_model.scene.numbers import Numbers
from percussion_model.scene.parameters import row_of
from percussion_model.scene.rock_law import fill_rock, rock_numbers

# An open gap of this many transits of the slower bar ends a blow where no
# pressure law does (docs/model.md, section 7).
REARM_TRANSITS = 20.0
# Changes of mode that the rock law can make within one step or at one instant: FF, SS, FF,
# DFC, FC, BC and again; more would be a loop.
MOST_CHANGES = 12

# Cells or elements of all bars; a hundred times what any result here needed.
MOST_CELLS = 1_000_000

# What the choices of the parameter table mean, in their order.
PISTONS = (Piston.ELASTIC, Piston.RIGID, Piston.ABSENT)
DIRECTIONS = (1, -1)


class Bit(IntEnum):
    """How the bit is modelled: choices of `bit.model`."""

    ELASTIC = 0
    RIGID = 1


class StandstillTension(IntEnum):
    """What ends standstill: choices of `effects.standstill_tension`."""

    RELEASE = 0
    PAPER = 1


def kelvin_voigt_time(numbers: Numbers) -> float:
    """Kelvin-Voigt time of elastic bars, 0 without loss [s]."""
    return float(numbers.values.loss_time) if numbers.values.effects_loss else 0.0


def elastic_piston(numbers: Numbers) -> np.ndarray:
    """Sections of an elastic piston, none of another."""
    if PISTONS[numbers.values.piston_model] == Piston.ELASTIC:
        return numbers.piston
    return numbers.piston[:0]


def elastic_times(numbers: Numbers) -> tuple[float, float]:
    """Transit times of the first elastic bar, whose modes are counted, and of the shortest [s].

    Parameters
    ----------
    numbers : Numbers
        Of a scene with an elastic bit.
    """
    bit = bar_transit_time(numbers.bit)
    if PISTONS[numbers.values.piston_model] != Piston.ELASTIC:
        return bit, bit
    piston = bar_transit_time(numbers.piston)
    return piston, min(piston, bit)


def fill_parameters(p: Any, numbers: Numbers, with_piston: bool) -> None:
    """Fill `COMMON_PARAMETERS`.

    Parameters
    ----------
    p : record
        Changed in place.
    numbers : Numbers
    with_piston : bool
        Whether waves go through the piston too, or would if it were not rigid.
    """
    values = numbers.values
    slowest = bar_transit_time(numbers.bit)
    if with_piston:
        slowest = max(slowest, bar_transit_time(numbers.piston))
    p["rearm_time"] = REARM_TRANSITS * slowest
    p["gravity"] = values.gravity_acceleration if values.effects_gravity else 0.0
    p["mass_b"] = bar_mass(numbers.bit)
    p["mass_p"] = bar_mass(numbers.piston)
    p["piston"] = PISTONS[values.piston_model]
    p["drive"] = DRIVES[values.effects_drive]
    p["throttled"] = Throttled.FORCE if p["drive"] == DriveKind.PRESSURE else Throttled.NOTHING
    fill_rock(p, numbers)
    fill_loads(p, values)
    p["release"] = values.effects_standstill_tension == StandstillTension.RELEASE
    fill_components(p, values)


def fill_loads(p: Any, values: Any) -> None:
    """Fill where the feed acts, and the area of the hole."""
    p["on_casing"] = values.effects_feed != 0 and values.feed_on == ON_CASING
    p["casing_weight"] = values.feed_casing_mass * p["gravity"]
    p["hole_area"] = 0.0
    if values.hole_diameter > 0.0:
        p["hole_area"] = 0.25 * math.pi * values.hole_diameter * values.hole_diameter


def follows_blows(one: Component) -> bool:
    """Whether a component needs to know of drilling cycles and blows."""
    kernels = (one.gained, one.end_loading, one.kept, one.next_blow)
    return any(kernel is not None for kernel in kernels)


def conditions_of(one: Component) -> dict[str, tuple[float, ...]]:
    """Fields of a scene's numbers that turn a component on, and their numbers then."""
    key, value = one.switch
    return {
        need.replace(".", "_"): tuple(_number_of(need, value) for value in values)
        for need, values in {key: (value,), **one.needs}.items()
    }


def _number_of(key: str, value: Any) -> float:
    choices = row_of(key).choices
    return choices.index(value) if choices else value


def fill_components(p: Any, values: Any) -> None:
    """Fill the parameters of the components that are on."""
    for one in COMPONENTS:
        if all(getattr(values, field) in found for field, found in conditions_of(one).items()):
            p[f"with_{one.name}"] = 1
            if one.is_throttled:
                p["throttled"] = Throttled.SUPPLY
            if one.takes_feed:
                p["feed_taken"] = 1
            if one.pushes:
                p["effects"] = 1
                if one.lasts is None:
                    p["steps"] = 1
            if follows_blows(one):
                p["places"] = 1
            if one.loading is not None:
                p["power"] = p["by_component"] = 1
            for name in one.parameters:
                p[f"{one.name}_{name}"] = getattr(values, f"{one.name}_{name}")


def start_components(s: Any, values: Any) -> None:
    """Fill the states of components at time zero, whether they are on or not."""
    for one in COMPONENTS:
        for name in one.inputs:
            s[f"{one.name}_{name}"] = getattr(values, f"{one.name}_{name}")
        for field, (_, _, start) in one.state.items():
            is_name = isinstance(start, str)
            value = getattr(values, f"{one.name}_{start}") if is_name else start
            s[f"{one.name}_{field}"] = value


def fill_start(s: Any, numbers: Numbers) -> None:
    """Fill what states have in common (`COMMON_STATE`) at time zero.

    Parameters
    ----------
    s : record
        Changed in place.
    numbers : Numbers
    """
    values, rock = numbers.values, rock_numbers(numbers)
    has_piston = PISTONS[values.piston_model] != Piston.ABSENT
    direction = DIRECTIONS[values.start_drive_direction]
    s["live"] = 1
    s["mode"] = Mode.FF
    s["alpha"] = direction
    kind = DRIVES[values.effects_drive]
    s["armed"] = kind != DriveKind.COMPONENT and (kind != DriveKind.PRESSURE or direction > 0)
    s["feed"] = values.feed_force if values.effects_feed else 0.0
    s["drive_force"] = values.drive_force
    s["reversal"] = values.drive_reversal_distance
    s["external"] = values.drive_external_force
    s["k_r"] = rock.k_r
    # of one button
    s["next_k_r"] = values.rock_loading_stiffness if rock.k_r > 0.0 else 0.0
    s["gamma"] = s["next_gamma"] = rock.gamma
    s["c_r"] = s["next_c_r"] = rock.c_r
    s["w_r"] = s["next_w_r"] = rock.w_r
    s["p"] = -values.start_rock_gap
    s["x_r"] = s["hole_start"] = values.start_rock_gap
    s["v_b"] = values.start_bit_velocity
    s["v_p"] = values.start_piston_velocity if has_piston else 0.0
    s["gap"] = values.start_gap if has_piston else math.inf
    s["t_open"] = -math.inf
    s["peak_from"] = math.inf
    s["b_rebound"] = s["b_standstill"] = math.nan
    s["b_barrier"] = s["b_counting"] = s["b_closing"] = math.nan
    start_components(s, values)
