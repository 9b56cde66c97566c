"""Loading and unloading of fresh rock by a slow test: force, and slopes of a fit to it."""

from __future__ import annotations

from percussion_model.physics.kernel import kernel
from percussion_model.physics.power_law import fresh_force, fresh_recovery, loading_slope

# Change of the peak's depth that tells how the line of unloading turns, as a share of it.
TURN = 1e-6


@kernel
def weigh(par, s, p, force, first, datum, peak, model, sums):
    """Compare a measured curve with fresh rock, which loads by eq. 20b and unloads by eq. 20c.

    Parameters
    ----------
    p, force : float array, shape (n,)
        Measured [m], [N].
    first : int
        How many data are of loading.
    datum, peak : float
        Penetrations at which the rock is touched and at which unloading begins, above it [m].
    model : float array, shape (n,)
        Filled with the force of the rock [N].
    sums : float array, shape (7,)
        Zeros, to which are added: the sum of squares of measured less computed force; the matrix
        of its normal equations for datum and peak, of three numbers, and their right-hand side,
        of two; the least number of data under force in a branch.
    """
    depth = peak - datum
    top = fresh_force(par, s, depth)
    slope = top / fresh_recovery(par, s, depth, top)
    rise = loading_slope(par, s, depth)
    more = depth * (1.0 + TURN)
    beyond = fresh_force(par, s, more)
    turn = beyond / fresh_recovery(par, s, more, beyond) - slope
    turn /= TURN * depth
    loaded, unloaded = 0, 0
    for k in range(len(p)):
        by_datum, by_peak = 0.0, 0.0
        if k < first:
            here = fresh_force(par, s, p[k] - datum) if p[k] > datum else 0.0
            if here > 0.0:
                loaded += 1
                by_datum = -loading_slope(par, s, p[k] - datum)
        else:
            here = top - slope * (peak - p[k])
            if here > 0.0:
                unloaded += 1
                by_datum = turn * (peak - p[k]) - rise
                by_peak = -by_datum - slope
            else:
                here = 0.0
        model[k] = here
        off = force[k] - here
        sums[0] += off * off
        sums[1] += by_datum * by_datum
        sums[2] += by_datum * by_peak
        sums[3] += by_peak * by_peak
        sums[4] += by_datum * off
        sums[5] += by_peak * off
    sums[6] = min(loaded, unloaded)
