"""Fixtures that several suites share."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from fmu_src.hammer.build import about_hammer
from fmu_src.native.archive import write_native_fmu
from fmu_src.native.library import library_here
from fmu_src.native.tables import model_tables
from percussion_model import Result, Scene, simulate
from percussion_model.interface import progress

# How long an example takes says nothing on a machine that others use too.
settings.register_profile("shared", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared")

# Workers of one run of the tests share compiled kernels; NUMBA_CACHE_DIR is theirs too.
os.environ.setdefault(
    "PERCUSSION_FMU_CACHE",
    str(Path(os.environ.get("NUMBA_CACHE_DIR") or tempfile.gettempdir()) / "percussion_fmu"),
)
# The cache is shared like compiled kernels, and never the user's own.
os.environ.setdefault(
    "PERCUSSION_CACHE",
    str(Path(os.environ.get("NUMBA_CACHE_DIR") or tempfile.gettempdir()) / "percussion_cache"),
)


def pytest_collection_modifyitems(items):
    """Files with slow tests come first, lest the last of them keep one process alone."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


@pytest.fixture(autouse=True)
def no_progress(monkeypatch):
    """No lines of progress on stderr, however slow the machine; tests of them ask for more."""
    monkeypatch.setattr(progress, "EVERY", 3600.0)


@pytest.fixture(scope="session")
def reference() -> Result:
    """Four seconds of the reference drill, one of them to settle."""
    return simulate(Scene(), 4.0, settle=1.0)


@pytest.fixture(scope="session")
def reference_by_waves() -> Result:
    """The same by waves."""
    return simulate(Scene().computed_by("wave"), 4.0, settle=1.0)


@pytest.fixture(scope="session")
def built_library():
    """Library of FMUs by platform, none without a compiler. One worker compiles, others wait."""
    return library_here()


@pytest.fixture(scope="session")
def library(built_library):
    """Library for this machine: {platform: bytes}."""
    if not built_library:
        pytest.skip("no C compiler, and no ziglang")
    return built_library


@pytest.fixture(scope="session")
def write(library, tmp_path_factory):
    """Writes the native FMU of a scene for a version of FMI; its path."""
    folder = tmp_path_factory.mktemp("native")
    made: dict[tuple[str, str], Path] = {}

    def one(scene: Scene, version: str) -> Path:
        key = (repr(scene.given_values()), version)
        if key not in made:
            path = folder / f"Hammer{len(made)}.fmu"
            about = about_hammer(scene, Path("PercussiveHammer.fmu"))
            write_native_fmu(
                path, version, about, scene, library, lambda guid: model_tables(scene, guid)
            )
            made[key] = path
        return made[key]

    return one


@pytest.fixture
def scene_from_text(tmp_path):
    """Read a scene from text."""

    def from_text(text):
        path = tmp_path / "scene.toml"
        path.write_text(text, encoding="utf-8")
        return Scene.from_toml(path)

    return from_text
