"""modelDescription.xml of FMI 2.0, for FMUs that run Python and for those that need none."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any, NamedTuple
from uuid import UUID
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from fmu_src.flat_names import flatten
from fmu_src.units import write_units
from fmu_src.variables import Variable

CAPABILITIES = {
    "canHandleVariableCommunicationStepSize": "true",
    "canInterpolateInputs": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
}
_OF_STATES = "canGetAndSetFMUstate", "canSerializeFMUstate"
_INITIAL = {"parameter": "exact", "output": "calculated"}


@dataclass(frozen=True)
class About:
    """What the head of a model description says; times in s.

    `flat` names have no dots; without `saves` an instance cannot save its state.
    """

    model: str
    description: str
    stop_time: float
    step_size: float
    version: str = version("percussion_model")
    author: str = "percussion_model developers"
    license: str = "BSD-3-Clause"
    flat: bool = False
    saves: bool = True


class Shell(NamedTuple):
    """What hosts load of an FMU: tool that made it, whether it needs Python, what it logs."""

    tool: str
    needs_python: bool
    log_categories: Mapping[str, str]


# What a native FMU sends; hosts choose by these names.
_LOGGED = {
    "logStatusWarning": "Warnings: where the motion leaves the model, inputs without effect.",
    "logStatusError": "Errors: why a call was refused.",
}
NATIVE = Shell(f"percussion_model {version('percussion_model')}", False, _LOGGED)
# pythonfmu would take "logAll" for one of its own categories, and be silent.
PYTHON = Shell(
    f"PythonFMU {version('pythonfmu')}",
    True,
    {"logEvents": "Events: kernels that are compiled."} | _LOGGED,
)


def write_description(
    about: About, variables: Sequence[Variable], contents: bytes, shell: Shell = PYTHON
) -> tuple[str, bytes]:
    """Return GUID and text of a model description.

    Parameters
    ----------
    contents : bytes
        Hash of what else is in the FMU, for the GUID.
    """
    return sign(_to_xml(about, variables, shell), "guid", contents)


def _to_xml(about: About, variables: Sequence[Variable], shell: Shell) -> Element:
    """Model description whose GUID is still empty."""
    head = {
        "fmiVersion": "2.0",
        "modelName": about.model,
        "guid": "",
        "generationTool": shell.tool,
        "variableNamingConvention": "structured",
        "description": about.description,
        "author": about.author,
        "license": about.license,
        "version": about.version,
    }
    root = Element("fmiModelDescription", head)
    needs = {"needsExecutionTool": str(shell.needs_python).lower()}
    model = {"modelIdentifier": about.model, "canNotUseMemoryManagementFunctions": "true"}
    able = CAPABILITIES if about.saves else CAPABILITIES | dict.fromkeys(_OF_STATES, "false")
    SubElement(root, "CoSimulation", needs | able | model)
    root.append(write_units({variable.unit for variable in variables if variable.unit}))
    if any(variable.enumeration for variable in variables):
        root.append(_type_definitions(variables))
    add_log_categories(root, shell)
    SubElement(root, "DefaultExperiment", experiment(about))
    nodes = SubElement(root, "ModelVariables")
    for variable in variables:
        nodes.append(_variable(variable))
    root.append(_structure(variables))
    if about.flat:
        flatten(root)
    return root


def add_log_categories(root: Element, shell: Shell) -> None:
    """Tell what the FMU logs."""
    categories = SubElement(root, "LogCategories")
    for name, text in shell.log_categories.items():
        SubElement(categories, "Category", {"name": name, "description": text})


def experiment(about: About) -> dict[str, str]:
    """Attributes of the default experiment."""
    times = {"startTime": 0.0, "stopTime": about.stop_time, "stepSize": about.step_size}
    return {name: repr(float(time)) for name, time in times.items()}


def _variable(variable: Variable) -> Element:
    attributes = {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "description": variable.description,
        "causality": variable.causality,
        "variability": variable.variability,
        "initial": _INITIAL.get(variable.causality),
    }
    node = Element("ScalarVariable", {name: text for name, text in attributes.items() if text})
    said: dict[str, Any] = {
        "declaredType": variable.enumeration,
        "unit": variable.unit,
        "displayUnit": variable.display,
        "min": variable.lower,
        "max": variable.upper,
        "nominal": variable.nominal,
        "start": variable.start,
    }
    texts = {
        name: value if isinstance(value, str) else to_text(value, variable.type)
        for name, value in said.items()
        if value is not None
    }
    SubElement(node, variable.type, texts)
    return node


def to_text(value: Any, kind: str) -> str:
    """Write a value as XML schema wants it; floats with all their digits."""
    if isinstance(value, bool):
        return str(value).lower()
    if kind == "Real":
        return repr(float(value))
    return str(value)


def _type_definitions(variables: Sequence[Variable]) -> Element:
    root = Element("TypeDefinitions")
    for variable in enumerations(variables):
        simple = SubElement(root, "SimpleType", {"name": str(variable.enumeration)})
        write_items(SubElement(simple, "Enumeration"), variable)
    return root


def enumerations(variables: Sequence[Variable]) -> list[Variable]:
    """The first variable of each enumeration."""
    found: dict[str, Variable] = {}
    for variable in variables:
        if variable.enumeration is not None:
            found.setdefault(variable.enumeration, variable)
    return list(found.values())


def write_items(node: Element, variable: Variable) -> None:
    """Write the items of a variable's enumeration."""
    for name, value, text in variable.items:
        item = SubElement(node, "Item", {"name": name, "value": str(value)})
        if text:
            item.set("description", text)


def _structure(variables: Sequence[Variable]) -> Element:
    """No output depends on an input at once; at the start some do, and on parameters."""
    root = Element("ModelStructure")
    outputs, unknowns = SubElement(root, "Outputs"), SubElement(root, "InitialUnknowns")
    for index, variable in enumerate(variables, start=1):
        if variable.causality != "output":
            continue
        known = [
            str(at) for at, one in enumerate(variables, start=1) if depends_at_start(variable, one)
        ]
        SubElement(outputs, "Unknown", {"index": str(index), "dependencies": ""})
        SubElement(unknowns, "Unknown", {"index": str(index), "dependencies": " ".join(known)})
    return root


def depends_at_start(output: Variable, known: Variable) -> bool:
    """Whether an output at the start depends on a parameter or an input."""
    if output.at_start is None:
        return False
    return known.causality == "parameter" or known.name in output.at_start


def sign(root: Element, attribute: str, contents: bytes) -> tuple[str, bytes]:
    """Give a model description its GUID; return that and the text.

    Parameters
    ----------
    attribute : str
        Where the GUID stands; it is a hash of the rest and of `contents`.
    """
    guid = str(UUID(bytes=hashlib.sha256(tostring(root) + contents).digest()[:16]))
    root.set(attribute, f"{{{guid}}}")
    return guid, to_bytes(root)


def to_bytes(root: Element) -> bytes:
    """Text of an XML file."""
    indent(root, space="  ")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, "utf-8") + b"\n"
