"""Command `native`: a scene as FMUs of FMI 2.0 and 3.0 that need no Python."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fmu_src.commands import options
from percussion_model.interface.commands import common


def native(
    scene: options.Baked = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder for both FMUs.")
    ] = options.DIST,
    platforms: Annotated[
        str | None,
        typer.Option(
            "--platforms",
            metavar="NAMES",
            help="Processors and systems, as linux64,win64,aarch64-linux. Default: this one.",
        ),
    ] = None,
    flat_names: options.FlatNames = False,
    force: options.Force = False,
    rock: common.RockName = None,
    bit: common.BitName = None,
    scene_option: options.BakedToo = None,
) -> None:
    """Bake a scene into FMUs that need no Python, of FMI 2.0 and 3.0.

    Other platforms than this one need the package ziglang (the extra native).
    """
    with common.needing("fmu"), options.refusing_faults():
        from fmu_src.archive import content, state_of
        from fmu_src.hammer.build import refuse_other
        from fmu_src.native.build import build_native, native_files
        from fmu_src.native.library import COMPILING, libraries, platform_names
        from fmu_src.slave.native import this_platform
        from percussion_model.interface.progress import progress

        if output.suffix == ".fmu":
            raise common.refusal(
                f"-o {output}: must be a folder, which two FMUs go to, of FMI 2.0 and of FMI 3.0"
            )
        file, chosen = options.baked_scene(scene, scene_option, rock, bit)
        names = platform_names((platforms or this_platform()).split(","))
        files = native_files(file, output)
        for path in files.values():
            refuse_other(path, chosen, force)
        common.check_outputs(output, None)
        with progress(COMPILING):
            made = libraries(names)
        source = options.baked_from(scene, scene_option, rock, bit)
        for version, path in files.items():
            before = content(path)
            with progress(f"building the FMU of FMI {version}"):
                guid = build_native(chosen, path, version, made, flat_names)
            typer.echo(f"{path} {{{guid}}}: {state_of(path, before)}, {source}")
