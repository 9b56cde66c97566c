"""One step of waves: what the ends of the bars meet."""

from __future__ import annotations

from percussion_model.physics.blows import (
    close_gap,
    open_gap,
    push_checkpoint,
    standstill_force,
    start_blow,
    starts_blow,
)
from percussion_model.physics.feed import feed_on_bit
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import (
    book_on_bit,
    book_piston_load,
    drive_force,
    hold_components,
    pass_time,
    piston_acceleration,
)
from percussion_model.physics.records import Mode, Piston
from percussion_model.physics.rock import barrier_level
from percussion_model.solvers.modal.lanes import from_front
from percussion_model.solvers.wave.joint import shoulders, yielding
from percussion_model.solvers.wave.piston import mass_contact, move_piston
from percussion_model.solvers.wave.records import MOST_CUTS, Bar, Fit, Has, Joint
from percussion_model.solvers.wave.rock_end import asks_for_energy, rock_step
from percussion_model.solvers.wave.sections import (
    ACCELERATION,
    BAR,
    DOWN,
    DOWN_OUT,
    FIRST,
    FROM_ABOVE,
    FROM_BELOW,
    GIVEN,
    IMPEDANCE,
    INV_MASS,
    LAST,
    LATE,
    MASS,
    UP,
    UP_OUT,
    kinetic_as_sent,
    kinetic_of_bar,
    mixing_in_turns,
    part_of_step,
    pass_on,
    send,
    under_way,
    write_given,
)

PERFECT, _, LOSSY, THREADED = (float(kind) for kind in Joint)
VELOCITY, POSITION, BY_LOSS = int(Bar.VELOCITY), int(Bar.POSITION), int(Bar.BY_LOSS)
KIND, YIELD, PRELOAD, STIFFNESS, DAMPING, SECTION, STIFF, ABOVE, BELOW = (int(row) for row in Fit)
CLOSED, GAP, FORCE, LEAST, CAME, PASSED, RETURNED, BY_WAVES = (int(row) for row in Has)
# A part of a step shorter than this is not worth a step of its own.
SHORTEST_PART = 1e-3
# Ends that approach each other by no more do not touch: where bars part, it is rounding [m/s].
REST_APPROACH = 1e-12
# Where its kinetic energy is below this share of the barrier, a bit stands still without a doubt.
FAR_BELOW = 0.1
# Mean velocities are derived anew from the waves so often [steps].
RESYNC_STEPS = 256
# Spacing of the bit force's checkpoints while standing still [steps].
CHECKPOINT_STEPS = 64


@merged
def time_of(par, s):
    """Time of a state [s]."""
    return s.t_base + s.step * par.dt


@inlined
def stored_in_joint(fits, joints, j):
    """Energy of a thread or of a lossy joint [J]."""
    gap = joints[GAP, j]
    if fits[j, KIND] == LOSSY or fits[j, KIND] == THREADED:
        return gap * (fits[j, PRELOAD] + 0.5 * fits[j, STIFFNESS] * gap)
    return 0.0


@inlined
def damper_force(par, shortened, speed, inv_mass):
    """Mean force over a step of the damper between casing and bar, which only pushes [N].

    By the trapezoidal rule, which is stable at any stiffness and damping; `speed` is that in the
    middle of the step without it.
    """
    k, c, half = par.damper_stiffness, par.damper_damping, 0.5 * par.dt
    gives = half * (1.0 / par.casing_mass + inv_mass)
    force = par.damper_preload + k * shortened + (c + half * k) * speed
    return max(force / (1.0 + gives * (c + half * k)), 0.0)


@inlined
def stored_in_damper(par, shortened):
    """Energy of its spring, less that at the start; no less than where it has parted [J]."""
    k, preload = par.damper_stiffness, par.damper_preload
    if k > 0.0:
        shortened = max(shortened, -preload / k)
    return shortened * (preload + 0.5 * k * shortened)


@inlined
def taken_by_damper(par, shortened, way, tau):
    """What its dashpot took on a way that ends at `shortened`, by its middle; never negative [J].

    Its force less that of its spring, which both only push, has the sign of the way: so it takes
    all where the spring lets go more slowly than the bar, or where the dashpot alone pushes.
    """
    spring = par.damper_preload + par.damper_stiffness * (shortened - 0.5 * way)
    force = max(spring + par.damper_damping * way / tau, 0.0)
    return way * (force - max(spring, 0.0))


@inlined
def accelerations(par, s, chain, waves, push):
    """Acceleration that its body forces give each bar; the force of the damper [N]."""
    came, bodies, g = waves.came, chain.bodies, par.gravity
    for i in range(par.bars):
        came[ACCELERATION, i] = g
    struck, bit, damper = par.struck, par.bars - 1, 0.0
    if par.damper == 1:
        # in the middle of the step but for the damper; impulses are those of the step before
        given = (came[FROM_ABOVE, struck] - came[FROM_BELOW, struck]) * bodies[struck, INV_MASS]
        others = ((s.feed - push) / par.casing_mass - g) * par.dt - given
        speed = s.v_c - waves.bars[VELOCITY, struck] + 0.5 * others
        damper = damper_force(par, s.x_c, speed, bodies[struck, INV_MASS])
        came[ACCELERATION, struck] += damper * bodies[struck, INV_MASS]
    else:
        s.held_feed = feed_on_bit(par, s)
        came[ACCELERATION, struck] += s.held_feed * bodies[struck, INV_MASS]
    if par.effects == 1:
        came[ACCELERATION, bit] += s.f_on_bit * bodies[bit, INV_MASS]
    if par.piston == Piston.ELASTIC:
        came[ACCELERATION, 0] = piston_acceleration(par, push)
    return damper


@inlined
def passed_to(old, new, share):
    """What changes from `old` to `new` in a step, after a part of it, as waves that are mixed."""
    return new if share == 1.0 else old + share * (new - old)


@inlined
def kick_of(par, waves, bar):
    """Mean velocity that body forces give in a step [m/s]."""
    return 0.5 * par.dt * waves.came[ACCELERATION, bar]


@inlined
def meet_top(par, s, chain, waves, tau, time):
    """The top end of the topmost bar: free, or without reflection; with a wave from outside."""
    z, up, kick = chain.steel[0, IMPEDANCE], waves.came[UP, 0], kick_of(par, waves, 0)
    pulse = 0.0
    if time < par.pulse_end:
        pulse = par.pulse * min(1.0, (par.pulse_end - time) / par.dt)
    if par.open_top == 1:  # as a dashpot Z, which no body force acts on
        down = pulse / z + 0.5 * kick
    else:
        down = up + kick + pulse / z
    waves.came[DOWN_OUT, 0] = down
    force = z * (down - kick - up)
    waves.came[FROM_ABOVE, 0] = force * tau
    s.e_ends -= force * (down + up) * tau


@inlined
def give_way(s, fits, joints, j, a, y, tau):
    """A joint that parts, closes or yields within `tau`; its impulse [N s]."""
    stored = stored_in_joint(fits, joints, j)
    if fits[j, KIND] == LOSSY:
        met = yielding(joints[GAP, j], a, y, fits[j, STIFFNESS], fits[j, DAMPING], tau)
    else:
        closed = 1 if joints[CLOSED, j] == 1.0 else 0
        met = shoulders(closed, joints[GAP, j], a, y, fits[j, PRELOAD], fits[j, STIFFNESS], tau)
    joints[CLOSED, j], joints[GAP, j] = met.closed, met.gap
    s.e_stored += stored_in_joint(fits, joints, j) - stored
    s.e_joints += met.taken
    s.e_numerical += y * (met.square - met.impulse * met.impulse / tau)
    return met.impulse


@inlined
def holds(fits, joints, j, a, y):
    """Whether a joint stays closed and rigid for the whole step."""
    kind = fits[j, KIND]
    if kind == PERFECT:
        return True
    return kind != LOSSY and joints[CLOSED, j] == 1.0 and a + y * fits[j, PRELOAD] > 0


@inlined
def meet_joints(par, s, chain, waves, tau):
    """All joints below rods."""
    came, fits, joints = waves.came, chain.fits, waves.joints
    steel, half, share, struck = chain.steel, 0.5 * par.dt, tau / par.dt, par.struck
    lag, more = par.lag, 1.0 + par.viscous
    for j in range(par.joints):
        k, upper = from_front(int(fits[j, SECTION])), from_front(int(fits[j, SECTION]) - 1)
        above, below = from_front(struck + j), from_front(struck + j + 1)
        down, up = came[DOWN, upper], came[UP, k]
        v_a = 2.0 * down + half * came[ACCELERATION, above]
        v_b = 2.0 * up + half * came[ACCELERATION, below]
        before = lag * joints[BY_WAVES, j]
        a, y = v_a - v_b - fits[j, YIELD] * before, fits[j, YIELD] / more
        if holds(fits, joints, j, a, y):
            force = a * fits[j, STIFF] * more
        else:
            force = give_way(s, fits, joints, j, a, y, tau) / tau
        by_waves = before + force / more
        joints[BY_WAVES, j] = passed_to(joints[BY_WAVES, j], by_waves, share)
        v_a, v_b = v_a - by_waves * fits[j, ABOVE], v_b + by_waves * fits[j, BELOW]
        s.e_loss += (force - by_waves) * (v_b - v_a) * tau
        returned, passed = v_a - down, v_b - up
        came[UP_OUT, upper], came[DOWN_OUT, k] = returned, passed
        came[FROM_BELOW, above] = came[FROM_ABOVE, below] = by_waves * tau
        joints[FORCE, j] = force
        joints[LEAST, j] = min(joints[LEAST, j], force)
        z_a, z_b = steel[upper, IMPEDANCE] * tau, steel[k, IMPEDANCE] * tau
        joints[CAME, j] += z_a * down * down
        joints[PASSED, j] += z_b * passed * passed
        joints[RETURNED, j] += z_a * returned * returned


@kernel
def record_contact(par, s, waves, opened, t_close, approach, force, time, tau, blows, events):
    """Book the opening and the closure of the gap below the piston in this step."""
    if opened == 1:
        open_gap(s, events, time, approach)
    if t_close >= 0.0:
        # no later than what the next step begins with, to the last bit: it may be an opening
        closure = min(time + t_close, s.t_base - (par.dt - tau) + (s.step + 1) * par.dt)
        s.cuts = 0
        if starts_blow(par, s, closure):
            here = waves.bars[POSITION, par.bars - 1] + s.v_b * t_close
            speed = s.v_p + piston_acceleration(par, drive_force(par, s)) * t_close
            impulse = s.i_bit + s.gamma * s.k_r * (s.p - s.p_u) * t_close
            still = standstill_force(s, closure, impulse)
            start_blow(par, s, blows, closure, speed, here, still)
        close_gap(s, events, closure, approach)
    s.b_peak_contact = max(s.b_peak_contact, force)
    if time + tau > s.peak_from:
        s.peak_contact_force = max(s.peak_contact_force, force)


@inlined
def free_ends(par, s, chain, waves, push):
    """Velocities of piston and struck bar at the contact without it, and how far they yield."""
    came, struck = waves.came, par.struck
    k = int(chain.bodies[struck, FIRST])
    z_t = chain.steel[k, IMPEDANCE]
    v_t, yields = 2.0 * came[UP, k] + kick_of(par, waves, struck), 1.0 / z_t
    if par.piston == Piston.ELASTIC:
        v_p = 2.0 * came[DOWN, k - 1] + kick_of(par, waves, 0)
        yields += 1.0 / chain.steel[k - 1, IMPEDANCE]
    else:
        v_p = s.v_p + 0.5 * par.dt * piston_acceleration(par, push)
    return v_p, v_t, yields


@merged
def time_to_cut(par, s, chain, waves, push, tau):
    """Time at which to end the step, so that a closure comes at the start of the next one [s].

    A cut mixes the waves of neighbouring steps: rods ring from blow to blow, and are not cut.
    """
    v_p, v_t, yields = free_ends(par, s, chain, waves, push)
    approach = v_p - v_t - yields * par.lag * s.g_contact
    if par.joints > 0 or s.closed == 1 or approach <= REST_APPROACH or s.cuts >= MOST_CUTS:
        return tau
    reach = s.gap / approach
    if reach < SHORTEST_PART * par.dt or reach > (1.0 - SHORTEST_PART) * par.dt:
        return tau
    if par.cuts_all == 0 and not starts_blow(par, s, time_of(par, s) + reach):
        return tau
    return reach


@inlined
def meet_piston(par, s, chain, waves, push, tau, time, blows, events):
    """The piston and the bar that it strikes; the impulse between them [N s].

    A closure in the first half of a step counts for waves from its start, one in the second from
    its end: so fronts stay sharp, of which averaging over the step would take a part, and come
    early as often as late. What the ends then are apart, or overlap, stays as `gap` till they have
    opened: else each blow would move the piston against its mean, by which the drive turns.
    """
    came, struck = waves.came, par.struck
    k = int(chain.bodies[struck, FIRST])
    z_t, elastic = chain.steel[k, IMPEDANCE], par.piston == Piston.ELASTIC
    v_p, v_t, yields = free_ends(par, s, chain, waves, push)
    before = par.lag * s.g_contact
    approach, was, opened, t_close = v_p - v_t - yields * before, s.closed, 0, -1.0
    if was == 1 and approach <= REST_APPROACH:
        s.closed, opened = 0, 1
    touches = s.closed == 1
    if s.closed == 0:
        if approach > REST_APPROACH and s.gap < approach * tau:
            t_close = max(s.gap / approach, 0.0)
            s.closed, touches = 1, t_close < 0.5 * tau
        if not touches:
            s.gap -= approach * tau
    impulse, force, more = 0.0, before + approach / yields, 1.0 + par.viscous
    if touches and elastic:
        impulse = approach / yields * more * tau
    elif touches:
        z_v, v_v = z_t * more, v_t + before / z_t
        d_t, q_t, impulse = mass_contact(v_p, v_v, par.mass_p, z_v, tau)
        s.e_numerical += z_v * (q_t - d_t * d_t / tau)
    by_waves = before + impulse / (more * tau)
    s.g_contact = passed_to(s.g_contact, by_waves, tau / par.dt)
    v_t += by_waves / z_t
    s.e_loss += (impulse - by_waves * tau) * v_t
    if elastic:
        v_p -= by_waves / chain.steel[k - 1, IMPEDANCE]
        s.e_loss -= (impulse - by_waves * tau) * v_p
        came[UP_OUT, k - 1] = v_p - came[DOWN, k - 1]
        came[DOWN_OUT, 0] = came[UP, 0] + kick_of(par, waves, 0)
    came[DOWN_OUT, k] = v_t - came[UP, k]
    came[FROM_ABOVE, struck] = by_waves * tau
    if was == 1 or s.closed == 1:
        peak = force if touches else 0.0
        record_contact(par, s, waves, opened, t_close, approach, peak, time, tau, blows, events)
    return impulse


@merged
def meet_rock(par, s, chain, waves, tau, time, events):
    """The bit's lower end on the rock; the impulse on the rock [N s]."""
    k, bit = par.sections - 1, par.bars - 1
    z, down = chain.steel[k, IMPEDANCE], waves.came[DOWN, k]
    v_whole, energy = 2.0 * down + kick_of(par, waves, bit), 0.0
    v_free, z_v = v_whole - par.lag * s.g_rock / z, z * (1.0 + par.viscous)
    if asks_for_energy(par, s, v_free, z_v, tau):
        energy = kinetic_as_sent(chain, waves, s.step, bit)
        if energy > FAR_BELOW * barrier_level(par, s):  # to know it costs as much as ten steps
            energy = kinetic_of_bar(chain, waves, s.step, bit)
    d, q = rock_step(par, s, energy, v_free, z_v, tau, time, events)
    impulse, up = z_v * (v_free * tau - d), d / tau - down
    by_waves = z * (v_whole - d / tau)
    s.g_rock = passed_to(s.g_rock, by_waves, tau / par.dt)
    s.e_loss += (by_waves - impulse / tau) * d
    waves.came[UP_OUT, k], waves.came[FROM_BELOW, bit] = up, by_waves * tau
    s.e_numerical += z_v * (q - d * d / tau)
    s.rock_work += z_v * (v_free * d - q)
    s.i_bit += impulse
    s.i_came += z * down * down * tau
    s.i_returned += z * up * up * tau
    return impulse


@inlined
def meet_nothing(par, s, chain, waves, tau):
    """The bit's lower end where it reflects nothing: what comes leaves."""
    k, bit = par.sections - 1, par.bars - 1
    z, down, kick = chain.steel[k, IMPEDANCE], waves.came[DOWN, k], kick_of(par, waves, bit)
    kick *= 0.5
    force = z * (down + kick)
    waves.came[UP_OUT, k], waves.came[FROM_BELOW, bit] = kick, force * tau
    s.e_ends += force * (down + kick) * tau
    s.i_came += z * down * down * tau


@inlined
def velocity_by_loss(bodies, i, above, below):
    """Mean velocity of a bar below the piston by the impulses of loss at its ends [m/s].

    They are eta/2 of the forces by waves, or as much less as its sections spread waves less.
    Without them momentum that an end gives a bar would move its mean by v eta/2 less than its
    ends, what body forces give would not: with each blow ends and mean would drift apart.
    """
    return bodies[i, LATE] * (above - below) * bodies[i, INV_MASS]


@inlined
def move_bars(par, s, chain, waves, damper, tau, rest):
    """Mean motion of bars and casing, and the work of body forces; path of what the drive holds."""
    came, bars, bodies, g = waves.came, waves.bars, chain.bodies, par.gravity
    struck, bit, held, lifted = par.struck, par.bars - 1, 0.0, 0.0
    path = 0.0
    joints, last = waves.joints, par.bars - 1 - struck
    g_contact, g_rock = s.g_contact, s.g_rock
    for j in range(last + 1):
        i = from_front(struck + j)
        v0, w0 = bars[VELOCITY, i], bars[BY_LOSS, i]
        gained = (came[FROM_ABOVE, i] - came[FROM_BELOW, i]) * bodies[i, INV_MASS]
        v1 = v0 + came[ACCELERATION, i] * tau + gained
        above = g_contact if j == 0 else joints[BY_WAVES, from_front(j - 1)]
        below = g_rock if j == last else joints[BY_WAVES, j]
        w1 = velocity_by_loss(bodies, i, above, below)
        more = 0.5 * tau * (w0 + w1)
        path = 0.5 * (tau * (v0 + v1) + rest * (v1 - v0)) + more
        bars[VELOCITY, i], bars[BY_LOSS, i] = v1, w1
        bars[POSITION, i] += path
        # what its waves get of body forces, beside their work, loss has taken from the waves
        s.e_loss += bodies[i, MASS] * came[ACCELERATION, i] * more
        lifted += bodies[i, MASS] * path
        if j == 0:
            held = path
    s.e_gravity += g * lifted
    if par.effects == 1:
        book_on_bit(par, s, path)
    s.v_b = waves.bars[VELOCITY, bit]
    if par.damper == 0:
        s.e_feed += s.held_feed * held
        return held
    recoil = drive_force(par, s)
    v1 = s.v_c + (s.feed - damper - recoil) / par.casing_mass * tau
    path = 0.5 * tau * (s.v_c + v1)
    before = stored_in_damper(par, s.x_c)
    s.x_c += path - held
    stored = stored_in_damper(par, s.x_c) - before
    taken = taken_by_damper(par, s.x_c, path - held, tau)
    s.e_stored += stored
    s.e_joints += taken
    s.e_numerical += damper * (path - held) - stored - taken
    s.e_feed += s.feed * path
    s.e_drive -= recoil * path
    s.v_c = v1
    s.u_c += path
    return path


@merged
def meet(par, s, chain, waves, tau, blows, events):
    """Let all ends meet what they meet for `tau`, up to a whole step.

    Mean motion, gaps, penetration, modes, impulses and the ledger move on; waves do not.

    Returns
    -------
    due : float
        Velocity that the piston is still to get, where the drive turned [m/s].
    tau : float
        Time that has passed [s].
    """
    time = time_of(par, s)
    hold_components(par, s, tau)
    push = drive_force(par, s)
    damper = accelerations(par, s, chain, waves, push)
    lost, mixed = pass_on(par, s, chain, waves)
    rest = 0.0
    if s.live == 1:
        if par.piston != Piston.ABSENT:
            tau = time_to_cut(par, s, chain, waves, push, tau)
            rest = par.dt - tau
        share = tau / par.dt
        s.e_loss += share * lost
        s.e_numerical += share * mixed
    meet_joints(par, s, chain, waves, tau)
    impulse = due = 0.0
    if par.piston == Piston.ABSENT:
        meet_top(par, s, chain, waves, tau, time)
    else:
        impulse = meet_piston(par, s, chain, waves, push, tau, time, blows, events)
    if par.open_bottom == 1:
        meet_nothing(par, s, chain, waves, tau)
    else:
        meet_rock(par, s, chain, waves, tau, time, events)
    s.i_contact += impulse
    held = move_bars(par, s, chain, waves, damper, tau, rest)
    bars = waves.bars
    if par.piston != Piston.ABSENT:
        half, u_before = 0.5 * tau, s.u_r
        a_p, more = piston_acceleration(par, push), 0.0
        if par.piston == Piston.ELASTIC:
            impulse = waves.came[FROM_ABOVE, par.struck]
            by_loss = -chain.bodies[0, LATE] * s.g_contact / par.mass_p
            more = half * (bars[BY_LOSS, 0] + by_loss)
            bars[BY_LOSS, 0] = by_loss
            s.e_loss += par.mass_p * a_p * more
            book_piston_load(par, s, push, more, 0.0)
        s.u_r += half * (2.0 * (s.v_p + a_p * half) - impulse / par.mass_p) + more - held
        v_p, given = s.v_p, s.i_drive
        move_piston(par, s, push, impulse, u_before, time, tau, events)
        if par.damper == 1:  # recoil of a drive that has turned
            extra = s.i_drive - given - push * tau
            s.e_drive -= extra * (s.v_c - 0.5 * extra / par.casing_mass)
            s.v_c -= extra / par.casing_mass
        if par.piston == Piston.ELASTIC:
            bars[VELOCITY, 0] = s.v_p
            # what its waves get is the force at the start over the whole step
            due = s.v_p - v_p + impulse / par.mass_p - a_p * tau
            if rest > 0.0:
                further = 0.5 * rest * (a_p * tau - impulse / par.mass_p)
                book_piston_load(par, s, push, further, 0.0)
    pass_time(par, s, tau)
    return due, tau


@kernel
def resync(par, s, chain, waves):
    """Derive the mean velocities from the waves, so that rounding cannot part them."""
    for i in range(par.bars):
        _, waves.bars[VELOCITY, i] = under_way(par.dt, chain, waves, s.step, i)
    s.v_b = waves.bars[VELOCITY, par.bars - 1]
    if par.piston == Piston.ELASTIC:
        s.v_p = waves.bars[VELOCITY, 0]


@kernel
def step(par, s, chain, waves, tau, blows, events):
    """Advance the state by one step; a copy that is only read meets what it meets for `tau`."""
    due, tau = meet(par, s, chain, waves, tau, blows, events)
    if s.live == 0:
        return
    share = tau / par.dt
    places, rings, came, bodies, bars = (
        chain.places, waves.rings, waves.came, chain.bodies, waves.bars
    )  # fmt: skip
    now, half, rewrite = s.step, 0.5 * par.dt, False
    most = par.most_given
    for i in range(par.bars):
        given = bars[GIVEN, i] + half * came[ACCELERATION, i]
        bars[GIVEN, i] += share * half * came[ACCELERATION, i]
        came[DOWN_OUT, from_front(int(bodies[i, FIRST]))] -= given
        came[UP_OUT, from_front(int(bodies[i, LAST]))] -= given
        rewrite = rewrite | (abs(given) > most)
    if share < 1.0:
        for k in range(par.sections):
            change = half * came[ACCELERATION, places[k, BAR]]
            s.e_numerical += mixing_in_turns(par.dt, chain, waves, now, k, share, change)
    for k in range(par.sections):
        down, up = came[DOWN_OUT, k], came[UP_OUT, k]
        send(places, chain.weights, rings, now, k, down, up, share)
    bars[GIVEN, 0] += 0.5 * due
    s.step = now + 1
    s.count_steps += 1
    if share < 1.0:
        s.cuts += 1
        s.t_base -= par.dt - tau
        for i in range(par.bars):
            change = half * came[ACCELERATION, i]
            s.e_numerical += part_of_step(par.dt, chain, waves, s.step, i, share, change)
    if rewrite:
        for i in range(par.bars):
            if abs(bars[GIVEN, i]) > par.most_given:
                write_given(chain, waves, i)
    if s.step % RESYNC_STEPS == 0:
        resync(par, s, chain, waves)
    if s.mode == Mode.SS and (s.n_check == 0 or s.step % CHECKPOINT_STEPS == 0):
        push_checkpoint(s, time_of(par, s))
