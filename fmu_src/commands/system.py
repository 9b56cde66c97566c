"""Command `system`: drilling systems of FMUs as SSP archives."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fmu_src.commands import options
from percussion_model.interface.commands import common

INVALID = 1


def system(
    systems: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="SYSTEM",
            help="Files (TOML), or presets, as FeedControlRigid; left out: all of the presets.",
        ),
    ] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder for all files.")
    ] = options.DIST,
    force: Annotated[bool, typer.Option("--force", help="Replace FMUs of other hammers.")] = False,
) -> int:
    """Build drilling systems of FMUs as SSP archives, and validate each FMU."""
    with common.needing("fmu"), options.refusing_faults():
        from fmpy.validation import validate_fmu

        from fmu_src.archive import content, state_of
        from fmu_src.native.library import COMPILING, library_here
        from fmu_src.system.archive import build_fmus, find_plan, plans, write_system
        from percussion_model.interface.progress import progress

        common.load_numba()
        problems = 0
        checked = set()
        chosen = [find_plan(path) for path in systems or ()] or plans()
        common.check_outputs(output, None)
        if not systems:
            names = ", ".join(plan.name for plan in chosen)
            common.print_message(f"no system is named, so all {len(chosen)} are built: {names}")
        with progress(COMPILING):
            library_here()
        for number, plan in enumerate(chosen, 1):
            of_all = f" ({number} of {len(chosen)})" if len(chosen) > 1 else ""
            before = {path: content(path) for path in output.glob("*.*")}
            with progress(f"building {plan.name}{of_all}"):
                fmus = build_fmus(plan, output, force)
            for fmu in fmus.values():
                if fmu in checked:
                    continue
                checked.add(fmu)
                with progress(f"validating {fmu.name}"):
                    found = validate_fmu(str(fmu))
                valid = "valid" if not found else "; ".join(found)
                typer.echo(f"{fmu}: {state_of(fmu, before.get(fmu))}, {valid}")
                problems += len(found)
            path = write_system(plan, fmus, output / f"{plan.name}.ssp")
            typer.echo(f"{path}: {state_of(path, before.get(path))}")
        return INVALID if problems else 0
