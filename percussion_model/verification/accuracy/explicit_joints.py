"""What a chain of bars adds to the steps of explicit elements: joints, damper, ledger.

What two ends do to each other in a step is one impulse, from the velocity at which they would
approach each other without it. Shoulders of rods that would pass through each other touch at
the step's end. Means of the bars follow from impulses, so that all works can be booked.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from percussion_model.physics.kernel import compiled, inlined, kernel, merged
from percussion_model.physics.loads import drive_force, piston_acceleration
from percussion_model.physics.rock import recoverable
from percussion_model.scene.numbers import JOINT_KINDS
from percussion_model.verification.accuracy.explicit_rock import ride, step_rock_end

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
# For long sums of the ledger, in any order: vectors add up several at once.
summed = compiled(
    error_model="numpy", _nrt=False, forceinline=True, fastmath={"contract", "reassoc"}
)
DAMPER = ("stiffness", "damping", "preload", "casing_mass")

# A joint: its kind, the reduced mass of both ends [kg], the preload of a thread [N], the stiffness
# of a thread or a spring [N/m] and its dashpot [N s/m]. The first is the contact of the piston.
FIT = np.dtype(
    [("kind", "i8"), *((name, "f8") for name in ("shared", "preload", "stiffness", "damping"))]
)


class Chain(NamedTuple):
    """What kernels need of a chain of bars; None in its place leaves all of it out."""

    fits: np.ndarray  # of FIT, shape (bars - 1,)
    mass: np.ndarray  # shape (bars,), of each bar [kg]
    bars: np.ndarray  # shape (BAR_ROWS, bars)
    joints: np.ndarray  # shape (JOINT_ROWS, bars - 1)
    before: np.ndarray  # shape (nodes,), velocities of a step ago [m/s]


@inlined
def load_bars(par, s, chain):
    """Put down what body forces do to each bar; the damper's force [N]."""
    bars = chain.bars
    for i in range(par.bars):
        bars[ACCELERATION, i] = par.gravity
    bars[ACCELERATION, 0] = piston_acceleration(par, drive_force(par, s))
    if par.damper == 0:
        bars[ACCELERATION, 1] += s.feed / chain.mass[1]
        return 0.0
    speed = s.v_c - bars[VELOCITY, 1]
    now = 1.5 * speed - 0.5 * s.damper_speed  # velocities are those of half a step ago
    s.damper_speed = speed
    force = par.damper_preload + par.damper_stiffness * s.x_c + par.damper_damping * now
    force = max(force, 0.0)
    bars[ACCELERATION, 1] += force / chain.mass[1]
    return force


@inlined
def joint_law(par, chain, j, before, free):
    """Velocity at which the ends of a joint approach each other after a step [m/s].

    Parameters
    ----------
    before, free : float
        That of a step ago, and what it would be now without a force [m/s].
    """
    fits, joints, dt = chain.fits, chain.joints, par.dt
    mass, gap = fits[j].shared, joints[GAP, j]
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
def speeds(runs, v, r):
    """Velocity at which the ends below a stretch approach: a step ago, and by what is told now."""
    return v[runs[r].first + runs[r].n] - v[runs[r + 1].first], runs[r].low - runs[r + 1].top


@inlined
def book_joint(par, s, chain, j, impulse, mean, stored):
    """Book an impulse at a joint whose ends approach at a mean speed, and its stored energy."""
    joints = chain.joints
    s.e_numerical += impulse * mean - (stored - joints[STORED, j])
    joints[STORED, j] = stored
    force = joints[FORCE, j] = impulse / par.dt
    joints[LEAST, j] = min(joints[LEAST, j], force)
    joints[GREATEST, j] = max(joints[GREATEST, j], force)
    chain.bars[BELOW, j] = chain.bars[ABOVE, j + 1] = impulse


@merged
def join(par, s, runs, chain, v, r):
    """Let the ends meet at the joint below a rod."""
    fits, joints, j = chain.fits, chain.joints, runs[r].bar
    before, free = speeds(runs, v, r)
    gap = joints[GAP, j]
    after = joint_law(par, chain, j, before, free)
    impulse = fits[j].shared * (free - after)
    middle = joints[GAP, j] if fits[j].kind == LOSSY else 0.5 * (gap + joints[GAP, j])
    stored = middle * (fits[j].preload + 0.5 * fits[j].stiffness * middle)
    if fits[j].kind == LOSSY:
        # the dashpot's share by the energy law; `ride` follows it exactly
        way = joints[GAP, j] - gap
        kinetic = 0.5 * (after - before) * (after + before)
        pushed = fits[j].shared * ((free - before) / par.dt * way - kinetic)
        taken = pushed - (stored - joints[STORED, j])
        s.e_joints += taken
        s.e_numerical -= taken
    book_joint(par, s, chain, j, impulse, 0.5 * (before + after), stored)
    runs[r].low -= impulse / runs[r].half
    runs[r + 1].top += impulse / runs[r + 1].half


@inlined
def rock_energy(par, s):
    """Where the work on the rock has gone [J]."""
    return s.e_crushing + s.e_barrier + s.e_standstill + recoverable(par, s)


@merged
def meet_rock(par, s, runs, chain, w, v, events):
    """Let the bit's lower end meet the rock."""
    last = runs.shape[0] - 1
    before, free = s.v_end, runs[last].low
    work, gone = s.rock_work, rock_energy(par, s)
    step_rock_end(par, s, runs, w, v, (free - before) / par.dt, events)
    runs[last].low = s.v_end
    if chain is not None:
        impulse, work = par.end_mass * (free - s.v_end), s.rock_work - work
        s.e_numerical += 0.5 * impulse * (before + s.v_end) - work
        s.e_overshoot += work - (rock_energy(par, s) - gone)
        chain.bars[BELOW, par.bars - 1] = impulse


@inlined
def damper_stored(par, s):
    """Energy of the damper's spring, which only pushes, beyond that of its preload [J]."""
    if par.damper_stiffness == 0.0:
        return par.damper_preload * s.x_c
    force = max(par.damper_preload + par.damper_stiffness * s.x_c, 0.0)
    return 0.5 * (force * force - par.damper_preload * par.damper_preload) / par.damper_stiffness


@merged
def move_means(par, s, chain, damper):
    """Mean motion of bars and casing, and the work of body forces."""
    bars, mass = chain.bars, chain.mass
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


@inlined
def stroke_speed(par, s, chain):
    """Speed of the piston against what the drive watches: casing, top rod or bit [m/s]."""
    if chain is None:
        return s.v_p - s.v_b
    return s.v_p - (s.v_c if par.damper == 1 else chain.bars[VELOCITY, 1])


@inlined
def kick_means(par, s, chain, kick):
    """Add what a turn of the drive within a step did to the piston [m/s], and to the casing."""
    impulse = par.mass_p * kick
    s.e_drive += impulse * (s.v_p + 0.5 * kick)
    s.i_drive += impulse
    chain.bars[VELOCITY, 0] += kick
    if par.damper == 1:
        recoil = impulse / par.damper_casing_mass
        s.e_drive -= impulse * (s.v_c - 0.5 * recoil)
        s.v_c -= recoil


@summed
def strain_work(before, v, first, n):
    """Sum over a stretch of rate of strain a step ago times twice its mean [m2/s2]."""
    total = 0.0
    old, new = before[first:], v[first:]
    for i in range(n):
        rate = old[i + 1] - old[i]
        total += rate * (rate + (new[i + 1] - new[i]))
    return total


@kernel
def held(par, s, runs, chain, w, v):
    """Energy of motion half a step ago, and of strain in bars, joints and damper then [J]."""
    kinetic = elastic = 0.0
    for r in range(runs.shape[0]):
        for i in range(runs[r].first, runs[r].first + runs[r].n):
            kinetic += 0.5 * runs[r].half * (v[i] * v[i] + v[i + 1] * v[i + 1])
            rate = v[i + 1] - v[i]
            stretch = w[i + 1] - w[i] - par.eta * rate
            stiff = 2.0 * runs[r].half * runs[r].kappa / par.dt
            elastic += 0.5 * stiff * stretch * (stretch - par.dt * rate)
    for j in range(chain.joints.shape[1]):
        elastic += chain.joints[STORED, j]
    if par.damper == 1:
        kinetic += 0.5 * par.damper_casing_mass * s.v_c * s.v_c
        elastic += damper_stored(par, s)
    return kinetic, elastic


@kernel
def begin(par_, state, chain):
    """Take the mean motion of bars and casing at time zero half a step back."""
    par, s = par_[0], state[0]
    half, bars = 0.5 * par.dt, chain.bars
    damper = load_bars(par, s, chain)
    if par.damper == 1:
        s.v_c -= half * (s.feed - drive_force(par, s) - damper) / par.damper_casing_mass
    for i in range(par.bars):
        bars[VELOCITY, i] -= half * bars[ACCELERATION, i]
