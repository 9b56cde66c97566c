"""Joints between two bars, followed in closed form through one step.

`a` is the velocity that the end above would have if it were free, less that of the end below;
both are constant over the step, so that a force F of compression between the ends lets them
approach each other with a - Y F, Y = 1/Z above + 1/Z below (docs/model.md, eqs 9-11).
"""

from __future__ import annotations

from typing import NamedTuple

from percussion_model.physics.elementary import expm1, log
from percussion_model.physics.kernel import inlined


class Met(NamedTuple):
    """What a joint did in a step.

    Attributes
    ----------
    closed : int
        1 where its shoulders touch at the end.
    gap : float
        Between them [m]; of a lossy joint its shortening.
    impulse, square : float
        Integrals of its force, compression positive, and of the square of it [N s, N2 s].
    taken : float
        What a dashpot took [J].
    """

    closed: int
    gap: float
    impulse: float
    square: float
    taken: float


@inlined
def _relaxed(rate, t):
    """Integral of exp(-rate t)."""
    return t if rate * t < 1e-12 else -expm1(-rate * t) / rate


@inlined
def shoulders(closed, gap, a, y, preload, stiffness, tau):
    """Two shoulders that only push, and a thread that pulls them together.

    Apart the thread pulls with preload + stiffness gap, so that the gap grows by
    -a - Y (preload + stiffness gap): towards a limit, or by a constant speed. Closed, they
    stay so as long as the force between the shoulders, a/Y + preload, is above zero, which with
    constant incoming waves ends only at the step's start. Without a thread this is a contact.

    Returns
    -------
    Met
    """
    opening = -a - y * preload
    if closed == 1 and opening < 0.0:
        force = a / y
        return Met(1, 0.0, force * tau, force * force * tau, 0.0)
    rate, free, closed = y * stiffness, tau, 0
    limit = 0.0
    if rate > 0.0:
        limit = opening / rate
        if opening < 0.0:
            free = log((gap - limit) / -limit) / rate
    elif opening < 0.0:
        free = -gap / opening
    if free < tau:
        closed = 1
    else:
        free = tau
    e1, e2 = _relaxed(rate, free), _relaxed(2.0 * rate, free)
    change = (opening - rate * gap) * e1
    # the force apart is first + fall (exp(-rate t)), with what it tends to
    last = -(preload + stiffness * limit)
    swing = -stiffness * (gap - limit)
    impulse = last * free + swing * e1
    square = last * last * free + 2.0 * last * swing * e1 + swing * swing * e2
    gap = gap + change
    if closed == 1:
        force, rest = a / y, tau - free
        return Met(1, 0.0, impulse + force * rest, square + force * force * rest, 0.0)
    return Met(0, max(gap, 0.0), impulse, square, 0.0)


@inlined
def yielding(short, a, y, stiffness, damping, tau):
    """A spring and a dashpot side by side between two ends.

    F = K x + c x', where the shortening x grows by a - Y F: it relaxes at the rate
    Y K / (1 + c Y). Waves far shorter than its inverse pass by the share c Y / (1 + c Y).

    Parameters
    ----------
    short : float
        Shortening at the start [m].
    """
    share = 1.0 / (1.0 + damping * y)
    rate = y * stiffness * share
    e1, e2 = _relaxed(rate, tau), _relaxed(2.0 * rate, tau)
    change = (a * share - rate * short) * e1
    last = a / y
    swing = (stiffness * short + damping * a) * share - last
    impulse = last * tau + swing * e1
    square = last * last * tau + 2.0 * last * swing * e1 + swing * swing * e2
    speeds = y * y * swing * swing * e2  # integral of x'^2, where x' = -Y swing exp(-rate t)
    return Met(1, short + change, impulse, square, damping * speeds)
