"""The hammer's FMU, from a scene."""

from __future__ import annotations

import functools
import json
import re
import zipfile
import zlib
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

from fmu_src.archive import SCENE, write_fmu
from fmu_src.description import About
from fmu_src.hammer.slave import PercussiveHammer
from fmu_src.hammer.variables import VERSION, hammer_variables
from fmu_src.native.library import library_here
from fmu_src.native.tables import model_tables
from fmu_src.page import write_page
from fmu_src.slave.native import library_name
from fmu_src.staging import stage
from fmu_src.variables import FILE, to_json, write_variables
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.scene.writing import is_special
from percussion_model.solvers.base import added_solvers

STEP_SIZE = 1e-3  # of the default experiment [s]


def build_hammer(
    scene: Scene,
    path: Path,
    libraries: Mapping[str, bytes] | None = None,
    flat: bool = False,
) -> str:
    """Write the FMU of a scene; return its GUID.

    It runs by a native library where it brings one for the machine, else by Python.

    Parameters
    ----------
    path : Path
        Ends with `.fmu`; the rest of its name is the model identifier.
    libraries : dict of str, optional
        Native libraries by platform; that of this machine if left out.
    flat : bool
        Whether names of variables have no dots.

    Raises
    ------
    SceneError
        If the name is no C identifier.
    """
    about = about_hammer(scene, path, flat)
    variables = hammer_variables(scene)
    bundle = stage("percussive_hammer", "hammer", with_model=True)
    identity = [bundle.name, [variable.name for variable in variables]]
    resources: dict[str, str | bytes] = {
        FILE: write_variables(variables),
        # what an instance needs of the scene, besides its variables
        "scene.json": to_json({"given": scene.given_values(), "identity": identity}),
    }
    model = None
    if not added_solvers():  # the library has the solvers of the package alone
        for name, library in (library_here() if libraries is None else libraries).items():
            resources[library_name(name)] = library
        model = functools.partial(model_tables, scene)
    page = write_page(about, variables, scene)
    return write_fmu(path, about, variables, bundle, PercussiveHammer, resources, page, model)


def refuse_other(path: Path, scene: Scene, force: bool = False) -> None:
    """Raise `SceneError` where a file holds the FMU of another scene, or no FMU of a scene.

    Parameters
    ----------
    force : bool
        Let it be replaced.
    """
    if path.is_dir():
        raise SceneError(f"{path}: is a folder; -o names the FMU, as {path / 'Hammer.fmu'}")
    if is_special(path):
        raise SceneError(f"{path}: is no regular file, and an FMU is read again once it is written")
    if force or not path.exists():
        return
    try:
        with zipfile.ZipFile(path) as archive:
            found = json.loads(archive.read(SCENE))
            same = found["given"] == json.loads(to_json(scene.given_values()))
    except (
        OSError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        RuntimeError,
        zipfile.BadZipFile,
        zlib.error,
    ):
        same = False
    if not same:
        raise SceneError(
            f"{path}: holds another FMU than that of this scene; --force replaces it, another -o "
            "keeps it"
        )


def hammer_name(scene: Path) -> str:
    """Name of the file for the FMU of a scene's file: that of the reference, or of its own."""
    stem = re.sub(r"\W", "", scene.stem.title().replace("_", ""))
    if not stem[:1].isalpha():
        stem = f"Scene{stem}"  # the name is an identifier
    return "PercussiveHammer.fmu" if stem == "Reference" else f"{stem}Hammer.fmu"


def about_hammer(scene: Scene, path: Path, flat: bool = False) -> About:
    """Head of the model description."""
    if path.suffix != ".fmu" or not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", path.stem):
        raise SceneError(
            f"{path.name}: an FMU is named by letters, digits and underscores, and ends with .fmu"
        )
    title = f": {scene.title}" if scene.title else ""
    return About(
        model=path.stem,
        description=f"Percussive drill, piston, bit and rock, blow by blow{title}",
        stop_time=scene.run.duration,
        step_size=min(STEP_SIZE, scene.run.duration),
        version=f"{version('percussion_model')}, interface {VERSION}",
        flat=flat,
    )
