"""Dormant piston: one in free flight waits until it can next meet something.

Between blows the piston only flies. It stays at an earlier step, and is
carried to the present in one leap before contact or a switch of the drive can
possibly come (docs/numerics.md, section 5).
"""

from __future__ import annotations

import math

from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.loads import (
    bit_acceleration,
    book_piston_load,
    drive_force,
    piston_acceleration,
    room_to_turn,
    time_to_cover,
)
from percussion_model.physics.records import Mode, Piston
from percussion_model.physics.rock import recoverable
from percussion_model.solvers.wave.bar import (
    deviation_energy,
    elastic_energy,
    kinetic_energy,
    strain_offset,
)
from percussion_model.solvers.wave.leaps.leap import (
    FEWEST_STEPS,
    keeps_contact,
    leap_free_bar,
    longest_leap,
    plan_leap,
    standstill_energy,
    stays_below_barrier,
)
from percussion_model.solvers.wave.leaps.lookahead import GRAIN, LOOKAHEAD, steps_with_open_gap
from percussion_model.solvers.wave.records import Coef
from percussion_model.solvers.wave.totals import resync

# How far ahead a moving bit's path is bounded at a time [s].
HORIZON = 0.01


@merged
def bit_bounds(par, s, wb, cb):
    """How far the bit can move while the piston is dormant.

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
    a = bit_acceleration(par, s)
    if s.mode == Mode.SS:
        energy = standstill_energy(par, s, wb, cb)
        if stays_below_barrier(par, s, energy) and keeps_contact(par, s, energy):
            spread = math.sqrt(2.0 * energy / (s.gamma * s.k_r))
            spread += (par.bound_t + 2.0 * par.bound_b) * math.sqrt(2.0 * energy)
            return 0.0, 0.0, spread, math.inf, math.sqrt(2.0 * energy / par.mass_b)
    r = 2 * s.parity
    energy = kinetic_energy(wb, cb, par.n_b, r) + elastic_energy(wb, cb, par.n_b, r)
    energy += recoverable(par, s)
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
    a = piston_acceleration(par, drive_force(par, s))
    margin = 2.0 * (spread + s.spread_p)
    limit = min(limit, time_to_cover(gap - margin, v + speed, a + slack))
    room = room_to_turn(par, s, u_r) - margin
    limit = min(limit, time_to_cover(room, speed + s.alpha * v, slack + s.alpha * a))
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
def make_dormant(par, s, bars, ops, scratch):
    """Let the piston wait where it cannot meet anything soon."""
    if s.closed == 1 or s.gap <= 0.0:
        s.no_dormancy = s.step + 1
        return
    resync(par, s, bars)
    r = 2 * s.parity
    s.spread_p = 0.0
    if par.piston == Piston.ELASTIC:
        energy = deviation_energy(bars.wp, bars.cp, par.n_p, r, s.v_p, 0.0)
        s.spread_p = par.bound_p * math.sqrt(2.0 * energy)
    s.piston_step = s.step
    steps = quiet_steps(par, s, bars.wb, bars.cb, s.gap, s.u_r, s.v_p)
    if steps < FEWEST_STEPS:
        steps = steps_with_lookahead(par, s, bars, ops, scratch)
    if steps < FEWEST_STEPS:
        return
    s.dormant = 1
    s.piston_parity = s.parity
    s.wake = s.step + steps
    s.moved = -s.p - strain_offset(bars.wb, bars.cb, par.n_b, r, Coef.BOTTOM)
    s.x_dormant = s.x_r


@kernel
def steps_with_lookahead(par, s, bars, ops, scratch):
    """Steps over which the gap is seen to stay open while the bit leaps.

    Plans the bit's leap along with it; where there is none, s.no_dormancy says
    when to look again.
    """
    s.no_dormancy = s.step + FEWEST_STEPS
    steps = min(quiet_steps(par, s, bars.wb, bars.cb, math.inf, s.u_r, s.v_p), LOOKAHEAD)
    if steps < FEWEST_STEPS:
        return 0
    plan_leap(par, s, bars.wb, bars.cb, ops.lookahead, scratch, steps)
    if s.leap_end < 0:
        s.no_dormancy = s.no_plan
        return 0
    steps = steps_with_open_gap(par, s, bars, ops.top, ops.bottom, scratch, s.leap_end - s.step)
    if steps < FEWEST_STEPS:
        s.no_dormancy = s.step + steps + 1
        s.leap_end = -1
        return 0
    s.leap_end = s.step + steps - steps % GRAIN
    return s.leap_end - s.step


@kernel
def mean_motion(par, s, wb, cb):
    """Mean motion of a dormant piston at the present step.

    Returns
    -------
    u_r : float
        Relative displacement [m].
    v : float
        Mean velocity of the piston [m/s].
    path : float
        Its mean displacement since it is dormant [m].
    """
    time = (s.step - s.piston_step) * par.dt
    a = piston_acceleration(par, drive_force(par, s))
    path = (s.v_p + 0.5 * a * time) * time
    here = s.moved + s.p + strain_offset(wb, cb, par.n_b, 2 * s.parity, Coef.BOTTOM)
    return s.u_r + path - here - (s.x_r - s.x_dormant), s.v_p + a * time, path


@kernel
def stays_dormant(par, s, wb, cb):
    """Whether the piston can stay dormant, as far as its mean motion tells."""
    u_r, v, _ = mean_motion(par, s, wb, cb)
    s.b_stroke = max(s.b_stroke, -u_r)
    gap = strain_offset(wb, cb, par.n_b, 2 * s.parity, Coef.TOP) - u_r
    steps = quiet_steps(par, s, wb, cb, gap, u_r, v)
    if steps < FEWEST_STEPS:
        return False
    s.wake = s.step + steps
    return True


@kernel
def wake_piston(par, s, bars, ops, scratch):
    """Carry the dormant piston to the present step."""
    steps = s.step - s.piston_step
    r = 2 * s.parity
    push = drive_force(par, s)
    v0 = s.v_p
    s.u_r, s.v_p, path = mean_motion(par, s, bars.wb, bars.cb)
    s.dormant = 0
    if par.piston == Piston.ELASTIC:
        n = par.n_p
        if s.piston_parity != s.parity:
            for i in range(n):
                bars.wp[r, i] = bars.wp[2 - r, i]
                bars.wp[r + 1, i] = bars.wp[3 - r, i]
        leap_free_bar(
            par, s, bars.wp, bars.cp, n, par.mass_p, v0, s.v_p, steps,
            ops.piston, ops.piston_loss, par.size_p, scratch,
        )  # fmt: skip
    s.gap = strain_offset(bars.wb, bars.cb, par.n_b, r, Coef.TOP) - s.u_r
    if par.piston == Piston.ELASTIC:
        s.gap += strain_offset(bars.wp, bars.cp, par.n_p, r, Coef.BOTTOM)
    book_piston_load(par, s, push, path, push * steps * par.dt)
    s.b_stroke = max(s.b_stroke, -s.u_r)
