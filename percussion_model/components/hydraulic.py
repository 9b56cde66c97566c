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
from typing import NamedTuple

from percussion_model.components import Component
from percussion_model.physics.chambers import Way, is_past, straight_slope
from percussion_model.physics.kernel import LEAST_DIVISOR, inlined, kernel
from percussion_model.physics.oil import (
    REFERENCE,
    compliance,
    drop_for,
    filling_of,
    gas_pressure,
    orifice,
    pressure_of,
    weights_of,
)

# Steps of the oil in the time for which it is foretold.
FINE = 10.0
# Where piston and bit touch, or may, oil is foretold for this share of the usual time.
SHORTEST = 0.02
# And while the spool moves for this: oil that it locks in is stiff, and the casing recoils.
SWITCHING = 0.3
# Rate of what is left of stiffness times a step that is stable by Runge and Kutta's steps (2.78).
STABLE = 1.5
# Rate times a step below which exponentials would cancel.
LEAST_FADING = 0.02
# Where the stages of a step are, and their shares of it.
PARTS, SHARES = (0.5, 0.5, 1.0, 1.0), (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)
# Most steps of one integration.
MOST_STEPS = 20_000
# A stop of some stiffness [N/m] leaves about this share of the rear chamber.
LEAST_SHARE, STOP = 1e-2, 1e8
# A pilot port that opens has this share at once, so that no oil has to pass nothing.
SHARP = 1e-2
# A valve lets out oil of the pump from its limit on, and all of it at this much more.
BAND = 0.1
# An edge is passed in a short step, from so long before to as long after it [s].
BEFORE = 5e-8
# A way foretold to this is the real one but for the work of the difference [m].
NEAR = 1e-5
# Nothing has been done yet.
NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
# Piston and bit meet no faster than this, or than the piston with a bit that bounces [m/s].
FASTEST, BOUNCE = 10.0, 3.0


class Oil(NamedTuple):
    """Piston, spool and oil, and what they have done; or what of these changes in a second."""

    x: float  # piston above where it strikes [m]
    v: float  # its velocity, up [m/s]
    spool: float  # how far the spool has gone towards the line [m]
    speed: float  # [m/s]
    rear: float  # filling of the rear chamber [m^3]
    supply: float  # the same of line and front chamber
    neck: float  # flow into the accumulator [m^3/s]
    gas: float  # volume of its gas [m^3]
    impulse: float  # on the piston, down [N s]
    work: float  # on its motion relative to the casing [J]
    used: float  # oil from the pump [m^3]
    given: float  # work of the pump [J]
    void: float  # time in which the rear chamber was below the pressure around it [s]
    empty: float  # time in which the accumulator held no oil [s]


class Pump(NamedTuple):
    """What a pump gives."""

    flow: float  # [m^3/s]
    limit: float  # pressure from which on it gives less, above that of the surroundings [Pa]


class Rates(NamedTuple):
    """What goes on at an instant."""

    oil: Oil  # changes in a second, the line's without what goes to the rear chamber
    to_rear: float  # from the line through the valve [m^3/s]
    leaks: float  # from the rear chamber [m^3/s]
    grows: float  # how its size changes [m^3/s]
    follows: float  # how its filling follows the pressure of a line that is open to it [m^3/s]
    fades: float  # how fast it comes to that pressure [1/s]
    rate: float  # of all else, which steps must be short against [1/s]
    pressure: float  # in the rear chamber [Pa]
    front: float
    line: float


@inlined
def size_of_rear(par, x):
    """Volume of the rear chamber [m^3]."""
    most = par.hydraulic_rear_volume
    return max(most - par.hydraulic_rear_area * x, LEAST_SHARE * most)


@inlined
def size_of_supply(par, x):
    """Volume of line and front chamber [m^3]."""
    return par.hydraulic_supply_volume + par.hydraulic_front_area * max(x, 0.0)


@inlined
def pilot_port(par, way):
    """Area of a port of the pilot that the piston has passed by a way [m^2]."""
    share = min(max(way / par.hydraulic_ramp, SHARP), 1.0)
    return par.hydraulic_pilot_port * share if way > 0.0 else 0.0


@kernel
def rates_of(par, pump, y):
    """What changes in a second; the piston is free, and the casing stands still."""
    bulk, air, least = par.hydraulic_bulk_modulus, par.hydraulic_air, par.hydraulic_vapour_pressure
    straight, tank = par.hydraulic_straight, REFERENCE + par.hydraulic_tank_pressure
    wide = par.hydraulic_discharge * math.sqrt(2.0 / par.hydraulic_density)
    area_r, area_f = par.hydraulic_rear_area, par.hydraulic_front_area
    small, large = par.hydraulic_spool_small, par.hydraulic_spool_large
    mass, stroke = par.hydraulic_spool_mass, par.hydraulic_spool_stroke
    size_r, size_s = size_of_rear(par, y.x), size_of_supply(par, y.x)
    p_r = pressure_of(y.rear, size_r, bulk, air, least)
    p_s = pressure_of(y.supply, size_s, bulk, air, least)
    ease_r = compliance(p_r, y.rear, size_r, bulk, air, least)
    ease_s = compliance(p_s, y.supply, size_s, bulk, air, least)

    # pilot and front chamber
    on = pilot_port(par, y.x - par.hydraulic_pilot_supply_edge)
    off = pilot_port(par, par.hydraulic_pilot_tank_edge - y.x) if on == 0.0 else 0.0
    taken = large * y.speed if on > 0.0 else 0.0
    drop = drop_for(area_f * y.v + taken, wide * par.hydraulic_front_port, straight)
    p_f = max(p_s - drop, least)
    speed, pull, stiff = 0.0, 0.0, 0.0
    if on + off > 0.0:
        drop = drop_for(large * y.speed, wide * (on + off), straight)
        p_p = max((p_f if on > 0.0 else tank) - drop, least)
        pull = ((p_p - REFERENCE) * large - (p_s - REFERENCE) * small) / mass
        stiff = large * large / (orifice(drop, wide * (on + off), straight).slope * mass)
        out = (y.spool <= 0.0 and pull < 0.0) or (y.spool >= stroke and pull > 0.0)
        speed, pull = y.speed, 0.0 if out else pull

    # valve
    half, width = 0.5 * stroke, wide * par.hydraulic_valve_width
    way, lap = y.spool - half, par.hydraulic_valve_lap
    from_line = orifice(p_s - p_r, width * max(way - lap, 0.0), straight)
    to_tank = orifice(p_r - tank, width * max(-way - lap, 0.0), straight)
    leaks = par.hydraulic_leak * (p_r - tank)

    # pump and accumulator
    whole, inertia = par.hydraulic_gas_volume, par.hydraulic_density * par.hydraulic_neck_length
    p_g = gas_pressure(par.hydraulic_precharge, whole, y.gas, par.hydraulic_gas_exponent)
    # which sees no pulses behind it
    over = (p_g - REFERENCE) / max(pump.limit, LEAST_DIVISOR) - 1.0
    given = pump.flow * min(max(1.0 - over / BAND, 0.0), 1.0)
    loss = drop_for(y.neck, wide * par.hydraulic_neck_area, straight)
    neck, rise = y.neck, par.hydraulic_neck_area / inertia * (p_s - p_g - loss)
    is_empty = y.gas >= whole
    if is_empty and neck <= 0.0:
        neck, rise = 0.0, max(rise, 0.0)
    supply = given - par.hydraulic_leak * (p_s - tank) - neck - taken + small * speed

    # piston
    force = (p_r - REFERENCE) * area_r - (p_f - REFERENCE) * area_f
    room = (1.0 - LEAST_SHARE) * par.hydraulic_rear_volume / area_r - y.x
    force += STOP * max(-room, 0.0)
    swings = (area_r * area_r / ease_r + area_f * area_f / ease_s) / par.mass_p
    swings = math.sqrt(max(swings, par.hydraulic_neck_area / (inertia * ease_s)))
    follows = 0.0
    if from_line.slope > 0.0:
        follows = (supply - from_line.flow - area_f * y.v) * ease_r / ease_s
    return Rates(
        Oil(
            y.v, -force / par.mass_p - par.gravity, speed, pull,
            from_line.flow - to_tank.flow - leaks, supply, rise, -neck,
            force, -force * y.v, given, given * (p_s - REFERENCE),
            1.0 if p_r < REFERENCE else 0.0, 1.0 if is_empty else 0.0,
        ),
        from_line.flow,
        leaks,
        -area_r * y.v if room > 0.0 else 0.0,
        follows,
        (from_line.slope + to_tank.slope + par.hydraulic_leak) / ease_r + from_line.slope / ease_s,
        max(stiff, swings), p_r, p_f, p_s,
    )  # fmt: skip


@inlined
def plus(y, change, h):
    """What `y` is after a time at a rate."""
    return Oil(
        y.x + h * change.x, y.v + h * change.v,
        y.spool + h * change.spool, y.speed + h * change.speed,
        y.rear + h * change.rear, y.supply + h * change.supply,
        y.neck + h * change.neck, y.gas + h * change.gas,
        y.impulse + h * change.impulse, y.work + h * change.work,
        y.used + h * change.used, y.given + h * change.given,
        y.void + h * change.void, y.empty + h * change.empty,
    )  # fmt: skip


@inlined
def on_way(way, y, t, rear, supply):
    """The same oil, with these fillings and the piston where the way has it after a time."""
    x, v = y.x, y.v
    if way.known:
        d, q = way.span, t / way.span
        bend = 3.0 * (way.then_x - way.x) - d * (2.0 * way.v + way.then_v)
        turn = 2.0 * (way.x - way.then_x) + d * (way.v + way.then_v)
        x = way.x + q * (d * way.v + q * (bend + q * turn))
        v = way.v + q * (2.0 * bend + 3.0 * q * turn) / d
    return Oil(
        x, v, y.spool, y.speed, rear, supply, y.neck, y.gas,
        y.impulse, y.work, y.used, y.given, y.void, y.empty,
    )  # fmt: skip


@inlined
def until(way, speed):
    """Time until a way is covered [s]; infinite for one that lies behind."""
    return way / speed if way * speed > 0.0 else math.inf


@kernel
def next_edge(par, y, pull):
    """Time until piston or spool pass an edge, or the spool its stop [s]."""
    on, off = par.hydraulic_pilot_supply_edge - y.x, par.hydraulic_pilot_tank_edge - y.x
    ramp, lap = par.hydraulic_ramp, par.hydraulic_valve_lap
    stroke = par.hydraulic_spool_stroke
    way = 0.5 * stroke - y.spool
    first = min(until(on, y.v), until(on + ramp, y.v), until(off, y.v), until(off - ramp, y.v))
    first = min(first, until(way + lap, y.speed), until(way - lap, y.speed))
    # the stop to which it goes, by v t + a t^2/2
    sign = 1.0 if y.speed > 0.0 or (y.speed == 0.0 and pull > 0.0) else -1.0
    room = stroke - y.spool if sign > 0.0 else y.spool
    square = y.speed * y.speed + 2.0 * sign * pull * room
    if room <= 0.0 or square <= 0.0:
        return first
    return min(first, 2.0 * room / (sign * y.speed + math.sqrt(square)))


@inlined
def stopped(par, y):
    """The same with the spool between its stops, and no more gas than the accumulator holds."""
    stroke, whole = par.hydraulic_spool_stroke, par.hydraulic_gas_volume
    spool, speed = min(max(y.spool, 0.0), stroke), y.speed
    if (spool == 0.0 and speed < 0.0) or (spool == stroke and speed > 0.0):
        speed = 0.0
    neck = max(y.neck, 0.0) if y.gas >= whole else y.neck
    return Oil(
        y.x, y.v, spool, speed, y.rear, y.supply, neck, min(y.gas, whole),
        y.impulse, y.work, y.used, y.given, y.void, y.empty,
    )  # fmt: skip


@inlined
def length_of_step(par, y, rate, left):
    """Length of the next step within what is left [s]."""
    longest = min(par.hydraulic_step / FINE, STABLE / rate.rate)
    edge = next_edge(par, y, rate.oil.speed)
    if edge < min(left, longest):
        return edge - BEFORE if edge > 2.0 * BEFORE else min(3.0 * BEFORE, left)
    return left / max(math.ceil(left / longest - 1e-9), 1)


@kernel
def go(par, pump, y, way):
    """Integrate over a way, or with a piston that flies: steps of fourth order.

    An open valve lets the rear chamber follow the line, or the tank, within a microsecond: what
    its filling is beside that which follows fades by exponentials (docs/model.md, eq. 13j).
    """
    t, left = 0.0, way.span
    for _ in range(MOST_STEPS):
        here, end, h = y, y, 0.0
        weight, opens, follows, fades = weights_of(-1.0, 1.0), False, 0.0, 0.0
        off = first = more = through = 0.0
        size = size_of_rear(par, y.x)
        share = y.rear / size
        for stage in range(4):
            rate = rates_of(par, pump, here)
            if stage == 0:
                h = length_of_step(par, y, rate, left)
                fades = max(rate.fades, LEAST_FADING / h)
                weight, follows = weights_of(-fades * h, h), rate.follows
                opens = rate.to_rear != 0.0
            beside = rate.oil.rear - share * rate.grows - follows + fades * off
            if stage == 0:
                first, off = beside, weight.half * beside
                more += weight.first * beside
            elif stage == 3:
                more += weight.last * beside
            else:
                more += weight.middle * beside
                off = weight.half * beside
            if stage == 2:
                off = weight.fades * weight.half * first + weight.half * (2.0 * beside - first)
            end = plus(end, rate.oil, SHARES[stage] * h)
            through += SHARES[stage] * h * (rate.leaks if opens else rate.to_rear)
            part = PARTS[stage] * h
            here = plus(y, rate.oil, part)
            here = on_way(way, here, t + part, here.rear, here.supply)
            gain = off + share * (size_of_rear(par, here.x) - size) + follows * part
            taken = gain + part * rate.leaks if opens else part * rate.to_rear
            here = on_way(way, here, t + part, y.rear + gain, here.supply - taken)
        end = on_way(way, end, t + h, end.rear, end.supply)
        gain = more + share * (size_of_rear(par, end.x) - size) + follows * h
        taken = gain + through if opens else through
        y = stopped(par, on_way(way, end, t + h, y.rear + gain, end.supply - taken))
        t += h
        left -= h
        if left <= 1e-9 * way.span:
            break
    return y


@inlined
def filled(par, pump, x):
    """Oil before a first blow: the line at the limit of the pump, the rear chamber at the tank."""
    bulk, air = par.hydraulic_bulk_modulus, par.hydraulic_air
    line, tank = REFERENCE + pump.limit, REFERENCE + par.hydraulic_tank_pressure
    pressed = min(par.hydraulic_precharge / line, 1.0)
    gas = par.hydraulic_gas_volume * math.exp(math.log(pressed) / par.hydraulic_gas_exponent)
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
    s.hydraulic_line_pressure = seen.line
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
    way = Way(True, before, casing - s.hydraulic_from_v, x, casing - v_p, h)
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


@kernel
def foretell(par, s, span):
    """Foretell the oil, and the force that it will have."""
    x, v, d = -s.u_r, s.hydraulic_casing_velocity - s.v_p, span
    s.hydraulic_from_x, s.hydraulic_from_v = x, s.v_p
    s.hydraulic_touched = s.closed
    s.hydraulic_from_path = s.hydraulic_last_path = s.path_p
    # a piston that touches the bit goes on as it has gone
    bend = -s.hydraulic_pull if s.closed == 1 else 0.0
    way = Way(s.closed == 1, x, v, x + d * (v + 0.5 * bend * d), v + bend * d, d)
    then = go(par, pump_of(s), present_oil(s, x, v), way)
    s.hydraulic_span, s.hydraulic_since = span, 0.0
    note_foretold(s, then)
    s.hydraulic_then_v = s.hydraulic_casing_velocity - then.v
    # a force that goes straight with the impulse and the way of the one foretold
    slope = 0.0
    if s.closed == 0:
        slope = straight_slope(par, then.impulse, then.x - x - d * v, d)
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
        "leak": (1.36e-12, "m^3/s/Pa", "leakage of the line to the tank, by the difference of "
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
        "step": (1.5e-4, "s", "time for which the oil is foretold; shorter is more accurate",
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
        "oil": ("m^3/s", "oil that the last blow took from the pump, by its period", 0.0),
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
        "last_path", "last_v", "used_before", "work_before",
    ),
    pass_time=pass_time,
    usual={"supply_pressure": (80e5, 250e5)},
    inputs=("flow", "supply_pressure"),
    next_blow=next_blow,
    of_blow=("oil", "pressure"),
)  # fmt: skip
