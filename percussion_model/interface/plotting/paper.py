"""Figures 6 and 9 of the paper, and its scaling laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

from percussion_model.analysis.study import Study
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM, MS
from percussion_model.simulation.uncertain import UNDECIDED
from percussion_model.verification.paper.runs import (
    DAMPINGS,
    ENERGIES,
    PAPER_LEAST_DISTANCE,
    PAPER_LEAST_FEED,
    Drop,
    along,
    exponent_and_error,
    fit_text,
    line_errors,
    power_law,
    straight_line,
)

# Colours of the drop tests by barrier energy, light to dark.
ENERGY_COLOURS = ("#9ECAE1", "#56B4E9", "#0072B2", "#08306B")
DAMPING_LINES: tuple[Any, ...] = ((0, (1.2, 1.2)), "-", (0, (4, 1.5)))
# The part of a drop test worth seeing [s].
DROP_SHOWN = 45e-3
# Room above the greatest rate, as a factor on it.
ROOM = 1.25
# The same above the end of the highest error bar.
ROOM_OF_BAR = 1.05
# Room for a legend below the lowest point of a logarithmic axis, as a factor on it.
ROOM_BELOW = 0.5
PERIODIC_COLOUR, APERIODIC_COLOUR = "#0072B2", "#D55E00"
RIGID_COLOUR = "#009E73"


def draw_drops(drops: Sequence[Drop]) -> Figure:
    """Draw the drop tests: mean bit motion, and where the bit comes to rest (figure 6)."""
    fig = Figure(figsize=(10.4, 4.4), layout="constrained")
    motion, close, rest = fig.subplots(1, 3)
    for drop in drops:
        shown = drop.time <= DROP_SHOWN
        colour = ENERGY_COLOURS[ENERGIES.index(drop.energy)]
        dashes = DAMPING_LINES[DAMPINGS.index(drop.damping)]
        for ax in (motion, close):
            x, y = drop.time[shown] * MS, drop.bit_position[shown] * MM
            ax.plot(x, y, linestyle=dashes, color=colour, linewidth=1.1)
    ends = [drop.rest * MM for drop in drops]
    room = ROOM - 1.0
    close.set_xlim(0.5 * DROP_SHOWN * MS, DROP_SHOWN * MS)
    close.set_ylim(min(ends) - 2.0 * room * np.ptp(ends), max(ends) + room * np.ptp(ends))
    for ax, title in ((motion, "(b) Mean bit motion"), (close, "(b) The same near rest")):
        ax.invert_yaxis()
        style.label(ax, "time [ms]", "mean bit displacement, down [mm]", title)
    for damping, dashes in zip(DAMPINGS, DAMPING_LINES, strict=True):
        row = [drop for drop in drops if drop.damping == damping]
        energies, ends = [drop.energy for drop in row], [drop.rest * MM for drop in row]
        rest.semilogx(energies, ends, linestyle=dashes, color="black", marker="o", markersize=4)
    style.label(
        rest,
        "energy barrier $W_R$ [J]",
        "bit end at rest, down [mm]",
        "(c) Penetration at rest",
    )
    handles = [
        Line2D([], [], color=colour, linewidth=2.0, label=f"$W_R$ = {energy:g} J")
        for energy, colour in zip(ENERGIES, ENERGY_COLOURS, strict=True)
    ]
    handles += [
        Line2D([], [], color="black", linestyle=dashes, label=f"$C_R$ = {damping:g} N s/m")
        for damping, dashes in zip(DAMPINGS, DAMPING_LINES, strict=True)
    ]
    style.head(fig, "Drop test of the bit at 5.25 m/s (figure 6)", handles)
    return fig


def draw_sweeps(found: Mapping[str, Study]) -> Figure:
    """Draw the rate of penetration around the reference (figure 9)."""
    fig = Figure(figsize=(10.5, 7.6), layout="constrained")
    axes = fig.subplots(2, 2).ravel()
    _stiffness(axes[0], found["a"])
    _ratio(axes[1], found)
    _feed(axes[2], found["c"])
    _distance(axes[3], found["d"])
    handles = [
        Line2D([], [], linestyle="", marker="o", color=colour, label=name)
        for name, colour in (("periodic", PERIODIC_COLOUR), ("aperiodic", APERIODIC_COLOUR))
    ]
    if any(one.undecided.any() for one in found.values()):
        words = f"{UNDECIDED}: error ≥ rate"
        handles.append(
            Line2D([], [], linestyle="", marker="x", color=style.RULE_COLOUR, label=words)
        )
    handles.append(Line2D([], [], color=style.RULE_COLOUR, linestyle="--", label="fit"))
    style.head(fig, "Rate of penetration around the reference (figure 9)", handles)
    return fig


def _points(ax: Axes, found: Study, factor: float = 1.0) -> None:
    x, rate, periodic = along(found)
    error, undecided = found.rows["rate_of_penetration_error"], found.undecided
    for colour, chosen in (
        (PERIODIC_COLOUR, periodic & ~undecided),
        (APERIODIC_COLOUR, ~periodic & ~undecided),
    ):
        ax.errorbar(
            x[chosen] * factor,
            rate[chosen] * MM,
            error[chosen] * MM,
            linestyle="",
            marker="o",
            markersize=3.5,
            color=colour,
            elinewidth=1.0,
        )
    # where such a point stands says nothing, so it stands at the foot of the panel
    if undecided.any():  # a line without points that is not clipped would break the layout
        foot = np.zeros(int(np.sum(undecided)))
        ax.plot(x[undecided] * factor, foot, "x", color=style.RULE_COLOUR, clip_on=False)
    if not undecided.all():
        known = ~undecided & np.isfinite(rate)
        top = float(np.max((rate + error)[known]))
        bottom = min(0.0, float(np.min((rate - error)[known])))
        ax.set_ylim(bottom * MM, max(ROOM * float(np.max(rate[known])), ROOM_OF_BAR * top) * MM)


def _fit(ax: Axes, x: np.ndarray, y: np.ndarray, words: str, at: tuple[float, float]) -> None:
    ax.plot(x, y * MM, color=style.RULE_COLOUR, linestyle="--", zorder=1)
    ax.annotate(words, at, xycoords="axes fraction", va="top")


def _power_fit(
    ax: Axes, found: Study, unit: float, least: float, law: tuple[str, str], at: tuple[float, float]
) -> None:
    """Draw the points, and the power law through those from `least` on.

    Parameters
    ----------
    unit : float
        Factor from SI to what the axis says.
    law : tuple of str
        Symbol, and the exponent of the paper.
    at : tuple of float
        Where they stand in the panel.
    """
    _points(ax, found, unit)
    x, rate, _ = along(found)
    x, rate = x[x >= least], rate[x >= least]
    exponent, factor = power_law(x, rate)
    _, error = exponent_and_error(x, rate)
    symbol, known = law
    words = f"$\\sim {symbol}^{{{_fitted(exponent, error)}}}$ (paper: {known})"
    _fit(ax, x * unit, factor * x**exponent, words, at)
    ax.set_xscale("log")


def _fitted(value: float, error: float) -> str:
    """What the statements say of a fit, within a formula."""
    return fit_text(value, error).replace("±", "\\pm").replace(" ", "\\ ")


RATE = "rate of penetration [mm/s]"


def _stiffness(ax: Axes, found: Study) -> None:
    _power_fit(ax, found, 1e-6, 0.0, ("K_R", "−0.55"), (0.35, 0.8))
    style.label(ax, "loading stiffness $K_R$ [kN/mm]", RATE, "(a) Loading stiffness of the rock")


def _ratio(ax: Axes, found: Mapping[str, Study]) -> None:
    _points(ax, found["b"])
    for name, line, label in (
        ("b_table", "x-", "finite elements, $K_C$ of Table II"),
        ("b_text", "+-", "finite elements, $K_C$ of the text"),
        ("b_rigid", "-", "rigid body trend"),
    ):
        x, rate, _ = along(found[name])
        rigid = name == "b_rigid"
        colour, width = (RIGID_COLOUR, 1.8) if rigid else ("#444444", 0.8)
        ax.plot(x, rate * MM, line, color=colour, markersize=5.0, linewidth=width, label=label)
        if rigid:
            best = int(np.argmax(rate))
            ax.plot(x[best], rate[best] * MM, "v", color=colour, markersize=6.0)
    ax.legend(loc="upper left")
    ax.set_xscale("log")
    ax.axvline(40.0, color=style.RULE_COLOUR, linestyle=":")
    _say_left(ax, 40.0, "paper: greatest rate")
    ratio = "ratio of unloading to loading stiffness $\\gamma$ [-]"
    style.label(ax, ratio, RATE, "(b) Unloading stiffness")


def _feed(ax: Axes, found: Study) -> None:
    _points(ax, found, 1.0 / KN)
    x, rate, _ = along(found)
    above = x >= PAPER_LEAST_FEED
    slope, intercept, _explained = straight_line(x[above], rate[above])
    errors = line_errors(x[above], rate[above])
    words = (
        f"$({_fitted(slope * 1e6, errors[0] * 1e6)})\\,F_S$ [kN]\n"
        f"$+\\,{_fitted(intercept * MM, errors[1] * MM)}$"
    )
    _fit(ax, x[above] / KN, slope * x[above] + intercept, words, (0.35, 0.8))
    _paper_limit(ax, PAPER_LEAST_FEED / KN)
    ax.set_xscale("log")
    style.label(ax, "feed force $F_S$ [kN]", RATE, "(c) Feed force")


def _distance(ax: Axes, found: Study) -> None:
    _power_fit(ax, found, MM, PAPER_LEAST_DISTANCE, ("D_1", "−0.36"), (0.5, 0.75))
    _paper_limit(ax, PAPER_LEAST_DISTANCE * MM)
    style.label(ax, "reversal distance $D_1$ [mm]", RATE, "(d) Frequency, at constant power")


def draw_scaling(found: Study) -> Figure:
    """Draw period, impact velocity and rate at constant power against each other (eqs 15, 59)."""
    fig = Figure(figsize=(10.5, 4.6), layout="constrained")
    x, rate, periodic = along(found)
    x, rate = x * MM, rate * MM
    chosen = periodic & (x >= PAPER_LEAST_DISTANCE * MM)
    period, velocity = found.rows["blow_period"] * MS, found.rows["impact_velocity"]
    scales, rates = fig.subplots(1, 2)
    _power_line(scales, x, period, chosen, PERIODIC_COLOUR, "period $T$ [ms] ~ $D_1$", "2/3")
    _power_line(scales, x, velocity, chosen, APERIODIC_COLOUR, "velocity $v$ [m/s] ~ $D_1$", "1/3")
    both = "period [ms], impact velocity [m/s]"
    style.label(scales, "reversal distance $D_1$ [mm]", both, "Scales of the drive (eq. 15)")
    _power_line(rates, period, rate, chosen, PERIODIC_COLOUR, "rate ~ $T$", "−1/2")
    _power_line(rates, velocity, rate, chosen, APERIODIC_COLOUR, "rate ~ $v$", "−1")
    style.label(rates, both, RATE, "Rate of penetration (eq. 59)")
    for ax, corner in ((scales, "lower right"), (rates, "lower left")):
        low, high = ax.get_ylim()
        ax.set_ylim(ROOM_BELOW * low, high)
        ax.legend(loc=corner)
    handles = [
        Line2D([], [], linestyle="", marker="o", color="black", label="periodic, in the fit"),
        Line2D([], [], linestyle="", marker="o", color="black", mfc="white", label="other"),
    ]
    style.head(fig, "Scaling with the reversal distance at constant power", handles)
    return fig


def _power_line(
    ax: Axes, x: np.ndarray, y: np.ndarray, chosen: np.ndarray, colour: str, words: str, law: str
) -> None:
    """Draw points, and the power law through those chosen, beside the exponent of the paper."""
    exponent, error = exponent_and_error(x[chosen], y[chosen])
    _, factor = power_law(x[chosen], y[chosen])
    for shown, face in ((chosen, colour), (~chosen, "white")):
        ax.plot(x[shown], y[shown], "o", color=colour, mfc=face, markersize=4.0)
    ends = np.array([np.min(x[chosen]), np.max(x[chosen])])
    label = f"{words}$^{{{_fitted(exponent, error)}}}$ (paper: {law})"
    ax.plot(ends, factor * ends**exponent, color=colour, linewidth=1.0, label=label)
    ax.set(xscale="log", yscale="log")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(ScalarFormatter())
        axis.set_minor_formatter(NullFormatter())


def _paper_limit(ax: Axes, x: float) -> None:
    ax.axvline(x, color=style.RULE_COLOUR, linestyle=":")
    _say_left(ax, x, "paper:\naperiodic")


def _say_left(ax: Axes, x: float, words: str) -> None:
    """Write words left of a vertical line, near the foot of the panel."""
    ax.annotate(
        words,
        (x, 0.04),
        (-4, 0),
        xycoords=ax.get_xaxis_transform(),
        textcoords="offset points",
        ha="right",
    )
