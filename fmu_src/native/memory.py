"""Arrays and records of kernels in plain memory, which the shell holds.

Memory is known by its address, a whole number. A directory says where its arrays are: in each
of its rows stand the offset [bytes] and up to four dimensions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import carray, from_dtype, literal_unroll, types
from numba.extending import intrinsic

from percussion_model.physics.kernel import compiled, preparing

# As `preparing`, but part of the caller: views of memory are cheap only there.
viewing = compiled(error_model="numpy", forceinline=True)

# For what returns records within tuples, which no compiled function can.
merging = compiled(error_model="numpy", inline="always")


@preparing
def hold(array):
    """Keep an array until here: numba frees it after its last use, and a record of it is none."""
    return len(array)


ENTRY_WORDS = 5
# Of a line of a processor's cache: parts of a memory begin at whole lines [bytes].
LINE = 64

# Memory of zeros, which begins at a line; 0 where there is none left (fmu_src/native/memory.c).
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


float_pointer = _pointer_of(types.float64)
word_pointer = _pointer_of(types.int64)


@intrinsic
def pointer_like(typing, address, array):
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


@viewing
def words_at(address, count):
    """Whole numbers at an address."""
    return carray(word_pointer(address), (count,))


@viewing
def floats_at(address, count):
    """Numbers at an address."""
    return carray(float_pointer(address), (count,))


@viewing
def matrix_at(address, rows, columns):
    """Numbers at an address as a matrix."""
    return carray(float_pointer(address), (rows, columns))


@viewing
def words_1(base, entries, k):
    """Whole numbers of a directory."""
    return carray(word_pointer(base + entries[k, 0]), (entries[k, 1],))


@viewing
def words_2(base, entries, k):
    """The same in two dimensions."""
    return carray(word_pointer(base + entries[k, 0]), (entries[k, 1], entries[k, 2]))


@viewing
def floats_1(base, entries, k):
    """Numbers of a directory."""
    return carray(float_pointer(base + entries[k, 0]), (entries[k, 1],))


@viewing
def floats_2(base, entries, k):
    """The same in two dimensions."""
    return carray(float_pointer(base + entries[k, 0]), (entries[k, 1], entries[k, 2]))


@viewing
def floats_3(base, entries, k):
    """The same in three dimensions."""
    shape = (entries[k, 1], entries[k, 2], entries[k, 3])
    return carray(float_pointer(base + entries[k, 0]), shape)


@viewing
def floats_4(base, entries, k):
    """The same in four dimensions."""
    shape = (entries[k, 1], entries[k, 2], entries[k, 3], entries[k, 4])
    return carray(float_pointer(base + entries[k, 0]), shape)


@viewing
def lines(count):
    """Bytes of so many, in whole lines."""
    return (count + LINE - 1) // LINE * LINE


@viewing
def put(base, entries, k, offset, array):
    """Copy an array to an offset and enter it in a directory; the offset behind it."""
    room = carray(pointer_like(base + offset, array), (array.size,))
    # numba makes one row of an array by a function that only Python has
    flat = carray(pointer_like(array.ctypes.data, array), (array.size,))
    room[:] = flat
    entries[k, 0] = offset
    j = 1
    for size in array.shape:
        entries[k, j] = size
        j += 1
    return offset + lines(8 * array.size)


@preparing
def table_bytes(arrays):
    """Bytes that arrays of a tuple take, each in whole lines."""
    total = 0
    for array in literal_unroll(arrays):
        total += lines(8 * array.size)
    return total


@preparing
def put_tables(base, entries, first, offset, arrays):
    """Copy arrays of a tuple to an offset, and enter them in rows from `first` on."""
    at, k = offset, first
    for array in literal_unroll(arrays):
        at = put(base, entries, k, at, array)
        k += 1  # numba unrolls no enumeration


@preparing
def enter(entries, k, offset, rows, columns):
    """Enter an array of two dimensions that lies at an offset of what moves."""
    entries[k, 0], entries[k, 1], entries[k, 2] = offset, rows, columns
