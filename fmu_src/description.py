"""modelDescription.xml: what pythonfmu writes, and all that it leaves out."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any, ClassVar
from uuid import UUID
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from pythonfmu import Boolean, DefaultExperiment, Fmi2Causality, Fmi2Slave, Integer, Real
from pythonfmu.enums import Fmi2Initial, Fmi2Variability

from fmu_src.flat_names import flatten
from fmu_src.units import write_units
from fmu_src.variables import Variable

OPTIONS = {
    "needsExecutionTool": "true",  # a Python
    "canHandleVariableCommunicationStepSize": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
}


@dataclass(frozen=True)
class About:
    """What the head of a model description says; times in s. `flat` names have no dots."""

    model: str
    description: str
    stop_time: float
    step_size: float
    version: str = version("percussion_model")
    author: str = "percussion_model developers"
    license: str = "BSD-3-Clause"
    flat: bool = False


class Described(Fmi2Slave):  # type: ignore[misc]
    """A slave that only describes itself.

    Parameters
    ----------
    about : About
    variables : sequence of Variable
    """

    # What the slaves send; pythonfmu would take "logAll" for one of its own, and be silent.
    log_categories: ClassVar[dict[str, str]] = {
        "logEvents": "Events: kernels that are compiled.",
        "logStatusWarning": "Warnings: where the motion leaves the model, inputs without effect.",
        "logStatusError": "Errors: why a call was refused.",
    }

    def __init__(self, about: About, variables: Sequence[Variable]) -> None:
        super().__init__(instance_name="described")
        self.about = about
        self.variables = variables
        self.modelName = about.model
        self.description, self.author = about.description, about.author
        self.version, self.license = about.version, about.license
        self.default_experiment = DefaultExperiment(0.0, about.stop_time, about.step_size)
        for variable in variables:
            found = _PYTHONFMU[variable.type](
                variable.name,
                causality=Fmi2Causality[variable.causality],
                variability=Fmi2Variability[variable.variability],
                initial=None if variable.causality == "input" else _INITIAL[variable.causality],
                description=variable.description,
                getter=lambda value=variable.start: value,
            )
            found.value_reference = variable.reference
            self.vars[variable.reference] = found

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Never called: this class is not what runs."""
        raise NotImplementedError

    def to_xml(self, model_options: Any = OPTIONS) -> Element:
        """Model description; its GUID is a hash of the rest."""
        root = super().to_xml(model_options)
        del root.attrib["generationDateAndTime"]  # the same inputs give the same bytes
        root.set("guid", "")
        by_name = {variable.name: variable for variable in self.variables}
        nodes = root.find("ModelVariables")
        assert nodes is not None
        for node in nodes:
            _complete(node, by_name[node.attrib["name"]])
        at = list(root).index(root.find("CoSimulation")) + 1
        used = {variable.unit for variable in self.variables if variable.unit}
        root.insert(at, write_units(used))
        if any(variable.enumeration for variable in self.variables):
            root.insert(at + 1, _type_definitions(self.variables))
        _complete_structure(root, self.variables)
        if self.about.flat:
            flatten(root)
        return root


_PYTHONFMU = {"Real": Real, "Integer": Integer, "Boolean": Boolean, "Enumeration": Integer}
_INITIAL = {"parameter": Fmi2Initial.exact, "output": Fmi2Initial.calculated}


def _complete(node: Element, variable: Variable) -> None:
    """Give a variable its unit, bounds, nominal and full digits."""
    inner = node[0]
    inner.tag = variable.type
    attributes: dict[str, Any] = {
        "declaredType": variable.enumeration,
        "unit": variable.unit,
        "displayUnit": variable.display,
        "min": variable.lower,
        "max": variable.upper,
        "nominal": variable.nominal,
        "start": variable.start,
    }
    inner.attrib.clear()
    for name, value in attributes.items():
        if value is not None:
            inner.set(name, value if isinstance(value, str) else to_text(value, variable.type))


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


def _complete_structure(root: Element, variables: Sequence[Variable]) -> None:
    """No output depends on an input at once; at the start some do, and on parameters."""
    structure = root.find("ModelStructure")
    assert structure is not None
    for unknown in structure.iter("Unknown"):
        unknown.set("dependencies", "")
    unknowns = SubElement(structure, "InitialUnknowns")
    for index, variable in enumerate(variables, start=1):
        if variable.causality != "output":
            continue
        known = [
            str(at) for at, one in enumerate(variables, start=1) if depends_at_start(variable, one)
        ]
        SubElement(unknowns, "Unknown", {"index": str(index), "dependencies": " ".join(known)})


def depends_at_start(output: Variable, known: Variable) -> bool:
    """Whether an output at the start depends on a parameter or an input."""
    if output.at_start is None:
        return False
    return known.causality == "parameter" or known.name in output.at_start


def write_description(
    about: About,
    variables: Sequence[Variable],
    contents: bytes,
    described: type[Described] = Described,
) -> tuple[str, bytes]:
    """Return GUID and text of a model description.

    Parameters
    ----------
    contents : bytes
        Hash of what else is in the FMU, for the GUID.
    described : type
        What writes all but the GUID.
    """
    return sign(described(about, variables).to_xml(), "guid", contents)


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
