"""What the shell calls of a part of the drilling system, as `entries` has it of the hammer.

The image of a part is three zeros, where that of a hammer counts its bars; the number of the
part; its parameters; its inputs. A motion is a head, a copy of the parameters, numbers made of
them, and what moves: the record of the state and the numbers that belong to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fmu_src.native.rows import set_fault
from fmu_src.parts.compiled import COMPILED
from fmu_src.parts.part import PartTable, Room, record_of, record_of_outputs
from percussion_model.engine.layout import copy_words
from percussion_model.engine.memory import allocate, floats_at, lines, records_at, words_at
from percussion_model.physics.kernel import preparing
from percussion_model.solvers.state import first_beyond, is_bounded

# Word of the image with the number of the part; its parameters follow.
NUMBER_AT = 3
# Words of the head of a motion, which the shell reads (fmu_src/native/shell.h), and after them
# the part's number and how many numbers were made.
BYTES, STATE_BEGIN, STATE_BYTES, SHARED_BEGIN, PART, MADE, HEAD = 0, 1, 2, 4, 9, 10, 16
# Flag of a reading: nothing but to make ready what moves; as in shell.h.
TO_SAVE = 4
# Faults that all parts have; those of a law follow.
MEMORY, FIELD, MOVING, OWN = 1, 2, 3, 3
FACTS = 4


@preparing
def _nothing(p):
    """No numbers."""
    return 0


@preparing
def _never(*arguments):
    """No fault."""
    return 0


@preparing
def _leave(p, made):
    """Nothing is made of the parameters."""


@preparing
def _refused(number, facts, notes):
    """Number of the fault for one of a law, with its facts; 0 stays 0."""
    return set_fault(notes, OWN + number, facts) if number > 0 else 0


def _entries_of(part: PartTable) -> tuple[Any, ...]:
    """The five functions of a part."""
    law = part.law
    assert law is not None
    count_made, count_moving = law.made or _nothing, law.moving or _nothing
    check_law, make, state_fault = (
        law.check or _never,
        law.make or _leave,
        law.state_fault or _never,
    )
    begin_law, step_law, fill_outputs = law.begin, law.step, law.outputs
    kinds = record_of(part.parameters), record_of(part.inputs), law.record
    parameters_at, inputs_at, states_at = map(records_at, kinds)
    outputs_at = records_at(record_of_outputs(part.outputs))
    of_parameters, of_state = kinds[0].itemsize, kinds[2].itemsize
    p_at, u_at = 8 * (NUMBER_AT + 1), 8 * (NUMBER_AT + 1) + of_parameters
    _, lows, highs, wholes = zip(*law.words, strict=True)
    low, high, whole = np.array(lows, float), np.array(highs, float), np.array(wholes)
    undefined = np.zeros(len(low), bool)

    @preparing
    def room(motion, moving, facts):
        """Numbers of a motion beside its records."""
        count = words_at(motion, HEAD)
        made = floats_at(motion + 8 * HEAD + of_parameters, count[MADE])
        rest = (count[STATE_BYTES] - of_state) // 8
        return Room(made, floats_at(moving + of_state, rest), facts)

    @preparing
    def check(image, notes):
        facts = np.zeros(FACTS)
        return _refused(check_law(parameters_at(image + p_at, 1)[0], facts), facts, notes)

    @preparing
    def create(image, motion, notes):
        facts, p = np.zeros(FACTS), parameters_at(image + p_at, 1)[0]
        made = count_made(p)
        at = lines(8 * HEAD + of_parameters + 8 * made)
        moving = of_state + 8 * count_moving(p)
        base = allocate(at + moving)
        if base == 0:
            return set_fault(notes, MEMORY, facts)
        words_at(motion, 1)[0] = base
        head = words_at(base, HEAD)
        head[BYTES] = head[SHARED_BEGIN] = at + moving
        head[STATE_BEGIN], head[STATE_BYTES] = at, moving
        head[PART], head[MADE] = words_at(image, NUMBER_AT + 1)[NUMBER_AT], made
        copy_words(image + p_at, base + 8 * HEAD, of_parameters // 8)
        w = room(base, base + at, facts)
        make(p, w.made)
        begin_law(p, inputs_at(image + u_at, 1)[0], states_at(base + at, 1)[0], w)
        return 0

    @preparing
    def take_step(motion, image, h, notes):
        facts, at = np.zeros(FACTS), motion + words_at(motion, HEAD)[STATE_BEGIN]
        p, u = parameters_at(motion + 8 * HEAD, 1)[0], inputs_at(image + u_at, 1)[0]
        number = step_law(p, u, states_at(at, 1)[0], room(motion, at, facts), h)
        return _refused(number, facts, notes)

    @preparing
    def read(motion, outputs):
        at = motion + words_at(motion, HEAD)[STATE_BEGIN]
        p, w = parameters_at(motion + 8 * HEAD, 1)[0], room(motion, at, np.zeros(FACTS))
        fill_outputs(p, states_at(at, 1)[0], w, outputs_at(outputs, 1)[0])
        return 0

    @preparing
    def find_fault(motion, state, notes):
        facts, words = np.zeros(FACTS), words_at(state, of_state // 8)
        k = first_beyond(words, words.view(np.float64), low, high, undefined, whole)
        if k >= 0:
            facts[0], facts[2], facts[3] = k + 1.0, low[k], high[k]
            facts[1] = float(words[k]) if whole[k] else words.view(np.float64)[k]
            return set_fault(notes, FIELD, facts)
        w = room(motion, state, facts)
        if not is_bounded(w.moving):
            return set_fault(notes, MOVING, facts)
        p = parameters_at(motion + 8 * HEAD, 1)[0]
        return _refused(state_fault(p, states_at(state, 1)[0], w), facts, notes)

    return check, create, take_step, read, find_fault


def _chosen(functions: Sequence[Any], first: int = 0) -> Any:
    """Kernel that calls the function of a part's number with what follows the number."""
    mine = functions[0]
    if len(functions) == 1:

        @preparing
        def last(number, *arguments):
            return mine(*arguments)

        return last
    others = _chosen(functions[1:], first + 1)

    @preparing
    def choose(number, *arguments):
        if number == first:
            return mine(*arguments)
        return others(number, *arguments)

    return choose


_check, _create, _take_step, _read, _find_fault = map(
    _chosen, zip(*(_entries_of(part) for part in COMPILED), strict=True)
)


@preparing
def check(image, notes):
    """Refuse parameters that do not go together."""
    return _check(words_at(image, NUMBER_AT + 1)[NUMBER_AT], image, notes)


@preparing
def create(image, motion, notes):
    """Make the memory of a motion at time zero; its address goes to the address `motion`."""
    number = words_at(image, NUMBER_AT + 1)[NUMBER_AT]
    fault = _check(number, image, notes)
    return fault if fault != 0 else _create(number, image, motion, notes)


@preparing
def take_step(motion, image, flags, t, size, reached, notes):
    """Advance by a communication step, which ends at `t`."""
    there = floats_at(reached, 2)
    there[0], there[1] = t, 0.0
    return _take_step(words_at(motion, HEAD)[PART], motion, image, size, notes)


@preparing
def read_outputs(motion, flags, outputs):
    """Fill the outputs."""
    return 0 if flags & TO_SAVE else _read(words_at(motion, HEAD)[PART], motion, outputs)


@preparing
def find_fault(motion, state, t, notes):
    """Refuse a state from outside that kernels cannot go on from."""
    return _find_fault(words_at(motion, HEAD)[PART], motion, state, notes)


# What the shell calls, as in `fmu_src.native.entries`.
EXPORTED = {
    "kernel_check": ("check", "w:ww"),
    "kernel_create": ("create", "w:www"),
    "kernel_step": ("take_step", "w:wwwnnww"),
    "kernel_read": ("read_outputs", "w:www"),
    "kernel_fault": ("find_fault", "w:wwnw"),
}
