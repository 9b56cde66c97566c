"""Command `controller`: a controller in Python as an FMU, or in a drilling system."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from fmu_src.commands import options
from percussion_model.interface.commands import common

INVALID = 1


def controller(
    given: Annotated[
        str,
        typer.Argument(
            metavar="FILE.py:NAME", help="NAME of a class, a factory or a function of the file."
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="The FMU to write, or with --system the archive (SSP).",
        ),
    ],
    system: Annotated[
        Path | None,
        typer.Option(
            "--system",
            metavar="SYSTEM",
            help="A system (TOML), or a preset, as FeedControlRigid, whose controller is replaced.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
) -> int:
    """Make an FMU of your controller in Python, FMI 2.0, or a drilling system that it controls.

    Numbers that its class or factory can be given become parameters. The FMU runs Python, with
    the packages that the file imports.
    """
    from percussion_model.interface.commands.bench_controller import file_and_name

    named, name = file_and_name(given)
    file = Path(named)
    if not name:
        raise common.refusal(f"{given}: must be FILE.py:NAME, as my.py:PI")
    if not file.is_file():
        raise common.refusal(f"{file}: no such file")
    kind = ".fmu" if system is None else ".ssp"
    if output.suffix != kind or not output.stem.isidentifier():
        raise common.refusal(
            f"-o {output}: must be a file {kind}, named by letters, digits and underlines"
        )
    common.check_file("-o", output)
    common.refuse_existing(output, force)
    with common.needing("fmu"), options.refusing_faults():
        return _write(file, name, output, system)


def _write(file: Path, name: str, output: Path, system: Path | None) -> int:
    """Write the FMU, or the archive, and say what is in it."""
    from fmpy.validation import validate_fmu

    from fmu_src.archive import content, state_of
    from fmu_src.parts.build import build_controller
    from fmu_src.system.archive import find_plan, write_with_controller
    from percussion_model.interface.progress import progress

    plan = None if system is None else find_plan(system)
    before = content(output)
    with tempfile.TemporaryDirectory(prefix="percussion-") as folder:
        fmu = output if plan is None else Path(folder) / f"{output.stem}.fmu"
        kept = build_controller(file, name, fmu)
        found = validate_fmu(str(fmu))
        left = {}
        if plan is not None and not found:
            with progress(f"building {plan.name}"):
                left = write_with_controller(plan, fmu, Path(folder), output)
    told = "valid" if not found else "; ".join(found)
    typer.echo(f"{output}: {state_of(output, before)}, {told}, from {name} of {file}")
    if kept:
        common.print_message(
            f"an instance cannot save its state, since it keeps {kept}: masters that take steps "
            "back refuse it"
        )
    if left:
        values = ", ".join(f"{one} = {value}" for one, value in left.items())
        common.print_message(f"the controller has no {values} of {system}: omitted")
    return INVALID if found else 0
