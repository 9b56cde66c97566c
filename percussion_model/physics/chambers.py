"""Gas in two chambers and an exhaust volume, with ports that a piston opens.

Mass and energy of each volume are its state, carried on by classical Runge-Kutta steps, with a
piston that flies or on a way that is known (docs/model.md, eqs 13a to 13c).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.physics.gas import HEAT, RATIO, flow, reservoir, stiffness, volume_of
from percussion_model.physics.kernel import LEAST_DIVISOR, inlined, kernel

# Rate of a volume times a step that is stable by the classical Runge-Kutta method (2.78).
STABLE = 2.4
# Steps shorter than this share of the usual ones, which are far from being unstable, are as good
# by two stages, at the start and in the middle.
SHORT, GENTLE = 0.25, 0.06
# Where the stages of a step are, and their shares of it.
PARTS, SHARES = (0.0, 0.5, 0.5, 1.0), (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)
# A step ends where a port bends its flow, but for one shorter than this share of it.
LEAST_PART = 0.02
NO_WAY = 1e3
# Most steps of one integration: a volume a thousandth of a usual one needs 1,300.
MOST_STEPS = 20_000
# A stop of some stiffness [N/m] leaves about this share of the upper chamber.
LEAST_SHARE, STOP = 1e-2, 1e8
# Steps are short by how fast a chamber shrinks, and by how fast a piston swings on its gas.
SHRINKS, SWINGS = 4.0, 3.0
# A piston that is faster or slower by this than was foretold has met something [m/s].
JUMP = 1.0
# Friction has its full value from some times this speed on [m/s].
CREEP = 1e-2


class Gas(NamedTuple):
    """Masses [kg] and internal energies [J] of upper and lower chamber and exhaust volume."""

    mass_u: float
    energy_u: float
    mass_l: float
    energy_l: float
    mass_x: float
    energy_x: float


class Done(NamedTuple):
    """What gas has done on a way."""

    used: float  # air from the supply [kg]
    vented: float  # air to the hole [kg]
    brought: float  # energy with air and through the walls, less what left with air [J]
    expanded: float  # work of the pressures on both faces of the piston, and the bit [J]
    impulse: float  # on the piston, down [N s]
    on_bit: float  # on the bit [N s]
    work: float  # on the piston's motion relative to the bit [J]


class Ahead(NamedTuple):
    """Gas, and what it does on the way."""

    gas: Gas
    x: float  # piston above the bit [m]
    v: float  # its velocity, up [m/s]
    done: Done
    rate: float  # of what goes on in it, which steps must be short against [1/s]


@inlined
def started(gas, x, v):
    """Gas with a piston above the bit, before either has moved."""
    return Ahead(gas, x, v, Done(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0)


@inlined
def size_of_upper(par, x):
    """Volume of the upper chamber [m^3]."""
    most = par.pneumatic_upper_volume
    return max(most - par.pneumatic_upper_area * x, LEAST_SHARE * most)


@inlined
def size_of_lower(par, x):
    """Volume of the lower chamber [m^3]; bars that are pressed together leave it as it is."""
    return par.pneumatic_lower_volume + par.pneumatic_lower_area * max(x, 0.0)


@inlined
def opened(par, area, share):
    """Effective area of a port of which a share is open, and of the leak beside it."""
    return par.pneumatic_discharge * (area * min(max(share, 0.0), 1.0) + par.pneumatic_leak)


@inlined
def rates_of(par, air, around, y, bounds):
    """What changes in a second; `x` and `v` as those of a free piston above a bit at rest.

    Parameters
    ----------
    air, around : Volume
        Of the supply, and behind the flushing holes.
    bounds : bool
        Whether `rate` is wanted too.
    """
    gas, x, v = y.gas, y.x, y.v
    size_u, size_l = size_of_upper(par, x), size_of_lower(par, x)
    size_x, per_both = par.pneumatic_exhaust_volume, 1.0 / (size_u * size_l)
    per_u, per_l, per_x = size_l * per_both, size_u * per_both, 1.0 / size_x
    upper = volume_of(gas.mass_u, gas.energy_u, size_u, per_u)
    lower = volume_of(gas.mass_l, gas.energy_l, size_l, per_l)
    behind = volume_of(gas.mass_x, gas.energy_x, size_x, per_x)
    share, each = par.pneumatic_discharge, 1.0 / par.pneumatic_ramp
    to_upper = flow(air, upper, opened(
        par, par.pneumatic_upper_intake, (x - par.pneumatic_upper_intake_edge) * each))  # fmt: skip
    to_lower = flow(air, lower, opened(
        par, par.pneumatic_lower_intake, (par.pneumatic_lower_intake_edge - x) * each))  # fmt: skip
    from_upper = flow(upper, behind, opened(
        par, par.pneumatic_upper_exhaust, (par.pneumatic_upper_exhaust_edge - x) * each)
    )  # fmt: skip
    from_lower = flow(lower, behind, opened(
        par, par.pneumatic_lower_exhaust, (x - par.pneumatic_lower_exhaust_edge) * each)
    )  # fmt: skip
    across = flow(upper, lower, share * par.pneumatic_leak)
    past = flow(air, behind, share * par.pneumatic_bypass)
    out = flow(behind, around, share * par.pneumatic_flushing)
    wall, cold = par.pneumatic_wall_conductance, par.pneumatic_wall_temperature
    heat_u = wall * (cold - upper.enthalpy / HEAT)
    heat_l = wall * (cold - lower.enthalpy / HEAT)
    area_u, area_l = par.pneumatic_upper_area, par.pneumatic_lower_area
    grow_l = area_l * v if x >= 0.0 else 0.0
    grow_u = -area_u * v if area_u * x < (1.0 - LEAST_SHARE) * par.pneumatic_upper_volume else 0.0
    rubbing = par.pneumatic_friction * v / math.sqrt(v * v + CREEP * CREEP)
    force = upper.pressure * area_u - lower.pressure * area_l
    force += rubbing - around.pressure * (area_u - area_l)
    beyond = x - (1.0 - LEAST_SHARE) * par.pneumatic_upper_volume / area_u
    force += STOP * max(beyond, 0.0)
    rate = 0.0
    if bounds:
        by_u, by_l = area_u * per_u, area_l * per_l
        spring = RATIO * max(upper.pressure * area_u * by_u, lower.pressure * area_l * by_l)
        spring = max(spring, STOP if beyond > 0.0 else 0.0)
        mixed = stiffness(across, upper, lower)
        by_upper = stiffness(from_upper, upper, behind)
        by_lower = stiffness(from_lower, lower, behind)
        vented = stiffness(out, behind, around) + stiffness(past, air, behind)
        by_wall = (RATIO - 1.0) * wall / HEAT
        wall_u = by_wall * upper.enthalpy * upper.per_pressure
        wall_l = by_wall * lower.enthalpy * lower.per_pressure
        rate = max(
            (stiffness(to_upper, air, upper) + by_upper + mixed + wall_u) * per_u,
            (stiffness(to_lower, air, lower) + by_lower + mixed + wall_l) * per_l,
            (by_upper + by_lower + vented) * per_x,
            SWINGS * math.sqrt(max(spring, 0.0) / par.mass_p),
            SHRINKS * abs(v) * max(by_u, by_l),
        )
    return Ahead(
        Gas(
            to_upper.mass - from_upper.mass - across.mass,
            to_upper.energy - from_upper.energy - across.energy - upper.pressure * grow_u + heat_u,
            to_lower.mass - from_lower.mass + across.mass,
            to_lower.energy - from_lower.energy + across.energy - lower.pressure * grow_l + heat_l,
            past.mass + from_upper.mass + from_lower.mass - out.mass,
            past.energy + from_upper.energy + from_lower.energy - out.energy,
        ),
        v,
        -force / par.mass_p - par.gravity,
        Done(
            to_upper.mass + to_lower.mass + past.mass,
            out.mass,
            to_upper.energy + to_lower.energy + past.energy - out.energy + heat_u + heat_l,
            upper.pressure * grow_u + lower.pressure * grow_l,
            force,
            (lower.pressure - around.pressure) * area_l,
            -force * v,
        ),
        rate,
    )


@inlined
def plus(y, rate, h):
    """What `y` is after a time at a rate."""
    gas, g, done, d = y.gas, rate.gas, y.done, rate.done
    return Ahead(
        Gas(
            gas.mass_u + h * g.mass_u,
            gas.energy_u + h * g.energy_u,
            gas.mass_l + h * g.mass_l,
            gas.energy_l + h * g.energy_l,
            gas.mass_x + h * g.mass_x,
            gas.energy_x + h * g.energy_x,
        ),
        y.x + h * rate.x,
        y.v + h * rate.v,
        Done(
            done.used + h * d.used,
            done.vented + h * d.vented,
            done.brought + h * d.brought,
            done.expanded + h * d.expanded,
            done.impulse + h * d.impulse,
            done.on_bit + h * d.on_bit,
            done.work + h * d.work,
        ),
        rate.rate,
    )


class Way(NamedTuple):
    """A way of the piston above the bit, by what it is at both ends."""

    known: bool  # else the piston flies
    x: float  # [m]
    v: float  # [m/s]
    then_x: float
    then_v: float
    span: float  # [s]
    fall: float  # acceleration of the bit that a flying piston's velocity is told by [m/s2]


@inlined
def flight(span):
    """Way of a piston that flies for a time."""
    return Way(False, 0.0, 0.0, 0.0, 0.0, span, 0.0)


@inlined
def moment_of(par, impulse, beyond, d):
    """Moment of a force about the end of a time, by the way that it makes [N s2].

    Parameters
    ----------
    impulse : float
        On the piston, down [N s].
    beyond : float
        How far the piston has come up beyond what its velocity alone makes [m].
    d : float
        Time of both [s].
    """
    return d * impulse + par.mass_p * (beyond + 0.5 * d * d * par.gravity)


@inlined
def straight_slope(impulse, moment, d):
    """Slope of a force that goes straight, by its impulse, and its moment about the end [N/s]."""
    return 12.0 * moment / (d * d * d) - 6.0 * impulse / (d * d)


@inlined
def is_past(s, since, span, touched, from_v, then_v):
    """Whether a time that was foretold is over, or the piston has met something since.

    Parameters
    ----------
    since, span : float
        How much of the time has passed, and all of it [s].
    touched : float
        `closed` when it was foretold.
    from_v, then_v : float
        Velocity of the piston then, and that foretold for the end [m/s].
    """
    if span == 0.0 or since >= (1.0 - 1e-9) * span or s.closed != touched:
        return True
    if s.closed == 1:
        return False
    return abs(s.v_p - (from_v + (then_v - from_v) * since / span)) > JUMP


@inlined
def on_way(way, y, t):
    """The same gas with the piston where the way has it after a time."""
    if not way.known:
        return Ahead(y.gas, y.x, y.v + way.fall * t, y.done, y.rate)
    d, q = way.span, t / way.span
    bend = 3.0 * (way.then_x - way.x) - d * (2.0 * way.v + way.then_v)
    turn = 2.0 * (way.x - way.then_x) + d * (way.v + way.then_v)
    x = way.x + q * (d * way.v + q * (bend + q * turn))
    v = way.v + q * (2.0 * bend + 3.0 * q * turn) / d
    return Ahead(y.gas, x, v, y.done, y.rate)


@inlined
def middle(way, y, t, h):
    """The same gas in the middle of a step, with the step's mean velocity."""
    y = on_way(way, y, t + 0.5 * h)
    if not way.known:
        return y
    x = on_way(way, y, t + h).x - on_way(way, y, t).x
    return Ahead(y.gas, y.x, x / h, y.done, y.rate)


@inlined
def next_bend(par, x, v):
    """Time in which the piston comes to where a port begins to open, or is open [s]."""
    ramp, way = par.pneumatic_ramp, NO_WAY
    for side in range(2):
        off = ramp * side
        for place in (
            par.pneumatic_upper_exhaust_edge - off,
            par.pneumatic_lower_intake_edge - off,
            par.pneumatic_upper_intake_edge + off,
            par.pneumatic_lower_exhaust_edge + off,
        ):
            to = place - x if v > 0.0 else x - place
            way = to if 0.0 < to < way else way
    return way / max(abs(v), LEAST_DIVISOR)


@kernel
def go(par, supply, hole, y, way):
    """Integrate the gas over a way, or with a piston that flies; classical Runge-Kutta steps.

    Parameters
    ----------
    supply, hole : float
        Pressures of the supply, and behind the flushing holes [Pa].
    """
    air = reservoir(supply, par.pneumatic_supply_temperature)
    around = reservoir(hole, par.pneumatic_ambient_temperature)
    t, left = 0.0, way.span
    for _ in range(MOST_STEPS):
        now = on_way(way, y, t)  # the state of a flight is told by the bit's first velocity
        rate = rates_of(par, air, around, now, True)
        steps = left * max(1.0 / par.pneumatic_step, rate.rate / STABLE)
        h = left / max(math.ceil(steps - 1e-9), 1)
        bend = next_bend(par, now.x, now.v)
        if LEAST_PART * h < bend < h:
            h = bend
        here = plus(y, rate, 0.5 * h)
        if h < SHORT * par.pneumatic_step and h * rate.rate < GENTLE:
            rate = rates_of(par, air, around, middle(way, here, t, h), False)
            end = plus(y, rate, h)
        else:
            end = plus(y, rate, SHARES[0] * h)
            for stage in range(1, 4):
                rate = rates_of(par, air, around, on_way(way, here, t + PARTS[stage] * h), False)
                end = plus(end, rate, SHARES[stage] * h)
                here = plus(y, rate, PARTS[min(stage + 1, 3)] * h)
        t += h
        y = on_way(way, end, t) if way.known else end
        left -= h
        if left <= 1e-9 * way.span:
            break
    return y
