"""Loader of the sources that an FMU brings along, from a place where compiled kernels last.

Numba keeps compiled kernels beside the sources, but hosts unpack an FMU into a new
folder each time. So the sources are copied once into the user's cache folder, under
a name that holds a hash of their contents, and imported from there. The environment
variable PERCUSSION_FMU_CACHE names another folder.
"""

from __future__ import annotations

import atexit
import ctypes
import importlib
import importlib.util
import os
import shutil
import sys
import tempfile
from pathlib import Path

PACKAGE = "__BUNDLE__"
VARIABLE = "PERCUSSION_FMU_CACHE"


def slave_class(module_globals: dict, module: str, name: str) -> type:
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
    if PACKAGE not in sys.modules:
        load(Path(module_globals["__file__"]).parent / PACKAGE)
    return getattr(importlib.import_module(f"{PACKAGE}.{module}"), name)


def load(source: Path) -> None:
    """Import the package from where its kernels are kept."""
    folder = kept_copy(source)
    spec = importlib.util.spec_from_file_location(
        PACKAGE, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"{folder} holds no package")
    package = importlib.util.module_from_spec(spec)
    sys.modules[PACKAGE] = package
    spec.loader.exec_module(package)


def kept_copy(source: Path) -> Path:
    """Copy the sources to the cache folder, unless they are there; return where."""
    try:
        target = cache_folder() / PACKAGE
        if not complete(target, source):
            target.parent.mkdir(parents=True, exist_ok=True)
            draft = Path(tempfile.mkdtemp(prefix=f".{PACKAGE}.", dir=target.parent))
            try:
                shutil.copytree(source, draft / PACKAGE, ignore=_NO_CACHE)
                os.rename(draft / PACKAGE, target)
            except OSError:
                if not complete(target, source):  # another process may have been first
                    raise
            finally:
                shutil.rmtree(draft, ignore_errors=True)
        if not os.access(target, os.W_OK):
            raise PermissionError(target)
        return target
    except OSError:
        draft = Path(tempfile.mkdtemp(prefix=f"{PACKAGE}-"))
        atexit.register(shutil.rmtree, draft, ignore_errors=True)
        shutil.copytree(source, draft / PACKAGE, ignore=_NO_CACHE)
        return draft / PACKAGE


_NO_CACHE = shutil.ignore_patterns("__pycache__")


def complete(target: Path, source: Path) -> bool:
    """Whether a copy has every file of the sources, in its size."""
    for path in source.rglob("*.py"):
        copy = target / path.relative_to(source)
        if not copy.is_file() or copy.stat().st_size != path.stat().st_size:
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
