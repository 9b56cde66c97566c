"""What is wrong with a state from outside, by which kernels count and index."""

from __future__ import annotations

from percussion_model.physics.kernel import kernel
from percussion_model.solvers.modal.advance import LONGEST
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.modal.records import JOINED, LONGEST_STRIDE, STEP

# What is said, by number; facts are those that `find_fault` gives.
FAULTS = (
    "",
    "active = {0:.0f}, of {1:.0f} modes",
    "form = {0:.0f}, with closed = {1:.0f}",
    "law = {0:.0f}, in form {1:.0f}",
    "pairs = {0:.0f}, in law {1:.0f}",
    "pairs = {0:.0f}, which is no multiple of {1:.0f}",
    "leap_end = {0:.0f}, with law = {1:.0f}",
    "leap_end = {0:.0f}, at {1:.0f} with leaps of " + f"{LONGEST} ticks at most",
    "piston_time = {0:.0f}, after {1:.0f}",
    "its time of {0!r} s, far before {1!r} s",
)


@kernel
def find_fault(s, form_sizes, law_sizes, tick, t):
    """Find what is wrong with a state whose numbers are within their limits.

    Parameters
    ----------
    s : MODAL_STATE record
    form_sizes, law_sizes : int array
        Modes of each form, pairs of each law.
    tick, t : float
        Unit of time, and the present [s].

    Returns
    -------
    number : int
        Place in FAULTS.
    first, second : float
        Facts.
    """
    modes = form_sizes[s.form]
    if not 0 < s.active <= modes or s.active % WIDTH != 0:
        return 1, float(s.active), float(modes)
    if (s.form >= JOINED) != (s.closed == 1):
        return 2, float(s.form), float(s.closed)
    if s.law >= 0 and s.law // 2 != s.form:
        return 3, float(s.law), float(s.form)
    if s.law >= 0 and not 0 < s.pairs <= law_sizes[s.law]:
        return 4, float(s.pairs), float(s.law)
    if s.pairs % WIDTH != 0:
        return 5, float(s.pairs), float(WIDTH)
    if s.leap_end >= 0 and s.law < 0:
        return 6, float(s.leap_end), float(s.law)
    if s.leap_end >= 0 and not s.time < s.leap_end <= s.time + LONGEST:
        return 7, float(s.leap_end), float(s.time)
    if s.parked == 1 and not s.piston_time <= s.time:
        return 8, float(s.piston_time), float(s.time)
    if not t <= max(s.time + (LONGEST_STRIDE << STEP), s.leap_end) * tick:
        return 9, s.time * tick, t
    return 0, 0.0, 0.0
