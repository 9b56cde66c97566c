"""A piston in free flight waits until it can next meet something.

Between blows the piston only flies. It stays at an earlier step, and is
carried to the present in one leap before contact or a switch of the drive can
possibly come (docs/numerics.md, section 5).
"""

from __future__ import annotations

import math

from percussion_model.physics.drive import PRESSURE, drive_force
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.records import Mode, Piston
from percussion_model.physics.rock import recoverable
from percussion_model.solvers.wave.bar import (
    deviation_energy,
    elastic_energy,
    kinetic_energy,
    strain_offset,
    time_to_cover,
)
from percussion_model.solvers.wave.leaps.contact_leap import GRAIN, WATCHED
from percussion_model.solvers.wave.leaps.gap_watch import watch_gap
from percussion_model.solvers.wave.leaps.leap import (
    FEWEST_STEPS,
    drills_not,
    leap_free_bar,
    lifts_not,
    longest_leap,
    plan_leap,
    standstill_energy,
)
from percussion_model.solvers.wave.records import Coef
from percussion_model.solvers.wave.totals import resync

SS = int(Mode.SS)
ELASTIC = int(Piston.ELASTIC)
TOP, BOTTOM = int(Coef.TOP), int(Coef.BOTTOM)

# How far ahead a moving bit's path is bounded at a time [s].
HORIZON = 0.01


@merged
def bit_bounds(par, s, wb, cb):
    """How far the bit can move while the piston sleeps.

    Energy bounds velocity and strain: |V| <= sqrt(2 E / M) + |a| t, and the
    offset of an end <= bound sqrt(2 E).

    Returns
    -------
    speed, acceleration : float
        Bounds of the mean motion [m/s, m/s2].
    spread : float
        Bound of the top end's motion about it [m].
    horizon : float
        Time over which they hold [s].
    pace : float
        Bound of the mean velocity, though it may lead nowhere [m/s].
    """
    a = par.gravity + s.feed / par.mass_b
    if s.mode == SS:
        energy = standstill_energy(par, s, wb, cb)
        if drills_not(par, s, energy) and lifts_not(par, s, energy):
            spread = math.sqrt(2.0 * energy / (s.gamma * s.k_r))
            spread += (par.bound_t + 2.0 * par.bound_b) * math.sqrt(2.0 * energy)
            return 0.0, 0.0, spread, math.inf, math.sqrt(2.0 * energy / par.mass_b)
    r = 2 * s.parity
    energy = kinetic_energy(wb, cb, par.n_b, r) + elastic_energy(wb, cb, par.n_b, r)
    energy += recoverable(s)
    speed = math.sqrt(2.0 * energy / par.mass_b)
    fall = speed * HORIZON + 0.5 * abs(a) * HORIZON * HORIZON
    energy += par.mass_b * abs(a) * fall
    return speed, abs(a), par.bound_t * math.sqrt(2.0 * energy), HORIZON, speed


@kernel
def quiet_steps(par, s, wb, cb, gap, u_r, v):
    """Steps before which neither contact nor a switch of the drive can come.

    Parameters
    ----------
    gap, u_r, v : float
        Gap and relative displacement [m], and the piston's mean velocity
        [m/s], at the present step.
    """
    speed, slack, spread, limit, pace = bit_bounds(par, s, wb, cb)
    a = par.gravity + drive_force(par, s) / par.mass_p
    margin = 2.0 * (spread + s.spread_p)
    limit = min(limit, time_to_cover(gap - margin, v + speed, a + slack))
    if par.drive == PRESSURE:
        if s.alpha > 0:
            limit = min(limit, time_to_cover(-u_r - margin, v + speed, a + slack))
        else:
            room = s.reversal + u_r - margin
            limit = min(limit, time_to_cover(room, speed - v, slack - a))
    if a > 0.0 and v < pace:
        # look at the top, which is the stroke: where the bit moves, all along it
        top = (-pace - v) / (a + slack)
        if top > FEWEST_STEPS * par.dt:
            limit = min(limit, top)
        else:
            limit = 0.0
    most = longest_leap(par) - (s.step - s.piston_step)
    if limit < most * par.dt:
        return int(limit / par.dt) - 1
    return most


@kernel
def put_to_sleep(par, s, wp, cp, wb, cb, ops, x, v, y):
    """Let the piston wait where it cannot meet anything soon."""
    if s.closed == 1 or s.gap <= 0.0:
        s.no_sleep = s.step + 1
        return
    resync(par, s, wp, cp, wb, cb)
    r = 2 * s.parity
    s.spread_p = 0.0
    if par.piston == ELASTIC:
        energy = deviation_energy(wp, cp, par.n_p, r, s.v_p, 0.0)
        s.spread_p = par.bound_p * math.sqrt(2.0 * energy)
    s.piston_step = s.step
    steps = quiet_steps(par, s, wb, cb, s.gap, s.u_r, s.v_p)
    if steps < FEWEST_STEPS:
        steps = watched_steps(par, s, wp, cp, wb, cb, ops, x, v, y)
    if steps < FEWEST_STEPS:
        return
    s.asleep = 1
    s.piston_parity = s.parity
    s.wake = s.step + steps
    s.moved = -s.p - strain_offset(wb, cb, par.n_b, r, BOTTOM)
    s.x_sleep = s.x_r


@kernel
def watched_steps(par, s, wp, cp, wb, cb, ops, x, v, y):
    """Steps over which the gap is seen to stay open while the bit leaps.

    Plans the bit's leap along with it; where there is none, s.no_sleep says
    when to look again.
    """
    s.no_sleep = s.step + FEWEST_STEPS
    steps = min(quiet_steps(par, s, wb, cb, math.inf, s.u_r, s.v_p), WATCHED)
    if steps < FEWEST_STEPS:
        return 0
    plan_leap(par, s, wb, cb, ops[2], x, v, steps)
    if s.leap_end < 0:
        s.no_sleep = s.no_plan
        return 0
    steps = watch_gap(par, s, wp, cp, wb, cb, ops[4], ops[5], x, y, s.leap_end - s.step)
    if steps < FEWEST_STEPS:
        s.no_sleep = s.step + steps + 1
        s.leap_end = -1
        return 0
    s.leap_end = s.step + steps - steps % GRAIN
    return s.leap_end - s.step


@kernel
def mean_motion(par, s, wb, cb):
    """Mean motion of a sleeping piston at the present step.

    Returns
    -------
    u_r : float
        Relative displacement [m].
    v : float
        Mean velocity of the piston [m/s].
    path : float
        Its mean displacement since it sleeps [m].
    """
    time = (s.step - s.piston_step) * par.dt
    a = par.gravity + drive_force(par, s) / par.mass_p
    path = (s.v_p + 0.5 * a * time) * time
    here = s.moved + s.p + strain_offset(wb, cb, par.n_b, 2 * s.parity, BOTTOM)
    return s.u_r + path - here - (s.x_r - s.x_sleep), s.v_p + a * time, path


@kernel
def sleep_on(par, s, wb, cb):
    """Whether the piston can go on sleeping, as far as its mean motion tells."""
    u_r, v, _ = mean_motion(par, s, wb, cb)
    s.b_stroke = max(s.b_stroke, -u_r)
    gap = strain_offset(wb, cb, par.n_b, 2 * s.parity, TOP) - u_r
    steps = quiet_steps(par, s, wb, cb, gap, u_r, v)
    if steps < FEWEST_STEPS:
        return False
    s.wake = s.step + steps
    return True


@kernel
def wake_piston(par, s, wp, cp, wb, cb, powers, x, y):
    """Carry the sleeping piston to the present step."""
    steps = s.step - s.piston_step
    r = 2 * s.parity
    push = drive_force(par, s)
    v0 = s.v_p
    s.u_r, s.v_p, path = mean_motion(par, s, wb, cb)
    s.asleep = 0
    if par.piston == ELASTIC:
        n = par.n_p
        if s.piston_parity != s.parity:
            for i in range(n):
                wp[r, i] = wp[2 - r, i]
                wp[r + 1, i] = wp[3 - r, i]
        leap_free_bar(par, s, wp, cp, n, par.mass_p, v0, s.v_p, steps, powers, par.size_p, x, y)
    s.gap = strain_offset(wb, cb, par.n_b, r, TOP) - s.u_r
    if par.piston == ELASTIC:
        s.gap += strain_offset(wp, cp, par.n_p, r, BOTTOM)
    s.e_drive += push * path
    s.e_gravity += par.mass_p * par.gravity * path
    s.i_drive += push * steps * par.dt
    s.b_stroke = max(s.b_stroke, -s.u_r)
