"""The loop of the finite-element solver, and reading a state without touching it."""

from __future__ import annotations

import math

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.drive import drive_force
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.records import PEAK_FIELDS, SAMPLE_FIELDS, Mode, Status
from percussion_model.solvers.fem.bars import (
    bit_position,
    dissipated_in_nodes,
    kinetic_energy,
    read_means,
    stored_energy,
)
from percussion_model.solvers.fem.events import end_of_step
from percussion_model.solvers.fem.modes import change_modes
from percussion_model.solvers.fem.records import FemTask, Node
from percussion_model.solvers.fem.step import bit_force, contact_force, note_forces, take_step

DONE, BLOWS_FULL, EVENTS_FULL = int(Status.DONE), int(Status.BLOWS_FULL), int(Status.EVENTS_FULL)
NOT_FINITE = int(Status.NOT_FINITE)
ADVANCE, SAMPLE = int(FemTask.ADVANCE), int(FemTask.SAMPLE)
FF, SS = int(Mode.FF), int(Mode.SS)
U = int(Node.U)

# Where a longer row goes on.
PEAKS = len(SAMPLE_FIELDS)
LEDGER = PEAKS + len(PEAK_FIELDS)
# A time this close before the end of a step is that end [steps].
GRID_ROUNDING = 1e-6
# Spacing of the bit force's checkpoints while standing still [steps].
CHECKPOINT_STEPS = 64


@merged
def watch_crowd(par, s):
    """Count a step cut short by an event; after too many the next looks for none."""
    if s.time - s.crowd_from > par.dt:
        s.crowd_from = s.time
        s.crowd = 0
    s.crowd += 1
    if s.crowd >= par.most_events:
        s.crowd = 0
        s.stuck = 1
        s.count_storms += 1


@merged
def go_on(par, s, w, c, f, x, q, time, whole, blows, events):
    """Advance by whole steps, or up to `time` where `whole` is False; a `Status`."""
    s.n_blows = 0
    s.n_events = 0
    grain = GRID_ROUNDING * par.dt
    if s.fresh == 1:
        s.fresh = 0
        change_modes(par, s, w, c, blows, events)
    while True:
        rest = time - s.time
        h = par.dt
        if rest < par.dt - grain:
            if whole or rest <= grain:
                return DONE
            h = rest
        if s.live == 1:
            if s.n_blows >= blows.shape[0]:
                return BLOWS_FULL
            # each change of contact, drive and rock is an event
            if s.events_on == 1 and s.n_events + 3 * par.most_changes > events.shape[0]:
                return EVENTS_FULL
        if not math.isfinite(s.p + s.v_end + s.gap_rate + s.u_r):
            return NOT_FINITE
        tried = h
        h = end_of_step(par, s, w, c, f, x, q, h)
        take_step(par, s, w, c, x, h)
        change_modes(par, s, w, c, blows, events)
        if h < tried:
            watch_crowd(par, s)
        note_forces(par, s)  # a dashpot may have come in
        if s.mode == SS and (s.n_check == 0 or s.count_steps % CHECKPOINT_STEPS == 0):
            push_checkpoint(s, s.time)


@merged
def fill_sample(par, s, w, c, time, row):
    """Write what is seen of a state (SAMPLE_FIELDS)."""
    read_means(par, s, w, c)
    row[0] = time
    row[1] = math.nan
    row[2] = s.v_p
    row[3] = bit_position(s)
    row[4] = s.v_b
    row[5] = s.x_r + s.p
    row[6] = s.v_end
    row[7] = s.gap
    row[8] = s.u_r
    row[9] = s.p
    row[10] = bit_force(s)
    row[11] = contact_force(par, s)
    row[12] = drive_force(par, s)
    row[13] = s.mode
    row[14] = kinetic_energy(c, w, par.n_p, par.n_b)
    row[15] = s.i_bit
    row[16] = s.i_contact
    row[17] = s.i_drive
    if par.n_p > 0:
        row[1] = s.x_r + s.mean_p + par.start_gap
    else:
        row[7] = math.nan
        row[8] = math.nan
    if row.shape[0] > LEDGER:
        fill_ledger(par, s, w, c, row)


@kernel
def fill_ledger(par, s, w, c, row):
    """Write peaks and energies of a state (LONG_SAMPLE_FIELDS)."""
    loss, numerical = dissipated_in_nodes(par, w)
    kinetic, elastic, rock = stored_energy(par, s, w, c)
    row[PEAKS] = s.peak_bit
    row[PEAKS + 1] = s.peak_contact
    row[LEDGER] = s.e_drive
    row[LEDGER + 1] = s.e_feed
    row[LEDGER + 2] = s.e_gravity
    row[LEDGER + 3] = s.e_crushing
    row[LEDGER + 4] = s.e_barrier
    row[LEDGER + 5] = s.e_standstill
    row[LEDGER + 6] = s.e_loss + loss
    row[LEDGER + 7] = s.e_contact
    row[LEDGER + 8] = s.e_numerical + numerical
    row[LEDGER + 9] = s.e_overshoot
    row[LEDGER + 10] = s.e_start
    row[LEDGER + 11] = kinetic
    row[LEDGER + 12] = elastic
    row[LEDGER + 13] = rock


@kernel
def run(task, par_, state, w, c, f, x, q, time, blows, events, row):
    """Do one `FemTask` with a state; the only entry into the finite-element kernels.

    Parameters
    ----------
    task : int
        ADVANCE: commit the whole steps up to `time`.
        BRING: commit up to `time`, with a part of a step at the end.
        SAMPLE: as BRING, then tell what is seen; spoils the state, so give a copy.
    par_, state : FEM_PAR, FEM_STATE array of length 1
    w : float array, shape (len(Node), n)
        What changes at each node.
    c : float array, shape (len(Mesh), n)
    f : float array, shape (2 len(Factor), at least n)
        Factorisations, kept from call to call; zero at first.
    x : float array, shape (len(Trial), n)
        Scratch.
    q : float array, shape (len(Look), len(Column))
        Scratch.
    time : float
        [s]
    blows, events : BLOW, EVENT array
        Filled from index 0; the state says how far.
    row : float array
        Of the length of SAMPLE_FIELDS or of LONG_SAMPLE_FIELDS.

    Returns
    -------
    int
        A `Status`.
    """
    par = par_[0]
    s = state[0]
    if task == SAMPLE:
        s.live = 0
    status = go_on(par, s, w, c, f, x, q, time, task == ADVANCE, blows, events)
    if task == SAMPLE:
        fill_sample(par, s, w, c, time, row)
    return status
