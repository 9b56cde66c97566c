"""Command `bench-controller`: a controller on the standard runs."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from percussion_model.interface.commands import common
from percussion_model.interface.commands.couple import read_value

if TYPE_CHECKING:
    from percussion_model.coupling.bench import Score

# Name, head, factor, and what it is.
COLUMNS = (
    ("depth", "depth [mm]", 1e3, "of the bit at the end"),
    ("energy_per_metre", "energy [MJ/m]", 1e-6, "work of supply and rig by the depth"),
    ("feed_error", "feed error [%]", 100.0, "mean distance of the feed from what is wanted"),
    ("overshoot", "overshoot [%]", 100.0, "greatest feed above what is wanted"),
    ("swing", "swing [%]", 100.0, "half the range of the feed in the last second"),
    ("time_off_bottom", "off bottom [s]", 1.0, "time in which the shoulder is off the bit"),
    ("dry_blows", "dry blows", 1.0, "blows in a void with the bit or the shoulder off"),
    ("peak_force", "peak force [kN]", 1e-3, "greatest force of the rock on the bit"),
    ("violations", "violations [s]", 1.0, "time beyond the limits of feed and torque"),
)


def bench_controller(
    controller: Annotated[
        str | None,
        typer.Argument(metavar="[FMU|FILE.py:FUNCTION]", help="Left out: that of the archive."),
    ] = None,
    system: Annotated[
        Path, typer.Option("--system", help="Archive of the feed-controlled system.")
    ] = Path("dist/FeedControlRigid.ssp"),
    trials: Annotated[
        list[str] | None, typer.Option("--trial", help="One of the runs; may be repeated.")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="VARIABLE=VALUE", help="Set a variable of the controller."),
    ] = None,
    out: common.Out = None,
    json_file: common.JsonFile = None,
) -> int:
    """Put a controller of feed and pressure through standard runs: scores, figures, a page."""
    try:
        from percussion_model.coupling.bench import bench, total
    except ImportError as error:
        return common.print_message(common.needs_extra(error, "fmu"), common.BAD_INPUT)
    from percussion_model.simulation.files import check_writable

    folder = out or Path("out") / "bench-controller"
    check_writable(folder)
    common.check_json(json_file)
    values = dict(read_value(f"controller.{text}") for text in settings or ())
    scores: list[Score] = []
    interrupted = False

    def take(score: Score) -> None:
        scores.append(score)
        _show(score)

    try:
        bench(system, _load(controller), values, trials or (), take)
    except KeyboardInterrupt:
        if not scores:
            raise
        interrupted = True
    points = total(scores)
    listed = [
        {"trial": s.trial, "points": s.points, "error": s.error, "faults": s.faults, **s.numbers}
        for s in scores
    ]
    common.write_json(json_file, {"points": points, "trials": listed})
    print(f"{'total':10s} {points:6.1f}", file=sys.stderr)
    try:
        from percussion_model.interface.bench_page import write_bench_page
    except ImportError as error:
        common.print_message(common.needs_plot_extra(error))
    else:
        title = controller or system.stem
        print(write_bench_page(scores, points, COLUMNS, folder, title), file=sys.stderr)
    if interrupted:
        return common.print_message(
            f"interrupted: the page has the {len(scores)} runs that were done", common.INTERRUPTED
        )
    return 1 if any(score.faults for score in scores) else 0


def _show(score: Score) -> None:
    """One line for a run, and why it has failed."""
    numbers = "  ".join(f"{text} {factor * score.numbers[name]:.4g}"
                        for name, text, factor, _ in COLUMNS)  # fmt: skip
    print(f"{score.trial:10s} {score.points:6.1f}  {numbers}", file=sys.stderr)
    for fault in score.faults:
        common.print_message(f"{score.trial} {'' if score.error else 'failed: '}{fault}")


def _load(controller: str | None) -> Any:
    """Path of an FMU, or the function of FILE.py:FUNCTION."""
    from percussion_model.coupling import CouplingError

    if controller is None:
        return None
    file, colon, name = controller.rpartition(":")
    if not colon or not file.endswith(".py"):
        if not Path(controller).is_file():
            raise CouplingError(f"{controller}: no such file")
        return Path(controller)
    spec = importlib.util.spec_from_file_location("bench_controller_of_user", file)
    if spec is None or spec.loader is None or not Path(file).is_file():
        raise CouplingError(f"{file}: no such file")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    work: Callable[..., Any] | None = getattr(module, name, None)
    if not callable(work):
        raise CouplingError(f"{file} has no function {name}")
    return work
