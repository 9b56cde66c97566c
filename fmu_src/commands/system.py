"""Command `system`: drilling systems of FMUs as SSP archives."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fmu_src.commands import options
from percussion_model.interface.commands import common

INVALID = 1
# The word for all that ship.
ALL = Path("all")


def system(
    systems: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="SYSTEM",
            help="Files (TOML), presets, as FeedControlRigid, or the word all for all presets; "
            "default: a list of them.",
        ),
    ] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder for all files.")
    ] = options.DIST,
    platforms: options.Platforms = None,
    flat_names: options.FlatNames = False,
    force: Annotated[bool, typer.Option("--force", help="Replace FMUs of other hammers.")] = False,
) -> int:
    """Build drilling systems of FMUs as SSP archives, and validate each FMU, or list them.

    The FMUs need no Python, but for a filter of the rock and what was added from outside. Other
    platforms than this one need the package ziglang (the extra native).
    """
    with common.needing("fmu"), options.refusing_faults():
        from fmpy.validation import validate_fmu

        from fmu_src.archive import content, state_of
        from fmu_src.native.library import COMPILING, OF, libraries, platform_names
        from fmu_src.slave.native import this_platform
        from fmu_src.system.archive import (
            build_fmus,
            find_plan,
            plans,
            with_flat_names,
            write_system,
        )
        from percussion_model.interface.progress import progress

        if not systems:
            options.list_choices({plan.name: plan.description for plan in plans()})
            return 0
        problems, names = 0, platform_names((platforms or this_platform()).split(","))
        checked = set()
        chosen = plans() if systems == [ALL] else [find_plan(path) for path in systems]
        common.check_outputs(output, None)
        with progress(COMPILING):
            for which in OF:
                libraries(names, which=which)
        for number, plan in enumerate(chosen):
            before = {path: content(path) for path in output.glob("*.*")}
            text, share = f"building {plan.name}", number / len(chosen)
            with progress(text, share) as report:
                if len(chosen) > 1:
                    report(f"{text} ({number + 1} of {len(chosen)})", share)
                fmus = build_fmus(plan, output, force, flat_names, names)
            for fmu in fmus.values():
                if fmu in checked:
                    continue
                checked.add(fmu)
                with progress(f"validating {fmu.name}"):
                    found = validate_fmu(str(fmu))
                valid = "valid" if not found else "; ".join(found)
                typer.echo(f"{fmu}: {state_of(fmu, before.get(fmu))}, {valid}")
                problems += len(found)
            plan = with_flat_names(plan, fmus) if flat_names else plan
            path = write_system(plan, fmus, output / f"{plan.name}.ssp")
            typer.echo(f"{path}: {state_of(path, before.get(path))}")
        return INVALID if problems else 0
