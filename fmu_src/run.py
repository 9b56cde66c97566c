"""A run of an FMU by fmpy, unpacked where FMUs of pythonfmu understand the path."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from fmpy import extract, simulate_fmu

from percussion_model.coupling.unpack import new_folder


def run_fmu(path: Path, **options: Any) -> Any:
    """Run an FMU.

    Parameters
    ----------
    **options
        Of `fmpy.simulate_fmu`.

    Returns
    -------
    ndarray
        What that returns.
    """
    folder = new_folder()
    try:
        extract(str(path), folder)
        return simulate_fmu(folder, **options)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
