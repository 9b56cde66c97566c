"""The shell of the native FMU, with the kernels of a toy: calls, misuse, states, places, words."""

from __future__ import annotations

import ctypes
import math
import os
import random
import shutil
import struct
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from fmpy import platform_tuple, sharedLibraryExtension
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Slave

from fmu_src.hammer.variables import LEFT_OUT, hammer_variables
from fmu_src.native.tables import LAST, model_tables, scene_image
from fmu_src.native.variables3 import TIME, array_name, fmi3_variables
from percussion_model import Scene
from percussion_model.scene.numbers import numbers_of, scene_numbers
from percussion_model.scene.rows import refuse_value
from tests.native import shell_build as build

pytestmark = [
    pytest.mark.skipif(build.COMPILER is None, reason="no C compiler"),
    pytest.mark.skipif(sys.platform == "win32", reason="the host uses dlopen"),
]
LONG = bool(os.environ.get("PERCUSSION_LONG"))
WRAPPED = "-Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc"
HAMMERS = Path(__file__).parents[2] / "percussion_model" / "scene" / "hammers"


@pytest.fixture(scope="module")
def toy(tmp_path_factory):
    """Library and host, and the same with sanitizers."""
    flags = {"plain": (), "checked": build.SANITIZERS}

    def built(kind):
        folder = tmp_path_factory.mktemp(kind)
        return build.build_library(folder, flags[kind]), build.build_host(folder, flags[kind])

    with ThreadPoolExecutor() as pool:
        jobs = {kind: pool.submit(built, kind) for kind in flags}
    if jobs["checked"].exception() is not None:  # no sanitizers on this machine
        jobs["checked"] = jobs["plain"]
    return {kind: job.result() for kind, job in jobs.items()}


@pytest.fixture(scope="module")
def resources(tmp_path_factory):
    """Folder of the toy's tables."""
    return build.write_resources(tmp_path_factory.mktemp("fmu") / "resources")


def run(built, resources, *tests, before=()):
    library, host = built
    place = resources.as_uri() if isinstance(resources, Path) else resources[0]
    folder = str(resources) if isinstance(resources, Path) else resources[1]
    done = subprocess.run(
        [*before, str(host), str(library), build.GUID, place, folder, *tests],
        capture_output=True, text=True, check=False, errors="replace",
        timeout=1000 if LONG else 100,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-4000:]
    return done.stdout


@pytest.mark.parametrize("kind", ["plain", "checked"])
@pytest.mark.parametrize("test", ["fmi2", "fmi3", "threads", "any"])
def test_calls(toy, resources, kind, test):
    run(toy[kind], resources, test)


def test_damaged_tables_harm_nothing(toy, tmp_path):
    run(toy["checked"], build.write_resources(tmp_path / "resources"), "tables")


def test_memory_that_ends_is_told(toy, resources, tmp_path):
    source = str(build.HERE / "no_memory.c")
    library = build.build_library(tmp_path, (source, WRAPPED))
    run((library, toy["plain"][1]), resources, "memory")


@pytest.mark.skipif(not LONG, reason="PERCUSSION_LONG=1 runs it")
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="no valgrind")
@pytest.mark.parametrize("test", ["fmi2", "fmi3", "threads"])
def test_valgrind_sees_nothing(toy, resources, test):
    options = ("valgrind", "-q", "--error-exitcode=9", "--leak-check=full")
    run(toy["plain"], resources, test, before=options)


def test_a_step_and_a_reading_are_quick(toy, resources):
    said = run(toy["plain"], resources, "measure")
    step, reading = (float(said.split(word)[1].split()[0]) for word in ("step", "of 25"))
    # measured: 15 ns and 140 ns; machines of others are slower, and busy
    assert step < 200.0
    assert reading < 2000.0


# places


@pytest.mark.parametrize("name", ["plain", "Müller", "50% #1", "o'k", "a b", "100%25", "日本"])
def test_resources_are_found_in_any_folder(toy, tmp_path, name):
    folder = build.write_resources(tmp_path / name / "resources")
    uri = folder.as_uri()
    path = uri.removeprefix("file://")
    for place in (uri, f"file:{path}", f"file://localhost{path}", f"FILE://{path}", f"{uri}/",
                  str(folder), f"file://{folder}"):  # fmt: skip
        assert run(toy["plain"], (place, str(folder)), "place") == "1 1\n", place
    assert run(toy["plain"], (uri, f"{folder}/"), "place") == "1 1\n"


def test_escapes_may_be_of_small_letters_and_a_zero_is_none(toy, tmp_path):
    folder = build.write_resources(tmp_path / "a#ö" / "resources")
    uri = folder.as_uri()
    assert "%C3%B6" in uri
    small = uri.replace("%C3%B6", "%c3%b6")
    assert run(toy["plain"], (small, str(folder)), "place") == "1 1\n"
    cut = f"{folder.as_uri()}%00x"
    assert run(toy["plain"], (cut, "/none"), "place") == "0 0\n"
    assert run(toy["plain"], ("file:", ""), "place") == "0 0\n"


# words


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Program that writes words."""
    sources = [build.HERE / "words.c", build.SHELL / "text.c"]
    return build.compile_c(tmp_path_factory.mktemp("words") / "words", sources, ())


def words(program, cases, locale=()):
    """What the shell makes of templates and numbers."""
    lines = [f"{form}\t{struct.unpack('>Q', struct.pack('>d', x))[0]:x}" for form, x in cases]
    done = subprocess.run(
        [str(program), *locale], input="\n".join(lines), capture_output=True, text=True, check=False
    )
    if done.returncode == 77:
        pytest.skip("no such locale here")
    assert done.returncode == 0, done.stderr
    return done.stdout.split("\n")[:-1]


def numbers():
    rng = random.Random(3)
    bits = [struct.unpack("<d", rng.randbytes(8))[0] for _ in range(3000)]
    near = [rng.choice((1, -1)) * rng.randrange(10**k) / 10**j for k in range(1, 18)
            for j in range(0, 18, 2)]  # fmt: skip
    powers = [2.0**k for k in range(-1074, 1024)] + [10.0**k for k in range(-300, 300)]
    odd = [0.0, -0.0, math.inf, -math.inf, math.nan, 1e16, 9999999999999998.0, 1e-4, 1e-5, 5e-324,
           1.7976931348623157e308, 0.1, 1 / 3, 123456.5, 1e22, 1e23]  # fmt: skip
    return bits + near + powers + odd


@pytest.mark.parametrize("form", ["", "r", "g", ".3g", ".6g", ".1g", ".12g", ".2f", "d"])
def test_numbers_are_written_as_python_writes_them(program, form):
    cases = numbers()
    if form in (".2f", "d"):
        cases = [x for x in cases if abs(x) < 1e15 and (form != "d" or x == int(x))]
    found = words(program, [("{0" + (":" if form else "") + form + "}", x) for x in cases])
    wanted = [
        repr(x) if form in ("", "r") else format(int(x) if form == "d" else x, form) for x in cases
    ]
    if form == "d":
        found = [text.replace("-0", "0") if text == "-0" else text for text in found]
    wrong = [(a, b) for a, b in zip(found, wanted, strict=True) if a != b]
    assert not wrong, wrong[:5]


def test_templates_have_words_and_braces(program):
    cases = [("a {{b}} {0:|one|two|three|} {0:|one} {5} }", 2.0), ("100% {0:.3g} s", 0.1234)]
    assert words(program, cases) == ["a {b} two  0.0 }", "100% 0.123 s"]


@pytest.mark.skipif(shutil.which("localedef") is None, reason="no localedef")
def test_numbers_do_not_follow_the_locale(program, tmp_path, monkeypatch):
    made = subprocess.run(
        ["localedef", "-i", "de_DE", "-f", "UTF-8", str(tmp_path / "de_DE.UTF-8")],
        capture_output=True, check=False,
    )  # fmt: skip
    if made.returncode != 0:
        pytest.skip("no locale with a decimal comma")
    monkeypatch.setenv("LOCPATH", str(tmp_path))
    cases = [("{0} {0:.3g} {0:.2f}", x) for x in (0.5, 1234567.25, 1e-7)]
    wanted = [f"{x!r} {x:.3g} {x:.2f}" for _, x in cases]
    assert words(program, cases, ("de_DE.UTF-8",)) == wanted


# tables


def scenes():
    yield build.toy_scene()
    yield Scene.from_toml(HAMMERS / "t38.toml")


def test_variables_of_fmi3_are_those_of_fmi2():
    for scene in scenes():
        two, three = hammer_variables(scene), fmi3_variables(hammer_variables(scene))
        members = [name for one in three for name in one.members]
        assert sorted(members) == sorted(one.name for one in two)
        assert len({one.reference for one in three}) == len({one.name for one in three})
        assert three[0].name == TIME
        by_name = {one.name: one for one in two}
        for one in three[1:]:
            kinds = {(by_name[name].type, by_name[name].unit) for name in one.members}
            assert len(kinds) == 1
            assert (math.prod(one.dimensions), not one.dimensions) == (
                len(one.members), not array_name(one.members[0]),
            )  # fmt: skip


def test_the_image_has_the_numbers_of_the_scene():
    for scene in scenes():
        starts = {one.name: one.start for one in hammer_variables(scene)}
        numbers = numbers_of(scene)
        counts = [len(numbers.piston), len(numbers.bit), len(numbers.rods)]
        counts += [len(rod) for rod in numbers.rods]
        rest = [bar.ravel() for bar in (numbers.piston, numbers.bit, *numbers.rods)]
        rest += [numbers.joints.ravel(), [float(starts[name]) for name in LAST]]
        wanted = np.array(counts, "<i8").tobytes() + scene_numbers(scene).tobytes()
        wanted += np.concatenate(rest).astype("<f8").tobytes()
        tables = model_tables(scene, build.GUID, build.FAULTS, build.NOTES)
        assert wanted in tables
        assert len(scene_image(scene).words) == len(wanted) // 8 + 1


def test_tables_are_the_same_each_time():
    assert len({model_tables(build.toy_scene(), build.GUID, build.FAULTS, build.NOTES)
                for _ in range(2)}) == 1  # fmt: skip


# fmpy


class FMU2Toy(FMU2Slave):
    """The toy as fmpy has it, which wants this name, and what a host sees that knows no format."""

    def __init__(self, library, folder, name="one"):
        self.said = []
        self.calls = fmi2CallbackFunctions()
        self.calls.logger = self.kept = fmi2CallbackLoggerTYPE(
            lambda environment, name, status, category, text: self.said.append(text.decode())
        )
        super().__init__(
            guid=build.GUID, unzipDirectory=str(folder.parent), instanceName=name,
            modelIdentifier="toy", libraryPath=str(library),
        )  # fmt: skip
        self.instantiate(callbacks=self.calls, loggingOn=True)


@pytest.fixture
def slave(toy, resources):
    one = FMU2Toy(toy["plain"][0], resources)
    yield one
    one.fmi2FreeInstance(one.component)


def test_fmpy_steps(slave):
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    for k in range(25):
        slave.doStep(k * 1e-3, 1e-3)
    assert slave.getInteger([300]) == [2]
    state = slave.getFMUstate()
    saved = slave.serializeFMUstate(state)
    slave.freeFMUstate(state)
    state = slave.deSerializeFMUstate(saved)
    slave.setFMUstate(state)
    slave.freeFMUstate(state)
    slave.terminate()


class FMU3Toy(FMU3Slave):
    """The toy by FMI 3.0."""


def test_fmpy_steps_by_fmi3(toy, tmp_path):
    build.write_resources(tmp_path / "resources")
    binaries = tmp_path / "binaries" / platform_tuple
    binaries.mkdir(parents=True)
    shutil.copy(toy["plain"][0], binaries / f"toy{sharedLibraryExtension}")
    one = FMU3Toy(
        guid=build.GUID, unzipDirectory=str(tmp_path), instanceName="one", modelIdentifier="toy"
    )
    one.instantiate(eventModeUsed=True, earlyReturnAllowed=True)
    one.enterInitializationMode(startTime=0.0)
    one.exitInitializationMode()
    one.enterStepMode()
    event, ended, early, time = one.doStep(0.0, 0.5)
    assert (event, ended, early, time) == (True, False, True, 0.01)
    assert one.getInt32([300]) == [1]
    assert one.getFloat64([10000], nValues=2) == [0.2, 0.1]
    one.enterEventMode()
    assert one.updateDiscreteStates()[:2] == (False, False)
    one.terminate()
    one.fmi3FreeInstance(one.component)


def bad_values(one):
    """Values of a variable that are not allowed."""
    row = one.row
    if one.type == "Boolean" or row is None:
        return []
    if one.type == "Enumeration":
        return [0, max(number for _, number, _ in one.items) + 1, -7, 2**31 - 1]
    found = [] if one.type == "Integer" else [math.nan, math.inf, -math.inf]
    for bound, is_open, sign in ((row.lower, row.lower_open, -1), (row.upper, row.upper_open, 1)):
        if bound is not None:
            found += [bound] if is_open else []
            found += [bound + sign] if one.type == "Integer" else [
                math.nextafter(bound, sign * math.inf), bound + sign * 0.75 * max(1.0, abs(bound)),
            ]  # fmt: skip
    return [
        int(value) if one.type == "Integer" else value
        for value in found
        if (value != one.left_out and abs(value) < 2**31) or one.type == "Real"
    ]


def test_every_bad_value_is_refused_in_the_words_of_the_library(slave):
    slave.setupExperiment(startTime=0.0)
    count = 0
    for one in hammer_variables(build.toy_scene()):
        if one.causality == "output":
            continue
        put = slave.setReal if one.type == "Real" else slave.setInteger
        for value in bad_values(one):
            if value == one.left_out:
                continue
            put([one.reference], [value])
            slave.said.clear()
            with pytest.raises(FMICallException) as error:
                slave.enterInitializationMode()
            assert error.value.status == 3
            assert slave.said == [
                f"one: {refuse_value(one.row, one.name, value)}".replace("%", "%%")
            ]
            count += 1
        if one.type != "Boolean":
            put([one.reference], [one.start])
    assert count > 200
    for name, (value, _) in LEFT_OUT.items():
        one = next(one for one in hammer_variables(build.toy_scene()) if one.name == name)
        (slave.setReal if one.type == "Real" else slave.setInteger)([one.reference], [value])
    slave.enterInitializationMode()


def test_percent_signs_are_doubled_for_hosts_that_print(toy, resources):
    one = FMU2Toy(toy["plain"][0], resources, name="100%s%n of it")
    with pytest.raises(FMICallException):
        one.terminate()
    assert any(text.startswith("100%%s%%n of it: call out of order") for text in one.said)
    one.fmi2FreeInstance(one.component)


def test_the_library_gives_only_fmi(toy):
    """What is not FMI stays inside, and what is not there fails when it is loaded."""
    library = ctypes.CDLL(str(toy["plain"][0]))
    assert hasattr(library, "fmi2GetVersion")
    assert hasattr(library, "fmi3GetVersion")
    for name in ("refuse", "get_values", "free_motion", "kernel_step_base"):
        assert not hasattr(library, name)
