"""The rock law of a scene in numbers, as kernels take them."""

from __future__ import annotations

from typing import Any, NamedTuple

from percussion_model.physics.records import Cuttings, RockKind
from percussion_model.scene.numbers import Numbers

# What the choices of the parameter table mean, in their order.
ROCKS = (
    RockKind.BILINEAR, RockKind.SPRING, RockKind.WALL, RockKind.NONE, RockKind.BILINEAR,
)  # fmt: skip
BY_CYCLE = 1  # the choice of `rock.removed_by`
POWER = 4  # the choice of the power law, which has the modes of the bilinear one


class RockNumbers(NamedTuple):
    """Rock law as the kernels take it: K_R of all buttons [N/m], gamma, C_R [N s/m], W_R [J]."""

    k_r: float
    gamma: float
    c_r: float
    w_r: float


def is_wall(values: Any) -> bool:
    """Whether the rock is a wall, which does not yield."""
    return bool(ROCKS[values.effects_rock] == RockKind.WALL)


def barrier_on(numbers: Numbers) -> bool:
    """Whether the rock law has an energy barrier (mode DFC)."""
    values = numbers.values
    if not values.effects_barrier or ROCKS[values.effects_rock] != RockKind.BILINEAR:
        return False
    return bool(values.rock_barrier_energy > 0.0 and values.rock_barrier_damping > 0.0)


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


def rock_springs(numbers: Numbers) -> tuple[float, float]:
    """Stiffnesses on which the rock is loaded and unloaded, 0 where it has none [N/m]."""
    kind, rock = ROCKS[numbers.values.effects_rock], rock_numbers(numbers)
    if kind == RockKind.WALL:
        return 0.0, 0.0
    return rock.k_r, rock.gamma * rock.k_r if kind == RockKind.BILINEAR else 0.0


def fill_rock(p: Any, numbers: Numbers) -> None:
    """Fill the parameters of the rock that `COMMON_PARAMETERS` has."""
    p["rock"] = ROCKS[numbers.values.effects_rock]
    p["barrier"] = barrier_on(numbers)
    p["threshold"] = numbers.values.rock_barrier_threshold
    fill_power(p, numbers.values)


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
    """Fill the parameters of what stays in the crater: with it loading has two lines."""
    share, exponent = values.rock_removed_share, values.rock_removal_exponent
    stay = share < 1.0 or exponent != 1.0
    is_crushed = ROCKS[values.effects_rock] == RockKind.BILINEAR
    p["cuttings"] = Cuttings.NONE
    if is_crushed and values.effects_cuttings != 0 and stay:
        p["cuttings"] = (
            Cuttings.BY_CYCLE if values.rock_removed_by == BY_CYCLE else Cuttings.BY_BLOW
        )
    met_again = values.effects_rotation != 0 and values.rotation_old_line != 0
    if is_crushed and met_again and values.rotation_renewal_length > 0.0:
        p["cuttings"] = Cuttings.INDEXED
    p["removed_share"], p["removal_exponent"] = share, exponent
    p["left"] = p["cuttings"] > Cuttings.BY_CYCLE
    if p["left"]:
        p["places"] = 1
    if p["cuttings"] != Cuttings.NONE:
        p["power"] = 1
