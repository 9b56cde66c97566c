"""Motions by travelling waves in plain memory."""

from __future__ import annotations

import math

import numpy as np

from fmu_src.native.checks import arrays_are_bounded, record_fault
from fmu_src.native.layout import (
    ADVANCE,
    BLOW_ROOM,
    GaugeBar,
    Kind,
    blow_rows,
    directory,
    event_rows,
    head_records,
    make_memory,
    reading_of,
    set_gauge,
    views_of,
    work_at,
)
from fmu_src.native.memory import (
    enter,
    floats_2,
    floats_3,
    floats_4,
    hold,
    lines,
    put_tables,
    table_bytes,
    viewing,
)
from fmu_src.native.messages import Fault
from percussion_model.physics.kernel import preparing
from percussion_model.solvers.cells import find_cell
from percussion_model.solvers.setup import MOST_CELLS
from percussion_model.solvers.wave.advance import GRID_ROUNDING, run
from percussion_model.solvers.wave.advance import time_of_blow as blow_of
from percussion_model.solvers.wave.grid import Refused
from percussion_model.solvers.wave.leaps.lookahead import LOOKAHEAD
from percussion_model.solvers.wave.prepare import (
    cut_bars,
    fill_wave_parameters,
    fill_wave_start,
    make_operators,
    scratch_size,
    wanted_grid,
)
from percussion_model.solvers.wave.records import (
    WAVE_LIMITS,
    WAVE_PAR,
    WAVE_STATE,
    Bars,
    LeapKind,
    LeapOperators,
    Row,
    Scratch,
    Task,
)

parameters, state_in = views_of(WAVE_PAR, WAVE_STATE)
LOW, HIGH, MAY_BE_NAN, WHOLE = WAVE_LIMITS.rows
PAR_BYTES = WAVE_PAR.itemsize
WORK = work_at(WAVE_STATE)  # place of the first array in what moves
ROWS = len(Row)
# A state without a leap is no more than a step, and rounding, behind the present [steps].
MOST_BEHIND = 2
(
    OF_PISTON, OF_BIT, PISTON, BIT, AHEAD, SUMS, TOP, BOTTOM, PISTON_LOSS, LOSS, SQUARES,
    SCRATCH, WP, WB,
) = range(14)  # fmt: skip


@viewing
def bars_in(base, moving):
    """`Bars` of what moves, or of a copy of it, at an address."""
    d = directory(base)
    return Bars(
        floats_2(moving, d, WP), floats_2(base, d, OF_PISTON),
        floats_2(moving, d, WB), floats_2(base, d, OF_BIT),
    )  # fmt: skip


@viewing
def operators(base):
    """`LeapOperators` of a motion."""
    d = directory(base)
    return LeapOperators(
        floats_3(base, d, PISTON), floats_4(base, d, BIT), floats_3(base, d, AHEAD),
        floats_2(base, d, SUMS), floats_3(base, d, TOP), floats_2(base, d, BOTTOM),
        floats_3(base, d, PISTON_LOSS), floats_4(base, d, LOSS), floats_3(base, d, SQUARES),
    )  # fmt: skip


@viewing
def scratch(base):
    """`Scratch` of a motion."""
    rows = floats_2(base, directory(base), SCRATCH)
    return Scratch(rows[0], rows[1], rows[2])


@preparing
def refuse(numbers, facts):
    """Number of why a scene cannot be set up, 0 for none: too many cells, or too much work."""
    wish = wanted_grid(numbers)[1]
    facts[0], facts[1] = wish.cells, MOST_CELLS
    if wish.refused == Refused.CELLS:
        return Fault.CELLS.value
    facts[1] = wish.parts
    return Fault.WORK.value if wish.refused == Refused.WORK else 0


@preparing
def create(numbers, bar, place):
    """Make the memory of a motion at time zero; its address, 0 where there is no memory left."""
    bars = cut_bars(numbers, wanted_grid(numbers)[0])
    par = np.zeros(1, WAVE_PAR)
    fill_wave_parameters(par[0], numbers, bars)
    ops = make_operators(par, numbers, bars)
    of_piston, of_bit = bars.piston.coefficients, bars.bit.coefficients
    tables = (
        of_piston, of_bit, ops.piston, ops.bit, ops.lookahead, ops.sums, ops.top, ops.bottom,
        ops.piston_loss, ops.loss, ops.squares,
    )  # fmt: skip
    room = (np.zeros((3, scratch_size(par[0]))),)
    n_p, n_b = len(bars.piston.grid.mass) + 1, len(bars.bit.grid.mass) + 1
    wb_at = WORK + lines(8 * ROWS * n_p)
    moving = wb_at + lines(8 * ROWS * n_b)
    base, room_at, tables_at = make_memory(
        Kind.WAVE.value, PAR_BYTES, moving, table_bytes(room), table_bytes(tables)
    )
    if base == 0:
        return base
    d = directory(base)
    put_tables(base, d, 0, tables_at, tables)
    put_tables(base, d, SCRATCH, room_at, room)
    enter(d, WP, WORK, ROWS, n_p)
    enter(d, WB, wb_at, ROWS, n_b)
    parameters(base)[0] = par[0]
    hold(par)
    if bar != GaugeBar.NONE:
        cut, sections = bars.bit, numbers.bit
        if bar == GaugeBar.PISTON:
            cut, sections = bars.piston, numbers.piston
        cell, area = find_cell(sections, cut.grid.mass, place)
        set_gauge(base, bar, cell, 0.0, cut.grid.impedance[cell], area)
    at = base + head_records(base, 1)[0].state_at
    fill_wave_start(parameters(base), state_in(at), bars_in(base, at), numbers)
    return base


@preparing
def _time_of(base, s, step):
    return s.t_base + step * parameters(base)[0].dt


@preparing
def state_time(base, moving):
    """Time up to which a state is committed [s]."""
    s = state_in(moving)[0]
    return _time_of(base, s, s.step)


@preparing
def grid_point_after(base, t):
    """First grid point at or after a time [s]."""
    s = state_in(base + head_records(base, 1)[0].state_at)[0]
    return _time_of(base, s, math.ceil((t - s.t_base) / parameters(base)[0].dt - GRID_ROUNDING))


@preparing
def is_quiet(base, t):
    """Whether nothing has to be done to come to a time: a leap, or a step, passes it."""
    s = state_in(base + head_records(base, 1)[0].state_at)[0]
    steps = (t - s.t_base) / parameters(base)[0].dt + GRID_ROUNDING
    return steps < (s.leap_end if s.leap_end >= 0 else s.step + 1)


@preparing
def time_of_blow(base):
    """Time at which the pending step is over, if a blow may start in it [s]; 0 if none may."""
    return blow_of(parameters(base), state_in(base + head_records(base, 1)[0].state_at))


@preparing
def go(base, task, t, room):
    """Advance the state or commit it, with room for so many blows; status and blows."""
    moving = base + head_records(base, 1)[0].state_at
    state, blows, events = state_in(moving), blow_rows(base, room), event_rows(base)
    state[0].events_on = 0
    bars, ops, rows = bars_in(base, moving), operators(base), scratch(base)
    wanted, time = Task.ADVANCE.value, t
    if task != ADVANCE:
        wanted, time = Task.COMMIT.value, grid_point_after(base, t)
    status = run(
        wanted, parameters(base), state, bars, ops, rows, time, blows, events, reading_of(base)
    )
    return status, state[0].n_blows if task == ADVANCE else 0


@preparing
def read(base, moving, t, reading, peaks):
    """Carry a copy of what moves to a time and read it."""
    state, blows, events = state_in(moving), blow_rows(base, BLOW_ROOM), event_rows(base)
    if not peaks:
        state[0].peak_from = math.inf
    bars, ops, rows = bars_in(base, moving), operators(base), scratch(base)
    run(Task.READ.value, parameters(base), state, bars, ops, rows, t, blows, events, reading)


@preparing
def stress(base, moving):
    """Stress at the gauge in a copy of what moves [Pa]."""
    head, bars = head_records(base, 1)[0], bars_in(base, moving)
    w = bars.wp if head.gauge_bar == GaugeBar.PISTON else bars.wb
    row, cell = 2 * state_in(moving)[0].parity, head.gauge_cell
    return head.gauge_impedance * (w[row, cell] - w[row + 1, cell]) / head.gauge_area


@preparing
def find_fault(base, moving, t, facts):
    """Number of the fault of what moves, from outside; its facts are filled in."""
    number = Fault.WAVE_FIELD.value
    fault = record_fault(moving, LOW, HIGH, MAY_BE_NAN, WHOLE, number, facts)
    if fault > 0:
        return fault
    if not arrays_are_bounded(base, moving, WP, 2):
        return Fault.WORKSPACE.value
    s, longest = state_in(moving)[0], (1 << 2 * parameters(base)[0].leaps) - 1
    facts[1] = s.step
    if s.leap_end >= 0:
        most = min(longest, LOOKAHEAD) if s.leap_kind == LeapKind.CONTACT else longest
        if not s.step < s.leap_end <= s.step + most:
            facts[0], facts[2] = s.leap_end, most
            return Fault.WAVE_LEAP.value
    begin = s.piston_step
    waits = max(s.step, s.leap_end) <= s.wake <= begin + longest and begin <= s.step
    if s.dormant == 1 and not (begin <= max(s.step, s.leap_end) and waits):
        facts[0], facts[2] = s.wake, begin
        return Fault.WAVE_WAKE.value
    facts[0], facts[1] = _time_of(base, s, s.step), t
    behind = t - _time_of(base, s, max(s.leap_end, s.step + MOST_BEHIND))
    return 0 if behind <= 0.0 else Fault.BEHIND.value
