"""Columns of outputs and commands, from the code."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable

from docs.blocks import Made
from percussion_model.analysis.study.response import FOUND, KINDS
from percussion_model.physics.records import (
    BLOW_COLUMNS,
    EVENT_COLUMNS,
    SAMPLE_COLUMNS,
    Column,
    EventKind,
    Mode,
)
from percussion_model.simulation.columns import ENERGY_COLUMNS, SUMMARY_COLUMNS
from percussion_model.simulation.markdown import table

STUDY_ONLY = (
    Column("kind", "", f"what the motion is: {', '.join(KINDS)}"),
    Column("order", "", "blows after which the motion repeats"),
    Column("blows", "", "blows that were run"),
    Column("wall_time", "s", "computing time of the point"),
)
OF_THE_CYCLE = {
    "multiplier": "stability multiplier: share of a deviation left after one cycle; below 1: "
    "stable",
}


def study_columns() -> tuple[Column, ...]:
    """Columns of a study; most are called as in a summary and mean the same."""
    known = {column.name: column.meaning for column in SUMMARY_COLUMNS} | OF_THE_CYCLE
    units = {name: "" if unit == "-" else unit for name, unit in FOUND.items()}
    return tuple(Column(name, units[name], known[name]) for name in FOUND) + STUDY_ONLY


def listed(columns: Iterable[Column]) -> str:
    """Columns as a table in Markdown."""
    rows = [(f"`{one.name}`", one.unit, one.meaning) for one in columns]
    return table(("name", "unit", "meaning"), rows)


def numbers(kinds: Iterable[Mode | EventKind]) -> str:
    """Numbers of an enumeration as a list of words."""
    return ", ".join(f"{kind.value} {kind.name}" for kind in kinds)


def outputs() -> str:
    """A table for each kind of output."""
    parts = {
        "Summary": "`summary.json`, `--json`, `Result.summary()`. Means are over the counted "
        "blows.\n\n" + listed(SUMMARY_COLUMNS),
        "Blows": "`blows.csv`, `Result.blows`: a row for each whole blow.\n\n"
        + listed(BLOW_COLUMNS),
        "Events": "`events.csv`, `Result.events`. In the file the kind is a word, in Python a "
        f"number: {numbers(EventKind)}.\n\n" + listed(EVENT_COLUMNS),
        "Samples": "`trace.csv` or `trace.npz` (`--trace`), `Result.trace`, "
        f"`Simulation.observe()`. Modes of the rock law: {numbers(Mode)}.\n\n"
        + listed(SAMPLE_COLUMNS),
        "Energy ledger": "`energy` in a summary. [The model, section 8](../model.md) shows how "
        "the entries add up.\n\n" + listed(ENERGY_COLUMNS),
        "Points of a study": "`points.csv`, `points.nc` and, with pyarrow, `points.parquet` of "
        "`percussion study`, beside the parameters that vary.\n\n" + listed(study_columns()),
    }
    return "\n".join(f"## {head}\n\n{text}\n" for head, text in parts.items()).rstrip()


def command_line() -> str:
    """What each command takes, which typer tells."""
    told = subprocess.run(
        [
            *(sys.executable, "-m", "typer", "fmu_src.command_line"),
            *("utils", "docs", "--name", "percussion"),
        ],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    return told.removeprefix("# `percussion`\n\n").replace("```console", "```text").rstrip()


def made() -> Made:
    """Both pages."""
    pages = ("reference/outputs.md", "reference/command_line.md")
    return Made(pages, {"outputs": outputs, "commands": command_line})
