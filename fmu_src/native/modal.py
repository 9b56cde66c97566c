"""Motions by the modal solver in plain memory."""

from __future__ import annotations

import math

import numpy as np
from numba import carray, literal_unroll

from fmu_src.native.layout import (
    ADVANCE,
    BLOW_BYTES,
    BLOW_ROOM,
    ENTRIES,
    EVENT_BYTES,
    HEAD_BYTES,
    MOTION_BYTES,
    READING_BYTES,
    GaugeBar,
    Kind,
    blow_records,
    event_records,
    head_records,
    reading_records,
)
from fmu_src.native.memory import (
    ENTRY_WORDS,
    allocate,
    floats_1,
    floats_2,
    floats_3,
    floats_4,
    floats_at,
    lines,
    matrix_at,
    put,
    records_at,
    viewing,
    word_pointer,
    words_1,
    words_2,
    words_at,
)
from fmu_src.native.messages import Fault
from percussion_model.physics.kernel import preparing
from percussion_model.solvers.cells import find_cell
from percussion_model.solvers.modal.advance import TICK_ROUNDING, run
from percussion_model.solvers.modal.faults import find_fault as state_fault
from percussion_model.solvers.modal.fields import loads_of, places_of, take_rest, total
from percussion_model.solvers.modal.modes import shapes_at
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
    Bars,
    Forms,
    Laws,
    Task,
)
from percussion_model.solvers.modal.resolution import MOST_MODES
from percussion_model.solvers.state import first_beyond, is_bounded, words_of

_parameters_at = records_at(MODAL_PAR)
_states_at = records_at(MODAL_STATE)
LOW, HIGH, MAY_BE_NAN, WHOLE = MODAL_LIMITS.rows
RECORD = MOTION_BYTES + BLOW_BYTES  # place of the state's record in what moves
WORDS = words_of(MODAL_STATE)
LOCKED = WORDS["count_locked"]
PAR_BYTES, STATE_BYTES = MODAL_PAR.itemsize, MODAL_STATE.itemsize
FREE = 2 * JOINED  # column of a gauge for a free piston
# Rows of modes and of the piston's in what moves, and of the room of a step.
ROWS, PISTON_ROWS, ROOM = 8, 2, 8
(
    SIZES, STIFF, SHAPE, MOVE, YIELDS, CHANGE, JOIN,
    LAW_SIZES, DASHPOT, LAW_MOVE, ENDS, OUT, INTO, TAKEN, REST, VIEWS, SCANS, SIDES, WAY, OVER,
    PUSHED, SHAPE_P, MOVE_P, ROOM_AT, GAUGE_AT, W_AT, WP_AT,
) = range(27)  # fmt: skip


@viewing
def _entries(base):
    at = base + head_records(base, 1)[0].entries_at
    return carray(word_pointer(at), (ENTRIES, ENTRY_WORDS))


@viewing
def parameters(base):
    """Parameters, as an array of one record."""
    return _parameters_at(base + head_records(base, 1)[0].par_at, 1)


@viewing
def state_in(moving):
    """State in what moves, or in a copy of it, at an address."""
    return _states_at(moving + RECORD, 1)


@viewing
def bars_in(base, moving):
    """`Bars` of what moves, or of a copy of it, at an address."""
    d = _entries(base)
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
def _arrays(made, room, gauge):
    """What the directory lists, in its order."""
    forms, laws = made.forms, made.laws
    return (
        forms.sizes, forms.stiff, forms.shape, forms.move, forms.yields, forms.change, forms.join,
        laws.sizes, laws.dashpot, laws.move, laws.ends, laws.out, laws.into, laws.taken, laws.rest,
        laws.views, laws.scans, laws.sides, laws.way, laws.over, laws.pushed,
        made.shape_p, made.move_p, room, gauge,
    )  # fmt: skip


@preparing
def _copy_tables(base, begin_at, arrays):
    """Copy tables into a memory, and enter them in its directory."""
    d, at, k = _entries(base), begin_at, 0
    for array in literal_unroll(arrays):
        at = put(base, d, k, at, array)
        k += 1  # noqa: SIM113  # numba unrolls no enumeration


@preparing
def _table_bytes(arrays):
    """Bytes of what `_copy_tables` copies."""
    total = 0
    for array in literal_unroll(arrays):
        total += lines(8 * array.size)
    return total


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
    if head.gauge_bar == GaugeBar.NONE:
        return 0.0
    par, s, bars = parameters(base)[0], state_in(moving)[0], bars_in(base, moving)
    rows = floats_2(base, _entries(base), GAUGE_AT)
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
def modes_of(numbers):
    """How many modes there would be, and how many at most: more are refused."""
    par = np.zeros(1, MODAL_PAR)
    request = fill_modal_parameters(par[0], numbers)
    return modes_wanted(numbers, request)[2], MOST_MODES


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
    arrays = _arrays(made, np.zeros((ROOM, max(n, 2 * SCAN))), gauge)
    # what moves: MOTION, the last blow, the record, rows of modes
    w_at = lines(RECORD + STATE_BYTES)
    wp_at = w_at + lines(8 * ROWS * n)
    moving_bytes = wp_at + lines(8 * PISTON_ROWS * n_p)
    entries_at = lines(HEAD_BYTES)
    par_at = entries_at + lines(8 * ENTRIES * ENTRY_WORDS)
    state_at = par_at + lines(PAR_BYTES)
    left_at = state_at + moving_bytes
    blows_at = left_at + 3 * moving_bytes
    tables_at = blows_at + lines(BLOW_ROOM * BLOW_BYTES + EVENT_BYTES + 2 * READING_BYTES)
    total = tables_at + _table_bytes(arrays)
    base = allocate(total)
    if base == 0:
        return base
    head = head_records(base, 1)[0]
    head.bytes, head.state_at, head.state_bytes, head.kind = (
        total, state_at, moving_bytes, Kind.MODAL.value
    )  # fmt: skip
    head.entries_at, head.par_at, head.blows_at, head.record_at = (
        entries_at, par_at, blows_at, RECORD
    )  # fmt: skip
    head.left_at, head.here_at = left_at, left_at + moving_bytes
    head.trial_at = left_at + 2 * moving_bytes
    _copy_tables(base, tables_at, arrays)
    d = _entries(base)
    d[W_AT, 0], d[W_AT, 1], d[W_AT, 2] = w_at, ROWS, n
    d[WP_AT, 0], d[WP_AT, 1], d[WP_AT, 2] = wp_at, PISTON_ROWS, n_p
    parameters(base)[0] = par[0]
    head.gauge_bar, head.gauge_above, head.gauge_area = bar, above, area
    w = matrix_at(base + state_at + w_at, ROWS, n)
    begin(par[0], state_in(base + state_at)[0], w, made.forms.sizes[0], numbers)
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
    """Whether nothing has to be done to come to a time: a leap that is pending passes it."""
    head = head_records(base, 1)[0]
    s = state_in(base + head.state_at)[0]
    return s.leap_end > math.floor(t / parameters(base)[0].tick + TICK_ROUNDING)


@preparing
def go(base, task, t, room):
    """Advance the state or commit it, with room for so many blows; status and blows."""
    head = head_records(base, 1)[0]
    moving = base + head.state_at
    state, blows = state_in(moving), blow_records(base + head.blows_at, room)
    events = event_records(base + head.blows_at + BLOW_ROOM * BLOW_BYTES, 1)
    reading = reading_records(base + head.blows_at + BLOW_ROOM * BLOW_BYTES + EVENT_BYTES, 1)
    state[0].events_on = 0
    bars = bars_in(base, moving)
    wanted = Task.ADVANCE.value if task == ADVANCE else Task.COMMIT.value
    status = run(wanted, parameters(base), state, bars, t, blows, events, reading)
    return status, state[0].n_blows


@preparing
def read(base, moving, t, reading, peaks):
    """Carry a copy of what moves to a time and read it."""
    head = head_records(base, 1)[0]
    state = state_in(moving)
    if not peaks:
        state[0].peak_from = math.inf
    blows = blow_records(base + head.blows_at, BLOW_ROOM)
    events = event_records(base + head.blows_at + BLOW_ROOM * BLOW_BYTES, 1)
    bars = bars_in(base, moving)
    run(Task.READ.value, parameters(base), state, bars, t, blows, events, reading)


@preparing
def find_fault(base, moving, t, facts):
    """Number of the fault of what moves, from outside; its facts are filled in."""
    state, d = state_in(moving), _entries(base)
    words = words_at(moving + RECORD, STATE_BYTES // 8)
    k = first_beyond(words, words.view(np.float64), LOW, HIGH, MAY_BE_NAN, WHOLE)
    if k >= 0:
        value = float(words[k]) if WHOLE[k] else words.view(np.float64)[k]
        facts[0], facts[1] = k + 1.0, value
        facts[2], facts[3] = LOW[k], HIGH[k]
        return Fault.MODAL_FIELD.value
    rows = floats_at(moving + d[W_AT, 0], d[W_AT, 1] * d[W_AT, 2])
    others = floats_at(moving + d[WP_AT, 0], d[WP_AT, 1] * d[WP_AT, 2])
    if not (is_bounded(rows) and is_bounded(others)):
        return Fault.WORKSPACE.value
    sizes, law_sizes = words_1(base, d, SIZES), words_1(base, d, LAW_SIZES)
    tick = parameters(base)[0].tick
    number, facts[0], facts[1] = state_fault(state[0], sizes, law_sizes, tick, t)
    return Fault.MODAL_STATE.value + number - 1 if number > 0 else 0
