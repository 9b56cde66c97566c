"""Files that are written whole or not at all, and what a process that was killed has left."""

from __future__ import annotations

import contextlib
import errno
import functools
import hashlib
import os
import platform
import re
import secrets
import shutil
import stat
import sys
import tempfile
from pathlib import Path

# Links behind each other that are followed, as Linux does.
MOST_LINKS = 40
# Names of drafts and temporary folders: whose they are, and of which process.
_OURS = re.compile(r"\.?percussion-([0-9a-f]{8})-(\d+)-\w+")
# Access that tells whether a process of Windows is there (SYNCHRONIZE), and that it has not ended.
_SYNCHRONIZE, _WAITING = 0x00100000, 0x102


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file whole or not at all; its folder must be there.

    Behind a link its target is written. What is no regular file, as a device or a pipe, is
    written through and stays what it is.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    data = content.encode() if isinstance(content, str) else content
    if is_special(path):
        _write_through(path, data)
        return
    target = followed(path)
    if not target.parent.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, f"there is no folder {target.parent}", str(path))
    draft = draft_in(target.parent)
    try:
        with draft.open("xb") as file:
            file.write(data)
        draft.replace(target)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise


def move_whole(draft: Path, path: Path) -> None:
    """Make a finished draft the content of a file, as `write_whole` does."""
    if path.is_symlink() or is_special(path):
        write_whole(path, draft.read_bytes())
        draft.unlink()
    else:
        draft.replace(path)


def is_special(path: Path) -> bool:
    """Whether a path means no regular file, nor a folder, nor nothing; or one that is open here."""
    if _number(path) is not None:
        return True
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def followed(path: Path) -> Path:
    """The file behind the links of a path, there or not.

    Raises
    ------
    OSError
        If the links lead to each other.
    """
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    return target


def _write_through(path: Path, data: bytes) -> None:
    number = _number(path)
    if number is not None:
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(AttributeError, ValueError):  # none, or closed
                stream.flush()
    with open(path if number is None else os.dup(number), "wb") as file:
        file.write(data)


def _number(path: Path) -> int | None:
    """Number of the open file of this process that a path such as /dev/stdout means."""
    if sys.platform == "win32":
        return None
    place, own = os.path.abspath(path), os.getpid()
    for _ in range(MOST_LINKS):
        folder = os.path.realpath(os.path.dirname(place))
        number = os.path.basename(place)
        if folder in ("/dev/fd", f"/proc/{own}/fd") and number.isdecimal():
            return int(number)
        place = os.path.join(folder, number)
        if not os.path.islink(place):
            return None
        place = os.path.join(folder, os.readlink(place))
    return None


def draft_in(folder: Path) -> Path:
    """Path of a draft in a folder; those of processes that were killed are removed."""
    return folder / f".{own_prefix(folder)}{secrets.token_hex(4)}"


def own_prefix(folder: str | Path | None = None) -> str:
    """Prefix of temporary names of this process, by which a later one knows that it has ended.

    Parameters
    ----------
    folder : str or Path, optional
        Where they are going to be, that of the system if left out: what processes that were
        killed have left there is removed.
    """
    remove_abandoned(str(folder or tempfile.gettempdir()))
    return f"percussion-{_machine()}-{os.getpid()}-"


@functools.cache  # a folder may hold thousands of files, and be written to as often
def remove_abandoned(folder: str) -> None:
    """Remove drafts and temporary folders of processes of this user that are no more; once."""
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            found = _OURS.fullmatch(entry.name)
            if not found or found[1] != _machine() or _is_alive(int(found[2])):
                continue
            with contextlib.suppress(OSError):
                owner = entry.stat(follow_symlinks=False).st_uid
                if sys.platform != "win32" and owner != os.getuid():
                    continue
                if entry.is_dir(follow_symlinks=False):
                    shutil.rmtree(entry.path, ignore_errors=True)
                else:
                    os.unlink(entry.path)


@functools.cache
def _machine() -> str:
    """What tells numbers of processes apart: the machine, and the container where there is one."""
    try:
        numbers = os.readlink("/proc/self/ns/pid")
    except OSError:
        numbers = ""
    return hashlib.sha256(f"{platform.node()} {numbers}".encode()).hexdigest()[:8]


def _is_alive(process: int) -> bool:
    """Whether there is a process of this number."""
    if sys.platform == "win32":
        import ctypes

        kernel = ctypes.windll.kernel32
        kernel.OpenProcess.restype = ctypes.c_void_p
        handle = kernel.OpenProcess(_SYNCHRONIZE, False, process)
        if not handle:
            return False
        is_alive: bool = kernel.WaitForSingleObject(ctypes.c_void_p(handle), 0) == _WAITING
        kernel.CloseHandle(ctypes.c_void_p(handle))
        return is_alive
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # of another user
        return True
    return True
