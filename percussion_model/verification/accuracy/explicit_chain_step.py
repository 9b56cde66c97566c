"""Steps of explicit elements in a chain of bars: what its ends meet, and the ledger.

As in `explicit_step`, positions live at whole steps and velocities in the middle between them,
and the rock end is followed in closed form. What two ends do to each other in a step is one
impulse, from the velocity at which they would approach each other without it. Shoulders that
would pass through each other touch at the step's end.
"""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.blows import close_gap, open_gap, start_blow, starts_blow
from percussion_model.physics.body import piston_acceleration
from percussion_model.physics.drive import drive_force, switch_drive
from percussion_model.physics.kernel import fused, inlined, kernel, merged
from percussion_model.physics.readings import fill_ledger, fill_motion
from percussion_model.physics.records import Status
from percussion_model.physics.rock import recoverable
from percussion_model.scene.numbers import JOINT_KINDS
from percussion_model.verification.accuracy.explicit_step import (
    EXPLICIT_PAR,
    EXPLICIT_STATE,
    STRETCH,
    Joint,
    kinetic_energy,
    move_node,
    prepare_mode,
    ride,
    share_velocity,
    step_rock_end,
    sweep,
)

LOSSY = JOINT_KINDS.index("lossy")
PERFECT = JOINT_KINDS.index("perfect")
# Rows of `bars`: mean velocity and displacement, acceleration by body forces, and the
# impulses on either end in a step.
VELOCITY, POSITION, ACCELERATION, ABOVE, BELOW = range(5)
BAR_ROWS = 5
# Rows of `joints`: gap, or shortening of a lossy joint; stored energy; mean force in the last
# step, its least and its greatest so far, all positive in compression.
GAP, STORED, FORCE, LEAST, GREATEST = range(5)
JOINT_ROWS = 5

# A stretch of equal elements, and the bar that it belongs to.
CHAIN_STRETCH = np.dtype([("bar", "i8"), *((k, STRETCH[k]) for k in STRETCH.names or ())])
# A joint: its kind, the stretch above it, the reduced mass of both ends [kg], the preload of a
# thread [N], the stiffness of a thread or a spring [N/m] and its dashpot [N s/m].
FIT = np.dtype(
    [("kind", "i8"), ("upper", "i8")]
    + [(name, "f8") for name in ("shared", "preload", "stiffness", "damping")]
)
DAMPER = ("stiffness", "damping", "preload", "casing_mass")
CHAIN_PAR = np.dtype(
    [("bars", "i8"), ("damper", "i8")]
    + [(f"damper_{name}", "f8") for name in DAMPER]
    + [(name, EXPLICIT_PAR[name]) for name in EXPLICIT_PAR.names or ()]
)
CHAIN_STATE = np.dtype(
    # velocity and displacement of the casing, shortening of the damper, and its speed a step ago
    [(name, "f8") for name in ("v_c", "u_c", "x_c", "damper_speed")]
    + [(name, EXPLICIT_STATE[name]) for name in EXPLICIT_STATE.names or ()]
)


@inlined
def accelerations(par, s, bars, mass):
    """Put down what body forces do to each bar; the damper's force [N]."""
    for i in range(par.bars):
        bars[ACCELERATION, i] = par.gravity
    bars[ACCELERATION, 0] = piston_acceleration(par, drive_force(par, s))
    if par.damper == 0:
        bars[ACCELERATION, 1] += s.feed / mass[1]
        return 0.0
    speed = s.v_c - bars[VELOCITY, 1]
    now = 1.5 * speed - 0.5 * s.damper_speed  # velocities are those of half a step ago
    s.damper_speed = speed
    force = par.damper_preload + par.damper_stiffness * s.x_c + par.damper_damping * now
    force = max(force, 0.0)
    bars[ACCELERATION, 1] += force / mass[1]
    return force


@inlined
def joint_law(par, fits, joints, j, before, free):
    """Velocity at which the ends of a joint approach each other after a step [m/s].

    Parameters
    ----------
    before, free : float
        That of a step ago, and what it would be now without a force [m/s].
    """
    mass, gap, dt = fits[j].shared, joints[GAP, j], par.dt
    if fits[j].kind == PERFECT:
        return 0.0
    if fits[j].kind == LOSSY:
        k, c = fits[j].stiffness / mass, fits[j].damping / mass
        joints[GAP, j], after = ride(k, c, (free - before) / dt, gap, before, dt)
        return after
    # the thread's pull is that of the gap's mean by (1, 2, 1)/4, which is always stable
    q = 0.25 * dt * dt * fits[j].stiffness / mass
    pull = fits[j].preload + fits[j].stiffness * gap
    after = min((free + dt * pull / mass + q * before) / (1.0 + q), gap / dt)
    joints[GAP, j] = gap - dt * after
    return after


@inlined
def stored_in(fits, joints, j, gap):
    """Energy of a thread or of a lossy joint's spring at a gap [J]."""
    return gap * (fits[j].preload + 0.5 * fits[j].stiffness * gap)


@kernel
def note_contact(par, s, bars, before, gap, free, blows, events):
    """Note that piston and struck bar meet or part in this step."""
    if s.closed == 1:
        s.closed = 0
        s.v_p = bars[VELOCITY, 0]
        open_gap(s, events, s.time, before)
        return
    share = gap / (par.dt * free) if gap > 0.0 else 0.0
    time = s.time + share * par.dt
    if starts_blow(par, s, time):
        speed = s.v_p + (0.5 + share) * par.dt * bars[ACCELERATION, 0]
        here = bars[POSITION, par.bars - 1] + share * par.dt * s.v_b
        start_blow(par, s, blows, time, speed, here, math.nan)
    s.closed = 1
    close_gap(s, events, time, free)


@merged
def meet(par, s, runs, fits, bars, joints, v, j, blows, events):
    """Let the ends at a joint meet."""
    r = fits[j].upper
    above = v[runs[r].first + runs[r].n]
    before, free = above - v[runs[r + 1].first], runs[r].low - runs[r + 1].top
    gap = joints[GAP, j]
    after = joint_law(par, fits, joints, j, before, free)
    touches = joints[GAP, j] <= 0.0
    impulse = fits[j].shared * (free - after)
    force = impulse / par.dt
    middle = joints[GAP, j] if fits[j].kind == LOSSY else 0.5 * (gap + joints[GAP, j])
    stored = stored_in(fits, joints, j, middle)
    into = 0.5 * impulse * (before + after) - (stored - joints[STORED, j])
    if fits[j].kind == LOSSY:
        # the dashpot's share by the energy law; `ride` follows it exactly
        way = joints[GAP, j] - gap
        kinetic = 0.5 * (after - before) * (after + before)
        pushed = fits[j].shared * ((free - before) / par.dt * way - kinetic)
        taken = pushed - (stored - joints[STORED, j])
        s.e_joints += taken
        into -= taken
    s.e_numerical += into
    joints[STORED, j] = stored
    joints[FORCE, j] = force
    joints[LEAST, j] = min(joints[LEAST, j], force)
    joints[GREATEST, j] = max(joints[GREATEST, j], force)
    bars[BELOW, j] = bars[ABOVE, j + 1] = impulse
    runs[r].low -= impulse / runs[r].half
    runs[r + 1].top += impulse / runs[r + 1].half
    if j > 0:
        return
    if touches != (s.closed == 1):
        note_contact(par, s, bars, before, gap, free, blows, events)
    s.gap = joints[GAP, 0]
    s.i_contact += impulse
    s.contact_force = force
    s.b_peak_contact = max(s.b_peak_contact, force)
    s.peak_contact_force = max(s.peak_contact_force, force)


@inlined
def rock_energy(par, s):
    """Where the work on the rock has gone [J]."""
    return s.e_crushing + s.e_barrier + s.e_standstill + recoverable(par, s)


@merged
def meet_rock(par, s, runs, bars, w, v, events):
    """Let the bit's lower end meet the rock."""
    last = runs.shape[0] - 1
    before, free = s.v_end, runs[last].low
    work, gone = s.rock_work, rock_energy(par, s)
    step_rock_end(par, s, runs, w, v, (free - before) / par.dt, events)
    runs[last].low = s.v_end
    impulse, work = par.end_mass * (free - s.v_end), s.rock_work - work
    s.e_numerical += 0.5 * impulse * (before + s.v_end) - work
    s.e_overshoot += work - (rock_energy(par, s) - gone)
    bars[BELOW, par.bars - 1] = impulse


@inlined
def damper_stored(par, s):
    """Energy of the damper's spring, which only pushes, beyond that of its preload [J]."""
    if par.damper_stiffness == 0.0:
        return par.damper_preload * s.x_c
    force = max(par.damper_preload + par.damper_stiffness * s.x_c, 0.0)
    return 0.5 * (force * force - par.damper_preload * par.damper_preload) / par.damper_stiffness


@merged
def move_means(par, s, bars, mass, damper):
    """Mean motion of bars and casing, and the work of body forces."""
    push = drive_force(par, s)
    for i in range(par.bars):
        v0 = bars[VELOCITY, i]
        v1 = v0 + par.dt * bars[ACCELERATION, i] + (bars[ABOVE, i] - bars[BELOW, i]) / mass[i]
        bars[VELOCITY, i] = v1
        bars[POSITION, i] += par.dt * v1
        path = 0.5 * par.dt * (v0 + v1)
        s.e_gravity += mass[i] * par.gravity * path
        if i == 0:
            s.e_drive += push * path
            s.i_drive += push * par.dt
        elif i == 1 and par.damper == 0:
            s.e_feed += s.feed * path
        elif i == 1:
            s.e_joints -= damper * path
    s.v_p, s.v_b = bars[VELOCITY, 0], bars[VELOCITY, par.bars - 1]
    s.u_r = bars[POSITION, 0] - bars[POSITION, 1]
    if par.damper == 1:
        v0 = s.v_c
        s.v_c += par.dt * (s.feed - push - damper) / par.damper_casing_mass
        s.u_c += par.dt * s.v_c
        before = damper_stored(par, s)
        path = 0.5 * par.dt * (v0 + s.v_c)
        s.e_feed += s.feed * path
        s.e_drive -= push * path
        s.x_c = s.u_c - bars[POSITION, 1]
        s.e_joints += damper * path - (damper_stored(par, s) - before)
        s.u_r = bars[POSITION, 0] - s.u_c
    s.b_stroke = max(s.b_stroke, -s.u_r)


@fused
def strain_work(before, v, first, n):
    """Sum over a stretch of rate of strain a step ago times twice its mean [m2/s2]."""
    total = 0.0
    old, new = before[first:], v[first:]
    for i in range(n):
        rate = old[i + 1] - old[i]
        total += rate * (rate + (new[i + 1] - new[i]))
    return total


@inlined
def first_below(runs):
    """The first stretch below the piston."""
    r = 0
    while runs[r].bar == 0:
        r += 1
    return r


@merged
def turn_pressure(par, s, runs, bars, w, v, mass, events):
    """Turn the drive where the relative motion has passed its threshold in this step."""
    speed = s.v_c if par.damper == 1 else bars[VELOCITY, 1]
    u_before = s.u_r - par.dt * (s.v_p - speed)
    push = drive_force(par, s)
    share = switch_drive(par, s, u_before, s.time, par.dt, events)
    if share < 0.0:
        return
    # what the new force did to piston and casing up to the middle of the step
    impulse = (drive_force(par, s) - push) * (0.5 - share) * par.dt
    kick = impulse / mass[0]
    s.e_drive += impulse * (s.v_p + 0.5 * kick)
    s.i_drive += impulse
    for i in range(runs[first_below(runs)].first):
        v[i] += kick
        w[i] += par.eta * kick
    bars[VELOCITY, 0] += kick
    s.v_p += kick
    if par.damper == 1:
        recoil = impulse / par.damper_casing_mass
        s.e_drive -= impulse * (s.v_c - 0.5 * recoil)
        s.v_c -= recoil


@kernel
def step(par, s, runs, fits, mass, bars, joints, old, new, v, before, blows, events):
    """Take one step from led positions `old` to `new`."""
    dt = par.dt
    damper = accelerations(par, s, bars, mass)
    last = runs.shape[0] - 1
    for r in range(last + 1):
        i, j = runs[r].first, runs[r].first + runs[r].n
        kick, pull = dt * bars[ACCELERATION, runs[r].bar], 2.0 * runs[r].kappa
        runs[r].top = v[i] + (pull * (old[i + 1] - old[i]) + kick)
        runs[r].low = v[j] + (pull * (old[j - 1] - old[j]) + kick)
    meet_rock(par, s, runs, bars, old, v, events)
    for r in range(last):
        if runs[r].joint == Joint.WELD:
            share_velocity(runs, r)
    for j in range(fits.shape[0]):
        meet(par, s, runs, fits, bars, joints, v, j, blows, events)
    if par.eta > 0.0:
        for i in range(v.shape[0]):
            before[i] = v[i]
    for r in range(last + 1):
        i = runs[r].first
        move_node(par, old, new, v, i, runs[r].top)
        move_node(par, old, new, v, i + runs[r].n, runs[r].low)
        kick = dt * bars[ACCELERATION, runs[r].bar]
        sweep(old, new, v, i, runs[r].n - 1, runs[r].kappa, kick, par.eta, dt + par.eta)
        if par.eta > 0.0:
            share = par.eta * runs[r].kappa * runs[r].half  # half of eta k dt
            s.e_loss += share * strain_work(before, v, i, runs[r].n)
    move_means(par, s, bars, mass, damper)
    turn_pressure(par, s, runs, bars, new, v, mass, events)


@merged
def advance_to(par, s, runs, fits, mass, bars, joints, rows, time, blows, events):
    """Take the whole steps up to `time`; a `Status`."""
    s.n_blows = 0
    s.n_events = 0
    while s.time + par.dt <= time:
        if s.live == 1:
            if s.n_blows >= blows.shape[0]:
                return Status.BLOWS_FULL
            if s.events_on == 1 and s.n_events + 3 * par.most_changes > events.shape[0]:
                return Status.EVENTS_FULL
        old, new = rows[s.flip], rows[1 - s.flip]
        step(par, s, runs, fits, mass, bars, joints, old, new, rows[2], rows[3], blows, events)
        s.flip = 1 - s.flip
        s.count_steps += 1
        s.time = s.count_steps * par.dt
        if not math.isfinite(s.p + s.v_end + s.v_b + s.v_p):
            return Status.NOT_FINITE
    return Status.DONE


@kernel
def stored(par, s, runs, joints, w, v):
    """Energy of motion half a step ago, and of strain in bars, joints and damper then [J]."""
    kinetic = elastic = 0.0
    for r in range(runs.shape[0]):
        for i in range(runs[r].first, runs[r].first + runs[r].n):
            kinetic += 0.5 * runs[r].half * (v[i] * v[i] + v[i + 1] * v[i + 1])
            rate = v[i + 1] - v[i]
            stretch = w[i + 1] - w[i] - par.eta * rate
            stiff = 2.0 * runs[r].half * runs[r].kappa / par.dt
            elastic += 0.5 * stiff * stretch * (stretch - par.dt * rate)
    for j in range(joints.shape[1]):
        elastic += joints[STORED, j]
    if par.damper == 1:
        kinetic += 0.5 * par.damper_casing_mass * s.v_c * s.v_c
        elastic += damper_stored(par, s)
    return kinetic, elastic


@kernel
def begin(par_, state, runs, mass, bars, joints, rows):
    """Complete a new state: nodes by the mean motion of their bars, half a step back; energy."""
    par, s = par_[0], state[0]
    half = 0.5 * par.dt
    damper = accelerations(par, s, bars, mass)
    casing = par.damper_casing_mass if par.damper == 1 else 1.0
    s.v_c -= half * (s.feed - drive_force(par, s) - damper) / casing
    for i in range(par.bars):
        bars[VELOCITY, i] -= half * bars[ACCELERATION, i]
    for r in range(runs.shape[0]):
        v, u = bars[VELOCITY, runs[r].bar], bars[POSITION, runs[r].bar]
        for i in range(runs[r].first, runs[r].first + runs[r].n + 1):
            rows[2, i] = v
            rows[0, i] = u + par.eta * v
    s.v_end = bars[VELOCITY, par.bars - 1]
    s.p -= half * s.v_end
    s.alert = 1
    prepare_mode(par, s)
    kinetic, elastic = stored(par, s, runs, joints, rows[0], rows[2])
    s.e_start = kinetic + elastic + recoverable(par, s)


@kernel
def run(reads, par_, state, runs, fits, mass, bars, joints, rows, time, blows, events, reading):
    """Take the whole steps up to `time`, and read the state where `reads` is 1."""
    par, s = par_[0], state[0]
    if reads == 0:
        return advance_to(par, s, runs, fits, mass, bars, joints, rows, time, blows, events)
    row, w, v = reading[0], rows[s.flip], rows[2]
    kinetic, elastic = stored(par, s, runs, joints, w, v)
    fill_ledger(s, row, kinetic, elastic, recoverable(par, s))
    fill_motion(par, s, row, time, bars[POSITION, 0] + par.start_gap, bars[POSITION, par.bars - 1])
    row.bit_end_velocity = s.v_end
    row.bit_kinetic_energy = kinetic_energy(par, s, runs, w, v, 0.0)
    row.contact_force = s.contact_force
    row.bit_force = s.force
    return Status.DONE
