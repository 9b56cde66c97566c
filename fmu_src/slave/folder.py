"""What an instance takes from the folder of its FMU: variables, and the export library."""

from __future__ import annotations

import ctypes
import functools
import json
import sys
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from percussion_model.scene.rows import Row


@dataclass(frozen=True)
class Known:
    """What an instance must know of a variable; the rest is in the model description."""

    name: str
    reference: int
    type: str  # Real, Integer, Boolean or Enumeration
    causality: str  # parameter, input or output
    start: Any
    row: Row | None  # bounds of a parameter or an input
    key: str | None  # of the scene
    left_out: Any  # value that stands for "left out"


@functools.cache
def read_variables(folder: str) -> dict[int, Known]:
    """Variables of the FMU in a folder, by value reference."""
    rows = json.loads((Path(folder) / "variables.json").read_text(encoding="utf-8"))
    known = {}
    for entry in rows:
        row = entry.pop("row")
        if row is not None:
            row["choices"] = tuple(row["choices"])
            row["needs"] = {key: tuple(values) for key, values in row["needs"].items()}
        names = {field.name for field in fields(Known)} - {"row"}
        variable = Known(
            row=Row(**row) if row is not None else None,
            **{name: value for name, value in entry.items() if name in names},
        )
        known[variable.reference] = variable
    return known


@functools.cache
def finalise_in_time(folder: str) -> None:
    """Let the export library end before its own static variables do (Linux).

    Left alone, it finalises the same pointer twice at the end of the process.
    """
    if not sys.platform.startswith("linux"):
        return
    libraries = sorted((Path(folder).parent / "binaries" / "linux64").glob("*.so"))
    if not libraries:
        return
    library = ctypes.CDLL(str(libraries[0]))
    # by getattr, since a class would mangle a name of two underscores
    at_exit = getattr(ctypes.CDLL(None), "__cxa_atexit")
    at_exit(ctypes.cast(library.finalizePythonInterpreter, ctypes.c_void_p), None, None)
