"""Command `scenario`: the scripted scenarios that ship."""

from __future__ import annotations

import ast
import runpy
import sys
from pathlib import Path
from typing import Annotated

import typer

from fmu_src.commands import options
from percussion_model.interface.commands import common

# What follows the name is the script's own.
SETTINGS = {"ignore_unknown_options": True, "allow_interspersed_args": False}


def scenario(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="One of them. Default: a list of all.")
    ] = None,
    words: Annotated[
        list[str] | None,
        typer.Argument(metavar="WORDS", help="Arguments of that scenario: see --help after NAME."),
    ] = None,
) -> None:
    """Run a scripted scenario of FMUs, as layered rock, or list them."""
    from percussion_model.scene.presets import scenario_folder
    from percussion_model.scene.rows import said_among, shortened

    folder = scenario_folder()
    about = _scripts(folder)
    if name is None:
        options.list_choices(about)
        return
    if name not in about:
        raise common.refusal(
            f"scenario {shortened(name)}: there is none: {said_among(name, about)}"
        )
    sys.argv[1:] = words or []
    with common.needing("all"):
        runpy.run_module(f"{folder.name}.{name}", run_name="__main__", alter_sys=True)


def _scripts(folder: Path) -> dict[str, str]:
    """First lines of scripts by their names: modules that do something when they are run."""
    found = {}
    for file in sorted(folder.glob("*.py")):
        text = file.read_text(encoding="utf-8")
        if '__name__ == "__main__"' in text:
            line = (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]
            found[file.stem] = line.partition(": `")[0].rstrip(".")
    return found
