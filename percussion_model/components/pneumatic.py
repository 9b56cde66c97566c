"""Pneumatic drive: two chambers and an exhaust volume, with ports that the piston opens.

The piston is x above the bit. Between its lower face and the bit is the lower chamber, above it
the upper one; each fills from the supply and empties into the exhaust volume, from which flushing
holes lead to the hole (docs/model.md, eqs 13a to 13c). The force

    F = p_u A_u - p_l A_l - p_b (A_u - A_l) + friction

pushes the piston down, and the gas of the lower chamber stands on the bit. What the gas will do is
foretold with a rigid piston for a short time, in which solvers take its mean forces; then it is
made out on the way that the bodies really went, and what was given too little is given later.
"""

from __future__ import annotations

import math

from percussion_model.components import Component
from percussion_model.physics.chambers import (
    Ahead,
    Done,
    Gas,
    Way,
    go,
    is_past,
    moment_of,
    size_of_lower,
    size_of_upper,
    started,
    straight_slope,
)
from percussion_model.physics.feed import throttle
from percussion_model.physics.gas import AIR, RATIO
from percussion_model.physics.kernel import LEAST_DIVISOR, inlined, kernel

# Where piston and bit touch, or may, gas is foretold for this share of the usual time.
SHORTEST = 0.1
# In flight for so many times that, in steps of it.
LONGEST = 2.0
# No volume is empty at the start [Pa].
LEAST_PRESSURE = 100.0
# A way foretold to this is the real one but for the work of the difference [m].
NEAR = 1e-4
# A bit that goes elsewhere than was foretold makes times shorter, by how far times the time [m s].
OFF, AGAIN = 1.5e-8, 0.2
# Steps of the bit's load, which make it ring, are below this share of the full pressure's.
STEADY = 0.07
# Over less than this share of a step a velocity of the bit may be that of ringing alone.
RINGS = 0.3
# A bit that bounces comes to the piston no faster than this [m/s].
BOUNCE = 5.0
# `Mode.FF`, which follows from the components.
FREE = 0


@inlined
def present_gas(s):
    """Gas as a state has it."""
    return Gas(
        s.pneumatic_mass_u,
        s.pneumatic_energy_u,
        s.pneumatic_mass_l,
        s.pneumatic_energy_l,
        s.pneumatic_mass_x,
        s.pneumatic_energy_x,
    )


@inlined
def note_pressures(par, s, share):
    """Note pressures at a share of the time foretold, in which energies go straight."""
    x, rest, size_x = -s.u_r, 1.0 - share, par.pneumatic_exhaust_volume
    size_u, size_l = size_of_upper(par, x), size_of_lower(par, x)
    each = (RATIO - 1.0) / (size_u * size_l * size_x)
    energy_u = rest * s.pneumatic_energy_u + share * s.pneumatic_then_energy_u
    energy_l = rest * s.pneumatic_energy_l + share * s.pneumatic_then_energy_l
    energy_x = rest * s.pneumatic_energy_x + share * s.pneumatic_then_energy_x
    s.pneumatic_upper_pressure = each * size_l * size_x * energy_u
    s.pneumatic_lower_pressure = each * size_u * size_x * energy_l
    s.pneumatic_exhaust_pressure = each * size_u * size_l * energy_x


@inlined
def keep_gas(par, s, gas):
    """Put gas into the state."""
    s.pneumatic_mass_u, s.pneumatic_energy_u = gas.mass_u, gas.energy_u
    s.pneumatic_mass_l, s.pneumatic_energy_l = gas.mass_l, gas.energy_l
    s.pneumatic_mass_x, s.pneumatic_energy_x = gas.mass_x, gas.energy_x
    s.pneumatic_gas_mass = gas.mass_u + gas.mass_l + gas.mass_x
    s.pneumatic_gas_energy = gas.energy_u + gas.energy_l + gas.energy_x
    note_pressures(par, s, 0.0)


@inlined
def set_pressure(par, s):
    """Pressure at which the supply is held where it can be [Pa]."""
    return s.pneumatic_supply_pressure + par.pneumatic_ambient_pressure


@inlined
def at_hammer(par, s):
    """Pressure that chambers fill from: less than the supply's where the casing lifts off [Pa]."""
    share, ambient = throttle(par, s), par.pneumatic_ambient_pressure
    if share == 1.0:
        return s.pneumatic_supply
    return ambient + share * (s.pneumatic_supply - ambient)


@inlined
def outside(par, s):
    """Pressure behind the flushing holes [Pa]."""
    return par.pneumatic_ambient_pressure + s.pneumatic_back_pressure


@inlined
def open_air(par, hole, x):
    """Gas of the surroundings in all volumes, as before a first blow."""
    pressure = max(hole, LEAST_PRESSURE)
    m, e = pressure / (AIR * par.pneumatic_ambient_temperature), pressure / (RATIO - 1.0)
    u, low, behind = size_of_upper(par, x), size_of_lower(par, x), par.pneumatic_exhaust_volume
    return Gas(m * u, e * u, m * low, e * low, m * behind, e * behind)


@inlined
def feed_supply(par, s, used, h):
    """Take air from the supply, and let the compressor give as much as it may."""
    if par.pneumatic_supply_volume == 0.0 or s.pneumatic_supply_flow == 0.0:
        s.pneumatic_supply = set_pressure(par, s)
        return
    by_mass = AIR * par.pneumatic_supply_temperature / par.pneumatic_supply_volume
    s.pneumatic_supply -= by_mass * used
    wanted = max(set_pressure(par, s) - s.pneumatic_supply, 0.0)
    s.pneumatic_supply += min(wanted, by_mass * s.pneumatic_supply_flow * h)


@inlined
def corrected(par, s, then, before, x):
    """What was foretold, with the work that a way which is not quite as foretold makes of it."""
    gas, off = then.gas, x - then.x
    per_u, per_l = 1.0 / size_of_upper(par, then.x), 1.0 / size_of_lower(par, then.x)
    p_u, p_l = (RATIO - 1.0) * gas.energy_u * per_u, (RATIO - 1.0) * gas.energy_l * per_l
    # forces go straight on with the way, off by a part that grows in time
    by_u = RATIO * p_u * par.pneumatic_upper_area**2 * per_u * off
    by_l = RATIO * p_l * par.pneumatic_lower_area**2 * per_l * off
    up = (p_u * par.pneumatic_upper_area + 0.5 * by_u) * off
    down = (p_l * par.pneumatic_lower_area - 0.5 * by_l) * off
    given = down if then.x >= 0.0 and x >= 0.0 else 0.0
    half = 0.5 * s.pneumatic_span
    gas = Gas(
        gas.mass_u, gas.energy_u + up, gas.mass_l, gas.energy_l - given, gas.mass_x, gas.energy_x
    )
    mean, by = then.done.impulse / s.pneumatic_span, by_u + by_l
    force = mean * off + 0.5 * by * (x - before)
    done = then.done
    done = Done(
        done.used,
        done.vented,
        done.brought,
        done.expanded + given - up,
        done.impulse + half * (by_u + by_l),
        done.on_bit - half * by_l,
        done.work - force,
    )
    return Ahead(gas, x, then.v, done, then.rate)


@inlined
def foretold(s):
    """What was foretold for the end of the time."""
    gas = Gas(
        s.pneumatic_then_mass_u,
        s.pneumatic_then_energy_u,
        s.pneumatic_then_mass_l,
        s.pneumatic_then_energy_l,
        s.pneumatic_then_mass_x,
        s.pneumatic_then_energy_x,
    )
    done = Done(
        s.pneumatic_then_used,
        s.pneumatic_then_vented,
        s.pneumatic_then_brought,
        s.pneumatic_then_expanded,
        s.pneumatic_then_impulse,
        s.pneumatic_then_on_bit,
        s.pneumatic_then_work,
    )
    return Ahead(gas, s.pneumatic_then_x, s.pneumatic_then_v, done, 0.0)


@inlined
def summed(total, more):
    """Sum, and what of it rounding loses: an hour of drilling adds up 1e7 small numbers."""
    new = total + more
    return new, more - (new - total)


@inlined
def turns_by(v):
    """Time in which a bit that meets the rock at a velocity goes elsewhere by too much [s]."""
    return math.sqrt(OFF / max(2.0 * abs(v), LEAST_DIVISOR))


@inlined
def note_bit(par, s, h, mean):
    """Note how the bit has gone for a time, by which it is foretold: of mean velocity, if it rings.

    One that flies falls evenly. One that has met the rock turns round, or not.
    """
    gained = s.v_b - s.pneumatic_from_b
    gained_p = s.v_p - s.pneumatic_from_v
    s.pneumatic_pull = (gained - gained_p) / h if s.pneumatic_touched == 1.0 else 0.0
    share = min(h / (RINGS * par.pneumatic_step), 1.0)
    s.pneumatic_bit_velocity += share * (mean - s.pneumatic_bit_velocity)
    if s.pneumatic_flew == 0.0:
        return
    s.pneumatic_bit_velocity = s.v_b
    if s.i_contact != s.pneumatic_from_contact:
        return  # the piston has struck it
    if s.mode == FREE:
        s.pneumatic_fall = gained / h
    else:
        s.pneumatic_reach = turns_by(s.pneumatic_from_b + s.pneumatic_fall * h)


@kernel
def settle(par, s):
    """Make out the gas on the way that was gone since it was foretold.

    A bit that rings has a mean velocity by its way, in which the piston's own moves on. The
    piston's last is that before it met something.
    """
    h, x, before, v_p = s.pneumatic_since, -s.u_r, s.pneumatic_from_x, s.pneumatic_last_v
    bit = (x - before + s.path_p - s.pneumatic_from_path) / h
    then = foretold(s)
    far = max(abs(x - then.x) * h, LEAST_DIVISOR)
    steady = STEADY * par.pneumatic_lower_area * set_pressure(par, s)
    steady /= max(abs(s.pneumatic_load_change), LEAST_DIVISOR)
    s.pneumatic_reach = h * min(math.sqrt(OFF / far), steady, 2.0) if s.closed == 0 else 0.0
    if abs(h - s.pneumatic_span) < 1e-9 * h and abs(x - then.x) < NEAR:
        then = corrected(par, s, then, before, x)
    else:
        way = Way(True, before, bit - s.pneumatic_from_v, x, bit - v_p, h, 0.0)
        then = go(
            par, at_hammer(par, s), outside(par, s), started(present_gas(s), before, 0.0), way
        )
    keep_gas(par, s, then.gas)
    done = then.done
    feed_supply(par, s, done.used, h)
    s.pneumatic_owed += done.impulse - s.pneumatic_given
    s.pneumatic_owed_bit += done.on_bit - s.pneumatic_given_bit
    s.pneumatic_given = s.pneumatic_given_bit = 0.0
    s.pneumatic_consumed, s.pneumatic_rest_used = summed(
        s.pneumatic_consumed, s.pneumatic_rest_used + done.used
    )
    s.pneumatic_vented, s.pneumatic_rest_vented = summed(
        s.pneumatic_vented, s.pneumatic_rest_vented + done.vented
    )
    s.pneumatic_brought, s.pneumatic_rest_brought = summed(
        s.pneumatic_brought, s.pneumatic_rest_brought + done.brought
    )
    s.pneumatic_expanded, s.pneumatic_rest_expanded = summed(
        s.pneumatic_expanded, s.pneumatic_rest_expanded + done.expanded
    )
    s.pneumatic_gas_work += done.work + bit * done.impulse
    s.pneumatic_held_work = s.pneumatic_given_work
    note_bit(par, s, h, bit)
    s.pneumatic_span = s.pneumatic_since = 0.0


@kernel
def foretell(par, s, span):
    """Foretell the gas, and the forces that it will have."""
    flies = s.closed == 0 and s.mode == FREE
    fall, s.pneumatic_flew = 0.0, 0.0
    if flies:
        fall, s.pneumatic_flew, s.pneumatic_bit_velocity = s.pneumatic_fall, 1.0, s.v_b
    x, v, d = -s.u_r, s.pneumatic_bit_velocity - s.v_p, span
    s.pneumatic_from_x, s.pneumatic_from_v, s.pneumatic_from_b = x, s.v_p, s.v_b
    s.pneumatic_touched, s.pneumatic_from_contact = s.closed, s.i_contact
    s.pneumatic_from_path = s.pneumatic_last_path = s.path_p
    y = started(present_gas(s), x, v)
    # a piston that touches the bit goes on as it has gone
    u, pull = s.v_b - s.v_p, s.pneumatic_pull if s.closed == 1 else 0.0
    way = Way(s.closed == 1, x, u, x + d * (u + 0.5 * pull * d), u + pull * d, d, fall)
    then = go(par, at_hammer(par, s), outside(par, s), y, way)
    s.pneumatic_span, s.pneumatic_since = span, 0.0
    s.pneumatic_then_mass_u, s.pneumatic_then_energy_u = then.gas.mass_u, then.gas.energy_u
    s.pneumatic_then_mass_l, s.pneumatic_then_energy_l = then.gas.mass_l, then.gas.energy_l
    s.pneumatic_then_mass_x, s.pneumatic_then_energy_x = then.gas.mass_x, then.gas.energy_x
    s.pneumatic_then_x, s.pneumatic_then_v = then.x, s.pneumatic_bit_velocity - then.v
    done = then.done
    beyond = then.x - x - d * v - 0.5 * d * d * fall
    moment = moment_of(par, done.impulse, beyond, d)
    s.pneumatic_then_used, s.pneumatic_then_vented = done.used, done.vented
    s.pneumatic_then_brought, s.pneumatic_then_expanded = done.brought, done.expanded
    s.pneumatic_then_impulse, s.pneumatic_then_on_bit = done.impulse, done.on_bit
    # of a bit that goes by its mean velocity, as `settle` takes it
    s.pneumatic_then_work = done.work + fall * (moment - 0.5 * d * done.impulse)
    # a force that goes straight with the impulse and the way of the one foretold
    impulse, slope = done.impulse, 0.0
    if s.closed == 0:
        slope = straight_slope(impulse, moment, d)
    s.pneumatic_slope = slope
    s.pneumatic_base = (impulse + s.pneumatic_owed) / d - 0.5 * slope * d
    on_bit = (done.on_bit + s.pneumatic_owed_bit) / d
    s.pneumatic_load_change = on_bit - s.pneumatic_mean_on_bit
    s.pneumatic_mean_on_bit = on_bit


@inlined
def is_over(s):
    """Whether what was foretold is to be made out."""
    since, span = s.pneumatic_since, s.pneumatic_span
    from_v, then_v = s.pneumatic_from_v, s.pneumatic_then_v
    return is_past(s, since, span, s.pneumatic_touched, from_v, then_v)


@inlined
def lasts(par, s):
    """Time for which mean forces may be held [s]: up to where piston and bit may meet."""
    if not is_over(s):
        return s.pneumatic_span - s.pneumatic_since
    if s.pneumatic_since > 0.0:
        settle(par, s)  # which tells how long
    shortest, meet = SHORTEST * par.pneumatic_step, -s.u_r / max(s.v_p - s.v_b, BOUNCE)
    if s.closed == 1:
        return shortest
    most = LONGEST * par.pneumatic_step
    if s.mode == FREE:
        room = s.p_u - s.p
        speed = s.v_b + math.sqrt(max(s.v_b * s.v_b + 2.0 * s.pneumatic_fall * room, 0.0))
        # or to where a bit that flies meets the rock
        meet = min(meet, max(2.0 * room / max(speed, LEAST_DIVISOR), turns_by(speed - s.v_b)))
    else:
        most = min(max(s.pneumatic_reach, AGAIN * par.pneumatic_step), most)
    return min(max(meet, shortest), most)


@kernel
def renew(par, s, h):
    """Foretell the gas where that is needed, for no less than a time."""
    if not is_over(s):
        return
    if s.pneumatic_mass_u == 0.0:
        keep_gas(par, s, open_air(par, outside(par, s), -s.u_r))
        s.pneumatic_supply = set_pressure(par, s)
    elif s.pneumatic_since > 0.0:
        settle(par, s)
    # what is asked for less is held on in steps, in which a bit that bounces may be anywhere
    is_whole = h >= 0.5 * SHORTEST * par.pneumatic_step
    foretell(par, s, h if is_whole else min(lasts(par, s), 0.5 * par.pneumatic_step))


@inlined
def on_piston(par, s, h):
    """Mean force on the piston over the next h [N]."""
    renew(par, s, h)
    return s.pneumatic_base + s.pneumatic_slope * (s.pneumatic_since + 0.5 * h)


@inlined
def on_bit(par, s, h):
    """Mean force on the bit over the next h [N]."""
    renew(par, s, h)
    return s.pneumatic_mean_on_bit


@inlined
def pass_time(par, s, h):
    """Note what was given for h."""
    s.pneumatic_given += s.f_pneumatic_piston * h
    s.pneumatic_given_bit += s.f_pneumatic_bit * h
    s.pneumatic_given_work += s.f_pneumatic_piston * (s.path_p - s.pneumatic_last_path)
    s.pneumatic_last_path, s.pneumatic_last_v = s.path_p, s.v_p
    s.pneumatic_since += h
    note_pressures(par, s, min(s.pneumatic_since / max(s.pneumatic_span, LEAST_DIVISOR), 1.0))
    if -s.u_r > par.pneumatic_upper_exhaust_edge:
        s.armed = 1


@inlined
def slope(par, s):
    """How fast the force on the piston changes [N/s]."""
    return s.pneumatic_slope


@inlined
def next_blow(par, s, period, kept, rest, push, climb):
    """Air of the blow that has ended."""
    used = s.pneumatic_consumed - s.pneumatic_consumed_before
    s.pneumatic_air = used / max(period, LEAST_DIVISOR)
    s.pneumatic_consumed_before = s.pneumatic_consumed


_AREA, _PORT, _PLACE = (1e-6, 1.0), (0.0, 0.1), (0.0, 10.0)

COMPONENT = Component(
    "pneumatic",
    "two chambers of air with ports that the piston opens, as of a down-the-hole hammer",
    {
        "supply_pressure": (24e5, "Pa", "pressure of the supply at the hammer, above that of the "
                            "surroundings", 0.0, 2e7),
        "supply_flow": (0.0, "kg/s", "most that the compressor gives, by mass; as m^3/min free air "
                        "of 0 C and 101,325 Pa, which is less by mass at a height; 0: as much as "
                        "is needed to hold the pressure", 0.0, 1e3),
        "supply_volume": (0.2, "m^3", "volume of the supply; 0: its pressure never falls, "
                          "whatever the compressor gives", 0.0, 1e3),
        "supply_temperature": (300.0, "K", "temperature of the supply", 100.0, 2000.0),
        "ambient_pressure": (101325.0, "Pa", "pressure of the surroundings", 0.0, 1e7),
        "ambient_temperature": (293.15, "K", "temperature of the surroundings", 100.0, 2000.0),
        "back_pressure": (0.0, "Pa", "pressure in the hole above that of the surroundings",
                          0.0, 1e8),
        "upper_area": (6.870e-3, "m^2", "A_u: area of the piston in the upper chamber", *_AREA),
        "lower_area": (6.335e-3, "m^2", "A_l: the same in the lower chamber", *_AREA),
        "upper_volume": (1.122e-3, "m^3", "upper chamber with the piston on the bit", 1e-9, 1.0),
        "lower_volume": (0.271e-3, "m^3", "lower chamber with the piston on the bit", 1e-9, 1.0),
        "exhaust_volume": (0.708e-3, "m^3", "volume between ports and flushing holes", 1e-9, 1.0),
        "upper_exhaust_edge": (20.7e-3, "m", "L_5: the upper chamber is open to the exhaust below "
                               "this distance of piston and bit", *_PLACE),
        "lower_intake_edge": (36.2e-3, "m", "L_3: the lower one to the supply below it", *_PLACE),
        "upper_intake_edge": (58.0e-3, "m", "L_4: the upper one to the supply above it", *_PLACE),
        "lower_exhaust_edge": (82.4e-3, "m", "L_2: the lower one to the exhaust above it", *_PLACE),
        "ramp": (6e-3, "m", "way over which a port opens", 1e-7, 1.0),
        "upper_exhaust": (695e-6, "m^2", "area of the open port", *_PORT),
        "lower_intake": (336e-6, "m^2", "area of the open port", *_PORT),
        "upper_intake": (569e-6, "m^2", "area of the open port", *_PORT),
        "lower_exhaust": (1907e-6, "m^2", "area of the open port", *_PORT),
        "flushing": (1658e-6, "m^2", "area of the flushing holes", *_PORT),
        "bypass": (3.2e-6, "m^2", "area from the supply to the exhaust volume", *_PORT),
        "leak": (2.419e-6, "m^2", "area of the leak beside each port, and between the chambers",
                 *_PORT),
        "discharge": (0.7, "-", "C_d: discharge coefficient of all areas", 0.0, 1.0),
        "friction": (24.19, "N", "friction of the piston", 0.0, 1e6),
        "step": (3e-4, "s", "time for which the gas is predicted; shorter is more accurate",
                 1e-7, 1e-3),
        "wall_conductance": (0.0, "W/K", "heat that passes the walls of a chamber", 0.0, 1e6),
        "wall_temperature": (293.15, "K", "temperature of the walls", 100.0, 2000.0),
    },
    on_piston=on_piston,
    on_bit=on_bit,
    is_drive=True,
    is_throttled=True,
    lasts=lasts,
    slope=slope,
    state={
        "upper_pressure": ("Pa", "pressure of the upper chamber, absolute", 0.0),
        "lower_pressure": ("Pa", "pressure of the lower chamber, absolute", 0.0),
        "exhaust_pressure": ("Pa", "pressure behind the flushing holes, absolute", 0.0),
        "supply": ("Pa", "pressure of the supply, absolute", 0.0),
        "air": ("kg/s", "air that the last blow consumed, divided by its period", 0.0),
        "consumed": ("kg", "air consumed since the start", 0.0),
        "vented": ("kg", "air that went through the flushing holes since the start", 0.0),
        "gas_mass": ("kg", "air in the three volumes", 0.0),
        "gas_energy": ("J", "internal energy of that air", 0.0),
        "brought": ("J", "energy that came with air and through walls, less what left with air",
                    0.0),
        "expanded": ("J", "work of the chambers' pressures as they grow", 0.0),
        "gas_work": ("J", "work of the gas on the piston, by the gas", 0.0),
        "held_work": ("J", "the same by the forces that solvers took", 0.0),
    },
    hidden=(
        *(f"{name}_{of}" for of in "ulx" for name in ("mass", "energy")),
        *(f"then_{name}_{of}" for of in "ulx" for name in ("mass", "energy")),
        "then_x", "then_v", "then_used", "then_vented", "then_brought", "then_expanded",
        "then_impulse", "then_on_bit", "then_work",
        "from_x", "from_v", "from_b", "from_path", "from_contact", "touched", "span", "since",
        "bit_velocity", "base", "slope", "mean_on_bit", "load_change", "pull", "given", "given_bit",
        "given_work", "owed", "owed_bit", "last_path", "last_v", "consumed_before", "reach",
        "flew", "fall",
        "rest_used", "rest_vented", "rest_brought", "rest_expanded",
    ),
    pass_time=pass_time,
    usual={"supply_pressure": (6e5, 35e5)},
    inputs=("supply_pressure", "supply_flow", "back_pressure"),
    next_blow=next_blow,
    of_blow=("air",),
)  # fmt: skip
