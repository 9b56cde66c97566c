"""Loader of the sources that an FMU brings along, from a place where compiled kernels last.

An FMU with a library that fits the machine needs no kernels, and runs from where it lies. For
all others:
Numba keeps compiled kernels beside the sources, but hosts unpack an FMU into a new
folder each time. So the sources are copied once into the user's cache folder, under
a name that holds a hash of their contents, and imported from there. The environment
variable PERCUSSION_FMU_CACHE names another folder. What lies in such a folder is run: it
has to be the user's, closed to others, and the sources in it those of the FMU.
"""

from __future__ import annotations

import atexit
import ctypes
import importlib
import importlib.util
import os
import shutil
import stat
import sys
import tempfile
from pathlib import Path
from typing import Any

PACKAGE = "__BUNDLE__"
VARIABLE = "PERCUSSION_FMU_CACHE"
# In the resources of FMUs with a library, and the module of the package that runs it.
MODEL, NATIVE = "model.bin", "fmu_src.slave.native"


# Why the library, or the first folder, was not taken; the first instance logs it.
notes: list[str] = []
told: set[str] = set()
# Files of the package, for kernels; empty while it was loaded from where an FMU lies.
kept: list[Path] = []


def slave_class(module_globals: dict, module: str, name: str) -> Any:
    """Return a class of the bundled sources.

    Parameters
    ----------
    module_globals : dict
        Of the script that the export library runs for each instance. The library
        gives back one reference too many to it each time, so one is added here.
    module, name : str
        Module within the bundle, and class in it.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(module_globals))
    # where the library has just put it; the script itself may be that of an equal FMU before
    resources = Path(sys.path[0])
    found = native_class(resources) if (resources / MODEL).is_file() else None
    if found is None:
        if not kept:
            forget()
            kept.append(kept_copy(resources / PACKAGE))
            load(kept[0])
        found = class_of(module, name)
    found.start_notes = notes
    # The library takes the class out of the script's module, which an equal FMU may have loaded;
    # what the script itself assigns now is lost.
    module_globals[name] = found
    return found


def native_class(resources: Path) -> Any:
    """Class that runs the library of an FMU; None, and a note, if that does not fit."""
    if PACKAGE not in sys.modules:
        load(resources / PACKAGE)
    native = importlib.import_module(f"{PACKAGE}.{NATIVE}")
    reason = native.reason_against(str(resources))
    if not reason:
        return class_of(NATIVE, "NativeSlave")
    note = f"runs by Python, and compiles its solver for a minute unless that is kept: {reason}"
    if note not in told:
        told.add(note)
        notes.append(note)
        if sys.stderr is not None:  # hosts see a log later, when a call has ended
            print(f"{PACKAGE}: {note}", file=sys.stderr, flush=True)
    return None


def class_of(module: str, name: str) -> Any:
    """Class of the package; where a module is missing, the reason for needing it is told too."""
    try:
        return getattr(importlib.import_module(f"{PACKAGE}.{module}"), name)
    except ImportError as error:
        raise ImportError("; ".join([*notes, str(error)])) from error


def forget() -> None:
    """Drop the package, if it was loaded from where an FMU lies."""
    for name in [*sys.modules]:
        if name == PACKAGE or name.startswith(f"{PACKAGE}."):
            del sys.modules[name]


def load(folder: Path) -> None:
    """Import the package from a folder."""
    spec = importlib.util.spec_from_file_location(
        PACKAGE, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"{folder} holds no package")
    package = importlib.util.module_from_spec(spec)
    sys.modules[PACKAGE] = package
    spec.loader.exec_module(package)


def kept_copy(source: Path) -> Path:
    """Copy the sources to the cache folder, unless they are there; return where.

    Where that cannot be, a temporary folder serves, and kernels are compiled anew.
    """
    try:
        return copy_into(cache_folder(), source)
    except (OSError, RuntimeError) as error:  # no HOME is a RuntimeError
        notes.append(f"compiled kernels are not kept ({VARIABLE}): {error}")
    draft = Path(tempfile.mkdtemp(prefix=f"{PACKAGE}-"))
    atexit.register(shutil.rmtree, draft, ignore_errors=True)
    shutil.copytree(source, draft / PACKAGE, ignore=_NO_CACHE)
    return draft / PACKAGE


def copy_into(folder: Path, source: Path) -> Path:
    """Copy the sources into a cache folder, unless they are there; return where.

    Raises
    ------
    OSError
        If that cannot be done, or if somebody else could change them there.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    refuse_open(folder)
    target = folder / PACKAGE
    if not equal(target, source):
        draft = Path(tempfile.mkdtemp(prefix=f".{PACKAGE}.", dir=folder))
        try:
            shutil.copytree(source, draft / PACKAGE, ignore=_NO_CACHE)
            os.chmod(draft / PACKAGE, 0o700)  # what is put into it later is closed to others too
            if target.exists() and not equal(target, source):  # files that are not the FMU's
                os.rename(target, draft / "old")
            os.rename(draft / PACKAGE, target)
        except OSError:
            if not equal(target, source):  # another process may have been first
                raise
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    refuse_open_tree(target)
    if not os.access(target, os.W_OK):
        raise PermissionError(f"{target} cannot be written")
    return target


_NO_CACHE = shutil.ignore_patterns("__pycache__")


def refuse_open(path: Path) -> None:
    """Raise PermissionError if somebody else owns a file or folder, or can write to it.

    Windows has no such modes: there the user's profile is closed to others by itself.
    """
    if sys.platform == "win32":
        return
    for found in (os.lstat(path), os.stat(path)):
        if found.st_uid != os.geteuid():
            raise PermissionError(f"{path} belongs to another user")
        if found.st_mode & 0o022 and not stat.S_ISLNK(found.st_mode):
            raise PermissionError(f"{path} can be written by others; empty it, then chmod go-w")


def refuse_open_tree(folder: Path) -> None:
    """The same for a folder with all that is in it, which nobody else may reach."""
    refuse_open(folder)
    if sys.platform == "win32" or not os.lstat(folder).st_mode & 0o077:
        return
    for path in folder.rglob("*"):
        refuse_open(path)


def equal(target: Path, source: Path) -> bool:
    """Whether a copy has every file of the sources, byte for byte."""
    for path in source.rglob("*.py"):
        copy = target / path.relative_to(source)
        if not copy.is_file() or copy.read_bytes() != path.read_bytes():
            return False
    return True


def cache_folder() -> Path:
    """Folder for compiled kernels: that of the environment variable, or the user's."""
    given = os.environ.get(VARIABLE)
    if given:
        return Path(given)
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "percussion_fmu"
