"""Motions by travelling waves in plain memory."""

from __future__ import annotations

import math

import numpy as np

from fmu_src.native.checks import arrays_are_bounded, record_fault
from fmu_src.native.image import gauge_sections
from fmu_src.native.layout import (
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
    hold,
    lines,
    put_tables,
    table_bytes,
    viewing,
    words_2,
)
from fmu_src.native.messages import Fault
from percussion_model.physics.kernel import preparing
from percussion_model.solvers.cells import find_cell
from percussion_model.solvers.setup import MOST_CELLS
from percussion_model.solvers.wave.advance import GRID_ROUNDING, run
from percussion_model.solvers.wave.advance import time_of_blow as blow_of
from percussion_model.solvers.wave.network import network_of, plan_of
from percussion_model.solvers.wave.prepare import begin, fill_wave_parameters
from percussion_model.solvers.wave.records import (
    WAVE_LIMITS,
    WAVE_PAR,
    WAVE_STATE,
    Bar,
    Chain,
    Has,
    Task,
    Waves,
)
from percussion_model.solvers.wave.sections import CAME_ROWS, cell_masses, force_in

parameters, state_in = views_of(WAVE_PAR, WAVE_STATE)
LOW, HIGH, MAY_BE_NAN, WHOLE = WAVE_LIMITS.rows
PAR_BYTES = WAVE_PAR.itemsize
WORK = work_at(WAVE_STATE)  # place of the first array in what moves
BAR_ROWS, JOINT_ROWS = len(Bar), len(Has)
# A state is no more than a step, and rounding, behind the present [steps].
MOST_BEHIND = 2.0
PLACES, STEEL, WEIGHTS, PASSAGE, FITS, BODIES, BARS, JOINTS, CAME, RINGS = range(10)


@viewing
def chain_of(base):
    """`Chain` of a motion."""
    d = directory(base)
    return Chain(
        words_2(base, d, PLACES), floats_2(base, d, STEEL), floats_2(base, d, WEIGHTS),
        floats_2(base, d, PASSAGE), floats_2(base, d, FITS), floats_2(base, d, BODIES),
    )  # fmt: skip


@viewing
def waves_in(base, moving):
    """`Waves` of what moves, or of a copy of it, at an address."""
    d = directory(base)
    return Waves(
        floats_2(moving, d, RINGS), floats_2(moving, d, BARS), floats_2(moving, d, JOINTS),
        floats_2(moving, d, CAME),
    )  # fmt: skip


@preparing
def refuse(numbers, facts):
    """Number of why a scene cannot be set up, 0 for none: too many cells, or too short steps."""
    plan = plan_of(numbers)
    facts[0], facts[1] = plan.cells, MOST_CELLS
    if not plan.cells <= MOST_CELLS:
        return Fault.CELLS.value
    facts[0], facts[1], facts[2] = plan.eta, network_of(numbers, plan).too_fine, plan.time_step
    return Fault.TOO_FINE.value if facts[1] > 0.0 else 0


@preparing
def _which(bar, struck, bars):
    """Number of a bar that carries the gauge: the piston comes first and the bit last."""
    if bar == GaugeBar.PISTON:
        return 0
    return bars - 1 if bar == GaugeBar.BIT else struck + bar - GaugeBar.ROD


@preparing
def create(numbers, bar, place):
    """Make the memory of a motion at time zero; its address, 0 where there is no memory left."""
    plan = plan_of(numbers)
    network = network_of(numbers, plan)
    chain = network.chain
    par = np.zeros(1, WAVE_PAR)
    fill_wave_parameters(par[0], numbers, plan, network)
    arrays = (chain.places, chain.steel, chain.weights, chain.passage, chain.fits, chain.bodies)
    bars, joints = len(chain.bodies), max(1, len(chain.fits))
    came = max(len(chain.places), bars)
    joints_at = WORK + lines(8 * BAR_ROWS * bars)
    came_at = joints_at + lines(8 * JOINT_ROWS * joints)
    rings_at = came_at + lines(8 * CAME_ROWS * came)
    moving = rings_at + lines(8 * network.rings)
    base, _, tables_at = make_memory(Kind.WAVE.value, PAR_BYTES, moving, 0, table_bytes(arrays))
    if base == 0:
        return base
    d = directory(base)
    put_tables(base, d, 0, tables_at, arrays)
    enter(d, BARS, WORK, BAR_ROWS, bars)
    enter(d, JOINTS, joints_at, JOINT_ROWS, joints)
    enter(d, CAME, came_at, CAME_ROWS, came)
    enter(d, RINGS, rings_at, 1, network.rings)
    parameters(base)[0] = par[0]
    hold(par)
    if bar != GaugeBar.NONE:
        which = _which(bar, network.struck, bars)
        cell, area = find_cell(gauge_sections(numbers, bar), cell_masses(chain, which), place)
        set_gauge(base, bar, cell, 0.0, 0.0, area)
    at = base + head_records(base, 1)[0].state_at
    begin(parameters(base)[0], state_in(at)[0], chain_of(base), waves_in(base, at), numbers)
    return base


@preparing
def state_time(base, moving):
    """Time up to which a state is committed [s]."""
    s = state_in(moving)[0]
    return s.t_base + s.step * parameters(base)[0].dt


@preparing
def grid_point_after(base, t):
    """First grid point at or after a time [s]."""
    s, dt = state_in(base + head_records(base, 1)[0].state_at)[0], parameters(base)[0].dt
    return s.t_base + math.ceil((t - s.t_base) / dt - GRID_ROUNDING) * dt


@preparing
def is_quiet(base, t):
    """Whether nothing has to be done to come to a time: a step passes it."""
    s = state_in(base + head_records(base, 1)[0].state_at)[0]
    return (t - s.t_base) / parameters(base)[0].dt + GRID_ROUNDING < s.step + 1


@preparing
def time_of_blow(base):
    """Time at which the pending step is over, if a blow may start in it [s]; 0 if none may."""
    return blow_of(parameters(base), state_in(base + head_records(base, 1)[0].state_at))


@preparing
def go(base, t, room):
    """Advance the state, with room for so many blows; status and blows."""
    moving = base + head_records(base, 1)[0].state_at
    state, blows, events = state_in(moving), blow_rows(base, room), event_rows(base)
    state[0].events_on = 0
    chain, waves = chain_of(base), waves_in(base, moving)
    status = run(
        Task.ADVANCE.value, parameters(base), state, chain, waves, t, blows, events,
        reading_of(base),
    )  # fmt: skip
    return status, state[0].n_blows


@preparing
def read(base, moving, t, reading, peaks):
    """Carry a copy of what moves to a time and read it."""
    state, blows, events = state_in(moving), blow_rows(base, BLOW_ROOM), event_rows(base)
    if not peaks:
        state[0].peak_from = math.inf
    chain, waves = chain_of(base), waves_in(base, moving)
    run(Task.READ.value, parameters(base), state, chain, waves, t, blows, events, reading)


@preparing
def stress(base, moving):
    """Stress at the gauge in a copy of what moves [Pa]."""
    head, chain = head_records(base, 1)[0], chain_of(base)
    bar = _which(head.gauge_bar, parameters(base)[0].struck, len(chain.bodies))
    rings, step = waves_in(base, moving).rings, state_in(moving)[0].step
    return force_in(chain, rings, step, bar, head.gauge_cell) / head.gauge_area


@preparing
def find_fault(base, moving, t, facts):
    """Number of the fault of what moves, from outside; its facts are filled in."""
    number = Fault.WAVE_FIELD.value
    fault = record_fault(moving, LOW, HIGH, MAY_BE_NAN, WHOLE, number, facts)
    if fault > 0:
        return fault
    if not arrays_are_bounded(base, moving, BARS, 4):
        return Fault.WORKSPACE.value
    facts[0], facts[1] = state_time(base, moving), t
    return 0 if facts[0] >= t - MOST_BEHIND * parameters(base)[0].dt else Fault.BEHIND.value
