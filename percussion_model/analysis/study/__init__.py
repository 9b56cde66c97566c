"""Studies: the stationary response at many points, on many processes."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from percussion_model.analysis.stationary import check_request
from percussion_model.analysis.study.metrics import read_metrics, text_of, why_not_elsewhere
from percussion_model.analysis.study.points import (
    Points,
    grid,
    latin_hypercube,
    read_axis,
    refuse_unknown,
    table,
)
from percussion_model.analysis.study.response import (
    COMPUTING,
    FOUND,
    KINDS,
    Metric,
    row_type,
    run_points,
)
from percussion_model.analysis.study.store import PARQUET, Store
from percussion_model.analysis.study.workers import (
    end_if_started_again,
    on_a_cluster,
    on_this_machine,
)
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.rows import unit_suffix
from percussion_model.scene.scene import Scene
from percussion_model.simulation.driller_numbers import DRILLER_NUMBERS
from percussion_model.simulation.files import ResultError, staged
from percussion_model.simulation.uncertain import (
    NOT_ESTIMATED,
    in_digits,
    with_error,
)
from percussion_model.solvers.sources import sources_digest

if TYPE_CHECKING:
    import pandas
    import xarray

__all__ = [
    "Points",
    "Study",
    "grid",
    "latin_hypercube",
    "read_axis",
    "study",
    "table",
]

# Points are handed out in parts of at most so many, and so many parts a process at least.
MOST_A_PART = 100
PARTS_A_PROCESS = 8
# Rates with a larger relative error are counted in the headlines.
LARGE_ERROR = 1e-3
# Smaller errors of a rate, relative to it, do not show in its three digits.
LEAST_ERROR = 1e-3
# The rate of penetration as drillers know it.
PER_HOUR = DRILLER_NUMBERS["rate_of_penetration"]
# What errors there are, behind "those of the rate".
KNOWN_ERRORS = (
    "are of convergence and scatter; the discretisation error is not estimated, nor are errors of "
    "the other numbers"
)

# What is not known of the motions that are counted, of solvers that have a grid.
OF_ONE_GRID = (
    "were found with one discretisation; near a threshold a finer one may give another motion "
    "(percussion settled checks)"
)


def _error_of(name: str) -> str:
    """What is known of the error of a column, in words."""
    if name == "rate_of_penetration":
        return f"in {name}_error; {KNOWN_ERRORS.split(',')[0]}"
    return "" if name.endswith("_error") else NOT_ESTIMATED


@dataclass(frozen=True)
class Study:
    """Result of a study.

    Attributes
    ----------
    scene : Scene
    points : Points
    rows : ndarray of `response.ROW`
        One for each point, SI units; with a column more for each metric.
    failures : list of str
        What went wrong at each point, empty where nothing did.
    """

    scene: Scene
    points: Points
    rows: np.ndarray
    failures: list[str]

    def __repr__(self) -> str:
        failed = sum(map(bool, self.failures))
        return f"Study({self.scene.title!r}, {self.points!r}, failed={failed})"

    @property
    def relative_error(self) -> np.ndarray:
        """Error of the rate divided by the rate, for each point; NaN where there is none."""
        rate = np.abs(self.rows["rate_of_penetration"])
        error = self.rows["rate_of_penetration_error"]
        return np.divide(error, rate, out=np.full(len(rate), np.nan), where=rate > 0)

    @property
    def undecided(self) -> np.ndarray:
        """Whether the error is no smaller than the rate, or it is of the cells, for each point."""
        error, rate = self.rows["rate_of_penetration_error"], self.rows["rate_of_penetration"]
        hidden = (error > 0.0) & (error >= np.abs(rate))
        return np.asarray(hidden | (self.depends_on_cells & (rate != 0.0) & np.isfinite(rate)))

    @property
    def depends_on_cells(self) -> np.ndarray:
        """Whether waves run without loss, so that the rate is one of the cells, for each point."""
        key, points = "loss.time", self.points
        if key not in points.keys or not self.scene.effects.loss:
            return np.full(len(points), self.scene.is_undamped)
        return np.asarray(self.scene.has_waves & (points.values[:, points.keys.index(key)] == 0.0))

    def place(self, k: int) -> str:
        """Parameters of a point with their values and units."""
        return ", ".join(
            f"{key} = {value:.5g}{unit_suffix(self.scene.row_of(key).unit)}"
            for key, value in self.points.changes(k).items()
        )

    def rate_text(self, k: int, unit: str = " mm/s", factor: float = 1e3) -> str:
        """Rate of a point with its error of convergence and scatter, where that shows.

        `factor` makes it one in `unit`, of m/s.
        """
        row = self.rows[k]
        rate, error = (factor * float(row[f"rate_of_penetration{end}"]) for end in ("", "_error"))
        if not math.isfinite(error):
            return f"{in_digits(rate)}{unit}, {NOT_ESTIMATED}"
        if error <= LEAST_ERROR * abs(rate):
            return f"{in_digits(rate)}{unit}"  # what the grid adds is not known
        return f"{with_error(rate, error)}{unit}"

    def headlines(self) -> list[tuple[str, str]]:
        """Motions, lowest and highest rate with their points, errors, cost: names and texts."""
        rows = self.rows
        counts = np.bincount(rows["kind"], minlength=len(KINDS)).tolist()
        motions = [f"{n} {kind}" for n, kind in zip(counts, KINDS, strict=True) if n]
        lines = [("Points", f"{len(self.points)}: {', '.join(motions)}")]
        failed = [k for k, text in enumerate(self.failures) if text]
        if failed:  # a metric may fail where the rest is known
            first = f"{self.place(failed[0])}: {self.failures[failed[0]]}"
            lines.append(("Failed", f"{len(failed)} of {len(self.points)}, the first at {first}"))
        if self.scene.solver_name in ("wave", "modal", "fem"):
            lines.append(("These motions", OF_ONE_GRID))
        rate, undecided = rows["rate_of_penetration"].copy(), self.undecided
        rate[undecided] = np.nan
        if np.isfinite(rate).any():
            for name, k in (
                ("Lowest rate", np.nanargmin(rate)),
                ("Highest rate", np.nanargmax(rate)),
            ):
                in_an_hour = self.rate_text(int(k), f" {PER_HOUR.unit}", PER_HOUR.factor)
                lines.append(
                    (name, f"{self.rate_text(int(k))} ({in_an_hour}) at {self.place(int(k))}")
                )
        if undecided.any():
            of_cells = int(np.count_nonzero(undecided & self.depends_on_cells))
            hidden = int(np.count_nonzero(undecided)) - of_cells
            for count, why in (
                (hidden, "their errors are no smaller than they"),
                (of_cells, "without loss in the bars they depend on the cells"),
            ):
                if count:
                    lines.append(("Undecided", f"{count} rates: {why}"))
        for kind in ("periodic", "aperiodic"):
            error = self.relative_error[rows["kind"] == KINDS.index(kind)]
            if np.isfinite(error).any():
                count = int(np.count_nonzero(error > LARGE_ERROR))
                words = f"{count} of them above {100 * LARGE_ERROR:g} %" if count else ""
                largest = f"at most {in_digits(100 * np.nanmax(error), 2)} % of the rate"
                lines.append((f"Error, {kind}", ", ".join(filter(None, (largest, words)))))
        lines.append(("These errors", KNOWN_ERRORS))
        lines.append(("Computed in", f"{in_digits(rows['wall_time'].sum(), 2)} s of one core"))
        return lines

    def save(self, folder: str | Path) -> list[Path]:
        """Write `points.csv`, `points.nc` and, with pyarrow, `points.parquet`: all or none."""
        folder = Path(folder)
        with staged(folder) as draft:
            frame = self.to_pandas()
            frame.to_csv(draft / "points.csv", index=False)
            if find_spec(PARQUET) is not None:
                frame.to_parquet(draft / "points.parquet")
            self.to_xarray().to_netcdf(draft / "points.nc", engine="h5netcdf")
            names = sorted(path.name for path in draft.iterdir())
        return [folder / name for name in names]

    def to_pandas(self) -> pandas.DataFrame:
        """One row for each point: parameters, numbers found, kind of motion, failure."""
        from pandas import DataFrame

        columns: dict[str, Any] = dict(zip(self.points.keys, self.points.values.T, strict=True))
        columns |= {name: self.rows[name] for name in self.rows.dtype.names or ()}
        columns["undecided"] = self.undecided
        columns["kind"] = np.array(KINDS)[self.rows["kind"]]
        frame = DataFrame(columns | {"failure": self.failures})
        frame.attrs["errors"] = f"those of the rate {KNOWN_ERRORS}"
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """Numbers found over the axes of the grid, or over the points; units as attributes."""
        from xarray import Dataset

        points = self.points
        dims = points.keys if points.is_grid else ("point",)
        columns = {name: self.rows[name] for name in self.rows.dtype.names or ()}
        columns |= {"undecided": self.undecided, "failure": np.array(self.failures)}
        found = Dataset(
            {name: (dims, column.reshape(points.shape)) for name, column in columns.items()},
            attrs={"title": self.scene.title, "scene": self.scene.to_toml()},
        )
        for key, column in zip(points.keys, points.values.T, strict=True):
            units = {"units": self.scene.row_of(key).unit}
            axis = (key, np.unique(column)) if points.is_grid else (dims, column)
            found.coords[key] = (*axis, units)
        for name, unit in FOUND.items():
            found[name].attrs |= {"units": unit, "error": _error_of(name)}
        found["kind"].attrs["meaning"] = ", ".join(f"{k}: {kind}" for k, kind in enumerate(KINDS))
        return found


def study(
    scene: Scene,
    points: Points,
    folder: str | Path,
    tolerance: float = 1e-4,
    most_blows: int = 400,
    scatter: float = 1e-3,
    processes: int | None = None,
    cluster: str | None = None,
    progress: Callable[[int, int], None] | None = None,
    force: bool = False,
    metric: Metric | Mapping[str, Metric] | None = None,
) -> Study:
    """Find the stationary response at many points.

    Finished points are kept in the folder: a study that was interrupted continues
    where it stopped when it is called again. What goes wrong at a point is
    recorded there and stops nothing.

    Parameters
    ----------
    scene : Scene
        What is common to all points.
    points : Points
        From `grid`, `latin_hypercube` or `table`.
    folder : str or Path
        New, or that of the same study before.
    tolerance, most_blows, scatter
        As in `settled`; aperiodic motion is run until the standard error of its
        rate is within `scatter`, a relative one, or for `most_blows`.
    processes : int, optional
        On this machine; default as many as it has cores, or one where a metric is in no file
        that others can import.
    cluster : str, optional
        Address of a Dask scheduler that does the work instead.
    progress : callable, optional
        Called with points done and their number.
    force : bool
        Remove another study that the folder holds.
    metric : callable or mapping, optional
        Takes the `Settled` of a point and gives a number, in a column of the function's name;
        several by names of their columns. With another text of a function the folder is
        another study; functions that it calls are not looked at.

    Returns
    -------
    Study

    Raises
    ------
    SceneError
        If a key, a value or the name of a metric makes no sense.
    ResultError
        If the folder holds something else, or points that other sources have computed.
    SimulationError
        If workers keep dying, no scheduler answers, or a metric cannot go to processes asked for.
    """
    refuse_unknown(scene, points)
    metrics = read_metrics(metric)
    check_request(scene, tolerance, most_blows, scatter)
    end_if_started_again()  # before the folder, which the first process holds
    if cluster is None and (why := why_not_elsewhere(metrics)):
        if processes not in (None, 1):
            raise SimulationError(f"{why}: put it in a file of its own, or take processes=1")
        processes = 1
    plan = _plan(scene, points, tolerance, most_blows, scatter)
    plan["metrics"] = {name: text_of(function) for name, function in metrics.items()}
    store = Store(Path(folder), plan, force, row_type(metrics))
    _rows, _failures, done = store.read(len(points))
    order = points.in_cheap_order()
    order = order[~done[order]]
    processes = processes or os.cpu_count() or 1
    size = max(1, min(MOST_A_PART, len(order) // (PARTS_A_PROCESS * processes)))
    parts = [order[k : k + size] for k in range(0, len(order), size)]
    asked = tolerance, most_blows, scatter, metrics
    tasks = [(scene, points.keys, points.values[part], *asked) for part in parts]
    count = int(done.sum())
    if progress is not None:
        progress(count, len(points))
    if tasks:
        ended = (
            on_this_machine(run_points, tasks, min(processes, len(tasks)))
            if cluster is None
            else on_a_cluster(run_points, tasks, cluster)
        )
        with closing(ended):  # an interruption here ends the workers as well
            for number, (rows, failures) in ended:
                store.keep(parts[number], rows, failures)
                count += len(parts[number])
                if progress is not None:
                    progress(count, len(points))
    rows, failures, done = store.read(len(points))
    if not done.all():
        raise ResultError(f"{folder}: {int((~done).sum())} points are missing: run it again")
    return Study(scene, points, rows, failures)


def _plan(
    scene: Scene, points: Points, tolerance: float, most_blows: int, scatter: float
) -> dict[str, Any]:
    return {
        "scene": scene.to_toml(),
        "keys": list(points.keys),
        "shape": list(points.shape),
        "points": points.digest(),
        "tolerance": tolerance,
        "most_blows": most_blows,
        "scatter": scatter,
        "version": version("percussion_model"),
        "sources": sources_digest(COMPUTING),
    }
