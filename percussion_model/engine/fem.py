"""Entries of the finite-element solver (`percussion_model.engine.entries`)."""

from __future__ import annotations

import numpy as np

from percussion_model.engine import layout
from percussion_model.engine.checks import arrays_are_bounded, record_fault, time_fault
from percussion_model.engine.defaults import shape_form, shapes, table_key  # noqa: F401  # entries
from percussion_model.engine.faults import Fault
from percussion_model.engine.image import new_values, numbers_in
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
    words_at,
)
from percussion_model.engine.records import ADVANCE, GaugeBar, Kind, work_at
from percussion_model.engine.sampling import sampler
from percussion_model.engine.settling import settler
from percussion_model.physics.kernel import preparing
from percussion_model.solvers.cells import find_cell
from percussion_model.solvers.fem.advance import run as run_task
from percussion_model.solvers.fem.advance import time_of_blow as blow_of
from percussion_model.solvers.fem.bars import force_in
from percussion_model.solvers.fem.mesh import cut_bars, elements_wanted, mesh_of, section_count
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
    Mesh,
    Node,
    Probe,
    Stage,
)
from percussion_model.solvers.setup import MOST_CELLS
from percussion_model.solvers.state import words_of

parameters, state_in = layout.views_of(FEM_PAR, FEM_STATE)
new_parameters = new_record(FEM_PAR)
LOW, HIGH, MAY_BE_NAN, WHOLE = FEM_LIMITS.rows
PAR_BYTES = FEM_PAR.itemsize
WORK = work_at(FEM_STATE)  # place of the nodes in what moves
ROWS_LISTED = tuple(words_of(FEM_STATE)[name] for name in ("n_blows", "n_events"))
ROWS, FACTOR_ROWS, KEYS, STAGES = len(Node), 2 * len(Factor), len(Key), len(Stage)
PROBES, COLUMNS = len(Probe), len(Column)
MESH, FACTORS, TRIAL, PROBE, NODES = range(5)


@viewing
def elements_in(base, moving):
    """`Elements` of what moves, or of a copy of it, at an address."""
    d = layout.directory(base)
    return Elements(
        floats_2(moving, d, NODES), floats_2(base, d, MESH), floats_2(base, d, FACTORS),
        floats_2(base, d, TRIAL), floats_2(base, d, PROBE),
    )  # fmt: skip


@preparing
def refuse(image, facts):
    """Number of why a scene cannot be set up, 0 for none: too many elements."""
    values, told = new_values(), floats_at(facts, 4)
    numbers = numbers_in(image, values)
    told[0], told[1] = elements_wanted(numbers), MOST_CELLS
    hold(values)
    return 0 if told[0] <= told[1] else Fault.ELEMENTS.value


@preparing
def _make(numbers, bar, place):
    """Make the memory of a motion, with all that never changes."""
    bars = cut_bars(numbers)
    mesh = mesh_of(bars)
    n = mesh.shape[1]
    par = new_parameters()
    fill_fem_parameters(par[0], numbers, bars)
    room = (
        np.zeros((FACTOR_ROWS, max(n, KEYS))), np.zeros((STAGES, n)), np.zeros((PROBES, COLUMNS)),
    )  # fmt: skip
    moving = WORK + lines(8 * ROWS * n)
    base, room_at, tables_at = layout.make_memory(
        Kind.FEM.value, PAR_BYTES, moving, table_bytes(room), table_bytes((mesh,))
    )
    if base == 0:
        return base
    d = layout.directory(base)
    put_tables(base, d, MESH, tables_at, (mesh,))
    put_tables(base, d, FACTORS, room_at, room)
    enter(d, NODES, WORK, ROWS, n)
    parameters(base)[0] = par[0]
    layout.describe(base, ROWS_LISTED, (NODES, 1), par[0].dt, 0.0)
    hold(par)
    if bar != GaugeBar.NONE:
        masses, sections = bars.bit.mass, numbers.bit
        if bar == GaugeBar.PISTON:
            masses, sections = bars.piston.mass, numbers.piston
        cell, area = find_cell(sections, masses, place)
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
        elements = elements_in(base, at)
        begin(parameters(base)[0], state_in(at)[0], elements.w, elements.c, numbers)
    hold(values)
    return base


@preparing
def state_time(base, moving):
    """Time up to which a state is committed [s]."""
    return state_in(moving)[0].time


@preparing
def grid_point_after(base, moving, t):
    """The time itself, or that of the state if it comes later [s]."""
    return max(t, state_in(moving)[0].time)


@preparing
def readable_until(base, moving):
    """Time up to which a copy can be read without advancing it far [s]."""
    return state_in(moving)[0].time + parameters(base)[0].dt


@preparing
def is_quiet(base, moving, t):
    """False: that is not asked beforehand."""
    return False


@preparing
def time_of_blow(base, moving):
    """Time at which the pending step is over, if a blow may start in it [s]; 0 if none may."""
    return blow_of(parameters(base), state_in(moving))


@preparing
def run(base, moving, task, t, blows, room, events, event_room, events_on):
    """Advance the state or commit it; a `Status`."""
    state = state_in(moving)
    state[0].events_on = events_on
    wanted = FemTask.ADVANCE.value if task == ADVANCE else FemTask.COMMIT.value
    return run_task(
        wanted, parameters(base), state, elements_in(base, moving), t,
        layout.blow_records(blows, room), layout.event_records(events, event_room),
        layout.reading_of(base),
    )  # fmt: skip


@preparing
def read(base, moving, copy, t, reading, peaks):
    """Carry a copy of what moves to a time and read it; a `Status`."""
    layout.copy_moving(base, moving, copy)
    return run_task(
        FemTask.READ.value, parameters(base), state_in(copy), elements_in(base, copy), t,
        layout.blow_rows(base), layout.event_rows(base), layout.reading_records(reading, 1),
    )  # fmt: skip


@preparing
def stress(base, moving):
    """Stress at the gauge in a copy of what moves [Pa]."""
    head, elements = layout.head_records(base, 1)[0], elements_in(base, moving)
    first = 0 if head.gauge_bar == GaugeBar.PISTON else parameters(base)[0].n_p
    return force_in(elements.c, elements.w, first, head.gauge_cell) / head.gauge_area


@preparing
def find_fault(base, moving, t, facts):
    """Number of the fault of what moves, from outside; its facts are filled in."""
    number, told = Fault.FEM_FIELD.value, floats_at(facts, 4)
    fault = record_fault(moving, LOW, HIGH, MAY_BE_NAN, WHOLE, number, told)
    if fault > 0:
        return fault
    if not arrays_are_bounded(base, moving, NODES, 1):
        return Fault.WORKSPACE.value
    return time_fault(state_time(base, moving), t, parameters(base)[0].dt, told)


@preparing
def cells(image, bar, counts, masses):
    """Elements of a bar; how many, 0 where there is none.

    Parameters
    ----------
    bar : int
        `GaugeBar`.
    counts, masses : int
        Addresses: elements of each section, mass of each [kg]; 0: not wanted.
    """
    values = new_values()
    numbers = numbers_in(image, values)
    bars = cut_bars(numbers)
    mass, sections = bars.bit.mass, numbers.bit
    if bar == GaugeBar.PISTON:
        mass, sections = bars.piston.mass, numbers.piston
    if counts != 0:
        found = words_at(counts, len(sections))
        for k in range(len(sections)):
            found[k] = section_count(sections[k], bars.element)
    if masses != 0:
        floats_at(masses, len(mass))[:] = mass
    hold(values)
    return len(mass)


@preparing
def fields(base, moving, bar, masses, made, modes, count, force, velocity):
    """Fill in elastic force [N] and velocity [m/s] of each element of a bar.

    Parameters
    ----------
    count : int
        Elements.
    force, velocity : int
        Addresses.
    """
    elements, first = elements_in(base, moving), 0
    if bar != GaugeBar.PISTON:
        first = parameters(base)[0].n_p
    w, stiffness = elements.w, elements.c[Mesh.STIFFNESS]
    out, speed = floats_at(force, count), floats_at(velocity, count)
    for k in range(count):
        i = first + k
        out[k] = -stiffness[i] * (w[Node.U, i + 1] - w[Node.U, i])
        speed[k] = 0.5 * (w[Node.V, i] + w[Node.V, i + 1])
    return 0


sample = sampler(run, read, state_time, time_of_blow)
settle = settler(run, state_time)
