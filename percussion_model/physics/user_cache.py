"""The folder that keeps for a user what takes long to make: kernels and libraries."""

from __future__ import annotations

import atexit
import functools
import logging
import os
import shutil
import sys
import tempfile
from pathlib import Path

VARIABLE = "PERCUSSION_CACHE"
NAME = "percussion_model"
_log = logging.getLogger(NAME)


# fmu_src/slave/start.py finds its folder in the same way: it runs before anything that an
# FMU brings along can be imported.
def cache_folder() -> Path:
    """Folder for what is kept: that of the environment variable PERCUSSION_CACHE, or the user's.

    Where that cannot be written, one in the folder for temporary files.
    """
    given = os.environ.get(VARIABLE)
    if given:
        return Path(given)
    try:
        if sys.platform == "win32":
            base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
        elif sys.platform == "darwin":
            base = Path.home() / "Library" / "Caches"
        else:
            base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError as error:
        return _temporary(str(error)) / NAME
    if not can_write(base / NAME):
        return _temporary(f"{base / NAME} cannot be written") / NAME
    return base / NAME


def is_clone() -> bool:
    """Whether this is a clone of the repository, and not an installed package, or an FMU's."""
    beside = Path(__file__).resolve().parents[2]
    return (beside / "scenarios").is_dir() and not (beside / "percussion_scenarios").is_dir()


def can_write(folder: Path) -> bool:
    """Whether files can be made in a folder, which need not be there yet."""
    there = next(one for one in (folder, *folder.absolute().parents) if os.path.exists(one))
    return there.is_dir() and os.access(there, os.W_OK | os.X_OK)


@functools.cache
def _temporary(reason: str) -> Path:
    """Folder for temporary files that nobody else can write to; told once."""
    own = f"-{os.getuid()}" if sys.platform != "win32" else ""
    folder = Path(tempfile.gettempdir()) / f"{NAME}{own}"
    if not _is_private(folder):
        folder = Path(tempfile.mkdtemp(prefix=f"{NAME}-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
    _log.warning("%s: what is compiled is kept in %s; %s changes that", reason, folder, VARIABLE)
    return folder


def _is_private(folder: Path) -> bool:
    """Make a folder closed to others; False where that cannot be, or is not so."""
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = os.lstat(folder)
    except OSError:
        return False
    if sys.platform == "win32":
        return True
    return folder.is_dir() and found.st_uid == os.getuid() and found.st_mode & 0o7077 == 0
