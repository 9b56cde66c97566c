"""Steps of the explicit elements: leapfrog between hard contact and the law of the rock.

Positions live at whole steps, velocities in the middle between them. Piston and struck bar
that meet within a step take their common velocity, and keep it as long as they press on each
other. Two bars pass `chain` as None, which leaves out at compilation what chains alone need.
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from percussion_model.physics.blows import close_gap, open_gap, start_blow, starts_blow
from percussion_model.physics.kernel import fused, inlined, kernel, merged
from percussion_model.physics.loads import (
    bit_acceleration,
    drive_force,
    piston_acceleration,
    switch_drive,
)
from percussion_model.physics.readings import fill_ledger, fill_motion
from percussion_model.physics.records import Mode, Status
from percussion_model.physics.rock import overcomes_barrier, recoverable, spring_force, stiffness
from percussion_model.physics.state import COMMON_PARAMETERS, COMMON_STATE
from percussion_model.verification.accuracy.explicit_joints import (
    ACCELERATION,
    DAMPER,
    POSITION,
    Chain,
    book_joint,
    held,
    join,
    kick_means,
    load_bars,
    meet_rock,
    move_means,
    speeds,
    strain_work,
    stroke_speed,
)
from percussion_model.verification.accuracy.explicit_rock import kinetic_energy

# Steps between two looks at the mean motion and at what the bit's energy is.
LOOK = 64
# Bound of the mean relative speed until the next look: so often what it is, and so much more [m/s].
FASTER, FASTER_BY = 2.0, 5.0
# A bit whose energy is below this share of the barrier cannot pass it without a blow.
SURELY = 0.5
# Bars with less energy of vibration than this count as rigid [J]; a blow has some 300 J.
QUIET = 1e-7
# A quiet piston has nodes again so many steps before its gap can close.
AHEAD = 4.0


class Joint(IntEnum):
    """What is below a stretch of equal elements."""

    WELD = 0  # the next stretch of the same bar
    CONTACT = 1  # the bar that the piston strikes
    ROD = 2  # the bar below a rod
    ROCK = 3


# A stretch of equal elements; both of its ends are nodes of its own.
STRETCH = np.dtype(
    [
        ("bar", "i8"),  # that it belongs to
        ("first", "i8"),  # node
        ("n", "i8"),  # elements
        ("bit", "i8"),  # 1: of the bit
        ("joint", "i8"),  # Joint
        ("half", "f8"),  # half the mass of an element [kg]
        ("kappa", "f8"),  # time step times stiffness of an element by its mass [1/s]
        *((name, "f8") for name in ("top", "low")),  # velocities of both ends after a step [m/s]
    ],
    align=True,
)

EXPLICIT_PAR = np.dtype(
    [
        ("dt", "f8"),  # time step [s]
        ("eta", "f8"),  # Kelvin-Voigt time [s]
        ("end_mass", "f8"),  # at the bit's rock end [kg]
        ("start_gap", "f8"),  # [m]
        ("bars", "i8"),
        ("uppers", "i8"),  # stretches of the piston
        ("bit_from", "i8"),  # first stretch of the bit
        ("most_changes", "i8"),  # of mode within a step; more are a loop
        ("damper", "i8"),  # 1: between casing and top rod
        *((f"damper_{name}", "f8") for name in DAMPER),
        *COMMON_PARAMETERS,
    ],
    align=True,
)

EXPLICIT_STATE = np.dtype(
    [
        ("time", "f8"),  # of the positions [s]
        ("v_end", "f8"),  # of the rock end, half a step before, as `p` is [m/s]
        ("force", "f8"),  # on the rock then, and a step before [N]
        ("force_before", "f8"),
        ("contact_force", "f8"),  # mean of the last step [N]
        ("by_a", "f8"),  # place of rest by acceleration in the present mode [s2]
        ("p_by_p", "f8"),  # place from there and velocity after a whole step, by those before
        ("p_by_v", "f8"),
        ("v_by_p", "f8"),
        ("v_by_v", "f8"),
        ("u_p", "f8"),  # mean displacement of a quiet piston [m]
        ("quiet_p", "i8"),  # 1: the piston moves as a rigid body
        ("quiet_b", "i8"),  # 1: and the bit stands still
        ("flip", "i8"),  # 1: the second row of positions is the present one
        ("look_in", "i8"),  # steps to the next look at the mean motion
        ("alert", "i8"),  # 1: the bit may have more energy than the barrier of its standstill
        # casing: velocity, displacement; damper: shortening, and its speed a step ago
        *((name, "f8") for name in ("v_c", "u_c", "x_c", "damper_speed")),
        *COMMON_STATE,
    ],
    align=True,
)


@fused
def sweep(old, new, v, first, inner, kappa, kick, eta, reach):
    """One step of the inner nodes of a stretch from led positions `old` to `new`."""
    for j in range(np.uint64(inner)):
        # unsigned places, which cannot count from the end, make it a loop over vectors
        i = np.uint64(first) + np.uint64(j)
        k = i + np.uint64(1)
        before = v[k]
        after = before + (kappa * ((old[i] - old[k]) + (old[k + np.uint64(1)] - old[k])) + kick)
        v[k] = after
        new[k] = old[k] + (reach * after - eta * before)


@fused
def total(a, first, n):
    """Sum over a stretch, its ends by half."""
    inner = 0.0
    x = a[first:]
    for j in range(n - 1):
        inner += x[j + 1]
    return inner + 0.5 * (x[0] + x[n])


@merged
def read_means(par, s, runs, chain, w, v):
    """Mean velocities, and the mean displacements of piston and bit."""
    if chain is not None:
        return chain.bars[POSITION, 0], chain.bars[POSITION, par.bars - 1]
    u_p = u_b = v_p = v_b = 0.0
    for r in range(par.uppers if s.quiet_p == 1 else 0, runs.shape[0]):
        mass = 2.0 * runs[r].half
        speed = total(v, runs[r].first, runs[r].n)
        place = total(w, runs[r].first, runs[r].n) - par.eta * speed
        if runs[r].bit == 1:
            u_b += mass * place
            v_b += mass * speed
        else:
            u_p += mass * place
            v_p += mass * speed
    s.v_b = v_b / par.mass_b
    if s.quiet_p == 1:
        return s.u_p, u_b / par.mass_b
    if par.mass_p > 0.0:
        s.v_p = v_p / par.mass_p
        return u_p / par.mass_p, u_b / par.mass_b
    return 0.0, u_b / par.mass_b


@kernel
def begin_contact(par, s, runs, chain, w, v, time, share, approach, blows, events):
    """Note that the gap closes after a share of the step that begins now."""
    _, u_b = read_means(par, s, runs, chain, w, v)
    s.v_p += (0.5 + share) * par.dt * piston_acceleration(par, drive_force(par, s))
    if starts_blow(par, s, time):
        start_blow(par, s, blows, time, s.v_p, u_b + share * par.dt * s.v_b, math.nan)
    s.closed = 1
    s.alert = 1
    s.look_in = 0
    close_gap(s, events, time, approach)


@inlined
def share_velocity(runs, upper):
    """Two ends that touch get their common velocity."""
    heavy, light = runs[upper].half, runs[upper + 1].half
    common = (heavy * runs[upper].low + light * runs[upper + 1].top) / (heavy + light)
    runs[upper].low = runs[upper + 1].top = common


@merged
def meet(par, s, runs, chain, w, v, upper, blows, events):
    """Contact of the piston: velocities of their ends, and the way before they met [m].

    It is what the piston's end goes in this step beyond what it does at its new velocity.
    """
    lower = upper + 1
    heavy, light = runs[upper].half, runs[lower].half
    approach = runs[upper].low - runs[lower].top
    way = 0.0
    gap = s.gap
    if s.closed == 0:
        s.gap -= par.dt * approach
        if s.gap > 0.0 or approach <= 0.0:
            return 0.0
    shared = heavy * light / (heavy + light)
    if s.closed == 1:
        if approach <= 0.0:
            s.closed = 0
            s.contact_force = 0.0
            read_means(par, s, runs, chain, w, v)
            open_gap(s, events, s.time, approach)
            s.gap = -par.dt * approach
            s.look_in = 0
            return 0.0
        s.contact_force = shared * approach / par.dt
        s.b_peak_contact = max(s.b_peak_contact, s.contact_force)
        s.peak_contact_force = max(s.peak_contact_force, s.contact_force)
    else:
        share = gap / (par.dt * approach)
        time = s.time + share * par.dt
        begin_contact(par, s, runs, chain, w, v, time, share, approach, blows, events)
        way = share * par.dt * shared * approach / heavy
        s.gap = 0.0
    s.i_contact += shared * approach
    share_velocity(runs, upper)
    return way


@inlined
def move_node(par, old, new, v, i, after):
    """Give a node at an end its velocity and its place."""
    new[i] = old[i] + ((par.dt + par.eta) * after - par.eta * v[i])
    v[i] = after


@inlined
def fly(par, s, push, top):
    """One step of a quiet piston over a bit whose upper end has the velocity `top`."""
    s.v_p += push
    s.u_p += par.dt * s.v_p
    s.gap -= par.dt * (s.v_p - top)


@inlined
def kick_of(par, runs, chain, r, push, load):
    """What body forces add to the velocities of a stretch in a step [m/s]."""
    if chain is not None:
        return par.dt * chain.bars[ACCELERATION, runs[r].bar]
    return load if runs[r].bit == 1 else push


@inlined
def close_way(par, s, runs, chain, new, v, way):
    """Put both ends that have met in the middle of a step at one place."""
    lower = par.uppers
    i = runs[lower].first
    before = held(par, s, runs, chain, new, v)[1] if chain is not None else 0.0
    new[i - 1] += way
    shift = new[i - 1] - new[i]
    new[i] = new[i - 1]
    if chain is not None:
        s.e_numerical += before - held(par, s, runs, chain, new, v)[1]
        chain.bars[POSITION, 0] += way * runs[lower - 1].half / chain.mass[0]
        chain.bars[POSITION, 1] += shift * runs[lower].half / chain.mass[1]


@kernel
def step(par, s, runs, chain, old, new, v, blows, events):
    """Take one step from led positions `old` to `new`."""
    dt = par.dt
    push = dt * piston_acceleration(par, drive_force(par, s)) if par.mass_p > 0.0 else 0.0
    load = dt * bit_acceleration(par, s)
    damper = load_bars(par, s, chain) if chain is not None else 0.0
    first = par.uppers if s.quiet_p == 1 else 0
    last = runs.shape[0] - 1
    for r in range(first, last + 1):
        i = runs[r].first
        j = i + runs[r].n
        kick = kick_of(par, runs, chain, r, push, load)
        pull = 2.0 * runs[r].kappa
        runs[r].top = v[i] + (pull * (old[i + 1] - old[i]) + kick)
        runs[r].low = v[j] + (pull * (old[j - 1] - old[j]) + kick)
    meet_rock(par, s, runs, chain, old, v, events)
    way = 0.0
    for r in range(first, last):
        if runs[r].joint == Joint.WELD:
            share_velocity(runs, r)
        elif chain is None or runs[r].joint == Joint.CONTACT:
            before, free = speeds(runs, v, r)
            way = meet(par, s, runs, chain, old, v, r, blows, events)
            if chain is not None:
                after = runs[r].low - runs[r + 1].top
                impulse = chain.fits[0].shared * (free - after)
                book_joint(par, s, chain, 0, impulse, 0.5 * (before + after), 0.0)
        else:
            join(par, s, runs, chain, v, r)
    if chain is not None and par.eta > 0.0:
        for i in range(v.shape[0]):
            chain.before[i] = v[i]
    for r in range(first, last + 1):
        i = runs[r].first
        j = i + runs[r].n
        move_node(par, old, new, v, i, runs[r].top)
        move_node(par, old, new, v, j, runs[r].low)
        kick = kick_of(par, runs, chain, r, push, load)
        sweep(old, new, v, i, runs[r].n - 1, runs[r].kappa, kick, par.eta, dt + par.eta)
        if chain is not None and par.eta > 0.0:
            share = par.eta * runs[r].kappa * runs[r].half  # half of eta k dt
            s.e_loss += share * strain_work(chain.before, v, i, runs[r].n)
    if way != 0.0:
        close_way(par, s, runs, chain, new, v, way)
    if chain is not None:
        move_means(par, s, chain, damper)
        return
    # where the rock law has it
    new[runs[last].first + runs[last].n] = (s.x_r + s.p) + (0.5 * dt + par.eta) * s.v_end
    if s.quiet_p == 1:
        fly(par, s, push, runs[first].top)


@merged
def turn_pressure(par, s, runs, chain, w, v, events):
    """Turn the drive where the mean relative motion has passed its threshold.

    What the new force did to the piston since then is made good.
    """
    before = piston_acceleration(par, drive_force(par, s))
    u_before = s.u_r - stroke_speed(par, s, chain) * par.dt
    share = switch_drive(par, s, u_before, s.time - par.dt, par.dt, events)
    if share < 0.0:
        return
    kick = (piston_acceleration(par, drive_force(par, s)) - before) * (0.5 - share) * par.dt
    if chain is not None:
        kick_means(par, s, chain, kick)
    s.v_p += kick
    if s.quiet_p == 0:
        for i in range(runs[par.uppers].first):
            v[i] += kick
            w[i] += par.eta * kick


@kernel
def standing_energy(par, s, runs, w, v):
    """Energy of a bit that stands on the rock, less what it would have at rest [J]."""
    energy = kinetic_energy(par, s, runs, w, v, 0.0)
    load = bit_acceleration(par, s)
    above = 0.0
    for r in range(par.uppers, runs.shape[0]):
        mass = 2.0 * runs[r].half
        stiff = runs[r].kappa * mass / par.dt
        for i in range(runs[r].first, runs[r].first + runs[r].n):
            off = stiff * (w[i + 1] - w[i]) + load * (above + runs[r].half)
            energy += 0.5 * off * off / stiff
            above += mass
    off = spring_force(par, s) - load * par.mass_b
    return energy + 0.5 * off * off / stiffness(s)


@kernel
def flying_energy(par, s, runs, w, v):
    """Energy of vibration of a piston that touches nothing [J]."""
    energy = 0.0
    for r in range(par.uppers):
        mass = 2.0 * runs[r].half
        stiff = runs[r].kappa * mass / par.dt
        for i in range(runs[r].first, runs[r].first + runs[r].n):
            stretch = w[i + 1] - w[i]
            speed = 0.5 * (v[i] + v[i + 1]) - s.v_p
            energy += 0.5 * (stiff * stretch * stretch + mass * speed * speed)
    return energy


@kernel
def wake(par, s, runs, w, v):
    """Give a quiet piston its nodes again."""
    s.quiet_p = 0
    s.quiet_b = 0
    s.look_in = 0
    for i in range(runs[par.uppers].first):
        v[i] = s.v_p
        w[i] = s.u_p + par.eta * s.v_p


@merged
def fall_quiet(par, s, runs, w, v, u_p):
    """Let piston and bit go on as rigid bodies where they have stopped to vibrate."""
    if s.mode == Mode.SS and s.closed == 0 and s.quiet_b == 0:
        # the energy of what is left to itself does not rise
        energy = standing_energy(par, s, runs, w, v)
        s.alert = 1 if overcomes_barrier(par, s, energy / SURELY) else 0
        if s.quiet_p == 1 and energy < QUIET:
            s.quiet_b = 1
            for i in range(runs[par.uppers].first, v.shape[0]):
                w[i] -= par.eta * v[i]
                v[i] = 0.0
            s.v_end = 0.0
            s.force = s.force_before = spring_force(par, s)
    flying = s.closed == 0 and s.quiet_p == 0 and par.uppers > 0
    if flying and flying_energy(par, s, runs, w, v) < QUIET:
        s.quiet_p = 1
        s.u_p = u_p


@kernel
def look(par, s, runs, chain, w, v, events):
    """Look at the mean motion: turn the drive, and say when to look again."""
    u_p, u_b = read_means(par, s, runs, chain, w, v)
    s.look_in = LOOK
    if chain is None:
        fall_quiet(par, s, runs, w, v, u_p)
        s.u_r = u_p - u_b
    if par.mass_p > 0.0:
        turn_pressure(par, s, runs, chain, w, v, events)
        room = -s.u_r if s.alpha > 0 else s.u_r + s.reversal
        speed = FASTER * abs(stroke_speed(par, s, chain)) + FASTER_BY
        s.look_in = int(min(float(LOOK), max(0.0, room / (speed * par.dt))))


@merged
def advance_to(par, s, runs, chain, first, second, v, time, blows, events):
    """Take the whole steps up to `time`; a `Status`."""
    s.n_blows = 0
    s.n_events = 0
    while s.time + par.dt <= time:
        if s.live == 1:
            if s.n_blows >= blows.shape[0]:
                return Status.BLOWS_FULL
            if s.events_on == 1 and s.n_events + 3 * par.most_changes > events.shape[0]:
                return Status.EVENTS_FULL
        if s.quiet_p == 1:
            top = v[runs[par.uppers].first]
            if s.gap <= AHEAD * par.dt * (abs(s.v_p) + abs(top)):
                wake(par, s, runs, second if s.flip == 1 else first, v)
        if s.quiet_b == 1:
            fly(par, s, par.dt * piston_acceleration(par, drive_force(par, s)), 0.0)
        else:
            if s.flip == 0:
                step(par, s, runs, chain, first, second, v, blows, events)
            else:
                step(par, s, runs, chain, second, first, v, blows, events)
            s.flip = 1 - s.flip
        s.time += par.dt
        s.count_steps += 1
        s.look_in -= 1
        if s.look_in < 0:
            look(par, s, runs, chain, second if s.flip == 1 else first, v, events)
            if not math.isfinite(s.p + s.v_end + s.v_b):
                return Status.NOT_FINITE
    return Status.DONE


@kernel
def run(
    reads, par_, state, runs, fits, mass, bars, joints, before, first, second, v, time,
    blows, events, reading,
):  # fmt: skip
    """Take the whole steps up to `time`, and read the state where `reads` is 1.

    Reading goes on to the step that has `time` between its middles, so give a copy. Parts of a
    `Chain` are passed one by one, all None without: numba takes long to tell a tuple's type.
    """
    par = par_[0]
    s = state[0]
    chain = None if fits is None else Chain(fits, mass, bars, joints, before)
    if reads == 0:
        return advance_to(par, s, runs, chain, first, second, v, time, blows, events)
    s.live = 0
    status = advance_to(par, s, runs, chain, first, second, v, time + 0.5 * par.dt, blows, events)
    w = second if s.flip == 1 else first
    u_p, u_b = read_means(par, s, runs, chain, w, v)
    row = reading[0]
    kinetic = kinetic_energy(par, s, runs, w, v, 0.0)
    if chain is None:
        s.u_r = u_p - u_b
        fill_ledger(s, row, kinetic, 0.0, recoverable(par, s))
    else:
        motion, strain = held(par, s, runs, chain, w, v)
        fill_ledger(s, row, motion, strain, recoverable(par, s))
    fill_motion(par, s, row, time, u_p + par.start_gap, u_b)
    row.bit_end_position = s.x_r + s.p + (time - s.time + 0.5 * par.dt) * s.v_end
    row.bit_end_velocity = s.v_end
    row.bit_kinetic_energy = kinetic
    row.contact_force = s.contact_force
    # the last step is at most half of one away
    row.contact_impulse += (time - s.time) * s.contact_force
    share = (time - (s.time - 1.5 * par.dt)) / par.dt
    row.bit_force = s.force_before + min(max(share, 0.0), 1.0) * (s.force - s.force_before)
    return status
