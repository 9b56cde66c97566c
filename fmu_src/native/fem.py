"""Motions by finite elements in plain memory."""

from __future__ import annotations

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
    hold,
    lines,
    put_tables,
    table_bytes,
    viewing,
)
from fmu_src.native.messages import Fault
from percussion_model.physics.kernel import preparing
from percussion_model.solvers.cells import find_cell
from percussion_model.solvers.fem.advance import run
from percussion_model.solvers.fem.advance import time_of_blow as blow_of
from percussion_model.solvers.fem.bars import force_in
from percussion_model.solvers.fem.mesh import cut_bars, elements_wanted, mesh_of
from percussion_model.solvers.fem.prepare import begin, fill_fem_parameters
from percussion_model.solvers.fem.records import (
    FEM_LIMITS,
    FEM_PAR,
    FEM_STATE,
    Column,
    Elements,
    Factor,
    FemTask,
    Key,
    Node,
    Probe,
    Stage,
)
from percussion_model.solvers.setup import MOST_CELLS

parameters, state_in = views_of(FEM_PAR, FEM_STATE)
LOW, HIGH, MAY_BE_NAN, WHOLE = FEM_LIMITS.rows
PAR_BYTES = FEM_PAR.itemsize
WORK = work_at(FEM_STATE)  # place of the nodes in what moves
ROWS, FACTOR_ROWS, KEYS, STAGES = len(Node), 2 * len(Factor), len(Key), len(Stage)
PROBES, COLUMNS = len(Probe), len(Column)
# A state is no more than a step, and rounding, behind the present [steps].
MOST_BEHIND = 2.0
MESH, FACTORS, TRIAL, PROBE, NODES = range(5)


@viewing
def elements_in(base, moving):
    """`Elements` of what moves, or of a copy of it, at an address."""
    d = directory(base)
    return Elements(
        floats_2(moving, d, NODES), floats_2(base, d, MESH), floats_2(base, d, FACTORS),
        floats_2(base, d, TRIAL), floats_2(base, d, PROBE),
    )  # fmt: skip


@preparing
def refuse(numbers, facts):
    """Number of why a scene cannot be set up, 0 for none: too many elements."""
    facts[0], facts[1] = elements_wanted(numbers), MOST_CELLS
    return 0 if facts[0] <= facts[1] else Fault.ELEMENTS.value


@preparing
def create(numbers, bar, place):
    """Make the memory of a motion at time zero; its address, 0 where there is no memory left."""
    bars = cut_bars(numbers)
    mesh = mesh_of(bars)
    n = mesh.shape[1]
    par = np.zeros(1, FEM_PAR)
    fill_fem_parameters(par[0], numbers, bars)
    room = (
        np.zeros((FACTOR_ROWS, max(n, KEYS))), np.zeros((STAGES, n)), np.zeros((PROBES, COLUMNS)),
    )  # fmt: skip
    moving = WORK + lines(8 * ROWS * n)
    base, room_at, tables_at = make_memory(
        Kind.FEM.value, PAR_BYTES, moving, table_bytes(room), table_bytes((mesh,))
    )
    if base == 0:
        return base
    d = directory(base)
    put_tables(base, d, MESH, tables_at, (mesh,))
    put_tables(base, d, FACTORS, room_at, room)
    enter(d, NODES, WORK, ROWS, n)
    parameters(base)[0] = par[0]
    hold(par)
    if bar != GaugeBar.NONE:
        masses, sections = bars.bit.mass, numbers.bit
        if bar == GaugeBar.PISTON:
            masses, sections = bars.piston.mass, numbers.piston
        cell, area = find_cell(sections, masses, place)
        set_gauge(base, bar, cell, 0.0, 0.0, area)
    at = base + head_records(base, 1)[0].state_at
    elements = elements_in(base, at)
    begin(parameters(base)[0], state_in(at)[0], elements.w, elements.c, numbers)
    return base


@preparing
def state_time(moving):
    """Time up to which a state is committed [s]."""
    return state_in(moving)[0].time


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
    elements = elements_in(base, moving)
    wanted = FemTask.ADVANCE.value if task == ADVANCE else FemTask.COMMIT.value
    status = run(wanted, parameters(base), state, elements, t, blows, events, reading_of(base))
    return status, state[0].n_blows


@preparing
def take_inputs(base):
    """Let modes follow inputs that have changed."""
    state_in(base + head_records(base, 1)[0].state_at)[0].inputs_changed = 1


@preparing
def read(base, moving, t, reading):
    """Carry a copy of what moves to a time and read it."""
    state, blows, events = state_in(moving), blow_rows(base, BLOW_ROOM), event_rows(base)
    elements = elements_in(base, moving)
    run(FemTask.READ.value, parameters(base), state, elements, t, blows, events, reading)


@preparing
def stress(base, moving):
    """Stress at the gauge in a copy of what moves [Pa]."""
    head, elements = head_records(base, 1)[0], elements_in(base, moving)
    first = 0 if head.gauge_bar == GaugeBar.PISTON else parameters(base)[0].n_p
    return force_in(elements.c, elements.w, first, head.gauge_cell) / head.gauge_area


@preparing
def find_fault(base, moving, t, facts):
    """Number of the fault of what moves, from outside; its facts are filled in."""
    number = Fault.FEM_FIELD.value
    fault = record_fault(moving, LOW, HIGH, MAY_BE_NAN, WHOLE, number, facts)
    if fault > 0:
        return fault
    if not arrays_are_bounded(base, moving, NODES, 1):
        return Fault.WORKSPACE.value
    facts[0], facts[1] = state_time(moving), t
    return 0 if facts[0] >= t - MOST_BEHIND * parameters(base)[0].dt else Fault.BEHIND.value
