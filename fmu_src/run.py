"""A run of an FMU by fmpy, unpacked where FMUs of pythonfmu understand the path; its signals."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from fmpy import extract, read_model_description, simulate_fmu

from percussion_model.coupling.unpack import new_folder
from percussion_model.scene.writing import write_whole
from percussion_model.simulation.files import csv_text

DURATION = 0.5  # of reference signals [s]
STEP_SIZE = 1e-3  # [s]


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


def write_reference(path: Path) -> list[Path]:
    """Run an FMU as it is; write `<name>_in.csv` and `<name>_ref.csv`, as the cross-check had them.

    Returns
    -------
    list of Path
        The files.
    """
    variables = read_model_description(str(path)).modelVariables
    inputs = [one for one in variables if one.causality == "input"]
    signals = {"time": [0.0, DURATION]}
    for one in inputs:
        signals[one.name] = [1.0 if one.start == "true" else float(one.start)] * 2
    result = run_fmu(path, stop_time=DURATION, step_size=STEP_SIZE, output_interval=STEP_SIZE)
    found = {name: result[name].astype(float) for name in result.dtype.names}
    files = []
    for end, columns in (("in", signals), ("ref", found)):
        files.append(path.with_name(f"{path.stem}_{end}.csv"))
        write_whole(files[-1], csv_text(columns, quoted=True))
    return files
