"""What numba has to know of `lanes`: a type for eight numbers, and instructions."""

from __future__ import annotations

import operator

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import PrimitiveModel, register_default
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature

WIDTH = 8  # that of `lanes`
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


class Lanes(types.Type):  # type: ignore[misc]
    """Type of eight numbers in kernels."""

    def __init__(self) -> None:
        super().__init__(name="Eight")


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


def load(typing, array, row, start):
    """Eight numbers of a row."""

    def generate(context, builder, signature, args):
        pointer = _pointer(context, builder, signature.args[0], args[0], [args[1], args[2]])
        return builder.load(pointer, align=8)

    return _lanes(array, types.intp, types.intp), generate


def store(typing, array, row, start, lanes):
    """Write eight numbers into a row."""

    def generate(context, builder, signature, args):
        pointer = _pointer(context, builder, signature.args[0], args[0], [args[1], args[2]])
        builder.store(args[3], pointer, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, types.intp, _lanes), generate


def _repeat(builder, number):
    """A vector of one number."""
    undefined = ir.Constant(_VECTOR, ir.Undefined)
    first = builder.insert_element(undefined, number, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, undefined, zeros)


def spread(typing, number):
    """One number eight times."""

    def generate(context, builder, signature, args):
        return _repeat(builder, args[0])

    return _lanes(types.float64), generate


def _fold(builder, lanes, join):
    """Join both halves of a vector, both halves of that, and so on, to one number."""
    part, width = lanes, WIDTH
    while width > 1:
        width //= 2
        undefined = ir.Constant(part.type, ir.Undefined)
        kind = ir.VectorType(ir.IntType(32), width)
        halves = [
            builder.shuffle_vector(
                part, undefined, ir.Constant(kind, list(range(start, start + width)))
            )
            for start in (0, width)
        ]
        part = join(*halves)
    return builder.extract_element(part, ir.Constant(ir.IntType(32), 0))


def total(typing, lanes):
    """Sum of eight numbers."""

    def generate(context, builder, signature, args):
        return _fold(builder, args[0], builder.fadd)

    return types.float64(_lanes), generate


def totals(typing, one, other):
    """Sums of eight numbers and of eight others."""

    pair = types.UniTuple(types.float64, 2)

    def generate(context, builder, signature, args):
        undefined, whole = ir.Constant(_VECTOR, ir.Undefined), ir.IntType(32)
        kind = ir.VectorType(whole, WIDTH)
        half = WIDTH // 2
        low, high = (
            builder.shuffle_vector(
                *args,
                ir.Constant(kind, [*range(k, k + half), *range(WIDTH + k, WIDTH + k + half)]),
            )
            for k in (0, half)
        )
        part, width = builder.fadd(low, high), half
        while width > 1:
            width //= 2
            joined = [
                ir.Constant(
                    ir.VectorType(whole, 2 * width),
                    [
                        *range(k, k + width),
                        *range(2 * width + k, 3 * width + k),
                    ],
                )
                for k in (0, width)
            ]
            undefined = ir.Constant(part.type, ir.Undefined)
            low, high = (builder.shuffle_vector(part, undefined, one) for one in joined)
            part = builder.fadd(low, high)
        found = [builder.extract_element(part, ir.Constant(whole, place)) for place in range(2)]
        return context.make_tuple(builder, pair, found)

    return pair(_lanes, _lanes), generate


def _picked(comparison):
    """Instruction that picks one of each two numbers."""

    def pick(typing, one, other):
        def generate(context, builder, signature, args):
            return builder.select(builder.fcmp_ordered(comparison, *args), *args)

        return _lanes(_lanes, _lanes), generate

    return pick


lower_of, higher_of = _picked("<"), _picked(">")


def root(typing, lanes):
    """Square roots."""

    def generate(context, builder, signature, args):
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(_VECTOR, [_VECTOR]), f"llvm.sqrt.v{WIDTH}f64"
        )
        return builder.call(function, args)

    return _lanes(_lanes), generate


def from_front(typing, index):
    """The index as one without a sign."""

    def generate(context, builder, signature, args):
        return args[0]

    return types.uintp(types.intp), generate


def _lower(function, instruction):
    """Make an operator of lanes one instruction: a function of its own would stay a call."""

    @infer_global(function)
    class Signatures(ConcreteTemplate):
        cases = [  # noqa: RUF012
            signature(_lanes, _lanes, _lanes),
            signature(_lanes, _lanes, types.float64),
            signature(_lanes, types.float64, _lanes),
        ]

    def generate(context, builder, signature, args):
        both = [
            one if kind is _lanes else _repeat(builder, one)
            for one, kind in zip(args, signature.args, strict=True)
        ]
        return getattr(builder, instruction)(*both)

    for case in Signatures.cases:
        lower_builtin(function, *case.args)(generate)


for _function, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _lower(_function, _instruction)
