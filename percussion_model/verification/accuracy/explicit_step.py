"""Steps of the explicit elements: leapfrog between hard contact and the law of the rock.

Positions live at whole steps, velocities in the middle between them. The mass at the
bit's rock end obeys m x'' = a m - F_R(x, x') from middle to middle, where what the rest of
the bit does to it, a m, is held: a linear equation in each mode of the rock law, solved as
such, with the step divided where the mode changes. Two ends that meet within a step take
their common velocity, and keep it as long as they press on each other.
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from percussion_model.physics.blows import close_gap, open_gap, push_event, start_blow, starts_blow
from percussion_model.physics.body import bit_acceleration, piston_acceleration
from percussion_model.physics.drive import drive_force, switch_drive
from percussion_model.physics.kernel import fused, inlined, kernel, merged
from percussion_model.physics.readings import fill_ledger, fill_motion
from percussion_model.physics.records import Mode, RockKind, Status
from percussion_model.physics.rock import (
    REST_VELOCITY,
    book_dashpot,
    close_interface,
    crush,
    damping,
    leave_by_velocity,
    leave_standstill,
    origin,
    overcomes_barrier,
    recoverable,
    spring_force,
    stiffness,
)
from percussion_model.physics.state import COMMON_PARAMETERS, COMMON_STATE

# Steps between two looks at the mean motion and at what the bit's energy is.
LOOK = 64
# Bound of the mean relative speed until the next look: so often what it is, and so much more [m/s].
FASTER, FASTER_BY = 2.0, 5.0
# A bit whose energy is below this share of the barrier cannot pass it without a blow.
SURELY = 0.5
# Bars with less energy of vibration than this count as rigid [J]; a blow has some 300 J.
QUIET = 1e-7
# A quiet piston has nodes again so many steps before its gap can close; halvings of a step
# in search of a change of mode.
AHEAD, HALVINGS = 4.0, 30


class Joint(IntEnum):
    """What is below a stretch of equal elements."""

    WELD = 0  # the next stretch of the same bar
    CONTACT = 1  # the bit
    ROCK = 2


# A stretch of equal elements; both of its ends are nodes of its own.
STRETCH = np.dtype(
    [
        ("first", "i8"),  # node
        ("n", "i8"),  # elements
        ("bit", "i8"),  # 0: of the piston
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
        ("uppers", "i8"),  # stretches of the piston
        ("most_changes", "i8"),  # of mode within a step; more are a loop
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
def read_means(par, s, runs, w, v):
    """Mean velocities, and the mean displacements of piston and bit."""
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
def kinetic_energy(par, s, runs, w, v, share):
    """Kinetic energy of the bit a share of a step after the velocities [J]."""
    energy = 0.0
    for r in range(par.uppers, runs.shape[0]):
        i, n = runs[r].first, runs[r].n
        kick = share * runs[r].kappa
        inner = 0.0
        for j in range(i + 1, i + n):
            speed = v[j] + kick * ((w[j - 1] - w[j]) + (w[j + 1] - w[j]))
            inner += speed * speed
        low = s.v_end if runs[r].joint == Joint.ROCK else v[i + n]
        energy += runs[r].half * (inner + 0.5 * (v[i] * v[i] + low * low))
    return energy


@inlined
def ride(k, c, a, x, v, h):
    """Solve x'' = a - k x - c x' over `h`; the closed form of each kind of damping."""
    if k == 0.0:
        return x + h * (v + 0.5 * h * a), v + h * a
    rest = a / k
    y = x - rest
    delta = 0.5 * c
    square = k - delta * delta
    root = math.sqrt(abs(square))
    decay = math.exp(-delta * h)
    if square > 0.0:
        cosine = math.cos(root * h)
        sine = math.sin(root * h) / root
    else:
        cosine = math.cosh(root * h)
        sine = math.sinh(root * h) / root
    y1 = decay * ((cosine + delta * sine) * y + sine * v)
    v1 = decay * ((cosine - delta * sine) * v - k * sine * y)
    return rest + y1, v1


@inlined
def ride_on_rock(par, s, a, h):
    """Penetration and velocity of the rock end after `h` in the present mode."""
    p_r = origin(s)
    k = stiffness(s) / par.end_mass
    x, v = ride(k, damping(s) / par.end_mass, a, s.p - p_r, s.v_end, h)
    return p_r + x, v


@kernel
def prepare_mode(par, s):
    """Take what a whole step in the present mode does."""
    k, c = stiffness(s) / par.end_mass, damping(s) / par.end_mass
    s.by_a = 1.0 / k if k > 0.0 else 0.0
    s.p_by_p, s.v_by_p = ride(k, c, 0.0, 1.0, 0.0, par.dt)
    s.p_by_v, s.v_by_v = ride(k, c, 0.0, 0.0, 1.0, par.dt)


@inlined
def work_of_dashpot(par, s, a, p, v):
    """Work of the rock's dashpot on the way from the present state, by the energy law [J]."""
    if damping(s) == 0.0:
        return 0.0
    spring = stiffness(s) * (0.5 * (p + s.p) - origin(s)) * (p - s.p)
    return par.end_mass * (a * (p - s.p) - 0.5 * (v - s.v_end) * (v + s.v_end)) - spring


@inlined
def passed(par, s, p, v, work):
    """Whether a state lies beyond the end of the present mode; energy apart."""
    if s.mode == Mode.FF:
        return p > s.p_u and v > 0.0
    if par.rock == RockKind.SPRING:
        return p < 0.0
    if s.mode == Mode.DFC and s.w + work >= s.w_r:
        return True
    if s.mode == Mode.DFC or s.mode == Mode.FC:
        return v < -REST_VELOCITY
    if s.mode == Mode.BC:
        return p < s.p_u or v > REST_VELOCITY
    return par.release == 1 and s.gamma * s.k_r * (p - s.p_u) + s.c_r * v < 0.0


@inlined
def move_end(par, s, a, p, v, h):
    """Put the rock end into a state that it comes to in `h`, and book what the rock takes."""
    if s.mode != Mode.FF:
        work = work_of_dashpot(par, s, a, p, v)
        book_dashpot(s, work)
        s.rock_work += work + stiffness(s) * (0.5 * (p + s.p) - origin(s)) * (p - s.p)
        s.i_bit += par.end_mass * (a * h - (v - s.v_end))
        before = s.p
        s.p = p
        crush(par, s, before)
    s.p = p
    s.v_end = v
    s.force = spring_force(par, s) + damping(s) * v
    s.b_peak_bit = max(s.b_peak_bit, s.force)
    s.peak_bit_force = max(s.peak_bit_force, s.force)


@kernel
def change_mode(par, s, energy, time, events):
    """Make the change of mode that the rock end's state asks for."""
    if s.mode == Mode.FF:
        close_interface(par, s, energy)
    elif par.rock == RockKind.SPRING:
        s.mode = Mode.FF
    elif s.mode == Mode.DFC and s.w >= s.w_r:
        s.mode = Mode.FC
    elif s.mode == Mode.SS or (s.mode == Mode.BC and s.p < s.p_u):
        s.mode = Mode.FF
    else:
        leave_by_velocity(par, s, s.v_end, energy)
    s.alert = 1
    prepare_mode(par, s)
    push_event(s, events, time, s.mode, spring_force(par, s))


@kernel
def find_end(par, s, a, h):
    """Shortest stretch of `h` after which the present mode is over, halved and halved."""
    low = 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + h)
        p, v = ride_on_rock(par, s, a, middle)
        if passed(par, s, p, v, work_of_dashpot(par, s, a, p, v)):
            h = middle
        else:
            low = middle
    return h


@kernel
def divide_step(par, s, runs, w, v, a, events):
    """Move the rock end over a step in which the mode changes."""
    h = par.dt
    for _ in range(par.most_changes):
        p, speed = ride_on_rock(par, s, a, h)
        if not passed(par, s, p, speed, work_of_dashpot(par, s, a, p, speed)):
            move_end(par, s, a, p, speed, h)
            return
        part = find_end(par, s, a, h)
        p, speed = ride_on_rock(par, s, a, part)
        move_end(par, s, a, p, speed, part)
        h -= part
        share = 1.0 - h / par.dt
        energy = kinetic_energy(par, s, runs, w, v, share)
        change_mode(par, s, energy, s.time + (share - 0.5) * par.dt, events)
    s.count_locked += 1
    p, speed = ride_on_rock(par, s, a, h)
    move_end(par, s, a, p, speed, h)


@merged
def step_rock_end(par, s, runs, w, v, a, events):
    """Move the rock end from the middle of the last step to the middle of this one."""
    s.force_before = s.force
    alert = s.mode == Mode.SS and s.alert == 1
    if alert and overcomes_barrier(par, s, kinetic_energy(par, s, runs, w, v, 0.0)):
        leave_standstill(par, s, s.v_end)
        prepare_mode(par, s)
        push_event(s, events, s.time - 0.5 * par.dt, s.mode, spring_force(par, s))
    if s.mode == Mode.FF:
        p = s.p + par.dt * (s.v_end + 0.5 * par.dt * a)
        speed = s.v_end + par.dt * a
        if speed > 0.0 and p > s.p_u and par.rock != RockKind.NONE:
            divide_step(par, s, runs, w, v, a, events)
            return
        s.p = p
        s.v_end = speed
        s.force = 0.0
        return
    rest = origin(s) + a * s.by_a
    p = rest + s.p_by_p * (s.p - rest) + s.p_by_v * s.v_end
    speed = s.v_by_p * (s.p - rest) + s.v_by_v * s.v_end
    if passed(par, s, p, speed, work_of_dashpot(par, s, a, p, speed)):
        divide_step(par, s, runs, w, v, a, events)
    else:
        move_end(par, s, a, p, speed, par.dt)


@kernel
def begin_contact(par, s, runs, w, v, time, share, approach, blows, events):
    """Note that the gap closes after a share of the step that begins now."""
    _, u_b = read_means(par, s, runs, w, v)
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
def meet(par, s, runs, w, v, upper, blows, events):
    """Contact of piston and bit: velocities of their ends, and the way before they met [m].

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
            read_means(par, s, runs, w, v)
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
        begin_contact(par, s, runs, w, v, time, share, approach, blows, events)
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


@kernel
def step(par, s, runs, old, new, v, blows, events):
    """Take one step from led positions `old` to `new`."""
    dt = par.dt
    push = dt * piston_acceleration(par, drive_force(par, s)) if par.mass_p > 0.0 else 0.0
    load = dt * bit_acceleration(par, s)
    first = par.uppers if s.quiet_p == 1 else 0
    last = runs.shape[0] - 1
    for r in range(first, last + 1):
        i = runs[r].first
        j = i + runs[r].n
        kick = load if runs[r].bit == 1 else push
        pull = 2.0 * runs[r].kappa
        runs[r].top = v[i] + (pull * (old[i + 1] - old[i]) + kick)
        runs[r].low = v[j] + (pull * (old[j - 1] - old[j]) + kick)
    step_rock_end(par, s, runs, old, v, (runs[last].low - s.v_end) / dt, events)
    runs[last].low = s.v_end
    way = 0.0
    for r in range(first, last):
        if runs[r].joint == Joint.CONTACT:
            way = meet(par, s, runs, old, v, r, blows, events)
        else:
            share_velocity(runs, r)
    for r in range(first, last + 1):
        i = runs[r].first
        j = i + runs[r].n
        move_node(par, old, new, v, i, runs[r].top)
        move_node(par, old, new, v, j, runs[r].low)
        kick = load if runs[r].bit == 1 else push
        sweep(old, new, v, i, runs[r].n - 1, runs[r].kappa, kick, par.eta, dt + par.eta)
    if way != 0.0:
        i = runs[par.uppers].first
        new[i - 1] += way
        new[i] = new[i - 1]
    new[runs[last].first + runs[last].n] = (s.x_r + s.p) + (0.5 * dt + par.eta) * s.v_end
    if s.quiet_p == 1:
        fly(par, s, push, runs[first].top)


@merged
def turn_pressure(par, s, runs, w, v, events):
    """Turn the drive where the mean relative motion has passed its threshold.

    What the new force did to the piston since then is made good.
    """
    before = piston_acceleration(par, drive_force(par, s))
    u_before = s.u_r - (s.v_p - s.v_b) * par.dt
    share = switch_drive(par, s, u_before, s.time - par.dt, par.dt, events)
    if share < 0.0:
        return
    kick = (piston_acceleration(par, drive_force(par, s)) - before) * (0.5 - share) * par.dt
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


@kernel
def look(par, s, runs, w, v, events):
    """Look at the mean motion: turn the drive, and say when to look again."""
    u_p, u_b = read_means(par, s, runs, w, v)
    s.look_in = LOOK
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
    if par.mass_p > 0.0:
        s.u_r = u_p - u_b
        turn_pressure(par, s, runs, w, v, events)
        room = -s.u_r if s.alpha > 0 else s.u_r + s.reversal
        speed = FASTER * abs(s.v_p - s.v_b) + FASTER_BY
        s.look_in = int(min(float(LOOK), max(0.0, room / (speed * par.dt))))


@merged
def advance_to(par, s, runs, first, second, v, time, blows, events):
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
                step(par, s, runs, first, second, v, blows, events)
            else:
                step(par, s, runs, second, first, v, blows, events)
            s.flip = 1 - s.flip
        s.time += par.dt
        s.count_steps += 1
        s.look_in -= 1
        if s.look_in < 0:
            look(par, s, runs, second if s.flip == 1 else first, v, events)
            if not math.isfinite(s.p + s.v_end + s.v_b):
                return Status.NOT_FINITE
    return Status.DONE


@kernel
def run(reads, par_, state, runs, first, second, v, time, blows, events, reading):
    """Take the whole steps up to `time`, and read the state where `reads` is 1.

    Reading goes on to the step that has `time` between its middles, so give a copy.
    """
    par = par_[0]
    s = state[0]
    if reads == 0:
        return advance_to(par, s, runs, first, second, v, time, blows, events)
    s.live = 0
    status = advance_to(par, s, runs, first, second, v, time + 0.5 * par.dt, blows, events)
    w = second if s.flip == 1 else first
    u_p, u_b = read_means(par, s, runs, w, v)
    s.u_r = u_p - u_b
    row = reading[0]
    kinetic = kinetic_energy(par, s, runs, w, v, 0.0)
    fill_ledger(s, row, kinetic, 0.0, recoverable(par, s))
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
