"""Write docs/data/fmu_interface.md from a model description: `python -m docs.make_fmu_interface`.

The FMU of the reference scene is built for it, and read as any tool would.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from fmpy import read_model_description

from fmu_src.hammer.build import build_hammer
from percussion_model.scene.scene import Scene
from percussion_model.simulation.markdown import table

HEADINGS = ("name", "unit", "shown in", "start", "range", "meaning", "reference")
PAGE = Path(__file__).parent / "data" / "fmu_interface.md"
HEAD = """# Variables of the hammer's FMU

This page lists every input, output and parameter of the [FMU of the hammer](../fmu.md), with
unit, start value, bounds and value reference. The start values are those of the reference scene.
Units are SI; *shown in* is the display unit that a tool may choose. `.venv/bin/python -m
docs.make_fmu_interface` writes this page from a model description.
"""
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
    return "\n".join(parts)


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


def page() -> str:
    """Text of the page."""
    return f"{HEAD}\n{tables().rstrip()}\n"


if __name__ == "__main__":
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(page(), encoding="utf-8")
