"""Drill string: head, rods, casing, and the shoulder that pushes the bit.

The shoulder is a spring with a damper, in compression only,

    F = k (x_c - x_b) + c (v_c - v_b)  >= 0,

and F is held over a communication step on both sides: the casing feels what the bit
feels, so momentum passes the interface exactly. A force that is held for a step h, and
known to the bit a step late, brings energy into the pair unless the damper takes it:
c > k h / 2 for the hold, 3 k h / 2 with the delay. A damper that is sampled needs
c h well below the mass that it brakes. `_shoulder` keeps both, by less stiffness if need
be: then a free bit comes to rest at any step. No sampled force is passive for every
partner; one that swings within a few steps has to lose a few percent a cycle, as rock does.
"""

from __future__ import annotations

import math

from fmu_src.parts import string_body as body
from fmu_src.parts import string_waves as waves
from fmu_src.parts.part import COUNT, NUMBER, Law, PartTable
from percussion_model.physics.elementary import exp
from percussion_model.physics.kernel import kernel

LUMPED = 1  # choice of the model
# Damping by stiffness and step: 3/2 is the limit, the rest is margin.
DAMPING_OF_DELAY = 2.0
# Damping by mass and step: stable below 1/2 with a delay of one step, the rest is margin
# for bits that swing on rock.
SHARE_OF_MASS = 0.1
# A step that misses the end of a cell by rounding ends there.
ROUNDING = 1e-9
# Implicit midpoint is stable at any step, but blind to what is faster [s].
LONGEST_LUMPED_STEP = 2e-3
# Numbers of what is refused, by `LAW.faults`.
TOO_MANY, NO_ROOM, SAVED_TOO_MANY, LAG = 1, 2, 3, 4


@kernel
def moving(p):
    """Places and velocities of lumps, or waves that go down and up."""
    return 2 * (p.rod_most + 2 if p.model == LUMPED else p.rod_most * p.rod_cells)


@kernel
def made(p):
    """Room to solve for the velocities of lumps."""
    return moving(p) if p.model == LUMPED else 0


@kernel
def check(p, facts):
    """Refuse more rods than there may be."""
    return TOO_MANY if body.rods_fault(p.start_rods, p.rod_most, facts) else 0


@kernel
def begin(p, u, s, w):
    """Stand still in balance, the shoulder loaded by `start.feed_force`."""
    s.count, s.next_rod = p.start_rods, p.start_rod_left
    s.force = s.mean_force = p.start_feed_force
    s.stiffness = p.shoulder_stiffness
    s.gap = s.force / s.stiffness
    s.loaded = 0.5 * (s.force * s.force) / s.stiffness
    s.bit, s.casing_impulse = u.bit_position, u.casing_impulse
    casing_weight = body.gravity_of(p) * p.casing_mass
    if p.model == LUMPED:
        body.rest_lumps(p, s, w, s.force - casing_weight)
    else:
        waves.rest_waves(p, s, w, s.force - casing_weight)


@kernel
def casing_position(s):
    """Displacement of the casing at the communication point [m]."""
    return s.casing + s.casing_velocity * s.lag


@kernel
def step(p, u, s, w, h):
    """Forces act, waves travel, the shoulder finds its new force."""
    reaction = (u.casing_impulse - s.casing_impulse) / h
    s.casing_impulse = u.casing_impulse
    head, casing = s.head, casing_position(s)
    if p.model == LUMPED:
        count = max(1, math.ceil(h / LONGEST_LUMPED_STEP - ROUNDING))
        for _ in range(count):
            body.advance_lumps(p, s, w, u.head_force, reaction - s.force, h / count)
    else:
        travel(p, s, w, u.head_force, reaction - s.force, h)
    s.head_work += u.head_force * (s.head - head)
    s.head_impulse += u.head_force * h
    s.time += h
    moved = casing_position(s) - casing
    s.reaction_work += reaction * moved
    s.shoulder_work += s.force * moved
    s.bit_impulse += s.force * h
    # what the bit did is known a step late, as it is in a master that goes by Jacobi
    s.bit_work += s.force_before * (u.bit_position - s.bit)
    s.force_before = s.force
    update_force(p, s, (u.bit_position - s.bit) / h, u.bit_position, h)
    s.bit = u.bit_position
    s.mean_force += (1.0 - exp(-h / p.feed_filter)) * (s.force - s.mean_force)
    return add_rod(p, s, w) if body.is_wanted(p, u, s) else 0


@kernel
def travel(p, s, w, head_force, casing_force, h):
    """Bring the waves up to the communication point, or within a cell of it."""
    grid = waves.grid_of(p)
    cell = grid.step
    if s.lag + h < cell * (1.0 - ROUNDING):
        s.head_impulse_due += head_force * h
        s.casing_impulse_due += casing_force * h
        s.lag += h
        return
    # what has acted since the last transit time ended counts in the first one
    first = cell - s.lag
    whole = max(0, math.floor((h - first) / cell + ROUNDING))
    on_head = (s.head_impulse_due + head_force * first) / cell
    on_casing = (s.casing_impulse_due + casing_force * first) / cell
    # Coulomb friction holds what is about to turn, so it has to act after each cell
    most = 1 if p.friction_force > 0.0 else s.count * p.rod_cells
    since = 0
    for k in range(1 + whole):
        waves.advance_waves(p, s, w, grid, on_head, on_casing)
        on_head, on_casing, since = head_force, casing_force, since + 1
        if since == most or k == whole:
            waves.rub_waves(p, s, w, grid, since)
            since = 0
    s.lag = max(0.0, h - first - whole * cell)
    s.head_impulse_due = head_force * s.lag
    s.casing_impulse_due = casing_force * s.lag


@kernel
def shoulder(p, h):
    """Stiffness [N/m] and damping [N s/m] that a communication step `h` [s] allows."""
    k, c = p.shoulder_stiffness, p.shoulder_damping
    if not p.shoulder_passive:
        return k, c
    most = SHARE_OF_MASS * p.shoulder_bit_mass / h
    k = min(k, most / (DAMPING_OF_DELAY * h))
    return k, min(max(c, DAMPING_OF_DELAY * k * h), most)


@kernel
def update_force(p, s, bit_velocity, bit, h):
    """Force of the shoulder for the step to come."""
    k, c = shoulder(p, h)
    if k != s.stiffness:
        # another step size: the same force at another stiffness
        softer = 1.0 / k - 1.0 / s.stiffness
        s.gap += s.force * softer
        s.loaded += 0.5 * (s.force * s.force) * softer
        s.stiffness = k
    compression = s.gap + casing_position(s) - bit
    s.force = 0.0
    if compression > 0.0:
        s.force = max(0.0, k * compression + c * (s.casing_velocity - bit_velocity))


@kernel
def add_rod(p, s, w):
    """Add a rod, and book what it brings."""
    if body.rods_fault(s.count + 1, p.rod_most, w.facts):
        w.facts[0] = s.count
        return NO_ROOM
    stored, momentum = energy_of(p, s, w), momentum_of(p, s, w)
    if p.model == LUMPED:
        body.add_lump(p, s, w)
    else:
        waves.add_to_waves(p, s, w)
    s.next_rod += p.rod_length
    s.brought_energy += energy_of(p, s, w) - stored
    s.brought_momentum += momentum_of(p, s, w) - momentum
    return 0


@kernel
def energy_of(p, s, w):
    """Kinetic and elastic energy of the body [J]."""
    if p.model == LUMPED:
        return body.stored_in_lumps(p, s, w)
    return waves.stored_in_waves(p, s, w)


@kernel
def momentum_of(p, s, w):
    """Of head, rods and casing [N s]."""
    return body.momentum_of_lumps(p, s, w) if p.model == LUMPED else waves.momentum_of_waves(p, s)


@kernel
def outputs(p, s, w, y):
    """Present values."""
    stored = 0.5 * (s.force * s.force) / s.stiffness
    y.feed_force, y.feed_force_mean, y.head_velocity = s.force, s.mean_force, s.head_velocity
    y.head_position = s.head + s.head_velocity * s.lag
    y.casing_position, y.casing_velocity = casing_position(s), s.casing_velocity
    y.length, y.weight = s.count * p.rod_length, body.weight_of(p, s.count, p.casing_mass)
    y.rod_wanted, y.lifted = s.head >= s.next_rod, s.force == 0.0
    y.shoulder_stiffness = s.stiffness
    y.head_impulse, y.bit_impulse = s.head_impulse, s.bit_impulse
    y.momentum = momentum_of(p, s, w) - s.brought_momentum
    y.wall_momentum = s.lost_momentum
    y.energy_head, y.energy_reaction, y.energy_weight = s.head_work, s.reaction_work, s.weight_work
    y.energy_bit = s.bit_work
    y.energy_shoulder = s.shoulder_work - s.bit_work - (stored - s.loaded)
    y.energy_wall = s.friction_loss
    y.energy_stored = energy_of(p, s, w) + stored - s.brought_energy
    y.rod_count = s.count


@kernel
def state_fault(p, s, w):
    """Refuse more rods than there is room for, and a lag that is longer than a cell."""
    if body.rods_fault(s.count, p.rod_most, w.facts):
        return SAVED_TOO_MANY
    w.facts[0], w.facts[1] = s.lag, 0.0 if p.model == LUMPED else body.step_of(p)
    return 0 if s.lag <= w.facts[1] else LAG


# Force of the shoulder until the next step ends, and that before it; compression of the shoulder at
# equal displacements; by how much waves stay behind the communication point, and what has acted
# since; energies, impulses; sum of all waves. What is divided by is above zero.
LAW = Law(
    state={
        **body.STATE,
        **dict.fromkeys(
            ("casing", "casing_velocity", "force", "force_before", "gap", "bit", "casing_impulse",
             "head_impulse_due", "casing_impulse_due", "mean_force", "head_work", "reaction_work",
             "bit_work", "shoulder_work", "head_impulse", "bit_impulse", "loaded", "time",
             "total"),
            NUMBER,
        ),
        "stiffness": (1e-30, NUMBER[1]),
        "lag": (0.0, NUMBER[1]),
    },
    begin=begin,
    step=step,
    outputs=outputs,
    made=made,
    moving=moving,
    check=check,
    state_fault=state_fault,
    faults=(
        body.TOO_MANY,
        body.NO_ROOM,
        body.SAVED_TOO_MANY,
        "the saved state has lag = {0:r}, which must be from 0 to {1:r} s",
    ),
)  # fmt: skip

TABLE = PartTable(
    name="DrillString",
    description="Axial drill string with head, casing and the shoulder that pushes the bit",
    inputs={
        "head_force": ("N", -1e9, 1e9, 0.0, "force of the rig on the head"),
        "bit_position": ("m", -1e6, 1e6, 0.0, "displacement of the bit"),
        "casing_impulse": (
            "N s", -1e12, 1e12, 0.0, "running integral of the drive's reaction on the casing"
        ),
        "add_rod": ("", 0, 1, False, "a rising edge adds a rod, where rod_wanted"),
    },
    outputs={
        "feed_force": ("N", "force of the shoulder on the bit, held for the next step"),
        "feed_force_mean": ("N", "the same, filtered"),
        "head_position": ("m", "displacement of the head, without that of adding rods"),
        "head_velocity": ("m/s", "velocity of the head"),
        "casing_position": ("m", "displacement of the casing"),
        "casing_velocity": ("m/s", "velocity of the casing"),
        "length": ("m", "length of the rods"),
        "weight": ("N", "weight of head, rods and casing, less buoyancy"),
        "rod_wanted": (False, "whether the head is down and a rod may be added"),
        "lifted": (False, "whether the shoulder is off the bit"),
        "shoulder_stiffness": ("N/m", "stiffness of the shoulder that the step size allows"),
        "head_impulse": ("N s", "running integral of head_force"),
        "bit_impulse": ("N s", "running integral of feed_force"),
        "momentum": ("N s", "of head, rods and casing, less what new rods brought"),
        "wall_momentum": ("N s", "momentum that the wall has taken"),
        "energy.head": ("J", "work of head_force"),
        "energy.reaction": ("J", "work of the drive's reaction on the casing"),
        "energy.weight": ("J", "work of the weight"),
        "energy.bit": ("J", "work of feed_force on the bit"),
        "energy.shoulder": (
            "J", "energy that the shoulder has taken; below 0 the coupling has made energy"
        ),
        "energy.wall": ("J", "energy that wall friction has taken"),
        "energy.stored": ("J", "kinetic and elastic energy, less what new rods brought"),
        "rod_count": (COUNT, "rods in the string"),
    },
    parameters={
        "model": ("", 0, 0, ("waves", "lumped"), "travelling waves, or a mass for each rod"),
        **body.rod_parameters(cells=2),
        "start.feed_force": ("N", 0.0, 1e6, 2500.0, "force of the shoulder at the start"),
        "casing.mass": ("kg", 0.1, 1e5, 40.0, "casing of the hammer; part of the string"),
        "shoulder.stiffness": ("N/m", 1e3, 1e10, 1e5, "stiffness of shoulder, chuck and damper"),
        "shoulder.damping": ("N s/m", 0.0, 1e7, 200.0, "damping of the same"),
        "shoulder.bit_mass": ("kg", 0.1, 1e4, 8.69, "mass of the bit, for the limit of a step"),
        "shoulder.passive": ("", 0, 1, True, "keep to what a communication step can bear"),
    },
    at_start=dict.fromkeys(
        (
            "feed_force", "feed_force_mean", "length", "weight", "rod_wanted", "lifted",
            "shoulder_stiffness", "momentum", "energy.stored", "rod_count",
        ),
        (),
    ),
    law=LAW,
)  # fmt: skip
