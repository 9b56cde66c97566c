"""Drill string that meets the hammer's casing by waves.

What crosses a communication point is the wave that goes down the lowest rod over the next step,
known since rods delay it, and the one that has come up over the last: sums of Legendre
polynomials, scaled to the energy of what they are of. So the coupling makes and loses none,
whatever the hammer does (docs/system.md, section 4). Steps may be as long as the rods delay a wave.
"""

from __future__ import annotations

import math

from fmu_src.parts import string_body as body
from fmu_src.parts import string_packets as packets
from fmu_src.parts.part import COUNT, NUMBER, Law, PartTable
from fmu_src.parts.string_packets import COMING, DEGREES
from percussion_model.physics.elementary import exp
from percussion_model.physics.kernel import kernel

# A time this close to another, by the step, is that; a wave that lacks less of its step is whole.
ROUNDING, WHOLE = 1e-9, 1e-4
# A wave that has come up: when its step began, and its polynomials.
PACKET = 1 + DEGREES
LATEST = 1e9  # of inputs [s]
_DOWN = tuple(f"wave_{k + 1}" for k in range(DEGREES))
_UP = tuple(f"returned_{k + 1}" for k in range(DEGREES))
# Numbers of what is refused, by `LAW.faults`.
TOO_MANY, NO_ROOM, SAVED_TOO_MANY, TOO_LONG, OTHER_STEP, LACKING, TIMES = range(1, 8)


@kernel
def kept_waves(p):
    """Room for waves that have come up, and are not in the rods yet."""
    return math.ceil(body.step_of(p) / p.communication_step) + 3


@kernel
def down_at(p):
    """Where waves that go down begin in what moves: behind those that have come up."""
    return kept_waves(p) * PACKET


@kernel
def up_at(p):
    """Where waves that go up begin there."""
    return down_at(p) + p.rod_most * p.rod_cells * DEGREES


@kernel
def moving(p):
    """Numbers that belong to the state."""
    return up_at(p) + p.rod_most * p.rod_cells * DEGREES


@kernel
def made(p):
    """Numbers that follow from parameters."""
    return packets.MADE


@kernel
def free_cells(p):
    """Lowest cells that give what the hammer needs next whatever it does until then."""
    return math.ceil(2.0 * p.communication_step / body.step_of(p) - ROUNDING) + 1


@kernel
def check(p, facts):
    """Refuse more rods than there may be, and a step in which a wave goes through all of them."""
    if body.rods_fault(p.start_rods, p.rod_most, facts):
        return TOO_MANY
    cells = p.start_rods * p.rod_cells
    facts[0], facts[1] = p.communication_step, 0.5 * body.step_of(p) * (cells - 2)
    facts[2], facts[3] = p.start_rods, cells
    return TOO_LONG if free_cells(p) >= cells else 0


@kernel
def begin(p, u, s, w):
    """Stand still in balance, with `start.force` at the low end."""
    s.count, s.next_rod, s.mean_push = p.start_rods, p.start_rod_left, p.start_feed_force
    packets.rest_packets(p, s, w, down_at(p), up_at(p), p.start_force)
    give(p, s, w)


@kernel
def step(p, u, s, w, h):
    """Take what the hammer has sent, move the rods as far as that is known, and give."""
    span, cell = p.communication_step, body.step_of(p)
    if h <= ROUNDING * span:  # what some masters add to come to the end
        return 0
    if abs(h - span) > ROUNDING * span:
        w.facts[0], w.facts[1] = h, span
        return OTHER_STEP
    fault = take(p, u, s, w)
    if fault > 0:
        return fault
    down, up, head, free = down_at(p), up_at(p), s.head, free_cells(p)
    while s.clock + cell <= s.known_until + ROUNDING * span:
        packets.clear(w.made, COMING)
        squared = 0.0
        for k in range(s.returned):
            at = k * PACKET
            squared += packets.project(
                w.moving, at + 1, w.moving[at], span, w.made, COMING, s.clock, cell
            )
        packets.keep_energy(w.made, COMING, squared)
        packets.advance_packets(p, s, w, down, up, u.head_force, free)
        s.clock += cell
    forget(p, s, w)
    s.head_work += u.head_force * (s.head - head)
    s.head_impulse += u.head_force * span
    s.steps += 1.0
    s.time = s.steps * span  # as the host has it, without rounding of a sum
    give(p, s, w)
    s.mean_push += (1.0 - exp(-span / p.feed_filter)) * (u.push - s.mean_push)
    return add_rod(p, s, w) if body.is_wanted(p, u, s) else 0


@kernel
def take(p, u, s, w):
    """Keep a wave that the hammer has sent whole."""
    start, span = u.returned_begin, p.communication_step
    if u.returned_until < start + span * (1.0 - WHOLE):
        return 0
    if start > s.known_until + 0.5 * span:
        w.facts[0], w.facts[1], w.facts[2] = start, s.known_until, span
        return LACKING
    if start <= s.known_until - 0.5 * span:
        return 0
    if s.returned == kept_waves(p):  # only in a state from outside
        drop(s, w)
    at, x = s.returned * PACKET, w.moving
    x[at] = start
    x[at + 1], x[at + 2], x[at + 3] = u.returned_1, u.returned_2, u.returned_3
    x[at + 4], x[at + 5], x[at + 6] = u.returned_4, u.returned_5, u.returned_6
    x[at + 7], x[at + 8] = u.returned_7, u.returned_8
    if u.returned_square > 0.0:  # else the hammer does not tell
        lacking = packets.keep_energy(x, at + 1, u.returned_square - s.debt)
        s.debt = max(-lacking, 0.0)
    s.returned += 1
    s.known_until = start + span
    s.taken += span * packets.square(x, at + 1)
    return 0


@kernel
def drop(s, w):
    """Forget the first of the waves that have come up."""
    s.returned -= 1
    for k in range(s.returned * PACKET):
        w.moving[k] = w.moving[PACKET + k]


@kernel
def forget(p, s, w):
    """Forget waves that are in the rods."""
    span = p.communication_step
    while s.returned > 0 and w.moving[0] + span <= s.clock + ROUNDING * span:
        drop(s, w)


@kernel
def give(p, s, w):
    """Find the wave that leaves over the step to come."""
    span, cell, cells = p.communication_step, body.step_of(p), s.count * p.rod_cells
    ahead = max(math.floor((s.time - s.clock) / cell), 0)
    packets.clear(s.wave, 0)
    squared = 0.0
    for k in range(ahead, min(ahead + 2 + math.ceil(span / cell), cells)):
        packets.leave(p, s, w, down_at(p), k, COMING)
        begin = s.clock + k * cell
        squared += packets.project(w.made, COMING, begin, cell, s.wave, 0, s.time, span)
    packets.keep_energy(s.wave, 0, squared)
    s.wave_begin = s.time
    s.given += span * packets.square(s.wave, 0)


@kernel
def add_rod(p, s, w):
    """Add a rod, and book what it brings."""
    if body.rods_fault(s.count + 1, p.rod_most, w.facts):
        w.facts[0] = s.count
        return NO_ROOM
    down, up = down_at(p), up_at(p)
    stored = packets.stored_in_packets(p, s, w, down, up)
    momentum = packets.momentum_of_packets(p, s, w, down, up)
    packets.add_to_packets(p, s, w, down, up)
    s.next_rod += p.rod_length
    s.brought_energy += packets.stored_in_packets(p, s, w, down, up) - stored
    s.brought_momentum += packets.momentum_of_packets(p, s, w, down, up) - momentum
    return 0


@kernel
def outputs(p, s, w, y):
    """Present values."""
    down, up, impedance = down_at(p), up_at(p), body.impedance_of(p)
    y.impedance, y.wave_begin, y.wave_span = impedance, s.wave_begin, p.communication_step
    y.wave_1, y.wave_2, y.wave_3, y.wave_4 = s.wave[0], s.wave[1], s.wave[2], s.wave[3]
    y.wave_5, y.wave_6, y.wave_7, y.wave_8 = s.wave[4], s.wave[5], s.wave[6], s.wave[7]
    y.feed_force_mean, y.head_position, y.head_velocity = s.mean_push, s.head, s.head_velocity
    y.length, y.weight = s.count * p.rod_length, body.weight_of(p, s.count, 0.0)
    y.rod_wanted, y.rod_count = s.head >= s.next_rod, s.count
    y.head_impulse = s.head_impulse
    y.momentum = packets.momentum_of_packets(p, s, w, down, up) - s.brought_momentum
    y.wall_momentum, y.energy_head, y.energy_weight = s.lost_momentum, s.head_work, s.weight_work
    y.energy_port, y.energy_left = impedance * (s.given - s.taken), s.port_work
    y.energy_wall = s.friction_loss
    y.energy_stored = packets.stored_in_packets(p, s, w, down, up) - s.brought_energy


@kernel
def state_fault(p, s, w):
    """Refuse more rods, or more waves, than there is room for, and a clock that is far off."""
    if body.rods_fault(s.count, p.rod_most, w.facts):
        return SAVED_TOO_MANY
    span, cell, facts = p.communication_step, body.step_of(p), w.facts
    facts[0], facts[1], facts[2], facts[3] = s.returned, s.clock, s.known_until, s.time
    late = s.known_until - s.clock
    good = s.returned <= kept_waves(p) and -span <= late <= cell + span and s.clock <= s.time + span
    return 0 if good and free_cells(p) < s.count * p.rod_cells else TIMES


# Time of the last communication point, up to which the rods have gone, a step or two behind, and up
# to which waves have come up; steps that were done; how many of those waves are kept; the wave that
# is given; energies of waves given and taken, divided by impedance; mean square that the last one
# has too much [m2/s2].
LAW = Law(
    state={
        **body.STATE,
        **dict.fromkeys(("time", "clock", "known_until", "wave_begin"), (0.0, LATEST)),
        "steps": (0.0, 1e15),
        "returned": (0, 2**31 - 1),
        "wave": (*NUMBER, DEGREES),
        **dict.fromkeys(
            ("given", "taken", "debt", "mean_push", "head_work", "head_impulse", "port_work"),
            NUMBER,
        ),
    },
    begin=begin,
    step=step,
    outputs=outputs,
    made=made,
    moving=moving,
    make=packets.make_packets,
    check=check,
    state_fault=state_fault,
    faults=(
        body.TOO_MANY,
        body.NO_ROOM,
        body.SAVED_TOO_MANY,
        "communication_step = {0:r} s: must be at most {1:.4g} s for {2:d} rods in {3:d} cells",
        "a step of {0:r} s: communication_step is {1:r} s: take steps of that, or set "
        "communication_step = {0:r}",
        "returned_begin = {0:r} s: the wave from {1:r} s on is lacking: the hammer must take steps "
        "of communication_step, {2:r} s",
        "the saved state has {0:d} waves that have come up, its rods at {1:r} s, waves up to "
        "{2:r} s and a present of {3:r} s, which do not fit",
    ),
)

TABLE = PartTable(
    name="WaveString",
    description="Axial drill string with head, coupled to a casing in the hammer by waves",
    inputs={
        "head_force": ("N", -1e9, 1e9, 0.0, "force of the rig on the head"),
        "push": ("N", -1e9, 1e9, 0.0, "push of the shoulder on the bit"),
        "returned_begin": ("s", 0.0, 1e9, 0.0, "when the step began whose wave comes up"),
        "returned_until": ("s", 0.0, 1e9, 0.0, "up to which time that is complete"),
        **{
            name: ("m/s", -1e4, 1e4, 0.0, f"share of polynomial {k} of the wave that comes up")
            for k, name in enumerate(_UP)
        },
        "returned_square": ("m^2/s^2", 0.0, 1e8, 0.0, "mean square of the wave that comes up"),
        "add_rod": ("", 0, 1, False, "a rising edge adds a rod, where rod_wanted"),
    },
    outputs={
        "impedance": ("N s/m", "impedance of the rods"),
        "wave_begin": ("s", "when the step begins whose wave goes down"),
        "wave_span": ("s", "length of that step"),
        **{
            name: ("m/s", f"share of polynomial {k} of the wave that goes down")
            for k, name in enumerate(_DOWN)
        },
        "feed_force_mean": ("N", "push, filtered"),
        "head_position": ("m", "displacement of the head, without that of adding rods"),
        "head_velocity": ("m/s", "velocity of the head"),
        "length": ("m", "length of the rods"),
        "weight": ("N", "weight of head and rods, less buoyancy"),
        "rod_wanted": (False, "whether the head is down and a rod may be added"),
        "head_impulse": ("N s", "running integral of head_force"),
        "momentum": ("N s", "of head and rods, less what new rods brought"),
        "wall_momentum": ("N s", "momentum that the wall has taken"),
        "energy.head": ("J", "work of head_force"),
        "energy.weight": ("J", "work of the weight"),
        "energy.port": ("J", "energy of waves sent less that of waves received"),
        "energy.left": ("J", "energy that has left the lowest cell, less what has come in"),
        "energy.wall": ("J", "energy that wall friction has taken"),
        "energy.stored": ("J", "kinetic and elastic energy, less what new rods brought"),
        "rod_count": (COUNT, "rods in the string"),
    },
    parameters={
        "communication_step": ("s", 1e-6, 1.0, 1e-3, "step of the master"),
        **body.rod_parameters(cells=4),
        "start.feed_force": ("N", 0.0, 1e6, 2500.0, "push of the shoulder at the start"),
        "start.force": ("N", -1e6, 1e6, 2100.0, "force of the rods on the casing at the start"),
    },
    at_start=dict.fromkeys(
        (
            "impedance", "wave_begin", "wave_span", "wave_1", "wave_2", "feed_force_mean",
            "length", "weight", "rod_wanted", "momentum", "energy.stored", "rod_count",
        ),
        (),
    ),
    law=LAW,
)  # fmt: skip
