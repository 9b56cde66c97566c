"""The native library with its real kernels: memory, threads, bad states, other platforms."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from fmpy import extract, read_model_description

from fmu_src.native.library import ENGINE, HAMMER, HERE, OF, libraries
from percussion_model import Scene
from percussion_model.engine.compiler import FLAGS, definitions, objects
from percussion_model.engine.platforms import PLATFORMS, this_platform
from tests.native import shell_build as build
from tests.native.test_native_fmu import SCENES, SOLVERS

pytestmark = [
    pytest.mark.skipif(build.COMPILER is None, reason="no C compiler"),
    pytest.mark.skipif(sys.platform != "linux", reason="the host uses dlopen"),
]
LONG = bool(os.environ.get("PERCUSSION_LONG"))
long = pytest.mark.skipif(not LONG, reason="PERCUSSION_LONG=1 runs it")
needs_valgrind = pytest.mark.skipif(shutil.which("valgrind") is None, reason="no valgrind")
PLAIN = build.HERE / "plain_host.c"
STEPS = 24  # the first blow is within them
VALGRIND = ("valgrind", "-q", "--error-exitcode=9", "--leak-check=full")


class Unpacked(NamedTuple):
    """An FMU of FMI 2.0 as a host finds it."""

    library: Path
    guid: str
    resources: Path
    depth: str  # reference


@pytest.fixture(scope="module")
def unpack(write, tmp_path_factory):
    """Unpacks the FMU of a scene."""

    def one(changes):
        path = write(Scene().replace(**changes), "2.0")
        description = read_model_description(str(path))
        folder = Path(extract(str(path), str(tmp_path_factory.mktemp("unpacked"))))
        references = {v.name: str(v.valueReference) for v in description.modelVariables}
        library = next((folder / "binaries").rglob("*.so"))
        return Unpacked(library, description.guid, folder / "resources", references["hole_depth"])

    return one


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """Host in C that steps an FMU and writes the depth."""
    out = tmp_path_factory.mktemp("plain") / "host"
    subprocess.run([build.COMPILER, "-O1", str(PLAIN), "-o", str(out), "-ldl"], check=True)
    return out


def depths(host, one, *before, library=None, place="", steps=STEPS):
    """What the plain host writes: depths as bits."""
    done = subprocess.run(
        [*before, str(host), str(library or one.library), one.guid,
         place or one.resources.as_uri(), one.depth, str(steps)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-4000:]
    return [float.fromhex(line) for line in done.stdout.split()[1:]]


@needs_valgrind
@pytest.mark.parametrize("name", SOLVERS)
def test_valgrind_sees_nothing_in_a_solver(unpack, plain, name):
    found = depths(plain, unpack(SOLVERS[name]), *VALGRIND)
    assert len(found) == STEPS


@long
@needs_valgrind
@pytest.mark.parametrize("name", SCENES)
def test_valgrind_sees_nothing_in_a_scene(unpack, plain, name):
    assert len(depths(plain, unpack(SCENES[name]), *VALGRIND, steps=128)) == 128


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """The host that tests the shell."""
    return build.build_host(tmp_path_factory.mktemp("host"))


def run(host, one, *tests, library=None):
    done = subprocess.run(
        [str(host), str(library or one.library), one.guid, one.resources.as_uri(),
         str(one.resources), *tests],
        capture_output=True, text=True, check=False, errors="replace", timeout=1500,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-4000:]


def test_threads_and_bad_states(host, unpack):
    run(host, unpack({}), "threads", "states")


@long
@pytest.mark.parametrize("name", SOLVERS)
def test_bad_states_of_all_solvers(host, unpack, name):
    """A thousand with a right hash: none crashes the host."""
    run(host, unpack(SOLVERS[name]), "states")


@long
def test_a_thousand_instances_in_eight_threads(host, unpack):
    run(host, unpack({}), "many")


@long
@pytest.mark.parametrize(("name", "count"), [("rigid", 10_000), ("modal", 500), ("wave", 500)])
def test_sequences_of_any_calls(host, unpack, name, count, monkeypatch):
    """Set-ups take most of the time: of rigid bodies they are the quickest."""
    monkeypatch.setenv("SEQUENCES", str(count))
    run(host, unpack(SOLVERS[name]), "sequences")


@long
def test_sanitizers_see_nothing(unpack, tmp_path):
    """In the shell, with the real kernels."""
    parts = objects(OF[HAMMER], [this_platform()])[this_platform()]
    library = tmp_path / "checked.so"
    sources = [*map(str, sorted(HERE.glob("*.c"))), str(ENGINE / "memory.c"), *map(str, parts)]
    subprocess.run(
        [build.COMPILER, *FLAGS, *build.SANITIZERS, *definitions(parts), "-fPIC", f"-I{HERE}",
         f"-I{ENGINE}", f"-isystem{build.HEADERS}", *sources, "-lm", "-o", str(library)],
        check=True,
    )  # fmt: skip
    (tmp_path / "host").mkdir()
    host = build.build_host(tmp_path / "host", build.SANITIZERS)
    for name in SOLVERS:
        run(host, unpack(SOLVERS[name]), "threads", "states", library=library)
    run(host, unpack({}), "any", library=library)


# Other platforms: how their programs run here, and where they find files of this machine.
RUNNERS = {
    "x86_64-windows": (("/usr/lib/wine/wine64",), "Z:"),
    "aarch64-linux": (("qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"), ""),
}


@long
@pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="no ziglang")
@pytest.mark.parametrize("platform", RUNNERS)
def test_other_platforms_give_the_same_bits(unpack, plain, platform, tmp_path, monkeypatch):
    runner, drive = RUNNERS[platform]
    if shutil.which(runner[0]) is None:
        pytest.skip(f"no {runner[0]}")
    monkeypatch.setenv("WINEDEBUG", "-all")
    monkeypatch.setenv("WINEPREFIX", str(tmp_path / "wine"))
    names = [this_platform(), *RUNNERS]
    library = tmp_path / f"hammer{PLATFORMS[platform].suffix}"
    library.write_bytes(libraries(names)[platform])
    host = tmp_path / "host.exe"
    compiler = (sys.executable, "-m", "ziglang", "cc", "-target", PLATFORMS[platform].zig)
    subprocess.run([*compiler, "-O1", str(PLAIN), "-o", str(host)], check=True)
    for name in SOLVERS:
        one = unpack(SOLVERS[name])
        place = f"file:///{drive}{one.resources}" if drive else ""
        found = depths(host, one, *runner, library=library, place=place, steps=256)
        assert found == depths(plain, one, steps=256), name
