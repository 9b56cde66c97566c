"""Writes a system as an SSP 1.0 archive: FMUs, their connections, their parameters."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, register_namespace, tostring

from fmpy import read_model_description

from fmu_src.archive import write_archive
from fmu_src.flat_names import flat_name, wide_name
from fmu_src.hammer.build import build_hammer, hammer_name, refuse_other
from fmu_src.native.build import build_native, native_files
from fmu_src.native.library import libraries
from fmu_src.parts.build import PARTS, build_part
from fmu_src.slave.native import this_platform
from fmu_src.units import UNITS, fmi_unit
from percussion_model.coupling.component import CouplingError, number_of_word
from percussion_model.coupling.ssp import FMU
from percussion_model.coupling.ssp_xml import SPACES, tag
from percussion_model.scene.presets import scenario_folder, scene_file, system_file
from percussion_model.scene.retired import remark
from percussion_model.scene.rows import said_among, shortened, show_value, unprintable
from percussion_model.scene.scene import Scene
from percussion_model.scene.text import read_toml
from percussion_model.solvers.base import added_solvers

SYSTEMS = scenario_folder() / "systems"
HAMMER, CONTROLLER = "PercussiveHammer", "DrillController"
# What names of files with flat names of variables have more.
FLAT = "Flat"
# Masters find the parameters of all components under one name.
PARAMETER_SET = "initialValues"

# What a system's file must have.
_KINDS: dict[str, Any] = {
    "name": str, "description": str, "hammer": str, "duration": (int, float), "step": (int, float)
}  # fmt: skip
_SAID = {str: "text", (int, float): "a number"}
_TABLES = {"components": str, "connections": str, "parameters": dict}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,99}")
MOST_BASES = 5

_OMS = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"
_TYPES = {"Real": "Real", "Integer": "Integer", "Boolean": "Boolean", "Enumeration": "Integer"}


class SystemPlanError(ValueError):
    """A system that contradicts its FMUs; names the connection or the parameter."""


@dataclass(frozen=True)
class SystemPlan:
    """A system as its file says.

    Attributes
    ----------
    components : dict of str
        Name of the FMU by name of the component.
    connections : dict of str
        Output by input, each `component.variable`.
    parameters : dict of dict
        Values of parameters and inputs by component.
    """

    name: str
    description: str
    hammer: Path
    duration: float
    step: float
    components: dict[str, str]
    connections: dict[str, str]
    parameters: dict[str, dict[str, Any]]


def read_plan(path: Path, **changes: Any) -> SystemPlan:
    """Read a system's file; one with `base` changes that of another file.

    Parameters
    ----------
    changes : dict
        Entries that replace those of the file, as `name` or `hammer`: the file of a scene, from
        the folder of the system's file or from the present one, or a preset.
    """
    try:
        found = _merged(path) | changes
    except (TypeError, AttributeError):
        raise SystemPlanError(f"{path}: a table stands where its base has a value") from None
    _check_entries(path, found)
    found["hammer"] = _beside(path, found["hammer"]) or scene_file(Path(found["hammer"]))
    found |= {key: float(found[key]) for key in ("duration", "step")}
    return SystemPlan(**{one.name: found[one.name] for one in fields(SystemPlan)})


def _check_entries(path: Path, found: dict[str, Any]) -> None:
    """Raise `SystemPlanError` for what is missing or of another kind, and for bad names."""
    lacking = [key for key in (*_KINDS, *_TABLES) if key not in found]
    if lacking:
        raise SystemPlanError(f"{path}: {', '.join(lacking)} missing")
    known = (*_KINDS, *_TABLES, "fidelity")
    for key in found:
        if key not in known:
            raise SystemPlanError(f"{path}: unknown key {shortened(key)}: {said_among(key, known)}")
    for key, kind in _KINDS.items():
        if not isinstance(found[key], kind) or isinstance(found[key], bool):
            shown = show_value(found[key])
            raise SystemPlanError(f"{path}: {key} = {shown}: must be {_SAID[kind]}")
    for key, kind in _TABLES.items():
        table = found[key]
        if not isinstance(table, dict) or not all(isinstance(v, kind) for v in table.values()):
            what = "of texts" if kind is str else "of tables"
            raise SystemPlanError(f"{path}: {key} = {show_value(table)}: must be a table {what}")
    for name in (found["name"], *found["components"]):
        if not _NAME.fullmatch(name):  # files are named by the system
            raise SystemPlanError(
                f"{path}: {show_value(name)}: a name must begin with a letter and go on with "
                "letters, digits and underlines, 100 in all"
            )
    if (word := found.get("fidelity", "wave")) != "wave":
        said = f'{path}: fidelity = {show_value(word)}: must be "wave", or be omitted'
        raise SystemPlanError(said + remark("solver.fidelity"))
    if unprintable(found["description"]):
        raise SystemPlanError(f"{path}: description has a control character")


def _merged(path: Path, left: int = MOST_BASES) -> dict[str, Any]:
    found = read_toml(path)
    base = found.pop("base", None)
    if base is None:
        return found
    if not isinstance(base, str) or not left:
        raise SystemPlanError(
            f"{path}: base = {show_value(base)}: must name a file that has a base of its own at "
            f"most {MOST_BASES} times"
        )
    below = _merged(_beside(path, base) or system_file(Path(base)), left - 1)
    for key, value in found.items():
        if key == "parameters" and isinstance(value, dict):
            both = {**below.get(key, {})}
            for name, values in value.items():
                both[name] = {**both.get(name, {}), **values}
            below[key] = both
        elif isinstance(value, dict):
            below[key] = {**below.get(key, {}), **value}
        else:
            below[key] = value
    return below


def _beside(path: Path, name: str) -> Path | None:
    """File that a system's file names, where it is in its folder."""
    file = path.parent / name
    return file if file.is_file() else None


def with_flat_names(plan: SystemPlan, fmus: dict[str, Path]) -> SystemPlan:
    """The system with the names of variables that FMUs with flat names have; its own says so."""
    known = {name: _variables(fmu) for name, fmu in fmus.items()}

    def flat(signal: str) -> str:
        component, variable = split(signal)
        wide = wide_name(variable)
        return f"{component}.{wide if wide in known[component] else flat_name(variable)}"

    return replace(
        plan,
        name=f"{plan.name}{FLAT}",
        connections={flat(sink): flat(source) for sink, source in plan.connections.items()},
        parameters={
            component: {split(flat(f"{component}.{name}"))[1]: values[name] for name in values}
            for component, values in plan.parameters.items()
        },
    )


def _variables(fmu: Path) -> dict[str, Any]:
    return {one.name: one for one in read_model_description(str(fmu)).modelVariables}


def build_fmus(
    plan: SystemPlan,
    folder: Path,
    force: bool = False,
    flat: bool = False,
    platforms: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, Path]:
    """Write the FMUs of a system into a folder; return their paths by component.

    They need no Python, but for a hammer with a solver that was added.

    Parameters
    ----------
    force : bool
        Replace the FMU of another hammer.
    flat : bool
        Whether names of variables have no dots; names of the files say so.
    platforms : dict of str, optional
        As `native.library.platform_names` gives them; this one if left out.

    Raises
    ------
    NoCompilerError
        If a library has to be made, and cannot be.
    """
    found = {}
    ending = f"{FLAT if flat else ''}.fmu"
    for component, name in plan.components.items():
        path = folder / f"{name}{ending}"
        if name in PARTS:
            build_part(PARTS[name], path, flat, platforms=platforms)
        elif name == HAMMER:
            path = _build_hammer(plan.hammer, folder, force, flat, platforms)
        else:
            known = ", ".join([HAMMER, *PARTS])
            raise SystemPlanError(f"{component} = {name!r}: must be one of {known}")
        found[component] = path
    return found


def _build_hammer(
    file: Path, folder: Path, force: bool, flat: bool, platforms: Mapping[str, str]
) -> Path:
    """Write the FMU of a scene; return its path, which says whether it is native."""
    scene, is_native = Scene.from_toml(file), not added_solvers()
    path = native_files(file, folder)["2.0"] if is_native else folder / hammer_name(file)
    stem, dash, rest = path.name.removesuffix(".fmu").partition("-")
    path = path.with_name(f"{stem}{FLAT if flat else ''}{dash}{rest}.fmu")
    refuse_other(path, scene, force)  # one of another scene has another name
    if is_native:
        build_native(scene, path, "2.0", libraries(platforms or [this_platform()]), flat)
    else:
        build_hammer(scene, path, flat=flat)
    return path


def write_system(plan: SystemPlan, fmus: dict[str, Path], path: Path) -> Path:
    """Write the archive; the same inputs give the same bytes."""
    variables = {component: _variables(fmu) for component, fmu in fmus.items()}
    _check(plan, variables)
    entries = {"SystemStructure.ssd": _structure(plan, fmus, variables)}
    for component, values in plan.parameters.items():
        entries[f"resources/{component}.ssv"] = _values(values, variables[component])
    for fmu in sorted(set(fmus.values())):
        entries[f"resources/{fmu.name}"] = fmu.read_bytes()
    write_archive(path, entries)
    return path


def write_with_controller(
    plan: SystemPlan, controller: Path, folder: Path, path: Path
) -> dict[str, Any]:
    """Write the archive of a system with another FMU in the place of its controller.

    Parameters
    ----------
    folder : Path
        For the other FMUs.

    Returns
    -------
    dict
        Values of the system's file that the controller has no variable for, left out.
    """
    mine = next((one for one, name in plan.components.items() if name == CONTROLLER), None)
    if mine is None:
        raise SystemPlanError(f"{plan.name} has no {CONTROLLER} in whose place one could be put")
    others = {one: name for one, name in plan.components.items() if one != mine}
    fmus = build_fmus(replace(plan, components=others), folder)
    fmus = {one: controller if one == mine else fmus[one] for one in plan.components}
    names = _variables(controller)
    given = plan.parameters.get(mine, {})
    kept = {name: value for name, value in given.items() if name in names}
    write_system(replace(plan, parameters=plan.parameters | {mine: kept}), fmus, path)
    return {name: value for name, value in given.items() if name not in names}


def split(signal: str) -> tuple[str, str]:
    """Component and variable of `component.variable`."""
    component, _, variable = signal.partition(".")
    return component, variable


def _check(plan: SystemPlan, variables: dict[str, dict[str, Any]]) -> None:
    for sink, source in plan.connections.items():
        kinds = []
        for signal, causality in ((sink, "input"), (source, "output")):
            component, name = split(signal)
            one = variables.get(component, {}).get(name)
            if one is None or one.causality != causality:
                raise SystemPlanError(f"connection {sink} = {source}: {signal} is no {causality}")
            kinds.append((one.type, one.unit))
        if kinds[0] != kinds[1]:
            raise SystemPlanError(
                f"connection {sink} = {source}: {kinds[0]} does not fit {kinds[1]}"
            )
    for component, values in plan.parameters.items():
        for name, value in values.items():
            one = variables.get(component, {}).get(name)
            if one is None or one.causality == "output":
                raise SystemPlanError(f"parameter {component}.{name}: there is no such variable")
            if isinstance(value, str) and one.type == "Enumeration":
                try:
                    number_of_word(component, one, value)
                except CouplingError as error:
                    raise SystemPlanError(f"parameter {error}") from None
            elif not isinstance(value, (bool, int, float)):
                shown = show_value(value)
                raise SystemPlanError(f"parameter {component}.{name} = {shown}: must be a number")


def _add(parent: Element, space: str, word: str, /, **attributes: str) -> Element:
    """Add an element to another one."""
    return SubElement(parent, tag(space, word), attributes)


def _text(root: Element) -> bytes:
    for prefix, address in (SPACES | {"oms": _OMS}).items():
        register_namespace(prefix, address)
    indent(root, space="  ")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, "utf-8") + b"\n"


def _structure(
    plan: SystemPlan, fmus: dict[str, Path], variables: dict[str, dict[str, Any]]
) -> bytes:
    root = Element(
        tag("ssd", "SystemStructureDescription"),
        {"version": "1.0", "name": plan.name, "description": plan.description},
    )
    system = _add(root, "ssd", "System", name=plan.name)
    elements = _add(system, "ssd", "Elements")
    used = [*plan.connections, *plan.connections.values()]
    units: set[str] = set()
    for component, fmu in fmus.items():
        file = f"resources/{fmu.name}"
        node = _add(elements, "ssd", "Component", name=component, type=FMU, source=file)
        connectors = _add(node, "ssd", "Connectors")
        for name, one in variables[component].items():
            if f"{component}.{name}" not in used:
                continue
            connector = _add(connectors, "ssd", "Connector", name=name, kind=one.causality)
            unit = {"unit": one.unit} if one.type == "Real" else {}
            _add(connector, "ssc", _TYPES[one.type], **unit)
            units.update(unit.values())
        if component in plan.parameters:
            bindings = _add(node, "ssd", "ParameterBindings")
            _add(bindings, "ssd", "ParameterBinding", source=f"resources/{component}.ssv")
    connections = _add(system, "ssd", "Connections")
    for sink, source in plan.connections.items():
        (a, x), (b, y) = split(source), split(sink)
        ends = {"startElement": a, "startConnector": x, "endElement": b, "endConnector": y}
        _add(connections, "ssd", "Connection", **ends)
    _annotate(system, plan.step)
    _units(root, units)
    _add(root, "ssd", "DefaultExperiment", startTime="0.0", stopTime=repr(plan.duration))
    return _text(root)


def _annotate(system: Element, step: float) -> None:
    """The step size, in the place where OMSimulator looks for it; others pass it over."""
    annotations = _add(system, "ssd", "Annotations")
    one = _add(annotations, "ssc", "Annotation", type="org.openmodelica")
    inner = SubElement(
        SubElement(one, f"{{{_OMS}}}Annotations"), f"{{{_OMS}}}SimulationInformation"
    )
    SubElement(
        inner, f"{{{_OMS}}}FixedStepMaster",
        {"description": "oms-ma", "stepSize": repr(step), "absoluteTolerance": "0.000100",
         "relativeTolerance": "0.000100"},
    )  # fmt: skip


def _units(root: Element, names: set[str]) -> None:
    node = _add(root, "ssd", "Units")
    for name in sorted(names):
        base = {key: str(power) for key, power in UNITS[fmi_unit(name)].base.items()}
        _add(_add(node, "ssc", "Unit", name=name), "ssc", "BaseUnit", **base)


_WRITTEN: dict[str, Callable[[Any], str]] = {
    "Real": lambda value: repr(float(value)),
    "Integer": lambda value: str(int(value)),
    "Boolean": lambda value: str(bool(value)).lower(),
}


def _values(values: dict[str, Any], variables: dict[str, Any]) -> bytes:
    root = Element(tag("ssv", "ParameterSet"), {"version": "1.0", "name": PARAMETER_SET})
    parameters = _add(root, "ssv", "Parameters")
    for name, value in values.items():
        kind = _TYPES[variables[name].type]
        if isinstance(value, str):
            value = number_of_word("", variables[name], value)
        parameter = _add(parameters, "ssv", "Parameter", name=name)
        _add(parameter, "ssv", kind, value=_WRITTEN[kind](value))
    return _text(root)


def find_plan(named: Path) -> SystemPlan:
    """Return the system that a user names: a file, or else one that ships, by its name."""
    if named.suffix or named.name != str(named) or named.exists():
        return read_plan(named)
    found = {plan.name: plan for plan in plans()}
    if named.name not in found:
        raise SystemPlanError(
            f"{shortened(str(named))}: there is no such file of a system, and no preset of that "
            f"name: {said_among(named.name, found)}"
            f"{remark('', 'blow-map') if named.name.endswith('Map') else ''}"
        )
    return found[named.name]


def plans() -> list[SystemPlan]:
    """All systems of `scenarios/systems`, each with both hammers of docs/data/fidelity.md."""
    found = []
    for path in sorted(SYSTEMS.glob("*.toml")):
        plan = read_plan(path)
        found.append(plan)
        found.append(read_plan(path, name=f"{plan.name}Rigid", hammer="rigid"))
    return found
