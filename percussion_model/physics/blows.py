"""Rows of blows and events, which every solver writes alike.

A blow starts at the first closure of the piston/bit gap after the downward
switch of the drive; without a switching drive, after the gap was open for 20
bar transits (docs/model.md, section 7).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from percussion_model.physics.kernel import composed, inlined, kernel, merged
from percussion_model.physics.place import move_place
from percussion_model.physics.records import (
    BLOW_COLUMNS,
    Column,
    DriveKind,
    EventKind,
    Mode,
    Piston,
)
from percussion_model.physics.rock import hole_depth
from percussion_model.physics.state import CHECKPOINTS

# No gap is looked at for a closure that would have to close faster [m/s].
FASTEST = 100.0
# The standstill force is the mean over this last share of the standstill.
LAST_SHARE = 0.1


@inlined
def push_event(s, events, time, kind, value):
    """Append a row to the event list, where one is kept."""
    s.count_events += 1
    if s.live == 1 and s.events_on == 1:
        row = events[s.n_events]
        row.time = time
        row.kind = kind
        row.value = value
        row.bit_position = s.x_r + s.p - s.climb
        s.n_events += 1


@inlined
def push_checkpoint(s, time):
    """Note the running bit impulse during standstill."""
    k = s.n_check % CHECKPOINTS
    s.check_time[k] = time
    s.check_impulse[k] = s.i_bit
    s.n_check += 1


@merged
def standstill_force(s, time, impulse):
    """Mean bit force over the last tenth of the standstill that ends at `time`.

    Parameters
    ----------
    impulse : float
        Running bit impulse at `time` [N s].

    Returns
    -------
    float
        Force [N]; NaN where the bit does not stand still.
    """
    if s.mode != Mode.SS or s.n_check == 0:
        return math.nan
    begin = time - LAST_SHARE * (time - s.t_standstill)
    later_time = time
    later_impulse = impulse
    for back in range(1, min(s.n_check, CHECKPOINTS) + 1):
        k = (s.n_check - back) % CHECKPOINTS
        if s.check_time[k] <= begin:
            share = (begin - s.check_time[k]) / (later_time - s.check_time[k])
            at_begin = s.check_impulse[k] + share * (later_impulse - s.check_impulse[k])
            return (impulse - at_begin) / (time - begin)
        later_time = s.check_time[k]
        later_impulse = s.check_impulse[k]
    if later_time < time:
        return (impulse - later_impulse) / (time - later_time)
    return math.nan


@composed
def _nothing(s: Any, row: Any) -> None:
    pass


def _and_column(before: Callable, name: str, field: str) -> Callable:
    @composed
    def copy(s: Any, row: Any) -> None:
        before(s, row)
        row[name] = s[field]

    return copy


def filled_from_state(columns: Iterable[Column]) -> Callable:
    """Kernel fill(s, row) that writes the columns that are fields of a state."""
    fill = _nothing
    for column in columns:
        if column.of:
            fill = _and_column(fill, column.name, column.of)
    return fill


fill_row = filled_from_state(BLOW_COLUMNS)


@merged
def finish_blow(par, s, blows, time, bit_position):
    """Write the row of the blow that ends at `time`."""
    row = blows[s.n_blows]
    row.time = s.b_time
    row.period = time - s.b_time
    row.impact_velocity = s.b_impact
    row.rebound_velocity = s.b_rebound
    row.stroke = s.b_stroke
    row.blow_energy = 0.5 * par.mass_p * s.b_impact * s.b_impact
    row.rock_energy = s.rock_work - s.b_rock0
    row.penetration = bit_position - s.b_position
    row.bit_position = s.b_position
    row.hole_advance = hole_depth(par, s) - s.b_hole
    row.hole_depth = s.b_hole
    row.peak_contact_force = s.b_peak_contact
    row.peak_bit_force = s.b_peak_bit
    row.standstill_force = s.b_standstill
    row.contact_impulse = s.i_contact - s.b_contact0
    row.bit_impulse = s.i_bit - s.b_bit0
    row.drive_impulse = s.i_drive - s.b_drive0
    row.contacts = s.b_contacts
    row.drilling_cycles = s.b_cycles
    row.barrier_margin = s.b_barrier
    row.counting_margin = s.b_counting
    row.closing_speed = s.b_closing
    fill_row(s, row)
    s.n_blows += 1


@kernel
def start_blow(par, s, blows, time, piston_velocity, bit_position, standstill):
    """End the blow under way, if any, and start the next at `time`.

    Parameters
    ----------
    piston_velocity : float
        Mean velocity of the piston at the closure [m/s].
    bit_position : float
        Mean displacement of the bit at the closure [m].
    standstill : float
        Mean bit force at the end of the standstill before, NaN where there was none [N].
    """
    move_place(par, s, time)
    if s.live == 1 and s.b_started == 1:
        finish_blow(par, s, blows, time, bit_position - s.climb)
    s.b_standstill = standstill
    s.b_started = 1
    s.count_blows += 1
    s.armed = 0
    s.b_time = time
    s.b_impact = piston_velocity
    s.b_rebound = math.nan
    s.b_stroke = 0.0
    s.b_peak_contact = 0.0
    s.b_peak_bit = 0.0
    s.b_position = bit_position - s.climb
    s.b_hole = hole_depth(par, s)
    s.b_rock0 = s.rock_work
    s.b_contact0 = s.i_contact
    s.b_bit0 = s.i_bit
    s.b_drive0 = s.i_drive
    s.b_contacts = 0
    s.b_cycles = 0
    s.b_barrier = math.nan
    s.b_counting = math.nan
    s.b_closing = math.nan


@inlined
def starts_blow(par, s, time):
    """Whether a closure of the gap at `time` starts a blow; no two start at one instant."""
    if s.b_started == 1 and time <= s.b_time:
        return False
    if s.armed == 1 or par.drive == DriveKind.PRESSURE or par.drive == DriveKind.COMPONENT:
        return s.armed == 1
    return time - s.t_open >= par.rearm_time


@inlined
def end_with_blow(par, s, end):
    """A time at which what is pending is over, if a closure before it may start a blow; else 0."""
    if s.closed == 1 or par.piston == Piston.ABSENT or not starts_blow(par, s, end):
        return 0.0
    return end


@inlined
def end_of_step_with_blow(par, s, end):
    """The same of a step, of a solver that knows the gap at all times."""
    return 0.0 if s.gap > FASTEST * par.dt else end_with_blow(par, s, end)


@merged
def close_gap(s, events, time, approach):
    """Note that the gap closes at `time` with a closing speed [m/s]."""
    s.b_contacts += 1
    if not s.b_closing <= approach:
        s.b_closing = approach
    s.count_contacts += 1
    push_event(s, events, time, EventKind.CONTACT_CLOSED, approach)


@merged
def open_gap(s, events, time, approach):
    """Note that the gap opens at `time`; the piston then has its rebound velocity."""
    s.b_rebound = s.v_p
    s.t_open = time
    push_event(s, events, time, EventKind.CONTACT_OPENED, approach)
