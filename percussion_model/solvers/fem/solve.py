"""Factors of the stage matrix, and solving with them.

M + h mu C + (h mu)^2 K is complex and tridiagonal. Piston and bit are eliminated
towards the contact, where two unknowns are left (docs/numerics.md, section 10).
"""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.rock import damping, present_line
from percussion_model.solvers.fem.records import Factor, Key, Mesh, Stage

ROWS = len(Factor)

# Factorisations: of the whole step, of any other.
WHOLE, PART = 0, 1


@merged
def eliminate(par, c, f, at, h, low, last, way):
    """Factorise the rows from `low` up to `last`, `way` +1 downwards, -1 upwards.

    The first row of the bit, at the rock, holds already what the rock adds.
    """
    h_re = h * par.mu_re
    h_im = h * par.mu_im
    # h mu (eta + h mu) goes with the stiffness of the bars
    bars_re = h_re * par.eta + h_re * h_re - h_im * h_im
    bars_im = h_im * par.eta + 2.0 * h_re * h_im
    inverse_re = 0.0
    inverse_im = 0.0
    i = low
    for k in range((last - low) * way + 1):
        side = i - 1 if way > 0 else i
        side_re = 0.0
        side_im = 0.0
        if k > 0:
            side_re = c[Mesh.COUPLING, side] - bars_re * c[Mesh.STIFFNESS, side]
            side_im = -bars_im * c[Mesh.STIFFNESS, side]
        low_re = side_re * inverse_re - side_im * inverse_im
        low_im = side_re * inverse_im + side_im * inverse_re
        re = f[at + Factor.PIVOT_RE, i] + c[Mesh.MASS, i] + bars_re * c[Mesh.SPRINGS, i]
        im = f[at + Factor.PIVOT_IM, i] + bars_im * c[Mesh.SPRINGS, i]
        re -= low_re * side_re - low_im * side_im
        im -= low_re * side_im + low_im * side_re
        size = re * re + im * im
        inverse_re = re / size
        inverse_im = -im / size
        f[at + Factor.LOW_RE, i] = low_re
        f[at + Factor.LOW_IM, i] = low_im
        f[at + Factor.PIVOT_RE, i] = inverse_re
        f[at + Factor.PIVOT_IM, i] = inverse_im
        if i == last:
            f[at + Factor.PIVOT_RE, i] = re
            f[at + Factor.PIVOT_IM, i] = im
        i += way


@kernel
def factorise(par, c, f, slot, h, K, C):
    """Factorise the stage matrix of a step and a rock, gap left open, into a slot of `f`.

    The piston is eliminated from its top, the bit from the rock; they meet at
    the contact, whose spring enters with the solution.
    """
    at = slot * ROWS
    n = par.n_p + par.n_b
    for i in range(n):
        f[at + Factor.PIVOT_RE, i] = 0.0
        f[at + Factor.PIVOT_IM, i] = 0.0
    h_re = h * par.mu_re
    h_im = h * par.mu_im
    f[at + Factor.PIVOT_RE, n - 1] = h_re * C + (h_re * h_re - h_im * h_im) * K
    f[at + Factor.PIVOT_IM, n - 1] = h_im * C + 2.0 * h_re * h_im * K
    if par.n_p > 0:
        eliminate(par, c, f, at, h, 0, par.n_p - 1, 1)
    eliminate(par, c, f, at, h, n - 1, par.n_p, -1)
    f[at + Factor.KEY, Key.STEP] = h
    f[at + Factor.KEY, Key.STIFFNESS] = K
    f[at + Factor.KEY, Key.DAMPING] = C


@inlined
def factors(par, s, c, f, h):
    """Slot of the factorisation for a step, made anew where it is not there."""
    slot = WHOLE if h == par.dt else PART
    at = slot * ROWS
    K, _ = present_line(par, s)
    C = damping(s)
    known = f[at + Factor.KEY, Key.STEP] == h
    if not (
        known and f[at + Factor.KEY, Key.STIFFNESS] == K and f[at + Factor.KEY, Key.DAMPING] == C
    ):
        factorise(par, c, f, slot, h, K, C)
    return slot


@inlined
def meet_at_contact(par, s, f, at, x, h):
    """Solve for the two nodes at the contact, whose spring couples them while it is closed."""
    lower = par.n_p
    re = x[Stage.RE, lower]
    im = x[Stage.IM, lower]
    b_re = f[at + Factor.PIVOT_RE, lower]
    b_im = f[at + Factor.PIVOT_IM, lower]
    if s.closed == 0:
        size = b_re * b_re + b_im * b_im
        x[Stage.RE, lower] = (re * b_re + im * b_im) / size
        x[Stage.IM, lower] = (im * b_re - re * b_im) / size
    if par.n_p == 0:
        return
    upper = par.n_p - 1
    up_re = x[Stage.RE, upper]
    up_im = x[Stage.IM, upper]
    p_re = f[at + Factor.PIVOT_RE, upper]
    p_im = f[at + Factor.PIVOT_IM, upper]
    if s.closed == 0:
        size = p_re * p_re + p_im * p_im
        x[Stage.RE, upper] = (up_re * p_re + up_im * p_im) / size
        x[Stage.IM, upper] = (up_im * p_re - up_re * p_im) / size
        return
    # [p + q, -q; -q, b + q]: its determinant is p b + q (p + b), without cancellation
    h_re = h * par.mu_re
    h_im = h * par.mu_im
    q_re = par.k_c * (h_re * h_re - h_im * h_im)
    q_im = par.k_c * 2.0 * h_re * h_im
    sum_re = p_re + b_re
    sum_im = p_im + b_im
    det_re = p_re * b_re - p_im * b_im + q_re * sum_re - q_im * sum_im
    det_im = p_re * b_im + p_im * b_re + q_re * sum_im + q_im * sum_re
    both_re = q_re * (re + up_re) - q_im * (im + up_im)
    both_im = q_re * (im + up_im) + q_im * (re + up_re)
    top_re = up_re * b_re - up_im * b_im + both_re
    top_im = up_re * b_im + up_im * b_re + both_im
    low_re = re * p_re - im * p_im + both_re
    low_im = re * p_im + im * p_re + both_im
    size = det_re * det_re + det_im * det_im
    x[Stage.RE, upper] = (top_re * det_re + top_im * det_im) / size
    x[Stage.IM, upper] = (top_im * det_re - top_re * det_im) / size
    x[Stage.RE, lower] = (low_re * det_re + low_im * det_im) / size
    x[Stage.IM, lower] = (low_im * det_re - low_re * det_im) / size


@inlined
def forward(f, at, x, i, re, im):
    """Eliminate row `i`, with what the row before it came to."""
    next_re = x[Stage.RE, i] - f[at + Factor.LOW_RE, i] * re + f[at + Factor.LOW_IM, i] * im
    next_im = x[Stage.IM, i] - f[at + Factor.LOW_RE, i] * im - f[at + Factor.LOW_IM, i] * re
    x[Stage.RE, i] = next_re
    x[Stage.IM, i] = next_im
    return next_re, next_im


@inlined
def backward(f, at, x, i, solved, re, im):
    """Solve for row `i`, with the solution of the row `solved` next to it."""
    pivot_re = (
        x[Stage.RE, i] * f[at + Factor.PIVOT_RE, i] - x[Stage.IM, i] * f[at + Factor.PIVOT_IM, i]
    )
    pivot_im = (
        x[Stage.RE, i] * f[at + Factor.PIVOT_IM, i] + x[Stage.IM, i] * f[at + Factor.PIVOT_RE, i]
    )
    next_re = pivot_re - f[at + Factor.LOW_RE, solved] * re + f[at + Factor.LOW_IM, solved] * im
    next_im = pivot_im - f[at + Factor.LOW_RE, solved] * im - f[at + Factor.LOW_IM, solved] * re
    x[Stage.RE, i] = next_re
    x[Stage.IM, i] = next_im
    return next_re, next_im


@inlined
def substitute(par, s, f, slot, x, h):
    """Solve with a factorisation; the solution replaces rows RE, IM.

    Piston and bit take their turns in one loop: each waits for its own last
    value, so that two together take hardly longer than one.
    """
    at = slot * ROWS
    n_p = par.n_p
    last = n_p + par.n_b - 1
    both = max(min(n_p, par.n_b) - 1, 0)
    a, b = x[Stage.RE, 0], x[Stage.IM, 0]
    c, d = x[Stage.RE, last], x[Stage.IM, last]
    for k in range(both):
        a, b = forward(f, at, x, 1 + k, a, b)
        c, d = forward(f, at, x, last - 1 - k, c, d)
    for k in range(both, n_p - 1):
        a, b = forward(f, at, x, 1 + k, a, b)
    for k in range(both, par.n_b - 1):
        c, d = forward(f, at, x, last - 1 - k, c, d)
    meet_at_contact(par, s, f, at, x, h)
    c, d = x[Stage.RE, n_p], x[Stage.IM, n_p]
    if n_p > 0:
        a, b = x[Stage.RE, n_p - 1], x[Stage.IM, n_p - 1]
    for k in range(both):
        a, b = backward(f, at, x, n_p - 2 - k, n_p - 1 - k, a, b)
        c, d = backward(f, at, x, n_p + 1 + k, n_p + k, c, d)
    for k in range(both, n_p - 1):
        a, b = backward(f, at, x, n_p - 2 - k, n_p - 1 - k, a, b)
    for k in range(both, par.n_b - 1):
        c, d = backward(f, at, x, n_p + 1 + k, n_p + k, c, d)
