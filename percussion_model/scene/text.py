"""Scenes as text: reading and writing TOML, and the wording of errors."""

from __future__ import annotations

import contextlib
import difflib
import os
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from percussion_model.scene.parameters import GROUPS
from percussion_model.scene.rows import (
    Row,
    generic_key,
    refuse_value,
    show_value,
    toml_value,
)
from percussion_model.scene.rules import SceneError
from percussion_model.scene.table import find_row, parameter_table, rows_by_key

# Below this similarity a guess at a misspelt key misleads more than it helps.
_SIMILAR_ENOUGH = 0.6
# Of a key or of a parser's words, no more than this is repeated in a message.
_LONGEST_WORDS = 200
# More faults of one file than this are counted, not told.
_MOST_FAULTS = 30

_HEADER = (
    "# A scene for `percussion run`. SI units; positions and velocities point down,",
    "# forces on contact and rock are positive in compression. What is left out takes",
    "# its default, which is the value of the reference scene.",
)


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file, with a clear error for what can go wrong."""
    if path.is_dir():
        raise SceneError(f"{path} is a folder: give the scene file in it")
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SceneError(f"{path}: there is no such scene file") from None
    except UnicodeDecodeError:
        raise SceneError(f"{path}: not a text file in UTF-8") from None
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror}") from None
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SceneError(f"{path}: tables or lists are nested too deep") from None
    except ValueError as error:  # of TOML, or a number of too many digits
        raise SceneError(f"{path}: not valid TOML: {_shortened(str(error))}") from None


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_WORDS else text[:_LONGEST_WORDS] + "..."


def write_text(path: Path, text: str) -> None:
    """Write a file in one go: whatever happens, no half-written file stays."""
    draft = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft.write_text(text, encoding="utf-8")
        draft.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise SceneError(f"{path}: cannot be written: {error.strerror}") from None


def read_setting(text: str) -> tuple[str, Any]:
    """Read a setting such as "rock.unloading_ratio=10" or "effects.rock=spring".

    Returns
    -------
    key, value
        The value as TOML reads it; what is not TOML counts as a word.
    """
    key, equals, value_text = (part.strip() for part in text.partition("="))
    if not equals or not key or not value_text:
        raise SceneError(f"setting {text!r}: must be KEY=VALUE, as in rock.unloading_ratio=10")
    try:
        return key, tomllib.loads(f"value = {value_text}")["value"]
    except tomllib.TOMLDecodeError:
        return key, value_text


def set_key(tree: dict[str, Any], key: str, value: Any) -> None:
    """Set a dotted key in nested tables and lists; None takes the key away."""
    *parents, last = key.split(".")
    node: Any = tree
    for depth, part in enumerate(parents):
        path = ".".join(parents[: depth + 1])
        if isinstance(node, list):
            node = node[_position(node, part, path)]
        else:
            node = node.setdefault(part, {})
        if not isinstance(node, (dict, list)):
            raise SceneError(unknown_key(key))
    if isinstance(node, list):
        node[_position(node, last, key)] = value
    elif value is None:
        node.pop(last, None)
    else:
        node[last] = value.item() if isinstance(value, np.generic) else value


def _position(items: list[Any], part: str, path: str) -> int:
    if part.isdigit() and int(part) < len(items):
        return int(part)
    raise SceneError(f"{path}: no such section; there are {len(items)}, counted from 0")


def flat_keys(tree: Mapping[str, Any]) -> Iterator[str]:
    """Go through the dotted keys of the parameters given in a nested mapping."""
    for group, entries in tree.items():
        if group in GROUPS:
            yield from (f"{group}.{name}" for name in entries)


def commented_scene(title: str, values: Mapping[str, Any], silent: Iterable[str]) -> str:
    """Write a complete scene, each parameter with its meaning, unit and bounds.

    Parameters
    ----------
    title : str
        Title of the scene.
    values : mapping
        Value of each dotted key, None where the solver picks one.
    silent : iterable of str
        Keys without influence on this scene: written, but commented out.
    """
    hidden = set(silent)
    lines = [*_HEADER, f"title = {toml_value(title)}"]
    group = ""
    for row in parameter_table():
        if "*" in row.key:
            continue
        if row.kind == "sections":
            lines += _commented_sections(row, values[row.key], row.key in hidden)
            continue
        if row.key.split(".")[0] != group:
            group = row.key.split(".")[0]
            lines += ["", f"[{group}]"]
        lines += _commented_value(row, values[row.key], row.key in hidden)
    return "\n".join(lines) + "\n"


def _commented_value(row: Row, value: Any, hidden: bool) -> list[str]:
    comment = f"# {row.description}: {row.allowed}"
    if hidden:
        comment += f"; needs {row.effect}"
    shown = "" if value is None else toml_value(value)
    mark = "# " if hidden or value is None else ""
    return [comment, f"{mark}{row.key.rpartition('.')[2]} = {shown}".rstrip()]


def _commented_sections(row: Row, sections: Iterable[Any], hidden: bool) -> list[str]:
    mark = "# " if hidden else ""
    lines = []
    for section in sections:
        lines += ["", f"{mark}[[{row.key}]]"]
        for name, value in section.model_dump().items():
            entry = rows_by_key()[f"{row.key}.*.{name}"]
            note = f"{entry.description} [{entry.unit}]"
            lines.append(f"{mark}{name} = {toml_value(value)}  # {note}")
    return lines


def explain_validation(error: ValidationError) -> str:
    """Turn pydantic's report into one line for each fault."""
    faults = {tuple(fault["loc"]): fault for fault in error.errors()}
    # A fault inside a list makes the list itself a fault too: say it once.
    above = {place[:k] for place in faults for k in range(len(place))}
    deepest = [fault for place, fault in faults.items() if place not in above]
    lines = [_explain(fault) for fault in deepest[:_MOST_FAULTS]]
    if len(deepest) > _MOST_FAULTS:
        lines.append(f"and {len(deepest) - _MOST_FAULTS} more faults")
    return "\n".join(lines)


def _explain(fault: Any) -> str:
    key = ".".join(str(part) for part in fault["loc"])
    value = fault["input"]
    if not key or (fault["type"] == "value_error" and find_row(key) is None):
        return str(fault["msg"]).removeprefix("Value error, ")
    if fault["type"] == "extra_forbidden":
        return unknown_key(key)
    row = find_row(key)
    if fault["type"] == "missing" and row is not None:
        return f"{key} is missing: must be {row.allowed}"
    if row is not None:
        return refuse_value(row, key, value)
    if key == "title":
        return f"title = {show_value(value)}: must be text"
    if generic_key(key).endswith(".*"):
        return f"{key} = {show_value(value)}: must be a table with length and area"
    return f"{key} = {show_value(value)}: must be a table, written [{key}]"


def unknown_key(key: str) -> str:
    """Say that a key is not known, and which known one is nearest."""
    key = _shortened(key)
    parent, _, name = key.rpartition(".")
    prefix = generic_key(parent) + "." if parent else ""
    keys = rows_by_key()
    siblings = [one.removeprefix(prefix) for one in keys if one.startswith(prefix)]
    siblings = [one for one in siblings if "." not in one]
    near = [one for one in siblings if one.startswith(name)]  # a shortened name
    near += difflib.get_close_matches(name, siblings, 1, _SIMILAR_ENOUGH)
    if near and parent:
        return f"unknown key {key}: did you mean {parent}.{near[0]}?"
    underlined = {one.replace(".", "_"): one for one in keys}
    if key in underlined:  # as keyword arguments of Python are written
        return f"unknown key {key}: did you mean {underlined[key]}?"
    known = list(keys) if parent else ["title", *GROUPS]
    near = difflib.get_close_matches(generic_key(key), known, 1, _SIMILAR_ENOUGH)
    if near:
        return f"unknown key {key}: did you mean {near[0].replace('.*', '.0')}?"
    if siblings and parent:
        return f"unknown key {key}: [{parent}] has the keys {', '.join(siblings)}"
    return f"unknown key {key}: a scene has a title and the tables {', '.join(GROUPS)}"
