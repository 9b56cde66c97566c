"""What scripted runs of coupled systems share: several runs in one figure, and their data."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping, Sequence
from math import isnan
from pathlib import Path

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from percussion_model.coupling import CoupledRun, Coupling, CouplingError
from percussion_model.interface.messages import wrapped
from percussion_model.interface.progress import progress, progress_bar
from percussion_model.interface.tables import print_table
from percussion_model.simulation.files import csv_text, staged_texts
from percussion_model.simulation.uncertain import in_digits

from .drawing import in_style, stacked
from .results import command_line, system, tell

STEP = 2e-3  # the longest at which the shoulder is as stiff as it is [s]
INTERVAL = 4e-3  # of the rows that are kept [s]
FEED = 3000.0  # the feed that FeedControl asks for [N]
SIGNALS = (
    "string.lifted", "string.weight", "string.rod_count", "string.bit_impulse",
    "hammer.bit.force_peak", "hammer.blow_count", "hammer.blow_energy", "hammer.off_bottom",
    "rig.energy", "supply.energy", "controller.force_command", "controller.mode",
    "rock.in_void",
    "rig.limited",
)  # fmt: skip
ONE_ROCK = {
    "rock.layers[1].loading_stiffness": 7.5e8, "rock.layers[2].top": -1.0,
    "rock.layers[3].top": -1.0,
}  # fmt: skip

Panel = tuple[str, float, str]
# Words, factor and unit of a number.
Quantity = tuple[str, float, str]


def run(
    archive: Path, duration: float, values: Mapping[str, float | bool] | None = None
) -> CoupledRun:
    """Run the feed-controlled system, its usual signals kept; an early end is an error."""
    with progress_bar(duration) as bar:
        found = Coupling(archive, {**ONE_ROCK, **(values or {})}).run(
            duration, STEP, SIGNALS, INTERVAL, progress=bar, tell=tell
        )
    return whole(found)


def whole(found: CoupledRun) -> CoupledRun:
    """A run that did not end early; else its error."""
    if found.error:
        raise CouplingError(found.error)
    return found


def held_since(time: np.ndarray, held: np.ndarray) -> float:
    """Time from which a condition holds to the end [s]; not a number if it does not."""
    broken = np.flatnonzero(~held)
    if len(broken) == 0:
        return float(time[0])
    return float(time[broken[-1] + 1]) if broken[-1] + 1 < len(time) else float("nan")


@in_style
def draw_runs(
    path: Path,
    title: str,
    runs: Mapping[str, CoupledRun | Mapping[str, np.ndarray]],
    panels: Sequence[Panel],
    marks: Mapping[str, Sequence[tuple[float, str]]] | None = None,
    spans: Sequence[tuple[float, float, str]] = (),
) -> Path:
    """Draw several runs over time, a panel for each quantity.

    Parameters
    ----------
    runs : mapping
        Runs, or their columns, by what the legend calls them.
    panels : sequence of tuple
        Label with unit, factor, signal.
    marks : mapping, optional
        Dashed lines by signal: value in the unit of the panel, and what it is.
    spans : sequence of tuple, optional
        Shaded intervals: begin and end [s], and what they are.

    Returns
    -------
    Path
        The PNG file.
    """
    from matplotlib.patches import Patch

    from percussion_model.interface.plotting.style import SHADE_COLOUR, save_png

    labels = [label for label, _, _ in panels]
    figure, axes = stacked(title, labels, (8.5, 1.6 + 1.5 * len(panels)))
    for ax, (_, factor, signal) in zip(axes, panels, strict=True):
        for name, one in runs.items():
            ax.plot(one["time"], factor * one[signal], linewidth=1.2, label=name)
        for begin, end, _ in spans:
            ax.axvspan(begin, end, color=SHADE_COLOUR, linewidth=0, zorder=0)
        for level, text in (marks or {}).get(signal, ()):
            ax.axhline(level, color="k", linewidth=0.8, linestyle="--")
            ax.annotate(text, (1.01, level), xycoords=("axes fraction", "data"), va="center")
        ax.margins(x=0.01, y=0.12)
    handles, names = axes[0].get_legend_handles_labels()
    for _, _, text in spans[:1]:
        handles.append(Patch(color=SHADE_COLOUR))
        names.append(text)
    figure.legend(handles, names, loc="outside lower center", ncols=4)
    return save_png(figure, path, 110)


def save_runs(runs: Mapping[str, CoupledRun], name: str, folder: Path) -> list[Path]:
    """Write the signals of each run as `NAME_RUN.csv` into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    return [
        one.write_csv(folder / f"{name}_{re.sub('[^a-z0-9]+', '_', label.lower())}.csv")
        for label, one in runs.items()
    ]


def save_table(columns: Mapping[str, np.ndarray], path: Path) -> Path:
    """Write columns as CSV."""
    return staged_texts(path.parent, {path.name: csv_text(columns)})[0]


def write(
    name: str,
    simulate: Callable[[Path], dict[str, CoupledRun]],
    numbers: Callable[[CoupledRun], Mapping[str, float]],
    draw: Callable[[dict[str, CoupledRun], Path], Path],
    shown: Mapping[str, Quantity],
) -> None:
    """Run a scenario of the feed-controlled system: write figure and data, print numbers.

    Parameters
    ----------
    name : str
        Of the files.
    simulate, numbers, draw : callable
        Runs of an archive, by what the legend calls them; numbers of one run; their figure.
    shown : mapping
        What a number is called, by its name: words, factor and unit.
    """

    def work(paths: Sequence[Path], folder: Path) -> list[Path]:
        runs = simulate(*paths)
        print_numbers({case: numbers(found) for case, found in runs.items()}, shown)
        with progress("drawing"):
            return [draw(runs, folder / f"{name}.png"), *save_runs(runs, name, folder)]

    about = sys.modules[simulate.__module__].__doc__
    command_line(name, about, [system("FeedControlRigid")], work)


def print_numbers(found: Mapping[str, Mapping[str, float]], shown: Mapping[str, Quantity]) -> None:
    """Print numbers of runs, a column for each run, and what is known of their errors."""
    print_columns(found, shown)
    step = f"the communication step of {1e3 * STEP:g} ms"
    print(wrapped(f"The error by {step} was not estimated: numbers have three digits."))


def print_columns(found: Mapping[str, Mapping[str, float]], shown: Mapping[str, Quantity]) -> None:
    """Print numbers of runs, a column for each run."""
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
    table.add_column("")
    for case in found:
        table.add_column(case, justify="right")
    table.add_column("unit", no_wrap=True)
    for key, (words, factor, unit) in shown.items():
        values = (factor * numbers[key] for numbers in found.values())
        table.add_row(words, *("never" if isnan(one) else in_digits(one) for one in values), unit)
    print_table(table)
