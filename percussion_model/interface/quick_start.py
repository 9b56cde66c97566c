"""Faster start of a process of the command line.

A library must not do this to the process of its caller.
"""

from __future__ import annotations

import gc
import sys

# Starting makes hundreds of thousands of objects that stay [objects].
COLLECT_AFTER = 100_000

_own_process = False


def own_process() -> None:
    """Say that this process belongs to the command line."""
    global _own_process
    _own_process = True
    gc.set_threshold(COLLECT_AFTER)


def load_numba() -> None:
    """Load numba without scipy's linear algebra, if the process is our own.

    Numba looks for a BLAS in scipy, whose import takes longer than all of our
    kernels; none of them calls it.
    """
    if not _own_process or "numba" in sys.modules or "scipy.linalg" in sys.modules:
        return
    sys.modules["scipy.linalg"] = None  # type: ignore[assignment]
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        del sys.modules["scipy.linalg"]
