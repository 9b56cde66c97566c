"""Cuttings that flushing leaves in the crater: eqs 24 and 25 of the paper, with units."""

from __future__ import annotations

from percussion_model.physics.elementary import exp, log
from percussion_model.physics.kernel import kernel

# Depth of a crater of which `rock.removed_share` is removed [m].
CRATER = 1e-3


@kernel
def left_depth(par, depth):
    """Depth that is left of a crater when its cuttings have been flushed (docs/model.md, 20d) [m].

    Parameters
    ----------
    depth : float
        Of the crater below the surface of the rock [m].
    """
    if par.cuttings == 0 or depth <= 0.0:
        return 0.0
    removed = par.removed_share * depth
    if par.removal_exponent != 1.0:
        removed *= exp((par.removal_exponent - 1.0) * log(depth / CRATER))
    return max(depth - removed, 0.0)
