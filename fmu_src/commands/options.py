"""Shared parts of the commands that make FMUs: options, and what is refused."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.scene.scene import Scene

DIST = Path("dist")
REFERENCE = Path("reference")

Baked = Annotated[
    Path | None,
    typer.Argument(metavar="SCENE", help="A scene file, or a preset. Default: reference."),
]
# How `build.py fmu` and `build.py native` have named it from the first.
BakedToo = Annotated[Path | None, typer.Option("--scene", hidden=True)]
FlatNames = Annotated[
    bool,
    typer.Option(
        "--flat-names",
        help="Underscores for dots in names of variables, of which Simulink makes buses.",
    ),
]
Platforms = Annotated[
    str | None,
    typer.Option(
        "--platforms",
        metavar="NAMES",
        help="Processors and systems, as linux64,win64,aarch64-linux. Default: this one.",
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Replace the FMU of another scene.")]


def baked_scene(
    named: Path | None, option: Path | None, rock: str | None = None, bit: str | None = None
) -> tuple[Path, Scene]:
    """File of the scene to bake, and the scene, with rock and bit that are asked for."""
    from percussion_model.scene.presets import scene_file
    from percussion_model.scene.scene import Scene

    if named is not None and option is not None:
        raise common.refusal(f"--scene {option}: a scene is given already, {named}")
    file = scene_file(named or option or REFERENCE)
    scene = common.with_bit(Scene.from_toml(file), bit)
    return file, scene.replace(**common.rock_changes(rock, scene))


def baked_from(
    named: Path | None, option: Path | None, rock: str | None = None, bit: str | None = None
) -> str:
    """Say which scene was baked, for the line that tells of the FMU."""
    chosen = named or option
    told = f"from the scene {chosen or REFERENCE}{'' if chosen else ', since none was named'}"
    added = [f"the {name} {one}" for name, one in (("rock", rock), ("bit", bit)) if one]
    return told + (f", with {' and '.join(added)}" if added else "")


def list_choices(about: Mapping[str, str]) -> None:
    """Print a line for each thing that can be chosen: its name, and what it is."""
    width = max(map(len, about))
    for name, text in about.items():
        typer.echo(f"{name:{width}s}  {text}")


@contextmanager
def refusing_faults() -> Iterator[None]:
    """Make one line of what the operating system refuses: a file, and why."""
    from fmu_src.archive import fault

    try:
        yield
    except OSError as error:
        raise common.refusal(fault(error)) from None
