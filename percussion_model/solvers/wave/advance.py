"""Loop of the travelling-wave solver, and reading a state without touching it."""

from __future__ import annotations

import math

from percussion_model.physics.blows import end_of_step_with_blow
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.readings import fill_forces, fill_ledger, fill_motion
from percussion_model.physics.records import Piston, Status
from percussion_model.physics.reference import refer
from percussion_model.physics.rock import recoverable
from percussion_model.solvers.wave.records import Task
from percussion_model.solvers.wave.sections import (
    DOWN,
    LATE,
    UP_OUT,
    kinetic_of_bar,
    under_way,
)
from percussion_model.solvers.wave.step import BY_LOSS, POSITION, step, time_of

# Events that one step can make besides the rock's crossings: contact and drive.
OTHER_EVENTS = 4
# A time this close below a grid point is that grid point, and the shortest that is read [steps].
GRID_ROUNDING = SHORTEST = 1e-6


@kernel
def stored(par, s, chain, waves):
    """Energy of motion, and of strain in bars, joints and damper [J]."""
    kinetic = whole = 0.0
    for i in range(par.bars):
        kinetic += kinetic_of_bar(chain, waves, s.step, i)
        whole += under_way(par.dt, chain, waves, s.step, i)[0]
    elastic = whole - kinetic + s.e_stored
    if par.piston == Piston.RIGID:
        kinetic += 0.5 * par.mass_p * s.v_p * s.v_p
    if par.damper == 1:
        kinetic += 0.5 * par.casing_mass * s.v_c * s.v_c
    return kinetic, elastic


@inlined
def momentum_by_loss(par, chain, waves, i):
    """Momentum of a bar beside its waves, by its mass [m/s].

    The impulses at lossy ends tell of eta/2; the mean follows by what the sections have of that.
    """
    late = chain.bodies[i, LATE]
    return waves.bars[BY_LOSS, i] * (par.viscous * par.dt / late) if late > 0.0 else 0.0


@merged
def show_motion(par, s, chain, waves, row, time):
    """Fill in the motion, with what loss gives beside the waves."""
    bit = par.bars - 1
    here = waves.bars[POSITION, bit]
    s.v_b += momentum_by_loss(par, chain, waves, bit)
    if par.piston == Piston.ELASTIC:
        s.v_p += momentum_by_loss(par, chain, waves, 0)
    casing = s.u_c if par.damper == 1 else waves.bars[POSITION, par.struck]
    fill_motion(par, s, row, time, s.u_r - s.u_0 + casing, here)
    if par.piston != Piston.ABSENT:  # what a closure between two grid points leaves is no gap
        row.gap = 0.0 if s.closed == 1 else max(s.gap, 0.0)


@merged
def read_at(par, s, chain, waves, time, blows, events, row, with_ledger):
    """Read the ledger at the grid point, let the ends meet up to `time`, and read the rest."""
    if with_ledger:
        kinetic, elastic = stored(par, s, chain, waves)
        fill_ledger(s, row, kinetic, elastic, recoverable(par, s))
    row.bit_kinetic_energy = kinetic_of_bar(chain, waves, s.step, par.bars - 1)
    tau = max(time - time_of(par, s), SHORTEST * par.dt)
    bit, contact = s.i_bit, s.i_contact
    s.i_bit = 0.0
    s.i_contact = 0.0
    at_grid_point = time - time_of(par, s) <= SHORTEST * par.dt
    if at_grid_point:  # nothing has moved in that instant
        show_motion(par, s, chain, waves, row, time)
    step(par, s, chain, waves, tau, blows, events)
    if at_grid_point:
        row.drilling_mode = s.mode
    else:
        show_motion(par, s, chain, waves, row, time)
    k = par.sections - 1
    row.bit_end_velocity = waves.came[DOWN, k] + waves.came[UP_OUT, k]
    fill_forces(s, row, tau, bit, contact, at_grid_point)


@kernel
def time_of_blow(par_, state):
    """Time at which the pending step is over, if a blow may start in it [s]; 0 if none may.

    One that is cut at the closure is over before.
    """
    par, s = par_[0], state[0]
    return end_of_step_with_blow(par, s, s.t_base + (s.step + 1) * par.dt)


@kernel
def run(task, par_, state, chain_, waves_, time, blows, events, reading):
    """Do one `Task` with a state; the only entry into the kernels of waves.

    Parameters
    ----------
    task : int
        ADVANCE: commit the whole steps up to `time`.
        READ: evaluate at `time`; spoils the state but for its rings, so give a copy.
        SAMPLE: as READ, without the ledger.
    par_, state : WAVE_PAR, WAVE_STATE array of length 1
    chain_ : Chain
    waves_ : Waves
    time : float
        [s]
    blows, events : BLOW, EVENT array
        Filled from index 0; the state says how far.
    reading : READING array of length 1

    Returns
    -------
    int
        A `Status`.
    """
    par, s = par_[0], state[0]
    chain, waves = refer(chain_), refer(waves_)
    if task != Task.ADVANCE:
        s.live = 0
        read_at(par, s, chain, waves, time, blows, events, reading[0], task == Task.READ)
        return Status.DONE
    s.n_blows = 0
    s.n_events = 0
    while (time - s.t_base) / par.dt + GRID_ROUNDING >= s.step + 1:
        if s.n_blows >= blows.shape[0]:
            return Status.BLOWS_FULL
        if s.events_on == 1 and s.n_events + par.most_changes + OTHER_EVENTS > events.shape[0]:
            return Status.EVENTS_FULL
        if not math.isfinite(s.p + s.v_b + s.v_p + s.u_r):
            return Status.NOT_FINITE
        step(par, s, chain, waves, par.dt, blows, events)
    return Status.DONE
