"""Command `study`: the stationary response over a grid or a sample of parameters."""

from __future__ import annotations

import os
import time
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.interface.commands import common
from percussion_model.simulation.interruption import interruptible

if TYPE_CHECKING:
    from percussion_model.analysis.study import Points, Study
    from percussion_model.scene.scene import Scene

# Packages that write tables and grids; checked before hours of work, not after.
NEEDED = ("pandas", "xarray", "h5netcdf", "h5py", "threadpoolctl")

# From so many points on their cost is told before; to find it takes two of them.
MANY = 1000
# Units that a cost is told in [s].
TIMES = ((86400.0, "days"), (3600.0, "h"), (60.0, "min"), (1.0, "s"))


def study(
    scene: common.SceneFile,
    over: Annotated[
        list[str],
        typer.Option(
            "--over",
            metavar="KEY=FIRST:LAST:COUNT",
            help="Values of a parameter, in SI or with units; COUNTlog for even steps of its "
            "logarithm, or KEY=A,B,C. May be repeated: the study runs all combinations.",
        ),
    ],
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder; an interrupted study continues.")
    ],
    samples: Annotated[
        int | None,
        typer.Option("--samples", help="So many points of a Latin hypercube instead of the grid."),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Of the Latin hypercube.")] = 0,
    solver: common.SolverName = None,
    cells: common.Cells = None,
    settings: common.Settings = None,
    rock: common.RockName = None,
    bit: common.BitName = None,
    tolerance: common.Tolerance = 1e-4,
    scatter: Annotated[
        float,
        typer.Option(
            "--scatter", help="Relative standard error that is enough for aperiodic rates."
        ),
    ] = 1e-3,
    report: Annotated[bool, typer.Option(help="Write report.html as well.")] = True,
    processes: Annotated[
        int | None, typer.Option("--processes", min=1, help="On this machine; default: its cores.")
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option("--cluster", metavar="ADDRESS", help="Dask scheduler, as tcp://host:8786."),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace another study that is in the folder.")
    ] = False,
) -> None:
    """Map the stationary response over parameters: points.csv, .nc and .parquet."""
    from percussion_model.analysis.study import grid, latin_hypercube, read_axis
    from percussion_model.analysis.study import study as run_study
    from percussion_model.analysis.study.store import PARQUET, PLAN
    from percussion_model.interface.progress import count_bar, progress
    from percussion_model.interface.terminal import show_study
    from percussion_model.scene.typical import hint_of

    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise common.refusal(
            f'a study needs {", ".join(missing)}: pip install "percussion_model[study]"'
        )
    if find_spec(PARQUET) is None:
        common.print_message(
            f"no points.parquet, since {PARQUET} is missing: "
            'pip install "percussion_model[parquet]"'
        )
    axes = dict(read_axis(text) for text in over)
    if len(axes) < len(over):
        raise common.refusal("--over: a key is given twice")
    for text in settings or ():
        if text.partition("=")[0] in axes:
            raise common.refusal(f"--set {text}: --over varies this key")
    if samples is None:
        points = grid(axes)
    else:
        logarithmic = [text.partition("=")[0] for text in over if text.endswith("log")]
        ends = {key: (float(min(values)), float(max(values))) for key, values in axes.items()}
        points = latin_hypercube(ends, samples, seed, logarithmic)
    common.check_outputs(out, None)
    chosen = common.load_scene(scene, solver, cells, settings, rock=rock, bit=bit)
    for key, column in zip(points.keys, points.values.T, strict=True):
        common.hint(key, hint_of(key, column.tolist()))
    try:
        with interruptible():
            # one that goes on has told it, and its bar tells what is left
            if len(points) >= MANY and cluster is None and not (out / PLAN).exists():
                _tell_of_cost(chosen, points, tolerance, scatter, processes)
            with count_bar("points") as report_count:
                found = run_study(
                    chosen,
                    points,
                    out,
                    tolerance,
                    scatter=scatter,
                    processes=processes,
                    cluster=cluster,
                    progress=report_count,
                    force=force,
                )
            files = found.save(out)
            if report:
                with progress("report"):
                    files += _report(found, out)
    except KeyboardInterrupt:
        words = f"interrupted; finished points are kept in {out}, the same command continues"
        raise typer.Exit(common.print_message(words, common.INTERRUPTED)) from None
    show_study(found)
    common.list_files(files)
    if any(found.failures):
        raise typer.Exit(common.FAILED)  # what was found of the others is written


def _tell_of_cost(
    scene: Scene, points: Points, tolerance: float, scatter: float, processes: int | None
) -> None:
    """Say what all points will take, as the one in the middle does."""
    from percussion_model.analysis.stationary import MOST_BLOWS
    from percussion_model.analysis.study.points import refuse_unknown
    from percussion_model.analysis.study.response import run_points
    from percussion_model.interface.progress import progress
    from percussion_model.simulation.uncertain import in_digits

    refuse_unknown(scene, points)
    middle = points.values[len(points) // 2 :][:1]
    with progress("trying a point"):
        for _ in range(2):  # the first one loads the kernels, or compiles them
            begin = time.perf_counter()
            run_points(scene, points.keys, middle, tolerance, MOST_BLOWS, scatter)
            one = time.perf_counter() - begin
    count = processes or os.cpu_count() or 1
    whole = len(points) * one / count
    size, unit = next(((size, unit) for size, unit in TIMES if whole >= size), TIMES[-1])
    common.print_message(
        f"{len(points):,} points take about {in_digits(whole / size, 2)} {unit} on {count} "
        f"{'process' if count == 1 else 'processes'}, as the one in the middle does; Ctrl-C keeps "
        "those that are finished"
    )


def _report(found: Study, folder: Path) -> list[Path]:
    """Write the report; the results are safe already."""
    try:
        from percussion_model.interface.report import write_study_report
    except ImportError as error:
        common.print_message(common.needs_plot_extra(error))
        return []
    return [write_study_report(found, folder)]
