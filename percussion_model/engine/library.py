"""The entries of a solver as functions: of a library, of objects, or of the sources.

Libraries are found beside this module where an installation brings them, else they are made once
and kept (`percussion_model.engine.compiler`). Without a linker the objects are loaded as they are.
With NUMBA_DISABLE_JIT the sources run as they stand.
"""

from __future__ import annotations

import ctypes
import functools
import tempfile
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from percussion_model.engine import compiler
from percussion_model.engine.entries import ENTRIES, OTHERS, SOLVERS
from percussion_model.engine.platforms import PLATFORMS, this_platform
from percussion_model.physics.kernel import DISABLED

# What an installation brings.
BROUGHT = compiler.HERE / "libraries"
# Folders of sources that libraries follow from.
FOLDERS = ("components", "engine", "physics", "scene", "solvers")
# Modules of the package with the entries of libraries beside those of the solvers.
MODULES = {"calls": "coupling.call_kernels"}
_KINDS: dict[str, Any] = {"w": ctypes.c_int64, "n": ctypes.c_double}


def module_of(solver: str) -> str:
    """Name of the module with the entries of a solver, or of one of `OTHERS`."""
    return f"{compiler.NAME}.{MODULES.get(solver, f'engine.{solver}')}"


def _forms(solver: str) -> dict[str, str]:
    """Results and arguments of entries by their names."""
    return OTHERS.get(solver, ENTRIES)


@functools.cache
def stamp() -> str:
    """Hash of the sources of all libraries."""
    files = [file for name in FOLDERS for file in (compiler.PACKAGE / name).rglob("*.py")]
    files += (compiler.PACKAGE / "coupling").glob("call*.py")
    of_c = (compiler.HERE / name for name in ("memory.c", "processor.h"))
    return compiler.hash_of([*sorted(files), *of_c])


def brought_file(solver: str, platform: str) -> Path:
    """Where an installation has the library of a solver, if it brings one."""
    return BROUGHT / f"{solver}-{stamp()}{PLATFORMS[platform].suffix}"


def _library_file(solver: str) -> Path:
    """File of the library of a solver, which need not be there."""
    brought = brought_file(solver, this_platform())
    if brought.is_file():
        return brought
    places = [folder / "libraries" / brought.name for folder in compiler.kept_folders()]
    return next((one for one in places if one.is_file()), None) or (
        compiler.kept_folder() / "libraries" / brought.name
    )


def place_to_compile(solver: str) -> Path | None:
    """Folder in which a solver will be kept when it is compiled; None where nothing has to be."""
    if solver not in SOLVERS or DISABLED or _library_file(solver).is_file():
        return None
    lacking = compiler.missing([module_of(solver)], [this_platform()])
    return compiler.kept_folder() if lacking else None


@functools.cache
def entries_of(solver: str) -> Any:
    """Entries of a solver by their names, with `free`, which takes what `create` gives.

    Those of one of `OTHERS` too.

    Raises
    ------
    SceneError
        If they have to be compiled, and cannot be.
    """
    if DISABLED:
        return _plain(solver)
    file = _library_file(solver)
    if not file.is_file():
        try:
            make(solver)
        except compiler.NoCompilerError:
            if not compiler.can_compile():
                raise
            return _of_objects(solver)
    return _of_library(solver, file)


def make(solver: str, report: compiler.Report | None = None) -> None:
    """Make the library of a solver, unless it is there.

    Raises
    ------
    NoCompilerError
        If nothing here compiles, or links.
    """
    file = _library_file(solver)
    if file.is_file():
        return
    name = this_platform()
    compiler.objects([module_of(solver)], [name], report)
    command = compiler.compiler_for(name)
    file.parent.mkdir(parents=True, exist_ok=True)
    with compiler.only_one(file.parent / "link.lock"):
        if not file.is_file():
            link_solver(solver, name, command, file)
            compiler.remove_old(file.parent, f"{solver}-*{file.suffix}")


def link_solver(solver: str, platform: str, command: Sequence[str], file: Path) -> None:
    """Link the library of a solver for a platform.

    Parameters
    ----------
    command : sequence of str
        Of a C compiler.
    """
    parts = compiler.objects([module_of(solver)], [platform])[platform]
    sources, flags = [compiler.HERE / "memory.c"], ["-DENGINE_LIBRARY"]
    with tempfile.TemporaryDirectory(prefix=".draft-", dir=file.parent) as folder:
        if "windows" in platform:  # where what is not said to be exported is not
            sources.append(Path(folder) / "exports.c")
            sources[-1].write_text(_exports(solver, parts), encoding="utf-8")
        compiler.link(platform, command, sources, parts, file, flags)


def _exports(solver: str, parts: Sequence[Path]) -> str:
    """C that has a linker for Windows export the entries of objects."""
    suffixes = [one.stem.rpartition("_")[2] for one in parts]
    names = [f"{solver}_{name}_{suffix}" for name in _forms(solver) for suffix in suffixes]
    words = "".join(f" -export:{name}" for name in names)
    return f'__asm__(".section .drectve, \\"yn\\"\\n.ascii \\"{words}\\"\\n.text");\n'


# Entries that are over at once; others let threads of Python run meanwhile.
QUICK = {"state_time", "grid_point_after", "readable_until", "is_quiet", "time_of_blow"}


def _functions(solver: str, suffix: str, address_of: Callable[[str], int]) -> SimpleNamespace:
    """Entries at addresses."""
    found = SimpleNamespace()
    for name, form in _forms(solver).items():
        result, _, arguments = form.partition(":")
        prototype = ctypes.PYFUNCTYPE if name in QUICK else ctypes.CFUNCTYPE
        kind = prototype(_KINDS[result], *(_KINDS[one] for one in arguments))
        setattr(found, name, kind(address_of(f"{solver}_{name}{suffix}")))
    return found


def _of_library(solver: str, file: Path, narrower: int = 0) -> SimpleNamespace:
    """Entries for the widest vectors of this processor, or for some that are narrower."""
    library = ctypes.PyDLL(str(file))
    library.engine_vectors.restype = ctypes.c_int64
    suffix = ("_base", "_avx2", "_avx512")[max(library.engine_vectors() - narrower, 0)]

    def address_of(name: str) -> int:
        return ctypes.cast(getattr(library, name), ctypes.c_void_p).value or 0

    found = _functions(solver, suffix, address_of)
    library.native_free.argtypes, library.native_free.restype = (ctypes.c_int64,), None
    found.free = library.native_free
    return found


def _of_objects(solver: str) -> SimpleNamespace:
    from percussion_model.engine.loading import load_objects

    name = this_platform()
    files = compiler.objects([module_of(solver)], [name])[name]
    address_of, suffix, free = load_objects(files)
    found = _functions(solver, suffix, address_of)
    found.free = free
    return found


def _plain(solver: str) -> SimpleNamespace:
    from percussion_model.engine import plain_memory

    module = import_module(module_of(solver))
    found = SimpleNamespace(**{name: getattr(module, name) for name in _forms(solver)})
    found.free = plain_memory.free
    return found
