"""Unpacked SSP archive: components, connections and parameter values of a system."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from fmpy import extract, read_model_description
from fmpy.ssp.ssd import find_components, read_ssd

from percussion_model.coupling.component import CouplingError


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


def unpack(path: Path, folder: str) -> Archive:
    """Read an archive and unpack it into a folder."""
    if not path.is_file():
        raise CouplingError(
            f"{path}: no such file; `python3 build.py system` makes the archives of dist"
        )
    try:
        system = read_ssd(str(path)).system
    except KeyError:
        raise CouplingError(f"{path}: no SSP archive: it holds no SystemStructure.ssd") from None
    except Exception as error:
        raise CouplingError(f"{path}: no SSP archive: {error}") from error
    extract(str(path), folder)
    components = find_components(system)
    links: dict[str, list[Link]] = {one.name: [] for one in components}
    for one in system.connections:
        links[one.endElement].append(Link(one.endConnector, one.startElement, one.startConnector))
    return Archive(
        {one.name: Path(folder) / one.source for one in components},
        {one.name: _bound(one) for one in components},
        links,
    )


def _bound(component: Any) -> dict[str, Any]:
    """Values that the archive binds to a component."""
    found = {}
    for binding in component.parameterBindings:
        for values in binding.parameterValues:
            for one in values.parameters:
                is_flag = one.type == "Boolean"
                found[one.name] = one.value in ("true", "1") if is_flag else float(one.value)
    return found


def input_starts(fmu: Path, values: Mapping[str, Any]) -> dict[str, Any]:
    """Start values of an FMU's inputs, after what the archive sets.

    Parameters
    ----------
    values : mapping
        Of the archive, by variable.
    """
    kinds: dict[str, Callable[[str], Any]] = {
        "Real": float, "Boolean": lambda text: text in ("true", "1")
    }  # fmt: skip
    found = {}
    for one in read_model_description(str(fmu), validate=False).modelVariables:
        if one.causality == "input":
            found[one.name] = values.get(one.name, kinds.get(one.type, int)(one.start))
    return found
