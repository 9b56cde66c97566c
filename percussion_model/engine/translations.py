"""Translations of kernels into LLVM's language, kept from one compiling to the next.

A translation holds as long as its function stays what it is: its code, its constants, the values
of the names that it uses, and thereby the functions that it calls. So an edit has translated anew
what it concerns and what calls that. Where the content of a value is not known, nothing is kept.
"""

from __future__ import annotations

import enum
import hashlib
import itertools
import pickle
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import numpy as np
from numba.core import serialize, types
from numba.core.bytecode import FunctionIdentity
from numba.core.caching import NullCache
from numba.core.compiler import compile_result
from numba.core.registry import cpu_target
from numba.extending import _Intrinsic as Intrinsic

from percussion_model.engine import compiler
from percussion_model.physics import compiling
from percussion_model.physics.kernel import Kernel

# Modules that change with the versions alone, which are in the stamp.
LIBRARIES = {*compiler.COMPILERS, *sys.stdlib_module_names}
_PLAIN = (bool, int, float, complex, str, bytes, type(None), type(...))


def stamp_of_translations(module: str) -> str:
    """Hash of what translations of the kernels of a module follow from besides these."""
    known = re.compile(rb"^\s*(?:import|from) (?:numba|llvmlite)", re.MULTILINE)
    files = [one for one in compiler.sources_of(module) if known.search(one.read_bytes())]
    return compiler.hash_of([*files, Path(__file__)], sys.version, *compiler.versions())


class UnknownContentError(Exception):
    """What a value holds cannot be told."""


def content_of(value: Any, inside: tuple[Any, ...] = ()) -> str:
    """All that a function, or a value that one uses, holds for a compiler.

    Parameters
    ----------
    value : object
    inside : tuple
        Functions that use it.

    Raises
    ------
    UnknownContentError
        If that is not known.
    """
    if isinstance(value, Kernel):
        options = sorted(value._options.items())
        return f"{options} {content_of(value.py_func, inside)}"
    if isinstance(value, FunctionType):
        return _of_function(value, inside)
    if isinstance(value, _PLAIN):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, (tuple, list)):
        return f"{type(value).__name__} {[content_of(one, inside) for one in value]}"
    if isinstance(value, Mapping):
        return f"{[(repr(key), content_of(one, inside)) for key, one in value.items()]}"
    if isinstance(value, np.ndarray):
        return f"{value.dtype!r} {value.shape} {value.tobytes().hex()}"
    if isinstance(value, (np.generic, np.dtype, types.Type)):
        return repr(value)
    if isinstance(value, type):
        return _of_class(value)
    if isinstance(value, Intrinsic):
        return _of_file(value._defn)
    name = getattr(value, "__name__", "")
    if isinstance(value, (BuiltinFunctionType, np.ufunc)) or (
        isinstance(value, ModuleType) and _is_of_library(name)
    ):
        return f"{type(value).__name__} {name}"
    raise UnknownContentError(f"{type(value)} {name}")


def _is_of_library(module: str) -> bool:
    return module.partition(".")[0] in LIBRARIES


def _of_class(value: type) -> str:
    name = f"{value.__module__}.{value.__qualname__}"
    if issubclass(value, enum.Enum):
        return f"{name} {[(one.name, one.value) for one in value]}"
    if issubclass(value, tuple):
        return f"{name} {getattr(value, '_fields', ())} {getattr(value, '_field_defaults', ())}"
    return f"{name} {_of_file(value)}"


def _of_file(value: Any) -> str:
    """Source of a function for numba, or of a class, and what it holds of other functions."""
    if _is_of_library(value.__module__):
        return f"{value.__module__}.{value.__qualname__}"
    source = Path(sys.modules[value.__module__].__file__ or "").read_bytes()
    held = [content_of(one.cell_contents) for one in getattr(value, "__closure__", None) or ()]
    return f"{value.__qualname__} {hashlib.sha256(source).hexdigest()} {held}"


_known = dict[int, tuple[FunctionType, str]]()


def _of_function(value: FunctionType, inside: tuple[Any, ...]) -> str:
    """Hash of a function of ours; the name of another, whose version is told elsewhere."""
    name = f"{value.__module__}.{value.__qualname__}"
    if value in inside or _is_of_library(name):
        return name
    make = vars(value).get(compiling.MAKER)
    if make is not None:  # kernels have that in its place
        return content_of(make(*[None] * make.__code__.co_argcount), inside)
    if id(value) not in _known:
        used: list[Any] = [value.__defaults__, value.__kwdefaults__]
        used += (cell.cell_contents for cell in value.__closure__ or ())
        define = vars(value).get(compiling.INSTRUCTIONS)
        words = [name, "" if define is None else _of_file(define)]
        for code in _codes_of(value.__code__):
            words += (code.co_code.hex(), *code.co_names, *code.co_varnames, *code.co_freevars)
            used += (one for one in code.co_consts if not isinstance(one, CodeType))
            used += _named(code.co_names, vars_of=value.__globals__)
        used = [one for one in used if one is None or one is not value.__doc__]
        words += (content_of(one, (*inside, value)) for one in used)
        _known[id(value)] = value, hashlib.sha256("\0".join(words).encode()).hexdigest()
    return _known[id(value)][1]


def _named(names: tuple[str, ...], vars_of: dict[str, Any]) -> Iterator[Any]:
    """Values of names in a module, and in modules of ours that are among them."""
    for one in (vars_of[name] for name in names if name in vars_of):
        if isinstance(one, ModuleType) and not _is_of_library(one.__name__):
            yield from _named(names, vars(one))
        else:
            yield one


def _codes_of(code: CodeType) -> Iterator[CodeType]:
    yield code
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield from _codes_of(one)


class _Library(NamedTuple):
    """Code of a function in LLVM's form, and the numbers of those that it calls."""

    name: str
    code: bytes
    called: tuple[int, ...]


class Translations(dict[str, Any]):
    """Those of the kernels of a module, by a hash of content and types of arguments.

    Parameters
    ----------
    file : Path
        In which they are kept; it need not be there.
    stamp : str
        What else they follow from.
    """

    def __init__(self, file: Path, stamp: str) -> None:
        super().__init__()
        self._file, self._stamp = file, stamp
        self._kept: dict[str, Any] = {}
        self._stored: list[_Library] = []
        self._libraries: dict[int, Any] = {}
        first = 1
        with suppress(Exception):  # a file of another version may end in any error
            stamp_of_kept, first_then, stored, kept = pickle.loads(file.read_bytes())
            if stamp_of_kept == stamp:
                first, self._stored, self._kept = first_then, stored, kept
        # functions have a number in their names: no new one may be that of a kept one
        FunctionIdentity._unique_ids = itertools.count(first)
        compiling.keeper_of = self.keeper_of

    def keeper_of(self, function: Callable, options: dict[str, Any]) -> Any:
        """What numba asks for translations of a function, and gives new ones to."""
        try:
            return _Keeper(self, f"{sorted(options.items())} {content_of(function)}")
        except UnknownContentError:
            return NullCache()

    def found(self, key: str, context: Any) -> Any:
        """A kept translation, as numba has it; None where there is none."""
        if key not in self._kept:
            return None
        signature, description, number = self._kept[key]
        self[key] = compile_result(
            typing_context=context.typing_context,
            target_context=context,
            entry_point=[].append,  # another one each time: numba tells functions apart by it
            signature=signature,
            objectmode=False,
            lifted=(),
            fndesc=description,
            library=self._library(number, context),
        )
        return self[key]

    def _library(self, number: int, context: Any) -> Any:
        if number not in self._libraries:
            name, code, called = self._stored[number]
            self._libraries[number] = made = compiling.Translated(context.codegen(), name)
            made._final_module = llvm.parse_bitcode(code)
            made._linking_libraries += [self._library(one, context) for one in called]
            made._finalized = True
        return self._libraries[number]

    def save(self) -> None:
        """Keep what is used: new ones, those found, and what these call."""
        for key, (_, _, number) in self._kept.items():
            if key not in self and number in self._libraries:
                self.found(key, cpu_target.target_context)
        numbers: dict[int, int] = {}
        stored: list[_Library] = []
        functions = {}
        for key, one in self.items():
            one.fndesc.typemap = one.fndesc.calltypes = None  # numba does not keep them either
            functions[key] = one.signature, one.fndesc, _store(one.library, stored, numbers)
        first = next(FunctionIdentity._unique_ids)
        draft = self._file.with_suffix(".draft")
        draft.write_bytes(serialize.dumps((self._stamp, first, stored, functions)))
        draft.replace(self._file)


def _store(library: Any, stored: list[_Library], numbers: dict[int, int]) -> int:
    """Number of a library among those stored, after it and those that it calls are."""
    if id(library) not in numbers:
        called = tuple(_store(one, stored, numbers) for one in library._linking_libraries)
        numbers[id(library)] = len(stored)
        code = compiling.module_of(library).as_bitcode()
        stored.append(_Library(str(library.name), code, called))
    return numbers[id(library)]


class _Keeper(NullCache):  # type: ignore[misc]
    """Translations of one function."""

    def __init__(self, translations: Translations, content: str) -> None:
        self._all, self._content = translations, content

    def _key(self, arguments: Any) -> str:
        return hashlib.sha256(f"{self._content} {arguments!r}".encode()).hexdigest()

    def load_overload(self, arguments: Any, context: Any) -> Any:
        """A kept translation; None where there is none."""
        return self._all.found(self._key(arguments), context)

    def save_overload(self, arguments: Any, made: Any) -> None:
        """Take a new one."""
        self._all[self._key(arguments)] = made
