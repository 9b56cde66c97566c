"""Unpacked SSP archive: what it says of components, connections and values, and of the time.

Whatever SSP 1.0 can say is applied, changes no number, or is refused here (docs/data/ssp.md).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote, urlsplit
from urllib.request import url2pathname

from percussion_model.coupling.component import CouplingError, naming
from percussion_model.coupling.ssp_units import Unit, unit_named, units_of
from percussion_model.coupling.ssp_values import (
    Transformation,
    Value,
    bound_values,
    transformation_of,
)
from percussion_model.coupling.ssp_xml import (
    Reader,
    elements,
    is_true,
    within,
    word_of,
)
from percussion_model.coupling.unpack import LONGEST_NAME, Allowance, unpack_zip
from percussion_model.scene.rows import shortened

STRUCTURE = "SystemStructure.ssd"
MOST_PARTS = 100
FMU = "application/x-fmu-sharedlibrary"
# The outermost system, as an element. Elements in systems within it have the names of these
# before their own, with dots between.
SYSTEM = ""
# Element and connector.
Place = tuple[str, str]


class Connector(NamedTuple):
    """What an archive says of a variable: its causality, and type and unit where it has them.

    Numbers of an enumeration by their words stand in `items`, if the archive has them.
    """

    kind: str
    type: str | None
    unit: Unit | None
    items: dict[str, int]


class Connection(NamedTuple):
    """A connection, in the order of the archive: that does not say which end is the source.

    Attributes
    ----------
    system : str
        In which it stands.
    ends : tuple
        Element and connector of both.
    transformation : Transformation or None
    keeps_unit : bool
        Whether no unit is converted.
    """

    system: str
    ends: tuple[Place, Place]
    transformation: Transformation | None
    keeps_unit: bool

    def __str__(self) -> str:
        one, other = (signal_name(*end) for end in self.ends)
        return shortened(f"connection of {one} to {other}")


@dataclass(frozen=True)
class Archive:
    """An unpacked archive.

    Attributes
    ----------
    sources : dict of Path
        FMU by component, in the order of the archive.
    systems : list of str
        Elements that are systems, outer before inner ones.
    values : dict of dict
        What the archive sets, by component and by system.
    connections : list of Connection
    connectors : dict of Connector
        By element and name.
    start, stop : float or None
        Of the default experiment [s].
    """

    sources: dict[str, Path]
    systems: list[str]
    values: dict[str, dict[str, Value]]
    connections: list[Connection]
    connectors: dict[Place, Connector]
    start: float | None
    stop: float | None


def signal_name(element: str, name: str) -> str:
    """How a variable of a component, or what stands in a system, is called."""
    return f"{element}.{name}" if element else name


def name_within(element: str, name: str) -> str | None:
    """Name within an element of what has this name outside of it; None of what is elsewhere."""
    inner = name.removeprefix(signal_name(element, ""))
    return inner if inner != name or element == SYSTEM else None


def place_of(signal: str, components: Iterable[str]) -> Place:
    """Component and variable of a signal; names of components may have dots, too."""
    found = [one for one in components if name_within(one, signal) is not None]
    component = max(found, key=len, default=signal.partition(".")[0])
    return component, name_within(component, signal) or ""


def unpack(path: Path, folder: str, allowance: Allowance) -> Archive:
    """Read an archive and unpack it into a folder.

    Parameters
    ----------
    path : Path
    folder : str
        One that is there.
    allowance : Allowance
        What the archive may take; one that is trusted may name FMUs outside of it.
    """
    if path.is_dir():
        raise CouplingError(f"{path}: is a folder: give the archive (.ssp) in it")
    if not path.is_file():
        raise CouplingError(
            f"{path}: no such file; `percussion system {path.stem}` makes it in dist, if it ships"
        )
    reader = Reader(Path(folder), allowance)
    with naming(path):
        unpack_zip(path, reader.folder, allowance)
        if not (reader.folder / STRUCTURE).is_file():
            raise CouplingError(f"is no SSP archive: there is no {STRUCTURE} in it")
        return _read(path, reader)


def _read(path: Path, reader: Reader) -> Archive:
    root = reader.structure(STRUCTURE)
    (system,) = elements(root, "ssd:System")
    named = {SYSTEM: system}
    _find_elements(SYSTEM, named)
    systems = [name for name, node in named.items() if word_of(node) == "System"]
    components = {name: node for name, node in named.items() if word_of(node) != "System"}
    for word, count, least in (("components", len(components), 1), ("systems", len(systems), 0)):
        if not least <= count <= MOST_PARTS:
            raise CouplingError(f"has {count} {word}, not {least} to {MOST_PARTS}")
    units = units_of(root, "ssd:Units/ssc:Unit")
    return Archive(
        {name: _source_of(name, node, reader, path) for name, node in components.items()},
        systems,
        {name: _values_of(name, node, reader, units) for name, node in named.items()},
        [one for name in systems for one in _connections(name, named[name])],
        _connectors(named, units, _enumerations(root)),
        _time_of(root, "startTime"),
        _time_of(root, "stopTime"),
    )


def _find_elements(system: str, named: dict[str, Any]) -> None:
    """Add the elements within a system to those that are named; what is not read is refused."""
    for node in elements(named[system], "ssd:Elements/*"):
        name, word = signal_name(system, node.get("name")), word_of(node).lower()
        if not (name.isprintable() and 0 < len(name) <= LONGEST_NAME):
            raise CouplingError(
                f"{word} {shortened(name)!r}: must have 1 to {LONGEST_NAME} characters that can "
                "be printed"
            )
        if word not in ("component", "system"):
            raise CouplingError(
                f"{word_of(node)} {shortened(name)}: signals of a dictionary are not computed: "
                "connect the components directly"
            )
        if name in named:
            raise CouplingError(f"has two {word}s {name}")
        for key, allowed in (("type", (FMU,)), ("implementation", ("any", "CoSimulation"))):
            if node.get(key, allowed[0]) not in allowed:
                raise CouplingError(
                    f"component {name}: {key} = {shortened(node.get(key))}: must be "
                    f"{' or '.join(allowed)}"
                )
        named[name] = node
        if word == "system":
            _find_elements(name, named)


def _source_of(name: str, component: Any, reader: Reader, path: Path) -> Path:
    """File of a component's FMU; outside of the archive only where that is trusted."""
    source, trusted = component.get("source"), reader.allowance.trusted
    found = within(reader.folder, source)
    if found is None and trusted:
        try:
            is_uri = source.startswith("file:")
            place = url2pathname(urlsplit(source).path) if is_uri else unquote(source)
            found = (path.parent / place).resolve()
            found = found if found.is_file() else None
        except (OSError, ValueError):
            found = None
    if found is None:
        trust = "" if trusted else " (--trust allows others)"
        raise CouplingError(
            f"component {name}: source = {shortened(source)!r}: must be an FMU within the "
            f"archive{trust}, no folder and no link"
        )
    return found


def _values_of(name: str, node: Any, reader: Reader, units: dict[str, Unit]) -> dict[str, Value]:
    with naming(f"{word_of(node).lower()} {name}".rstrip()):
        return bound_values(node, reader, units)


def _connectors(
    named: dict[str, Any], units: dict[str, Unit], enumerations: dict[str, dict[str, int]]
) -> dict[Place, Connector]:
    """Connectors of all components and systems."""
    found: dict[Place, Connector] = {}
    for element, node in named.items():
        for one in elements(node, "ssd:Connectors/ssd:Connector"):
            key = element, one.get("name")
            if key in found:
                raise CouplingError(f"connector {shortened(signal_name(*key))}: stands there twice")
            types = elements(one, "ssc:*")  # geometry and annotations are of another space
            name = word_of(types[0]) if types else None
            unit = unit_named(types[0].get("unit"), units) if types else None
            items = enumerations.get(types[0].get("name"), {}) if types else {}
            found[key] = Connector(one.get("kind"), name, unit, items)
    return found


def _enumerations(root: Any) -> dict[str, dict[str, int]]:
    """Numbers by word of all enumerations of the structure, by name."""
    return {
        one.get("name"): {
            item.get("name"): int(item.get("value")) for item in elements(one, "ssc:Item")
        }
        for one in elements(root, "ssd:Enumerations/ssc:Enumeration")
    }


def _connections(system: str, node: Any) -> Iterator[Connection]:
    """Connections within a system, each of what stands directly in it."""
    inside = [one.get("name") for one in elements(node, "ssd:Elements/*")]
    known = {*inside, None}
    for one in elements(node, "ssd:Connections/ssd:Connection"):
        ends: list[Place] = []
        unknown: set[Any] = set()
        for end in ("start", "end"):
            # OMSimulator leaves it empty where it means the system
            element = one.get(f"{end}Element") or None
            name = system if element is None else signal_name(system, element)
            ends.append((name, one.get(f"{end}Connector")))
            unknown = unknown or ({element} - known)
        keeps_unit = is_true(one.get("suppressUnitConversion"))
        found = Connection(system, (ends[0], ends[1]), None, keeps_unit)
        with naming(found):
            for name in unknown:
                told = shortened(", ".join(inside))
                raise CouplingError(f"there is no component {shortened(name)}, only {told}")
            yield found._replace(transformation=transformation_of(one))


def _time_of(root: Any, key: str) -> float | None:
    """Start or stop of the default experiment [s], None where it does not say."""
    for one in elements(root, "ssd:DefaultExperiment"):
        if key in one.attrib:
            time = float(one.get(key))
            if not math.isfinite(time):
                raise CouplingError(f"DefaultExperiment: {key} = {time}: must be finite")
            return time
    return None
