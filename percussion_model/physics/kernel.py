"""Decorators of every kernel."""

from __future__ import annotations

import functools
import inspect
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import config, njit, types
from numba.extending import register_jitable

from percussion_model.physics import kept_kernels

# Folders with functions that kernels of other files call.
CALLEES = ("physics", "components", "scene", "solvers", "verification/accuracy")
PACKAGE = Path(__file__).parents[1]
# None: beside the sources, or where NUMBA_CACHE_DIR says.
FOLDER = kept_kernels.prepare(PACKAGE, CALLEES)
_log = logging.getLogger("percussion_model")


def compiled(**options: Any) -> Callable[[Callable], Any]:
    """Decorator that compiles a kernel where it is first called, and keeps it in `FOLDER`.

    Where numba finds no place for it, each process compiles it, which is told once.
    """

    def decorate(function: Callable) -> Any:
        before = config.CACHE_DIR
        config.CACHE_DIR = before if FOLDER is None else str(FOLDER)
        try:
            made = njit(cache=True, **options)(function)
        except RuntimeError:
            _tell_of_no_place()
            return njit(**options)(function)
        finally:
            config.CACHE_DIR = before
        if FOLDER is not None and hasattr(made, "stats"):
            beside = Path(inspect.getfile(function)).with_name("__pycache__")
            kept_kernels.take_along(Path(made.stats.cache_path), beside)
        return _taking_numbers(made)

    return decorate


def _taking_numbers(made: Any) -> Any:
    """Let a kernel take the constants of those that call it as numbers like others.

    Numba would compile it anew for each constant, which takes a sixth of all compiling.
    """
    find: Any = getattr(made, "get_call_template", None)  # none where nothing is compiled

    def find_plain(arguments: Any, named: Any) -> Any:
        named = {name: types.unliteral(kind) for name, kind in named.items()}
        return find([types.unliteral(kind) for kind in arguments], named)

    if find is not None:
        made.get_call_template = find_plain
    return made


@functools.cache
def _tell_of_no_place() -> None:
    _log.warning(
        "no folder can be written in which compiled kernels would be kept, so each start compiles "
        "for about a minute: NUMBA_CACHE_DIR names one"
    )


def place_to_compile(function: Callable) -> Path | None:
    """Folder in which numba will keep a kernel once it is compiled; None where it does so already.

    A kernel counts as kept where numba's index of it is there. None as well where nothing is
    compiled, or kept.
    """
    place = getattr(getattr(function, "stats", None), "cache_path", None)
    if place is None or getattr(function, "overloads", None):
        return None
    module, code = function.__module__.rpartition(".")[2], function.__code__
    name = f"{module}.{function.__qualname__}-{code.co_firstlineno}."
    folder = Path(place)
    return None if any(one.name.startswith(name) for one in folder.glob("*.nbi")) else folder


_entries: dict[Callable, Callable] = {}


def entry_of(function: Callable) -> Callable:
    """Where a call of a compiled function ends up, or the function itself.

    Numba looks at the types of all arguments at every call, which takes longer than a
    short kernel where they are records. For callers whose arguments never change their
    types, not from object to object either: nothing looks at them any more.
    """
    overloads = getattr(function, "overloads", {})
    if len(overloads) != 1:
        return function
    if function not in _entries:  # to find it takes a while as well
        (compiled,) = overloads.values()
        _entries[function] = getattr(compiled, "entry_point", function)
    return _entries[function]


# `_nrt=False` leaves out numba's runtime: arrays are passed without reference
# counting (which took most of a step's time), and a kernel that allocates does
# not compile, so that it can always be built ahead of time.
kernel = compiled(error_model="numpy", _nrt=False)


def plain(function: Callable) -> Callable:
    """Let kernels call what stays plain Python: it calls kernels for all that takes long.

    For what is put together before a run. Compiled for Python, it would take longer to be
    compiled and loaded than it takes to run.
    """
    register_jitable(function)
    return function


def preparing(function: Callable) -> Callable:
    """Compile what is done before a run: it may allocate.

    Ahead of time, the library brings the memory.
    """
    made: Callable = compiled(error_model="numpy")(function)
    return made


# For calls of other libraries, which may wait for threads that want to run Python.
nogil = compiled(error_model="numpy", _nrt=False, nogil=True)

# For what runs in every step: arrays cost nine words an argument to pass.
inlined = compiled(error_model="numpy", _nrt=False, forceinline=True)

# For long recursions, whose latency counts: a product and a sum may be one operation
# with one rounding. The bits are the same in every run of one build.
fused = compiled(error_model="numpy", _nrt=False, forceinline=True, fastmath={"contract"})

# For what is called from one place: compiled as part of its caller alone.
merged = compiled(error_model="numpy", _nrt=False, inline="always")

# For kernels put together at import, which a cache could not tell apart: part of their callers.
composed = njit(error_model="numpy", _nrt=False, forceinline=True)
