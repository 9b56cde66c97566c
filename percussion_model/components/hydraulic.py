"""Hydraulic drive: two chambers of oil, a spool valve, and an accumulator at the pump's line.

The piston is x above where it strikes. Its front chamber, which lifts it, is always on the line;
a spool connects the rear one, which pushes it down, with the line or the tank. What moves the
spool is oil at its larger end: it comes from the front chamber while the piston is above an edge,
goes to the tank while it is below another, and is locked in between. Front chamber and pilot take
the pressure of what flows through their ports at once (docs/model.md, eqs 13d to 13i).

Oil is foretold with a rigid piston for a short time, in which solvers take its mean forces; then it
is made out on the way that the bodies really went, and what was given too little is given later.
"""

from __future__ import annotations

import math

from percussion_model.components import Component
from percussion_model.physics.chambers import Way, is_past, moment_of, straight_slope
from percussion_model.physics.elementary import exp, log
from percussion_model.physics.kernel import LEAST_DIVISOR, inlined, kernel
from percussion_model.physics.oil import REFERENCE, filling_of
from percussion_model.physics.oil_chambers import (
    Oil,
    Pump,
    go,
    on_way,
    rates_of,
    size_of_rear,
    size_of_supply,
)

# Where piston and bit touch, or may, oil is foretold for this share of the usual time.
SHORTEST = 0.02
# And while the spool moves for this: oil that it locks in is stiff, and the casing recoils.
SWITCHING = 0.3
# Rate at which the piston swings on its oil, or oil in its front port slows it, times the longest
# time for which that is foretold.
SWINGS = 1.5
# In a solver's step that is longer by this a force is held: most tries for it, and how near.
LONG, MOST_TRIES, SETTLED = 2.0, 40, 1e-4
# A way foretold to this is the real one but for the work of the difference [m].
NEAR = 1e-5
# Nothing has been done yet.
NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
# Piston and bit meet no faster than this, or than the piston with a bit that bounces [m/s].
FASTEST, BOUNCE = 10.0, 3.0


@inlined
def filled(par, pump, x):
    """Oil before a first blow: the line at the limit of the pump, the rear chamber at the tank."""
    bulk, air = par.hydraulic_bulk_modulus, par.hydraulic_air
    line, tank = REFERENCE + pump.limit, REFERENCE + par.hydraulic_tank_pressure
    pressed = min(par.hydraulic_precharge / line, 1.0)
    gas = par.hydraulic_gas_volume * exp(log(pressed) / par.hydraulic_gas_exponent)
    rear = filling_of(tank, size_of_rear(par, x), bulk, air)
    supply = filling_of(line, size_of_supply(par, x), bulk, air)
    return Oil(x, 0.0, 0.0, 0.0, rear, supply, 0.0, gas, *NOTHING)


@inlined
def pump_of(s):
    """The pump as it is set."""
    return Pump(s.hydraulic_flow, s.hydraulic_supply_pressure)


@inlined
def present_oil(s, x, v):
    """Oil as a state has it."""
    return Oil(
        x, v, s.hydraulic_spool, s.hydraulic_spool_speed, s.hydraulic_filling_r,
        s.hydraulic_filling_s, s.hydraulic_neck, s.hydraulic_gas, *NOTHING,
    )  # fmt: skip


@inlined
def keep_oil(par, s, oil):
    """Put oil into the state, with what it has done."""
    s.hydraulic_spool, s.hydraulic_spool_speed = oil.spool, oil.speed
    s.hydraulic_filling_r, s.hydraulic_filling_s = oil.rear, oil.supply
    s.hydraulic_neck, s.hydraulic_gas = oil.neck, oil.gas
    seen = rates_of(par, pump_of(s), oil)
    s.hydraulic_rear_pressure, s.hydraulic_front_pressure = seen.pressure, seen.front
    s.hydraulic_line_pressure, s.hydraulic_swings = seen.line, seen.swings
    s.hydraulic_used += oil.used
    s.hydraulic_pump_work += oil.given
    s.hydraulic_oil_work += oil.work
    s.hydraulic_void += oil.void
    s.hydraulic_empty += oil.empty


@inlined
def foretold(s):
    """What was foretold for the end of the time."""
    return Oil(
        s.hydraulic_then_x, s.hydraulic_then_v, s.hydraulic_then_spool, s.hydraulic_then_speed,
        s.hydraulic_then_r, s.hydraulic_then_s, s.hydraulic_then_neck, s.hydraulic_then_gas,
        s.hydraulic_then_impulse, s.hydraulic_then_work, s.hydraulic_then_used,
        s.hydraulic_then_given, s.hydraulic_then_void, s.hydraulic_then_empty,
    )  # fmt: skip


@inlined
def note_foretold(s, then):
    """Keep what is foretold."""
    s.hydraulic_then_x, s.hydraulic_then_v = then.x, then.v
    s.hydraulic_then_spool, s.hydraulic_then_speed = then.spool, then.speed
    s.hydraulic_then_r, s.hydraulic_then_s = then.rear, then.supply
    s.hydraulic_then_neck, s.hydraulic_then_gas = then.neck, then.gas
    s.hydraulic_then_impulse, s.hydraulic_then_work = then.impulse, then.work
    s.hydraulic_then_used, s.hydraulic_then_given = then.used, then.given
    s.hydraulic_then_void, s.hydraulic_then_empty = then.void, then.empty


@kernel
def settle(par, s):
    """Make out the oil on the way that was gone since it was foretold.

    The casing, or a bit that rings, has a mean velocity by its way, in which the piston's own
    moves on.
    """
    h, x, before, v_p = s.hydraulic_since, -s.u_r, s.hydraulic_from_x, s.hydraulic_last_v
    casing = (x - before + s.path_p - s.hydraulic_from_path) / h
    then, off = foretold(s), 0.0
    way = Way(True, before, casing - s.hydraulic_from_v, x, casing - v_p, h, 0.0)
    if abs(h - s.hydraulic_span) < 1e-9 * h and abs(x - then.x) < NEAR:
        off = x - then.x
        then = on_way(way, then, h, then.rear, then.supply)
    else:
        then = go(par, pump_of(s), present_oil(s, before, way.v), way)
    keep_oil(par, s, then)
    # the bodies part from what was foretold as t^2: the mean of F by t, which moments tell
    s.hydraulic_oil_work -= (then.impulse / h + s.hydraulic_slope * h / 6.0) * off
    s.hydraulic_oil_work += casing * then.impulse
    s.hydraulic_owed += then.impulse - s.hydraulic_pushed
    s.hydraulic_pushed = 0.0
    s.hydraulic_held_work = s.hydraulic_pushed_work
    # over a short time it may be that of ringing alone
    share = 1.0 if s.hydraulic_touched == 1.0 else min(h / par.hydraulic_step, 1.0)
    s.hydraulic_casing_velocity += share * (casing - s.hydraulic_casing_velocity)
    s.hydraulic_restless = abs(casing - s.hydraulic_casing_mean) / h
    s.hydraulic_casing_mean = casing
    s.hydraulic_pull = (v_p - s.hydraulic_from_v) / h if s.hydraulic_touched == 1.0 else 0.0
    s.hydraulic_span = s.hydraulic_since = 0.0


@inlined
def held_way(x, v, a, d):
    """Way of a piston that a force held on for `d` [s] accelerates by `a` [m/s^2]."""
    return Way(True, x, v, x + d * (v + 0.5 * a * d), v + a * d, d, 0.0)


@kernel
def under_held_force(par, s, x, v, d, others):
    """Oil over a step of a solver in which the piston would swing by more than `LONG`.

    The mean force is held on, and is that of the oil on the way which it makes: so the step is
    stable, however stiff the oil. By how much an acceleration is too great rises with it by one or
    more: that brackets the right one, which regula falsi (of Illinois) finds.

    Parameters
    ----------
    others : float
        Acceleration, down, that all else gives the piston [m/s^2].
    """
    now, pump, per = present_oil(s, x, v), pump_of(s), 1.0 / (par.mass_p * d)
    then = go(par, pump, now, held_way(x, v, 0.0, d))
    one, off_one = 0.0, (then.impulse + s.hydraulic_owed) * per + others
    a, enough = -off_one, SETTLED * abs(off_one)
    other, off_other = a, 0.0
    for k in range(MOST_TRIES):
        then = go(par, pump, now, held_way(x, v, a, d))
        off = a + (then.impulse + s.hydraulic_owed) * per + others
        if abs(off) <= enough or off == off_one:
            break
        if k > 0 and off * off_other < 0.0:
            one, off_one = other, off_other
        elif k > 0:
            off_one *= 0.5
        other, off_other = a, off
        a -= off * (a - one) / (off - off_one)
    return then


@kernel
def foretell(par, s, span):
    """Foretell the oil, and the force that it will have."""
    x, v, d = -s.u_r, s.hydraulic_casing_velocity - s.v_p, span
    others = par.gravity
    if s.closed == 1 and s.hydraulic_touched == 1.0:  # and what the bit has given of late
        others = s.hydraulic_pull - s.hydraulic_base / par.mass_p
    s.hydraulic_from_x, s.hydraulic_from_v = x, s.v_p
    s.hydraulic_touched = s.closed
    s.hydraulic_from_path = s.hydraulic_last_path = s.path_p
    # a piston that touches the bit goes on as it has gone
    bend = -s.hydraulic_pull if s.closed == 1 else 0.0
    way = Way(s.closed == 1, x, v, x + d * (v + 0.5 * bend * d), v + bend * d, d, 0.0)
    is_long = s.hydraulic_swings * d * d > LONG * LONG
    if is_long:
        then = under_held_force(par, s, x, v, d, others)
    else:
        then = go(par, pump_of(s), present_oil(s, x, v), way)
    s.hydraulic_span, s.hydraulic_since = span, 0.0
    note_foretold(s, then)
    s.hydraulic_then_v = s.hydraulic_casing_velocity - then.v
    # a force that goes straight with the impulse and the way of the one foretold
    slope = 0.0
    if s.closed == 0 and not is_long:
        moment = moment_of(par, then.impulse, then.x - x - d * v, d)
        slope = straight_slope(then.impulse, moment, d)
    s.hydraulic_slope = slope
    s.hydraulic_base = (then.impulse + s.hydraulic_owed) / d - 0.5 * slope * d


@inlined
def is_over(s):
    """Whether what was foretold is to be made out."""
    since, span = s.hydraulic_since, s.hydraulic_span
    from_v, then_v = s.hydraulic_from_v, s.hydraulic_then_v
    return is_past(s, since, span, s.hydraulic_touched, from_v, then_v)


@inlined
def lasts(par, s):
    """Time for which mean forces may be held [s]: up to where piston and bit may meet."""
    if not is_over(s):
        return s.hydraulic_span - s.hydraulic_since
    shortest, longest = SHORTEST * par.hydraulic_step, par.hydraulic_step
    if 0.0 < s.hydraulic_spool < par.hydraulic_spool_stroke:
        longest *= SWITCHING
    meet = s.gap / max(s.v_p + BOUNCE, FASTEST)
    # a bit that bounces leaves a steady way
    longest = min(longest, math.sqrt(2.0 * NEAR / max(s.hydraulic_restless, LEAST_DIVISOR)))
    longest = min(longest, SWINGS / math.sqrt(max(s.hydraulic_swings, LEAST_DIVISOR)))
    return shortest if s.closed == 1 else max(min(meet, longest), shortest)


@kernel
def renew(par, s, h):
    """Foretell the oil where that is needed, for no less than a time."""
    if not is_over(s):
        return
    if s.hydraulic_filling_s == 0.0:
        keep_oil(par, s, filled(par, pump_of(s), -s.u_r))
    elif s.hydraulic_since > 0.0:
        settle(par, s)
    # what is asked for less is held on in steps, at whose end the time is over
    foretell(par, s, max(math.floor(lasts(par, s) / h), 1.0) * h)


@inlined
def on_piston(par, s, h):
    """Mean force on the piston over the next h [N]."""
    renew(par, s, h)
    return s.hydraulic_base + s.hydraulic_slope * (s.hydraulic_since + 0.5 * h)


@inlined
def pass_time(par, s, h):
    """Note what was given for h."""
    s.hydraulic_pushed += s.f_hydraulic_piston * h
    s.hydraulic_pushed_work += s.f_hydraulic_piston * (s.path_p - s.hydraulic_last_path)
    s.hydraulic_last_path, s.hydraulic_last_v = s.path_p, s.v_p
    s.hydraulic_since += h
    if -s.u_r > par.hydraulic_pilot_supply_edge:
        s.armed = 1


@inlined
def slope(par, s):
    """How fast the force on the piston changes [N/s]."""
    return s.hydraulic_slope


@inlined
def next_blow(par, s, period, kept, rest, push, climb):
    """Oil of the blow that has ended, and its mean pressure."""
    used = s.hydraulic_used - s.hydraulic_used_before
    given = s.hydraulic_pump_work - s.hydraulic_work_before
    s.hydraulic_oil = used / max(period, LEAST_DIVISOR)
    s.hydraulic_pressure = given / max(used, LEAST_DIVISOR)
    s.hydraulic_used_before = s.hydraulic_used
    s.hydraulic_work_before = s.hydraulic_pump_work


_AREA, _PORT, _SIZE, _PLACE = (1e-6, 1.0), (1e-7, 0.1), (1e-7, 1.0), (0.0, 1.0)

COMPONENT = Component(
    "hydraulic",
    "two chambers of oil with a spool valve and an accumulator, as of a top hammer",
    {
        "flow": (1.083e-3, "m^3/s", "what the pump gives", 0.0, 1.0),
        "supply_pressure": (150e5, "Pa", "pressure from which on a valve lets oil of the pump "
                            "out, above that of the surroundings", 0.0, 1e8),
        "tank_pressure": (2e5, "Pa", "pressure of the tank's line, above that of the "
                          "surroundings", 0.0, 1e7),
        "front_area": (4.54e-4, "m^2", "A_f: area of the piston in the front chamber", *_AREA),
        "rear_area": (7.94e-4, "m^2", "A_r: the same in the rear chamber", *_AREA),
        "rear_volume": (38.3e-6, "m^3", "rear chamber with the piston where it strikes", *_SIZE),
        "supply_volume": (0.4e-3, "m^3", "volume of the pump's line and the front chamber",
                          1e-6, 1.0),
        "front_port": (123e-6, "m^2", "area between line and front chamber", *_PORT),
        "pilot_supply_edge": (15.6e-3, "m", "x_1: the spool's larger end is open to the front "
                              "chamber above this distance of piston and bit", *_PLACE),
        "pilot_tank_edge": (8.4e-3, "m", "x_2: it is open to the tank below it", *_PLACE),
        "pilot_port": (40e-6, "m^2", "area of an open port of the pilot; 0: the spool is stuck",
                       0.0, 0.1),
        "ramp": (1e-3, "m", "way over which it opens", 1e-6, 0.1),
        "spool_mass": (0.12, "kg", "mass of the spool", 1e-4, 1e3),
        "spool_stroke": (5e-3, "m", "way of the spool between its stops", 1e-5, 0.1),
        "spool_small": (0.7e-4, "m^2", "area of the spool's end on the line", *_AREA),
        "spool_large": (1.4e-4, "m^2", "area of its larger end", *_AREA),
        "valve_width": (70e-3, "m", "length of the edges that the spool opens", 1e-6, 10.0),
        "valve_lap": (0.0, "m", "way of the spool to either side of its middle in which it "
                      "closes both ports", 0.0, 0.1),
        "leak": (1.36e-12, "m^3/s/Pa", "leakage of the line to the tank, per difference of "
                 "their pressures; the same of the rear chamber", 0.0, 1e-6),
        "gas_volume": (0.2e-3, "m^3", "gas of the accumulator without oil", 1e-6, 1.0),
        "precharge": (60e5, "Pa", "its pressure then, absolute", 1e3, 1e8),
        "gas_exponent": (1.4, "-", "polytropic exponent of the gas", 1.0, 2.0),
        "neck_length": (0.03, "m", "length of the accumulator's neck", 1e-3, 10.0),
        "neck_area": (8e-4, "m^2", "area of the neck", *_AREA),
        "discharge": (0.7, "-", "C_d: discharge coefficient of all areas", 0.01, 1.0),
        "density": (870.0, "kg/m^3", "of the oil", 100.0, 5e3),
        "bulk_modulus": (1.4e9, "Pa", "B: of the oil without air", 1e7, 1e11),
        "air": (0.003, "-", "share of air in the oil at the pressure of the surroundings",
                0.0, 0.5),
        "vapour_pressure": (3e3, "Pa", "pressure of the oil's vapour, absolute", 1.0, 1e5),
        "straight": (5e4, "Pa", "difference of pressures below which flow through an orifice "
                     "grows straight with it", 1e2, 1e7),
        "step": (1.5e-4, "s", "time for which the oil is predicted; shorter is more accurate",
                 1e-6, 1e-3),
    },
    on_piston=on_piston,
    is_drive=True,
    lasts=lasts,
    slope=slope,
    state={
        "rear_pressure": ("Pa", "pressure of the rear chamber, absolute", 0.0),
        "front_pressure": ("Pa", "pressure of the front chamber, absolute", 0.0),
        "line_pressure": ("Pa", "pressure of the pump's line, absolute", 0.0),
        "spool": ("m", "how far the spool has gone towards the line", 0.0),
        "gas": ("m^3", "volume of the accumulator's gas", 0.0),
        "oil": ("m^3/s", "oil that the last blow took from the pump, divided by its period", 0.0),
        "pressure": ("Pa", "mean pressure at which the pump gave it, above that of the "
                     "surroundings", 0.0),
        "used": ("m^3", "oil from the pump since the start", 0.0),
        "pump_work": ("J", "work of the pump since the start", 0.0),
        "void": ("s", "time in which the rear chamber was below the pressure around it", 0.0),
        "empty": ("s", "time in which the accumulator held no oil", 0.0),
        "oil_work": ("J", "work of the oil on the piston, by the oil", 0.0),
        "held_work": ("J", "the same by the forces that solvers took", 0.0),
    },
    hidden=(
        "spool_speed", "filling_r", "filling_s", "neck",
        *(f"then_{name}" for name in ("x", "v", "spool", "speed", "r", "s", "neck", "gas",
                                      "impulse", "work", "used", "given", "void", "empty")),
        "from_x", "from_v", "casing_velocity", "casing_mean", "restless", "touched", "span",
        "since", "base", "slope", "pushed", "pushed_work", "owed", "pull", "from_path",
        "last_path", "last_v", "used_before", "work_before", "swings",
    ),
    pass_time=pass_time,
    usual={"supply_pressure": (80e5, 250e5)},
    inputs=("flow", "supply_pressure"),
    next_blow=next_blow,
    of_blow=("oil", "pressure"),
)  # fmt: skip
