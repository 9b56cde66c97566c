"""The hammer's FMU, from a scene."""

from __future__ import annotations

import re
from importlib.metadata import version
from pathlib import Path

from fmu_src.archive import write_fmu
from fmu_src.description import About
from fmu_src.hammer.slave import PercussiveHammer
from fmu_src.hammer.variables import VERSION, hammer_variables
from fmu_src.page import write_page
from fmu_src.staging import stage
from fmu_src.variables import FILE, Variable, to_json, write_variables
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.solvers.blow_map.table import BlowTable, fixed_values

STEP_SIZE = 1e-3  # of the default experiment [s]


def build_hammer(scene: Scene, path: Path, blow_map: BlowTable | None = None) -> str:
    """Write the FMU of a scene; return its GUID.

    Parameters
    ----------
    blow_map : BlowTable, optional
        What `solver.fidelity = "blow-map"` needs; the FMU runs without it otherwise.
    path : Path
        Ends with `.fmu`; the rest of its name is the model identifier.

    Raises
    ------
    SceneError
        If the name is no C identifier.
    """
    about = about_hammer(scene, path)
    variables = hammer_variables(scene)
    bundle = stage("percussive_hammer", "hammer", with_model=True)
    resources: dict[str, str | bytes] = {
        FILE: write_variables(variables),
        "scene.json": to_json(_scene(scene, variables, bundle.name)),
    }
    if blow_map is not None:
        blow_map.refuse_other(fixed_values(scene))
        resources["blow_map.npz"] = blow_map.to_bytes()
    page = write_page(about, variables, scene)
    return write_fmu(path, about, variables, bundle, PercussiveHammer, resources, page)


def about_hammer(scene: Scene, path: Path) -> About:
    """Head of the model description."""
    if path.suffix != ".fmu" or not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", path.stem):
        raise SceneError(
            f"{path.name}: an FMU is named by letters, digits and underscores, and ends with .fmu"
        )
    title = f": {scene.title}" if scene.title else ""
    return About(
        model=path.stem,
        description=f"Percussive drill with travelling waves{title}",
        stop_time=scene.run.duration,
        step_size=min(STEP_SIZE, scene.run.duration),
        version=f"{version('percussion_model')}, interface {VERSION}",
    )


def _scene(scene: Scene, variables: list[Variable], bundle: str) -> dict[str, object]:
    """What an instance needs of the scene, besides its variables."""
    return {
        "given": scene.given_values(),
        "identity": [bundle, [variable.name for variable in variables]],
    }
