"""Instructions of compiled code that call functions of FMUs at their addresses."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types

_BYTE, _WORD, _INT, _DOUBLE = (
    ir.IntType(8).as_pointer(), ir.IntType(64), ir.IntType(32), ir.DoubleType(),
)  # fmt: skip


def _called(*parameters: Any) -> Any:
    """Code that calls a function at an address, its first argument, with the others."""
    shape = ir.FunctionType(_INT, parameters)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        function = builder.inttoptr(arguments[0], shape.as_pointer())
        given = [
            builder.inttoptr(one, _BYTE) if kind is _BYTE else one
            for one, kind in zip(arguments[1:], parameters, strict=True)
        ]
        return builder.call(function, given)

    return code


def exchange(
    typing: Any, function: Any, component: Any, references: Any, count: Any, values: Any
) -> tuple[Any, Any]:
    """Call a getter or a setter of an FMU; all arguments are addresses but for the count."""
    word = types.int64
    return types.int32(word, word, word, word, word), _called(_BYTE, _BYTE, _WORD, _BYTE)


def do_step(
    typing: Any, function: Any, component: Any, time: Any, step: Any, forward: Any
) -> tuple[Any, Any]:
    """Call `fmi2DoStep`."""
    word, real = types.int64, types.float64
    shape = types.int32(word, word, real, real, types.int32)
    return shape, _called(_BYTE, _DOUBLE, _DOUBLE, _INT)
