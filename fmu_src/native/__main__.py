"""Command line: `python -m fmu_src.native [--scene FILE] [-o FILE.fmu] [--platforms ...]`."""

from __future__ import annotations

import argparse
import functools
import sys
from pathlib import Path

from fmu_src.__main__ import DIST, REFERENCE
from fmu_src.archive import content, fault, state_of
from fmu_src.hammer.build import about_hammer, hammer_name
from fmu_src.native.archive import Version, write_native_fmu
from fmu_src.native.compare import refuse_difference
from fmu_src.native.library import libraries, platform_names
from fmu_src.native.reference_results import add_reference_results
from fmu_src.native.tables import model_tables
from fmu_src.run import run_fmu
from fmu_src.slave.native import this_platform
from percussion_model.interface.terminal import progress
from percussion_model.scene.scene import Scene, SceneError

# Files by version of FMI: what follows the name of the scene's FMU.
SUFFIXES: dict[Version, str] = {"2.0": "-native", "3.0": "-fmi3"}


def build(scene: Scene, path: Path, version: Version, platforms: dict[str, bytes]) -> str:
    """Write the native FMU of a scene, with reference results; return its GUID.

    Parameters
    ----------
    platforms : dict of bytes
        Libraries by platform.
    """
    # the name of the file is no identifier, that of the model is
    about = about_hammer(scene, path.with_name(f"{path.stem.partition('-')[0]}.fmu"))
    guid = write_native_fmu(
        path, version, about, scene, platforms, lambda guid: model_tables(scene, guid)
    )
    if this_platform() in platforms:
        refuse_difference(scene, path)
        add_reference_results(path, scene, functools.partial(run_fmu, path))
    return guid


def main(arguments: list[str]) -> int:
    """Build the FMUs of a scene that need no Python."""
    parser = argparse.ArgumentParser(
        prog="build.py native",
        description="Bake a scene into FMUs that need no Python, of FMI 2.0 and 3.0.",
    )
    parser.add_argument("--scene", type=Path, help="a scene file; left out: the reference")
    parser.add_argument(
        "-o", "--output", type=Path, help="folder to write them to; left out: dist/"
    )
    parser.add_argument(
        "--platforms", default=this_platform(),
        help="processors and systems, such as linux64,win64,aarch64-linux; left out: this one",
    )  # fmt: skip
    choice = parser.parse_args(arguments)
    try:
        file = choice.scene or REFERENCE
        scene = Scene.from_toml(file)
        names = platform_names(choice.platforms.split(","))
        with progress("compiling the library, which takes a few minutes the first time"):
            made = libraries(names)
        for version, suffix in SUFFIXES.items():
            stem = hammer_name(file).removesuffix(".fmu")
            path = (choice.output or DIST) / f"{stem}{suffix}.fmu"
            before = content(path)
            with progress(f"building the FMU of FMI {version}"):
                guid = build(scene, path, version, made)
            print(f"{path} {{{guid}}}: {state_of(path, before)}")
    except (SceneError, OSError) as error:
        print(f"error: {fault(error)}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
