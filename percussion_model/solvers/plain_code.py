"""Plain functions of scenes and their numbers that kernels call as well: each is written once.

Scenes are read without numba, which takes a second to load; here numba learns to compile
what it needs of them. Kernels that call such a function import it from its own module, and
this module beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from percussion_model.components import COMPONENTS, Component
from percussion_model.physics.feed import Throttled
from percussion_model.physics.kernel import composed, when_compiling
from percussion_model.scene import bars, contradictions, rock_law, solver_choice
from percussion_model.solvers import setup
from percussion_model.solvers.modal import resolution as modal_resolution
from percussion_model.solvers.rigid import restitution as rigid_restitution
from percussion_model.solvers.wave import resolution as wave_resolution

_FUNCTIONS = (
    bars.section_wave_speed,
    bars.section_impedance,
    bars.section_mass,
    bars.section_transit_time,
    bars.add,
    bars.bar_mass,
    bars.bar_length,
    bars.bar_transit_time,
    solver_choice.why_waves,
    rock_law.is_wall,
    rock_law.barrier_on,
    rock_law.rock_numbers,
    rock_law.rock_springs,
    rock_law.fill_cuttings,
    rock_law.fill_power,
    rock_law.fill_rock,
    contradictions.find_contradiction,
    contradictions._in_breaking,
    contradictions._in_string,
    contradictions._in_accuracy,
    setup.kelvin_voigt_time,
    setup.fill_loads,
    setup.fill_parameters,
    setup.fill_start,
    setup.elastic_piston,
    setup.elastic_times,
    modal_resolution.in_first_bar,
    modal_resolution.modes_by_rule,
    modal_resolution.asked_modes,
    modal_resolution.default_modes,
    modal_resolution.modes_for,
    modal_resolution.fill_coarser,
    modal_resolution.promised_error,
    rigid_restitution.st_venant_restitution,
    rigid_restitution.restitution,
    wave_resolution.steps_for,
    wave_resolution.coarser_steps,
    wave_resolution.fill_comparable,
    wave_resolution.error_by_steps,
)


def _rows(sections):
    return lambda sections: sections


@composed
def _nothing(record: Any, values: Any) -> None:
    pass


def _number(field: str, value: str) -> Callable:
    @composed
    def fill(record: Any, values: Any) -> None:
        record[field] = values[value]

    return fill


def _constant(field: str, value: float) -> Callable:
    @composed
    def fill(record: Any, values: Any) -> None:
        record[field] = value

    return fill


def _both(one: Callable, other: Callable) -> Callable:
    @composed
    def fill(record: Any, values: Any) -> None:
        one(record, values)
        other(record, values)

    return fill


def _all(fills: list[Callable]) -> Callable:
    """One kernel that calls all; by halves, since a compiler goes down into each call."""
    if len(fills) < 2:
        return fills[0] if fills else _nothing
    middle = len(fills) // 2
    return _both(_all(fills[:middle]), _all(fills[middle:]))


def _where(field: str, numbers: tuple[float, ...], fill: Callable) -> Callable:
    @composed
    def fill_where(record: Any, values: Any) -> None:
        if values[field] in numbers:
            fill(record, values)

    return fill_where


def _component(one: Component) -> Callable:
    present = f"with_{one.name}"
    pushes, moves = len(one.pushes) > 0, setup.follows_blows(one)
    steps, loads = pushes and one.lasts is None, one.loading is not None
    is_throttled, supply = one.is_throttled, Throttled.SUPPLY.value
    takes_feed = one.takes_feed
    numbers = _all([_number(name, name) for name in (f"{one.name}_{of}" for of in one.parameters)])

    @composed
    def fill(p: Any, values: Any) -> None:
        p[present] = 1
        if is_throttled:
            p["throttled"] = supply
        if takes_feed:
            p["feed_taken"] = 1
        if pushes:
            p["effects"] = 1
        if steps:
            p["steps"] = 1
        if moves:
            p["places"] = 1
        if loads:
            p["power"] = p["by_component"] = 1
        numbers(p, values)

    for field, found in setup.conditions_of(one).items():
        fill = _where(field, found, fill)
    return fill


def _parameters(p, values):
    fill = _all([_component(one) for one in COMPONENTS])
    return lambda p, values: fill(p, values)


def _states(s, values):
    fills = []
    for one in COMPONENTS:
        fills += [_number(name, name) for name in (f"{one.name}_{of}" for of in one.inputs)]
        for field, (_, _, start) in zip(one.fields, one.state.values(), strict=True):
            is_name = isinstance(start, str)
            fills.append(
                _number(field, f"{one.name}_{start}") if is_name else _constant(field, float(start))
            )
    fill = _all(fills)
    return lambda s, values: fill(s, values)


def _teach() -> None:
    from numba.extending import register_jitable

    from percussion_model.physics.compiling import replace

    for function in _FUNCTIONS:
        register_jitable(function)
    replace(bars._plain, _rows)
    replace(setup.fill_components, _parameters)
    replace(setup.start_components, _states)


when_compiling(_teach)
