"""Rigid piston and bit blow by blow, in plain Python: another way to the same equations.

Written from docs/model.md and the law of breaking and rotation alone: no kernel is imported.
Motion between events is in closed form, and events are found by looking at many times at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

# Looks in a period of the bit on the rock, and looks at once.
LOOKS, CHUNK = 48, 512
# Without an oscillation there are so many looks in a millisecond.
FREE = 20
# The first are closer and closer: bounces of the piston on the bit get shorter and shorter [s].
CLOSE = np.geomspace(1e-10, 1e-5, 100)
# A rebound slower than this ends them, where the drive and the bit press the two together [m/s].
SLOWEST = 1e-4
# Where the piston leaves the bit without a rebound the gap is rounding so long [s].
OPENING = 1e-6
# Flights of a bit that leaves the rock slower are taken whole [m/s].
SHORT = 1e-6
LONGEST = 1.0  # no event is further off [s]


@dataclass
class Law:
    """Numbers of a scene, SI units."""

    piston: float
    bit: float
    restitution: float
    gravity: float
    feed: float
    casing: float | None  # weight of the casing that the feed pushes; None: it pushes the bit
    drive: float
    reversal: float
    stiffness: float
    ratio: float
    barrier: tuple[float, float] | None  # energy [J] and damping [N s/m]
    area: float
    buttons: int
    energy: float
    threshold: float
    efficiency: float
    speed: float
    radius: float
    renewal: float
    old_line: bool
    friction: float
    stall: float
    full: float
    response: float
    string: float
    inertia: float


def law_of(scene) -> Law:
    """The numbers of a scene of rigid bodies."""
    g = scene.gravity.acceleration if scene.effects.gravity else 0.0
    rock, barrier = scene.rock, None
    if scene.effects.barrier:
        barrier = (rock.barrier_energy, rock.barrier_damping)
    return Law(
        piston=scene.piston.mass,
        bit=scene.bit.mass,
        restitution=scene["contact.restitution"],
        gravity=g,
        feed=scene.feed.force,
        casing=scene["feed.casing_mass"] * g if scene.feed.on == "casing" else None,
        drive=scene.drive.force,
        reversal=scene.drive.reversal_distance,
        stiffness=rock.loading_stiffness,
        ratio=rock.unloading_ratio,
        barrier=barrier,
        area=0.25 * math.pi * scene.hole_diameter**2,
        buttons=scene["breaking.buttons"],
        energy=scene["breaking.crushing_energy"],
        threshold=scene["breaking.threshold"],
        efficiency=scene["breaking.efficiency"],
        speed=scene["rotation.speed"],
        radius=scene["rotation.mean_radius"],
        renewal=scene["rotation.renewal_length"],
        old_line=scene["rotation.old_line"],
        friction=scene["rotation.friction"],
        stall=scene["rotation.stall_torque"],
        full=scene["rotation.full_torque"],
        response=scene["rotation.response"],
        string=scene["rotation.string_stiffness"],
        inertia=scene["rotation.inertia"],
    )


def oscillation(mass, damping, stiffness, push, x, v):
    """Motion of m x'' + c x' + k x = push from x and v: a function of time to both."""
    if stiffness == 0.0:
        a = push / mass
        return lambda t: (x + t * (v + 0.5 * a * t), v + a * t)
    rest, half = push / stiffness, 0.5 * damping / mass
    square = stiffness / mass - half * half
    if square <= 0.0:
        raise AssertionError("this damping is not meant to be strong")
    omega, y = math.sqrt(square), x - rest
    b = (v + half * y) / omega

    def at(t):
        e, c, s = np.exp(-half * t), np.cos(omega * t), np.sin(omega * t)
        return (
            rest + e * (y * c + b * s),
            e * ((b * omega - half * y) * c - (y * omega + half * b) * s),
        )

    return at


@dataclass
class Rig:
    """Piston and bit on rock.

    The bit is at x, the unloaded surface of the rock at `surface`, both from where the bit began
    and in a frame that does not climb. The rock was pressed to `peak`, at which it had the force
    K `peak`; up to that force it answers on the line gamma K (x - surface).
    """

    law: Law
    surface: float
    gap: float
    v_p: float
    x: float = 0.0
    v: float = 0.0
    time: float = 0.0
    mode: str = "flight"  # loading, reloading on the old line, elastic, standstill
    peak: float = 0.0
    damped: bool = False  # the barrier of this cycle is not spent yet
    spent: float = 0.0
    down: bool = True
    armed: bool = True
    held: bool = False  # the piston moves with the bit
    released: bool = False  # just now: the gap is nothing but rounding yet
    impulse: float = 0.0
    recoil: float = 0.0
    # place and hole
    place: tuple[float, float] = (0.0, 0.0)  # time and impulse of the drive
    pit: float = 0.0
    hole: float = 0.0
    taken: float = 0.0
    crushed: float = 0.0  # at this place
    cycle: tuple[float, float] = (0.0, 0.0)  # surface and peak where this cycle began
    began: float = 0.0  # penetration at which this cycle began
    parted: bool = False  # the loading under way began at another place
    volume: float = 0.0
    turning: float = 0.0
    needed: float = 0.0
    torque: float = 0.0
    twist: float = 0.0
    index: float = 0.0
    last: float = 0.0
    under_way: float = 0.0
    rows: list[dict[str, float]] = field(default_factory=list)
    start: tuple[float, float] | None = None  # time and hole of the blow under way

    def __post_init__(self) -> None:
        self.turning = self.law.speed

    # forces

    @property
    def throttled(self) -> float:
        one = self.law
        if one.casing is None or self.recoil <= 0.0:
            return 1.0
        return min(max(one.feed + one.casing, 0.0) / self.recoil, 1.0)

    @property
    def feed(self) -> float:
        one = self.law
        return one.feed if one.casing is None else max(one.feed + one.casing - self.recoil, 0.0)

    @property
    def drive(self) -> float:
        return (1.0 if self.down else -1.0) * self.law.drive * self.throttled

    def spring(self, x):
        """Force of the rock's spring."""
        one = self.law
        if self.mode == "flight":
            return 0.0 * x
        if self.mode == "loading":
            return one.stiffness * (x - self.datum)
        return one.ratio * one.stiffness * (x - self.surface)

    @property
    def datum(self) -> float:
        """From which penetration counts: so that unloading from the peak ends at the surface."""
        return self.surface - self.peak * (1.0 - 1.0 / self.law.ratio)

    @property
    def damping(self) -> float:
        if self.law.barrier is None:
            return 0.0
        by_mode = self.mode == "standstill" or (self.mode == "loading" and self.damped)
        return self.law.barrier[1] if by_mode else 0.0

    @property
    def mass(self) -> float:
        return self.law.bit + (self.law.piston if self.held else 0.0)

    @property
    def push(self) -> float:
        """Constant force on what moves with the bit."""
        one = self.law
        push = self.mass * one.gravity + self.feed
        return push + (self.drive if self.held else 0.0)

    def pull(self, x, v):
        """Force that would have to keep the piston on the bit."""
        a = (self.push - self.spring(x) - self.damping * v) / self.mass
        return self.law.piston * (a - self.law.gravity) - self.drive

    # motion

    def motion(self):
        """Position and velocity of the bit by time from now on."""
        one = self.law
        stiffness, origin = 0.0, self.x
        if self.mode != "flight":
            loads = self.mode == "loading"
            stiffness = one.stiffness * (1.0 if loads else one.ratio)
            origin = self.datum if loads else self.surface
        at = oscillation(self.mass, self.damping, stiffness, self.push, self.x - origin, self.v)

        def moved(t):
            x, v = at(t)
            return x + origin, v

        return moved, stiffness

    def conditions(self, moved):
        """Functions of time that rise through 0 at an event, by its name."""
        one = self.law
        a = one.gravity + self.drive / one.piston
        x0, here = self.x, self.gap

        def gap(t):
            wide = here + moved(t)[0] - x0 - t * (self.v_p + 0.5 * a * t)
            return np.where(t < OPENING, 1.0, wide) if self.released else wide

        found = {"close": lambda t: -gap(t)}
        if self.held:
            found = {"release": lambda t: self.pull(*moved(t))}
        elif not self.down:
            found["switch"] = lambda t: gap(t) - one.reversal
        if self.mode == "flight":
            found["touch"] = lambda t: moved(t)[0] - self.surface
        elif self.mode == "loading":
            found["top"] = lambda t: -moved(t)[1]
            if self.damped:
                found["spend"] = lambda t: self.dashpot(*moved(t)) - one.barrier[0]
        elif self.mode == "reloading":
            found["top"] = lambda t: -moved(t)[1]
            found["kink"] = lambda t: self.spring(moved(t)[0]) - one.stiffness * self.peak
        elif self.mode == "elastic":
            found["lift"] = lambda t: self.surface - moved(t)[0]
            found["turn"] = lambda t: moved(t)[1]
        else:
            limit = math.sqrt(2.0 * one.barrier[0] / one.bit)
            found["lift"] = lambda t: -(self.spring(moved(t)[0]) + one.barrier[1] * moved(t)[1])
            found["leave"] = lambda t: np.abs(moved(t)[1]) - limit
        return found

    def dashpot(self, x, v):
        """Work of the dashpot in this cycle, if the bit now comes to x and v."""
        one, push = self.law, self.push
        kinetic = 0.5 * self.mass * (self.v**2 - v**2)
        stored = 0.5 * one.stiffness * ((x - self.datum) ** 2 - (self.x - self.datum) ** 2)
        return self.spent + kinetic + push * (x - self.x) - stored

    def next_event(self):
        """Time to the next event, and its name."""
        moved, stiffness = self.motion()
        step = 1e-3 / FREE
        if stiffness > 0.0:
            step = 2.0 * math.pi * math.sqrt(self.law.bit / stiffness) / LOOKS
        found, first = self.conditions(moved), 0
        if self.held and self.pull(self.x, self.v) > 0.0:
            return 0.0, "release"
        while first * step < LONGEST:
            times = step * np.arange(first, first + CHUNK + 1)
            if first == 0:
                times = np.union1d(times, CLOSE)
            best = (math.inf, "")
            for name, function in found.items():
                values = np.broadcast_to(function(times), times.shape)
                rises = np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))
                if len(rises):
                    k = rises[0]
                    t = brentq(function, times[k], times[k + 1], xtol=1e-18, rtol=1e-15)
                    best = min(best, (t, name))
            if best[1] == "turn" and found["lift"](best[0]) > 0.0:  # lets go between two looks
                best = (brentq(found["lift"], 0.0, best[0], xtol=1e-18, rtol=1e-15), "lift")
            if best[1]:
                return best
            first += CHUNK
        raise AssertionError("nothing happens any more")

    def go(self) -> None:
        """Move to the next event, and let it happen."""
        tau, name = self.next_event()
        self.pass_time(tau, *(float(value) for value in self.motion()[0](tau)))
        self.released = name == "release"
        getattr(self, name)()

    def pass_time(self, tau: float, x: float, v: float) -> None:
        """Move on by a time, at whose end the bit is at x."""
        one = self.law
        if self.mode == "loading" and self.damped:
            self.spent = self.dashpot(x, v)
        a = one.gravity + self.drive / one.piston
        if not self.held:
            self.gap += x - self.x - tau * (self.v_p + 0.5 * a * tau)
        self.v_p = v if self.held else self.v_p + a * tau
        self.impulse += self.drive * tau
        self.time += tau
        if self.mode == "loading":
            peak = x - self.datum
            self.surface, self.peak = self.datum + peak * (1.0 - 1.0 / one.ratio), peak
        self.x, self.v = x, v

    # events

    def close(self) -> None:
        one, self.gap = self.law, 0.0
        if self.armed:
            self.begin_blow()
        self.down = False
        mass = 1.0 / (1.0 / one.piston + 1.0 / one.bit)
        speed = self.v_p - self.v
        given = (1.0 + one.restitution) * mass * speed
        if one.restitution * speed < SLOWEST:
            self.held, common = (
                True,
                (one.piston * self.v_p + one.bit * self.v) / (one.piston + one.bit),
            )
            self.held = self.pull(self.x, common) < 0.0
        if self.held:
            given = mass * speed
        self.v_p -= given / one.piston
        self.v += given / one.bit
        if self.mode == "elastic" and self.v > 0.0:
            self.turn()
        elif self.mode == "standstill" and self.fast:
            self.leave()

    def release(self) -> None:
        self.held = False

    def switch(self) -> None:
        self.down = self.armed = True

    @property
    def fast(self) -> bool:
        """Whether the bit has the energy to overcome the barrier."""
        one = self.law
        return one.barrier is None or 0.5 * one.bit * self.v**2 > one.barrier[0]

    def touch(self) -> None:
        self.x = self.surface
        if self.fast:
            self.load(0.0)
        else:
            self.mode = "standstill"

    def turn(self) -> None:
        """The bit goes down again on rock that has not let go of it."""
        if self.fast:
            self.leave()
        else:
            self.mode = "standstill"

    def leave(self) -> None:
        if self.v < 0.0:
            self.mode = "elastic"
        else:
            self.load(self.spring(self.x) / self.law.stiffness)

    def load(self, peak: float) -> None:
        """Begin to load under the force K `peak`: as fresh rock, or on the old line."""
        if self.law.old_line and self.peak > peak:
            self.mode = "reloading"
            return
        self.begin(peak)

    def begin(self, peak: float) -> None:
        self.mode, self.peak = "loading", peak
        self.surface = self.x - peak / self.law.ratio
        self.damped, self.spent = self.law.barrier is not None, 0.0
        self.cycle, self.parted, self.began = (self.surface, peak), False, peak

    def kink(self) -> None:
        self.begin(self.peak)

    def spend(self) -> None:
        self.damped = False

    def lift(self) -> None:
        self.mode = "flight"
        if not self.held and self.v > -SHORT:
            # back at once, as fast: what lies between has no digits
            self.pass_time(2.0 * abs(self.v) * self.law.bit / self.push, self.x, abs(self.v))
            self.touch()

    def top(self) -> None:
        """Unloading begins: what is crushed breaks rock."""
        if self.mode == "reloading":
            self.mode = "elastic"
            return
        self.book()
        self.mode = "elastic"

    def book(self) -> None:
        """Note what the loading has broken."""
        energy, volume, gained = self.gained()
        self.crushed += energy
        self.under_way += volume
        self.volume += gained * self.law.area
        self.hole += gained
        self.pit += self.surface - self.cycle[0] - gained

    def gained(self) -> tuple[float, float, float]:
        """Energy that the loading adds at this place so far, its volume and its advance.

        On the old line it is crushed from where it was left. Fresh rock that was loaded before
        takes the energy of reloading it first, from the force of the start on.
        """
        one, (surface, before) = self.law, self.cycle
        share = 0.5 * one.stiffness * (1.0 - 1.0 / one.ratio)
        energy = share * (self.peak**2 - before**2)
        if not (one.old_line or self.parted):
            reloads = max(self.crushed - share * before**2, 0.0) / one.ratio
            energy = max(energy - reloads, 0.0)
        deeper = self.surface - surface
        if one.energy == 0.0:
            return energy, 0.0, deeper
        known = max(one.buttons * one.threshold, self.taken)
        beyond = max(self.crushed + energy - known, 0.0) - max(self.crushed - known, 0.0)
        volume = one.efficiency * beyond / one.energy
        return energy, volume, min(volume / one.area, deeper)

    # blows

    def depth(self) -> float:
        return self.hole + (self.gained()[2] if self.mode == "loading" else 0.0)

    def begin_blow(self) -> None:
        if not (self.law.old_line and self.mode in ("loading", "reloading")):
            self.move_on()
        self.armed = False
        if self.start is not None:
            time, hole = self.start
            self.rows.append({
                "time": time, "period": self.time - time, "hole_advance": self.depth() - hole,
                "rotation_torque": self.torque, "rotation_index": self.index,
                "breaking_blow_volume": self.last,
            })  # fmt: skip
        self.start = (self.time, self.depth())

    def rotate(self, period: float) -> tuple[float, float]:
        """Angle that the bit turns, and mean torque of a string that twists; no motor stalls."""
        one, left = self.law, period
        if not one.string:
            return self.turning * period, 0.0
        k, twist, angle, wound = one.string, self.twist, 0.0, 0.0  # `wound`: twist by time

        def rates(_, y):
            return (
                self.turning - y[1],
                (k * y[0] - self.needed) / one.inertia,
                y[1],
                y[0],
            )

        def rest(t, y):
            return y[1] if t > 1e-9 else 1.0

        rest.terminal, rest.direction = True, -1
        while left > 0.0:
            wait = min(max(self.needed / k - twist, 0.0) / self.turning, left)
            wound += wait * (twist + 0.5 * wait * self.turning)
            twist, left = twist + wait * self.turning, left - wait
            if left > 0.0:
                swing = solve_ivp(
                    rates, (0.0, left), (twist, 0.0, angle, wound), "DOP853",
                    events=rest, rtol=1e-12, atol=1e-15,
                )  # fmt: skip
                twist, _, angle, wound = swing.y[:, -1]
                left -= swing.t[-1]
        self.twist = twist
        return angle, k * wound / period

    def move_on(self) -> None:
        """Turn to the next place, and climb out of the craters of this one."""
        one, period = self.law, self.time - self.place[0]
        if period <= 0.0:
            return
        push = (self.impulse - self.place[1]) / period
        self.place = (self.time, self.impulse)
        feed = self.feed
        if one.casing is not None:
            self.recoil = push / self.throttled
        carried = 0.0
        if self.mode == "loading":  # it goes on at the next place
            share = 0.5 * one.stiffness * (1.0 - 1.0 / one.ratio)
            self.book()
            carried = min(share * (self.peak**2 - self.began**2), self.crushed)
            self.cycle, self.parted = (self.surface, self.peak), True
        angle, wound = self.rotate(period)
        arc = one.radius * angle
        kept = math.exp(-0.5 * arc / one.renewal)  # of depth; of energy the square
        if one.old_line and self.peak > 0.0:
            left = max(kept * self.peak, self.spring(self.x) / one.stiffness)
            kept, self.peak = left / self.peak, left
        climb = (1.0 - kept) * self.pit
        rest = feed + one.bit * one.gravity
        force = max(rest + push + one.piston * one.gravity, 0.0)
        slope = climb / arc if arc else 0.5 * self.pit / one.renewal
        needed = one.radius * (force * slope + one.friction * max(rest, 0.0))
        self.needed, self.index = needed, arc
        needed = wound if one.string else needed
        self.torque = min(needed, one.stall) if one.stall else needed
        speed = one.speed
        if one.stall and needed > one.full:
            speed *= max(one.stall - needed, 0.0) / (one.stall - one.full)
        follows = 1.0 - math.exp(-period / one.response) if one.response else 1.0
        self.turning += follows * (speed - self.turning)
        self.pit = self.pit - climb if one.old_line else 0.0
        self.taken = kept**2 * max(self.taken, self.crushed)
        self.crushed = self.taken if one.old_line else carried
        self.last, self.under_way = self.under_way, 0.0

    def run(self, blows: int) -> list[dict[str, float]]:
        """Rows of the first blows."""
        while len(self.rows) < blows:
            self.go()
        return self.rows


def rig_of(scene) -> Rig:
    """A rig as a scene begins."""
    start = scene.start
    return Rig(law_of(scene), start.rock_gap, start.gap, start.piston_velocity)
