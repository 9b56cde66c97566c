"""Motion of the hammer as communication steps see it, in plain memory."""

from __future__ import annotations

import math

from fmu_src.hammer.inputs import SAME
from fmu_src.hammer.motion import PERIODS_HELD
from fmu_src.native import kinds
from percussion_model.engine.layout import (
    blow_records,
    copy_words,
    head_records,
    last_blow,
    motion_of,
    other_reading_at,
    reading_at,
    reading_of,
    reading_records,
)
from percussion_model.engine.memory import floats_at, words_at
from percussion_model.engine.records import ADVANCE, BLOW_ROOM, COMMIT, Left
from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Status
from percussion_model.scene.inputs import INPUTS

# Inputs of the solver, in the order of INPUTS.
COUNT = len(INPUTS)
# Flags of a step, as the shell has them (fmu_src/native/shell.h).
NEW_INPUTS, STOP_AT_BLOW, SAME_STEP = 1, 2, 4
NO_LIMIT = 1 << 30  # of blows


@preparing
def numbers_of_record(base):
    """Words of the solver's record, as numbers."""
    head = head_records(base, 1)[0]
    return floats_at(base + head.state_at + head.record_at, head.state_bytes // 8)


@preparing
def count_of(base, word):
    """A count that the solver's record has at a word; 0 for none."""
    head = head_records(base, 1)[0]
    if word < 0:
        return 0
    return words_at(base + head.state_at + head.record_at, head.state_bytes // 8)[word]


@preparing
def _carry(base, source, to):
    """Copy what moves from one place of the memory to another."""
    copy_words(base + source, base + to, head_records(base, 1)[0].state_bytes // 8)


@preparing
def _copy(base, to):
    """Copy what moves to another place of the memory."""
    _carry(base, head_records(base, 1)[0].state_at, to)


@preparing
def _take_impulses(motion, row):
    """Keep the impulses of a reading as those at the start of the last step."""
    motion.before[0] = row.bit_impulse
    motion.before[1] = row.contact_impulse
    motion.before[2] = row.drive_impulse
    motion.left = Left.NOWHERE


@preparing
def _leave(base):
    """Keep a copy of the state if it is needed as it is, since it is about to change."""
    motion = motion_of(base)
    if motion.left == Left.HERE:
        _copy(base, head_records(base, 1)[0].left_at)
        motion.left = Left.COPY


@preparing
def settle_before(base):
    """Find the impulses at the start of the last step, if they are not known yet."""
    motion, head = motion_of(base), head_records(base, 1)[0]
    if motion.left == Left.NOWHERE:
        return
    at = base + (head.state_at if motion.left == Left.HERE else head.left_at)
    t = max(motion.left_time, kinds.state_time(base, at))
    kinds.read(base, at, base + head.trial_at, t, other_reading_at(base), False)
    _take_impulses(motion, reading_records(other_reading_at(base), 1)[0])


@preparing
def begin_step(base, flags):
    """Remember what a step begins with, and count peaks from now on."""
    motion, head = motion_of(base), head_records(base, 1)[0]
    if flags & SAME_STEP:
        return
    if motion.is_read == 1:
        _take_impulses(motion, reading_of(base)[0])
    else:
        motion.left, motion.left_time = Left.HERE, motion.time
    numbers = numbers_of_record(base)
    numbers[head.peak_from_at] = motion.time
    numbers[head.peak_bit_at] = numbers[head.peak_contact_at] = 0.0


@preparing
def _run(base, task, t, most):
    """Let the solver do a task, until so many blows more have ended; a `Status`."""
    motion, head, blow = motion_of(base), head_records(base, 1)[0], last_blow(base)
    status = Status.BLOWS_FULL.value
    while most > 0:
        status, found = kinds.go(base, task, t, min(most, BLOW_ROOM))
        if found > 0:
            blow[0] = blow_records(base + head.blows_at, BLOW_ROOM)[found - 1]
            motion.blow_count += found
            most -= found
        full = status == Status.BLOWS_FULL or status == Status.EVENTS_FULL
        if not (full and found > 0):
            break
    return status


@preparing
def _find_blow(base, t):
    """Do what is pending at `t` if it comes to its end before, as at a blow; as `Runner` does it.

    Returns
    -------
    bool
        False: nothing was done, since no blow starts up to `t`.
    """
    end, head, motion = kinds.time_of_blow(base), head_records(base, 1)[0], motion_of(base)
    if not end > t:
        return False
    _leave(base)
    _copy(base, head.trial_at)
    before, count = kinds.state_time(base, base + head.state_at), motion.blow_count
    _run(base, ADVANCE, end, 1)
    now = kinds.state_time(base, base + head.state_at)
    if now > t:
        _carry(base, head.trial_at, head.state_at)
        return False
    return now > before or motion.blow_count > count


@preparing
def advance(base, t, most):
    """Advance until so many blows more have ended, or else to a time; a `Status`."""
    motion = motion_of(base)
    last, status, is_on = motion.blow_count + most, Status.DONE.value, True
    while is_on:
        if not kinds.is_quiet(base, t):
            _leave(base)
            status = _run(base, ADVANCE, t, last - motion.blow_count)
        is_on = status == Status.DONE and motion.blow_count < last and _find_blow(base, t)
    return status


@preparing
def set_inputs(base, wanted):
    """Commit the state at its next grid point and give it inputs that are new and act.

    Parameters
    ----------
    wanted : float array, shape (COUNT,)
        Inputs as the solver takes them.

    Returns
    -------
    status : int
        A `Status`.
    in_vain : int
        Bits of the inputs that are new and have no effect.
    """
    motion, head = motion_of(base), head_records(base, 1)[0]
    in_vain, acts = 0, False
    for k in range(COUNT):
        if wanted[k] != motion.acting[k]:
            if head.acts[k] == 1:
                acts = True
            else:
                if abs(wanted[k] - motion.acting[k]) > SAME * abs(wanted[k]):
                    in_vain |= 1 << k
                motion.acting[k] = wanted[k]
    if not acts:
        return Status.DONE.value, in_vain
    _leave(base)
    status, reached = Status.DONE.value, -math.inf
    t = kinds.grid_point_after(base, motion.time)
    while status == Status.DONE and t > reached:  # as `Runner` does it
        status = advance(base, t, NO_LIMIT)
        reached, t = t, kinds.grid_point_after(base, motion.time)
    if status == Status.DONE:
        status = _run(base, COMMIT, t, NO_LIMIT)
    if status == Status.DONE:
        numbers = numbers_of_record(base)
        for k in range(COUNT):
            if wanted[k] != motion.acting[k]:
                numbers[head.inputs_at[k]] = motion.acting[k] = wanted[k]
        kinds.take_inputs(base)
    return status, in_vain


@preparing
def step(base, t, size, flags, count):
    """Advance to a time, after inputs were set.

    Parameters
    ----------
    t, size : float
        End and size of the communication step [s].
    flags : int
    count : int
        Blows before the inputs were set: the change of an input can find one.

    Returns
    -------
    status : int
        A `Status`.
    reached : float
        [s]; less than `t` where it stopped at the end of a blow.
    """
    motion, head = motion_of(base), head_records(base, 1)[0]
    t = max(t, motion.time)
    stops, status, reached = flags & STOP_AT_BLOW != 0, Status.DONE.value, t
    if not (stops and motion.blow_count > count):
        status = advance(base, t, 1 if stops else NO_LIMIT)
    if stops and motion.blow_count > count:
        reached = min(t, max(motion.time, kinds.state_time(base, base + head.state_at)))
    motion.step_size = size - (t - reached)
    motion.time = reached
    motion.is_read = 0
    return status, reached


@preparing
def read(base, peaks):
    """What it is like now, greatest forces only if asked for: a READING array of length 1."""
    motion, head, row = motion_of(base), head_records(base, 1)[0], reading_of(base)
    if motion.is_read == 1 and (head.has_peaks == 1 or not peaks):
        return row
    at = base + head.state_at
    # after a change of inputs a state may lie a step ahead
    t = max(motion.time, kinds.state_time(base, at))
    kinds.read(base, at, base + head.here_at, t, reading_at(base), peaks)
    head.has_peaks = 1 if peaks else 0
    if motion.is_read == 0:
        motion.is_read, head.has_stress = 1, 0
    return row


@preparing
def read_stress(base):
    """Stress at the gauge [Pa]."""
    head = head_records(base, 1)[0]
    read(base, False)
    if head.has_stress == 0:
        head.stress, head.has_stress = kinds.stress(base, base + head.here_at), 1
    return head.stress


@preparing
def rate_decay(base):
    """Share of the last blow's rate that holds now; falls when blows fail to come."""
    motion, blow = motion_of(base), last_blow(base)[0]
    if motion.blow_count == 0 or not blow.period > 0.0:
        return 0.0
    since = motion.time - (blow.time + blow.period)
    late = since / blow.period - (PERIODS_HELD - 1.0)
    return min(1.0, 1.0 / late) if late > 0.0 else 1.0
