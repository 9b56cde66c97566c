"""One step of the travelling-wave solver, and the stored energy of its state.

The order within a step of one cell's transit time: half of the body forces,
waves to the ends, contact and rock in closed form, loss, the other half
(docs/numerics.md, section 1).
"""

from __future__ import annotations

from percussion_model.core.bar import (
    add_velocity,
    elastic_energy,
    face_velocities,
    kinetic_energy,
    mean_velocity,
    send_waves,
    send_waves_with_loss,
    strain_offset,
)
from percussion_model.core.blows import push_checkpoint, push_event, start_blow
from percussion_model.core.contact import bar_contact, mass_contact
from percussion_model.core.drive import drive_force, switch_drive
from percussion_model.core.kernel import inlined, kernel, merged
from percussion_model.core.loss import finish_loss, loss_substeps, smooth_cells
from percussion_model.core.records import DriveKind, EventKind, Mode, Piston
from percussion_model.core.rock import recoverable, rock_step
from percussion_model.core.wave_records import Coef, Row

ABSENT, RIGID, ELASTIC = int(Piston.ABSENT), int(Piston.RIGID), int(Piston.ELASTIC)
CONTACT_CLOSED, CONTACT_OPENED = int(EventKind.CONTACT_CLOSED), int(EventKind.CONTACT_OPENED)
PRESSURE = int(DriveKind.PRESSURE)
SS = int(Mode.SS)
FACE, LOSS = int(Row.FACE), int(Row.LOSS)
MASS, TOP, BOTTOM = int(Coef.MASS), int(Coef.TOP), int(Coef.BOTTOM)

# Mean motion is derived anew from the waves this often, so that rounding in
# its running sums can never drift away from the gap [steps].
RESYNC_STEPS = 256
# A part of a step shorter than this is not worth a step of its own.
SHORTEST_PART = 1e-3
# Spacing of the bit force's checkpoints while standing still [steps].
CHECKPOINT_STEPS = 64


@merged
def now(par, s):
    """Time of a state [s]."""
    return s.t_base + s.step * par.dt


@inlined
def bit_position(s, wb, cb, n, r):
    """Mean displacement of the bit since the start [m]."""
    return s.x_r + s.p + strain_offset(wb, cb, n, r, BOTTOM) - s.offset_start


@kernel
def resync(par, s, wp, cp, wb, cb):
    """Derive the mean velocities and u_r from gap and waves."""
    r = 2 * s.parity
    s.v_b = mean_velocity(wb, cb, par.n_b, r, par.mass_b)
    if par.piston == ABSENT or s.asleep == 1:
        return
    s.u_r = strain_offset(wb, cb, par.n_b, r, TOP) - s.gap
    if par.piston == ELASTIC:
        s.v_p = mean_velocity(wp, cp, par.n_p, r, par.mass_p)
        s.u_r += strain_offset(wp, cp, par.n_p, r, BOTTOM)


@inlined
def inner_waves(par, w, c, n, r, kick):
    """Interface velocities of a bar and what its end cells push against.

    Returns
    -------
    top, bottom : float
        Velocities of the inner interfaces next to the ends [m/s].
    """
    face_velocities(w, c, n, r, kick)
    if par.loss == 0 or n < 2:
        return 0.0, 0.0
    if par.loss == 1:
        return w[FACE, 1], w[FACE, n - 1]
    return loss_substeps(w, c, n, par.loss)


@inlined
def outer_waves(par, w, c, n, r, top, bottom, z_top, z_bottom):
    """Finish a bar's step once both end velocities are known.

    Parameters
    ----------
    top, bottom : float
        From `inner_waves` [m/s].
    z_top, z_bottom : float
        Viscous number times impedance of the end cells [N s/m].
    """
    if par.loss == 0 or n < 2:
        send_waves(w, n, r)
    elif par.loss == 1:
        send_waves_with_loss(w, c, n, r)
    else:
        force_top = z_top * (w[FACE, 0] - top)
        force_bottom = -z_bottom * (w[FACE, n] - bottom)
        finish_loss(w, c, n, force_top, force_bottom)
        send_waves(w, n, r)
    if par.loss > 0 and n > 1:
        smooth_cells(w, c, n, 2 - r, par.loss)


@inlined
def book_end(s, z, kappa, inner, d, q, tau):
    """Ledger of one end: loss in its cell, and what averaging dissipates.

    Parameters
    ----------
    z, kappa : float
        Impedance [N s/m] and viscous number of the end cell.
    inner : float
        Velocity that the cell works against [m/s].
    d, q : float
        Integrals of the end velocity [m] and of its square [m2/s].
    """
    s.e_loss += kappa * z * (q - inner * d)
    s.e_numerical += z * (q - d * d / tau)


@kernel
def record_contact(par, s, wb, cb, opened, t_close, approach, peak, time, blows, events):
    """Book the opening and the closure of the piston/bit gap in this step."""
    if opened == 1:
        s.b_rebound = s.v_p
        s.t_open = time
        push_event(s, events, time, CONTACT_OPENED, approach)
    if t_close >= 0.0:
        closure = time + t_close
        if starts_blow(par, s, closure):
            r = 2 * s.parity
            here = bit_position(s, wb, cb, par.n_b, r) + s.v_b * t_close
            speed = s.v_p + (par.gravity + drive_force(par, s) / par.mass_p) * t_close
            impulse = s.i_bit + s.gamma * s.k_r * (s.p - s.p_u) * t_close
            start_blow(s, blows, closure, speed, here, impulse, par.mass_p)
        s.b_contacts += 1
        push_event(s, events, closure, CONTACT_CLOSED, approach)
    if s.closed == 1:
        s.b_peak_contact = max(s.b_peak_contact, peak)


@inlined
def meet_piston(par, s, wp, wb, cb, v_p, v_t, in_p, in_t, elastic, tau, time, blows, events):
    """Contact of piston and bit over `tau`.

    Parameters
    ----------
    v_p, v_t : float
        Free velocities of the piston's lower and the bit's upper end [m/s].
    in_p, in_t : float
        Velocities that their end cells work against [m/s].
    elastic : float
        Difference of the free velocities without loss [m/s].

    Returns
    -------
    impulse, moment : float
        Of the contact force [N s, N s2].
    """
    z_t = par.z_t * (1.0 + par.kappa_t)
    if par.piston == ABSENT or s.asleep == 1:
        d_t = v_t * tau
        book_end(s, par.z_t, par.kappa_t, in_t, d_t, v_t * d_t, tau)
        wb[FACE, 0] = v_t
        return 0.0, 0.0
    # the elastic part: a viscous front has no peak of its own
    peak = par.z_t * elastic
    if par.piston == ELASTIC:
        z_p = par.z_p * (1.0 + par.kappa_p)
        closed, gap, d_p, q_p, d_t, q_t, impulse, moment, t_close, opened = bar_contact(
            s.closed, s.gap, v_p, v_t, z_p, z_t, tau
        )
        peak *= par.z_p / (par.z_p + par.z_t)
        book_end(s, par.z_p, par.kappa_p, in_p, d_p, q_p, tau)
        wp[FACE, par.n_p] = d_p / tau
    else:
        closed, gap, d_p, q_p, d_t, q_t, impulse, moment, t_close, opened = mass_contact(
            s.closed, s.gap, v_p, v_t, par.mass_p, z_t, tau
        )
    book_end(s, par.z_t, par.kappa_t, in_t, d_t, q_t, tau)
    wb[FACE, 0] = d_t / tau
    if closed != s.closed or t_close >= 0.0 or closed == 1:
        s.closed = closed
        record_contact(par, s, wb, cb, opened, t_close, v_p - v_t, peak, time, blows, events)
    s.gap = gap
    return impulse, moment


@merged
def starts_blow(par, s, time):
    """Whether a closure of the gap at `time` starts a blow."""
    return s.armed == 1 or (par.drive != PRESSURE and time - s.t_open >= par.rearm_time)


@merged
def time_to_blow(par, s, approach, tau, time):
    """Time until a blow starts within the step, `tau` where none does [s]."""
    if s.live == 0 or s.closed == 1 or approach <= 0.0:
        return tau
    reach = s.gap / approach
    if reach < SHORTEST_PART * tau or reach > (1.0 - SHORTEST_PART) * tau:
        return tau
    if not starts_blow(par, s, time + reach):
        return tau
    return reach


@inlined
def meet(par, s, wp, cp, wb, cb, tau, blows, events):
    """Let the ends meet what they meet for `tau`, up to a whole step.

    Mean motion, gap, penetration, modes, impulses and the ledger move on; the
    waves in the bars do not.

    A closure of the gap that starts a blow ends the time early, so that the
    front of the blow begins with a step and is not averaged over a cell.

    Returns
    -------
    top, bottom, top_p, bottom_p : float
        What `outer_waves` needs of bit and piston [m/s].
    tau : float
        Time that has passed [s].
    """
    r = 2 * s.parity
    time = now(par, s)
    a_b = par.gravity + s.feed / par.mass_b
    top, bottom = inner_waves(par, wb, cb, par.n_b, r, a_b * 0.5 * par.dt)
    kick = a_b * 0.5 * par.dt
    elastic = -(2.0 * wb[r + 1, 0] + kick)
    v_t = (par.kappa_t * top - elastic) / (1.0 + par.kappa_t)
    v_free = (2.0 * wb[r, par.n_b - 1] + kick + par.kappa_b * bottom) / (1.0 + par.kappa_b)
    top_p = 0.0
    bottom_p = 0.0
    impulse = 0.0
    moment = 0.0
    push = 0.0
    a_p = 0.0
    awake = par.piston != ABSENT and s.asleep == 0
    if awake:
        push = drive_force(par, s)
        a_p = par.gravity + push / par.mass_p
        kick = a_p * 0.5 * par.dt
        if par.piston == ELASTIC:
            n = par.n_p
            top_p, bottom_p = inner_waves(par, wp, cp, n, r, kick)
            v_f = (2.0 * wp[r + 1, 0] + kick + par.kappa_f * top_p) / (1.0 + par.kappa_f)
            wp[FACE, 0] = v_f
            v_p = 2.0 * wp[r, n - 1] + kick
            elastic += v_p
            v_p = (v_p + par.kappa_p * bottom_p) / (1.0 + par.kappa_p)
        else:
            v_p = s.v_p + kick
            elastic += v_p
        tau = time_to_blow(par, s, v_p - v_t, tau, time)
        if par.piston == ELASTIC:
            book_end(s, par.z_f, par.kappa_f, top_p, v_f * tau, v_f * v_f * tau, tau)
    else:
        v_p = 0.0
    half = 0.5 * tau
    impulse, moment = meet_piston(
        par, s, wp, wb, cb, v_p, v_t, bottom_p, top, elastic, tau, time, blows, events
    )
    z = par.z_b * (1.0 + par.kappa_b)
    d, q, area = rock_step(par, s, wb, cb, v_free, z, tau, time, events)
    book_end(s, par.z_b, par.kappa_b, bottom, d, q, tau)
    wb[FACE, par.n_b] = d / tau
    push_rock = z * (v_free * tau - d)
    s.rock_work += z * (v_free * d - q)
    s.i_bit += push_rock
    s.i_contact += impulse
    move_bit(par, s, a_b, impulse - push_rock, half)
    if awake:
        u_before = s.u_r
        s.u_r += (s.v_p + a_p * half) * tau - moment / par.mass_p
        s.u_r -= (s.v_b - (impulse - push_rock) / par.mass_b - a_b * half) * tau
        s.u_r -= (moment - z * (0.5 * v_free * tau * tau - area)) / par.mass_b
        move_piston(par, s, wp, push, impulse, u_before, time, tau, events)
    return top, bottom, top_p, bottom_p, tau


@merged
def move_bit(par, s, a_b, impulse, half):
    """Mean velocity of the bit over the step, and the work of its body forces."""
    v0 = s.v_b
    v1 = v0 + 2.0 * a_b * half + impulse / par.mass_b
    s.v_b = v1
    path = half * (v0 + v1)
    s.e_feed += s.feed * path
    s.e_gravity += par.mass_b * par.gravity * path


@merged
def move_piston(par, s, wp, push, impulse, u_before, time, tau, events):
    """The same for the piston, with a switch of the drive inside the step.

    The second half of the body force makes up for what the first half, given
    before the switch was known, had too much.
    """
    half = 0.5 * tau
    later = push
    share = switch_drive(par, s, u_before, time, tau, events)
    if share >= 0.0:
        mean = share * push + (1.0 - share) * drive_force(par, s)
        later = 2.0 * mean - push
    v0 = s.v_p
    v1 = v0 + (par.gravity + push / par.mass_p) * half
    v2 = v1 - impulse / par.mass_p
    v3 = v2 + (par.gravity + later / par.mass_p) * half
    first = 0.5 * half * (v0 + v1)
    second = 0.5 * half * (v2 + v3)
    s.v_p = v3
    s.e_drive += push * first + later * second
    s.e_gravity += par.mass_p * par.gravity * (first + second)
    s.i_drive += (push + later) * half
    if -s.u_r > s.b_stroke:
        s.b_stroke = -s.u_r


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
            lost += c[MASS, i] * jump * jump
    return share * (1.0 - share) * lost


@merged
def shorten_step(par, s, wp, cp, wb, cb, tau, loss_before, push, dv_p, dv_b):
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
    s.e_loss -= rest * (lost_in_faces(par, wp, wb) - loss_before)
    s.e_numerical += part_of_step(wb, cb, par.n_b, r, share)
    # the body forces worked along the whole step's path, not along its part
    a = par.gravity + s.feed / par.mass_b
    s.e_numerical -= 0.5 * par.mass_b * a * par.dt * rest * dv_b
    if par.piston == ELASTIC:
        s.e_numerical += part_of_step(wp, cp, par.n_p, r, share)
        a = par.gravity + push / par.mass_p
        s.e_numerical -= 0.5 * par.mass_p * a * par.dt * rest * dv_p
    s.gap = 0.0
    s.t_base -= par.dt - tau


@kernel
def step(par, s, wp, cp, wb, cb, dt, blows, events):
    """Advance the state by one step of the transit time of a cell.

    A copy that is only read (s.live = 0) moves on by `dt` of a step: what its
    ends meet, not the waves in its bars.
    """
    r = 2 * s.parity
    alpha = s.alpha
    v_p, v_b = s.v_p, s.v_b
    contact_before = s.i_contact
    push = drive_force(par, s)
    top, bottom, top_p, bottom_p, tau = meet(par, s, wp, cp, wb, cb, dt, blows, events)
    if s.live == 0:
        return
    short = tau < dt
    loss_before = 0.0
    if short:
        loss_before = lost_in_faces(par, wp, wb)
    z_t, z_b = par.kappa_t * par.z_t, par.kappa_b * par.z_b
    outer_waves(par, wb, cb, par.n_b, r, top, bottom, z_t, z_b)
    if par.piston == ELASTIC and s.asleep == 0:
        z_t, z_b = par.kappa_f * par.z_f, par.kappa_p * par.z_p
        outer_waves(par, wp, cp, par.n_p, r, top_p, bottom_p, z_t, z_b)
    given = (par.gravity + push / par.mass_p) * tau
    if short:
        shorten_step(par, s, wp, cp, wb, cb, tau, loss_before, push, given, s.v_b - v_b)
    if alpha != s.alpha and par.piston == ELASTIC:
        # what the waves got is the old force over the whole step
        due = s.v_p - v_p + (s.i_contact - contact_before) / par.mass_p
        add_velocity(wp, par.n_p, 2 - r, due - given)
    s.parity = 1 - s.parity
    s.step += 1
    s.count_steps += 1
    if s.step % RESYNC_STEPS == 0:
        resync(par, s, wp, cp, wb, cb)
    if s.mode == SS and (s.n_check == 0 or s.step % CHECKPOINT_STEPS == 0):
        push_checkpoint(s, now(par, s))


@kernel
def stored_energy(par, s, wp, cp, wb, cb):
    """Energy stored in bars and rock.

    Returns
    -------
    kinetic, elastic, rock : float
        [J]
    """
    r = 2 * s.parity
    kinetic = kinetic_energy(wb, cb, par.n_b, r)
    elastic = elastic_energy(wb, cb, par.n_b, r)
    if par.piston == ELASTIC:
        kinetic += kinetic_energy(wp, cp, par.n_p, r)
        elastic += elastic_energy(wp, cp, par.n_p, r)
    elif par.piston == RIGID:
        kinetic += 0.5 * par.mass_p * s.v_p * s.v_p
    return kinetic, elastic, recoverable(s)


@kernel
def lost_in_faces(par, wp, wb):
    """Structural loss booked interface by interface [J]."""
    total = 0.0
    for i in range(par.n_b):
        total += wb[LOSS, i]
    for i in range(par.n_p):
        total += wp[LOSS, i]
    return total * par.dt
