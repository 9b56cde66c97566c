"""Arrays and records of kernels in plain memory.

Memory is known by its address, a whole number. A directory says where its arrays are: in each
of its rows stand the offset [bytes] and up to four dimensions.
"""

from __future__ import annotations

from percussion_model.engine.records import LINE
from percussion_model.physics.kernel import DISABLED, preparing

if DISABLED:
    from percussion_model.engine.plain_memory import (
        allocate,
        copy_to,
        floats_in,
        literal_unroll,
        merging,
        new_record,
        records_at,
        viewing,
        words_in,
    )
else:
    from percussion_model.engine.compiled_memory import (
        allocate,
        copy_to,
        floats_in,
        literal_unroll,
        merging,
        new_record,
        records_at,
        viewing,
        words_in,
    )

__all__ = ["allocate", "merging", "new_record", "records_at", "viewing", "words_in"]


@preparing
def hold(array):
    """Keep an array until here: numba frees it after its last use, and a record of it is none."""
    return len(array)


@viewing
def words_at(address, count):
    """Whole numbers at an address."""
    return words_in(address, (count,))


@viewing
def floats_at(address, count):
    """Numbers at an address."""
    return floats_in(address, (count,))


@viewing
def matrix_at(address, rows, columns):
    """Numbers at an address as a matrix."""
    return floats_in(address, (rows, columns))


@viewing
def words_1(base, entries, k):
    """Whole numbers of a directory."""
    return words_in(base + entries[k, 0], (entries[k, 1],))


@viewing
def words_2(base, entries, k):
    """The same in two dimensions."""
    return words_in(base + entries[k, 0], (entries[k, 1], entries[k, 2]))


@viewing
def floats_1(base, entries, k):
    """Numbers of a directory."""
    return floats_in(base + entries[k, 0], (entries[k, 1],))


@viewing
def floats_2(base, entries, k):
    """The same in two dimensions."""
    return floats_in(base + entries[k, 0], (entries[k, 1], entries[k, 2]))


@viewing
def floats_3(base, entries, k):
    """The same in three dimensions."""
    shape = (entries[k, 1], entries[k, 2], entries[k, 3])
    return floats_in(base + entries[k, 0], shape)


@viewing
def floats_4(base, entries, k):
    """The same in four dimensions."""
    shape = (entries[k, 1], entries[k, 2], entries[k, 3], entries[k, 4])
    return floats_in(base + entries[k, 0], shape)


@viewing
def lines(count):
    """Bytes of so many, in whole lines."""
    return (count + LINE - 1) // LINE * LINE


@viewing
def put(base, entries, k, offset, array):
    """Copy an array to an offset and enter it in a directory; the offset behind it."""
    copy_to(base + offset, array)
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
