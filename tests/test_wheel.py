"""What is installed without the clone: the wheel's files, and tasks from an empty folder.

With PERCUSSION_LONG=1 the wheel is installed as users do, with all that it needs.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
import sysconfig
import zipfile
from email import message_from_bytes
from pathlib import Path

import pytest

from fmu_src.hammer.build import build_hammer
from fmu_src.native.library import PARTS, PLATFORMS, libraries, stamp
from fmu_src.wheels import make_wheel
from percussion_model import Scene, simulate
from percussion_model.engine.compiler import compiler_for, kept_folder
from percussion_model.engine.library import brought_file, make
from percussion_model.engine.platforms import this_platform
from percussion_model.scene.presets import scene_presets
from tests.installed import build_wheel, expected_files, plain_environment, try_python

# Beside the packages: what a wheel says of itself.
ABOUT = {"METADATA", "WHEEL", "RECORD", "entry_points.txt", "licenses/LICENSE"}
SHORT = {"duration": 0.5, "settle": 0.1}
TWO_TENTHS = ("--duration", "0.2", "--settle", "0")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    pytest.importorskip("hatchling")
    return build_wheel(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def installed(wheel, built_library, tmp_path_factory):
    """The wheel in an environment of its own, which keeps the library of FMUs and a solver already.

    `test_added_component` has an installation compile a solver.
    """
    folder = tmp_path_factory.mktemp("installed")
    outer = {sysconfig.get_path(name) for name in ("purelib", "platlib")}
    made = plain_environment(folder, wheel, sorted(outer))
    kept = folder / "percussion_cache" / "native" / stamp()
    kept.mkdir(parents=True)
    for name, content in built_library.items():
        (kept / f"{name}{PLATFORMS[name].suffix}").write_bytes(content)
        parts = libraries([name], which=PARTS)[name]
        (kept / f"{PARTS}{name}{PLATFORMS[name].suffix}").write_bytes(parts)
    for one in ("rigid", "calls") if built_library else ():
        make(one)
        file = Path("engine", "libraries", brought_file(one, this_platform()).name)
        (folder / "percussion_cache" / file.parent).mkdir(parents=True, exist_ok=True)
        shutil.copy2(kept_folder().parent / file, folder / "percussion_cache" / file)
    made.variables["PATH"] = str(made.program("percussion").parent)  # without a compiler
    return made


@pytest.fixture(scope="module")
def bare(built_library, tmp_path_factory):
    """The wheel for this platform where nothing compiles: no numba, no compiler, no cache."""
    pytest.importorskip("hatchling")
    if not built_library:
        pytest.skip("no C compiler, and no ziglang")
    folder = tmp_path_factory.mktemp("bare")
    wheel = make_wheel(this_platform(), compiler_for(this_platform()), folder)
    outer = {sysconfig.get_path(name) for name in ("purelib", "platlib")}
    made = plain_environment(folder, wheel, sorted(outer))
    (site,) = (folder / "venv").glob("[Ll]ib/**/site-packages")
    absent = "import sys; sys.modules.update(dict.fromkeys(('numba', 'llvmlite', 'scipy')))\n"
    (site / "absent.pth").write_text(absent, encoding="utf-8")
    made.variables["PATH"] = str(made.program("percussion").parent)
    made.variables["PYTHONDONTWRITEBYTECODE"] = "1"
    return made


def test_a_wheel_for_a_platform_compiles_nothing_and_writes_nothing(bare):
    def files():
        found = {path for path in bare.folder.parent.rglob("*") if path.is_file()}
        return {path for path in found if bare.empty not in path.parents}

    before = files()
    for words in (["reference"], ["t38_rods"], ["drop_test"], ["rigid"]):
        out = bare.percussion("run", *words, *TWO_TENTHS, "--json", "-")
        here = simulate(Scene.from_toml(scene_presets()[words[0]]), 0.2, settle=0.0).summary()
        assert json.loads(out)["blows"] == here["blows"]
        assert json.loads(out)["energy"] == here["energy"]
    bare.percussion("run", "reference", *TWO_TENTHS, "--set", "effects.rock=power", "--json", "-")
    bare.percussion("effects", "rigid", "--duration", "0.3", "--settle", "0.1")
    bare.percussion("settled", "rigid")
    assert files() == before
    refused = bare.call("accuracy", "reference")
    assert refused.returncode == 2
    assert 'numba is missing: pip install "percussion_model[compile]"' in refused.stderr


def test_a_wheel_for_a_platform_makes_fmus_without_compiling(bare, built_library):
    bare.percussion("fmu", "rigid", "-o", "Hammer.fmu")
    bare.percussion("native", "reference", "-o", "native")
    bare.percussion("system", "FeedControlRigid", "-o", "systems")
    done = bare.call("couple", "systems/FeedControlRigid.ssp", "--duration", "0.2",
                     "--no-figures", "--json", "-")  # fmt: skip
    assert json.loads(done.stdout)["time"] == pytest.approx(0.2)
    names = zipfile.ZipFile(bare.empty / "Hammer.fmu").namelist()
    assert any(name.startswith("resources/native/") for name in names)


def test_a_library_of_other_sources_is_not_taken(bare):
    """An edit of an installed file: the library is refused, and what compiles is missing."""
    (source,) = (bare.folder).rglob("percussion_model/physics/rock.py")
    before = source.read_text(encoding="utf-8")
    source.write_text(before + "\n", encoding="utf-8")
    try:
        refused = bare.call("run", "reference", *TWO_TENTHS)
    finally:
        source.write_text(before, encoding="utf-8")
    assert refused.returncode == 2
    assert "the sources of the solvers have changed" in refused.stderr
    assert 'pip install "percussion_model[compile]"' in refused.stderr


def test_the_wheel_has_every_file_and_no_other(wheel):
    found = set(zipfile.ZipFile(wheel).namelist())
    about = {name.partition(".dist-info/")[2] for name in found if ".dist-info/" in name}
    assert about == ABOUT
    assert {name for name in found if ".dist-info/" not in name} == expected_files()
    kinds = {name.rpartition(".")[2] for name in found}
    assert {"py", "c", "h", "toml", "json", "j2", "png", "typed"} <= kinds


def test_users_get_no_tools_of_development(wheel):
    archive = zipfile.ZipFile(wheel)
    (name,) = (one for one in archive.namelist() if one.endswith("/METADATA"))
    needed = message_from_bytes(archive.read(name)).get_all("Requires-Dist")
    plain = {re.split("[<>]", text)[0] for text in needed if "extra ==" not in text}
    assert plain == {"numpy", "typer", "rich", "tomli-w", "pint"}
    of_all = [text for text in needed if "extra == 'all'" in text]
    assert of_all
    tools = ("ruff", "mypy", "pytest", "hypothesis", "import-linter", "ecospy", "hatchling")
    for tool in (*tools, "numba", "pyarrow", "distributed", "ziglang"):  # which take much disk
        assert any(text.startswith(tool) for text in needed)
        assert not any(text.startswith(tool) for text in of_all)


@pytest.mark.slow
def test_scenes_are_found_by_name(installed):
    out = installed.percussion("run", "rigid", "--duration", "0.5", "--settle", "0.1",
                               "--json", "-")  # fmt: skip
    here = simulate(Scene.from_toml(scene_presets()["rigid"]), **SHORT).summary()
    assert json.loads(out)["rate_of_penetration"] == here["rate_of_penetration"]
    installed.percussion("new", "mine.toml", "--hammer", "dth5")
    assert (installed.empty / "mine.toml").is_file()
    refused = installed.call("run", "nosuch")
    assert refused.returncode == 2
    said = [line for line in refused.stderr.splitlines() if not line.endswith("still running")]
    assert len(said) == 1
    assert "reference" in said[0]
    assert "layered_rock" in installed.percussion("scenario")


def test_the_fmu_is_that_of_the_clone_to_the_byte(installed, built_library, tmp_path):
    """It is run by fmpy for its reference signals."""
    installed.percussion("fmu", "rigid", "-o", "Hammer.fmu")
    build_hammer(Scene.from_toml(scene_presets()["rigid"]), tmp_path / "Hammer.fmu")
    made = installed.empty / "Hammer.fmu"
    assert made.read_bytes() == (tmp_path / "Hammer.fmu").read_bytes()
    assert (installed.empty / "Hammer_ref.csv").read_text().count("\n") > 500
    names = zipfile.ZipFile(made).namelist()
    assert any(name.startswith("resources/native/") for name in names) == bool(built_library)


def test_fmus_without_python_are_made(installed, built_library):
    if not built_library:
        pytest.skip("no C compiler, and no ziglang")
    said = installed.percussion("native", "rigid", "-o", "native").splitlines()
    assert len(said) == 2
    assert all(line.endswith("}: written, from the scene rigid") for line in said)


def test_a_system_is_built_valid_and_runs(installed):
    said = installed.percussion("system", "FeedControlRigid", "-o", "systems").splitlines()
    assert [line.endswith(", valid") for line in said] == [True] * 6 + [False]
    done = installed.call("couple", "systems/FeedControlRigid.ssp", "--duration", "0.4",
                          "--no-figures", "--json", "-")  # fmt: skip
    found = json.loads(done.stdout)
    assert found["time"] == pytest.approx(0.4)
    assert found["depth"] > 1e-3
    assert (installed.empty / "out" / "FeedControlRigid" / "signals.csv").is_file()


def test_a_study_is_made(installed):
    installed.percussion("study", "rigid", "--over", "feed.force=2kN:4kN:3", "--out", "map")
    assert (installed.empty / "map" / "report.html").is_file()


@pytest.mark.skipif(
    not os.environ.get("PERCUSSION_LONG"), reason="takes minutes: PERCUSSION_LONG=1 runs it"
)
def test_all_tasks_from_a_fresh_installation(wheel):
    try_python(sys.executable, wheel)
