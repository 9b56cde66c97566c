"""Figure of a calibration: data and fit, residuals, profiles with their thresholds and rivals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from percussion_model.analysis.fitting import Curve, DropTest, Explained, Fit
from percussion_model.analysis.fitting.found import OPEN, OPEN_ABOVE, OPEN_BELOW
from percussion_model.analysis.fitting.likelihood import EXPONENTS
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM, MPA, MS
from percussion_model.simulation.uncertain import in_digits

SYMBOLS = {
    "rock.loading_stiffness": ("$K_R$", " [N/m]"),
    "rock.loading_exponent": ("$n$", ""),
    "rock.unloading_ratio": ("$\\gamma$", ""),
    "rock.unloading_exponent": ("$q$", ""),
    "rock.barrier_damping": ("$C_R$", " [N s/m]"),
    "rock.barrier_energy": ("$W_R$", " [J]"),
}
# Factors to what axes of data say, and of residuals, by SI unit.
SHOWN = {
    "m": (MM, "mm", 1e6, "µm"),
    "m/s": (1.0, "m/s", 1e3, "mm/s"),
    "N": (1.0 / KN, "kN", 1.0 / KN, "kN"),
    "Pa": (1.0 / MPA, "MPa", 1.0 / MPA, "MPa"),
}
DATA, FIT, RIVAL = "#222222", "#0072B2", "#D55E00"
# Profiles are drawn up to this multiple of the threshold.
HIGHEST = 2.0
# Axes of intervals wider than this factor are logarithmic.
LOGARITHMIC = 10.0
DPI = 130


def save_calibration(found: Fit, path: Path) -> Path:
    """Draw a fit into a PNG file."""
    with rc_context(style.STYLE):
        return style.save_png(draw_calibration(found), path, DPI)


def draw_calibration(found: Fit) -> Figure:
    """Draw measurements above, residuals below them, and the profile of each parameter."""
    rows = [one for one in found.explained if not hasattr(one.source, "quantity")]
    columns = max(len(rows), 1)
    fig = Figure(figsize=(max(3.6 * columns, 11.0), 8.6), layout="constrained")
    style.head(fig, "Calibration: measurements, fit and what it is worth")
    above, below = list(fig.subfigures(2, 1, height_ratios=[1.7, 1.0]))  # type: ignore[arg-type]
    if rows:
        axes = above.subplots(2, columns, squeeze=False, height_ratios=[1.8, 1.0])
        for (top, bottom), one in zip(axes.T, rows, strict=True):
            _data(top, bottom, one)
    panels = np.atleast_1d(below.subplots(1, len(found.estimates)))
    for ax, key in zip(panels, found.estimates, strict=True):
        _profile(ax, found, key)
    told: dict[str, Any] = {}
    for ax in panels:
        for handle, text in zip(*ax.get_legend_handles_labels(), strict=True):
            told.setdefault(text, handle)
    below.legend(told.values(), told.keys(), loc="outside lower center", ncols=len(told))
    return fig


def _data(top: Axes, bottom: Axes, one: Explained) -> None:
    factor, unit, fine, fine_unit = SHOWN[one.unit]
    if isinstance(one.source, Curve):
        x, place, what = one.source.penetration * MM, "penetration [mm]", "force"
    else:
        assert isinstance(one.source, DropTest)
        x, place, what = one.source.time * MS, "time [ms]", one.source.signal.replace("_", " ")
    top.plot(x, one.data * factor, "o", color=DATA, markersize=2.0, label="measured")
    top.plot(x, one.fitted * factor, color=FIT, label="fit")
    top.legend()
    style.label(top, "", f"{what} [{unit}]", one.name)
    if what.endswith("position"):
        top.invert_yaxis()
    bottom.axhspan(-2.0 * one.noise * fine, 2.0 * one.noise * fine, color=FIT, alpha=0.15, lw=0)
    bottom.plot(x, one.residuals * fine, "o", color=DATA, markersize=1.6)
    words = f"noise {one.noise_text(fine)} {fine_unit} (band: twice)"
    style.label(bottom, place, f"data - fit [{fine_unit}]", words)


def _interval(found: Fit) -> str:
    """What the shaded interval is."""
    level = f"{100.0 * found.confidence:g} %"
    if not found.is_widened:
        return f"{level} interval"
    return (
        f"interval, widened for roughness to a deviance of {in_digits(found.threshold)} "
        f"({level} alone: {in_digits(found.quantile)})"
    )


def _profile(ax: Axes, found: Fit, key: str) -> None:
    estimate, (values, deviance) = found.estimates[key], found.profiles[key]
    top = HIGHEST * found.threshold
    shown = deviance < 2.0 * top
    where, height = values[shown], deviance[shown]
    ax.plot(where, height, ".-", color=FIT, lw=0.9, markersize=4, label="lowest deviance found")
    limit = "limit of the region"
    ax.axhline(found.threshold, color=style.RULE_COLOUR, lw=1.0, ls="--", label=limit)
    ax.axvspan(estimate.low, estimate.high, color=FIT, alpha=0.12, lw=0, label=_interval(found))
    # where it is not open: the deviance may jump beyond the last point drawn
    for end, is_open in ((estimate.low, (OPEN, OPEN_BELOW)), (estimate.high, (OPEN, OPEN_ABOVE))):
        if estimate.verdict not in is_open:
            ax.axvline(end, color=FIT, lw=0.8, label="its ends")
    ax.plot([estimate.value], [0.0], "o", color=FIT, markersize=5)
    rivals = [(one.values[key], one.deviance) for one in found.rivals if one.deviance < top]
    if rivals:
        ax.plot(*zip(*rivals, strict=True), "x", color=RIVAL, markersize=6, label="other minimum")
    if key not in EXPONENTS and estimate.high > LOGARITHMIC * estimate.low:
        ax.set_xscale("log")
    else:
        ax.ticklabel_format(useOffset=False)
        ax.locator_params(axis="x", nbins=4)
    ax.set_ylim(-0.03 * top, top)
    symbol, unit = SYMBOLS[key]
    style.label(ax, symbol + unit, "deviance above the best", f"{symbol}: {estimate.verdict}")
