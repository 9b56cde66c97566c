"""The native FMUs of the reference, built once for all tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from fmu_src.hammer.build import about_hammer
from fmu_src.native.archive import write_native_fmu
from fmu_src.native.tables import model_tables
from percussion_model import Scene


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
