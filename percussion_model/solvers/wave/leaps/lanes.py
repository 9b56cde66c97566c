"""Sixteen numbers side by side, for the products of leaps.

Most of the time of a run goes into products of small matrices, and a compiler
left to itself keeps their sums in memory. A `Lanes` value stays in registers.
The instructions are plain arithmetic in a fixed order: no platform rounds it
otherwise than another.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core.datamodel import PrimitiveModel, register_default
from numba.extending import intrinsic

WIDTH = 16
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


class Lanes(types.Type):  # type: ignore[misc]
    """Type of a `Lanes` value in kernels."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


@register_default(Lanes)
class _LanesModel(PrimitiveModel):  # type: ignore[misc]
    """Kept as one vector."""

    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, _VECTOR)


_lanes = Lanes()


def _pointer(context, builder, array_type, array, indices):
    """Address of an element of a contiguous array as one of a vector."""
    made = context.make_array(array_type)(context, builder, array)
    element = cgutils.get_item_pointer(
        context, builder, array_type, made, indices, wraparound=False, boundscheck=False
    )
    return builder.bitcast(element, _VECTOR.as_pointer())


def _spread(builder, scalar):
    """A vector of one number."""
    first = builder.insert_element(
        ir.Constant(_VECTOR, ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0)
    )
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, ir.Constant(_VECTOR, ir.Undefined), zeros)


@intrinsic
def _no_lanes(typing):
    def generate(context, builder, signature, args):
        return ir.Constant(_VECTOR, [0.0] * WIDTH)

    return _lanes(), generate


@intrinsic
def _add_scaled(typing, lanes, array, row, column, scale):
    def generate(context, builder, signature, args):
        total, array, row, column, scale = args
        pointer = _pointer(context, builder, signature.args[1], array, [row, column])
        numbers = builder.load(pointer, align=8)
        return builder.fadd(total, builder.fmul(numbers, _spread(builder, scale)))

    return _lanes(_lanes, array, types.intp, types.intp, types.float64), generate


@intrinsic
def _load_lanes(typing, array, start):
    def generate(context, builder, signature, args):
        return builder.load(
            _pointer(context, builder, signature.args[0], args[0], [args[1]]), align=8
        )

    return _lanes(array, types.intp), generate


@intrinsic
def _store_sum(typing, array, start, first, second):
    def generate(context, builder, signature, args):
        pointer = _pointer(context, builder, signature.args[0], args[0], [args[1]])
        builder.store(builder.fadd(args[2], args[3]), pointer, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, _lanes, _lanes), generate


def _no_numbers():
    return np.zeros(WIDTH)


def _add_numbers(lanes, array, row, column, scale):
    return lanes + array[row, column : column + WIDTH] * scale


def _load_numbers(array, start):
    return array[start : start + WIDTH].copy()


def _store_numbers(array, start, first, second):
    array[start : start + WIDTH] = first + second


# The same for kernels that run as plain Python.
_PLAIN = bool(config.DISABLE_JIT)
no_lanes = _no_numbers if _PLAIN else _no_lanes
add_scaled = _add_numbers if _PLAIN else _add_scaled
load_lanes = _load_numbers if _PLAIN else _load_lanes
store_sum = _store_numbers if _PLAIN else _store_sum
