"""How long the gap between piston and bit stays open while both are close.

Energy bounds the gap too coarsely there. Within one mode of the bit the motion
of both ends is linear in the present waves: two products show the gap at the
end of each of the next steps (docs/numerics.md, section 5).
"""

from __future__ import annotations

from percussion_model.physics.drive import drive_force
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.records import Mode, Piston
from percussion_model.solvers.wave.bar import strain_offset
from percussion_model.solvers.wave.leaps.contact_leap import load_contact, look_ahead
from percussion_model.solvers.wave.leaps.linear import load, pad
from percussion_model.solvers.wave.records import Coef

FF = int(Mode.FF)
ELASTIC = int(Piston.ELASTIC)
TOP, BOTTOM, STATIC = int(Coef.TOP), int(Coef.BOTTOM), int(Coef.STATIC)


@merged
def top_at_rest(c, n, a):
    """Way from the bottom end to the top end of a bar at rest [m].

    Positive where the static load of the body acceleration `a` shortens it.
    """
    way = 0.0
    for i in range(n):
        way += 2.0 * a * c[STATIC, i] * (c[TOP, i] + c[BOTTOM, i])
    return way


@kernel
def watch_gap(par, s, wp, cp, wb, cb, of_bit, of_piston, x, y, steps):
    """Number of steps, at most `steps`, before which no gap closes.

    Nor within half a step after, so that a closure finds its step uncut
    (docs/numerics.md, section 6).

    Parameters
    ----------
    of_bit : float array, shape (modes, size, WATCHED)
        By mode: motion of the bit's top end, less the mean motion in FF.
    of_piston : float array, shape (size, WATCHED)
        Strain offset of the piston's bottom end.
    x, y : float array
        Scratch.
    steps : int
        Over which the bit stays in its mode, at most WATCHED.
    """
    r = 2 * s.parity
    a_b = par.gravity + s.feed / par.mass_b
    v_b, base = 0.0, 0.0
    if s.mode == FF:
        v_b = s.v_b
        load(x, wb, cb, par.n_b, r, v_b, 0.0)
        pad(x, 2 * par.n_b, par.size_r)
        base = -strain_offset(wb, cb, par.n_b, r, TOP)
    else:
        base = load_contact(par, s, wb, cb, x) + top_at_rest(cb, par.n_b, a_b)
        base -= s.p + strain_offset(wb, cb, par.n_b, r, BOTTOM)
        base -= strain_offset(wb, cb, par.n_b, r, TOP)
        a_b = 0.0  # part of the map
    look_ahead(of_bit[s.mode], par.size_r, x, y, steps, False)
    if par.piston == ELASTIC:
        load(x, wp, cp, par.n_p, r, s.v_p, 0.0)
        pad(x, 2 * par.n_p, par.size_p)
        look_ahead(of_piston, par.size_p, x, y, steps, True)
        base -= strain_offset(wp, cp, par.n_p, r, BOTTOM)
    base += s.gap
    v = v_b - s.v_p
    a = a_b - par.gravity - drive_force(par, s) / par.mass_p
    before = s.gap
    for k in range(steps):
        t = (k + 1) * par.dt
        gap = base + y[k] + (v + 0.5 * a * t) * t
        if gap + 0.5 * min(gap - before, 0.0) <= 0.0:
            return k
        before = gap
    return steps
