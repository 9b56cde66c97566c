"""Variables of the hammer's FMU, built of the reference scene and read as any tool would."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from fmpy import read_model_description

from docs.blocks import Made
from fmu_src.hammer.build import build_hammer
from percussion_model.scene.scene import Scene
from percussion_model.simulation.markdown import table

HEADINGS = ("name", "unit", "shown in", "start", "range", "meaning", "reference")
HEADS = {"input": "Inputs", "output": "Outputs", "parameter": "Parameters"}


def tables() -> str:
    """Tables of inputs, outputs and parameters, Markdown."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "PercussiveHammer.fmu"
        build_hammer(Scene(), path)
        variables = read_model_description(str(path)).modelVariables
    parts = []
    for causality, head in HEADS.items():
        rows = [_cells(one) for one in variables if one.causality == causality]
        parts.append(f"## {head}\n\n{table(HEADINGS, rows)}\n")
    return "\n".join(parts).rstrip()


def _cells(one: Any) -> tuple[str, ...]:
    span = f"{float(one.min):.4g} … {float(one.max):.4g}" if one.min is not None else "true, false"
    start = one.start or ""
    if one.type == "Enumeration":
        names = {int(item.value): item.name for item in one.declaredType.items}
        span = ", ".join(f"{value} {name}" for value, name in names.items())
        start = names[int(start)] if start else ""
    elif start and one.type == "Real":
        start = f"{float(start):.10g}"
    text = one.description.replace("|", "\\|")
    unit, display = one.unit or "", one.displayUnit or ""
    return (f"`{one.name}`", unit, display, start, span, text, str(one.valueReference))


def made() -> Made:
    """The tables."""
    return Made(("data/fmu_interface.md",), {"variables": tables})
