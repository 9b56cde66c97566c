"""Entries of the wave solver (`percussion_model.engine.entries`)."""

from __future__ import annotations

import math

from percussion_model.engine import layout
from percussion_model.engine.checks import arrays_are_bounded, record_fault, time_fault
from percussion_model.engine.defaults import shape_form, shapes, table_key  # noqa: F401  # entries
from percussion_model.engine.faults import Fault
from percussion_model.engine.image import gauge_sections, new_values, numbers_in
from percussion_model.engine.memory import (
    enter,
    floats_2,
    floats_at,
    hold,
    lines,
    new_record,
    put_tables,
    table_bytes,
    viewing,
    words_2,
    words_at,
)
from percussion_model.engine.records import RECORD, GaugeBar, Kind, work_at
from percussion_model.engine.sampling import sampler
from percussion_model.engine.settling import settler
from percussion_model.physics.kernel import preparing
from percussion_model.solvers.cells import find_cell
from percussion_model.solvers.setup import MOST_CELLS
from percussion_model.solvers.state import words_of
from percussion_model.solvers.wave.advance import GRID_ROUNDING
from percussion_model.solvers.wave.advance import run as run_task
from percussion_model.solvers.wave.advance import time_of_blow as blow_of
from percussion_model.solvers.wave.network import network_of, plan_of
from percussion_model.solvers.wave.prepare import begin, fill_wave_parameters
from percussion_model.solvers.wave.records import (
    WAVE_LIMITS,
    WAVE_PAR,
    WAVE_STATE,
    Bar,
    Body,
    Chain,
    Has,
    Place,
    Task,
    Waves,
)
from percussion_model.solvers.wave.sections import CAME_ROWS, cell_masses, fill_cells, force_in

parameters, state_in = layout.views_of(WAVE_PAR, WAVE_STATE)
new_parameters = new_record(WAVE_PAR)
LOW, HIGH, MAY_BE_NAN, WHOLE = WAVE_LIMITS.rows
PAR_BYTES = WAVE_PAR.itemsize
WORK = work_at(WAVE_STATE)  # place of the first array in what moves
ROWS_LISTED = tuple(words_of(WAVE_STATE)[name] for name in ("n_blows", "n_events"))
BAR_ROWS, JOINT_ROWS = len(Bar), len(Has)
CELLS, GIVEN = Place.CELLS.value, Bar.GIVEN.value
PLACES, STEEL, WEIGHTS, PASSAGE, FITS, BODIES, BARS, JOINTS, CAME, RINGS = range(10)


@viewing
def chain_of(base):
    """`Chain` of a motion."""
    d = layout.directory(base)
    return Chain(
        words_2(base, d, PLACES), floats_2(base, d, STEEL), floats_2(base, d, WEIGHTS),
        floats_2(base, d, PASSAGE), floats_2(base, d, FITS), floats_2(base, d, BODIES),
    )  # fmt: skip


@viewing
def waves_in(base, moving, own):
    """`Waves` of what moves with its rings, and the rest of it or of a copy, at an address."""
    d = layout.directory(base)
    return Waves(
        floats_2(moving, d, RINGS), floats_2(own, d, BARS), floats_2(own, d, JOINTS),
        floats_2(own, d, CAME),
    )  # fmt: skip


@preparing
def refuse(image, facts):
    """Number of why a scene cannot be set up, 0 for none: too many cells, or too short steps."""
    values, told, fault = new_values(), floats_at(facts, 4), 0
    numbers = numbers_in(image, values)
    plan = plan_of(numbers)
    told[0], told[1] = plan.cells, MOST_CELLS
    if not plan.cells <= MOST_CELLS:
        fault = Fault.CELLS.value
    else:
        told[0], told[1], told[2] = plan.eta, network_of(numbers, plan).too_fine, plan.time_step
        if told[1] > 0.0:
            fault = Fault.TOO_FINE.value
    hold(values)
    return fault


@preparing
def _which(bar, struck, bars):
    """Number of a bar: the piston comes first and the bit last."""
    if bar == GaugeBar.PISTON:
        return 0
    return bars - 1 if bar == GaugeBar.BIT else struck + bar - GaugeBar.ROD


@preparing
def _make(numbers, bar, place):
    """Make the memory of a motion, with all that never changes."""
    plan = plan_of(numbers)
    network = network_of(numbers, plan)
    chain = network.chain
    par = new_parameters()
    fill_wave_parameters(par[0], numbers, plan, network)
    arrays = (chain.places, chain.steel, chain.weights, chain.passage, chain.fits, chain.bodies)
    bars, joints = len(chain.bodies), max(1, len(chain.fits))
    came = max(len(chain.places), bars)
    joints_at = WORK + lines(8 * BAR_ROWS * bars)
    came_at = joints_at + lines(8 * JOINT_ROWS * joints)
    rings_at = came_at + lines(8 * CAME_ROWS * came)
    moving = rings_at + lines(8 * network.rings)
    base, _, tables_at = layout.make_memory(
        Kind.WAVE.value, PAR_BYTES, moving, 0, table_bytes(arrays)
    )
    if base == 0:
        return base
    d = layout.directory(base)
    put_tables(base, d, 0, tables_at, arrays)
    enter(d, BARS, WORK, BAR_ROWS, bars)
    enter(d, JOINTS, joints_at, JOINT_ROWS, joints)
    enter(d, CAME, came_at, CAME_ROWS, came)
    enter(d, RINGS, rings_at, 1, network.rings)
    parameters(base)[0] = par[0]
    layout.describe(base, ROWS_LISTED, (BARS, 4), plan.time_step, network.misfit)
    hold(par)
    if bar != GaugeBar.NONE:
        which = _which(bar, network.struck, bars)
        cell, area = find_cell(gauge_sections(numbers, bar), cell_masses(chain, which), place)
        layout.set_gauge(base, bar, cell, 0.0, 0.0, area)
    return base


@preparing
def create(image, bar, place, like):
    """Make the memory of a motion at time zero; its address, 0 where there is no memory left."""
    values = new_values()
    numbers = numbers_in(image, values)
    base = _make(numbers, bar, place)
    if base != 0:
        at = base + layout.head_records(base, 1)[0].state_at
        begin(parameters(base)[0], state_in(at)[0], chain_of(base), waves_in(base, at, at), numbers)
    hold(values)
    return base


@preparing
def state_time(base, moving):
    """Time up to which a state is committed [s]."""
    s = state_in(moving)[0]
    return s.t_base + s.step * parameters(base)[0].dt


@preparing
def grid_point_after(base, moving, t):
    """First grid point at or after a time [s]."""
    s, dt = state_in(moving)[0], parameters(base)[0].dt
    return s.t_base + math.ceil((t - s.t_base) / dt - GRID_ROUNDING) * dt


@preparing
def readable_until(base, moving):
    """Time up to which a copy can be read without advancing it far [s]."""
    s = state_in(moving)[0]
    return s.t_base + (s.step + 1) * parameters(base)[0].dt


@preparing
def is_quiet(base, moving, t):
    """Whether nothing has to be done to come to a time: a step passes it."""
    s = state_in(moving)[0]
    return (t - s.t_base) / parameters(base)[0].dt + GRID_ROUNDING < s.step + 1


@preparing
def time_of_blow(base, moving):
    """Time at which the pending step is over, if a blow may start in it [s]; 0 if none may."""
    return blow_of(parameters(base), state_in(moving))


@preparing
def run(base, moving, task, t, blows, room, events, event_room, events_on):
    """Advance the state; a `Status`. To commit is to advance to a grid point."""
    state = state_in(moving)
    state[0].events_on = events_on
    return run_task(
        Task.ADVANCE.value, parameters(base), state, chain_of(base),
        waves_in(base, moving, moving), t, layout.blow_records(blows, room),
        layout.event_records(events, event_room), layout.reading_of(base),
    )  # fmt: skip


@preparing
def read(base, moving, copy, t, reading, peaks):
    """Carry a copy of what moves to a time and read it; a `Status`.

    The rings, far larger than the rest, are left alone, and are not copied.
    """
    count = (layout.directory(base)[RINGS, 0] - RECORD) // 8
    layout.copy_words(moving + RECORD, copy + RECORD, count)
    state = state_in(copy)
    if peaks < 1:
        state[0].peak_from = math.inf
    task = Task.READ.value if peaks >= 0 else Task.SAMPLE.value
    return run_task(
        task, parameters(base), state, chain_of(base), waves_in(base, moving, copy), t,
        layout.blow_rows(base), layout.event_rows(base), layout.reading_records(reading, 1),
    )  # fmt: skip


@preparing
def stress(base, moving):
    """Stress at the gauge in what moves [Pa]."""
    head, chain = layout.head_records(base, 1)[0], chain_of(base)
    bar = _which(head.gauge_bar, parameters(base)[0].struck, len(chain.bodies))
    rings, step = waves_in(base, moving, moving).rings, state_in(moving)[0].step
    return force_in(chain, rings, step, bar, head.gauge_cell) / head.gauge_area


@preparing
def find_fault(base, moving, t, facts):
    """Number of the fault of what moves, from outside; its facts are filled in."""
    number, told = Fault.WAVE_FIELD.value, floats_at(facts, 4)
    fault = record_fault(moving, LOW, HIGH, MAY_BE_NAN, WHOLE, number, told)
    if fault > 0:
        return fault
    if not arrays_are_bounded(base, moving, BARS, 4):
        return Fault.WORKSPACE.value
    return time_fault(state_time(base, moving), t, parameters(base)[0].dt, told)


@preparing
def cells(image, bar, counts, masses):
    """Cells of a bar in which fields are read; how many, 0 where there is none.

    Parameters
    ----------
    bar : int
        `GaugeBar`.
    counts, masses : int
        Addresses: cells of each section, mass of each cell [kg]; 0: not wanted.
    """
    values = new_values()
    numbers = numbers_in(image, values)
    network = network_of(numbers, plan_of(numbers))
    chain = network.chain
    which = _which(bar, network.struck, len(chain.bodies))
    if bar == GaugeBar.PISTON and network.struck == 0:
        hold(values)
        return 0
    first, last = int(chain.bodies[which, Body.FIRST]), int(chain.bodies[which, Body.LAST])
    mass = cell_masses(chain, which)
    if counts != 0:
        words_at(counts, last + 1 - first)[:] = chain.places[first : last + 1, CELLS]
    if masses != 0:
        floats_at(masses, len(mass))[:] = mass
    hold(values)
    return len(mass)


@preparing
def fields(base, moving, bar, masses, made, modes, count, force, velocity):
    """Fill in elastic force [N] and velocity [m/s] of each cell of a bar.

    Parameters
    ----------
    count : int
        Cells.
    force, velocity : int
        Addresses.
    """
    chain, waves = chain_of(base), waves_in(base, moving, moving)
    which = _which(bar, parameters(base)[0].struck, len(chain.bodies))
    out, speed, step = floats_at(force, count), floats_at(velocity, count), state_in(moving)[0].step
    fill_cells(chain, waves.rings, step, which, out, speed)
    for k in range(count):
        speed[k] += 2.0 * waves.bars[GIVEN, which]
    return 0


sample = sampler(run, read, state_time, time_of_blow)
settle = settler(run, state_time)
