"""Archives of the systems that ship: the standard's schemas and rules, and components of others."""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import read_model_description
from lxml import etree

from fmu_src.flat_names import flat_name
from fmu_src.system.archive import build_fmus, find_plan, with_flat_names, write_system
from percussion_model import Scene
from percussion_model.coupling import Coupling
from percussion_model.coupling.coupled_run import STRING_ENERGIES
from percussion_model.scene.presets import scene_presets

SCHEMAS = Path(fmpy.__file__).parent / "ssp" / "schema"
SPACE = {
    f"ss{letter}": f"http://ssp-standard.org/SSP1/SystemStructure{name}"
    for letter, name in (("c", "Common"), ("d", "Description"), ("v", "ParameterValues"))
}
LASTS = 0.2  # [s]


@pytest.fixture(scope="module")
def flat(built_library, tmp_path_factory):
    """Archive of the feed-controlled system with flat names."""
    folder, plan = tmp_path_factory.mktemp("flat"), find_plan(Path("FeedControlRigid"))
    fmus = build_fmus(plan, folder, flat=True)
    stems = {path.stem for path in fmus.values()}
    assert {"DrillStringFlat", "RigidHammerFlat-native"} <= stems
    assert all("Flat" in one for one in stems)
    plan = with_flat_names(plan, fmus)
    return write_system(plan, fmus, folder / f"{plan.name}.ssp")


@pytest.fixture(params=["feed_control", "extremum_seeking", "two_way", "flat"])
def archive(request):
    """Archive, by file."""
    return request.getfixturevalue(request.param)


def parsed(file, name, schema):
    """Root of a file of XML that the schema of SSP 1.0 lets pass."""
    root = etree.fromstring(file.read(name))
    known = etree.XMLSchema(file=str(SCHEMAS / f"SystemStructure{schema}.xsd"))
    assert known.validate(root), known.error_log
    assert root.get("version") == "1.0"
    return root


def unique(nodes, key="name"):
    """Nodes by a key that no two of them share."""
    found = {node.get(key): node for node in nodes}
    assert len(found) == len(nodes)
    return found


def test_archives_obey_the_standard(archive, tmp_path):
    with zipfile.ZipFile(archive) as file:
        root = parsed(file, "SystemStructure.ssd", "Description")
        units = unique(root.findall("ssd:Units/ssc:Unit", SPACE))
        components = unique(root.findall("ssd:System/ssd:Elements/ssd:Component", SPACE))
        kinds = {}
        for name, node in components.items():
            # where it says, and as its FMU has it
            fmu = tmp_path / f"{name}.fmu"
            fmu.write_bytes(file.read(node.get("source")))
            known = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
            connectors = unique(node.findall("ssd:Connectors/ssd:Connector", SPACE))
            for connector in connectors.values():
                variable = known[connector.get("name")]
                assert connector.get("kind") == variable.causality
                kinds[name, variable.name] = variable.causality
                (kind,) = connector.findall("ssc:*", SPACE)
                unit = kind.get("unit")
                assert unit is None or unit in units
                assert unit == (variable.unit if variable.type == "Real" else None)
            for binding in node.findall("ssd:ParameterBindings/ssd:ParameterBinding", SPACE):
                values = parsed(file, binding.get("source"), "ParameterValues")
                for one in unique(values.findall("ssv:Parameters/ssv:Parameter", SPACE)):
                    assert known[one].variability != "constant"
                    assert known[one].initial in ("exact", "approx")
        fed = []
        for one in root.findall("ssd:System/ssd:Connections/ssd:Connection", SPACE):
            ends = [(one.get(f"{e}Element"), one.get(f"{e}Connector")) for e in ("start", "end")]
            assert sorted(kinds[end] for end in ends) == ["input", "output"]
            fed += [end for end in ends if kinds[end] == "input"]
        assert len(set(fed)) == len(fed) > 5


def test_flat_names_change_no_number(flat, feed_control):
    """Of all that is connected: what else is judged has other names."""
    signals = [[f"string.energy{mark}{name}" for name in STRING_ENERGIES] for mark in "_."]
    runs = [
        Coupling(path).run(LASTS, signals=one)
        for path, one in zip((flat, feed_control), signals, strict=True)
    ]
    assert all(name.count(".") == 1 for name in runs[0].columns if name != "time")
    found, wanted = (run.columns for run in runs)
    for name, column in wanted.items():
        component, dot, variable = name.partition(".")
        assert np.array_equal(found[f"{component}{dot}{flat_name(variable)}"], column), name


def test_a_hammer_of_fmi_3_gives_the_same_bits(feed_control, write):
    newer = write(Scene.from_toml(scene_presets()["rigid"]), "3.0")
    runs = [Coupling(feed_control, replaced=by).run(LASTS) for by in ({}, {"hammer": newer})]
    assert [run.error for run in runs] == ["", ""]
    assert runs[0]["hammer.blow_count"][-1] > 2.0
    for name in runs[0].columns:
        assert np.array_equal(runs[0][name], runs[1][name]), name
