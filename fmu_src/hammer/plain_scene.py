"""A scene as plain values: what the solvers read, without what makes scenes."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from percussion_model.scene.rows import Row, generic_key
from percussion_model.scene.rules import (
    BarNumbers,
    SceneError,
    SceneRules,
    SectionNumbers,
    refuse_contradictions,
)


class PlainSection(SimpleNamespace, SectionNumbers):
    """A section with its values as attributes."""


class PlainBar(SimpleNamespace, BarNumbers):
    """A bar with its values as attributes."""


class PlainScene(SimpleNamespace, SceneRules):
    """A scene with its groups as attributes; not to be changed.

    Parameters
    ----------
    values : mapping
        Value of every key, `piston.sections.0.length` included.
    given : iterable of str
        Keys that were given, not left to their defaults.
    rows : mapping
        Row of each key in the parameter table, sections with `*`.
    """

    def __init__(self, values: Mapping[str, Any], given: Any, rows: Mapping[str, Row]) -> None:
        tree: dict[str, Any] = {}
        for key, value in values.items():
            *parents, last = key.split(".")
            node = tree
            for part in parents:
                node = node.setdefault(part, {})
            node[last] = value
        super().__init__(**{name: _group(entries) for name, entries in tree.items()})
        self._given = frozenset(given)
        self._rows = rows

    @property
    def given(self) -> frozenset[str]:
        """Dotted keys that were given, not left to their defaults."""
        return self._given

    def row_of(self, key: str) -> Row:
        """Row of a dotted key in the parameter table."""
        try:
            return self._rows[generic_key(key)]
        except KeyError:
            raise SceneError(f"unknown key {key}") from None


def make_scene(values: Mapping[str, Any], given: Any, rows: Mapping[str, Row]) -> PlainScene:
    """Return a scene; raise `SceneError` if parts of it contradict each other."""
    scene = PlainScene(values, given, rows)
    refuse_contradictions(scene)
    return scene


def _group(entries: dict[str, Any]) -> SimpleNamespace:
    if "sections" not in entries:
        return SimpleNamespace(**entries)
    sections = tuple(PlainSection(**section) for section in entries.pop("sections").values())
    return PlainBar(sections=sections, **entries)
