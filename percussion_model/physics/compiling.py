"""All of kernels that needs numba: it is imported where something is compiled, not before.

Numba finds the dispatcher behind a `Kernel` by itself where another one calls it.
"""

from __future__ import annotations

import functools
import inspect
import logging
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import config, njit, types
from numba.core.typing.templates import infer, infer_global, make_intrinsic_template

from percussion_model.physics import kept_kernels

# Folders with functions that kernels of other files call.
CALLEES = ("physics", "components", "scene", "solvers", "verification/accuracy")
PACKAGE = Path(__file__).parents[1]
# None: beside the sources, or where NUMBA_CACHE_DIR says.
FOLDER = kept_kernels.prepare(PACKAGE, CALLEES)
# Numba finds the types of what a function calls within those of the function, fifty frames a call:
# 1,000, as Python has them, are too few.
DEEPEST = 5000
sys.setrecursionlimit(max(sys.getrecursionlimit(), DEEPEST))
_log = logging.getLogger("percussion_model")


def dispatcher_of(function: Callable, is_kept: bool, options: dict[str, Any]) -> Any:
    """Numba's object for a function, which compiles it where it is called.

    Where numba finds no place to keep it, each process compiles it, which is told once.

    Parameters
    ----------
    function : callable
    is_kept : bool
        Keep what is compiled in `FOLDER`.
    options : dict
        Of numba.
    """
    if not is_kept:
        return njit(**options)(function)
    before = config.CACHE_DIR
    config.CACHE_DIR = before if FOLDER is None else str(FOLDER)
    try:
        made = njit(cache=True, **options)(function)
    except RuntimeError:
        _tell_of_no_place()
        return njit(**options)(function)
    finally:
        config.CACHE_DIR = before
    if FOLDER is not None:
        beside = Path(inspect.getfile(function)).with_name("__pycache__")
        kept_kernels.take_along(Path(made.stats.cache_path), beside)
    return _taking_numbers(made)


def _taking_numbers(made: Any) -> Any:
    """Let a kernel take the constants of those that call it as numbers like others.

    Numba would compile it anew for each constant, which takes a sixth of all compiling.
    """
    find = made.get_call_template

    def find_plain(arguments: Any, named: Any) -> Any:
        named = {name: types.unliteral(kind) for name, kind in named.items()}
        return find([types.unliteral(kind) for kind in arguments], named)

    made.get_call_template = find_plain
    return made


@functools.cache
def _tell_of_no_place() -> None:
    _log.warning(
        "no folder can be written in which compiled kernels would be kept, so each start compiles "
        "for about a minute: NUMBA_CACHE_DIR names one"
    )


def instruct(function: Callable, define: Callable) -> None:
    """Let kernels that call a plain function have instructions in its place.

    Parameters
    ----------
    function : callable
        What plain Python calls.
    define : callable
        What `numba.extending.intrinsic` takes: from the types of the arguments, the signature
        and what writes the instructions.
    """
    template = make_intrinsic_template(function, define, function.__name__)
    infer(template)
    infer_global(function, types.Function(template))
