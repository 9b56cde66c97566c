"""The five-mode bit/rock law: its numbers, energies, changes of mode, and lines on curved rock.

Table 1 of docs/model.md, with the readings given there.

Straight lines stand in place of curved loading. Each does the work of the law between its ends
(eqs 20b to 20e). Solvers with steps take one over the way of a step. Those that go from event to
event take lines that follow each other at fixed penetrations, so that a run does not depend on how
it is cut into calls: errors of the motion are of fourth order in the ratio of their ends, and jumps
of the force where they meet of second.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from percussion_model.components import COMPONENTS, Component
from percussion_model.physics.elementary import exp, log
from percussion_model.physics.kernel import composed, inlined, kernel, merged
from percussion_model.physics.power_law import (
    CHIPPING_SLOPE,
    force_and_work,
    fresh_recovery,
    fresh_work,
    is_chipping,
    is_reloading,
    left_depth,
    loading_force,
    loading_part,
    loading_work,
    next_kink,
    penetration_at,
    recoverable_by_power,
    recovery,
    resume_loading,
    start_loading,
)
from percussion_model.physics.records import Mode, RockKind

# A velocity below this counts as zero: the ringing left after a long
# standstill is of this size, its sign means nothing [m/s].
REST_VELOCITY = 1e-9
# A drilling cycle counts when it crushed more than this share of W_R.
COUNTED_CYCLE = 0.01
# Rock that would give back less than this share of W_R is unloaded: a bit is found on it within
# a tick or a step of where it met it.
UNLOADED = 1e-6
# Energies are divided by no less than this, as hosts may trap an overflow [J].
LEAST_ENERGY = 1e-30
# A line is no shorter than this share of the reference penetration: where the bit turns, it is
# the tangent.
SHORTEST = 1e-6
# So many lines reach the reference penetration, and grow with their distance from nothing; beyond,
# their ends have one ratio. The first reaches where rock has this share of its stiffness at the
# reference penetration: on a softer line the bit would swing about a place so far away that its
# motion had no digits left.
LINES, SOFTEST = 96, 1e-4
RATIO = (1.0 + 1.0 / LINES) ** 2
# A penetration so close below the end of a line is there, as a share of it.
CLOSE = 1e-9


@inlined
def has_rock(par):
    """Whether there is anything under the bit."""
    return par.rock != RockKind.NONE


@inlined
def is_rigid_rock(par):
    """Whether what is under the bit does not yield."""
    return par.rock == RockKind.WALL


@inlined
def is_elastic_rock(par):
    """Whether the rock gives everything back, on the line on which it was loaded."""
    return par.rock == RockKind.SPRING


@inlined
def is_crushable(par):
    """Whether the rock is crushed in drilling cycles, which the barrier may prevent."""
    return par.rock == RockKind.BILINEAR


@inlined
def yield_like_a_spring(par):
    """Take a spring for what is under the bit."""
    par.rock = RockKind.SPRING


@inlined
def stiffness(s):
    """K of the present mode [N/m], table 1 of docs/model.md."""
    if s.mode == Mode.DFC or s.mode == Mode.FC:
        return s.k_r
    if s.mode == Mode.FF:
        return 0.0
    return s.gamma * s.k_r


@inlined
def damping(s):
    """C of the present mode [N s/m], table 1 of docs/model.md."""
    if s.mode == Mode.DFC or s.mode == Mode.SS:
        return s.c_r
    return 0.0


@inlined
def origin(s):
    """P_R of the present mode [m], table 1 of docs/model.md."""
    if s.mode == Mode.BC or s.mode == Mode.SS:
        return s.p_u
    return 0.0


@inlined
def is_loading(s):
    """Whether the rock is in a drilling cycle: DFC or FC."""
    return s.mode == Mode.DFC or s.mode == Mode.FC


@inlined
def spring_force(par, s):
    """Force of the rock without its damping, K (p - P_R) of docs/model.md, eq. 15 [N]."""
    if par.power == 1 and is_loading(s):
        return loading_force(par, s, s.p)
    return stiffness(s) * (s.p - origin(s))


@inlined
def recoverable_at(par, s, p):
    """Energy that the rock would give back from `p` in this mode (docs/model.md, eq. 21) [J]."""
    if is_loading(s):
        if par.power == 1:
            return recoverable_by_power(par, s, p, loading_force(par, s, p))
        return 0.5 * s.k_r * p * p / s.gamma
    if s.mode == Mode.FF and p <= s.p_u:
        return 0.0
    y = p - s.p_u
    return 0.5 * s.gamma * s.k_r * y * y


@inlined
def recoverable(par, s):
    """Energy that the rock would give back on unloading [J]."""
    return recoverable_at(par, s, s.p)


@inlined
def unloaded_penetration(par, s):
    """Penetration at which the rock would be unloaded, in a drilling cycle [m]."""
    if par.power == 0:
        return s.p * (s.gamma - 1.0) / s.gamma
    force = loading_force(par, s, s.p)
    return s.p - recovery(par, s, s.p, force)


@inlined
def pressed_depth(par, s):
    """Depth of the rock's surface by what is pressed in (docs/model.md, eq. 20a) [m]."""
    surface = s.p_u
    if is_loading(s):
        surface = unloaded_penetration(par, s)
    return s.x_r - s.hole_start + surface


@composed
def _all_gained(par: Any, s: Any, deeper: float) -> float:
    return deeper


@composed
def _nothing(par: Any, s: Any, gained: float) -> None:
    pass


def _or_less(before: Callable, one: Component) -> Callable:
    gain, present = one.gained, f"with_{one.name}"
    if gain is None:
        return before

    @composed
    def gained(par: Any, s: Any, deeper: float) -> float:
        least = before(par, s, deeper)
        if par[present] == 1:
            least = gain(par, s, least)
        return least

    return gained


def _and_end(before: Callable, one: Component) -> Callable:
    book, present = one.end_loading, f"with_{one.name}"
    if book is None:
        return before

    @composed
    def end(par: Any, s: Any, gained: float) -> None:
        before(par, s, gained)
        if par[present] == 1:
            book(par, s, gained)

    return end


# gained_of(par, s, deeper): advance of the hole by a loading that presses so much deeper [m].
gained_of = _all_gained
# note_gained(par, s, gained): components that follow loadings.
note_gained = _nothing
for _one in COMPONENTS:
    gained_of, note_gained = _or_less(gained_of, _one), _and_end(note_gained, _one)


@inlined
def hole_depth(par, s):
    """Depth of the hole (docs/model.md, eqs 20a and 20g) [m]."""
    if par.rock != RockKind.BILINEAR:
        return 0.0
    depth = pressed_depth(par, s)
    if par.places == 0:
        return depth
    not_gained = s.climb + s.pit
    if is_loading(s):
        deeper = depth - s.cycle_depth
        not_gained += deeper - gained_of(par, s, deeper)
    return depth - not_gained


@inlined
def leave_pit(par, s):
    """Note how much of the loading the hole does not gain: at its end, or where the bit turns."""
    deeper = pressed_depth(par, s) - s.cycle_depth
    gained = gained_of(par, s, deeper)
    s.pit += deeper - gained
    note_gained(par, s, gained)


@inlined
def barrier_off(par, s):
    """Whether a blow of any energy starts a drilling cycle."""
    return par.barrier == 0 or s.next_c_r == 0.0 or s.next_w_r == 0.0 or s.w_r == 0.0


@inlined
def barrier_level(par, s):
    """Energy above which a bit starts a drilling cycle, W_R unless a scene asks otherwise [J]."""
    return par.threshold * s.w_r


@inlined
def overcomes_barrier(par, s, energy):
    """Whether a bit of that kinetic energy [J] starts a drilling cycle."""
    return barrier_off(par, s) or energy > barrier_level(par, s)


@inlined
def crushed_until(par, s, force):
    """What a loading of fresh rock crushes until it has a force [N] [J]."""
    if force <= 0.0 or par.places == 0:
        return 0.0
    if par.power == 0:
        return 0.5 * force * force / s.k_r * (1.0 - 1.0 / s.gamma)
    return fresh_work(par, s, s.p) - 0.5 * force * fresh_recovery(par, s, s.p, force)


@kernel
def start_cycle(par, s, force):
    """Begin a drilling cycle that starts under a force [N] (docs/model.md, eq. 19)."""
    s.k_r = par.buttons * s.next_k_r
    s.gamma = s.next_gamma
    s.c_r = s.next_c_r
    s.w_r = s.next_w_r
    p = force / s.k_r
    if par.power == 1:
        left = left_depth(par, s.p_u if force > 0.0 else s.p)
        start_loading(par, s, left)
        p = penetration_at(par, s, force) if force > 0.0 else left
    if par.places == 1:
        s.cycle_depth = pressed_depth(par, s)  # a bit found just below the surface pressed it in
    s.x_r += s.p - p
    s.p = p
    s.w = 0.0
    s.crushed = s.crushed_before = 0.0
    s.cycle_from = crushed_until(par, s, force)
    s.cycle_counted = 0
    if par.barrier == 1 and s.c_r > 0.0 and s.w_r > 0.0:
        s.mode = Mode.DFC
    else:
        s.mode = Mode.FC


@kernel
def resume_cycle(par, s):
    """Begin a cycle from contact: the elastic force stays the same (docs/model.md, eq. 19)."""
    stiff = s.gamma * s.k_r
    force = stiff * (s.p - s.p_u)  # that of the spring, in BC and SS
    before = recoverable(par, s)
    depth = pressed_depth(par, s)
    start_cycle(par, s, force)
    if par.power == 1:
        resume_loading(par, s, force, force / stiff)
        s.hole_start += pressed_depth(par, s) - depth
    else:
        # Other rock under the same force springs back otherwise, which crushes nothing.
        s.hole_start += force / stiff - force / (s.gamma * s.k_r)
    if par.places == 1:
        s.cycle_depth = pressed_depth(par, s)
    # With other rock than before, what can be recovered changes at once.
    s.e_crushing += before - recoverable(par, s)


@inlined
def end_loading(par, s):
    """Unloading begins at the peak of a drilling cycle (docs/model.md, eq. 20).

    By the power law K_R becomes that of the straight line on which this cycle unloads.
    """
    if s.w_r > 0.0:
        margin = s.crushed / max(COUNTED_CYCLE * s.w_r, LEAST_ENERGY) - 1.0
        if not abs(s.b_counting) <= abs(margin):
            s.b_counting = margin
    if par.places == 1:
        leave_pit(par, s)
        s.crushed_before = 0.0
    if par.power == 1:
        force = loading_force(par, s, s.p)
        given_back = recovery(par, s, s.p, force)
        s.p_u = s.p - given_back
        if given_back != 0.0:
            s.k_r = force / (s.gamma * given_back)
    else:
        s.p_u = unloaded_penetration(par, s)
    s.mode = Mode.BC


@inlined
def keep_margin(par, s, energy):
    """Keep how far from the barrier an energy is, where it is the closest of a blow's decisions."""
    margin = energy / max(barrier_level(par, s), LEAST_ENERGY) - 1.0
    if not abs(s.b_barrier) <= abs(margin):  # of the first one it is NaN
        s.b_barrier = margin


@inlined
def decide_barrier(par, s, energy):
    """Decide as `overcomes_barrier`, and keep the closest of a blow's decisions."""
    if barrier_off(par, s):
        return True
    keep_margin(par, s, energy)
    return overcomes_barrier(par, s, energy)


@inlined
def ends_standstill(par, s, energy):
    """Decide as `overcomes_barrier` in standstill, and keep how near its energy came at a top."""
    if overcomes_barrier(par, s, energy):
        return True
    if energy < s.watched_energy:
        keep_margin(par, s, s.watched_energy)
    s.watched_energy = energy
    return False


@merged
def end_unloading(par, s, energy):
    """The bit turns downward while unloading: a new cycle, or standstill."""
    if decide_barrier(par, s, energy):
        resume_cycle(par, s)
    else:
        s.mode = Mode.SS


@merged
def leave_by_velocity(par, s, v, energy):
    """Change of mode that the sign of the end velocity asks for.

    Parameters
    ----------
    v : float
        Velocity of the bit end [m/s].
    energy : float
        Kinetic energy of the bit [J].

    Returns
    -------
    int
        1 where the mode changed.
    """
    if par.rock != RockKind.BILINEAR:
        return 0
    if s.mode == Mode.DFC or s.mode == Mode.FC:
        if v < -REST_VELOCITY:
            end_loading(par, s)
            return 1
    elif s.mode == Mode.BC and v > REST_VELOCITY:
        end_unloading(par, s, energy)
        return 1
    return 0


@merged
def close_interface(par, s, energy):
    """Contact with the rock begins: a new cycle, standstill, spring or wall."""
    if par.rock == RockKind.SPRING:
        s.k_r = par.buttons * s.next_k_r
        s.mode = Mode.FC
    elif par.rock == RockKind.WALL:
        s.mode = Mode.SS
    elif decide_barrier(par, s, energy):
        s.e_standstill += recoverable(par, s)
        start_cycle(par, s, 0.0)
    else:
        before = recoverable(par, s)
        s.mode = Mode.SS
        if par.power == 1 and before <= UNLOADED * s.w_r:
            # unloaded rock: the stiffness of the last peak's line has no say any more
            s.k_r, s.gamma = par.buttons * s.next_k_r, s.next_gamma
        s.e_standstill += before - recoverable(par, s)


@merged
def leave_standstill(par, s, v):
    """Standstill ends because KE_b > W_R: a new cycle, or unloading."""
    if v < -REST_VELOCITY:
        s.mode = Mode.BC
    else:
        resume_cycle(par, s)


@inlined
def enter_standstill(s, time):
    """Start the record of the bit force in standstill."""
    s.t_standstill = time
    s.watched_energy = 0.0
    s.n_check = 0


@inlined
def book_dashpot(s, work):
    """Book what the dashpot of the present mode took [J]."""
    if s.mode == Mode.DFC:
        s.e_barrier += work
        s.w += work
    elif s.mode == Mode.SS:
        s.e_standstill += work


@inlined
def crush(par, s, p_before):
    """Book the irrecoverable part of loading from `p_before` to s.p, if this is loading [J]."""
    if par.rock != RockKind.BILINEAR or (s.mode != Mode.DFC and s.mode != Mode.FC):
        return 0.0
    if par.power == 1:
        work = loading_work(par, s, s.p) - loading_work(par, s, p_before)
        work -= recoverable(par, s) - recoverable_at(par, s, p_before)
    else:
        work = 0.5 * s.k_r * (s.p - p_before) * (s.p + p_before) * (1.0 - 1.0 / s.gamma)
    book_crushed(s, work)
    return work


@inlined
def book_crushed(s, work):
    """Book what was crushed in a drilling cycle [J]."""
    s.e_crushing += work
    s.crushed += work
    if s.cycle_counted == 0 and s.crushed > COUNTED_CYCLE * s.w_r:
        s.cycle_counted = 1
        s.count_cycles += 1
        s.b_cycles += 1


class Line(NamedTuple):
    """The rock's spring: stiffness (p - origin) is its force [N]."""

    stiffness: float  # [N/m]
    origin: float  # [m]


@inlined
def is_curved(par, s):
    """Whether the present mode of the rock has no straight line of its own."""
    return par.power == 1 and is_loading(s)


@inlined
def present_line(par, s):
    """Line on which the rock is: that of its mode (table 1 of docs/model.md), or the one taken."""
    if is_curved(par, s):
        return Line(s.line_stiffness, s.line_origin)
    return Line(stiffness(s), origin(s))


class Place(NamedTuple):
    """A place on the curve of loading."""

    p: float  # penetration [m]
    force: float  # [N]
    work: float  # up to a constant of the cycle [J]


@inlined
def place_at(par, s, p):
    """Place of a penetration [m]."""
    force, work = force_and_work(par, s, p)
    return Place(p, force, work)


@inlined
def line_between(par, s, one, other):
    """Line that does the work of loading between two places; by the tangent where they are one."""
    least = SHORTEST * par.reference_penetration
    if abs(other.p - one.p) < least:
        other = place_at(par, s, one.p + least)
    way = other.p - one.p
    K, mean = (other.force - one.force) / way, (other.work - one.work) / way
    return Line(K, 0.5 * (one.p + other.p) - mean / K)


@kernel
def take_step_line(par, s, way):
    """Take the line from the present penetration on over a way ahead [m]."""
    if is_curved(par, s):
        here = place_at(par, s, s.p)
        line = line_between(par, s, here, place_at(par, s, s.p + max(way, 0.0)))
        s.line_stiffness, s.line_origin = line.stiffness, line.origin


@inlined
def line_work(line, a, b):
    """Work on the rock along a line between two penetrations [J]."""
    return line.stiffness * (b - a) * (0.5 * (b + a) - line.origin)


@inlined
def crushed_on_line(par, s, line, one, other):
    """What loading crushed from one place to another, between which a line was taken [J]."""
    before = recoverable_by_power(par, s, one.p, one.force)
    change = recoverable_by_power(par, s, other.p, other.force) - before
    return line_work(line, one.p, other.p) - change


@kernel
def next_end(par, part):
    """Where the line ends on which rock loads, by what of the penetration loads it [m].

    The line does the work of the curve, so that a step of it is off by the fourth power of its
    length alone, and little penetrations have little weight in that.
    """
    P = par.reference_penetration
    if part < (1.0 - CLOSE) * P:
        end = (math.floor(LINES * math.sqrt((1.0 + CLOSE) * max(part, 0.0) / P)) + 1.0) / LINES
        softest = exp(math.log(SOFTEST) / (par.exponent - 1.0)) if par.exponent > 1.0 else 0.0
        return max(end * end, softest) * P
    line = math.floor(log(part / P) / math.log(RATIO) + 1.0 + CLOSE / math.log(RATIO))
    return exp(line * math.log(RATIO)) * P


@kernel
def take_line(par, s):
    """Move on a line from the present penetration on.

    Lines have their ends where what loads the rock has those of rock that does not chip, and
    where the rock begins and ends to chip.
    """
    a = s.p
    straight = par.exponent == 1.0 and par.by_component == 0
    if straight and par.chipping_penetration == 0.0 and not is_reloading(s, a):
        s.line_stiffness, s.line_origin, s.line_end = s.k_r, 0.0, math.inf
        return
    kink = next_kink(par, s, a)
    if kink - a <= CLOSE * a:
        a = kink
        kink = next_kink(par, s, a)
    if is_reloading(s, a):
        s.line_stiffness, s.line_origin = s.reload_stiffness, s.reload_from
        s.line_end = s.reload_to
        return
    part = loading_part(par, s, a)
    way = next_end(par, part) - part
    b = min(a + (way / CHIPPING_SLOPE if is_chipping(par, s, a) else way), kink)
    s.line_stiffness, s.line_origin = line_between(par, s, place_at(par, s, a), place_at(par, s, b))
    s.line_end = b
