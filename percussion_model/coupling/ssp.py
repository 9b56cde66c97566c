"""Unpacked SSP archive: components, connections and parameter values of a system."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from fmpy.ssp.ssd import find_components, read_ssd

from percussion_model.coupling.component import CouplingError, read_description
from percussion_model.coupling.unpack import LONGEST_NAME, Allowance, check_xml, unpack_zip
from percussion_model.scene.rows import shortened

STRUCTURE = "SystemStructure.ssd"
# Of components, and of files with their values.
MOST_PARTS = 100


class Link(NamedTuple):
    """A connection to an input of a component."""

    input: str
    source: str  # component
    output: str  # of that component


@dataclass(frozen=True)
class Archive:
    """An unpacked archive.

    Attributes
    ----------
    sources : dict of Path
        FMU by component, in the order of the archive.
    values : dict of dict
        What the archive sets, by component.
    links : dict of list
        Inputs of each component.
    """

    sources: dict[str, Path]
    values: dict[str, dict[str, Any]]
    links: dict[str, list[Link]]


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
    try:
        unpack_zip(path, Path(folder), allowance)
        _check_files(path.name, Path(folder), allowance)
        system = read_ssd(str(path)).system
        components = find_components(system)
        values = {one.name: _bound(one) for one in components}
    except CouplingError as error:
        raise CouplingError(f"{path}: no SSP archive: {error}") from error
    except Exception as error:  # fmpy has no errors of its own
        text = shortened(" ".join(str(error).split()))
        raise CouplingError(f"{path}: no SSP archive: {text}") from error
    _check_names(path, [one.name for one in components])
    sources = {
        one.name: _source_of(one, path, Path(folder), allowance.trusted) for one in components
    }
    return Archive(sources, values, _links(path, list(sources), system.connections))


def _check_files(name: str, folder: Path, allowance: Allowance) -> None:
    """Check the structure and all that fmpy reads with it, before it does."""
    others = check_xml(folder / STRUCTURE, STRUCTURE, allowance)
    if len(others) > MOST_PARTS:
        raise CouplingError(f"{name}: names more than {MOST_PARTS} files of values")
    for source in others:
        place = _within(folder, source)
        if place is None:
            raise CouplingError(f"{shortened(source)}: is no file within the archive")
        check_xml(place, shortened(source), allowance)


def _within(folder: Path, source: str) -> Path | None:
    """File within a folder that a source names, None if it is none."""
    try:
        place = folder / source
        inside = place.resolve().is_relative_to(folder.resolve())
        return place if inside and place.is_file() and not place.is_symlink() else None
    except (OSError, ValueError):  # a name that no file can have
        return None


def _check_names(path: Path, names: list[str]) -> None:
    if not 0 < len(names) <= MOST_PARTS:
        raise CouplingError(f"{path}: has {len(names)} components, not 1 to {MOST_PARTS}")
    for name in names:
        if not (name.isprintable() and 0 < len(name) <= LONGEST_NAME):
            raise CouplingError(
                f"{path}: component {shortened(name)!r}: must have 1 to {LONGEST_NAME} characters "
                "that can be printed"
            )
        if names.count(name) > 1:
            raise CouplingError(f"{path}: has two components {name}")


def _source_of(component: Any, path: Path, folder: Path, trusted: bool) -> Path:
    """File of a component's FMU; outside of the archive only where that is trusted."""
    source = component.source or ""
    found = _within(folder, source)
    if found is None and trusted:
        try:
            found = (path.parent / source).resolve()
            found = found if found.is_file() else None
        except (OSError, ValueError):
            found = None
    if found is None:
        trust = "" if trusted else " (--trust allows others)"
        raise CouplingError(
            f"{path}: component {component.name}: source = {shortened(source)!r}: must be an FMU "
            f"within the archive{trust}, no folder and no link"
        )
    return found


def _links(path: Path, names: list[str], connections: list[Any]) -> dict[str, list[Link]]:
    """Connections by component; those to a component that is not there are refused."""
    found: dict[str, list[Link]] = {name: [] for name in names}
    for one in connections:
        where = f"{one.startElement}.{one.startConnector} to {one.endElement}.{one.endConnector}"
        for name in (one.startElement, one.endElement):
            if name not in found:
                raise CouplingError(
                    f"{path}: connection of {shortened(where)}: there is no component "
                    f"{shortened(str(name))}, only {shortened(', '.join(names))}"
                )
        link = Link(one.endConnector, one.startElement, one.startConnector)
        if link.input in [other.input for other in found[one.endElement]]:
            raise CouplingError(
                f"{path}: {shortened(f'{one.endElement}.{link.input}')} has two connections"
            )
        found[one.endElement].append(link)
    return found


def _bound(component: Any) -> dict[str, Any]:
    """Values that the archive binds to a component; words are for enumerations."""
    found: dict[str, Any] = {}
    for binding in component.parameterBindings:
        for values in binding.parameterValues:
            for one in values.parameters:
                if one.type == "Boolean":
                    found[one.name] = one.value in ("true", "1")
                else:
                    is_word = one.type in ("Enumeration", "String")
                    found[one.name] = one.value if is_word else float(one.value)
    return found


def input_starts(name: str, folder: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Start values of an FMU's inputs, after what the archive sets.

    Parameters
    ----------
    name, folder : str
        Of the component, and of its unpacked FMU.
    values : mapping
        Of the archive, by variable.
    """
    kinds: dict[str, Callable[[str], Any]] = {
        "Real": float, "Boolean": lambda text: text in ("true", "1")
    }  # fmt: skip
    found = {}
    for one in read_description(name, folder).modelVariables:
        if one.causality == "input":
            try:
                found[one.name] = values.get(one.name, kinds.get(one.type, int)(one.start))
            except (TypeError, ValueError):
                raise CouplingError(f"{name}: {one.name} has no start value") from None
    return found
