"""Folders that one process at a time writes to; locks lie in the system's temporary folder."""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
import tempfile
import weakref
from io import FileIO
from pathlib import Path

# Where a folder is held already, as a clause.
IS_HELD = "is being written by another process"

_held: weakref.WeakValueDictionary[Path | None, Hold] = weakref.WeakValueDictionary()


class Hold:
    """What a process has while it alone writes to a folder; it ends with it, however that ends.

    Parameters
    ----------
    lock : FileIO or None
        The locked file; None where this system gives none.
    """

    def __init__(self, lock: FileIO | None) -> None:
        self._lock = lock

    def __del__(self) -> None:
        if self._lock is not None:
            with contextlib.suppress(OSError):  # Windows removes nothing that is open
                os.unlink(str(self._lock.name))
            self._lock.close()


def hold(folder: Path, waits: bool = False) -> Hold | None:
    """Hold a folder that may not be there yet; None where another process of this machine does.

    What a process holds it may hold again.

    Parameters
    ----------
    waits : bool
        Wait instead until the other one has let go.
    """
    try:
        path: Path | None = _lock_file(folder)
    except OSError:  # no place for it
        path = None
    found = _held.get(path)
    if found is None:
        try:
            lock = None if path is None else _lock(path, waits)
        except BlockingIOError:
            return None
        except OSError:  # a system without locks: each writes as before
            lock = None
        _held[path] = found = Hold(lock)
    return found


def _lock_file(folder: Path) -> Path:
    user = os.getuid() if sys.platform != "win32" else ""
    name = hashlib.sha256(f"{user} {os.path.realpath(folder)}".encode()).hexdigest()[:32]
    return Path(tempfile.gettempdir()) / f"percussion_lock-{name}"


def _open(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0), 0o600)


def _lock(path: Path, waits: bool) -> FileIO:
    """Open and lock a file; `BlockingIOError` where another process has locked it."""
    while True:
        file = FileIO(path, "a", opener=_open)
        try:
            if sys.platform == "win32":
                import msvcrt

                try:
                    msvcrt.locking(file.fileno(), msvcrt.LK_LOCK if waits else msvcrt.LK_NBLCK, 1)
                except PermissionError:
                    raise BlockingIOError from None
                return file
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
            with contextlib.suppress(FileNotFoundError):
                if os.fstat(file.fileno()).st_ino == os.stat(path).st_ino:
                    return file
        except BaseException:
            file.close()
            raise
        file.close()  # the one that had it has removed it meanwhile
