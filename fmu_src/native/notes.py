"""Notes about a motion for the log: each once, and as soon as it is seen."""

from __future__ import annotations

from fmu_src.hammer.warnings import INTERVAL
from fmu_src.native.messages import Note
from fmu_src.native.motion import count_of, read
from fmu_src.native.outputs import numerical, residual
from fmu_src.native.rows import add_note
from percussion_model.engine.layout import head_records, last_blow, motion_of
from percussion_model.physics.kernel import preparing
from percussion_model.physics.power_law import secant_stiffness
from percussion_model.physics.records import Mode, RockKind
from percussion_model.simulation.validity import (
    BUTTON_LENGTH,
    LEAST_NUMERICAL,
    LONGEST_FLIGHT,
    MOST_BARRIER,
    MOST_NUMERICAL,
    MOST_RATE,
    MOST_RESIDUAL,
)


@preparing
def _tell(base, notes, number, first, second):
    """Add a note that was not told before."""
    head = head_records(base, 1)[0]
    if head.told & (1 << number) == 0:
        head.told |= 1 << number
        add_note(notes, number, first, second, motion_of(base).time)


@preparing
def _of_blow(base, stiffness, notes):
    """What the last whole blow tells."""
    head, blow = head_records(base, 1)[0], last_blow(base)[0]
    head.blows_seen = motion_of(base).blow_count
    if head.rock == RockKind.BILINEAR or head.rock == RockKind.SPRING:
        force, bent = blow.peak_bit_force, (head.exponent, head.reference_penetration)
        depth = force / secant_stiffness(force, head.buttons * stiffness, *bent)
        if depth > BUTTON_LENGTH:
            _tell(base, notes, Note.BUTTON, 1e3 * depth, 0.0)
    if head.rock != RockKind.NONE and blow.period > 0.0:
        rate = blow.hole_advance / blow.period
        if rate > MOST_RATE:
            _tell(base, notes, Note.RATE, rate, 0.0)


@preparing
def _of_state(base, notes):
    """What ledger, counts and forces tell."""
    head, motion = head_records(base, 1)[0], motion_of(base)
    if head.scene_seen == 0:
        head.scene_seen = 1
        if max(head.time_share, head.energy_share) > MOST_BARRIER:
            _tell(base, notes, Note.BARRIER, head.time_share, head.energy_share)
    reading = read(base, False)
    row, share = reading[0], residual(reading)
    if not abs(share) <= MOST_RESIDUAL:
        _tell(base, notes, Note.LEDGER, share, 0.0)
    taken = numerical(reading)
    if not taken >= LEAST_NUMERICAL:
        _tell(base, notes, Note.GIVES_ENERGY, taken, 0.0)
    elif taken > MOST_NUMERICAL:
        _tell(base, notes, Note.TAKES_ENERGY + head.kind - 1, 100.0 * taken, 0.0)
    locked, storms = count_of(base, head.locked_at), count_of(base, head.storms_at)
    if locked > 0:
        _tell(base, notes, Note.LOCKED, locked, 1.0 if locked == 1 else 2.0)
    if storms > 0:
        _tell(base, notes, Note.STORM, storms, 1.0 if storms == 1 else 2.0)
    if head.rock == RockKind.NONE:
        return
    if int(row.drilling_mode) != Mode.FF or row.bit_impulse != head.impulse_seen:
        head.pushed_at, head.impulse_seen = motion.time, row.bit_impulse
    if motion.time - head.pushed_at > LONGEST_FLIGHT:
        _tell(base, notes, Note.FLIGHT, motion.time - head.pushed_at, 0.0)


@preparing
def look(base, stiffness, notes):
    """Add notes that are new.

    Parameters
    ----------
    stiffness : float
        K_R of the rock now, under one button [N/m].
    notes : int
        Address of the notes.
    """
    head, motion = head_records(base, 1)[0], motion_of(base)
    if motion.time < head.check_at - INTERVAL:  # an older state has been restored
        head.check_at = head.pushed_at = motion.time
    due = motion.time >= head.check_at
    if motion.blow_count != head.blows_seen:
        _of_blow(base, stiffness, notes)
    if due:
        head.check_at = motion.time + INTERVAL
        _of_state(base, notes)
