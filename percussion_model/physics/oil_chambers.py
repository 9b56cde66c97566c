"""Oil in two chambers with a spool valve, and in a line with pump and accumulator.

Steps of fourth order, with a piston that flies or on a way that is known, in which what follows
an open valve fades by exponentials (docs/model.md, eqs 13f to 13j).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.physics.kernel import LEAST_DIVISOR, inlined, kernel
from percussion_model.physics.oil import (
    REFERENCE,
    compliance,
    drop_for,
    gas_pressure,
    orifice,
    pressure_of,
    weights_of,
)

# Steps of the oil in the time for which it is foretold.
FINE = 10.0
# Rate of what is left of stiffness times a step that is stable by Runge and Kutta's steps (2.78).
STABLE = 1.5
# Steps are short by how fast the accumulator's gas shrinks.
SHRINKS = 4.0
# A piston that is slower counts as going at this speed, where its front port slows it [m/s].
SLOW = 0.1
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
    swings: float  # square of that at which oil makes the piston swing, or slows it [1/s^2]
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


@inlined
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
    # no more than twice the secant
    drag = 2.0 * area_f * abs(drop) / (par.mass_p * max(abs(y.v), SLOW))
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
    swings = max(swings, drag * drag, STOP / par.mass_p if room < 0.0 else 0.0)
    # the neck's oil on that of the line, and on gas which it may press to nothing
    by_gas = par.hydraulic_gas_exponent * p_g / y.gas
    neck_swings = par.hydraulic_neck_area / inertia * max(1.0 / ease_s, by_gas)
    rate = max(stiff, math.sqrt(max(swings, neck_swings)), SHRINKS * neck / y.gas)
    follows = 0.0
    if from_line.slope > 0.0 and p_r > least:  # a void follows nothing
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
        rate, swings, p_r, p_f, p_s,
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
