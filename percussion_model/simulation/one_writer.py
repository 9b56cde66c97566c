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

_held: weakref.WeakValueDictionary[str, Hold] = weakref.WeakValueDictionary()


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
    name = hashlib.sha256(os.path.realpath(folder).encode()).hexdigest()[:32]
    found = _held.get(name)
    if found is None:
        try:
            lock = _lock(_place() / name, waits)
        except BlockingIOError:
            return None
        except OSError:  # a system without locks, or no place for them: each writes as before
            lock = None
        _held[name] = found = Hold(lock)
    return found


def _place() -> Path:
    """Folder of the locks of this user."""
    user = os.getuid() if sys.platform != "win32" else 0
    folder = Path(tempfile.gettempdir()) / f"percussion_locks-{user}"
    folder.mkdir(mode=0o700, exist_ok=True)
    if folder.is_symlink() or folder.stat().st_uid != user:
        raise PermissionError(f"{folder} is another user's")
    return folder


def _lock(path: Path, waits: bool) -> FileIO:
    """Open and lock a file; `BlockingIOError` where another process has locked it."""
    while True:
        file = FileIO(path, "a")
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
