"""Flat names of variables, for hosts that make buses of names with dots.

An FMU has them in its descriptions alone: what runs in it knows variables by their references,
and messages keep the names with dots.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from xml.etree.ElementTree import Element

_MARKS = re.compile(r"[.\[\]]+")


def flat_name(name: str) -> str:
    """The name with underscores for dots and brackets, as piston_sections_1_length."""
    return _MARKS.sub("_", name).strip("_")


def flat_names(names: Iterable[str]) -> dict[str, str]:
    """Flat names by names; where two would have the same, that with dots gets more underscores."""
    plain = {name: flat_name(name) for name in names}
    counts = Counter(plain.values())
    return {
        name: flat if name == flat or counts[flat] == 1 else wide_name(name)
        for name, flat in plain.items()
    }


def wide_name(name: str) -> str:
    """The name with two underscores for dots and brackets."""
    return _MARKS.sub("__", name).strip("_")


def flatten(root: Element) -> None:
    """Give the variables of a model description flat names.

    Raises
    ------
    ValueError
        If two of them have the same.
    """
    root.set("variableNamingConvention", "flat")
    seen: dict[str, str] = {}
    nodes = list(root.find("ModelVariables") or ())
    known = flat_names(node.attrib["name"] for node in nodes)
    for node in nodes:
        name = node.attrib["name"]
        flat = known[name]
        if flat in seen:
            raise ValueError(f"{seen[flat]} and {name} would both be {flat}")
        seen[flat] = name
        node.set("name", flat)
