"""Scenes as TOML, and the files that hold them."""

from __future__ import annotations

import codecs
import functools
import os
import re
import sys
import tomllib
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from percussion_model.scene.parameters import HOLE_DIAMETER, parameter_table, rows_by_key
from percussion_model.scene.rows import ParameterRow, SceneError, said_among, shortened, toml_value
from percussion_model.scene.units import has_unit, with_point
from percussion_model.scene.writing import write_whole

# A scene of a thousand sections has a tenth of it [bytes].
LARGEST_FILE = 1_000_000
# `piston.sections.length` has three parts; the time of the parser grows with their square.
DEEPEST_KEY = 10
_PART = r"""(?>[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*+\.[ \t]*+"""
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:{_PART}){{{DEEPEST_KEY}}}", re.ASCII)

# Marks at the beginning of a text in UTF-16, by the order of its bytes.
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
# Of the line that a message repeats [characters].
LONGEST_LINE = 60
_PLACE = re.compile(r"\(at line ([0-9]+), column [0-9]+\)$")
_BARE_WORD = re.compile(r"(?!(?:true|false|inf|nan)$)[A-Za-z][A-Za-z-]*")

_HEADER = (
    "# A scene for `percussion run`. SI units; positions and velocities point down,",
    "# forces on contact and rock are positive in compression. What is omitted takes",
    "# its default, which is the value of the reference scene.",
)


@functools.cache
def _names_in(folder: Path) -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in folder.glob("[!_]*.toml")))


def stored_names(folder: Path) -> list[str]:
    """Names under which bits, rocks or hammers are stored in a folder."""
    return list(_names_in(folder))


def read_stored(what: str, name: str, names: Collection[str], folder: Path) -> dict[str, Any]:
    """Read what is stored under a name in a folder: a bit, a rock, a hammer.

    Raises
    ------
    SceneError
        If there is none of that name.
    """
    if name not in names:
        raise SceneError(
            f"{what} {shortened(name)}: there is none of that name: {said_among(name, names)}"
        )
    return read_toml(folder / f"{name}.toml")


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file, with a clear error for what can go wrong."""
    if os.path.isdir(path):  # unlike Path, it bears a name that is too long
        raise SceneError(f"{path} is a folder: give the scene file in it")
    try:
        with path.open("rb") as file:  # no more than the limit, of a device without end as well
            content = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise SceneError(f"{path}: there is no such scene file") from None
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError:  # a name with a zero byte
        raise SceneError(f"{str(path)!r}: no file can have this name") from None
    if len(content) > LARGEST_FILE:
        raise SceneError(f"{path}: is larger than {LARGEST_FILE} bytes, which no scene needs")
    if content.startswith(_UTF_16):
        raise SceneError(f"{path}: is text in UTF-16, and TOML is UTF-8: save it as that")
    try:
        text = content.decode("utf-8-sig")  # editors of Windows put a mark before it
    except UnicodeDecodeError:
        raise SceneError(f"{path}: not a text file in UTF-8") from None
    if _DEEP_KEY.search(text):
        raise SceneError(
            f"{path}: a key has more than {DEEPEST_KEY} parts with points between them"
        )
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SceneError(f"{path}: tables or lists are nested too deep") from None
    except tomllib.TOMLDecodeError as error:
        if text.lstrip().startswith("{"):
            raise SceneError(f"{path}: JSON, as results are: must be a scene in TOML") from None
        raise SceneError(f"{path}: not valid TOML: {_about_fault(str(error), text)}") from None
    except ValueError:
        raise SceneError(
            f"{path}: a whole number has more than {sys.get_int_max_str_digits()} digits"
        ) from None


def _about_fault(told: str, text: str) -> str:
    """What is wrong with a text of TOML: the parser's words, with the line they are of."""
    place = _PLACE.search(told)
    if place is None:
        return shortened(told)
    line = text.split("\n")[int(place[1]) - 1].strip()
    value = line.partition("=")[2].partition("#")[0].strip()
    hint = ""
    if pointed := with_point(value):
        hint = f": a decimal point is wanted, as in {pointed}"
    elif _BARE_WORD.fullmatch(value) or has_unit(value):
        hint = f': text stands in quotes, as in "{value}"'
    return f"{shortened(told)}: {shortened(line, LONGEST_LINE)}{hint}"


def write_text(path: Path, text: str) -> None:
    """Write a file in one go: whatever happens, no half-written file stays."""
    try:
        write_whole(path, text)
    except OSError as error:
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
    except ValueError:  # of TOML, or a number of too many digits
        return key, value_text


def plain_scene(tree: Mapping[str, Any]) -> str:
    """Write nested tables as TOML."""
    import tomli_w  # only what writes scenes needs it

    return tomli_w.dumps(tree)


def commented_scene(
    head: Mapping[str, Any], values: Mapping[str, Any], silent: Iterable[str]
) -> str:
    """Write a complete scene, each parameter with its meaning, unit and bounds.

    Parameters
    ----------
    head : mapping
        Title of the scene, and the diameter of the hole where it is known.
    values : mapping
        Value of each dotted key, None where the solver picks one.
    silent : iterable of str
        Keys without influence on this scene: written, but commented out.
    """
    hidden = set(silent)
    lines = [*_HEADER, f"title = {toml_value(head['title'])}"]
    lines += _commented_value(HOLE_DIAMETER, head.get(HOLE_DIAMETER.key), False)
    group = ""
    for row in parameter_table():
        if "*" in row.key or row is HOLE_DIAMETER:
            continue
        if row.kind == "sections":
            lines += _commented_sections(row, values[row.key], row.key in hidden)
            continue
        if row.kind == "rods" and values[row.key]:
            lines += _commented_rods(row, values[row.key])
            continue
        if row.key.split(".")[0] != group:
            group = row.key.split(".")[0]
            lines += ["", f"[{group}]"]
        lines += _commented_value(row, values[row.key], row.key in hidden)
    return "\n".join(lines) + "\n"


def _commented_value(row: ParameterRow, value: Any, hidden: bool) -> list[str]:
    comment = f"# {row.description}: {row.allowed}"
    if hidden:
        comment += f"; needs {row.effect}"
    shown = "" if value in (None, ()) else toml_value(value)
    mark = "# " if hidden or value in (None, ()) else ""
    return [comment, f"{mark}{row.key.rpartition('.')[2]} = {shown}".rstrip()]


def _commented_rods(row: ParameterRow, rods: Iterable[Any]) -> list[str]:
    lines = []
    for rod in rods:
        lines += ["", f"[[{row.key}]]"]
        for name in rod.telling:
            entry = rows_by_key()[f"{row.key}.*.{name}"]
            if entry.kind == "sections":
                continue
            unit = f" [{entry.unit}]" if entry.unit else ""
            lines.append(f"{name} = {toml_value(getattr(rod, name))}  # {entry.description}{unit}")
        sections = rows_by_key()[f"{row.key}.*.sections"]
        lines += _commented_sections(sections, rod.sections, False, f"{row.key}.sections")
    return lines


def _commented_sections(
    row: ParameterRow, sections: Iterable[Any], hidden: bool, table: str = ""
) -> list[str]:
    mark = "# " if hidden else ""
    lines = []
    for section in sections:
        lines += ["", f"{mark}[[{table or row.key}]]"]
        for name, value in asdict(section).items():
            entry = rows_by_key()[f"{row.key}.*.{name}"]
            note = f"{entry.description} [{entry.unit}]"
            lines.append(f"{mark}{name} = {toml_value(value)}  # {note}")
    return lines
