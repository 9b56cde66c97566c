"""The native FMUs of the reference, built once for all tests."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from fmu_src.hammer.build import about_hammer
from fmu_src.native.archive import write_native_fmu
from fmu_src.native.library import libraries, this_platform
from fmu_src.native.tables import model_tables
from percussion_model import Scene
from percussion_model.scene.scene import SceneError

# Compiling takes minutes; another worker waits for it so long [s].
LONGEST_WAIT = 900.0


@pytest.fixture(scope="session")
def library(tmp_path_factory):
    """Library for this machine: {platform: bytes}. One worker compiles it, others wait."""
    lock = tmp_path_factory.getbasetemp().parent / "native.lock"
    deadline = time.monotonic() + LONGEST_WAIT
    while True:
        try:
            lock.open("x").close()
            break
        except FileExistsError:
            assert time.monotonic() < deadline, f"{lock}: its worker has not ended"
            time.sleep(0.2)
    try:
        return libraries([this_platform()])
    except SceneError as error:
        if "no compiler" in str(error):
            pytest.skip(str(error))
        raise
    finally:
        lock.unlink()


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
