"""Loading and unloading of the rock by a power law, with chipping and with cuttings.

A component may give another curve of loading (`loading`), which has all else of the law.
Eqs 20b to 20e of docs/model.md. Of the penetration a part loads the rock: all of it, but for
the step in which the rock chips at a nearly constant force. Cuttings that flushing leaves in the
crater (eqs 24 and 25 of the paper, with units) are first compressed again, on the line on which
rock unloads from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from percussion_model.components import COMPONENTS, Component
from percussion_model.physics.elementary import exp, log
from percussion_model.physics.kernel import LEAST_DIVISOR, composed, inlined, kernel, merged, scalar
from percussion_model.physics.records import Cuttings

# Below this share of the reference penetration, or of the force there, the power law goes on as
# a straight line: nothing that moves a bit is so small.
LEAST_SHARE = 1e-9
# While the rock chips this share of the way still loads it: so a force has one penetration.
CHIPPING_SLOPE = 1e-4
# By a power of the force rock gives back no less, which is 1/gamma of the greatest gamma.
LEAST_RECOVERED = 1e-4
# Halvings that find a penetration to rounding.
MOST_TURNS = 60
# Depth of a crater of which `rock.removed_share` is removed [m].
CRATER = 1e-3


class Curve(NamedTuple):
    """Where a part of the penetration is on a component's curve of loading."""

    force: float  # [N]
    slope: float  # [N/m]
    work: float  # [J]


@composed
def _straight(par: Any, x: float) -> tuple[float, float, float]:
    return x, 1.0, 0.5 * x * x


def _or_loading(before: Callable, one: Component) -> Callable:
    if one.loading is None:
        return before
    loading, present = one.loading, f"with_{one.name}"

    @composed
    def either(par: Any, x: float) -> tuple[float, float, float]:
        return loading(par, x) if par[present] == 1 else before(par, x)

    return either


# loading_of(par, x): force, slope and work by those of K_R at P_0 where x of that loads.
loading_of = _straight
for _one in COMPONENTS:
    loading_of = _or_loading(loading_of, _one)


@kernel
def on_curve(par, k, part):
    """Place on the curve of loading that a component gives, with a stiffness [N/m]."""
    P = par.reference_penetration
    force, slope, work = loading_of(par, part / P)
    return Curve(k * P * force, k * max(slope, LEAST_SHARE), k * P * P * work)


@kernel
def exponent_at(par, part):
    """Exponent of the power that loads as the rock does at a part of the penetration."""
    if par.by_component == 0 or part <= 0.0:
        return par.exponent
    here = on_curve(par, 1.0, part)
    return part * here.slope / max(here.force, LEAST_DIVISOR)


@kernel
def growth(par, p):
    """Secant stiffness at a penetration that loads, by that at the reference penetration."""
    share = max(p / par.reference_penetration, LEAST_SHARE)
    # the usual exponents, which cost no logarithm
    if par.exponent == 1.0:
        return 1.0
    if par.exponent == 1.5:
        return math.sqrt(share)
    return share if par.exponent == 2.0 else exp((par.exponent - 1.0) * log(share))


@kernel
def loading_part(par, s, p):
    """Part of a penetration that loads the rock [m]."""
    if par.chipping_penetration == 0.0 or p <= s.chipping_from:
        return p
    way = p - s.chipping_from
    if way <= par.chipping_penetration:
        return s.chipping_from + CHIPPING_SLOPE * way
    return p - (1.0 - CHIPPING_SLOPE) * par.chipping_penetration


@kernel
def is_reloading(s, p):
    """Whether a bit at a penetration still compresses what is left of the crater."""
    return s.reload_from < s.reload_to and p < s.reload_to


@kernel
def loading_force(par, s, p):
    """Force of the rock at a penetration in a drilling cycle (docs/model.md, eqs 15, 20b) [N]."""
    if par.power == 0:
        return s.k_r * p
    if is_reloading(s, p):
        return s.reload_stiffness * (p - s.reload_from)
    return fresh_force(par, s, p)


@kernel
def fresh_force(par, s, p):
    """Force of rock that no cuttings cover [N]."""
    part = loading_part(par, s, p)
    if par.by_component == 1:
        return on_curve(par, s.k_r, part).force
    return s.k_r * part * growth(par, part)


@kernel
def loading_slope(par, s, p):
    """How that force grows with the penetration [N/m]."""
    if is_reloading(s, p):
        return s.reload_stiffness
    part = loading_part(par, s, p)
    if par.by_component == 1:
        slope = on_curve(par, s.k_r, part).slope
    else:
        slope = par.exponent * s.k_r * growth(par, part)
    return CHIPPING_SLOPE * slope if is_chipping(par, s, p) else slope


@kernel
def is_chipping(par, s, p):
    """Whether the rock chips at a penetration."""
    return (
        par.chipping_penetration > 0.0
        and s.chipping_from <= p < s.chipping_from + par.chipping_penetration
    )


@kernel
def next_kink(par, s, p):
    """Penetration above `p` at which cuttings or chipping next bend the loading [m]."""
    if is_reloading(s, p):
        return s.reload_to
    if par.chipping_penetration == 0.0 or p >= s.chipping_from + par.chipping_penetration:
        return math.inf
    return s.chipping_from if p < s.chipping_from else s.chipping_from + par.chipping_penetration


@kernel
def loading_work(par, s, p):
    """Work on the rock in a drilling cycle of the power law, up to a constant of the cycle [J]."""
    if is_reloading(s, p):
        # what is missing to the end of this line
        way, last = s.reload_to - p, s.reload_to - s.reload_from
        return fresh_work(par, s, s.reload_to) - s.reload_stiffness * way * (last - 0.5 * way)
    return fresh_work(par, s, p)


@kernel
def force_and_work(par, s, p):
    """`loading_force` [N] and `loading_work` [J] at a penetration."""
    if par.by_component == 1 or par.chipping_penetration > 0.0 or is_reloading(s, p):
        return loading_force(par, s, p), loading_work(par, s, p)
    force = s.k_r * p * growth(par, p)
    return force, force * p / (par.exponent + 1.0)


@kernel
def fresh_work(par, s, p):
    """Work from no penetration to `p` on rock that no cuttings cover [J]."""
    part = loading_part(par, s, p)
    work = work_of_part(par, s.k_r, part)
    if par.chipping_penetration > 0.0 and p > s.chipping_from:
        first = s.chipping_from
        last = first + CHIPPING_SLOPE * min(p - first, par.chipping_penetration)
        # the same forces over a longer way
        if par.by_component == 1:
            more = work_of_part(par, s.k_r, last) - work_of_part(par, s.k_r, first)
            return work + (1.0 / CHIPPING_SLOPE - 1.0) * more
        more = last * last * growth(par, last) - first * first * growth(par, first)
        work += (1.0 / CHIPPING_SLOPE - 1.0) * s.k_r * more / (par.exponent + 1.0)
    return work


@inlined
def work_of_part(par, k, part):
    """Work of a loading without chipping, with a stiffness [N/m] [J]."""
    if par.by_component == 1:
        return on_curve(par, k, part).work
    return k * part * part * growth(par, part) / (par.exponent + 1.0)


@kernel
def recovered_share(par, s, part, force):
    """Penetration that the rock gives back from a peak force, by the part that loaded it.

    1/gamma at the force of the reference penetration, a power of the force beside it; never so
    much that rock would unload softer than it loads there (docs/model.md, eq. 20c).
    """
    share = 1.0 / s.gamma
    if par.unloading_exponent > 0.0:
        relative = max(force / (s.k_r * par.reference_penetration), LEAST_SHARE)
        share = max(share * exp(-par.unloading_exponent * log(relative)), LEAST_RECOVERED)
    return min(share, 1.0 / exponent_at(par, part))


@inlined
def fresh_recovery(par, s, p, force):
    """Penetration that rock gives back from a peak, in a cycle that began without a force [m]."""
    if is_reloading(s, p):
        return p - s.reload_from
    part = loading_part(par, s, p)
    return part * recovered_share(par, s, part, force)


@kernel
def recovery(par, s, p, force):
    """Penetration that rock gives back from a peak and its force (docs/model.md, eq. 20c) [m]."""
    given_back = fresh_recovery(par, s, p, force)
    if s.resumed_force > 0.0:
        given_back *= 1.0 - (1.0 - s.resumed_share) * s.resumed_force / max(force, s.resumed_force)
    return given_back


@kernel
def recoverable_by_power(par, s, p, force):
    """Energy that the rock would give back at a penetration [m] and its force [N] [J]."""
    return 0.5 * force * recovery(par, s, p, force)


@kernel
def part_at(par, k, force):
    """Part of the penetration that loads at a force, with a loading stiffness `k` [m]."""
    if par.by_component == 1:
        return part_on_curve(par, k, force)
    relative = max(force / (k * par.reference_penetration), LEAST_SHARE)
    return par.reference_penetration * exp(log(relative) / par.exponent)


@merged
def part_on_curve(par, k, force):
    """The same on the curve of a component, by halves."""
    low, high = 0.0, par.reference_penetration
    for _ in range(MOST_TURNS):
        if on_curve(par, k, high).force >= force:
            break
        low, high = high, 2.0 * high
    for _ in range(MOST_TURNS):
        mid = 0.5 * (low + high)
        if on_curve(par, k, mid).force < force:
            low = mid
        else:
            high = mid
    return high


@scalar
def secant_stiffness(force, stiffness, exponent, reference_penetration):
    """Force of rock by the penetration that loads it, at a force [N/m].

    Parameters
    ----------
    force : float
        [N]
    stiffness : float
        That at the reference penetration, of all buttons [N/m].
    exponent : float
    reference_penetration : float
        [m]
    """
    if exponent == 1.0 or not force > 0.0:
        return stiffness
    relative = force / (stiffness * reference_penetration)
    return stiffness * exp((1.0 - 1.0 / exponent) * log(max(relative, LEAST_SHARE)))


@merged
def peak_above(par, s, left):
    """Penetration from which the rock would unload to `left` [m]."""
    bent = par.by_component == 1 or par.chipping_penetration > 0.0
    if par.exponent == 1.0 and par.unloading_exponent == 0.0 and not bent:
        return left * s.gamma / (s.gamma - 1.0)
    low, high = left, 2.0 * left
    for _ in range(MOST_TURNS):
        if high - fresh_recovery(par, s, high, fresh_force(par, s, high)) >= left:
            break
        low, high = high, 2.0 * high
    for _ in range(MOST_TURNS):
        mid = 0.5 * (low + high)
        if mid - fresh_recovery(par, s, mid, fresh_force(par, s, mid)) < left:
            low = mid
        else:
            high = mid
    return high


@merged
def start_loading(par, s, left):
    """Find the lines of a cycle that begins, with what is `left` of the crater [m]."""
    if par.chipping_penetration > 0.0:
        s.chipping_from = part_at(par, s.k_r, par.chipping_force)
    s.resumed_force = 0.0
    s.reload_from = s.reload_to = 0.0
    if left > LEAST_SHARE * par.reference_penetration:
        peak = peak_above(par, s, left)
        force = fresh_force(par, s, peak)
        s.reload_stiffness = force / fresh_recovery(par, s, peak, force)
        s.reload_from, s.reload_to = left, peak


@merged
def resume_loading(par, s, force, given_back):
    """Go on with what the rock would give back under a force, where a cycle begins under it.

    Of its own such a cycle would give back more, or less: that share fades as the force grows.
    More than its own it cannot: what is too much is crushed.

    Parameters
    ----------
    force : float
        [N]
    given_back : float
        Penetration that the rock would give back from it [m].
    """
    if force > 0.0:
        own = fresh_recovery(par, s, s.p, fresh_force(par, s, s.p))
        s.resumed_share = min(given_back / own, 1.0)
        s.resumed_force = force


@merged
def penetration_at(par, s, force):
    """Penetration of a drilling cycle at a force [m]."""
    if s.reload_to > s.reload_from:
        way = force / s.reload_stiffness
        if s.reload_from + way <= s.reload_to:
            return s.reload_from + way
    part = part_at(par, s.k_r, force)
    if par.chipping_penetration == 0.0 or part <= s.chipping_from:
        return part
    way = (part - s.chipping_from) / CHIPPING_SLOPE
    if way <= par.chipping_penetration:
        return s.chipping_from + way
    return part + (1.0 - CHIPPING_SLOPE) * par.chipping_penetration


@kernel
def left_depth(par, depth):
    """Depth that is left of a crater when its cuttings have been flushed (docs/model.md, 20d) [m].

    Parameters
    ----------
    depth : float
        Of the crater below the surface of the rock [m].
    """
    if par.cuttings == Cuttings.NONE or depth <= 0.0:
        return 0.0
    if par.left == 1:
        return depth
    return unflushed(par, depth)


@kernel
def unflushed(par, depth):
    """Depth that flushing leaves of a crater [m]."""
    removed = par.removed_share * depth
    if par.removal_exponent != 1.0:
        removed *= exp((par.removal_exponent - 1.0) * log(depth / CRATER))
    return max(depth - removed, 0.0)
