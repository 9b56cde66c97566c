"""modelDescription.xml of the FMI 3.0 FMU, for co-simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from fmu_src.description import (
    NATIVE,
    About,
    add_log_categories,
    depends_at_start,
    enumerations,
    experiment,
    sign,
    to_text,
    write_items,
)
from fmu_src.flat_names import flatten
from fmu_src.native.variables3 import Variable3
from fmu_src.units import write_units
from fmu_src.variables import Variable

FMI_VERSION = "3.0"
TIME_UNIT = "s"
# What is left out here is false, 0 or not there.
CAPABILITIES = {
    "needsExecutionTool": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesPerElementDependencies": "true",  # those of ModelStructure, at run time as well
    "canHandleVariableCommunicationStepSize": "true",
    "providesIntermediateUpdate": "true",  # at the end of each blow
    "canReturnEarlyAfterIntermediateUpdate": "true",
    "hasEventMode": "true",  # an event is the end of a blow
    "mightReturnEarlyFromDoStep": "true",  # there, to a host that uses events
}
_INITIAL = {"parameter": "exact", "output": "calculated"}


def write_description3(
    about: About,
    variables: Sequence[Variable],
    arranged: Sequence[Variable3],
    contents: bytes,
) -> tuple[str, bytes]:
    """Return instantiation token, without its braces, and text of the model description.

    Parameters
    ----------
    variables : sequence of Variable
        Those of FMI 2.0.
    arranged : sequence of Variable3
        The same as FMI 3.0 has them, and `time`.
    contents : bytes
        Hash of what else is in the FMU, for the token.
    """
    return sign(_to_xml(about, variables, arranged), "instantiationToken", contents)


def _to_xml(about: About, variables: Sequence[Variable], arranged: Sequence[Variable3]) -> Element:
    """Model description whose token is still empty."""
    root = Element("fmiModelDescription", _head(about))
    SubElement(root, "CoSimulation", {"modelIdentifier": about.model} | CAPABILITIES)
    used = {variable.unit for variable in variables if variable.unit}
    root.append(write_units(used | {TIME_UNIT}))
    if found := enumerations(variables):
        kinds = SubElement(root, "TypeDefinitions")
        for one in found:
            write_items(SubElement(kinds, "EnumerationType", {"name": str(one.enumeration)}), one)
    add_log_categories(root, NATIVE)
    SubElement(root, "DefaultExperiment", experiment(about))
    by_name = {variable.name: variable for variable in variables}
    nodes = SubElement(root, "ModelVariables")
    for entry in arranged:
        nodes.append(_variable(entry, [by_name[name] for name in entry.members]))
    root.append(_structure(by_name, arranged))
    if about.flat:
        flatten(root)
    return root


def _head(about: About) -> dict[str, str]:
    return {
        "fmiVersion": FMI_VERSION,
        "modelName": about.model,
        "instantiationToken": "",
        "description": about.description,
        "author": about.author,
        "version": about.version,
        "license": about.license,
        "generationTool": NATIVE.tool,
        "variableNamingConvention": "structured",
    }


def _variable(entry: Variable3, members: Sequence[Variable]) -> Element:
    """A variable; `time` has no members."""
    attributes: dict[str, Any] = {
        "name": entry.name,
        "valueReference": str(entry.reference),
        "causality": entry.causality,
        "variability": entry.variability,
        "initial": _INITIAL.get(entry.causality),
    }
    if members:
        attributes |= _said_of(members)
    else:
        attributes |= {"description": "time of the simulation", "unit": TIME_UNIT}
    if entry.causality == "output" and entry.variability == "continuous":
        attributes["intermediateUpdate"] = "true"
    kind: str = entry.type
    node = Element(kind, {name: text for name, text in attributes.items() if text})
    for size in entry.dimensions:
        SubElement(node, "Dimension", {"start": str(size)})
    return node


def _said_of(members: Sequence[Variable]) -> dict[str, str | None]:
    """Attributes that the members of an array share, and their start values."""
    first = members[0]
    found: dict[str, str | None] = {
        "description": first.description,
        "declaredType": first.enumeration,
        "unit": first.unit,
        "displayUnit": first.display,
    }
    bounds = {"min": first.lower, "max": first.upper, "nominal": first.nominal}
    for name, value in bounds.items():
        if value is not None:
            found[name] = to_text(value, first.type)
    if first.start is not None:
        found["start"] = " ".join(to_text(one.start, one.type) for one in members)
    return found


def _structure(by_name: Mapping[str, Variable], arranged: Sequence[Variable3]) -> Element:
    """No output depends on an input at once; at the start some do, and on parameters."""
    root = Element("ModelStructure")
    outputs = [entry for entry in arranged if entry.causality == "output"]
    for entry in outputs:
        SubElement(root, "Output", {"valueReference": str(entry.reference), "dependencies": ""})
    for entry in outputs:
        output = by_name[entry.members[0]]
        known = [
            str(one.reference)
            for one in arranged
            if one.members and depends_at_start(output, by_name[one.members[0]])
        ]
        attributes = {"valueReference": str(entry.reference), "dependencies": " ".join(known)}
        SubElement(root, "InitialUnknown", attributes)
    return root
