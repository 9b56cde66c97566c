"""Loop of the solver of chains, and reading a state without touching it."""

from __future__ import annotations

import math

from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.readings import fill_forces, fill_ledger, fill_motion
from percussion_model.physics.records import Piston, Status
from percussion_model.physics.reference import refer
from percussion_model.physics.rock import recoverable
from percussion_model.solvers.chain.records import Task
from percussion_model.solvers.chain.sections import (
    DOWN,
    INV_MASS,
    UP_OUT,
    energy_of_bar,
    kinetic_of_bar,
)
from percussion_model.solvers.chain.step import POSITION, VISCOUS, step, time_of

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
        whole += energy_of_bar(par.dt, chain, waves, s.step, i)
    elastic = whole - kinetic + s.e_stored
    if par.piston == Piston.RIGID:
        kinetic += 0.5 * par.mass_p * s.v_p * s.v_p
    if par.damper == 1:
        kinetic += 0.5 * par.casing_mass * s.v_c * s.v_c
    return kinetic, elastic


@merged
def show_motion(par, s, chain, waves, row, time):
    """Fill in the motion, with the momentum that loss gives beside the waves near contacts."""
    bit = par.bars - 1
    here = waves.bars[POSITION, bit]
    above = s.viscous_contact if par.struck == bit else waves.joints[VISCOUS, par.joints - 1]
    s.v_b += (above - s.viscous_rock) * chain.bodies[bit, INV_MASS]
    if par.piston == Piston.ELASTIC:
        s.v_p -= s.viscous_contact * chain.bodies[0, INV_MASS]
    casing = s.u_c if par.damper == 1 else waves.bars[POSITION, par.struck]
    fill_motion(par, s, row, time, s.u_r - s.u_0 + casing, here)


@merged
def read_at(par, s, chain, waves, time, blows, events, row):
    """Read the ledger at the grid point, then let the ends meet up to `time` and read the rest."""
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
def run(task, par_, state, chain_, waves_, time, blows, events, reading):
    """Do one `Task` with a state; the only entry into the kernels of chains.

    Parameters
    ----------
    task : int
        ADVANCE: commit the whole steps up to `time`.
        READ: evaluate at `time`; spoils the state but for its rings, so give a copy.
    par_, state : CHAIN_PAR, CHAIN_STATE array of length 1
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
    if task == Task.READ:
        s.live = 0
        read_at(par, s, chain, waves, time, blows, events, reading[0])
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
