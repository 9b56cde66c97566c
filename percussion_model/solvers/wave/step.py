"""One step of the travelling-wave solver.

The order within a step of one cell's transit time: half of the body forces,
waves to the ends, contact and rock in closed form, loss, the other half
(docs/numerics.md, section 1).
"""

from __future__ import annotations

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.loads import (
    book_bit_load,
    book_piston_load,
    drive_force,
    hold_components,
    piston_acceleration,
)
from percussion_model.physics.records import Mode, Piston
from percussion_model.solvers.wave.bar import add_velocity
from percussion_model.solvers.wave.ends import meet, outer_waves
from percussion_model.solvers.wave.records import Coef
from percussion_model.solvers.wave.totals import lost_in_faces, resync, time_of

# Mean motion is derived anew from the waves this often, so that rounding in
# its running sums can never drift away from the gap [steps].
RESYNC_STEPS = 256
# Spacing of the bit force's checkpoints while standing still [steps].
CHECKPOINT_STEPS = 64


@kernel
def part_of_step(w, c, n, r, share):
    """Move the waves back to `share` of the step just done.

    A fraction of a cell's transit mixes the waves of neighbouring cells.

    Returns
    -------
    float
        Energy that the mixing dissipates [J].
    """
    q = 2 - r
    lost = 0.0
    for i in range(n):
        for k in range(2):
            jump = w[q + k, i] - w[r + k, i]
            w[q + k, i] = w[r + k, i] + share * jump
            lost += c[Coef.MASS, i] * jump * jump
    return share * (1.0 - share) * lost


@merged
def shorten_step(par, s, bars, tau, loss_before, push, dv_p, dv_b):
    """Turn the step just done into one of duration `tau`, with its ledger.

    Parameters
    ----------
    loss_before : float
        Loss booked at the interfaces before the step [J].
    push : float
        Force of the drive that the piston's waves got [N].
    dv_p, dv_b : float
        Change of the mean velocities over `tau`, the piston's under `push` [m/s].
    """
    r = 2 * s.parity
    share = tau / par.dt
    rest = 1.0 - share
    s.e_loss -= rest * (lost_in_faces(par, bars) - loss_before)
    s.e_numerical += part_of_step(bars.wb, bars.cb, par.n_b, r, share)
    # the means move by a share of the whole step's path; half of `tau` is booked already
    further = 0.5 * par.dt * rest
    book_bit_load(par, s, further * dv_b)
    if par.piston == Piston.ELASTIC:
        s.e_numerical += part_of_step(bars.wp, bars.cp, par.n_p, r, share)
        book_piston_load(par, s, push, further * dv_p, 0.0)
    s.t_base -= par.dt - tau


@kernel
def step(par, s, bars, dt, blows, events):
    """Advance the state by one step of the transit time of a cell.

    A copy that is only read (s.live = 0) moves on by `dt` of a step: what its
    ends meet, not the waves in its bars. Where the step is cut before, it is made.
    """
    r = 2 * s.parity
    alpha = s.alpha
    v_p, v_b = s.v_p, s.v_b
    contact_before = s.i_contact
    hold_components(par, s, dt)
    push = drive_force(par, s)
    top, bottom, top_p, bottom_p, tau = meet(par, s, bars, dt, blows, events)
    if s.live == 0 and tau == dt:
        return
    short = tau < par.dt
    loss_before = 0.0
    if short:
        loss_before = lost_in_faces(par, bars)
    z_t, z_b = par.kappa_t * par.z_t, par.kappa_b * par.z_b
    outer_waves(par, bars.wb, bars.cb, par.n_b, r, top, bottom, z_t, z_b)
    if par.piston == Piston.ELASTIC and s.dormant == 0:
        z_t, z_b = par.kappa_f * par.z_f, par.kappa_p * par.z_p
        outer_waves(par, bars.wp, bars.cp, par.n_p, r, top_p, bottom_p, z_t, z_b)
    given = piston_acceleration(par, push) * tau
    if short:
        s.cuts += 1
        shorten_step(par, s, bars, tau, loss_before, push, given, s.v_b - v_b)
    if alpha != s.alpha and par.piston == Piston.ELASTIC:
        # what the waves got is the old force over the whole step
        due = s.v_p - v_p + (s.i_contact - contact_before) / par.mass_p
        add_velocity(bars.wp, par.n_p, 2 - r, due - given)
    s.parity = 1 - s.parity
    s.step += 1
    s.count_steps += 1
    if short or s.step % RESYNC_STEPS == 0:
        resync(par, s, bars)
    if s.mode == Mode.SS and (s.n_check == 0 or s.step % CHECKPOINT_STEPS == 0):
        push_checkpoint(s, time_of(par, s))
