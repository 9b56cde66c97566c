"""Signals of a coupled run as a file, and values from the command line."""

from __future__ import annotations

from pathlib import Path

from percussion_model.coupling.component import CouplingError
from percussion_model.coupling.coupled_run import CoupledRun
from percussion_model.simulation.files import staged_text


def write_columns(run: CoupledRun, path: Path) -> Path:
    """Write time and signals as CSV, with all digits."""
    names = list(run.columns)
    lines = [",".join(f'"{name}"' for name in names)]
    for row in zip(*(run.columns[name].tolist() for name in names), strict=True):
        lines.append(",".join(repr(value) for value in row))
    path.parent.mkdir(parents=True, exist_ok=True)
    staged_text(path, "\n".join(lines) + "\n")
    return path


def read_value(text: str) -> tuple[str, float | bool | str]:
    """Signal and value of `component.variable=value`; words are for enumerations."""
    signal, equals, value = text.partition("=")
    if not equals or "." not in signal or not value:
        raise CouplingError(f"--set {text}: must be COMPONENT.VARIABLE=VALUE")
    if value in ("true", "false"):
        return signal, value == "true"
    try:
        return signal, float(value)
    except ValueError:
        return signal, value


def read_pace(text: str) -> tuple[str, int]:
    """Component and steps of `component=steps`."""
    name, _, steps = text.partition("=")
    if not name or not steps.isdecimal():
        raise CouplingError(f"--every {text}: must be COMPONENT=STEPS, a whole number from 1")
    return name, int(steps)
