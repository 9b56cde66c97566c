"""The table of blows that an FMU of the hammer may bring along."""

from __future__ import annotations

import functools
from pathlib import Path

from percussion_model.solvers.blow_table import BlowTable


@functools.cache
def read_blow_map(folder: str) -> BlowTable:
    """Table of blows that the FMU in a folder brings along.

    Raises
    ------
    ValueError
        If there is none.
    """
    path = Path(folder) / "blow_map.npz"
    if not path.is_file():
        raise ValueError(
            'solver.fidelity = "blow-map": this FMU brings no blow map; build it with --blow-map'
        )
    return BlowTable.from_bytes(path.read_bytes())
