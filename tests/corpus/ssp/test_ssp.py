"""Archives of SSP, one a feature: each gives what the standard says, or is refused in one line."""

from __future__ import annotations

import subprocess
import tempfile
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest
from fmpy import platform, platform_tuple, sharedLibraryExtension

from fmu_src.native.library import NoCompilerError, compiler_for
from fmu_src.slave.native import this_platform
from percussion_model.coupling import Coupling, CouplingError
from percussion_model.coupling.python_part import input_starts
from tests.commands import percussion
from tests.properties.hostile import pack, unpacked

HERE = Path(__file__).parent
CASES = tomllib.loads((HERE / "cases.toml").read_text(encoding="utf-8"))["case"]
SPACES = " ".join(
    f'xmlns:ss{letter}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for letter, name in (
        ("c", "Common"), ("d", "Description"), ("v", "ParameterValues"), ("m", "ParameterMapping")
    )
)  # fmt: skip
# Where the texts of a case stand; `others` are more elements, `after` follows the system.
STRUCTURE = """<ssd:SystemStructureDescription SPACES version="1.0" name="case">
<ssd:System name="case">{system}<ssd:Elements>
<ssd:Component name="a" source="resources/Echo.fmu">{a}</ssd:Component>
<ssd:Component name="b" source="resources/Workshop.fmu">{b}</ssd:Component>{others}
</ssd:Elements>{connections}</ssd:System>{after}</ssd:SystemStructureDescription>"""
WORDS = {
    "VALUES_END": "BINDING_END</ssd:ParameterBindings>",
    "VALUES": "<ssd:ParameterBindings>BINDING",
    "BINDING_END": "</ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues>"
    "</ssd:ParameterBinding>",
    "BINDING": '<ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" '
    'name="own"><ssv:Parameters>',
    "SPACES": SPACES,
}
# The second FMU: units of a workshop, and an enumeration in another order.
WORKSHOP = {
    '"N"': '"kN"', '"m"': '"mm"', '"K"': '"degC"', '"Hz"': '"rad/s"',
    's="-2"/>': 's="-2" factor="1000"/>', 'm="1"/>': 'm="1" factor="0.001"/>',
    'K="1"/>': 'K="1" offset="273.15"/>', 's="-1"/>': 's="-1" rad="1"/>',
    'off" value="1"': 'off" value="2"', 'slow" value="2"': 'slow" value="3"',
    'fast" value="3"': 'fast" value="1"',
}  # fmt: skip


@pytest.fixture(scope="session")
def echoes(tmp_path_factory):
    """All FMUs as bytes, by name."""
    try:
        compiler = compiler_for(this_platform())
    except NoCompilerError as error:
        pytest.skip(str(error))
    folder = tmp_path_factory.mktemp("echo")

    def packed(name, text, place):
        library = folder / f"{name}{sharedLibraryExtension}"
        if not library.exists():
            words = [*compiler, "-shared", "-O1", "-fPIC", HERE / f"{name}.c", "-o", library]
            subprocess.run([str(word) for word in words], check=True)
        entry = f"binaries/{place}/Echo{sharedLibraryExtension}"
        return pack({"modelDescription.xml": text.encode(), entry: library.read_bytes()})

    text = (HERE / "echo.xml").read_text(encoding="utf-8")
    other = text
    for old, new in WORKSHOP.items():
        assert old in other
        other = other.replace(old, new)
    newer = (HERE / "echo3.xml").read_text(encoding="utf-8")
    return {
        "Echo": packed("echo", text, platform),
        "Workshop": packed("echo", other, platform),
        "Echo3": packed("echo3", newer, platform_tuple),
    }


def write_case(case, echoes, path):
    """Write the archive of a case."""
    keys = ("system", "a", "b", "others", "connections", "after")
    texts = {key: case.get(key, "") for key in keys}
    if texts["connections"]:
        texts["connections"] = f"<ssd:Connections>{texts['connections']}</ssd:Connections>"
    structure = STRUCTURE.format(**texts)
    for old, new in case.get("replace", ()):
        assert old in structure
        structure = structure.replace(old, new)
    entries = {"SystemStructure.ssd": structure, **case.get("files", {})}
    for name, text in entries.items():
        for word, meaning in WORDS.items():
            text = text.replace(word, meaning)
        entries[name] = echoes["Echo"] if text == "ECHO" else text.encode()
    entries |= {f"resources/{name}.fmu": one for name, one in echoes.items()}
    path.write_bytes(pack(entries))


@pytest.mark.parametrize("case", CASES, ids=[case["id"] for case in CASES])
def test_an_archive_gives_what_it_says_or_is_refused(case, echoes, tmp_path):
    path = tmp_path / "case.ssp"
    write_case(case, echoes, path)
    if "refused" in case:
        with pytest.raises(CouplingError, match=case["refused"]) as refused:
            Coupling(path).run(2e-3, 1e-3)
        assert "\n" not in str(refused.value)
        return
    coupling = Coupling(path)
    duration = 2e-3 if coupling.stop is None else coupling.stop - coupling.start
    names, told = [name for name in case["right"] if name != "time"], []
    run = coupling.run(duration, 1e-3, names, tell=told.append)
    assert told == ([case["remark"]] if "remark" in case else [])
    assert run.error == ""
    found = {name: run[name][-1] for name in case["right"]}
    assert found == pytest.approx(case["right"], rel=1e-14)


def write_named(name, echoes, path):
    """Write the archive of a case by its id."""
    (case,) = [case for case in CASES if case["id"] == name]
    write_case(case, echoes, path)
    return path


def test_another_fmu_and_a_python_part_have_their_units(echoes, tmp_path):
    """Of b: the other FMU has SI itself, the Python part stands for that of the archive."""
    path = write_named("connection between units", echoes, tmp_path / "case.ssp")
    (tmp_path / "Other.fmu").write_bytes(echoes["Echo"])
    run = Coupling(path, replaced={"b": tmp_path / "Other.fmu"}).run(2e-3, 1e-3, ["b.force_out"])
    assert run["b.force_out"][-1] == 2500.0
    seen = {}

    def work(inputs, time, step):
        seen.update(inputs)
        return {}

    Coupling(path, replaced={"b": work}).run(2e-3, 1e-3)
    assert (seen["force"], seen["heat"], seen["length"]) == pytest.approx((2.5, 27.0, 3.0))
    path = write_named("bindings of the system go first, the last of them", echoes, path)
    Coupling(path, replaced={"b": lambda inputs, time, step: seen.update(inputs) or {}}).run(
        2e-3, 1e-3
    )
    assert seen["mode"] == 3


def test_an_input_without_a_start_takes_the_value_of_the_archive():
    one = SimpleNamespace(name="force", type="Real", causality="input", start=None)
    description = SimpleNamespace(modelVariables=[one])
    assert input_starts("a", description, {"force": 2.0}) == {"force": 2.0}
    with pytest.raises(CouplingError, match="a: force has no start value"):
        input_starts("a", description, {})


def test_options_set_what_the_archive_does_too(echoes, tmp_path):
    path = write_named("prefix", echoes, tmp_path / "case.ssp")
    run = Coupling(path, {"b.force": 1.5}).run(2e-3, 1e-3, ["b.force_out"])
    assert run["b.force_out"][-1] == 1.5
    with pytest.raises(CouplingError, match=r"a\.force_out is calculated: it cannot be set"):
        Coupling(path, {"a.force_out": 1.0}).run(2e-3, 1e-3)
    with pytest.raises(CouplingError, match="a: count = 4294967297 does not fit an Integer"):
        Coupling(path, {"a.count": 2**32 + 1}).run(2e-3, 1e-3)


def test_steps_of_fmi_3_are_taken_back(echoes, tmp_path):
    """A tolerance saves and restores the state, and leaves it as it was."""
    path = write_named("components of FMI 3.0", echoes, tmp_path / "case.ssp")
    structure = unpacked(path.read_bytes())
    words = structure["SystemStructure.ssd"].replace(b"Echo.fmu", b"Echo3.fmu")
    text = words.replace(b"Workshop.fmu", b"Echo3.fmu")
    path.write_bytes(pack(structure | {"SystemStructure.ssd": text}))
    run = Coupling(path).run(4e-3, 1e-3, ["d.force_out", "d.clock_out"], tolerance=1e-3)
    assert (run.error, run.steps) == ("", 8)
    assert (run["d.force_out"][-1], run["d.clock_out"][-1]) == (6000.0, 4e-3)
    run = Coupling(path, {"a.force": 2e6}).run(4e-3, 1e-3)
    assert (run.error, run.steps) == ("at 0 s: a: asks for the end of the run", 0)


@pytest.fixture
def timed(echoes, tmp_path, monkeypatch):
    """Archive that says from when to when it is run."""
    write_named("default experiment", echoes, tmp_path / "case.ssp")
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("words", "first", "last"),
    [
        ((), 1.0, 1.25),
        (("--duration", "0.1"), 1.0, 1.1),
        (("--start", "0"), 0.0, 1.25),
        (("--start", "-1", "--duration", "0.5"), -1.0, -0.5),
    ],
)
def test_options_go_before_the_default_experiment(words, first, last, timed):
    percussion("couple", "case.ssp", "--signal", "a.clock_out", "--no-figures", *words)
    lines = Path("out/case/signals.csv").read_text(encoding="utf-8").splitlines()
    rows = [[float(word) for word in line.split(",")] for line in lines[1:]]
    assert rows[0][0] == first
    assert rows[-1] == pytest.approx([last, last])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--start", "2"), "stopTime = 1.25: is not after the start at 2 s: give --duration"),
        (("--start", "nan"), "stopTime = 1.25: is not after the start at nan s: give --duration"),
        (("--start", "inf", "--duration", "1"), "start = inf s: must be a finite time that a step"),
        (("--start", "-1e300", "--duration", "1"), "start = -1e+300 s: must be a finite time"),
        (("--duration", "-1"), "duration = -1.0 s: must be above 0 s"),
    ],
)
def test_times_that_cannot_be_are_refused_and_leave_nothing(words, said, timed, capsys):
    (folder := Path("temporary")).mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tempfile, "tempdir", str(folder.absolute()))
        assert percussion("couple", "case.ssp", *words) == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert not Path("out").exists()
    assert not list(folder.iterdir())


def test_options_name_what_stands_in_inner_systems(echoes, tmp_path, monkeypatch):
    write_named("values of systems within systems", echoes, tmp_path / "case.ssp")
    monkeypatch.chdir(tmp_path)
    words = ("--set", "in.core.c.count=4", "--signal", "in.core.c.count_out", "--no-figures")
    assert percussion("couple", "case.ssp", "--duration", "0.01", *words) == 0
    head, *_, last = Path("out/case/signals.csv").read_text(encoding="utf-8").splitlines()
    assert (head, last) == ('"time","in.core.c.count_out"', "0.01,4.0")
    with pytest.raises(CouplingError, match=r"no FMU in in case\.ssp.*a, b, in\.core\.c, in\.d"):
        Coupling("case.ssp", {"in.cor.c.count": 4})
