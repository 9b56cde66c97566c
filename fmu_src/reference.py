"""Reference signals beside an FMU, as the cross-check of FMI had them."""

from __future__ import annotations

from pathlib import Path

from fmpy import read_model_description

from fmu_src.run import run_fmu
from percussion_model.scene.writing import write_whole
from percussion_model.simulation.files import csv_text

DURATION = 0.5  # [s]
STEP_SIZE = 1e-3  # [s]


def write_reference(path: Path) -> list[Path]:
    """Run an FMU as it is and write `<name>_in.csv` and `<name>_ref.csv` beside it.

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
