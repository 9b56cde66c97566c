"""What an image tells of its scene: contradictions, and which solver computes it.

As `Scene` does in words, in numbers.
"""

from __future__ import annotations

import numpy as np

from percussion_model.engine.fault_texts import FIRST_RULE, keys_in
from percussion_model.engine.image import fill_values, has_rods, new_values, numbers_at, own_numbers
from percussion_model.engine.memory import floats_at, hold
from percussion_model.engine.records import KINDS, Kind
from percussion_model.engine.scene_image import AT, Own
from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Piston
from percussion_model.scene.bars import bar_transit_time
from percussion_model.scene.contradictions import TEXTS, Bodies, Rule, find_contradiction
from percussion_model.scene.parameters import row_of
from percussion_model.scene.rock_law import is_wall
from percussion_model.scene.solver_choice import WhyWaves, why_waves
from percussion_model.scene.solver_names import BODIES
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.setup import PISTONS, Bit

Pair = tuple[tuple[int, int], tuple[int, int]]
NO_VALUE = (-1, 0)


def _facts() -> tuple[Pair, ...]:
    """Of each rule the two values in its text: words, -1 for none, and 1 for choices."""
    found: list[Pair] = [(NO_VALUE, NO_VALUE)] * (1 + len(TEXTS))
    for rule, text in TEXTS.items():
        one, two = NO_VALUE, NO_VALUE
        for key in reversed(keys_in(text)):
            one, two = (AT[key.replace(".", "_")], int(bool(row_of(key).choices))), one
        found[rule] = (one, two)
    return tuple(found)


FACTS = _facts()
BODIES_OF_SOLVERS = tuple(
    {"elastic": int(Bodies.ELASTIC), "rigid": int(Bodies.RIGID)}.get(BODIES.get(name) or "", 0)
    for name in row_of("solver.name").choices
)


@preparing
def _fact(values, word, is_choice):
    """A value as a fact: of a choice its place, counted from 1."""
    if word < 0:
        return 0.0
    if is_choice == 1:
        return values.view(np.int64)[word] + 1.0
    return values.view(np.float64)[word]


@preparing
def contradiction(values, has_rods, is_barrier_given, facts):
    """Number of the fault of parameters that contradict each other, 0 for none; fills the facts."""
    v = values[0]
    bodies = BODIES_OF_SOLVERS[v.solver_name]
    found = find_contradiction(v, bodies, has_rods, is_barrier_given)
    rule = found.value
    if rule == Rule.NOTHING.value:
        return 0
    (one, one_is), (two, two_is) = FACTS[rule]
    facts[0], facts[1] = _fact(values, one, one_is), _fact(values, two, two_is)
    return FIRST_RULE + rule - 1


# By the choices of `solver.fidelity` and `solver.name`: 0 for waves, which a name divides, for
# "auto" and for solvers that others added.
BY_FIDELITY = tuple(
    0 if name == "wave" else int(KINDS[name]) for name in row_of("solver.fidelity").choices
)
BY_NAME = tuple(int(KINDS.get(name, 0)) for name in row_of("solver.name").choices)
AUTO = row_of("solver.name").choices.index("auto")


@preparing
def kind_of(numbers):
    """`Kind` of the solver; 0 for one that this library does not have."""
    values = numbers.values
    is_elastic = values.bit_model == Bit.ELASTIC
    if is_elastic and BY_FIDELITY[values.solver_fidelity] > 0:
        return BY_FIDELITY[values.solver_fidelity]
    if values.solver_name != AUTO:
        return BY_NAME[values.solver_name]
    if values.effects_string:
        return Kind.WAVE.value
    if not is_elastic:
        return Kind.RIGID.value
    piston, bit = PISTONS[values.piston_model], bar_transit_time(numbers.bit)
    top = bar_transit_time(numbers.piston) if piston == Piston.ELASTIC else bit
    has_loss = values.effects_loss != 0
    why = why_waves(is_wall(values), has_loss, values.loss_time, top, bit)
    return Kind.MODAL.value if why == WhyWaves.NOT else Kind.WAVE.value


@preparing
def check(image, facts):
    """Number of the fault of a scene that contradicts itself, 0 for none; fills the facts."""
    values = new_values()
    fill_values(image, values)
    given = own_numbers(image)[Own.BARRIER_GIVEN] != 0.0
    found = contradiction(values, has_rods(image), given, floats_at(facts, 4))
    hold(values)
    return found


@preparing
def solver(image):
    """`Kind` of the solver of a scene; 0 for one that is not here."""
    values = new_values()
    fill_values(image, values)
    found = kind_of(numbers_at(image, values))
    hold(values)
    return found


# What hosts call: function, and its result and arguments as in `engine.entries`.
EXPORTED = {"scene_check": ("check", "w:ww"), "scene_solver": ("solver", "w:w")}
