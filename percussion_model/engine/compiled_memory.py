"""Views of plain memory as numba compiles them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import carray, from_dtype, literal_unroll, types
from numba.extending import intrinsic

from percussion_model.physics.kernel import compiled

__all__ = ["literal_unroll"]

# As `preparing`, but part of the caller: views of memory are cheap only there.
viewing = compiled(error_model="numpy", forceinline=True)

# For what returns records within tuples, which no compiled function can.
merging = compiled(error_model="numpy", inline="always")

# Memory of zeros, which begins at a line; 0 where there is none left (engine/memory.c).
allocate = types.ExternalFunction("native_allocate", types.int64(types.int64))


def _pointer_of(kind: Any) -> Any:
    """Intrinsic that makes a pointer to a type out of an address."""
    pointer = types.CPointer(kind)

    @intrinsic
    def point(typing, address):
        def generate(context, builder, signature, args):
            target = context.get_value_type(pointer)
            return builder.inttoptr(args[0], target)

        return pointer(types.int64), generate

    return point


_float_pointer = _pointer_of(types.float64)
_word_pointer = _pointer_of(types.int64)


@intrinsic
def _pointer_like(typing, address, array):
    """Pointer to numbers as those of an array."""
    pointer = types.CPointer(array.dtype)

    def generate(context, builder, signature, args):
        return builder.inttoptr(args[0], context.get_value_type(pointer))

    return pointer(types.int64, array), generate


def records_at(dtype: np.dtype) -> Any:
    """Kernel that sees so many records of a type at an address."""
    point = _pointer_of(from_dtype(dtype))

    @viewing
    def view(address, count):
        return carray(point(address), (count,))

    return view


def new_record(dtype: np.dtype) -> Any:
    """Kernel that makes an array of one record of zeros."""

    @viewing
    def make():
        return np.zeros(1, dtype)

    return make


@viewing
def words_in(address, shape):
    """Whole numbers at an address as an array."""
    return carray(_word_pointer(address), shape)


@viewing
def floats_in(address, shape):
    """Numbers at an address as an array."""
    return carray(_float_pointer(address), shape)


@viewing
def copy_to(address, array):
    """Copy an array to an address."""
    room = carray(_pointer_like(address, array), (array.size,))
    # numba makes one row of an array by a function that only Python has
    room[:] = carray(_pointer_like(array.ctypes.data, array), (array.size,))
