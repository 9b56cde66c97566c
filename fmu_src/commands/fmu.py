"""Command `fmu`: a scene as an FMU of FMI 2.0 that runs by Python in its host."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fmu_src.commands import options
from percussion_model.interface.commands import common


def fmu(
    scene: options.Baked = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE.fmu",
            help="The FMU to write. Default: named after the scene, in dist.",
        ),
    ] = None,
    platforms: Annotated[
        str | None,
        typer.Option(
            "--platforms",
            metavar="NAMES",
            help=(
                "Platforms whose native libraries are included, as linux64,win64. Default: "
                "this one."
            ),
        ),
    ] = None,
    no_reference: Annotated[
        bool, typer.Option("--no-reference", help="Do not run it for _in.csv and _ref.csv.")
    ] = False,
    flat_names: options.FlatNames = False,
    force: options.Force = False,
    rock: common.RockName = None,
    bit: common.BitName = None,
    scene_option: options.BakedToo = None,
) -> None:
    """Bake a scene into an FMU for co-simulation, FMI 2.0, which runs Python.

    Its reference signals go beside it.
    """
    with common.needing("fmu"), options.refusing_faults():
        path = write_hammer(scene, output, platforms, force, scene_option, rock, flat_names, bit)
        if no_reference:
            return
        from fmu_src.run import write_reference
        from percussion_model.interface.progress import progress

        with progress("running the FMU; the first run compiles"):
            files = write_reference(path)
        for written in files:
            typer.echo(str(written))


def write_hammer(
    scene: Path | None = None,
    output: Path | None = None,
    platforms: str | None = None,
    force: bool = False,
    scene_option: Path | None = None,
    rock: str | None = None,
    flat_names: bool = False,
    bit: str | None = None,
) -> Path:
    """Write the FMU of a scene and say so; the parameters are those of `fmu`."""
    from fmu_src.archive import content, state_of
    from fmu_src.hammer.build import about_hammer, build_hammer, hammer_name, refuse_other
    from fmu_src.native.library import COMPILING, libraries, library_here
    from percussion_model.interface.progress import progress

    file, chosen = options.baked_scene(scene, scene_option, rock, bit)
    names = None if platforms is None else _export_platforms(platforms)
    path = output or options.DIST / hammer_name(file)
    about_hammer(chosen, path)  # refuses a name, before anything is compiled or --force offered
    refuse_other(path, chosen, force)
    check_fmu(output, path)
    with progress(COMPILING):  # for this platform, if there is a compiler, where none are named
        made = library_here() if names is None else libraries(names)
    before = content(path)
    with progress("building the FMU"):
        guid = build_hammer(chosen, path, made, flat_names)
    source = options.baked_from(scene, scene_option, rock, bit)
    typer.echo(f"{path} {{{guid}}}: {state_of(path, before)}, {source}")
    return path


def check_fmu(output: Path | None, path: Path) -> None:
    """Refuse a file that could not be written; the folder of one that is not named is made."""
    common.check_file("-o", output)
    common.check_outputs(path.parent if output is None else None, None)


def _export_platforms(words: str) -> dict[str, str]:
    """Platforms by their names, refused where the FMU could not start for lack of its frame."""
    from fmu_src.archive import export_platforms
    from fmu_src.native.library import ALIASES, platform_names

    names = platform_names(words.split(","))
    known = {ALIASES[word]: word for word in export_platforms() if word in ALIASES}
    for name, word in names.items():
        if name not in known:
            raise common.refusal(
                f"--platforms {word}: an FMU that runs Python is for {', '.join(known.values())}; "
                "`percussion native` makes those for others"
            )
    return names
