"""Decorators of every kernel.

Numba takes a second to load. So a decorator only notes what is to be compiled; numba comes in
(`compiling`) where a kernel is called from Python, or another one that calls it is compiled.
"""

from __future__ import annotations

import functools
import os
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from types import MethodType, ModuleType
from typing import Any


def _is_set(name: str) -> bool:
    """Whether a variable of the environment is a number other than zero, as numba reads it."""
    with suppress(ValueError):
        return int(os.environ.get(name, 0)) != 0
    return False


# Compiled code may divide where the quotient is not used, and hosts trap a division by zero: a
# divisor that may be zero is at least this.
LEAST_DIVISOR = 1e-30
# Kernels run as plain Python.
DISABLED = _is_set("NUMBA_DISABLE_JIT")
# Numba without scipy's linear algebra (`own_process`).
_is_light = False
# What numba is to be taught before it compiles.
_lessons: list[Callable[[], None]] = []
# One thread at a time teaches it, and makes dispatchers.
_making = threading.RLock()


def _is_loaded(module: str) -> bool:
    return sys.modules.get(module) is not None


def own_process() -> None:
    """Load numba, once it is needed, without scipy's linear algebra.

    Numba looks for a BLAS in scipy, whose import takes longer than all of our kernels; none of
    them calls it. A library must not do so to the process of its caller.
    """
    global _is_light
    _is_light = True


def _compiler() -> ModuleType:
    """What loads numba, which is taught all there is."""
    if _is_light and not (_is_loaded("numba") or _is_loaded("scipy.linalg")):
        sys.modules["scipy.linalg"] = None  # type: ignore[assignment]
        try:
            import numba.np.arraymath  # noqa: F401
        finally:
            del sys.modules["scipy.linalg"]
    from percussion_model.physics import compiling

    with _making:
        while _lessons:
            _lessons.pop(0)()
    return compiling


def when_compiling(teach: Callable[[], None]) -> None:
    """Teach numba something once it is loaded: at once where it is."""
    if DISABLED:
        return
    _lessons.append(teach)
    if _is_loaded("numba"):
        _compiler()


class Kernel:
    """A function that is compiled where it is first needed.

    For numba it is the dispatcher that stands behind it.

    Parameters
    ----------
    function : callable
    is_scalar : bool
        It takes and returns numbers alone, and runs as plain Python until numba is loaded.
    is_kept : bool
        Keep what is compiled for other processes.
    options : dict
        Of numba.
    """

    def __init__(
        self, function: Callable, is_scalar: bool, is_kept: bool, options: dict[str, Any]
    ) -> None:
        functools.update_wrapper(self, function)
        self.__code__ = function.__code__
        self.__defaults__ = function.__defaults__
        self.py_func = function
        self._is_scalar, self._is_kept, self._options = is_scalar, is_kept, options
        self._made: Any = None

    @property
    def dispatcher(self) -> Any:
        """Numba's object for the function."""
        if self._made is None:
            with _making:
                if self._made is None:  # another thread may have come before
                    make = _compiler().dispatcher_of
                    self._made = make(self.py_func, self._is_kept, self._options)
        return self._made

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call what is compiled, after compiling it where it is not."""
        if self._is_scalar and not (_is_loaded("numba") or named):
            # numpy's numbers would stay such, and warn where others become infinite
            return self.py_func(*(one.item() if hasattr(one, "item") else one for one in arguments))
        return self.dispatcher(*arguments, **named)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # copying and pickling ask for many: numba's are no help there
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return getattr(self.dispatcher, name)

    def __get__(self, one: Any, kind: Any = None) -> Any:
        return self if one is None else MethodType(self, one)

    def __reduce__(self) -> Any:
        """A kernel is found by its name, as a function is; one made within another, remade."""
        if "<locals>" not in self.__qualname__:
            return self.__qualname__
        return Kernel, (self.py_func, self._is_scalar, self._is_kept, self._options)

    def __repr__(self) -> str:
        return f"<kernel {self.__module__}.{self.__qualname__}>"


def compiled(*, is_scalar: bool = False, is_kept: bool = True, **options: Any) -> Callable:
    """Decorator that compiles a kernel where it is first needed, and keeps it (`compiling`).

    Parameters
    ----------
    is_scalar, is_kept : bool
        See `Kernel`.
    **options
        Of numba.
    """

    def decorate(function: Callable) -> Any:
        return function if DISABLED else Kernel(function, is_scalar, is_kept, options)

    return decorate


_entries: dict[Callable, Callable] = {}


def entry_of(function: Callable) -> Callable:
    """Where a call of a compiled function ends up, or the function itself.

    Numba looks at the types of all arguments at every call, which takes longer than a
    short kernel where they are records. For callers whose arguments never change their
    types, not from object to object either: nothing looks at them any more.
    """
    if isinstance(function, Kernel) and function._made is None:
        return function  # without a call there is no entry, nor need for numba
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
# `forceinline` is said each time: else numba hands it down from a caller, and what `inlined`
# kernels call stands a hundred times in one function, which takes minutes to optimise.
kernel = compiled(error_model="numpy", _nrt=False, forceinline=False)


def plain(function: Callable) -> Callable:
    """Let kernels call what stays plain Python: it calls kernels for all that takes long.

    For what is put together before a run. Compiled for Python, it would take longer to be
    compiled and loaded than it takes to run.
    """

    def teach() -> None:
        from numba.extending import register_jitable

        register_jitable(function)

    when_compiling(teach)
    return function


def preparing(function: Callable) -> Callable:
    """Compile what is done before a run: it may allocate.

    Ahead of time, the library brings the memory.
    """
    made: Callable = compiled(error_model="numpy", forceinline=False)(function)
    return made


# For calls of other libraries, which may wait for threads that want to run Python.
nogil = compiled(error_model="numpy", _nrt=False, forceinline=False, nogil=True)

# For what runs in every step: arrays cost nine words an argument to pass.
inlined = compiled(error_model="numpy", _nrt=False, forceinline=True)

# For functions of numbers, which plain Python calls here and there, without numba.
scalar = compiled(is_scalar=True, error_model="numpy", _nrt=False, forceinline=False)
inlined_scalar = compiled(is_scalar=True, error_model="numpy", _nrt=False, forceinline=True)

# For long recursions, whose latency counts: a product and a sum may be one operation
# with one rounding. The bits are the same in every run of one build.
fused = compiled(error_model="numpy", _nrt=False, forceinline=True, fastmath={"contract"})

# For what is called from one place: compiled as part of its caller alone.
merged = compiled(error_model="numpy", _nrt=False, inline="always")

# For kernels put together at import, which a cache could not tell apart: part of their callers.
composed = compiled(is_kept=False, error_model="numpy", _nrt=False, forceinline=True)
