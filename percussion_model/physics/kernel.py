"""Decorators of every kernel, and the check that no stale compiled code is loaded."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit, types
from numba.extending import register_jitable

STAMP = "kernels.sha256"
# Folders with functions that kernels of other files call.
CALLEES = ("physics", "scene", "solvers", "verification/accuracy")


def drop_stale_kernels(folder: Path) -> None:
    """Delete compiled kernels below `folder` where a source in `CALLEES` has changed.

    Numba's cache looks at the file of a function alone, not at those of the
    functions that it calls; after an edit or an update it would go on with
    old code. A cache that the user keeps elsewhere is left alone.
    """
    if os.environ.get("NUMBA_CACHE_DIR"):
        return
    digest = hashlib.sha256()
    for source in sorted(path for name in CALLEES for path in (folder / name).rglob("*.py")):
        digest.update(source.read_bytes())
    stamp = Path(__file__).parent / "__pycache__" / STAMP
    try:
        if stamp.is_file() and stamp.read_text() == digest.hexdigest():
            return
        for compiled in [*folder.rglob("*.nbi"), *folder.rglob("*.nbc")]:
            compiled.unlink(missing_ok=True)
        stamp.parent.mkdir(exist_ok=True)
        stamp.write_text(digest.hexdigest())
    except OSError:
        return  # a folder that cannot be written holds no cache of ours


drop_stale_kernels(Path(__file__).parents[1])


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
kernel = njit(cache=True, error_model="numpy", _nrt=False)


def plain(function: Callable) -> Callable:
    """Let kernels call what stays plain Python: it calls kernels for all that takes long.

    For what is put together before a run. Compiled for Python, it would take longer to be
    compiled and loaded than it takes to run.
    """
    register_jitable(function)
    return function


def preparing(function: Callable) -> Callable:
    """Compile what is done before a run: it may allocate, and constants are numbers as others.

    Ahead of time, the library brings the memory. Numba would compile a function anew for each
    constant that it is called with; here that takes longer than it spares.
    """
    compiled = njit(cache=True, error_model="numpy")(function)
    find: Any = getattr(compiled, "get_call_template", None)  # none where nothing is compiled

    def find_plain(arguments: Any, named: Any) -> Any:
        named = {name: types.unliteral(kind) for name, kind in named.items()}
        return find([types.unliteral(kind) for kind in arguments], named)

    if find is not None:
        compiled.get_call_template = find_plain
    return compiled


# For calls of other libraries, which may wait for threads that want to run Python.
nogil = njit(cache=True, error_model="numpy", _nrt=False, nogil=True)

# For what runs in every step: arrays cost nine words an argument to pass.
inlined = njit(cache=True, error_model="numpy", _nrt=False, forceinline=True)

# For long recursions, whose latency counts: a product and a sum may be one operation
# with one rounding. The bits are the same in every run of one build.
fused = njit(cache=True, error_model="numpy", _nrt=False, forceinline=True, fastmath={"contract"})

# For what is called from one place: compiled as part of its caller alone.
merged = njit(cache=True, error_model="numpy", _nrt=False, inline="always")

# For kernels put together at import, which a cache could not tell apart: part of their callers.
composed = njit(error_model="numpy", _nrt=False, forceinline=True)
