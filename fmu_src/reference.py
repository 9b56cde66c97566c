"""Reference signals beside an FMU, as the cross-check of FMI had them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from fmpy import read_model_description

from fmu_src.run import run_fmu
from percussion_model.scene.writing import write_whole

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
    names = np.array([one.name for one in inputs])
    starts = [1.0 if one.start == "true" else float(one.start) for one in inputs]
    signals = np.array([[0.0, *starts], [DURATION, *starts]])
    result = run_fmu(path, stop_time=DURATION, step_size=STEP_SIZE, output_interval=STEP_SIZE)
    inputs_file = path.with_name(f"{path.stem}_in.csv")
    reference_file = path.with_name(f"{path.stem}_ref.csv")
    _write(inputs_file, ["time", *names], signals)
    table = np.array([[float(value) for value in row] for row in result])
    _write(reference_file, list(result.dtype.names), table)
    return [inputs_file, reference_file]


def _write(path: Path, names: list[str], table: np.ndarray) -> None:
    header = ",".join(f'"{name}"' for name in names)
    lines = [header, *(",".join(repr(float(value)) for value in row) for row in table)]
    write_whole(path, "\n".join(lines) + "\n")
