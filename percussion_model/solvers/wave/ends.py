"""Ends of the bars within a step: contact with each other, with the rock, or none.

Contact and rock are followed in closed form with the waves that come to the
ends (docs/numerics.md, section 1). Mean motion and the ledger move along.
"""

from __future__ import annotations

from percussion_model.physics.blows import (
    close_gap,
    open_gap,
    standstill_force,
    start_blow,
    starts_blow,
)
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import (
    bit_acceleration,
    book_bit_load,
    drive_force,
    move_to_components,
    pass_time,
    piston_acceleration,
    switch_drive,
)
from percussion_model.physics.records import Piston
from percussion_model.solvers.wave.bar import (
    face_velocities,
    kinetic_energy,
    send_waves,
    send_waves_with_loss,
)
from percussion_model.solvers.wave.contact import bar_contact, mass_contact
from percussion_model.solvers.wave.loss import finish_loss, loss_substeps, smooth_cells
from percussion_model.solvers.wave.records import MOST_CUTS, Row
from percussion_model.solvers.wave.rock_end import asks_for_energy, rock_step
from percussion_model.solvers.wave.totals import bit_position, time_of

# A part of a step shorter than this is not worth a step of its own.
SHORTEST_PART = 1e-3
# Where loss spreads a front over half a cell within a transit, a closure is to come
# later in its step than this.
WIDE = 0.2


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
        return w[Row.FACE, 1], w[Row.FACE, n - 1]
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
        force_top = z_top * (w[Row.FACE, 0] - top)
        force_bottom = -z_bottom * (w[Row.FACE, n] - bottom)
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
def record_contact(par, s, wb, cb, opened, t_close, approach, peak, time, tau, blows, events):
    """Book the opening and the closure of the piston/bit gap in this step."""
    if opened == 1:
        open_gap(s, events, time, approach)
    if t_close >= 0.0:
        closure = time + t_close
        s.cuts = 0
        if starts_blow(par, s, closure):
            r = 2 * s.parity
            here = bit_position(s, wb, cb, par.n_b, r) + s.v_b * t_close
            speed = s.v_p + piston_acceleration(par, drive_force(par, s)) * t_close
            impulse = s.i_bit + s.gamma * s.k_r * (s.p - s.p_u) * t_close
            force = standstill_force(s, closure, impulse)
            start_blow(par, s, blows, closure, speed, here, force)
        close_gap(s, events, closure, approach)
    s.b_peak_contact = max(s.b_peak_contact, peak)
    if time + tau > s.peak_from:
        s.peak_contact_force = max(s.peak_contact_force, peak)


@merged
def meet_piston(par, s, bars, v_p, v_t, in_p, in_t, peak, tau, time, blows, events):
    """Contact of piston and bit over `tau`.

    Parameters
    ----------
    v_p, v_t : float
        Free velocities of the piston's lower and the bit's upper end [m/s].
    in_p, in_t : float
        Velocities that their end cells work against [m/s].
    peak : float
        Elastic part of the force, if they touch [N].

    Returns
    -------
    impulse : float
        Of the contact force [N s].
    d_p : float
        Displacement of the piston's lower end [m].
    """
    z_t = par.z_t * (1.0 + par.kappa_t)
    if par.piston == Piston.ABSENT or s.dormant == 1:
        d_t = v_t * tau
        book_end(s, par.z_t, par.kappa_t, in_t, d_t, v_t * d_t, tau)
        bars.wb[Row.FACE, 0] = v_t
        return 0.0, 0.0
    if par.piston == Piston.ELASTIC:
        z_p = par.z_p * (1.0 + par.kappa_p)
        closed, gap, d_p, q_p, d_t, q_t, impulse, t_close, opened = bar_contact(
            s.closed, s.gap, v_p, v_t, z_p, z_t, tau
        )
        book_end(s, par.z_p, par.kappa_p, in_p, d_p, q_p, tau)
        bars.wp[Row.FACE, par.n_p] = d_p / tau
    else:
        closed, gap, d_p, q_p, d_t, q_t, impulse, t_close, opened = mass_contact(
            s.closed, s.gap, v_p, v_t, par.mass_p, z_t, tau
        )
    book_end(s, par.z_t, par.kappa_t, in_t, d_t, q_t, tau)
    bars.wb[Row.FACE, 0] = d_t / tau
    if t_close >= 0.0 and par.front > 0.0:
        # what averaging takes from a front is what loss would have taken
        taken = par.z_t * (q_t - d_t * d_t / tau)
        if par.piston == Piston.ELASTIC:
            taken += par.z_p * (q_p - d_p * d_p / tau)
        s.e_numerical -= taken
        s.e_loss += taken
    if closed != s.closed or t_close >= 0.0 or closed == 1:
        s.closed = closed
        record_contact(
            par, s, bars.wb, bars.cb, opened, t_close, v_p - v_t, peak, time, tau, blows, events
        )
    s.gap = gap
    return impulse, d_p


@merged
def time_to_cut(par, s, approach, tau, time):
    """Time at which to end the step for a closure to come, `tau` where it comes later [s].

    The next step then has the closure at `par.front` of its time. A cut mixes the
    waves of both bars: with little loss these ring with sharp fronts between the
    contacts of a blow, and only the quiet before a blow is cut.
    """
    if s.closed == 1 or approach <= 0.0 or s.cuts >= MOST_CUTS:
        return tau
    reach = s.gap / approach - par.front * par.dt
    if reach < SHORTEST_PART * par.dt or reach > (1.0 - SHORTEST_PART) * par.dt:
        return tau
    if par.front < WIDE and not starts_blow(par, s, time + reach):
        return tau
    return min(reach, tau)


@merged
def meet(par, s, bars, tau, blows, events):
    """Let the ends meet what they meet for `tau`, up to a whole step.

    Mean motion, gap, penetration, modes, impulses and the ledger move on; the
    waves in the bars do not.

    Where the gap is about to close the time ends early, so that the closure comes
    in a step at the place that gives its front the right width.

    Returns
    -------
    top, bottom, top_p, bottom_p : float
        What `outer_waves` needs of bit and piston [m/s].
    tau : float
        Time that has passed [s].
    """
    r = 2 * s.parity
    time = time_of(par, s)
    a_b = bit_acceleration(par, s)
    top, bottom = inner_waves(par, bars.wb, bars.cb, par.n_b, r, a_b * 0.5 * par.dt)
    kick = a_b * 0.5 * par.dt
    up = 2.0 * bars.wb[r + 1, 0] + kick
    v_t = (par.kappa_t * top + up) / (1.0 + par.kappa_t)
    v_free = (2.0 * bars.wb[r, par.n_b - 1] + kick + par.kappa_b * bottom) / (1.0 + par.kappa_b)
    top_p = 0.0
    bottom_p = 0.0
    impulse = 0.0
    push = 0.0
    a_p = 0.0
    peak = 0.0
    awake = par.piston != Piston.ABSENT and s.dormant == 0
    if awake:
        push = drive_force(par, s)
        a_p = piston_acceleration(par, push)
        kick = a_p * 0.5 * par.dt
        if par.piston == Piston.ELASTIC:
            n = par.n_p
            top_p, bottom_p = inner_waves(par, bars.wp, bars.cp, n, r, kick)
            v_f = (2.0 * bars.wp[r + 1, 0] + kick + par.kappa_f * top_p) / (1.0 + par.kappa_f)
            bars.wp[Row.FACE, 0] = v_f
            v_p = 2.0 * bars.wp[r, n - 1] + kick
            v_p = (v_p + par.kappa_p * bottom_p) / (1.0 + par.kappa_p)
            # of the bit's end: waves that come to a viscous front have a peak that is not real
            peak = s.closed * par.z_t * (bars.wb[r, 0] - bars.wb[r + 1, 0])
        else:
            v_p = s.v_p + kick
            peak = par.z_t * (v_p - up)
        tau = time_to_cut(par, s, v_p - v_t, tau, time)
        if par.piston == Piston.ELASTIC:
            book_end(s, par.z_f, par.kappa_f, top_p, v_f * tau, v_f * v_f * tau, tau)
    else:
        v_p = 0.0
    half = 0.5 * tau
    impulse, d_p = meet_piston(
        par,
        s,
        bars,
        v_p,
        v_t,
        bottom_p,
        top,
        peak,
        tau,
        time,
        blows,
        events,
    )
    z = par.z_b * (1.0 + par.kappa_b)
    energy = 0.0
    if asks_for_energy(par, s, v_free, z, tau):
        energy = kinetic_energy(bars.wb, bars.cb, par.n_b, r)
    d, q = rock_step(par, s, energy, v_free, z, tau, time, events)
    book_end(s, par.z_b, par.kappa_b, bottom, d, q, tau)
    bars.wb[Row.FACE, par.n_b] = d / tau
    push_rock = z * (v_free * tau - d)
    s.rock_work += z * (v_free * d - q)
    s.i_bit += push_rock
    s.i_contact += impulse
    v_b = s.v_b
    move_bit(par, s, a_b, impulse - push_rock, half)
    if awake:
        u_before = s.u_r
        # the strain of the cells moves the mean by the trapezoidal rule, exactly
        if par.piston == Piston.ELASTIC:
            d_p = half * (2.0 * (s.v_p + a_p * half) - impulse / par.mass_p)
        s.u_r += d_p - half * (v_b + s.v_b)
        move_piston(par, s, push, impulse, u_before, time, tau, events)
    pass_time(par, s, tau)
    return top, bottom, top_p, bottom_p, tau


@merged
def move_bit(par, s, a_b, impulse, half):
    """Mean velocity of the bit over the step, and the work of its body forces."""
    v0 = s.v_b
    v1 = v0 + 2.0 * a_b * half + impulse / par.mass_b
    s.v_b = v1
    book_bit_load(par, s, half * (v0 + v1))


@merged
def move_piston(par, s, push, impulse, u_before, time, tau, events):
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
    v1 = v0 + piston_acceleration(par, push) * half
    v2 = v1 - impulse / par.mass_p
    v3 = v2 + piston_acceleration(par, later) * half
    first = 0.5 * half * (v0 + v1)
    second = 0.5 * half * (v2 + v3)
    s.v_p = v3
    s.e_drive += push * first + later * second
    s.e_gravity += par.mass_p * par.gravity * (first + second)
    s.i_drive += (push + later) * half
    move_to_components(par, s, first + second)
    if -s.u_r > s.b_stroke:
        s.b_stroke = -s.u_r
