"""Command `native`: a scene as FMUs of FMI 2.0 and 3.0 that need no Python."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fmu_src.commands import options
from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from fmu_src.parts.part import PartTable


def native(
    scene: Annotated[
        Path | None,
        typer.Argument(
            metavar="SCENE",
            help="A scene file, a preset, or a part of a system, as RigFeed. Default: reference.",
        ),
    ] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder for both FMUs.")
    ] = options.DIST,
    platforms: options.Platforms = None,
    flat_names: options.FlatNames = False,
    force: options.Force = False,
    rock: common.RockName = None,
    bit: common.BitName = None,
    scene_option: options.BakedToo = None,
) -> None:
    """Bake a scene, or a part, into FMUs that need no Python, of FMI 2.0 and 3.0.

    Other platforms than this one need the package ziglang (the extra native).
    """
    with common.needing("fmu"), options.refusing_faults():
        from fmu_src.archive import content, state_of
        from fmu_src.hammer.build import refuse_other
        from fmu_src.native.build import build_native, native_files
        from fmu_src.native.library import COMPILING, libraries, platform_names
        from fmu_src.parts.build import PARTS
        from fmu_src.slave.native import this_platform
        from percussion_model.interface.progress import progress

        if output.suffix == ".fmu":
            raise common.refusal(
                f"-o {output}: must be a folder, which two FMUs go to, of FMI 2.0 and of FMI 3.0"
            )
        names = platform_names((platforms or this_platform()).split(","))
        part = PARTS.get(str(scene))
        if part is not None and part.law is not None:
            if rock or bit:
                raise common.refusal(f"{part.name}: is no hammer: omit --rock and --bit")
            _write_part(part, output, names, flat_names)
            return
        _refuse_misspelt_part(scene)
        file, chosen = options.baked_scene(scene, scene_option, rock, bit)
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


def _refuse_misspelt_part(scene: Path | None) -> None:
    """Say which part was meant, if a name is near one and is no scene."""
    from fmu_src.parts.build import PARTS
    from percussion_model.scene.presets import scene_presets
    from percussion_model.scene.rows import nearest

    name = str(scene or "")
    known = [part.name for part in PARTS.values() if part.law is not None]
    meant = nearest(name, known) if name and name not in scene_presets() else ""
    if meant and not Path(name).exists():
        raise common.refusal(f"{name}: is no scene and no part: did you mean {meant}?")


def _write_part(part: PartTable, output: Path, names: Mapping[str, str], flat: bool) -> None:
    """Write both FMUs of a part of a system."""
    from fmu_src.archive import content, state_of
    from fmu_src.native.build import SUFFIXES
    from fmu_src.native.library import COMPILING, PARTS, libraries
    from fmu_src.parts.build import build_part
    from percussion_model.interface.progress import progress

    common.check_outputs(output, None)
    with progress(COMPILING):
        libraries(names, which=PARTS)
    for version, suffix in SUFFIXES.items():
        path = output / f"{part.name}{suffix if version == '3.0' else ''}.fmu"
        before = content(path)
        guid = build_part(part, path, flat, version, names)
        typer.echo(f"{path} {{{guid}}}: {state_of(path, before)}")
