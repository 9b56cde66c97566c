"""From the numbers of a scene to the fields that the records of all solvers have in common."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from percussion_model.components import COMPONENTS
from percussion_model.physics.records import DRIVES, TURNS, Mode, Piston, RockKind
from percussion_model.scene.bars import bar_mass, bar_transit_time
from percussion_model.scene.numbers import Numbers
from percussion_model.scene.rows import SceneError

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
ROCKS = (
    RockKind.BILINEAR, RockKind.SPRING, RockKind.WALL, RockKind.NONE, RockKind.BILINEAR,
)  # fmt: skip
POWER = 4  # the choice of the power law, which has the modes of the bilinear one
DIRECTIONS = (1, -1)


class Bit(IntEnum):
    """How the bit is modelled: choices of `bit.model`."""

    ELASTIC = 0
    RIGID = 1


class StandstillTension(IntEnum):
    """What ends standstill: choices of `effects.standstill_tension`."""

    RELEASE = 0
    PAPER = 1


class RockNumbers(NamedTuple):
    """Rock law as the kernels take it: K_R of all buttons [N/m], gamma, C_R [N s/m], W_R [J]."""

    k_r: float
    gamma: float
    c_r: float
    w_r: float


def refuse_many(name: str, count: float, most: int = MOST_CELLS, instead: str = "") -> None:
    """Raise `SceneError` for more cells, elements or modes than can be set up."""
    if not count <= most:
        raise SceneError(
            f"the bars would have {count:.3g} {name}, more than {most}: ask for fewer, or "
            f"make the bars more alike in length{instead}"
        )


def barrier_on(numbers: Numbers) -> bool:
    """Whether the rock law has an energy barrier (mode DFC)."""
    values = numbers.values
    if not values.effects_barrier or ROCKS[values.effects_rock] != RockKind.BILINEAR:
        return False
    return bool(values.rock_barrier_energy > 0.0 and values.rock_barrier_damping > 0.0)


def kelvin_voigt_time(numbers: Numbers) -> float:
    """Kelvin-Voigt time of elastic bars, 0 without loss [s]."""
    return float(numbers.values.loss_time) if numbers.values.effects_loss else 0.0


def rock_numbers(numbers: Numbers) -> RockNumbers:
    """Numbers of the rock law."""
    values, barrier = numbers.values, barrier_on(numbers)
    kind = ROCKS[values.effects_rock]
    buttons = values.rock_buttons if values.effects_rock == POWER else 1.0
    return RockNumbers(
        buttons * values.rock_loading_stiffness if kind != RockKind.NONE else 0.0,
        values.rock_unloading_ratio if kind == RockKind.BILINEAR else 1.0,
        values.rock_barrier_damping if barrier else 0.0,
        values.rock_barrier_energy if barrier else 0.0,
    )


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
    p["rock"] = ROCKS[values.effects_rock]
    p["barrier"] = barrier_on(numbers)
    p["threshold"] = values.rock_barrier_threshold
    fill_power(p, values)
    p["release"] = values.effects_standstill_tension == StandstillTension.RELEASE
    fill_components(p, values)


def fill_power(p: Any, values: Any) -> None:
    """Fill the parameters of the power law; with plain exponents it is the bilinear one."""
    p["exponent"], p["unloading_exponent"], p["reference_penetration"] = 1.0, 0.0, 1e-3
    p["buttons"], p["chipping_force"], p["chipping_penetration"] = 1.0, 0.0, 0.0
    if values.effects_rock == POWER:
        p["exponent"] = values.rock_loading_exponent
        p["unloading_exponent"] = values.rock_unloading_exponent
        p["reference_penetration"] = values.rock_reference_penetration
        p["buttons"] = values.rock_buttons
        p["chipping_force"] = values.rock_buttons * values.rock_chipping_force
        p["chipping_penetration"] = values.rock_chipping_penetration
    curved = p["exponent"] != 1.0 or p["unloading_exponent"] != 0.0
    p["power"] = curved or p["chipping_penetration"] > 0.0
    fill_cuttings(p, values)


def fill_cuttings(p: Any, values: Any) -> None:
    """Fill the parameters of cuttings that stay in the crater: with them loading has two lines."""
    share, exponent = values.rock_removed_share, values.rock_removal_exponent
    stay = share < 1.0 or exponent != 1.0
    is_crushed = ROCKS[values.effects_rock] == RockKind.BILINEAR
    p["cuttings"] = is_crushed and values.effects_cuttings != 0 and stay
    p["removed_share"], p["removal_exponent"] = share, exponent
    if p["cuttings"]:
        p["power"] = 1


def fill_components(p: Any, values: Any) -> None:
    """Fill the parameters of the components that are on."""
    for one in COMPONENTS:
        if getattr(values, f"effects_{one.name}"):
            p["effects"] = p[f"with_{one.name}"] = 1
            for name in one.parameters:
                p[f"{one.name}_{name}"] = getattr(values, f"{one.name}_{name}")


def start_components(s: Any, values: Any) -> None:
    """Fill the states of components at time zero, whether they are on or not."""
    for one in COMPONENTS:
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
    s["armed"] = not TURNS[values.effects_drive] or direction > 0
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
