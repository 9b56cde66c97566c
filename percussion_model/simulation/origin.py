"""Origin of what a folder holds, so that no result replaces that of another scene or run.

A file in each result folder says which command made it and from what. The same command from
the same replaces its own files. Anything else is refused, or goes to a numbered folder beside
it, unless it is forced; then what the other result left is removed.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from percussion_model.scene.parameters import find_row
from percussion_model.scene.rows import unit_suffix
from percussion_model.simulation.files import ResultError, check_writable, staged_texts, to_json
from percussion_model.simulation.one_writer import IS_HELD, Hold, hold

ORIGIN = "made_by.json"
# What commands begin with that are none of `percussion`: examples and scenarios.
PYTHON = "python -m "
# Differences that a message shows.
SHOWN = 2


class Claim:
    """A folder that a result may be written to.

    Parameters
    ----------
    folder : Path
        Wanted.
    origin : mapping
        Command, of `percussion` or beginning with `python -m`, and what its result follows
        from, tables in it by their dotted keys.
    force : bool
        Replace what is there, whatever it is.
    numbered : bool
        Take a numbered folder beside it, rather than refuse, where it holds something else.

    Attributes
    ----------
    folder : Path
        To be written to.
    moved : str
        Why that is not the one that was wanted; empty where it is.

    Raises
    ------
    ResultError
        If the folder holds something else, or cannot be written.
    """

    def __init__(
        self, folder: Path, origin: Mapping[str, Any], force: bool = False, numbered: bool = False
    ) -> None:
        self.origin = flat(origin)
        self.folder, self.moved = folder, ""
        self._hold = hold(folder)
        other = _other_than(folder, self.origin) if self._hold else IS_HELD
        can_replace = "--force replaces it" if self._hold else ""
        if other and not (force and self._hold):
            if not numbered:
                ways = ", ".join(filter(None, (can_replace, "another --out keeps it")))
                raise ResultError(f"{folder} {other}: {ways}")
            self.folder, self._hold = _free_beside(folder, self.origin)
            self.moved = f"{folder} {other}: this one goes to {self.folder}"
            self.moved += f" ({can_replace})" if can_replace else ""
        check_writable(self.folder)
        self._note(bool(other) and not self.moved)

    def _note(self, replaces: bool) -> None:
        """Take what the folder holds before anything is written."""
        self._before = _times(self.folder)
        # a list from elsewhere may name what lies outside, which is never removed
        self._left = [name for name in _read(self.folder)[1] if name in self._before]
        self._replaces = replaces

    def move_to(self, folder: Path) -> None:
        """Take another folder, a new one, since the claimed one cannot be written any more."""
        self.folder, self._hold = folder, hold(folder)
        self._note(False)

    def sign(self) -> Path:
        """Say in the folder where its files are from, when they are written; return the file."""
        from importlib.metadata import version  # loads what reads mail

        now = _times(self.folder)
        made = [name for name, time in now.items() if self._before.get(name) != time]
        if self._replaces:
            for name in set(self._left) - set(made):
                (self.folder / name).unlink(missing_ok=True)
        else:
            made += [name for name in self._left if name in now]
        tree = {
            "made_by": self.origin,
            "version": version("percussion_model"),
            "files": sorted(set(made) - {ORIGIN}),
        }
        return staged_texts(self.folder, {ORIGIN: to_json(tree) + "\n"})[0]


def flat(tree: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Entries of a tree by their dotted keys; what is None is left out."""
    found: dict[str, Any] = {}
    for key, value in tree.items():
        name = f"{above}{key}"
        if isinstance(value, Mapping):
            found |= flat(value, f"{name}.")
        elif isinstance(value, (list, tuple)):
            found |= flat({str(k): one for k, one in enumerate(value)}, f"{name}.")
        elif value is not None:
            is_plain = isinstance(value, (str, bool, int))
            is_plain |= isinstance(value, float) and math.isfinite(value)
            found[name] = value if is_plain else repr(value)
    return found


def _other_than(folder: Path, origin: Mapping[str, Any]) -> str:
    """What else a folder holds, as a clause; nothing where it is free or has this origin."""
    if not folder.is_dir():
        return ""
    files = sorted(one.name for one in folder.iterdir() if one.is_file() and one.name[0] != ".")
    if ORIGIN not in files:
        more = ", ..." if len(files) > SHOWN else ""
        return f"holds files of unknown origin ({', '.join(files[:SHOWN])}{more})" if files else ""
    found = _read(folder)[0]
    if not found:
        return f"holds files of unknown origin ({ORIGIN} cannot be read)"
    if found == origin:
        return ""
    if found.get("command") != origin.get("command"):
        return f"holds the result of `{_typed(found.get('command'))}`"
    keys = sorted(key for key in found.keys() | origin.keys() if found.get(key) != origin.get(key))
    shown = [
        f"{key.removeprefix('scene.')} {_told(key, found)}, now {_told(key, origin)}"
        for key in keys
    ]
    more = f", and {len(keys) - SHOWN} more" if len(keys) > SHOWN else ""
    return f"holds another result ({'; '.join(shown[:SHOWN])}{more})"


def _told(key: str, origin: Mapping[str, Any]) -> str:
    """An entry as text, with its unit where it is a number of a scene."""
    if key not in origin:
        return "not set"
    row = find_row(key.removeprefix("scene."))
    return f"{origin[key]}{unit_suffix(row.unit) if row is not None else ''}"


def _typed(command: Any) -> str:
    """A command as it is typed: one of `percussion`, unless it is one of Python."""
    return str(command) if str(command).startswith(PYTHON) else f"percussion {command}"


def _free_beside(folder: Path, origin: Mapping[str, Any]) -> tuple[Path, Hold]:
    """The first numbered folder that is free or has this origin, and its hold."""
    number = 2
    while True:
        place = folder.with_name(f"{folder.name}-{number}")
        if (held := hold(place)) and not _other_than(place, origin):
            return place, held
        number += 1


def _read(folder: Path) -> tuple[dict[str, Any], list[str]]:
    """Origin of what a folder holds, and its files; nothing where it does not say so."""
    try:
        found = json.loads((folder / ORIGIN).read_text(encoding="utf-8"))
        origin, files = found["made_by"], found["files"]
    except (OSError, ValueError, LookupError, TypeError):
        return {}, []
    if not isinstance(origin, dict) or not isinstance(files, list):
        return {}, []
    return origin, [name for name in files if isinstance(name, str)]


def _times(folder: Path) -> dict[str, int]:
    """Times at which the files of a folder were written, by their path in it."""
    if not folder.is_dir():
        return {}
    return {
        str(one.relative_to(folder)): one.stat().st_mtime_ns
        for pattern in ("*", "*/*")
        for one in folder.glob(pattern)
        if one.is_file() and not one.relative_to(folder).parts[0].startswith(".")  # no drafts
    }
