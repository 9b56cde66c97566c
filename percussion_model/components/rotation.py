"""Rotation of the bit: what it leaves of the craters, its torque and its motor.

From blow to blow buttons at the mean radius r turn on by an arc s. Craters keep of the energy
that they have taken the share exp(-s/lambda) (docs/model.md, eq. 20h). The torque lifts the bit
out of its craters, by c a blow against the mean force F, and rubs the buttons on the rock, which
only the static force F_0 presses on it between blows,

    T = r (F c/s + mu F_0)

(eq. 20i). The motor's speed falls with the torque, to zero where it stalls. A string between them
may twist: each blow stops the bit, which then rests until the string's torque is T, and swings on
under both (eq. 20j).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.components import Component
from percussion_model.physics.elementary import atan2, cos_and_sin, exp
from percussion_model.physics.kernel import LEAST_DIVISOR, inlined

# A turn by less is rounding [rad].
LEAST_TURN = 1e-12


class Turn(NamedTuple):
    """What the bit does on a string that twists, from one blow to the next."""

    angle: float  # by which it turns [rad]
    twist: float  # of the string at the end [rad]
    torque: float  # of the string, its mean [N m]
    speed: float  # of the bit when the next blow stops it [rad/s]


@inlined
def twists(par):
    """Whether the string twists."""
    return par.rotation_string_stiffness > 0.0


@inlined
def turn(par, s, period):
    """The bit's turn in a period that it begins at rest, against the torque of the last blow.

    It does not turn back.
    """
    stiffness = max(par.rotation_string_stiffness, LEAST_DIVISOR)
    inertia = max(par.rotation_inertia, LEAST_DIVISOR)
    motor, needed = s.rotation_turning_speed, s.rotation_needed_torque
    stall, rate = par.rotation_stall_torque, math.sqrt(stiffness / inertia)
    twist, held = s.rotation_twist, needed / stiffness
    angle, speed, impulse, left = 0.0, 0.0, 0.0, period
    for _ in range(2):  # a bit that has come to rest by itself swings on without another rest
        if left > 0.0:
            time = left
            if stall == 0.0 or needed < stall:
                time = min(max(held - twist, 0.0) / max(motor, LEAST_DIVISOR), left)
            impulse += stiffness * (twist + 0.5 * motor * time) * time
            twist, left, speed = twist + motor * time, left - time, 0.0
        if left > 0.0:
            time, off = left, twist - held
            if off > LEAST_TURN:
                time = min((math.pi + 2.0 * atan2(motor, rate * off)) / rate, left)
            c, sine = cos_and_sin(rate * time)
            after = off * c + motor / rate * sine
            speed = max(motor * (1.0 - c) + rate * off * sine, 0.0)
            angle += motor * time - (after - off)
            impulse += needed * time + inertia * speed
            twist, left = held + after, left - time
    angle, torque = angle if angle > LEAST_TURN else 0.0, impulse / max(period, LEAST_DIVISOR)
    if stall > 0.0:
        twist, torque = min(twist, stall / stiffness), min(torque, stall)
    return Turn(angle, twist, torque, speed)


@inlined
def arc(par, s, period):
    """Arc at the mean radius of the buttons in a time [m]."""
    if twists(par):
        return par.rotation_mean_radius * turn(par, s, period).angle
    return par.rotation_mean_radius * s.rotation_turning_speed * period


@inlined
def fading(par):
    """Arc over which craters lose 63 % of their depth [m]."""
    return par.rotation_renewal_length * (par.exponent + 1.0)


@inlined
def kept(par, s, period):
    """Share of their depth that craters keep after a period."""
    length = fading(par)
    return exp(-arc(par, s, period) / max(length, LEAST_DIVISOR)) if length > 0.0 else 0.0


@inlined
def motor_speed(par, s, torque):
    """Speed of the motor under a torque [rad/s]."""
    stall, full = par.rotation_stall_torque, par.rotation_full_torque
    if stall == 0.0 or torque <= full:
        return s.rotation_speed
    return s.rotation_speed * max(stall - torque, 0.0) / max(stall - full, LEAST_DIVISOR)


@inlined
def next_blow(par, s, period, kept, rest, push, climb):
    """Torque of the blow that has ended, and the speed of the next."""
    way, radius = arc(par, s, period), par.rotation_mean_radius
    slope = climb / max(way, LEAST_DIVISOR) if way > 0.0 else 0.0
    if way == 0.0 and fading(par) > 0.0:
        slope = s.pit / max(fading(par), LEAST_DIVISOR)  # on which it would begin to climb
    rubbing = par.rotation_friction * max(rest, 0.0)
    needed = radius * (max(push, 0.0) * slope + rubbing)
    stall, at_motor, lost = par.rotation_stall_torque, needed, 0.0
    if twists(par):
        turned = turn(par, s, period)
        s.rotation_twist, at_motor = turned.twist, turned.torque
        s.rotation_angle += turned.angle
        lost = 0.5 * par.rotation_inertia * turned.speed * turned.speed
    else:
        s.rotation_angle += s.rotation_turning_speed * period
    s.rotation_needed_torque = needed
    s.rotation_torque = min(at_motor, stall) if stall > 0.0 else at_motor
    s.rotation_index = way
    s.e_turning += rubbing * way + lost
    s.e_friction += rubbing * way + lost
    follows = 1.0
    if par.rotation_response > 0.0:
        follows = 1.0 - exp(-period / max(par.rotation_response, LEAST_DIVISOR))
    off = motor_speed(par, s, at_motor) - s.rotation_turning_speed
    s.rotation_turning_speed += follows * off


COMPONENT = Component(
    "rotation",
    "the bit turns: rock that was met before answers as left, and a torque is needed",
    {
        "speed": (4.0, "rad/s", "speed of the rotation, of its motor without load", 0.0, 1e4),
        "mean_radius": (None, "m", "mean radius on which the buttons are", 1e-4, 10.0),
        "renewal_length": (
            2e-3,
            "m",
            "lambda: arc at the mean radius after which 63 % of the energy of craters is to be "
            "crushed anew; 0: rock is always fresh",
            0.0,
            1.0,
        ),
        "old_line": (
            False,
            "-",
            "rock met again answers on its old line of unloading; else it is crushed again, which "
            "breaks nothing",
            0,
            1,
        ),
        "friction": (0.8, "-", "mu: friction of buttons on rock between blows", 0.0, 10.0),
        "stall_torque": (
            0.0,
            "N m",
            "torque at which the motor stalls; 0: it never does",
            0.0,
            1e9,
        ),
        "full_torque": (0.0, "N m", "torque up to which the motor holds its speed", 0.0, 1e9),
        "string_stiffness": (
            0.0,
            "N m/rad",
            "torque per twist of the string between motor and bit; 0: it does not twist",
            0.0,
            1e12,
        ),
        "inertia": (
            0.0,
            "kg m^2",
            "moment of inertia of the bit and of what turns with it below the string",
            0.0,
            1e6,
        ),
        "response": (0.1, "s", "time in which the speed follows; 0: from blow to blow", 0.0, 1e3),
    },
    state={
        "angle": ("rad", "angle turned since the start, up to the present blow", 0.0),
        "turning_speed": ("rad/s", "speed of the rotation, that of its motor", "speed"),
        "twist": ("rad", "twist of the string when the last blow began", 0.0),
        "torque": ("N m", "torque of the rotation, that of its motor, in the last blow", 0.0),
        "needed_torque": ("N m", "torque that rotation needs, more than the motor's in a jam", 0.0),
        "index": ("m", "arc at the mean radius in the last blow", 0.0),
    },
    inputs=("speed",),
    kept=kept,
    next_blow=next_blow,
    of_blow=("torque", "index"),
    entries={
        "turning": ("work", "work of the rotation against the friction of the buttons"),
        "friction": ("dissipated", "friction of buttons that turn on the rock"),
    },
    needs={"effects.rock": ("bilinear", "power")},
)
