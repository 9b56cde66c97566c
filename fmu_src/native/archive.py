"""Writes the FMUs that need no Python: the same inputs give the same bytes."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from fmu_src.archive import HERE, MODEL, SCENE, digest, licence, write_described
from fmu_src.description import NATIVE, About, write_description
from fmu_src.hammer.variables import hammer_variables
from fmu_src.native.description3 import write_description3
from fmu_src.native.library import ALIASES
from fmu_src.native.terminals import FOLDER, write_terminals
from fmu_src.native.variables3 import fmi3_variables
from fmu_src.page import NEEDS_NOTHING, write_page
from fmu_src.slave.native import SUFFIXES
from fmu_src.variables import Variable, to_json
from percussion_model.scene.scene import Scene

Version = Literal["2.0", "3.0"]
# FMI 2.0 has names of its own for x86, and takes those of FMI 3.0 for all others (2.0.5).
FMI2_PLATFORMS = {name: alias for alias, name in ALIASES.items()}


def write_native_fmu(
    path: Path,
    version: Version,
    about: About,
    scene: Scene,
    libraries: Mapping[str, bytes],
    model: Callable[[str], bytes],
) -> str:
    """Write the FMU of a scene and return its GUID, as `write_native` does."""
    variables = hammer_variables(scene)
    page = write_page(about, variables, scene, needs_nothing(libraries))
    # what nothing that runs reads: whose FMU this is
    files = {SCENE: to_json({"given": scene.given_values()}).encode()}
    if version == "3.0":
        files[f"{FOLDER}/terminalsAndIcons.xml"] = write_terminals(about.flat)
    return write_native(path, version, about, variables, page, libraries, model, files)


def needs_nothing(libraries: Mapping[str, bytes]) -> str:
    """What an FMU needs of its host, HTML."""
    return NEEDS_NOTHING.format(platforms=escape(", ".join(sorted(libraries))))


def write_native(
    path: Path,
    version: Version,
    about: About,
    variables: Sequence[Variable],
    page: str,
    libraries: Mapping[str, bytes],
    model: Callable[[str], bytes],
    files: Mapping[str, bytes] = MappingProxyType({}),
) -> str:
    """Write an FMU and return its GUID or instantiation token, without the braces.

    Parameters
    ----------
    version : str
        Of FMI.
    page : str
        Documentation, HTML.
    libraries : dict of str
        Libraries by platform, whose names are those of FMI 3.0 for both versions.
    model : callable
        Gives the tables for a GUID as hosts pass it, with its braces; it is asked for an empty
        one as well, whose tables are part of what the GUID is a hash of.
    files : dict of bytes, optional
        Further ones.
    """
    icon = (HERE / "icon.png").read_bytes()
    entries = {
        "documentation/index.html": page.encode(),
        "documentation/licenses/license.txt": licence(),
        MODEL: model(""),
        "model.png" if version == "2.0" else f"{FOLDER}/icon.png": icon,
        **files,
    }
    for platform, library in libraries.items():
        entries[library_path(version, platform, about.model)] = library
    contents = digest(entries)
    if version == "2.0":
        guid, xml = write_description(about, variables, contents, NATIVE)
    else:
        guid, xml = write_description3(about, variables, fmi3_variables(variables), contents)
    entries[MODEL] = model(f"{{{guid}}}")
    write_described(path, xml, entries)
    return guid


def library_path(version: Version, platform: str, model: str) -> str:
    """Where a library lies in the archive.

    Parameters
    ----------
    platform : str
        Processor and system as FMI 3.0 has them, such as `x86_64-linux`.
    """
    processor, _, system = platform.partition("-")
    if processor not in ("x86_64", "aarch64") or system not in SUFFIXES:
        raise ValueError(f"no platform of FMI 3.0 that is known here: {platform}")
    folder = FMI2_PLATFORMS.get(platform, platform) if version == "2.0" else platform
    return f"binaries/{folder}/{model}{SUFFIXES[system]}"


def add_files(path: Path, files: Mapping[str, bytes]) -> None:
    """Put files into an FMU, in the place of those of the same names."""
    with zipfile.ZipFile(path) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    xml = entries.pop("modelDescription.xml")
    write_described(path, xml, {**entries, **files})
