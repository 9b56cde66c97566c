"""The decorators of every kernel."""

from __future__ import annotations

from numba import njit

# `_nrt=False` leaves out numba's runtime: arrays are passed without reference
# counting (which took most of a step's time), and a kernel that allocates does
# not compile, so that it can always be built ahead of time.
kernel = njit(cache=True, error_model="numpy", _nrt=False)

# For what runs in every step: arrays cost nine words an argument to pass.
inlined = njit(cache=True, error_model="numpy", _nrt=False, forceinline=True)

# For what is called from one place: compiled as part of its caller alone.
merged = njit(cache=True, error_model="numpy", _nrt=False, inline="always")
