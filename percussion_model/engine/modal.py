"""Entries of the modal solver (`percussion_model.engine.entries`)."""

from __future__ import annotations

import math

import numpy as np

from percussion_model.engine import layout
from percussion_model.engine.checks import arrays_are_bounded, record_fault
from percussion_model.engine.faults import Fault
from percussion_model.engine.image import new_values, numbers_in
from percussion_model.engine.memory import (
    enter,
    floats_1,
    floats_2,
    floats_3,
    floats_4,
    floats_at,
    hold,
    lines,
    matrix_at,
    new_record,
    put_tables,
    table_bytes,
    viewing,
    words_1,
    words_2,
    words_at,
)
from percussion_model.engine.records import ADVANCE, GaugeBar, Kind, work_at
from percussion_model.engine.sampling import sampler
from percussion_model.engine.settling import settler
from percussion_model.physics.kernel import preparing
from percussion_model.solvers.cells import find_cell
from percussion_model.solvers.modal.advance import TICK_ROUNDING, portion
from percussion_model.solvers.modal.advance import run as run_task
from percussion_model.solvers.modal.advance import time_of_blow as blow_of
from percussion_model.solvers.modal.faults import find_fault as state_fault
from percussion_model.solvers.modal.fields import loads_of, places_of, take_rest, total
from percussion_model.solvers.modal.modes import shapes_at
from percussion_model.solvers.modal.pairs import law_wanted
from percussion_model.solvers.modal.prepare import (
    begin,
    fill_modal_parameters,
    forms_for,
    modes_wanted,
    tables_of,
)
from percussion_model.solvers.modal.records import (
    JOINED,
    LONGEST_STRIDE,
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
from percussion_model.solvers.setup import elastic_piston
from percussion_model.solvers.state import words_of

parameters, state_in = layout.views_of(MODAL_PAR, MODAL_STATE)
new_parameters = new_record(MODAL_PAR)
LOW, HIGH, MAY_BE_NAN, WHOLE = MODAL_LIMITS.rows
PAR_BYTES = MODAL_PAR.itemsize
WORK = work_at(MODAL_STATE)  # place of the first array in what moves
FREE = 2 * JOINED  # column of a gauge for a free piston
ROWS_LISTED = tuple(words_of(MODAL_STATE)[name] for name in ("n_blows", "n_events"))
# Rows of modes and of the piston's in what moves, and of the room of a step.
ROWS, PISTON_ROWS, ROOM = 8, 2, 8
(
    SIZES, STIFF, SHAPE, MOVE, YIELDS, CHANGE, JOIN,
    LAW_SIZES, DASHPOT, LAW_MOVE, ENDS, OUT, INTO, TAKEN, REST, VIEWS, SCANS, SIDES, WAY, OVER,
    PUSHED, HELD, SHAPE_P, MOVE_P, GAUGE_AT, ROOM_AT, W_AT, WP_AT,
) = range(28)  # fmt: skip


@viewing
def bars_in(base, moving):
    """`Bars` of what moves, or of a copy of it, at an address."""
    d = layout.directory(base)
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
        floats_3(base, d, OVER), floats_3(base, d, PUSHED), floats_3(base, d, HELD),
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
        laws.views, laws.scans, laws.sides, laws.way, laws.over, laws.pushed, laws.held,
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
    head = layout.head_records(base, 1)[0]
    par, s, bars = parameters(base)[0], state_in(moving)[0], bars_in(base, moving)
    rows = floats_2(base, layout.directory(base), GAUGE_AT)
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
def refuse(image, facts):
    """Number of why a scene cannot be set up, 0 for none: too many modes."""
    values, par, told = new_values(), new_parameters(), floats_at(facts, 4)
    numbers = numbers_in(image, values)
    request = fill_modal_parameters(par[0], numbers)
    told[0], told[1] = modes_wanted(numbers, request)[2], MOST_MODES
    hold(par)
    hold(values)
    return Fault.MODES.value if told[0] > told[1] else 0


@preparing
def table_key(image, key):
    """Fill in what tables follow from besides the bars; how many numbers."""
    values, par = new_values(), new_parameters()
    numbers = numbers_in(image, values)
    request, out = fill_modal_parameters(par[0], numbers), floats_at(key, 7)
    out[0], out[1], out[2] = request.piston_mass, request.springs[0], request.springs[1]
    out[3], out[4], out[5] = request.dashpot, request.highest, request.eta
    out[6] = request.tick
    hold(par)
    hold(values)
    return 7


@preparing
def _take_tables(base, like):
    """Let a motion use the tables of another one."""
    mine, other = layout.directory(base), layout.directory(like)
    for k in range(ROOM_AT):
        mine[k] = other[k]
        mine[k, 0] += like - base


@preparing
def _enter_moving(base, n, n_p):
    """Enter the arrays of what moves."""
    d = layout.directory(base)
    enter(d, W_AT, WORK, ROWS, n)
    enter(d, WP_AT, WORK + lines(8 * ROWS * n), PISTON_ROWS, n_p)


@preparing
def _make(numbers, par, request, bar, place):
    """Make the memory of a motion with tables of its own."""
    made = tables_of(numbers, request)
    n, n_p = made.forms.shape.shape[2], made.shape_p.shape[1]
    gauge, above, area = np.zeros((0, 0)), 0.0, 1.0
    if bar != GaugeBar.NONE:
        gauge, above, area = gauge_rows(numbers, made, par[0].dt, bar, place)
    tables, room = _tables(made, gauge), (np.zeros((ROOM, max(n, 2 * SCAN))),)
    moving = WORK + lines(8 * ROWS * n) + lines(8 * PISTON_ROWS * n_p)
    base, room_at, tables_at = layout.make_memory(
        Kind.MODAL.value, PAR_BYTES, moving, table_bytes(room), table_bytes(tables)
    )
    if base != 0:
        put_tables(base, layout.directory(base), 0, tables_at, tables)
        put_tables(base, layout.directory(base), ROOM_AT, room_at, room)
        _enter_moving(base, n, n_p)
        layout.set_gauge(base, bar, 0, above, 0.0, area)
    return base


@preparing
def _make_like(like):
    """Make the memory of a motion that uses the tables of another one."""
    other = layout.directory(like)
    n, n_p = other[W_AT, 2], other[WP_AT, 2]
    room = (np.zeros((ROOM, max(n, 2 * SCAN))),)
    moving = WORK + lines(8 * ROWS * n) + lines(8 * PISTON_ROWS * n_p)
    base, room_at, _ = layout.make_memory(Kind.MODAL.value, PAR_BYTES, moving, table_bytes(room), 0)
    if base != 0:
        _take_tables(base, like)
        put_tables(base, layout.directory(base), ROOM_AT, room_at, room)
        _enter_moving(base, n, n_p)
        layout.set_gauge(base, GaugeBar.NONE.value, 0, 0.0, 0.0, 1.0)
    return base


@preparing
def create(image, bar, place, like):
    """Make the memory of a motion at time zero; its address, 0 where there is no memory left.

    Parameters
    ----------
    image : int
        Address of the image of a scene that `refuse` passes.
    bar : int
        `GaugeBar`.
    place : float
        Of the gauge, from the top of its bar [m].
    like : int
        Address of a motion with the same bars and `table_key`, whose tables this one uses as
        long as it is there; 0: none. Only without a gauge.
    """
    values, par = new_values(), new_parameters()
    numbers = numbers_in(image, values)
    request = fill_modal_parameters(par[0], numbers)
    base = _make_like(like) if like != 0 else _make(numbers, par, request, bar, place)
    if base != 0:
        parameters(base)[0] = par[0]
        layout.describe(base, ROWS_LISTED, (W_AT, 2), par[0].dt, 0.0)
        at = base + layout.head_records(base, 1)[0].state_at
        bars = bars_in(base, at)
        begin(par[0], state_in(at)[0], bars.w, bars.forms.sizes[0], numbers)
    hold(par)
    hold(values)
    return base


@preparing
def state_time(base, moving):
    """Time up to which a state is committed [s]."""
    return state_in(moving)[0].time * parameters(base)[0].tick


@preparing
def grid_point_after(base, moving, t):
    """First tick at or after a time [s]."""
    tick = parameters(base)[0].tick
    return math.ceil(t / tick - TICK_ROUNDING) * tick


@preparing
def readable_until(base, moving):
    """Time up to which a copy can be read without advancing it far [s]."""
    s = state_in(moving)[0]
    go = LONGEST_STRIDE if s.law >= 0 else 1
    return max(s.leap_end, s.time + (go << STEP)) * parameters(base)[0].tick


@preparing
def is_quiet(base, moving, t):
    """Whether nothing has to be done to come to a time: a leap, or a step, passes it."""
    par = parameters(base)[0]
    s, end = state_in(moving)[0], math.floor(t / par.tick + TICK_ROUNDING)
    if s.leap_end >= 0:
        return s.leap_end > end
    law = law_wanted(par, s, bars_in(base, moving).laws)
    return s.time + (portion(s, law) if law >= 0 else 1 << STEP) > end


@preparing
def time_of_blow(base, moving):
    """Time by which what is pending is over, if a blow may start in it [s]; 0 if none may."""
    return blow_of(parameters(base), state_in(moving), bars_in(base, moving))


@preparing
def run(base, moving, task, t, blows, room, events, event_room, events_on):
    """Advance the state or commit it; a `Status`."""
    state = state_in(moving)
    state[0].events_on = events_on
    wanted = Task.ADVANCE.value if task == ADVANCE else Task.COMMIT.value
    return run_task(
        wanted, parameters(base), state, bars_in(base, moving), t, layout.blow_records(blows, room),
        layout.event_records(events, event_room), layout.reading_of(base),
    )  # fmt: skip


@preparing
def read(base, moving, copy, t, reading, peaks):
    """Carry a copy of what moves to a time and read it; a `Status`."""
    layout.copy_moving(base, moving, copy)
    state = state_in(copy)
    if peaks < 1:
        state[0].peak_from = math.inf
    return run_task(
        Task.READ.value, parameters(base), state, bars_in(base, copy), t, layout.blow_rows(base),
        layout.event_rows(base), layout.reading_records(reading, 1),
    )  # fmt: skip


@preparing
def find_fault(base, moving, t, facts):
    """Number of the fault of what moves, from outside; its facts are filled in."""
    number, told = Fault.MODAL_FIELD.value, floats_at(facts, 4)
    fault = record_fault(moving, LOW, HIGH, MAY_BE_NAN, WHOLE, number, told)
    if fault > 0:
        return fault
    if not arrays_are_bounded(base, moving, W_AT, 2):
        return Fault.WORKSPACE.value
    d = layout.directory(base)
    sizes, law_sizes = words_1(base, d, SIZES), words_1(base, d, LAW_SIZES)
    tick, s = parameters(base)[0].tick, state_in(moving)[0]
    number, told[0], told[1] = state_fault(s, sizes, law_sizes, tick, t)
    return Fault.MODAL_STATE.value + number - 1 if number > 0 else 0


@preparing
def cells(image, bar, counts, masses):
    """Cells of a bar in which fields are read; how many.

    Parameters
    ----------
    bar : int
        `GaugeBar`.
    counts, masses : int
        Addresses: cells of each section, mass of each cell [kg]; 0: not wanted.
    """
    values, par = new_values(), new_parameters()
    numbers = numbers_in(image, values)
    fill_modal_parameters(par[0], numbers)
    sections = elastic_piston(numbers) if bar == GaugeBar.PISTON else numbers.bit
    in_sections, _, _, mass = places_of(sections, par[0].dt)
    if counts != 0:
        words_at(counts, len(in_sections))[:] = in_sections
    if masses != 0:
        floats_at(masses, len(mass))[:] = mass
    hold(par)
    hold(values)
    return len(mass)


@preparing
def shape_form(base, moving, bar):
    """Which shapes `fields` needs of a bar: those of a form, or FREE for those of the piston."""
    form = state_in(moving)[0].form
    return FREE if bar == GaugeBar.PISTON and form < JOINED else form


@preparing
def shapes(image, bar, form, out):
    """Fill in what modes have in the cells of a bar, first of velocity and then of force.

    Parameters
    ----------
    form : int
        As `shape_form` has it.
    out : int
        Address of two matrices, modes by cells; 0: not wanted.

    Returns
    -------
    int
        How many modes.
    """
    values, par = new_values(), new_parameters()
    numbers = numbers_in(image, values)
    request = fill_modal_parameters(par[0], numbers)
    sections = elastic_piston(numbers) if bar == GaugeBar.PISTON else numbers.bit
    _, section, share, _ = places_of(sections, par[0].dt)
    _, modes, free = forms_for(numbers, request)
    first = len(elastic_piston(numbers)) if bar == GaugeBar.BIT and form >= JOINED else 0
    chosen = free if form == FREE else modes[form]
    offset, force = shapes_at(chosen, first + section, share)
    count, n = offset.shape
    if out != 0:
        matrix_at(out, count, n)[:] = offset
        matrix_at(out + 8 * count * n, count, n)[:] = force
    hold(par)
    hold(values)
    return count


@preparing
def fields(base, moving, bar, masses, made, modes, count, force, velocity):
    """Fill in elastic force [N] and velocity [m/s] of each cell of a bar.

    Parameters
    ----------
    masses, made : int
        Addresses of what `cells` and `shapes` gave.
    modes, count : int
        How many of them, and how many cells.
    force, velocity : int
        Addresses.
    """
    par, s, bars = parameters(base)[0], state_in(moving)[0], bars_in(base, moving)
    mass, form, on_piston = floats_at(masses, count), s.form, bar == GaugeBar.PISTON
    a_p, a_b = loads_of(par, s, bars.forms.stiff[form])
    free = on_piston and form < JOINED
    own = np.zeros((2, max(bars.wp.shape[1] + 1, bars.w.shape[1])))
    if free:
        own[:, 1 : bars.wp.shape[1] + 1] = bars.wp[:2]
    else:
        take_rest(bars.w, bars.forms.shape[form], s.active, own)
    offsets = matrix_at(made, modes, count)
    forces = matrix_at(made + 8 * modes * count, modes, count)
    held = par.mass_p * a_p if form >= JOINED and not on_piston else 0.0
    a, mean, above = a_p if on_piston else a_b, s.v_p if free else 0.0, 0.0
    out, speed = floats_at(force, count), floats_at(velocity, count)
    for j in range(count):
        above += mass[j]
        out[j] = total(forces, j, own, 0) + (held + a * (above - 0.5 * mass[j]))
        speed[j] = total(offsets, j, own, 1) + mean
    return 0


sample = sampler(run, read, state_time, time_of_blow)
settle = settler(run, state_time)
