"""Command `bench-controller`: a controller on the standard runs."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence
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
    ("violations", "beyond limits [s]", 1.0, "time beyond the limits of feed and torque"),
)
# Characters of the first two columns of the table.
NAME, POINTS = 10, 6


def bench_controller(
    controller: Annotated[
        str | None,
        typer.Argument(
            metavar="[FMU|FILE.py:NAME]",
            help="NAME of a function, a class or a factory. Left out: that of the archive.",
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
        typer.Option("--set", metavar="VARIABLE=VALUE", help="Set a variable of the controller."),
    ] = None,
    trust: common.Trust = False,
    out: common.Out = None,
    json_file: common.JsonFile = None,
    force: common.Force = False,
) -> int:
    """Put a controller of feed and pressure through standard runs: scores, figures, a page."""
    from percussion_model.interface.terminal import progress, progress_bar

    try:
        from percussion_model.coupling.bench import bench, mean_points
    except ImportError as error:
        return common.print_message(common.needs_extra(error, "fmu"), common.BAD_INPUT)
    common.check_json(json_file)
    values = dict(read_value(f"controller.{text}") for text in settings or ())
    source = None if controller is None else Path(_file_and_name(controller)[0])
    claimed = common.claim(
        "bench-controller", out, Path("out") / "bench-controller", force,
        system=common.digest(system), controller=controller, file=common.digest(source),
        set=common.by_name(settings), trials=sorted(trials or ()),
    )  # fmt: skip
    scores: list[Score] = []
    interrupted = False

    try:
        with progress_bar(0.0) as bar:
            bench(system, _load(controller), values, trials or (), scores.append, trust, watch=bar)
    except KeyboardInterrupt:
        if not scores:
            raise
        interrupted = True
    points = mean_points(scores)
    listed = [
        {"trial": s.trial, "points": s.points, "error": s.error, "faults": s.faults, **s.numbers}
        for s in scores
    ]
    common.write_json(json_file, {"points": points, "trials": listed})
    if json_file != "-":
        for line in _table(scores, points):
            typer.echo(line)
    for score in scores:
        for fault in score.faults:
            common.print_message(f"{score.trial} {'' if score.error else 'failed: '}{fault}")
    try:
        from percussion_model.interface.bench_page import write_bench_page
    except ImportError as error:
        common.print_message(common.needs_plot_extra(error))
    else:
        title = controller or system.stem
        with progress("drawing the page"):
            page = write_bench_page(scores, points, COLUMNS, claimed.folder, title)
        common.list_files([page, claimed.sign()])
    if interrupted:
        return common.print_message(
            f"interrupted: the page has the {len(scores)} runs that were done", common.INTERRUPTED
        )
    return 1 if any(score.faults for score in scores) else 0


def _table(scores: Sequence[Score], points: float) -> list[str]:
    """Lines of the table: heading, runs, mean."""
    lines = _heading()
    for score in scores:
        numbers = [_short(factor * score.numbers[name]) for name, _, factor, _ in COLUMNS]
        lines.append(f"{score.trial:{NAME}s}{score.points:{POINTS}.1f}{_cells(numbers)}")
    return [*lines, f"{'mean':{NAME}s}{points:{POINTS}.1f}"]


def _heading() -> list[str]:
    """Lines of the heading: words of the columns one below the other, units last."""
    heads = [head.split() for _, head, _, _ in COLUMNS]
    depth = max(map(len, heads))
    lines = []
    for k in range(depth):
        words = [head[k - depth + len(head)] if k >= depth - len(head) else "" for head in heads]
        first = f"{'run':{NAME}s}{'points':>{POINTS}s}" if k == depth - 1 else " " * (NAME + POINTS)
        lines.append(first + _cells(words))
    return lines


def _cells(texts: Sequence[str]) -> str:
    """Right-aligned texts, each as wide as the longest word of its heading, and a space."""
    widths = (max(map(len, head.split())) + 1 for _, head, _, _ in COLUMNS)
    return "".join(f"{text:>{width}s}" for text, width in zip(texts, widths, strict=True))


def _short(value: float) -> str:
    """Three digits, two decimals at most, in five characters."""
    if abs(value) >= 99999.5:
        return f"{value:.0e}".replace("e+0", "e").replace("e+", "e")
    return f"{float(f'{value:.3g}'):.2f}".rstrip("0").rstrip(".")


def _file_and_name(controller: str) -> tuple[str, str]:
    """File and name of FILE.py:NAME; an FMU has no name."""
    file, _, name = controller.rpartition(":")
    return (file, name) if file.endswith(".py") else (controller, "")


def _load(controller: str | None) -> Any:
    """Path of an FMU, or what loads FILE.py afresh for a run and gives its NAME."""
    from percussion_model.coupling import CouplingError
    from percussion_model.coupling.fresh import fresh

    if controller is None:
        return None
    file, name = _file_and_name(controller)
    if not Path(file).is_file():
        raise CouplingError(f"{file}: no such file")
    if not name:
        return Path(file)

    def anew() -> Callable[..., Any]:
        # what the file keeps by itself, in globals as well, is left behind with its module
        spec = importlib.util.spec_from_file_location("bench_controller_of_user", file)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        work: Callable[..., Any] | None = getattr(module, name, None)
        if not callable(work):
            raise CouplingError(f"{file} has no function or class {name}")
        return fresh(name, work, is_new=True)

    return anew
