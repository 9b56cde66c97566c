"""Loop of the finite-element solver, and reading a state without touching it."""

from __future__ import annotations

import math

from percussion_model.physics.blows import end_of_step_with_blow, push_checkpoint
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.loads import hold_components
from percussion_model.physics.readings import fill_ledger, fill_motion
from percussion_model.physics.records import Mode, Status
from percussion_model.solvers.fem.bars import (
    bit_position,
    dissipated_in_nodes,
    kinetic_energy,
    read_means,
    stored_energy,
)
from percussion_model.solvers.fem.events import end_of_step
from percussion_model.solvers.fem.modes import change_modes, keep_near
from percussion_model.solvers.fem.records import FemTask
from percussion_model.solvers.fem.step import bit_force, contact_force, note_forces, take_step

# A time this close before the end of a step is that end [steps].
GRID_ROUNDING = 1e-6
# Spacing of the bit force's checkpoints while standing still [steps].
CHECKPOINT_STEPS = 64


@kernel
def time_of_blow(par_, state):
    """Time at which the pending step is over, if a blow may start in it [s]; 0 if none may.

    One that is cut at the closure is over before.
    """
    return end_of_step_with_blow(par_[0], state[0], state[0].time + par_[0].dt)


@merged
def guard_events(par, s):
    """Zeno guard: count a step cut short by an event; after too many the next looks for none."""
    if s.time - s.window_from > par.dt:
        s.window_from = s.time
        s.window_events = 0
    s.window_events += 1
    if s.window_events >= par.most_events:
        s.window_events = 0
        s.skip_events = 1
        s.count_storms += 1


@merged
def advance_to(par, s, elements, time, whole, blows, events):
    """Advance by whole steps, or up to `time` where `whole` is False; a `Status`."""
    w, c, x = elements.w, elements.c, elements.x
    s.n_blows = 0
    s.n_events = 0
    grain = GRID_ROUNDING * par.dt
    if s.inputs_changed == 1:
        s.inputs_changed = 0
        change_modes(par, s, w, c, blows, events)
    while True:
        rest = time - s.time
        h = par.dt
        if rest < par.dt - grain:
            if whole or rest <= grain:
                return Status.DONE
            h = rest
        if s.live == 1:
            if s.n_blows >= blows.shape[0]:
                return Status.BLOWS_FULL
            # each change of contact, drive and rock is an event
            if s.events_on == 1 and s.n_events + 3 * par.most_changes > events.shape[0]:
                return Status.EVENTS_FULL
        if not math.isfinite(s.p + s.v_end + s.gap_rate + s.u_r):
            return Status.NOT_FINITE
        if par.effects == 1:
            read_means(par, s, w, c)
            hold_components(par, s, h)
        tried = h
        h = end_of_step(par, s, elements, h)
        take_step(par, s, w, c, x, h)
        change_modes(par, s, w, c, blows, events)
        keep_near(par, s, w)
        if h < tried:
            guard_events(par, s)
        note_forces(par, s)  # a dashpot may have come in
        if s.mode == Mode.SS and (s.n_check == 0 or s.count_steps % CHECKPOINT_STEPS == 0):
            push_checkpoint(s, s.time)


@merged
def read_here(par, s, w, c, time, row):
    """Write what is seen of a state."""
    read_means(par, s, w, c)
    kinetic, elastic, rock = stored_energy(par, s, w, c)
    loss, numerical = dissipated_in_nodes(par, w)
    fill_ledger(s, row, kinetic, elastic, rock)
    row.e_loss += loss
    row.e_numerical += numerical
    fill_motion(par, s, row, time, s.x_r + s.mean_p + par.start_gap, bit_position(s))
    row.bit_end_velocity = s.v_end
    row.bit_force = bit_force(par, s)
    row.contact_force = contact_force(par, s)
    row.bit_kinetic_energy = kinetic_energy(c, w, par.n_p, par.n_b)


@kernel
def run(task, par_, state, elements, time, blows, events, reading):
    """Do one `FemTask` with a state; the only entry into the finite-element kernels.

    Parameters
    ----------
    task : int
        ADVANCE: commit the whole steps up to `time`.
        COMMIT: commit up to `time`, with a part of a step at the end.
        READ: as COMMIT, then read it; spoils the state, so give a copy.
    par_, state : FEM_PAR, FEM_STATE array of length 1
    elements : Elements
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
    par = par_[0]
    s = state[0]
    if task == FemTask.READ:
        s.live = 0
    status = advance_to(par, s, elements, time, task == FemTask.ADVANCE, blows, events)
    if task == FemTask.READ:
        read_here(par, s, elements.w, elements.c, time, reading[0])
    return status
