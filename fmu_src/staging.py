"""The sources that an FMU brings along, under names that hold a hash of their contents.

Two FMUs in one process share `sys.modules`; with such names each runs its own code,
and equal code is loaded and compiled once.
"""

from __future__ import annotations

import hashlib
import importlib
import re
from dataclasses import dataclass
from pathlib import Path

import pythonfmu

import fmu_src
import percussion_model
from percussion_model.scene.solver_names import BODIES
from percussion_model.solvers.base import added_solvers

PLACEHOLDER = "__BUNDLE__"
MODEL = Path(percussion_model.__file__).parent
ADAPTERS = Path(fmu_src.__file__).parent
LIBRARY = Path(pythonfmu.__file__).parent

# What computes, and nothing that plots, reads files or needs more than numpy and numba.
MODEL_FILES = (
    "__init__.py",
    "components/*.py",
    "engine/*.py",
    "engine/*.[ch]",
    "physics/**/*.py",
    "scene/*.py",
    "simulation/__init__.py",
    "simulation/runner.py",
    "simulation/validity.py",
    "solvers/**/*.py",
)
# What parts take of it.
PART_FILES = (
    "__init__.py", "scene/__init__.py", "scene/rows.py", "scene/retired.py",
    "analysis/__init__.py",
    *(f"analysis/identify/{name}.py" for name in ("__init__", "filter", "observation", "part")),
)  # fmt: skip
LIBRARY_FILES = (
    "_version.py",
    "default_experiment.py",
    "enums.py",
    "fmi2slave.py",
    "logmsg.py",
    "variables.py",
)
# What every slave needs; START runs outside the package that the sources become.
SLAVE_FILES = ("__init__.py", "flat_names.py", "variables.py", "slave/*.py")
START = "slave/start.py"
# Files of a model's folder that make its FMU and do not run in it.
BUILD_FILES = ("build.py", "variables.py")

# Where a bundle registers solvers that are not a part of the package.
SOLVERS = "percussion_model/solvers/__init__.py"

_IMPORT = re.compile(
    r"^(?P<before>\s*(?:from|import) )(?P<package>percussion_model|fmu_src|pythonfmu)\b",
    re.MULTILINE,
)


@dataclass(frozen=True)
class Bundle:
    """Sources for an FMU.

    Attributes
    ----------
    name : str
        Package that holds them.
    files : dict of str
        Text by path within `resources`.
    """

    name: str
    files: dict[str, str]


def stage(prefix: str, folder: str, with_model: bool) -> Bundle:
    """Collect sources and give them their names.

    Parameters
    ----------
    prefix : str
        Beginning of the package's name.
    folder : str
        Folder of `fmu_src` with what runs in the FMU, besides the files of every slave.
    with_model : bool
        Whether all of what computes is wanted, or the parameter rows alone.
    """
    inner = {"__init__.py": f'"""{prefix}: sources of an FMU."""\n'}
    for pattern in (*SLAVE_FILES, f"{folder}/*.py"):
        for source in sorted(ADAPTERS.glob(pattern)):
            path = source.relative_to(ADAPTERS).as_posix()
            if path != START and not (pattern.startswith(folder) and source.name in BUILD_FILES):
                inner[f"fmu_src/{path}"] = _read(source)
    patterns = MODEL_FILES if with_model else PART_FILES
    for pattern in patterns:
        for source in sorted(MODEL.glob(pattern)):
            inner[f"percussion_model/{source.relative_to(MODEL).as_posix()}"] = _read(source)
    if with_model:
        inner |= _added_solvers(inner[SOLVERS])
    inner["pythonfmu/__init__.py"] = "from .fmi2slave import Fmi2Slave\n"
    for name in LIBRARY_FILES:
        inner[f"pythonfmu/{name}"] = _read(LIBRARY / name)
    inner = {
        path: _IMPORT.sub(rf"\g<before>{PLACEHOLDER}.\g<package>", text)
        for path, text in inner.items()
    }
    start = _read(ADAPTERS / START)
    digest = hashlib.sha256()
    for path, text in sorted({**inner, START: start}.items()):
        digest.update(f"{path}\0{text}\0".encode())
    name = f"{prefix}_{digest.hexdigest()[:16]}"
    files = {f"{name}/{path}": text for path, text in inner.items()}
    files[f"{name}_start.py"] = start
    return Bundle(name, {path: text.replace(PLACEHOLDER, name) for path, text in files.items()})


def _added_solvers(text: str) -> dict[str, str]:
    """Sources of solvers that were registered from outside, and what registers them again.

    Parameters
    ----------
    text : str
        Of the module that does so.
    """
    found = {}
    for name, entry in added_solvers().items():
        source = Path(importlib.import_module(entry.module).__file__ or "")
        found[f"{Path(SOLVERS).parent.as_posix()}/{source.name}"] = _read(source)
        text += (
            "from percussion_model.solvers.base import register\n"
            f'register("{name}", __name__ + ".{source.stem}", "{entry.factory}", '
            f"{BODIES.get(name)!r})\n"
        )
    return found | {SOLVERS: text}


def script(bundle: Bundle, slave: type) -> tuple[str, str]:
    """Name and text of the script that the export library runs for each instance."""
    class_name = slave.__name__
    name = f"{bundle.name}_{class_name.lower()}"
    return name, (
        f'"""Loads {class_name}; run anew for each instance, and therefore short."""\n'
        f"import {bundle.name}_start\n"
        f"{class_name} = {bundle.name}_start.slave_class("
        f'globals(), "{slave.__module__}", "{class_name}")\n'
    )


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8")
