"""The place under the bit from blow to blow: what is left of craters, and how the bit climbs.

The bit moves on in a frame in which it does not climb out of its craters; `pit` is how deep it
is in them, `climb` how far the frame has gone up with the bit (docs/model.md, section 6).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from percussion_model.components import COMPONENTS, Component
from percussion_model.physics.feed import feed_on_bit, note_recoil
from percussion_model.physics.kernel import LEAST_DIVISOR, composed, inlined, merged
from percussion_model.physics.power_law import unflushed
from percussion_model.physics.records import Cuttings
from percussion_model.physics.rock import is_loading, leave_pit, pressed_depth


@composed
def _no_push(s: Any) -> float:
    return 0.0


def _and_push(before: Callable, one: Component) -> Callable:
    held = f"f_{one.name}_bit"

    @composed
    def add(s: Any) -> float:
        return before(s) + s[held]

    return add if one.takes_feed else before


# passed_on(s): force on the bit of components that take the feed [N].
passed_on: Callable = _no_push
for _one in COMPONENTS:
    passed_on = _and_push(passed_on, _one)


@composed
def _nothing_kept(par: Any, s: Any, period: float) -> float:
    return 0.0


@composed
def _no_more(
    par: Any, s: Any, period: float, kept: float, rest: float, push: float, climb: float
) -> None:
    pass


def _or_kept(before: Callable, one: Component) -> Callable:
    keep, present = one.kept, f"with_{one.name}"
    if keep is None:
        return before

    @composed
    def kept(par: Any, s: Any, period: float) -> float:
        share = before(par, s, period)
        if par[present] == 1:
            share = max(share, keep(par, s, period))
        return share

    return kept


def _and_next(before: Callable, one: Component) -> Callable:
    follow, present = one.next_blow, f"with_{one.name}"
    if follow is None:
        return before

    @composed
    def go_on(
        par: Any, s: Any, period: float, kept: float, rest: float, push: float, climb: float
    ) -> None:
        before(par, s, period, kept, rest, push, climb)
        if par[present] == 1:
            follow(par, s, period, kept, rest, push, climb)

    return go_on


# kept_of(par, s, period): share of their depth that craters keep; without rotation none.
kept_of = _nothing_kept
# go_on(par, s, period, kept, rest, push, climb): all components that follow blows.
go_on = _no_more
for _one in COMPONENTS:
    kept_of, go_on = _or_kept(kept_of, _one), _and_next(go_on, _one)

# More energy than any [J].
LARGEST = 1e60


@inlined
def renew(par, s, kept):
    """Leave a share of the depth of the craters under the bit, whose force stays; the real share.

    What carries the bit now is left in any case.
    """
    before = s.p_u
    if before <= 0.0:
        return kept
    left = max(kept * before, (s.gamma - 1.0) * max(s.p - s.p_u, 0.0))
    shift = max(before - left, 0.0)
    s.p_u -= shift
    s.p -= shift
    s.x_r += shift
    return s.p_u / max(before, LEAST_DIVISOR)


@inlined
def lift_bit(par, s, feed, push, way):
    """Let the bit get higher by a way, against feed, drive and weight; the work of this [J]."""
    weight = (par.mass_p + par.mass_b) * par.gravity
    s.pit -= way
    s.climb += way
    s.e_feed -= feed * way
    s.e_drive -= push * way
    s.e_gravity -= weight * way
    return (feed + push + weight) * way


@merged
def move_place(par, s, time):
    """Move the bit on to the place of the blow that begins at `time`.

    A loading under way is parted there; where its line would change, the next blow moves the bit.
    """
    period, loads = time - s.place_time, is_loading(s)
    if (par.places == 0 and par.on_casing == 0) or period <= 0.0 or (loads and par.left == 1):
        return
    given = s.i_drive + s.i_on_bit
    push = (given - s.place_drive) / max(period, LEAST_DIVISOR)
    s.place_time, s.place_drive = time, given
    feed = feed_on_bit(par, s)
    if par.feed_taken == 1:
        feed = passed_on(s)
    if par.on_casing == 1:
        note_recoil(par, s, push)
    if par.places == 0:
        return
    if loads:
        leave_pit(par, s)
        s.crushed_before, s.cycle_depth = s.crushed, pressed_depth(par, s)
        s.cycle_from = LARGEST  # it reloads nothing
    kept = kept_of(par, s, period)
    if par.cuttings == Cuttings.BY_BLOW and s.p_u > 0.0:
        kept = unflushed(par, s.p_u) / max(s.p_u, LEAST_DIVISOR)
    if par.left == 1:
        kept = renew(par, s, kept)
    climb = (1.0 - kept) * s.pit
    rest = feed + par.mass_b * par.gravity
    go_on(par, s, period, kept, rest, rest + push + par.mass_p * par.gravity, climb)
    s.e_climb += lift_bit(par, s, feed, push, climb)
    if par.left == 0:  # what is crushed again counts anew
        s.e_refill += lift_bit(par, s, feed, push, s.pit)
