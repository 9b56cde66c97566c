"""Plain functions of scenes and their numbers that kernels call as well: each is written once.

Scenes are read without numba, which takes a second to load; here numba learns to compile
what it needs of them. Kernels that call such a function import it from its own module, and
this module beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from percussion_model.components import COMPONENTS, Component
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
    rigid_restitution.st_venant_restitution,
    rigid_restitution.restitution,
    wave_resolution.steps_for,
)


def _rows(sections):
    return lambda sections: sections


@composed
def _nothing(record: Any, values: Any) -> None:
    pass


def _and_number(before: Callable, field: str, value: str) -> Callable:
    @composed
    def fill(record: Any, values: Any) -> None:
        before(record, values)
        record[field] = values[value]

    return fill


def _and_constant(before: Callable, field: str, value: float) -> Callable:
    @composed
    def fill(record: Any, values: Any) -> None:
        before(record, values)
        record[field] = value

    return fill


def _and_component(before: Callable, one: Component, numbers: Callable) -> Callable:
    switch, present = f"effects_{one.name}", f"with_{one.name}"
    pushes, moves = one.force is not None, setup.follows_blows(one)

    @composed
    def fill(p: Any, values: Any) -> None:
        before(p, values)
        if values[switch]:
            p[present] = 1
            if pushes:
                p["effects"] = 1
            if moves:
                p["places"] = 1
            numbers(p, values)

    return fill


def _parameters(p, values):
    fill = _nothing
    for one in COMPONENTS:
        numbers = _nothing
        for name in one.parameters:
            numbers = _and_number(numbers, f"{one.name}_{name}", f"{one.name}_{name}")
        fill = _and_component(fill, one, numbers)
    return lambda p, values: fill(p, values)


def _states(s, values):
    fill = _nothing
    for one in COMPONENTS:
        for name in one.inputs:
            fill = _and_number(fill, f"{one.name}_{name}", f"{one.name}_{name}")
        for field, (_, _, start) in zip(one.fields, one.state.values(), strict=True):
            if isinstance(start, str):
                fill = _and_number(fill, field, f"{one.name}_{start}")
            else:
                fill = _and_constant(fill, field, float(start))
    return lambda s, values: fill(s, values)


def _teach() -> None:
    from numba.extending import overload, register_jitable

    for function in _FUNCTIONS:
        register_jitable(function)
    overload(bars._plain)(_rows)
    overload(setup.fill_components)(_parameters)
    overload(setup.start_components)(_states)


when_compiling(_teach)
