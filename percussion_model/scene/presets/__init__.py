"""Scenes and systems that ship, by name: a file of that name comes first."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from percussion_model.scene.rows import SceneError, said_among, shortened, unprintable

# The folder lies beside the package: as it is installed, or in a clone.
_BESIDE = Path(__file__).resolve().parents[3]
_NAMES = ("percussion_scenarios", "scenarios")


def scenario_folder() -> Path:
    """Folder with the scenes, systems and scripted scenarios that ship.

    Raises
    ------
    SceneError
        If they were not installed.
    """
    for name in _NAMES:
        if (folder := _BESIDE / name).is_dir():
            return folder
    raise SceneError(f"{_BESIDE / _NAMES[0]}: there is no such folder; install percussion_model")


def scene_presets() -> dict[str, Path]:
    """Scenes that ship, by name."""
    folder = scenario_folder()
    return _by_name(
        [*folder.glob("*.toml"), *folder.glob("drawn/*.toml"), *folder.glob("hammers/*.toml")]
    )


def system_presets() -> dict[str, Path]:
    """Drilling systems that ship, by name."""
    return _by_name([*scenario_folder().glob("systems/*.toml")])


def scene_file(named: Path) -> Path:
    """Return the scene file that a user names: a file, or else a preset.

    Raises
    ------
    SceneError
        If it is a plain name, and neither.
    """
    try:
        return _file(named, "scene", scene_presets)
    except SceneError:
        from percussion_model.scene.hammers import hammers  # no scene that is there needs it

        if named.name in hammers():
            raise SceneError(
                f"{named}: is a hammer, and no scene: `percussion new {named}.toml --hammer "
                f"{named}` writes one"
            ) from None
        raise


def system_file(named: Path) -> Path:
    """Return the file of a system as `scene_file` does that of a scene."""
    return _file(named, "system", system_presets)


def _file(named: Path, kind: str, presets: Callable[[], dict[str, Path]]) -> Path:
    if named.suffix or named.name != str(named) or unprintable(str(named)):
        return named
    if os.path.isfile(named):  # unlike Path, it bears a name that is too long
        return named
    known = presets()
    if named.name in known:
        return known[named.name]
    if os.path.isdir(named):
        return named  # which its reader refuses
    raise SceneError(
        f"{shortened(str(named))}: there is no such {kind} file, and no preset of that name: "
        f"{said_among(named.name, known)}"
    )


def _by_name(files: list[Path]) -> dict[str, Path]:
    return {file.stem: file for file in sorted(files, key=lambda one: one.stem)}
