"""Groups of parameters: plain frozen values, checked when they are given."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar, Self

from percussion_model.scene.rows import (
    REFUSED,
    Faults,
    Needs,
    ParameterRow,
    generic_key,
    nearest,
    show_value,
)
from percussion_model.scene.units import read_value, refuse

# What must hold, key by key, for a parameter to have any influence.
HAS_PISTON: Needs = {"piston.model": ("elastic", "rigid")}
HAS_WAVES: Needs = {"bit.model": ("elastic",)}
SOLVER_WAVE: Needs = {"solver.name": ("auto", "wave", "modal"), **HAS_WAVES}
SOLVER_MODAL: Needs = {"solver.name": ("auto", "modal"), **HAS_WAVES}
SOLVER_FEM: Needs = {"solver.name": ("fem",)}
ALL_RIGID: Needs = {"piston.model": ("rigid",), "bit.model": ("rigid",)}
GRAVITY_ON: Needs = {"effects.gravity": (True,)}
FEED_ON: Needs = {"effects.feed": (True,)}
FEED_ON_CASING: Needs = {"feed.on": ("casing",), **FEED_ON}
DRIVE_PRESSURE: Needs = {"effects.drive": ("pressure",)}
DRIVE_EXTERNAL: Needs = {"effects.drive": ("external",)}
LOSS_ON: Needs = {"effects.loss": (True,), **HAS_WAVES}
ROCK_CRUSHED: Needs = {"effects.rock": ("bilinear", "power")}
ROCK_POWER: Needs = {"effects.rock": ("power",)}
ROCK_SPRINGY: Needs = {"effects.rock": ("bilinear", "spring", "power")}
ROCK_PRESENT: Needs = {"effects.rock": ("bilinear", "spring", "wall", "power")}
BARRIER_ON: Needs = {"effects.barrier": (True,), **ROCK_CRUSHED}
CUTTINGS_ON: Needs = {"effects.cuttings": (True,), **ROCK_CRUSHED}
STRING_ON: Needs = {"effects.string": (True,), **HAS_WAVES}
JOINTS_ON: Needs = {"effects.joints": (True,), **STRING_ON}
DAMPER_ON: Needs = {"effects.damper": (True,), **STRING_ON}
NO_PISTON: Needs = {"piston.model": ("absent",), **STRING_ON}


class Parameters:
    """A group of parameters: plain frozen values, checked when they are given.

    Bad values raise `SceneError`.
    """

    key: ClassVar[str] = ""  # of the group in a scene
    # says that a key is not known; the whole table does
    say_unknown: ClassVar[Callable[[str], str]] = staticmethod("unknown key {}".format)
    rows: ClassVar[dict[str, ParameterRow]] = {}  # by the name of the field
    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]
    _defaults: ClassVar[dict[str, Any]] = {}
    _given: frozenset[str]

    def __init_subclass__(cls) -> None:
        dataclasses.dataclass(frozen=True, init=False)(cls)
        fields = dataclasses.fields(cls)
        cls.rows = {one.name: one.metadata["row"] for one in fields if one.metadata}
        cls._defaults = {name: row.default for name, row in cls.rows.items()}

    def __init__(self, **values: Any) -> None:
        faults = Faults()
        self._fill(values, self.key, faults)
        faults.refuse()

    @classmethod
    def read(cls, value: Any, key: str, faults: Faults) -> Self:
        """Return a group as it is, or make it of a table of values."""
        if isinstance(value, cls):
            return value
        group = cls.__new__(cls)
        if isinstance(value, (dict, Mapping)):  # mostly the first, which is quick to see
            group._fill(value, key, faults)
        elif generic_key(key).endswith(".*"):
            faults.add(_refuse_table, key, value, "a table with length and area")
        else:
            faults.add(_refuse_table, key, value, f"a table, written [{key}]")
        return group

    def _fill(self, values: Mapping[str, Any], key: str, faults: Faults) -> None:
        kept, rows = self.__dict__, self.rows
        kept.update(self._defaults)
        kept["_given"] = frozenset(values)
        unknown = [name for name in values if name not in rows]
        # a misspelt key is one fault, and not that it is missing as well
        meant = {nearest(str(name), rows) for name in unknown[: len(rows)]}
        for name, row in rows.items():
            if name not in values:
                if row.required and name not in meant:
                    faults.add(_refuse_missing, row, f"{key}.{name}")
            elif row.kind in LISTED:
                kept[name] = _entries(row, f"{key}.{name}", values[name], faults)
            else:
                kept[name] = found = read_value(row, values[name])
                if found is REFUSED:
                    faults.add(refuse, row, f"{key}.{name}", values[name])
        for name in unknown:
            faults.add(Parameters.say_unknown, f"{key}.{name}")

    @property
    def telling(self) -> tuple[str, ...]:
        """Names of the parameters that matter in an entry of a list."""
        return tuple(self.rows)

    def given_values(self) -> dict[str, Any]:
        """Return the values that were given, not left to their defaults."""
        return {name: self.__dict__[name] for name in self.rows if name in self._given}


# What stands in a list of tables, and how many entries it may have, by the kind of its row.
LISTED: dict[str, type[Parameters]] = {}
MOST_LISTED: dict[str, int] = {}


def _entries(row: ParameterRow, key: str, value: Any, faults: Faults) -> tuple[Parameters, ...]:
    """Read a list of tables; empty where it is none."""
    try:
        found = [] if isinstance(value, (str, bytes, Mapping)) else list(value)
    except TypeError:  # no list of anything
        found = []
    if not found and (row.default != () or value not in ([], ())):
        faults.add(refuse, row, key, value)
    if len(found) > MOST_LISTED[row.kind]:
        faults.add(_refuse_many, row, key, len(found), MOST_LISTED[row.kind])
        found = []
    return tuple(LISTED[row.kind].read(one, f"{key}.{k}", faults) for k, one in enumerate(found))


def _refuse_many(row: ParameterRow, key: str, count: int, most: int) -> str:
    return f"{key}: {count} {row.kind}: must be at most {most}"


def _refuse_table(key: str, value: Any, wanted: str) -> str:
    return f"{key} = {show_value(value)}: must be {wanted}"


def _refuse_missing(row: ParameterRow, key: str) -> str:
    return f"{key} is missing: must be {row.allowed}"


def table_of(groups: Mapping[str, type[Parameters]]) -> Iterator[ParameterRow]:
    """Go through the rows of groups; keys of sections have a `*` for their number."""
    for key, group in groups.items():
        for name, row in group.rows.items():
            yield dataclasses.replace(row, key=f"{key}.{name}")
            if row.kind in LISTED:
                yield from table_of({f"{key}.{name}.*": LISTED[row.kind]})
