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

import llvmlite.binding as llvm
from numba import config, njit, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering
from numba.core.types.npytypes import Record
from numba.core.typing.templates import infer, infer_global, make_intrinsic_template
from numba.extending import overload

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
# Numba writes out types at each of its steps, where records have a hundred fields: a fifth of all
# compiling.
Record.__repr__ = functools.cache(Record.__repr__)  # type: ignore[method-assign]
# Attributes of a plain function with what kernels have in its place: what writes instructions,
# or what makes a function.
INSTRUCTIONS, MAKER = "_instructions", "_maker"
_log = logging.getLogger("percussion_model")
# What keeps translations of a function with these options from one process to the next, if any.
keeper_of: Callable[[Callable, dict[str, Any]], Any] | None = None


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
    return _called_by_others(made, options)


def _called_by_others(made: Any, options: dict[str, Any]) -> Any:
    """Let kernels that call a kernel have what is translated of it, and no code for Python.

    They take constants as numbers like others: numba would compile it anew for each constant,
    which takes a sixth of all compiling.
    """
    translated = njit(pipeline_class=_Translator, **options)(made.py_func)
    if keeper_of is not None:
        translated._cache = keeper_of(made.py_func, options)

    def find(arguments: Any, named: Any) -> Any:
        named = {name: types.unliteral(kind) for name, kind in named.items()}
        return translated.get_call_template([types.unliteral(kind) for kind in arguments], named)

    made.get_call_template, made.get_overload = find, translated.get_overload
    return made


class Translated(JITCodeLibrary):  # type: ignore[misc]
    """A function in LLVM's language, and nothing made of it.

    Numba would link it with all that it calls, optimise the whole and make machine code of it,
    again for each caller: that is done once, for what Python calls.
    """

    _shared_module: Any

    def finalize(self) -> None:
        """There is no more to do."""
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """Module of the function and of all that it calls."""
        if self._shared_module is None:
            found: dict[int, Any] = {}
            add_callees_first(self, found)
            own, *others = reversed(found.values())
            whole = own._final_module.clone()
            # what nothing calls yet is left out: so what calls comes before what is called
            for one in others:
                whole.link_in(module_of(one), preserve=True)
            self._shared_module = _shared(whole)
        return self._shared_module


def add_callees_first(library: Any, found: dict[int, Any]) -> None:
    """Add those that a library calls to those found, and then itself."""
    if id(library) in found:
        return
    for one in library._linking_libraries:
        add_callees_first(one, found)
    found[id(library)] = library


def module_of(library: Any) -> Any:
    """A library's own module, for linking it with those of others."""
    if isinstance(library, Translated):
        return _shared(library._final_module.clone())
    return library._get_module_for_linking()


def _shared(module: Any) -> Any:
    """The module with functions that may be there more than once."""
    for one in module.functions:
        if not one.is_declaration and one.linkage == llvm.Linkage.external:
            one.linkage = "linkonce_odr"
    return module


@register_pass(mutates_CFG=True, analysis_only=False)
class _Translating(NativeLowering):  # type: ignore[misc]
    """Numba's last step, without its machine code and its wrappers for Python and C."""

    _name = "translating"

    def run_pass(self, state: Any) -> bool:
        """Write the function in LLVM's language."""
        flags, context = state.flags, state.targetctx
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        state.library = Translated(context.codegen(), state.func_id.func_qualname)
        super().run_pass(state)
        # some built-in function, another each time: numba tells functions apart by it
        found = state["cr"]._replace(cfunc=[].append)
        context.insert_user_function(found.cfunc, found.fndesc, [state.library])
        state["cr"] = found
        return True


class _Translator(CompilerBase):  # type: ignore[misc]
    """Numba's steps for a function that others call."""

    def define_pipelines(self) -> list[Any]:
        """Put the steps in order."""
        steps = DefaultPassBuilder.define_nopython_pipeline(self.state)
        steps.passes = [
            (_Translating if step is NativeLowering else step, text) for step, text in steps.passes
        ]
        steps.finalize()
        return [steps]


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
    setattr(function, INSTRUCTIONS, define)
    template = make_intrinsic_template(function, define, function.__name__)
    infer(template)
    infer_global(function, types.Function(template))


def replace(function: Callable, make: Callable) -> None:
    """Let kernels that call a plain function have another in its place.

    Parameters
    ----------
    function : callable
        What plain Python calls.
    make : callable
        What `numba.extending.overload` takes: gives that other one, whatever the types of the
        arguments.
    """
    setattr(function, MAKER, make)
    overload(function)(make)
