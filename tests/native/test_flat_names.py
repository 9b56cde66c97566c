"""Names of variables without dots, of which some hosts make buses."""

from __future__ import annotations

import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_src.description import write_description
from fmu_src.flat_names import flat_name, flatten
from fmu_src.hammer.build import about_hammer
from fmu_src.hammer.variables import hammer_variables
from fmu_src.native.archive import write_native_fmu
from fmu_src.native.build import build_native
from fmu_src.native.library import library_here
from fmu_src.native.reference_results import FOLDER
from fmu_src.parts.build import PARTS, build_part
from fmu_src.run import run_fmu
from percussion_model import Scene
from percussion_model.scene.presets import scene_presets

SCENES = {name: Scene.from_toml(scene_presets()[name]) for name in ("reference", "top_hammer")}
TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"


def test_dots_and_brackets_become_underscores():
    assert flat_name("piston.sections[1].length") == "piston_sections_1_length"
    assert flat_name("feed_force") == "feed_force"


def built(path, version, scene, flat):
    about = about_hammer(scene, Path("A.fmu"), flat)
    library = {"x86_64-linux": b"none"}
    write_native_fmu(path, version, about, scene, library, lambda guid: b"tables " + guid.encode())
    return read_model_description(str(path))


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_native_fmus_differ_in_names_alone(name, version, tmp_path):
    flat = built(tmp_path / "flat.fmu", version, SCENES[name], True)
    dotted = built(tmp_path / "dotted.fmu", version, SCENES[name], False)
    assert (flat.variableNamingConvention, dotted.variableNamingConvention) == (
        "flat", "structured"
    )  # fmt: skip
    assert validate_fmu(str(tmp_path / "flat.fmu")) == []
    names = [one.name for one in flat.modelVariables]
    assert len(set(names)) == len(names) > 80
    assert all(one.isidentifier() for one in names)
    for one, other in zip(flat.modelVariables, dotted.modelVariables, strict=True):
        assert one.name == flat_name(other.name)
        assert (one.valueReference, one.start) == (other.valueReference, other.start)
    assert flat.guid != dotted.guid
    with zipfile.ZipFile(tmp_path / "flat.fmu") as archive:
        page = archive.read("documentation/index.html").decode()
        assert "<code>bit_position</code>" in page
        if version == "3.0":
            root = ElementTree.fromstring(archive.read(TERMINALS))
            members = {one.attrib["variableName"] for one in root.iter("TerminalMemberVariable")}
            assert members <= set(names)


@pytest.mark.parametrize("name", SCENES)
def test_an_fmu_of_python_has_them_too(name):
    scene = SCENES[name]
    _, text = write_description(
        about_hammer(scene, Path("A.fmu"), True), hammer_variables(scene), b""
    )
    root = ElementTree.fromstring(text)
    assert root.attrib["variableNamingConvention"] == "flat"
    assert all(one.attrib["name"].isidentifier() for one in root.iter("ScalarVariable"))


def test_two_variables_never_have_one_flat_name():
    def names(*given):
        nodes = "".join(f"<ScalarVariable name='{name}'/>" for name in given)
        root = ElementTree.fromstring(
            f"<fmiModelDescription><ModelVariables>{nodes}</ModelVariables></fmiModelDescription>"
        )
        flatten(root)
        return [node.attrib["name"] for node in root[0]]

    assert names("a.b", "a_b", "c[1].d") == ["a__b", "a_b", "c_1_d"]
    with pytest.raises(ValueError, match=r"a\.b and a__b would both be a__b"):
        names("a.b", "a_b", "a__b")
    with pytest.raises(ValueError, match=r"a\.b and a\[b\] would both be a__b"):
        names("a.b", "a[b]")


def test_a_flat_fmu_runs_and_holds_its_reference(built_library, tmp_path):
    """Building compares it with the package to the last bit."""
    path = tmp_path / "Hammer-native.fmu"
    rigid = Scene.from_toml(scene_presets()["rigid"])
    build_native(rigid, path, "2.0", library_here(), flat=True)
    found = run_fmu(path, stop_time=0.1, step_size=0.01, output=["bit_position", "blow_count"])
    assert found["blow_count"][-1] >= 1
    assert np.isfinite(found["bit_position"]).all()
    with zipfile.ZipFile(path) as archive:
        head = archive.read(f"{FOLDER}/changing_inputs_in.csv").decode().partition("\n")[0]
    assert '"rock_loading_stiffness"' in head
    assert "." not in head


def test_a_part_has_them_too(tmp_path):
    build_part(PARTS["Supply"], tmp_path / "Supply.fmu", flat=True)
    model = read_model_description(str(tmp_path / "Supply.fmu"))
    assert model.variableNamingConvention == "flat"
    assert all(one.name.isidentifier() for one in model.modelVariables)
