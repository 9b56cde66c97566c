"""Unpacked SSP archive: what it says of components, connections and values, and of the time.

Whatever SSP 1.0 can say is applied, changes no number, or is refused here (docs/data/ssp.md).
"""

from __future__ import annotations

import math
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
    InvalidError,
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
# The element whose connectors are those of the system itself.
SYSTEM = ""


class Connector(NamedTuple):
    """What an archive says of a variable: its causality, and type and unit where it has them."""

    kind: str
    type: str | None
    unit: Unit | None


class Connection(NamedTuple):
    """A connection, in the order of the archive: that does not say which end is the source.

    Attributes
    ----------
    ends : tuple
        Element and connector of both.
    transformation : Transformation or None
    keeps_unit : bool
        Whether no unit is converted.
    """

    ends: tuple[tuple[str, str], tuple[str, str]]
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
    values : dict of dict
        What the archive sets, by component, that of the whole system under `SYSTEM`.
    connections : list of Connection
    connectors : dict of Connector
        By element and name.
    start, stop : float or None
        Of the default experiment [s].
    """

    sources: dict[str, Path]
    values: dict[str, dict[str, Value]]
    connections: list[Connection]
    connectors: dict[tuple[str, str], Connector]
    start: float | None
    stop: float | None


def signal_name(element: str, name: str) -> str:
    """How a variable of a component, or a connector of the system, is called."""
    return f"{element}.{name}" if element else name


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
    if not path.is_file():
        raise CouplingError(
            f"{path}: no such file; `percussion system {path.stem}` makes it in dist, if it ships"
        )
    reader = Reader(Path(folder), allowance)
    with naming(f"{path}: no SSP archive"):
        unpack_zip(path, Path(folder), allowance)
    try:
        return _read(path, reader)
    except InvalidError as error:
        raise CouplingError(f"{path}: no SSP archive: {error}") from error
    except CouplingError as error:
        raise CouplingError(f"{path}: {error}") from error


def _read(path: Path, reader: Reader) -> Archive:
    root = reader.structure(STRUCTURE)
    (system,) = elements(root, "ssd:System")
    components = _components(system)
    units = units_of(root, "ssd:Units/ssc:Unit")
    named = {SYSTEM: system} | components
    return Archive(
        {name: _source_of(node, reader, path) for name, node in components.items()},
        {name: _values_of(name, node, reader, units) for name, node in named.items()},
        [_connection(one) for one in elements(system, "ssd:Connections/ssd:Connection")],
        _connectors(named, units),
        _time_of(root, "startTime"),
        _time_of(root, "stopTime"),
    )


def _components(system: Any) -> dict[str, Any]:
    """Elements of the components by name; other elements, and other components, are refused."""
    found: dict[str, Any] = {}
    for node in elements(system, "ssd:Elements/*"):
        name = node.get("name")
        if not (name.isprintable() and len(name) <= LONGEST_NAME):
            raise CouplingError(
                f"component {shortened(name)!r}: must have 1 to {LONGEST_NAME} characters that "
                "can be printed"
            )
        if word_of(node) != "Component":
            raise CouplingError(
                f"{word_of(node)} {shortened(name)}: a system within the system, or a reference "
                "to signals, is not computed: connect its components directly"
            )
        if name in found:
            raise CouplingError(f"has two components {name}")
        for key, allowed in (("type", (FMU,)), ("implementation", ("any", "CoSimulation"))):
            if node.get(key, allowed[0]) not in allowed:
                raise CouplingError(
                    f"component {name}: {key} = {shortened(node.get(key))}: must be "
                    f"{' or '.join(allowed)}"
                )
        found[name] = node
    if not 0 < len(found) <= MOST_PARTS:
        raise CouplingError(f"has {len(found)} components, not 1 to {MOST_PARTS}")
    return found


def _source_of(component: Any, reader: Reader, path: Path) -> Path:
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
            f"component {component.get('name')}: source = {shortened(source)!r}: must be an FMU "
            f"within the archive{trust}, no folder and no link"
        )
    return found


def _values_of(name: str, node: Any, reader: Reader, units: dict[str, Unit]) -> dict[str, Value]:
    with naming(f"component {name}" if name else "system"):
        return bound_values(node, reader, units)


def _connectors(named: dict[str, Any], units: dict[str, Unit]) -> dict[tuple[str, str], Connector]:
    """Connectors of all components, and of the system."""
    found: dict[tuple[str, str], Connector] = {}
    for element, node in named.items():
        for one in elements(node, "ssd:Connectors/ssd:Connector"):
            key = element, one.get("name")
            if key in found:
                raise CouplingError(f"connector {shortened(signal_name(*key))}: stands there twice")
            types = elements(one, "ssc:*")  # geometry and annotations are of another space
            name = word_of(types[0]) if types else None
            unit = unit_named(types[0].get("unit"), units) if types else None
            found[key] = Connector(one.get("kind"), name, unit)
    return found


def _connection(node: Any) -> Connection:
    ends = tuple(
        (node.get(f"{end}Element", SYSTEM), node.get(f"{end}Connector")) for end in ("start", "end")
    )
    found = Connection(ends, None, is_true(node.get("suppressUnitConversion")))  # type: ignore[arg-type]
    with naming(found):
        return found._replace(transformation=transformation_of(node))


def _time_of(root: Any, key: str) -> float | None:
    """Start or stop of the default experiment [s], None where it does not say."""
    for one in elements(root, "ssd:DefaultExperiment"):
        if key in one.attrib:
            time = float(one.get(key))
            if not math.isfinite(time):
                raise CouplingError(f"DefaultExperiment: {key} = {time}: must be finite")
            return time
    return None
