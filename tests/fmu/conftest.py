"""FMUs built once for all tests, and a cache of kernels that they share."""

from __future__ import annotations

import pytest

from fmu_src.hammer.build import build_hammer
from fmu_src.parts.build import PARTS, build_part
from percussion_model import Scene
from scenarios.harness import Instance

RIGID = {"piston.model": "rigid", "bit.model": "rigid"}


@pytest.fixture(scope="session")
def fmus(built_library, tmp_path_factory):
    """Folder with the reference's FMU, that of rigid bodies, both also without a library, and
    those of a part with and without Python.
    """
    folder = tmp_path_factory.mktemp("fmus")
    build_hammer(Scene(), folder / "PercussiveHammer.fmu")
    build_hammer(Scene().replace(**RIGID), folder / "RigidHammer.fmu")
    build_hammer(Scene(), folder / "NumbaHammer.fmu", libraries={})
    build_hammer(Scene().replace(**RIGID), folder / "NumbaRigidHammer.fmu", libraries={})
    for name in ("RockFilter", "Supply"):
        build_part(PARTS[name], folder / f"{name}.fmu")
    return folder


@pytest.fixture(scope="session")
def hammer(fmus):
    """FMU of the reference scene."""
    return fmus / "PercussiveHammer.fmu"


@pytest.fixture(scope="session")
def rigid(fmus):
    """FMU of the rigid scene."""
    return fmus / "RigidHammer.fmu"


@pytest.fixture(scope="session")
def unpacked(fmus, tmp_path_factory):
    """Folders of the unpacked FMUs by name."""
    from fmpy import extract

    folder = tmp_path_factory.mktemp("unpacked")
    return {path.stem: extract(str(path), str(folder / path.stem)) for path in fmus.glob("*.fmu")}


@pytest.fixture
def make(unpacked):
    """Make initialised instances, freed at the end of the test."""
    made = []

    def one(name="RigidHammer", start=True, **values):
        """`NumbaHammer` and `NumbaRigidHammer` have no library, and run by numba."""
        instance = Instance(unpacked[name], name=f"{name}{len(made)}")
        made.append(instance)
        if start:
            instance.start(**values)
        return instance

    yield one
    for instance in made:
        instance.free()
