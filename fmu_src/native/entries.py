"""What the shell calls: checks, makes, steps, reads and restores motions of the hammer.

Arguments are addresses and numbers; results are 0 or the number of a fault (`Fault`). No
function keeps anything outside the memory that it is given.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fmu_src.native import kinds
from fmu_src.native.messages import Note
from fmu_src.native.motion import (
    COUNT,
    NEW_INPUTS,
    begin_step,
    set_inputs,
    step,
)
from fmu_src.native.notes import look
from fmu_src.native.outputs import OUTPUT_COUNT, fill_outputs
from fmu_src.native.rows import add_note, set_fault
from percussion_model.engine.faults import Fault
from percussion_model.engine.image import (
    fill_values,
    gauge_sections,
    has_rods,
    numbers_at,
    own_numbers,
)
from percussion_model.engine.layout import blow_records, head_records, motion_of, motion_records
from percussion_model.engine.memory import floats_at, hold, words_at
from percussion_model.engine.records import MOTION_BYTES, GaugeBar, Kind, Left
from percussion_model.engine.scene_checks import contradiction, kind_of
from percussion_model.engine.scene_image import AT, Own
from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import BLOW, DRIVES, DriveKind, Piston, Status
from percussion_model.physics.state import LARGEST, MOST
from percussion_model.scene.bars import bar_length, bar_mass
from percussion_model.scene.inputs import INPUTS
from percussion_model.scene.parameters import row_of
from percussion_model.scene.rock_law import POWER, ROCKS, barrier_on, rock_numbers
from percussion_model.scene.values import SCENE_NUMBERS
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.base import MOST_AHEAD
from percussion_model.solvers.fem.records import FEM_STATE
from percussion_model.solvers.modal.records import MODAL_STATE
from percussion_model.solvers.rigid.records import RIGID_STATE
from percussion_model.solvers.setup import PISTONS
from percussion_model.solvers.state import is_bounded, words_of
from percussion_model.solvers.wave.records import WAVE_STATE

# Word of each input in the record of `SCENE_NUMBERS`, and in that of a solver's state.
INPUT_WORDS = tuple(AT[one.key.replace(".", "_")] for one in INPUTS.values())
FIELDS = tuple(one.field for one in INPUTS.values())
STIFFNESS = list(INPUTS).index("loading_stiffness")
BARRIER = tuple(name.startswith("barrier") for name in INPUTS)


def _needs() -> tuple[tuple[int, int, int], ...]:
    """Of each input what must hold: its number, word of a choice, bits of what it may be."""
    found = []
    for k, one in enumerate(INPUTS.values()):
        for key, allowed in row_of(one.key).needs.items():
            choices = row_of(key).choices or (False, True)
            bits = sum(1 << choices.index(value) for value in allowed)
            found.append((k, AT[key.replace(".", "_")], bits))
    return tuple(found)


NEEDS = _needs()
BLOW_COUNTS = tuple(k for k, name in enumerate(BLOW.names or ()) if BLOW[name].kind == "i")
BLOW_NUMBERS = tuple(k for k in range(len(BLOW.names or ())) if k not in BLOW_COUNTS)
MOST_BLOWS = 2**31 - 1  # an output is a whole number of FMI
# The host's times come from sums and products of its own; a share of the time.
CLOCK_ROUNDING = 1e-12
# Records of the solvers by `Kind`, of which the first is none.
RECORDS = {
    Kind.MODAL: MODAL_STATE, Kind.WAVE: WAVE_STATE, Kind.FEM: FEM_STATE,
    Kind.RIGID: RIGID_STATE,
}  # fmt: skip


def _words(fields: Sequence[str]) -> tuple[tuple[int, ...], ...]:
    """Words of fields in the record of each solver, -1 where it has none."""
    found = [words_of(RECORDS[kind]) for kind in Kind]
    none = (-1,) * len(fields)
    return (none, *(tuple(words.get(field, -1) for field in fields) for words in found))


INPUTS_AT = _words(FIELDS)
PEAKS_AT = _words(("peak_from", "peak_bit_force", "peak_contact_force"))
GUARDS_AT = _words(("count_locked", "count_storms", "inputs_changed"))


@preparing
def _wanted(values):
    """Inputs as a solver takes them."""
    words, wanted = values.view(np.float64), np.zeros(COUNT)
    for k in range(COUNT):
        wanted[k] = words[INPUT_WORDS[k]]
    return wanted


@preparing
def _fill_acts(head, numbers, values):
    """Enter which inputs have an effect."""
    words = values.view(np.int64)
    head.acts[:] = 1
    for k, word, bits in NEEDS:
        if bits & (1 << words[word]) == 0:
            head.acts[k] = 0
    if not barrier_on(numbers):
        for k in range(COUNT):
            if BARRIER[k]:
                head.acts[k] = 0


@preparing
def _fill_bend(head, values):
    """What the note about buttons needs of the power law."""
    head.buttons, head.exponent, head.reference_penetration = 1.0, 1.0, 1.0
    if values.effects_rock == POWER:
        head.buttons, head.exponent = values.rock_buttons, values.rock_loading_exponent
        head.reference_penetration = values.rock_reference_penetration


@preparing
def _fill_barrier(head, numbers):
    """Enter shares of the barrier: of a drilling cycle's time and of a blow's energy (eq. 30)."""
    values = numbers.values
    energy = values.drive_force * values.drive_reversal_distance
    turns = DRIVES[values.effects_drive] == DriveKind.PRESSURE
    if not (turns and energy > 0.0 and barrier_on(numbers)):
        return
    share = values.rock_barrier_energy / energy
    took = share * bar_mass(numbers.piston) / values.rock_barrier_damping
    cycle = math.sqrt(bar_mass(numbers.bit) / rock_numbers(numbers).k_r)
    head.time_share, head.energy_share = took / cycle, share


@preparing
def check(image, notes):
    """Refuse parameters that go together with none other, or with none of this library."""
    values = np.zeros(1, SCENE_NUMBERS)
    fill_values(image, values)
    fault = _check_values(image, values, notes)
    hold(values)
    return fault


@preparing
def _check_values(image, values, notes):
    numbers = numbers_at(image, values)
    given = own_numbers(image)[Own.BARRIER_GIVEN] != 0.0
    facts = np.zeros(4)
    fault = contradiction(values, has_rods(image), given, facts)
    if fault > 0:
        return set_fault(notes, fault, facts)
    if kind_of(numbers) == 0:
        return set_fault(notes, Fault.SOLVER.value, facts)
    fault = kinds.refuse(kind_of(numbers), image, facts.ctypes.data)
    if fault > 0:
        return set_fault(notes, fault, facts)
    own = own_numbers(image)
    length = bar_length(gauge_sections(numbers, int(own[Own.GAUGE_BAR])))
    if own[Own.GAUGE_PLACE] > length:
        facts[0], facts[1], facts[2] = own[Own.GAUGE_PLACE], length, own[Own.GAUGE_BAR]
        return set_fault(notes, Fault.GAUGE.value, facts)
    return 0


@preparing
def create(image, motion, notes):
    """Make the memory of a motion at time zero; its address goes to the address `motion`."""
    fault = check(image, notes)
    if fault != 0:
        return fault
    values = np.zeros(1, SCENE_NUMBERS)
    fill_values(image, values)
    numbers = numbers_at(image, values)
    own = own_numbers(image)
    bar, place = int(own[Own.GAUGE_BAR]), own[Own.GAUGE_PLACE]
    if place < 0.0:
        place = 0.5 * bar_length(gauge_sections(numbers, bar))
    if bar == GaugeBar.PISTON and PISTONS[numbers.values.piston_model] != Piston.ELASTIC:
        bar = GaugeBar.NONE.value
    if bar - GaugeBar.ROD >= len(numbers.rod_counts):
        bar = GaugeBar.NONE.value
    kind, facts = kind_of(numbers), np.zeros(4)
    if kind == Kind.RIGID:
        bar = GaugeBar.NONE.value
    base = kinds.create(kind, image, bar, place)
    if base == 0:
        return set_fault(notes, Fault.MEMORY.value, facts)
    head = head_records(base, 1)[0]
    for k in range(COUNT):
        head.inputs_at[k] = INPUTS_AT[kind][k]
    head.peak_from_at, head.peak_bit_at, head.peak_contact_at = PEAKS_AT[kind]
    head.locked_at, head.storms_at, head.changed_at = GUARDS_AT[kind]
    head.rock = ROCKS[numbers.values.effects_rock]
    _fill_bend(head, numbers.values)
    _fill_acts(head, numbers, values)
    _fill_barrier(head, numbers)
    motion_of(base).acting[:] = _wanted(values)
    words_at(motion, 1)[0] = base
    hold(values)
    return 0


@preparing
def _end(base, status, notes):
    """Fault of a solver that could not go on; 0 for none."""
    if status == Status.DONE or status == Status.BLOWS_FULL:
        return 0
    head, facts = head_records(base, 1)[0], np.zeros(4)
    number = Fault.STOPPED.value
    if status == Status.NOT_FINITE:
        number = Fault.NOT_FINITE.value
    facts[0] = kinds.state_time(base, base + head.state_at)
    return set_fault(notes, number, facts)


@preparing
def take_step(motion, image, flags, t, size, reached, notes):
    """Advance a motion to a time; what is new of it is noted.

    `reached` is the address of two numbers: the time that was reached, and how many blows ended.
    """
    words_at(notes, 2)[:] = 0
    count = motion_of(motion).blow_count
    begin_step(motion, flags)
    if flags & NEW_INPUTS:
        values = np.zeros(1, SCENE_NUMBERS)
        fill_values(image, values)
        status, in_vain = set_inputs(motion, _wanted(values))
        for k in range(COUNT):
            if in_vain & (1 << k):
                add_note(notes, Note.IN_VAIN + k, 0.0, 0.0, t)
        fault = _end(motion, status, notes)
        if fault != 0:
            return fault
    status, there = step(motion, t, size, flags, count)
    floats_at(reached, 2)[0] = there
    floats_at(reached, 2)[1] = motion_of(motion).blow_count - count
    fault = _end(motion, status, notes)
    if fault == 0:
        look(motion, motion_of(motion).acting[STIFFNESS], notes)
    return fault


@preparing
def read_outputs(motion, flags, outputs):
    """Fill the outputs."""
    fill_outputs(motion, flags, floats_at(outputs, OUTPUT_COUNT))
    return 0


@preparing
def find_fault(motion, state, t, notes):
    """Refuse a state from outside that kernels cannot go on from.

    Parameters
    ----------
    motion : int
        Address of a motion of the same scene.
    state : int
        Address of what is to move.
    t : float
        Time that it is said to have [s].
    """
    facts = np.zeros(4)
    m, blow = motion_records(state, 1)[0], blow_records(state + MOTION_BYTES, 1)
    good = 0 <= m.is_read <= 1 and m.left == Left.NOWHERE and 0 <= m.blow_count <= MOST_BLOWS
    good = good and 0.0 <= m.time <= LARGEST and 0.0 <= m.step_size <= LARGEST
    good = good and is_bounded(m.before) and is_bounded(m.acting)
    numbers, counts = blow.view(np.float64), blow.view(np.int64)
    for word in BLOW_NUMBERS:
        good = good and (abs(numbers[word]) <= LARGEST or numbers[word] != numbers[word])
    for word in BLOW_COUNTS:
        good = good and 0 <= counts[word] <= MOST
    # the clock of the motion follows that of the host, within the rounding of a step
    if not good or not abs(t - m.time) <= m.step_size + CLOCK_ROUNDING * abs(t):
        return set_fault(notes, Fault.MOTION.value, facts)
    if not kinds.state_time(motion, state) <= m.time + MOST_AHEAD:
        return set_fault(notes, Fault.MOTION.value, facts)
    number = kinds.find_fault(motion, state, m.time, facts.ctypes.data)
    if number > 0:
        set_fault(notes, number, facts)
    return number


# What the shell calls: function, and its result and arguments as in `engine.entries`.
EXPORTED = {
    "kernel_check": ("check", "w:ww"),
    "kernel_create": ("create", "w:www"),
    "kernel_step": ("take_step", "w:wwwnnww"),
    "kernel_read": ("read_outputs", "w:www"),
    "kernel_fault": ("find_fault", "w:wwnw"),
}
