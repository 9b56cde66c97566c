"""Figures of a result, as PNG and SVG."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

from percussion_model.analysis.drill_string import StringReport, string_report
from percussion_model.interface.plotting.activation import draw_activation
from percussion_model.interface.plotting.drill_string import draw_string
from percussion_model.interface.plotting.motion import draw_motion
from percussion_model.interface.plotting.overview import draw_overview
from percussion_model.interface.plotting.stress import draw_stress
from percussion_model.interface.plotting.style import STYLE, save_figures, shown_in_notebooks
from percussion_model.interface.plotting.window import (
    NotRepeatable,
    last_blow_window,
    stress_fields,
)
from percussion_model.interface.progress import Report
from percussion_model.scene.rows import said_among
from percussion_model.simulation.files import ResultError
from percussion_model.simulation.result import Result

__all__ = ["CAPTIONS", "draw_figures", "figures", "plot"]

# What each figure shows, in the order in which they are made.
CAPTIONS = {
    "overview": (
        "The whole run, one point for each blow. The rate of penetration is the advance of the "
        "hole over a blow, divided by the blow's period. Deviations are from the mean of the blows "
        "after settling: a straight fall shows the stability multiplier."
    ),
    "bit_motion": (
        "Mean motion of the bit and its force on the rock. Colours show the drilling mode; grey "
        "bands are times at which the piston rests on the bit. Displacements count from the start "
        "of the blow (or from first contact), down positive; forces are positive in compression."
    ),
    "activation": (
        "Piston and bit just after the impact. Letters mark where piston and bit close (A, C, …) "
        "and part (B, D, …); u_r and v_r are the mean displacement and velocity of the piston "
        "relative to the bit, down positive."
    ),
    "stress_waves": (
        "Stress along the bars (top to bottom) against time, at every step of the solver. "
        "Compression is red, tension blue. Waves move at the slope of the stripes; the black line "
        "is thick where the piston touches the bit. Below: the forces at the two ends of the bit."
    ),
    "string_waves": (
        "Force in all bars, from the piston down, after one impact. Waves move at the slope of the "
        "stripes; red is compression, blue tension. Thin lines are the joints."
    ),
    "string_energy": (
        "Energy in piston, string and bit after one impact, and the greatest forces of that blow "
        "along the string, as the middle of each cell has them."
    ),
    "string_gauges": (
        "Stress as strain gauges in the middle of three bars show it, after one impact; positive "
        "in compression."
    ),
}
# Figures of a piston on a bit alone, and of a drill string alone.
OF_TWO_BARS, OF_STRINGS = ("activation", "stress_waves"), (
    "string_waves", "string_energy", "string_gauges",
)  # fmt: skip
# A run of fewer blows has no overview.
FEWEST_BLOWS = 2


def figures(result: Result, folder: str | Path, report: Report | None = None) -> list[Path]:
    """Draw all figures that a result supports, each as PNG and as SVG.

    Parameters
    ----------
    result : Result
    folder : str or Path
        Made if it is not there; all figures are written, or none.
    report : callable, optional
        Is told which figure is drawn, and the share that is done.

    Returns
    -------
    list of Path
        The files, in the order of `CAPTIONS`, PNG before SVG.
    """
    return save_figures(lambda: draw_figures(result), folder, names=_names(result), report=report)


def plot(result: Result, figure: str = "overview") -> Figure:
    """Draw one figure of a result; as `Result.plot`."""
    names = _names(result)
    if figure not in names:
        whose = "this run has none of that name" if figure in CAPTIONS else "there is none"
        raise ResultError(f"figure {figure!r}: {whose}: {said_among(figure, names)}")
    with rc_context(STYLE):
        for name, drawn in draw_figures(result):
            if name == figure:
                return shown_in_notebooks(drawn)
    raise ResultError(f"figure {figure!r}: the scene alone does not repeat this run")


def _names(result: Result) -> list[str]:
    """Names of the figures that a result supports, of one that can be run again."""
    lacking = {
        "overview": len(result.blows) < FEWEST_BLOWS,
        "activation": result.scene.piston.model == "absent",
        "stress_waves": not result.cells,
    }
    others = OF_TWO_BARS if result.scene.effects.string else OF_STRINGS
    return [name for name in CAPTIONS if not lacking.get(name) and name not in others]


def draw_figures(result: Result) -> Iterator[tuple[str, Figure]]:
    """Draw the figures one by one, without writing them.

    Yields
    ------
    name : str
        A key of `CAPTIONS`.
    figure : matplotlib.figure.Figure
    """
    if len(result.blows) >= FEWEST_BLOWS:
        yield "overview", draw_overview(result)
    try:
        window = last_blow_window(result)
    except NotRepeatable as error:
        warnings.warn(f"no detailed figures: {error}", stacklevel=2)
        return
    yield "bit_motion", draw_motion(window)
    if result.scene.effects.string:
        if result.scene.piston.model != "absent" and len(result.counted):
            yield from draw_string(watched_string(result))
        return
    if result.scene.piston.model != "absent":
        yield "activation", draw_activation(window)
    fields = stress_fields(window)
    if fields:
        yield "stress_waves", draw_stress(window, fields)


def watched_string(result: Result) -> StringReport:
    """One blow of a drill string, with gauges in the middle of three bars."""
    bars = [name for name in result.scene.bars if name != "piston"]
    chosen = dict.fromkeys((bars[0], bars[len(bars) // 2], bars[-2]))
    gauges = [(name, 0.5 * result.scene.bars[name].length) for name in chosen]
    return string_report(result.scene, gauges=gauges)
