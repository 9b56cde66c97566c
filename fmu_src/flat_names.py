"""Flat names of variables, for hosts that make buses of names with dots.

An FMU has them in its descriptions alone: what runs in it knows variables by their references,
and messages keep the names with dots.
"""

from __future__ import annotations

import re
from xml.etree.ElementTree import Element

_MARKS = re.compile(r"[.\[\]]+")


def flat_name(name: str) -> str:
    """The name with underscores for dots and brackets, as piston_sections_1_length."""
    return _MARKS.sub("_", name).strip("_")


def flatten(root: Element) -> None:
    """Give the variables of a model description flat names.

    Raises
    ------
    ValueError
        If two of them have the same.
    """
    root.set("variableNamingConvention", "flat")
    seen: dict[str, str] = {}
    for node in root.find("ModelVariables") or ():
        name = node.attrib["name"]
        flat = flat_name(name)
        if flat in seen:
            raise ValueError(f"{seen[flat]} and {name} would both be {flat}")
        seen[flat] = name
        node.set("name", flat)
