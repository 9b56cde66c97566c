"""Where compiled kernels are kept: a set of them for each state of the sources.

Numba's cache looks at the file of a function alone, not at those of the functions that it
calls; after an edit, an update or one more component it would go on with old code. So sets are
told apart by a hash of the sources. That of the present sources lies beside them, the last
ones are set aside, and come back with their sources. Sources that cannot be written have their
kernels in the user's cache.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from percussion_model.physics.user_cache import cache_folder, can_write

STAMP, ASIDE, LOCK = "kernels.sha256", "kernels", "kernels.lock"
# So many other sets are kept, the newest.
MOST_KEPT = 3
# A set is exchanged in less; who has held the lock for longer was killed [s].
PATIENCE = 20.0
_log = logging.getLogger("percussion_model")


def prepare(package: Path, callees: tuple[str, ...]) -> Path | None:
    """See to it that no stale kernels are loaded; return the folder of kernels.

    Parameters
    ----------
    package : Path
    callees : tuple of str
        Folders with functions that kernels of other files call.

    Returns
    -------
    Path or None
        None where numba chooses: beside the sources, or what NUMBA_CACHE_DIR names.
    """
    if os.environ.get("NUMBA_CACHE_DIR"):
        return None
    digest = hashlib.sha256()
    for source in sorted(path for name in callees for path in (package / name).rglob("*.py")):
        digest.update(source.read_bytes())
    beside = package / "physics" / "__pycache__"
    try:
        if can_write(beside):
            exchange(package, beside, digest.hexdigest())
            return None
        place = cache_folder() / ASIDE / digest.hexdigest()[:16]
        place.mkdir(parents=True, exist_ok=True)
        os.utime(place)
        remove_old(place.parent)
    except OSError:
        return None  # numba looks for a place of its own
    return place


def exchange(package: Path, beside: Path, digest: str) -> None:
    """Set the kernels of other sources aside, and bring those of the present ones back.

    Parameters
    ----------
    package, beside : Path
        Sources, and the folder that says whose kernels lie beside them.
    digest : str
        Hash of the present sources.
    """
    stamp, aside = beside / STAMP, beside / ASIDE
    if _words(stamp)[:1] == [digest]:
        return
    beside.mkdir(exist_ok=True)
    with _alone(beside / LOCK):
        old, *before = _words(stamp) or [""]
        if old == digest:
            return
        # whoever is cut off from here on leaves kernels of which nothing is known
        stamp.unlink(missing_ok=True)
        for kernels in [*package.rglob("*.nbi"), *package.rglob("*.nbc")]:
            if kernels.parent.name != "__pycache__":
                continue
            if old:
                _move(kernels, aside / old[:16] / kernels.parent.parent.relative_to(package))
            else:
                kernels.unlink(missing_ok=True)
        present = aside / digest[:16]
        now = sorted(path.stem for path in (package / "components").glob("[!_]*.py"))
        if present.is_dir():
            for kernels in [path for path in present.rglob("*") if path.is_file()]:
                folder = package / kernels.parent.relative_to(present)
                _move(kernels, folder / "__pycache__")
            shutil.rmtree(present, ignore_errors=True)
        elif old:
            _tell(sorted(set(now) ^ set(before)))
        remove_old(aside)
        stamp.write_text(" ".join([digest, *now]))


def _tell(components: list[str]) -> None:
    """Say why all kernels are compiled anew: components that came or went, or other sources."""
    why = f"components ({', '.join(components)})" if components else "sources of the package"
    _log.warning(
        "%s have changed: kernels are compiled anew when they are first used; those of before "
        "are kept",
        why,
    )


def _words(stamp: Path) -> list[str]:
    """Hash of the sources whose kernels lie beside them, and names of their components."""
    try:
        return stamp.read_text().split()
    except OSError:
        return []


def _move(file: Path, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    try:
        os.replace(file, folder / file.name)
    except FileNotFoundError:
        pass  # a running process has put another one in its place


def remove_old(folder: Path) -> None:
    """Remove all sets but the newest."""
    sets = sorted(folder.glob("*/"), key=lambda one: one.stat().st_mtime, reverse=True)
    for old in sets[MOST_KEPT:]:
        shutil.rmtree(old, ignore_errors=True)


@contextmanager
def _alone(lock: Path) -> Iterator[None]:
    """One process at a time."""
    give_up = time.monotonic() + PATIENCE
    while True:
        try:
            os.close(os.open(lock, os.O_CREAT | os.O_EXCL))
            break
        except FileExistsError:
            if time.monotonic() > give_up:
                lock.unlink(missing_ok=True)
            time.sleep(0.05)
    try:
        yield
    finally:
        lock.unlink(missing_ok=True)


@functools.cache  # a folder has many kernels
def take_along(place: Path, beside: Path) -> None:
    """Copy kernels that lie beside sources which cannot be written to where they are kept; once."""
    if any(place.glob("*.nbi")):
        return
    # those that say which kernels there are come last
    for kernels in sorted(beside.glob("*.nb[ci]")):
        draft = place / f"{kernels.name}.{os.getpid()}"
        try:
            shutil.copy2(kernels, draft)
            os.replace(draft, place / kernels.name)
        except OSError:
            draft.unlink(missing_ok=True)
            return
