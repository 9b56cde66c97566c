"""Motions by the modal solver in plain memory."""

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
    floats_1,
    floats_2,
    floats_3,
    floats_4,
    hold,
    lines,
    matrix_at,
    put_tables,
    table_bytes,
    viewing,
    words_1,
    words_2,
)
from fmu_src.native.messages import Fault
from percussion_model.physics.kernel import preparing
from percussion_model.solvers.cells import find_cell
from percussion_model.solvers.modal.advance import TICK_ROUNDING, portion, run
from percussion_model.solvers.modal.advance import time_of_blow as blow_of
from percussion_model.solvers.modal.faults import find_fault as state_fault
from percussion_model.solvers.modal.fields import loads_of, places_of, take_rest, total
from percussion_model.solvers.modal.modes import shapes_at
from percussion_model.solvers.modal.pairs import law_wanted
from percussion_model.solvers.modal.prepare import (
    begin,
    fill_modal_parameters,
    modes_wanted,
    tables_of,
)
from percussion_model.solvers.modal.records import (
    JOINED,
    MODAL_LIMITS,
    MODAL_PAR,
    MODAL_STATE,
    SCAN,
    STEP,
    Bars,
    Forms,
    Laws,
    Task,
)
from percussion_model.solvers.modal.resolution import MOST_MODES

parameters, state_in = views_of(MODAL_PAR, MODAL_STATE)
LOW, HIGH, MAY_BE_NAN, WHOLE = MODAL_LIMITS.rows
PAR_BYTES = MODAL_PAR.itemsize
WORK = work_at(MODAL_STATE)  # place of the first array in what moves
FREE = 2 * JOINED  # column of a gauge for a free piston
# Rows of modes and of the piston's in what moves, and of the room of a step.
ROWS, PISTON_ROWS, ROOM = 8, 2, 8
(
    SIZES, STIFF, SHAPE, MOVE, YIELDS, CHANGE, JOIN,
    LAW_SIZES, DASHPOT, LAW_MOVE, ENDS, OUT, INTO, TAKEN, REST, VIEWS, SCANS, SIDES, WAY, OVER,
    PUSHED, SHAPE_P, MOVE_P, GAUGE_AT, ROOM_AT, W_AT, WP_AT,
) = range(27)  # fmt: skip


@viewing
def bars_in(base, moving):
    """`Bars` of what moves, or of a copy of it, at an address."""
    d = directory(base)
    forms = Forms(
        words_1(base, d, SIZES), floats_1(base, d, STIFF), floats_3(base, d, SHAPE),
        floats_4(base, d, MOVE), floats_3(base, d, YIELDS), floats_4(base, d, CHANGE),
        floats_3(base, d, JOIN),
    )  # fmt: skip
    laws = Laws(
        words_1(base, d, LAW_SIZES), floats_1(base, d, DASHPOT), floats_4(base, d, LAW_MOVE),
        floats_3(base, d, ENDS), floats_3(base, d, OUT), floats_3(base, d, INTO),
        floats_3(base, d, TAKEN), floats_2(base, d, REST), floats_4(base, d, VIEWS),
        floats_4(base, d, SCANS), floats_4(base, d, SIDES), words_2(base, d, WAY),
        floats_3(base, d, OVER), floats_3(base, d, PUSHED),
    )  # fmt: skip
    return Bars(
        floats_2(moving, d, W_AT), floats_2(moving, d, WP_AT), forms, laws,
        floats_2(base, d, SHAPE_P), floats_3(base, d, MOVE_P), floats_2(base, d, ROOM_AT),
    )  # fmt: skip


@preparing
def _tables(made, gauge):
    """What never changes, in the order of the directory."""
    forms, laws = made.forms, made.laws
    return (
        forms.sizes, forms.stiff, forms.shape, forms.move, forms.yields, forms.change, forms.join,
        laws.sizes, laws.dashpot, laws.move, laws.ends, laws.out, laws.into, laws.taken, laws.rest,
        laws.views, laws.scans, laws.sides, laws.way, laws.over, laws.pushed,
        made.shape_p, made.move_p, gauge,
    )  # fmt: skip


@preparing
def gauge_rows(numbers, made, dt, bar, place):
    """What the modes of each form, and at last those of the free piston, have at a gauge.

    Parameters
    ----------
    bar : int
        A `GaugeBar` that has modes.
    place : float
        From the top of the bar [m].

    Returns
    -------
    rows : ndarray, shape (n, 7)
        Elastic force [N/(m kg^0.5)].
    above : float
        Mass of the bar above the middle of the gauge's cell [kg].
    area : float
        Cross-section there [m2].
    """
    sections = numbers.piston if bar == GaugeBar.PISTON else numbers.bit
    _, section, share, mass = places_of(sections, dt)
    cell, area = find_cell(sections, mass, place)
    above = 0.0
    for k in range(cell + 1):
        above += mass[k]
    rows = np.zeros((made.forms.shape.shape[2] + 1, FREE + 1))
    where = np.zeros(1, np.int64)
    for form in range(FREE):
        joined = form >= JOINED
        if made.forms.sizes[form] == 0 or (bar == GaugeBar.PISTON and not joined):
            continue
        first = len(numbers.piston) if bar == GaugeBar.BIT and joined else 0
        if len(made.free.frequency) == 0:
            first = 0
        where[0] = first + section[cell]
        force = shapes_at(made.modes[form], where, share[cell : cell + 1])[1]
        rows[: len(force), form] = force[:, 0]
    if bar == GaugeBar.PISTON:
        where[0] = section[cell]
        force = shapes_at(made.free, where, share[cell : cell + 1])[1]
        rows[: len(force), FREE] = force[:, 0]
    return rows, above - 0.5 * mass[cell], area


@preparing
def stress(base, moving):
    """Stress at the gauge in a copy of what moves [Pa]."""
    head = head_records(base, 1)[0]
    par, s, bars = parameters(base)[0], state_in(moving)[0], bars_in(base, moving)
    rows = floats_2(base, directory(base), GAUGE_AT)
    form, on_piston = s.form, head.gauge_bar == GaugeBar.PISTON
    a_p, a_b = loads_of(par, s, bars.forms.stiff[form])
    own = np.zeros((2, rows.shape[0]))
    if on_piston and form < JOINED:
        n = bars.wp.shape[1]
        own[:, 1 : n + 1] = bars.wp[:2]
        force = total(rows[: n + 1], FREE, own, 0)
    else:
        n = bars.forms.sizes[form]
        take_rest(bars.w, bars.forms.shape[form], s.active, own)
        force = total(rows[:n], form, own, 0)
    held = par.mass_p * a_p if form >= JOINED and not on_piston else 0.0
    force += held + (a_p if on_piston else a_b) * head.gauge_above
    return force / head.gauge_area


@preparing
def refuse(numbers, facts):
    """Number of why a scene cannot be set up, 0 for none: too many modes."""
    par = np.zeros(1, MODAL_PAR)
    request = fill_modal_parameters(par[0], numbers)
    hold(par)
    facts[0], facts[1] = modes_wanted(numbers, request)[2], MOST_MODES
    return Fault.MODES.value if facts[0] > facts[1] else 0


@preparing
def create(numbers, bar, place):
    """Make the memory of a motion at time zero.

    Parameters
    ----------
    numbers : Numbers
    bar : int
        `GaugeBar`.
    place : float
        Of the gauge, from the top of its bar [m].

    Returns
    -------
    int
        Address; 0 where there is no memory left.
    """
    par = np.zeros(1, MODAL_PAR)
    request = fill_modal_parameters(par[0], numbers)
    made = tables_of(numbers, request)
    n, n_p = made.forms.shape.shape[2], made.shape_p.shape[1]
    gauge, above, area = np.zeros((0, 0)), 0.0, 1.0
    if bar != GaugeBar.NONE:
        gauge, above, area = gauge_rows(numbers, made, par[0].dt, bar, place)
    tables, room = _tables(made, gauge), (np.zeros((ROOM, max(n, 2 * SCAN))),)
    wp_at = WORK + lines(8 * ROWS * n)
    moving = wp_at + lines(8 * PISTON_ROWS * n_p)
    base, room_at, tables_at = make_memory(
        Kind.MODAL.value, PAR_BYTES, moving, table_bytes(room), table_bytes(tables)
    )
    if base == 0:
        return base
    d = directory(base)
    put_tables(base, d, 0, tables_at, tables)
    put_tables(base, d, ROOM_AT, room_at, room)
    enter(d, W_AT, WORK, ROWS, n)
    enter(d, WP_AT, wp_at, PISTON_ROWS, n_p)
    parameters(base)[0] = par[0]
    set_gauge(base, bar, 0, above, 0.0, area)
    at = base + head_records(base, 1)[0].state_at
    w = matrix_at(at + WORK, ROWS, n)
    begin(par[0], state_in(at)[0], w, made.forms.sizes[0], numbers)
    hold(par)
    return base


@preparing
def state_time(base, moving):
    """Time up to which a state is committed [s]."""
    return state_in(moving)[0].time * parameters(base)[0].tick


@preparing
def grid_point_after(base, t):
    """First tick at or after a time [s]."""
    tick = parameters(base)[0].tick
    return math.ceil(t / tick - TICK_ROUNDING) * tick


@preparing
def is_quiet(base, t):
    """Whether nothing has to be done to come to a time: a leap, or a step, passes it."""
    moving, par = base + head_records(base, 1)[0].state_at, parameters(base)[0]
    s, end = state_in(moving)[0], math.floor(t / par.tick + TICK_ROUNDING)
    if s.leap_end >= 0:
        return s.leap_end > end
    law = law_wanted(par, s, bars_in(base, moving).laws)
    return s.time + (portion(s, law) if law >= 0 else 1 << STEP) > end


@preparing
def time_of_blow(base):
    """Time by which what is pending is over, if a blow may start in it [s]; 0 if none may."""
    moving = base + head_records(base, 1)[0].state_at
    return blow_of(parameters(base), state_in(moving), bars_in(base, moving))


@preparing
def go(base, task, t, room):
    """Advance the state or commit it, with room for so many blows; status and blows."""
    moving = base + head_records(base, 1)[0].state_at
    state, blows, events = state_in(moving), blow_rows(base, room), event_rows(base)
    state[0].events_on = 0
    bars = bars_in(base, moving)
    wanted = Task.ADVANCE.value if task == ADVANCE else Task.COMMIT.value
    status = run(wanted, parameters(base), state, bars, t, blows, events, reading_of(base))
    return status, state[0].n_blows


@preparing
def read(base, moving, t, reading, peaks):
    """Carry a copy of what moves to a time and read it."""
    state, blows, events = state_in(moving), blow_rows(base, BLOW_ROOM), event_rows(base)
    if not peaks:
        state[0].peak_from = math.inf
    bars = bars_in(base, moving)
    run(Task.READ.value, parameters(base), state, bars, t, blows, events, reading)


@preparing
def find_fault(base, moving, t, facts):
    """Number of the fault of what moves, from outside; its facts are filled in."""
    number = Fault.MODAL_FIELD.value
    fault = record_fault(moving, LOW, HIGH, MAY_BE_NAN, WHOLE, number, facts)
    if fault > 0:
        return fault
    if not arrays_are_bounded(base, moving, W_AT, 2):
        return Fault.WORKSPACE.value
    d = directory(base)
    sizes, law_sizes = words_1(base, d, SIZES), words_1(base, d, LAW_SIZES)
    tick, s = parameters(base)[0].tick, state_in(moving)[0]
    number, facts[0], facts[1] = state_fault(s, sizes, law_sizes, tick, t)
    return Fault.MODAL_STATE.value + number - 1 if number > 0 else 0
