"""Command `bench-controller`: a controller on the standard runs."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any
from zipfile import is_zipfile

import typer

from percussion_model.interface.commands import common
from percussion_model.interface.commands.couple import read_value
from percussion_model.simulation.interruption import interruptible

if TYPE_CHECKING:
    from percussion_model.coupling.bench import Score


def bench_controller(
    controller: Annotated[
        str | None,
        typer.Argument(
            metavar="[FMU|FILE.py:NAME]",
            help="NAME of a function, a class or a factory. Default: that of the archive.",
        ),
    ] = None,
    system: Annotated[
        Path, typer.Option("--system", help="Archive of the feed-controlled system.")
    ] = Path("dist/FeedControlRigid.ssp"),
    trials: Annotated[
        list[str] | None, typer.Option("--trial", help="One of the runs; may be repeated.")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="VARIABLE=VALUE",
            help="Set a variable of the controller, or an argument of a class or factory.",
        ),
    ] = None,
    step_check: Annotated[
        bool,
        typer.Option(
            help="Do each run with half the communication step too, for the errors of the scores."
        ),
    ] = True,
    trust: common.Trust = False,
    out: common.Out = None,
    json_file: common.JsonFile = None,
    force: common.Force = False,
) -> int:
    """Put a controller of feed and pressure through standard runs: scores, figures, a page."""
    from percussion_model.interface.progress import progress, progress_bar

    with common.needing("fmu"):
        from percussion_model.coupling.bench import STEP, bench, mean_points, mean_points_error
    common.check_json(json_file)
    values = dict(read_value(f"controller.{text}") for text in settings or ())
    own = {name.partition(".")[2]: value for name, value in values.items()}
    given = _load(controller, own)
    of_fmu = {} if callable(given) else values
    source = None if controller is None else Path(file_and_name(controller)[0])
    claimed = common.claim(
        "bench-controller", out, Path("out") / "bench-controller", force,
        system=common.digest(system), controller=controller, file=common.digest(source),
        set=common.by_name(settings), trials=sorted(trials or ()), step_check=step_check,
    )  # fmt: skip
    scores: list[Score] = []
    interrupted = False

    try:
        with interruptible(), progress_bar(0.0) as bar:
            bench(
                system, given, of_fmu, trials or (), scores.append, trust, bar,
                check_step=step_check, tell=common.print_message,
            )  # fmt: skip
    except KeyboardInterrupt:
        if not scores:
            raise
        interrupted = True
    listed = [
        {"trial": s.trial, "points": s.points, "points_error": s.points_error, "error": s.error,
         "faults": s.faults, "doubt": s.doubt, **s.numbers, "errors": s.errors}
        for s in scores
    ]  # fmt: skip
    found = {"points": mean_points(scores), "points_error": mean_points_error(scores)}
    common.write_json(json_file, {**found, "step": STEP, "trials": listed})
    if json_file != "-":
        _show(scores)
    for score in scores:
        for fault in score.faults:
            common.print_message(f"{score.trial} {'' if score.error else 'failed: '}{fault}")
        if score.doubt:
            common.print_message(
                f"{score.trial}: {score.doubt}, so whether it does is not known with this step"
            )
    with common.if_drawable():
        with progress("drawing the figures"):
            # to load what draws takes its time too
            from percussion_model.interface.bench_page import write_bench_page

            page = write_bench_page(scores, claimed.folder, controller or system.stem)
        common.list_files([page, claimed.sign()])
    if interrupted:
        return common.print_message(
            f"interrupted: the page has the {len(scores)} runs that were done", common.INTERRUPTED
        )
    return 1 if any(score.faults for score in scores) else 0


def _show(scores: Sequence[Score]) -> None:
    """Print the table of the runs, their mean, and what the errors are."""
    from rich.markup import escape

    from percussion_model.interface.bench_text import (
        COLUMNS,
        about_columns,
        about_errors,
        about_runs,
        cells,
        mean_text,
        points_text,
    )
    from percussion_model.interface.tables import airy_table, print_notes, print_table

    heads = [escape(head.replace(" [", "\n[")) for _, head, _, _ in COLUMNS]
    table = airy_table(["run", "points", *heads], ["run"], pad_edge=False, header_style="")
    for column in table.columns:
        column.vertical = "bottom"
    for score in scores:
        table.add_row(score.trial, points_text(score.points, score.points_error), *cells(score))
    print_table(table)
    mean = f"mean of the points: {mean_text(scores)} of 100"
    print_notes([mean, about_runs(scores), about_columns(), about_errors(scores)])


def file_and_name(controller: str) -> tuple[str, str]:
    """File and name of FILE.py:NAME; an FMU has no name."""
    file, _, name = controller.rpartition(":")
    return (file, name) if file.endswith(".py") else (controller, "")


def _load(controller: str | None, values: Mapping[str, Any]) -> Any:
    """Path of an FMU, or what loads FILE.py afresh for a run and makes its NAME with values."""
    from percussion_model.coupling import CouplingError
    from percussion_model.coupling.fresh import fresh, with_values
    from percussion_model.coupling.python_part import fault_text

    if controller is None:
        return None
    file, name = file_and_name(controller)
    if not Path(file).is_file():
        raise CouplingError(f"{file}: no such file")
    if not name:
        if file.endswith(".py"):
            raise CouplingError(f"{file}: which function or class of it? give {file}:NAME")
        if not is_zipfile(file):
            raise CouplingError(f"{file}: is neither an FMU nor FILE.py:NAME")
        return Path(file)

    def anew() -> Callable[..., Any]:
        # what the file keeps by itself, in globals as well, is left behind with its module
        spec = importlib.util.spec_from_file_location("bench_controller_of_user", file)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
        except (Exception, SystemExit) as error:
            raise CouplingError(f"{file}: cannot be loaded: {fault_text(error)}") from error
        work: Callable[..., Any] | None = getattr(module, name, None)
        if not callable(work):
            raise CouplingError(f"{file} has no function or class {name}")
        return fresh(file, with_values(work, values) if values else work, is_new=True)

    return anew
