"""Shared parts of the examples: the command line, and the place of figures."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from percussion_model import Scene
from percussion_model.analysis.study import Points, Study, study
from percussion_model.interface.commands.common import end_script
from percussion_model.interface.plotting import style
from percussion_model.interface.progress import Report, progress
from percussion_model.simulation.files import staged, staged_texts, to_json
from percussion_model.simulation.origin import Claim

# What an example found, as JSON.
FOUND = "found.json"
# Energies and rates are drawn in these, and told apart with any colour vision.
BLUE, ORANGE, GREEN, BLACK, GREY = "#0072B2", "#D55E00", "#009E73", "#222222", "#8C8C8C"
PINK = "#CC79A7"


# What takes the words of the example that runs; none where it is called from Python.
_reports: list[Report] = []


def tell(text: str, share: float | None = None) -> None:
    """Say what an example does at present, and which share of it is done."""
    for report in _reports:
        report(text, share)


def study_points(
    points: Points, out: Path, quick: bool, most_blows: int, scene: Scene | None = None
) -> Study:
    """Study points around a scene, the reference if it is left out, and say how far it is."""
    return study(
        scene or Scene(), points, out / "points", most_blows=most_blows,
        processes=1 if quick else None,
        progress=lambda done, total: tell(f"{done} of {total} points", done / total),
    )  # fmt: skip


def plain_ticks(ax: Axes, x: np.ndarray) -> None:
    """Write plain numbers on a logarithmic axis that spans `x`."""
    ax.set_xscale("log")
    ticks = [t for t in (0.2, 0.5, 1, 2, 5, 10, 20) if x[0] <= t <= x[-1]]
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.minorticks_off()


@contextmanager
def figure_of(name: str, out: Path, size: tuple[float, float]) -> Iterator[Figure]:
    """Give an empty figure; what is drawn on it ends up in `out/name.png`."""
    with matplotlib.rc_context(style.STYLE):
        fig = Figure(figsize=size, layout="constrained")
        yield fig
        with staged(out) as draft:
            style.save(fig, draft, name, ("png",))


def arguments(main: Callable[..., Any], name: str, out: Path) -> argparse.Namespace:
    """Words of the command line of an example: out, quick and force."""
    parser = argparse.ArgumentParser(prog=f"python -m examples.{name}", description=main.__doc__)
    parser.add_argument("--out", type=Path, default=out, metavar="DIR")
    parser.add_argument("--quick", action="store_true", help="few points: seconds, not minutes")
    parser.add_argument("--force", action="store_true", help="replace what else is in DIR")
    return parser.parse_args()


def write_example(
    main: Callable[..., dict[str, Any]],
    name: str,
    out: Path,
    quick: bool,
    force: bool,
    numbered: bool = True,
) -> None:
    """Run an example; write its figure and what it found where nothing else is replaced."""
    origin = {"command": f"python -m examples.{name}", "quick": quick}
    claim = Claim(out, origin, force, numbered)
    if claim.moved:
        print(claim.moved, file=sys.stderr)
    numbers = claim.folder / FOUND
    with progress(f"computing {name}") as report:
        _reports[:] = [report]
        try:
            found = main(claim.folder, quick)
        finally:
            _reports.clear()
    staged_texts(claim.folder, {FOUND: to_json(found) + "\n"})
    claim.sign()
    for path in (numbers, claim.folder / f"{name}.png"):
        print(f"wrote {path}", file=sys.stderr)


def command_line(main: Callable[..., dict[str, Any]], name: str) -> NoReturn:
    """Run an example with the words of the command line, and write what it found."""
    default = Path("out/examples") / name
    words = arguments(main, name, default)
    numbered = words.out == default
    end_script(
        f"examples.{name}",
        lambda: write_example(main, name, words.out, words.quick, words.force, numbered),
    )
