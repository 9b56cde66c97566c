"""Native FMUs as archives: descriptions, terminals, reference results; no library runs here."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy import read_csv, read_model_description
from fmpy.validation import validate_fmu
from lxml import etree

from fmu_src.archive import MODEL, SCENE
from fmu_src.description import NATIVE, write_description
from fmu_src.hammer.build import about_hammer
from fmu_src.hammer.variables import hammer_variables
from fmu_src.native import reference_results
from fmu_src.native.archive import add_files, library_path, write_native_fmu
from fmu_src.native.reference_results import add_reference_results, experiments
from fmu_src.native.terminals import TERMINALS
from fmu_src.native.variables3 import fmi3_variables
from percussion_model import Scene, Section

SCHEMAS = Path(fmpy.__file__).parent / "schema"
SCENARIOS = Path(__file__).parents[2] / "scenarios"
LIBRARIES = {
    name: name.encode()
    for name in ("x86_64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-linux")
}
STEPPED = [Section(length=0.1, area=0.005), Section(length=0.075, area=0.004)]
SCENES = {
    "reference": Scene(),
    "stepped": Scene().replace(**{"piston.sections": STEPPED}),
    "rods": Scene.from_toml(SCENARIOS / "top_hammer.toml"),
}


def build(path, version, scene, libraries=LIBRARIES):
    about = about_hammer(scene, Path("PercussiveHammer.fmu"))
    guid = write_native_fmu(
        path, version, about, scene, libraries, lambda guid: b"tables " + guid.encode()
    )
    return path, guid


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def version(request):
    return request.param


@pytest.fixture(scope="module", params=list(SCENES))
def scene(request):
    return SCENES[request.param]


@pytest.fixture(scope="module")
def fmu(tmp_path_factory, version, scene):
    path = tmp_path_factory.mktemp("native") / "hammer.fmu"
    return build(path, version, scene)[0]


@pytest.fixture(scope="module")
def fmu3(tmp_path_factory, scene):
    path = tmp_path_factory.mktemp("native3") / "hammer.fmu"
    return build(path, "3.0", scene)[0]


def read(path, name="modelDescription.xml"):
    with zipfile.ZipFile(path) as archive:
        return archive.read(name)


def valid(text, *schema):
    return etree.XMLSchema(etree.parse(SCHEMAS.joinpath(*schema))).validate(etree.fromstring(text))


def test_fmpy_finds_no_problem(fmu):
    assert validate_fmu(str(fmu)) == []


def test_the_schema_holds(fmu, version):
    number = f"fmi{version[0]}"
    assert valid(read(fmu), number, f"{number}ModelDescription.xsd")


def test_no_python_is_needed(fmu):
    model = read_model_description(str(fmu))
    assert model.coSimulation.needsExecutionTool is False
    assert model.coSimulation.canBeInstantiatedOnlyOncePerProcess is False
    assert model.generationTool.startswith("percussion_model ")
    assert b"ythonFMU" not in read(fmu)
    page = read(fmu, "documentation/index.html").decode()
    assert "numba" not in page
    assert "Needs nothing but the C library" in page
    assert all(platform in page for platform in LIBRARIES)
    assert all(one.name in page for one in hammer_variables(Scene()) if "[" not in one.name)


def test_variables_of_fmi2_are_those_of_the_other_fmu(scene):
    about = about_hammer(scene, Path("PercussiveHammer.fmu"))
    variables = hammer_variables(scene)
    texts = (
        write_description(about, variables, b""),
        write_description(about, variables, b"", NATIVE),
    )
    ours, theirs = (ElementTree.fromstring(text) for _, text in texts)
    for part in ("UnitDefinitions", "TypeDefinitions", "ModelVariables", "ModelStructure"):
        found = [ElementTree.tostring(root.find(part)) for root in (ours, theirs)]
        assert found[0] == found[1], part


def test_fmi3_says_of_each_variable_what_fmi2_does(fmu3, scene):
    by_name = {one.name: one for one in hammer_variables(scene)}
    nodes = {node.get("name"): node for node in etree.fromstring(read(fmu3)).find("ModelVariables")}
    arranged = fmi3_variables(hammer_variables(scene))
    assert list(nodes) == [one.name for one in arranged]
    assert sorted(name for one in arranged for name in one.members) == sorted(by_name)
    for entry in arranged[1:]:
        node, members = nodes[entry.name], [by_name[name] for name in entry.members]
        first = members[0]
        assert node.tag == entry.type
        assert node.get("causality") == first.causality
        assert node.get("variability") == first.variability
        assert node.get("unit") == first.unit
        assert node.get("declaredType") == first.enumeration
        sizes = [int(one.get("start")) for one in node.findall("Dimension")]
        assert sizes == list(entry.dimensions)
        assert len(members) == np.prod(sizes, dtype=int)
        for bound, value in (("min", first.lower), ("max", first.upper)):
            assert (node.get(bound) is None) == (value is None)
            assert value is None or float(node.get(bound)) == value
        starts = (node.get("start") or "").split()
        if first.causality == "output":
            assert starts == []
        elif first.type == "Boolean":
            assert starts == [str(first.start).lower()]
        else:
            assert [float(text) for text in starts] == [one.start for one in members]


def test_arrays_of_fmi3():
    names = {one.name: one for one in fmi3_variables(hammer_variables(SCENES["stepped"]))}
    assert names["piston.sections.area"].dimensions == (2,)
    assert names["bit.sections.area"].dimensions == (1,)
    assert names["feed_force"].dimensions == ()


def test_time_is_the_independent_variable(fmu3):
    model = read_model_description(str(fmu3))
    (time,) = [one for one in model.modelVariables if one.causality == "independent"]
    assert (time.name, time.valueReference, time.unit, time.start) == ("time", 0, "s", None)


def test_enumerations_of_fmi3(fmu3):
    for one in read_model_description(str(fmu3)).modelVariables:
        if one.type == "Enumeration":
            values = [int(item.value) for item in one.declaredType.items]
            assert len(set(values)) == len(values) > 1, one.name
            assert (int(one.min), int(one.max)) == (min(values), max(values)), one.name
            assert one.start is None or int(one.start) in values, one.name


def test_structure_of_fmi3_is_that_of_fmi2(fmu3, scene):
    """Dependencies by names of FMI 2.0: members of an array all matter, or none does."""
    about = about_hammer(scene, Path("PercussiveHammer.fmu"))
    variables = hammer_variables(scene)
    root = ElementTree.fromstring(write_description(about, variables, b"", NATIVE)[1])
    expected = {
        variables[int(node.get("index")) - 1].name: {
            variables[int(index) - 1].name for index in node.get("dependencies").split()
        }
        for node in root.find("ModelStructure/InitialUnknowns")
    }
    arranged = {str(one.reference): one.members for one in fmi3_variables(hammer_variables(scene))}
    structure = etree.fromstring(read(fmu3)).find("ModelStructure")
    outputs = {
        node.get("valueReference"): node.get("dependencies") for node in structure.findall("Output")
    }
    found = {}
    for node in structure.findall("InitialUnknown"):
        (name,) = arranged[node.get("valueReference")]
        references = node.get("dependencies").split()
        found[name] = {member for one in references for member in arranged[one]}
    assert found == expected
    assert set(outputs.values()) == {""}
    assert {arranged[one][0] for one in outputs} == set(expected)


def test_terminals_and_icon_of_fmi3(fmu3):
    text = read(fmu3, "terminalsAndIcons/terminalsAndIcons.xml")
    assert valid(text, "fmi3", "fmi3TerminalsAndIcons.xsd")
    assert etree.fromstring(text).get("fmiVersion") == etree.fromstring(read(fmu3)).get(
        "fmiVersion"
    )
    assert read(fmu3, "terminalsAndIcons/icon.png").startswith(b"\x89PNG")
    variables = {one.name: one for one in read_model_description(str(fmu3)).modelVariables}
    for terminal in TERMINALS:
        for member, name in terminal.members.items():
            assert variables[name].causality in ("input", "output"), member
    connected = {name for terminal in TERMINALS for name in terminal.members.values()}
    inputs = {name for name, one in variables.items() if one.causality == "input"}
    assert inputs - connected == {"drive.reversal_distance"}  # a setting of the hammer's own


@pytest.mark.parametrize(
    ("version", "platform", "path"),
    [
        ("2.0", "x86_64-linux", "binaries/linux64/Hammer.so"),
        ("2.0", "x86_64-windows", "binaries/win64/Hammer.dll"),
        ("2.0", "x86_64-darwin", "binaries/darwin64/Hammer.dylib"),
        ("2.0", "aarch64-linux", "binaries/aarch64-linux/Hammer.so"),
        ("3.0", "x86_64-linux", "binaries/x86_64-linux/Hammer.so"),
        ("3.0", "aarch64-darwin", "binaries/aarch64-darwin/Hammer.dylib"),
    ],
)
def test_places_of_libraries(version, platform, path):
    assert library_path(version, platform, "Hammer") == path


@pytest.mark.parametrize("platform", ["linux64", "x86_64-beos", "sparc-linux"])
def test_a_platform_that_is_unknown_is_refused(platform):
    with pytest.raises(ValueError, match=platform):
        library_path("3.0", platform, "Hammer")


def test_archive_holds_what_belongs_to_it(fmu, version):
    with zipfile.ZipFile(fmu) as archive:
        names = archive.namelist()
        model = archive.read(MODEL).decode()
    assert names[0] == "modelDescription.xml"
    assert names[1:] == sorted(names[1:])
    icon = "model.png" if version == "2.0" else "terminalsAndIcons/icon.png"
    assert {icon, "documentation/index.html", "documentation/licenses/license.txt"} <= set(names)
    assert sum(name.startswith("binaries/") for name in names) == len(LIBRARIES)
    assert [name for name in names if name.endswith((".py", ".json"))] == [SCENE]
    assert model == f"tables {read_model_description(str(fmu)).guid}"


def test_the_same_inputs_give_the_same_bytes(tmp_path, version):
    first, guid = build(tmp_path / "a.fmu", version, Scene())
    again, same = build(tmp_path / "b.fmu", version, Scene())
    assert first.read_bytes() == again.read_bytes()
    _, other = build(tmp_path / "c.fmu", version, Scene(), {"x86_64-linux": b"another"})
    assert guid == same != other


def fake_run(**options):
    """A result of the form that fmpy gives, which shows what it was asked for."""
    assert options["output_interval"] == options["step_size"]
    count = round(options["stop_time"] / options["step_size"])
    names = ("time", "bit.force", "energy_residual")
    kinds = [*((name, float) for name in names), ("off_bottom", np.bool_)]
    result = np.zeros(count + 1, kinds)
    result["time"] = np.arange(count + 1) * options["step_size"]
    result["bit.force"] = 1e5 / 3.0
    result["off_bottom"] = True
    return result


@pytest.fixture(scope="module")
def with_results(tmp_path_factory, version):
    path, _ = build(tmp_path_factory.mktemp("results") / "hammer.fmu", version, Scene())
    add_reference_results(path, Scene(), fake_run)
    return path


def test_manifest_of_fmi_ls_ref(with_results):
    """The layered standard's own schema is not on PyPI: what it asks for is asked here."""
    folder = reference_results.FOLDER
    root = etree.fromstring(read(with_results, f"{folder}/fmi-ls-manifest.xml"))
    assert root.tag == "fmiReferences"
    space = "{http://fmi-standard.org/fmi-ls-manifest}"
    assert root.get(f"{space}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    assert set(root.attrib) == {
        space + f"fmi-ls-{one}" for one in ("name", "version", "description")
    }
    with zipfile.ZipFile(with_results) as archive:
        names = set(archive.namelist())
    for node in root:
        assert node.tag == "Related"
        assert re.fullmatch("document|model|result|experiment/smoke-test", node.get("role"))
        source = node.get("source")
        path = source.removeprefix("../../") if source.startswith("..") else f"{folder}/{source}"
        assert path in names


def test_experiments_and_their_files(with_results, tmp_path):
    folder = reference_results.FOLDER
    root = etree.fromstring(read(with_results, f"{folder}/{reference_results.EXPERIMENTS}"))
    assert [node.get("name") for node in root] == ["constant_inputs", "changing_inputs"]
    for node in root:
        assert [one.tag for one in node] == ["TransientSimulation", "Stimuli", "References"]
        times = {name: float(text) for name, text in node[0].attrib.items()}
        assert times["stopTime"] / times["stepSize"] == 512.0
        tables = []
        for one in node[1:]:
            tables.append(tmp_path / one.get("source"))
            tables[-1].write_bytes(read(with_results, f"{folder}/{one.get('source')}"))
        inputs, results = (read_csv(path) for path in tables)
        assert inputs["time"][0] == results["time"][0] == times["startTime"]
        assert inputs["time"][-1] == results["time"][-1] == times["stopTime"]
        assert set(inputs.dtype.names[1:]) == {
            one.name for one in hammer_variables(Scene()) if one.causality == "input"
        }
        assert results.dtype.names == ("time", "bit.force", "off_bottom")
        assert np.all(results["bit.force"] == 33333.3333333)
        assert np.all(results["off_bottom"] == 1.0)
    assert validate_fmu(str(with_results)) == []


def test_results_leave_the_guid_as_it_is(with_results, version, tmp_path):
    before, _ = build(tmp_path / "hammer.fmu", version, Scene())
    assert read(before) == read(with_results)
    add_reference_results(before, Scene(), fake_run)
    assert before.read_bytes() == with_results.read_bytes()
    add_files(before, {"extra/org.example/a.txt": b"a"})
    assert read(before, "extra/org.example/a.txt") == b"a"
    assert read(before, MODEL) == read(with_results, MODEL)


def test_inputs_change_where_they_have_an_effect():
    _, changing = experiments(Scene())
    moved = [name for name in changing.signals.dtype.names if np.ptp(1.0 * changing.signals[name])]
    assert moved == [
        "time", "feed_force", "supply_pressure", "percussion_on", "rock.loading_stiffness",
    ]  # fmt: skip
    without = Scene().replace(**{"effects.feed": False})
    _, changing = experiments(without)
    assert np.ptp(changing.signals["feed_force"]) == 0.0
    steps = changing.signals["time"] / reference_results.STEP_SIZE
    assert np.all(steps == np.round(steps))
