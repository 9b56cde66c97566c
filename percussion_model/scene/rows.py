"""Rows of the parameter table: declaration, what is allowed, and the wording of faults.

Standard library only: every FMU takes this module along.
"""

from __future__ import annotations

import dataclasses
import difflib
import json
import math
import numbers
import reprlib
import unicodedata
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

from percussion_model.scene.retired import remark

Kind = Literal["number", "whole number", "flag", "choice", "sections", "rods"]

# Of a key or of a parser's words, no more than this is repeated in a message.
_LONGEST_WORDS = 200
# Nor more of a value [characters].
_LONGEST_VALUE = 60
# A whole number of more is beyond all floats [bits].
_LONGEST_WHOLE = 1024
# Below this similarity a guess at a misspelt name misleads more than it helps.
SIMILAR_ENOUGH = 0.6
# More faults of one scene than this are counted, not told.
_MOST_FAULTS = 30
# No characters by Unicode, and refused by XML.
NO_XML = "\ufffe\uffff"
# What `ParameterRow.read` returns for a value that is not allowed.
REFUSED = object()


class SceneError(ValueError):
    """A scene that cannot be read or makes no sense; the message says what to do."""


@dataclass(frozen=True)
class ParameterRow:
    """One parameter.

    Keys of bars and sections have a `*` for their number, counted from 0. `typical` is where
    hammers and rocks of the literature lie, from and to; None where no source says so.
    """

    key: str
    kind: Kind
    unit: str
    lower: float | None
    lower_open: bool  # the bound itself is not allowed
    upper: float | None
    upper_open: bool
    default: Any
    required: bool
    choices: Sequence[Any]
    description: str
    needs: Mapping[str, tuple[Any, ...]]
    typical: tuple[float, float] | None = None

    @property
    def allowed(self) -> str:
        """Say what values are allowed, as in "a number above 0 and up to 10 m^2"."""
        if self.kind == "flag":
            return "true or false"
        if self.kind == "choice":
            return "one of " + ", ".join(toml_value(choice) for choice in self.choices)
        if self.kind == "sections":
            return "a list of at least one section, each with length and area"
        if self.kind == "rods":
            return "a list of bars, each with sections and a joint"
        return f"a {self.kind} {self._range()}{unit_suffix(self.unit)}".rstrip()

    def _range(self) -> str:
        if self.lower is None or self.upper is None:
            return ""
        if self.lower_open or self.upper_open:
            start = "above" if self.lower_open else "from"
            end = "below" if self.upper_open else "up to"
            return f"{start} {short_number(self.lower)} and {end} {short_number(self.upper)}"
        return f"from {short_number(self.lower)} to {short_number(self.upper)}"

    @property
    def effect(self) -> str:
        """Say what must be on for this parameter to matter; empty if it always does."""
        parts = []
        for key, values in self.needs.items():
            parts.append(f"{key} = " + " or ".join(toml_value(value) for value in values))
        return ", ".join(parts)

    def read(self, value: Any) -> Any:
        """Return a value as a scene keeps it, `REFUSED` if it is not allowed.

        Words and whole numbers must be such themselves: True and 1.0 are no 1.
        """
        if self.kind == "number":
            if self.allows(value):
                return float(value)
        elif self.kind == "whole number":
            if isinstance(value, int) and self.allows(value):
                return int(value)
        elif self.kind == "flag":
            if type(value) is bool:
                return value
        elif type(value) is int or isinstance(value, str):
            for choice in self.choices:
                if value == choice:
                    return choice
        if value is None and self.default is None and not self.required:
            return None
        return REFUSED

    def allows(self, value: Any) -> bool:
        """Whether a number lies within the bounds."""
        if not is_number(value):
            return False
        value = float(value)  # narrow numbers would narrow the bounds
        low = self.lower is None or value > self.lower
        low = low or (value == self.lower and not self.lower_open)
        high = self.upper is None or value < self.upper
        high = high or (value == self.upper and not self.upper_open)
        return low and high


# What must hold, key by key, for a parameter to have any influence.
Needs = dict[str, tuple[object, ...]]


def quantity(
    default: Any,
    unit: str,
    description: str,
    needs: Needs | None = None,
    typical: tuple[float, float] | None = None,
    **bounds: float,
) -> Any:
    """Declare a number with its unit, bounds (gt, ge, lt, le) and what it needs.

    The default ... makes it required; None lets it be left out. `typical` is the range that
    sources have, where there are any.
    """
    return _declare("number", default, description, needs, unit, bounds=bounds, typical=typical)


def count(
    default: int | None, unit: str, description: str, needs: Needs | None = None, **bounds: float
) -> Any:
    """Declare a whole number, as `quantity` does a number."""
    return _declare("whole number", default, description, needs, unit, bounds=bounds)


def flag(default: bool, description: str, needs: Needs | None = None) -> Any:
    """Declare a switch."""
    return _declare("flag", default, description, needs)


def choice(
    default: Any, choices: Sequence[Any], description: str, needs: Needs | None = None
) -> Any:
    """Declare one of several words or whole numbers."""
    return _declare("choice", default, description, needs, choices=choices)


def section_list(default: tuple[Any, ...], needs: Needs | None = None) -> Any:
    """Declare the sections of a bar."""
    return _declare("sections", default, "sections from top to bottom", needs)


def rod_list(needs: Needs | None = None) -> Any:
    """Declare the bars between piston and bit."""
    return _declare("rods", (), "bars from top to bottom", needs)


def _declare(
    kind: Any,
    default: Any,
    description: str,
    needs: Needs | None,
    unit: str = "",
    choices: Sequence[Any] = (),
    bounds: Mapping[str, float] = MappingProxyType({}),
    typical: tuple[float, float] | None = None,
) -> Any:
    low, high = bounds.get("gt", bounds.get("ge")), bounds.get("lt", bounds.get("le"))
    row = ParameterRow(
        key="",
        kind=kind,
        unit=unit,
        lower=None if low is None else float(low),
        lower_open="gt" in bounds,
        upper=None if high is None else float(high),
        upper_open="lt" in bounds,
        default=None if default is ... else default,
        required=default is ...,
        choices=choices,
        description=description,
        needs=needs or {},
        typical=typical,
    )
    return dataclasses.field(default=row.default, metadata={"row": row})


def is_number(value: Any) -> bool:
    """Whether a value is a finite real number, and no truth value."""
    if type(value) is float:  # by far the most frequent, and the rest takes its time
        return math.isfinite(value)
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number beyond all floats
        return False


def short_number(number: float) -> str:
    """Write a bound without needless digits, as in 1e9."""
    return f"{number:g}".replace("e+0", "e").replace("e+", "e").replace("e-0", "e-")


def unit_suffix(unit: str) -> str:
    """Return the unit as it follows a number, nothing for pure numbers."""
    return f" {unit}" if unit not in ("", "-") else ""


def toml_value(value: object) -> str:
    """Write a flag, a number or a text as in a TOML file.

    Raises
    ------
    TypeError
        For anything else.
    """
    if isinstance(value, (bool, str)):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if type(value) is int and value.bit_length() > _LONGEST_WHOLE:
        return hex(value)  # Python refuses to write so many decimal digits
    if type(value) in (int, float):
        return repr(value)
    raise TypeError(f"{type(value).__name__} is no simple value")


def generic_key(key: str) -> str:
    """Replace the numbers of bars and sections in a dotted key by `*`."""
    return ".".join("*" if part.isdecimal() else part for part in key.split("."))


def unprintable(text: str) -> str:
    """First character of a text that neither XML nor a terminal bears; empty if it has none."""
    return next((c for c in text if unicodedata.category(c) in ("Cc", "Cs") or c in NO_XML), "")


def shortened(text: str, most: int = _LONGEST_WORDS) -> str:
    """Text of others, no longer than a message bears."""
    return text if len(text) <= most else text[:most] + "..."


def nearest(name: str, known: Collection[str]) -> str:
    """The known name that a misspelt or shortened one was meant to be; empty if none is near."""
    name = shortened(name)
    near = [one for one in known if one.startswith(name)]  # as far as it was written
    near += difflib.get_close_matches(name, known, 1, SIMILAR_ENOUGH)
    return near[0] if near else ""


def said_among(name: str, known: Collection[str]) -> str:
    """Say which names there are, and before them the one that was meant, if one is near."""
    near, names = nearest(name, known), ", ".join(known)
    return f"did you mean {near}? Known are {names}" if near else f"known are {names}"


def refuse_value(row: ParameterRow, key: str, value: Any) -> str:
    """Say that a value is not allowed, and what is."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    unit = unit_suffix(row.unit) if number else ""
    return f"{key} = {show_value(value)}{unit}: must be {row.allowed}{remark(key, value)}"


def show_value(value: Any) -> str:
    """Show a value as it stands in a scene file, shortened."""
    if type(value) is int:
        return shortened(toml_value(value), _LONGEST_VALUE)
    try:
        text = toml_value(value)
    except TypeError:
        text = _python_value(value)
    return text if len(text) <= _LONGEST_VALUE and "\n" not in text else reprlib.repr(value)


def _python_value(value: Any) -> str:
    try:
        return repr(value)
    except ValueError:  # holds a whole number of too many digits
        return f"a {type(value).__name__}"


class Faults:
    """What is wrong with a scene, a line for each fault, as long as they can be read."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.untold = 0

    def add(self, say: Callable[..., str], *words: Any) -> None:
        """Note a fault; its wording is worked out only if it will be told."""
        if len(self.lines) < _MOST_FAULTS:
            self.lines.append(say(*words))
        else:
            self.untold += 1

    def refuse(self) -> None:
        """Raise `SceneError` if there are any."""
        if self.untold:
            self.lines.append(f"and {self.untold} more faults")
        if self.lines:
            raise SceneError("\n".join(self.lines))
