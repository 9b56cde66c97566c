"""The table of blows that an FMU of the hammer may bring along."""

from __future__ import annotations

import functools
from pathlib import Path

from percussion_model.solvers.blow_map.table import BlowTable

NO_MAP = (
    'solver.fidelity = "blow-map": this FMU brings no blow map; build it with --blow-map, or of a '
    'scene with solver.fidelity = "blow-map"'
)


def read_blow_map(folder: str) -> BlowTable:
    """Table of blows that the FMU in a folder brings along; instances share one.

    Raises
    ------
    ValueError
        If there is none.
    """
    path = Path(folder) / "blow_map.npz"
    if not path.is_file():
        raise ValueError(NO_MAP)
    stamp = path.stat()
    return _read(path, stamp.st_mtime_ns, stamp.st_size)


@functools.lru_cache(maxsize=8)
def _read(path: Path, changed: int, size: int) -> BlowTable:
    """Table in a file as it was at a time: hosts may unpack another FMU into the same folder."""
    return BlowTable.from_bytes(path.read_bytes())
