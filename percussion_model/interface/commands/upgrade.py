"""Command `upgrade`: a scene of an older version, with the names of this one."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from percussion_model.interface.commands import common


class Change(NamedTuple):
    """What became of a key, or of one of its values; of a table with all its keys.

    Attributes
    ----------
    key : str
        Dotted; that of a table has no point.
    value : str or None
        That is no more; None: any.
    new : str or None
        Value in its place; None: the key is removed.
    why : str
    version : str
        In which it changed.
    """

    key: str
    value: str | None
    new: str | None
    why: str
    version: str


_NO_MAP = "the default solver drills an hour in about a minute"
CHANGES = (
    Change("blow_map", None, None, _NO_MAP, "0.1.0"),
    Change("solver.fidelity", "blow-map", None, _NO_MAP, "0.1.0"),
    Change("solver.name", "blow-map", None, _NO_MAP, "0.1.0"),
    Change("solver.name", "chain", "wave", "waves take bars between piston and bit too", "0.1.0"),
)

_TABLE = re.compile(r"\s*\[+\s*([\w.-]+)\s*\]+\s*(#.*)?$")
_ENTRY = re.compile(r"(\s*([\w.-]+)\s*=\s*)(.*\S)\s*$")


def upgrade(
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="A scene file (TOML).")],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="File to write; without it only says what changed.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
) -> None:
    """Bring a scene of an older version up to date, with its comments, and say what changed."""
    from percussion_model.scene.rows import SceneError
    from percussion_model.scene.scene import Scene
    from percussion_model.scene.text import read_toml

    common.check_file("-o", output)
    if output is not None:
        common.refuse_existing(output, force)
    tree = read_toml(scene)
    found = [change for change in CHANGES if _has(tree, change)]
    text, told = edited(scene.read_text(encoding="utf-8-sig"), found)
    left = [change.key for change in CHANGES if _has(tomllib.loads(text), change)]
    if left:
        raise common.refusal(f"{scene}: {left[0]} is not written on a line of its own: remove it")
    try:
        Scene(**tomllib.loads(text))
    except SceneError as error:
        raise common.refusal(f"{scene}: {error}") from None
    for line in told or ["nothing to change: the scene is one of this version"]:
        typer.echo(line)
    if output is not None:
        common.list_files([common.write_file(output, text)])


def _has(tree: dict[str, Any], change: Change) -> bool:
    table, _, name = change.key.partition(".")
    if not name:
        return table in tree
    found = tree.get(table)
    return isinstance(found, dict) and name in found and change.value in (None, found[name])


def edited(text: str, changes: list[Change]) -> tuple[str, list[str]]:
    """A scene's text with changes made line by line, and a line of words for each."""
    lines, told, table = [], [], ""
    by_key = {(change.key, change.value): change for change in changes}
    for line in text.splitlines(keepends=True):
        if head := _TABLE.match(line):
            table = head[1]
        change = by_key.get((table, None))
        entry = None if change else _ENTRY.match(line)
        if entry:
            key = f"{table}.{entry[2]}" if table else entry[2]
            change = by_key.get((key, _value(entry[3])))
        if change is None:
            lines.append(line)
            continue
        if head or entry:  # of a table its head alone
            now = "removed" if change.new is None else f'now "{change.new}"'
            was = f"[{change.key}]" if change.value is None else f'{change.key} = "{change.value}"'
            told.append(f"{was}: {now}, since {change.version}: {change.why}")
        if entry and change.new is not None:
            end = line.partition("#")[2]
            lines.append(f'{entry[1]}"{change.new}"{f"  #{end.rstrip()}" if end else ""}\n')
    return "".join(lines), told


def _value(text: str) -> Any:
    """A value as it is written behind its key; None where it goes on in other lines."""
    try:
        found = tomllib.loads(f"x = {text}")["x"]
    except tomllib.TOMLDecodeError:
        return None
    return found if isinstance(found, str) else None
