"""Figure of an experiment: what was measured, what was computed, and the criteria."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM, MPA, US
from percussion_model.verification.measured import (
    QUANTITIES,
    Comparison,
    Experiment,
    FoundFit,
    Row,
)
from percussion_model.verification.measured.blow import (
    Reading,
    Rig,
    at_speed,
    deepest,
    gauge_record,
    rebound,
    resolved,
)
from percussion_model.verification.measured.comparison import (
    FITTED,
    MET,
    MISSED,
    NO_CRITERION,
    UNDECIDED,
)

VERDICT_COLOURS = {
    MET: "#009E73",
    MISSED: "#D55E00",
    UNDECIDED: "#E69F00",
    FITTED: "#0072B2",
    NO_CRITERION: "#8C8C8C",
}
RATIO = "rock.unloading_ratio"
# Unloading ratios of the curve of restitution.
RATIOS = np.geomspace(1.2, 40.0, 25)
# Of the lines by each law.
DASHES = ("-", (0, (4.0, 2.0)), ":")
# Samples of a record of a gauge.
SAMPLES = 400


# A fit, and a speed that it is shown at.
Line = tuple[FoundFit, float | None]


def draw_all(found: Comparison) -> Iterator[tuple[str, Figure]]:
    """Draw a figure for each experiment, by its name."""
    for one in found.experiments:
        yield one.name, draw_experiment(found, one)


def draw_experiment(found: Comparison, one: Experiment) -> Figure:
    """Draw displacement, force, a third view, and deviations by their criteria."""
    fig = Figure(figsize=(9.0, 8.8), layout="constrained")
    axes = fig.subplots(2, 2)
    rig = Rig(Reading(one.gauge))
    fits = _drawn(found, one)
    lines = [(fit, speed) for fit in fits for speed in _speeds(found, fit)]
    _displacements(axes[0, 0], found, rig, lines)
    _forces(axes[0, 1], found, rig, lines)
    third = axes[1, 0]
    rows = [row for fit in fits for row in found.of(one.name, fit.name)]
    if len({row.speed for row in rows if row.quantity == "restitution"}) > 1:
        _restitution(third, found, one, rig)
    elif any(row.quantity == "first_wave" for row in rows):
        _gauge(third, found, one, fits)
    else:
        _force_in_time(third, found, rig, lines)
    _deviations(axes[1, 1], rows)
    handles = [
        _marker("black", "measured, or computed by others, with its error", "o"),
        Patch(facecolor=style.SHADE_COLOUR, label="within the criterion"),
    ]
    if any(row.within is None and row.quantity == "peak_force" for row in rows):
        handles.append(_marker("black", "without a criterion", "o", hollow=True))
    verdicts = {row.verdict for row in rows}
    handles += [
        _marker(colour, word, "D", hollow=word == FITTED)
        for word, colour in VERDICT_COLOURS.items()
        if word in verdicts and word != NO_CRITERION
    ]
    style.head(fig, f"{one.title}: published numbers and this model", handles)
    return fig


def _marker(colour: str, words: str, marker: str, hollow: bool = False) -> Line2D:
    face = "white" if hollow else colour
    return Line2D([], [], color=colour, marker=marker, linestyle="", markersize=5.0,
                  markerfacecolor=face, label=words)  # fmt: skip


def _speeds(found: Comparison, fit: FoundFit) -> list[float | None]:
    rows = found.of(fit.experiment, fit.name)
    return sorted({row.speed for row in rows}, key=lambda speed: speed or 0.0)


def _drawn(found: Comparison, one: Experiment) -> list[FoundFit]:
    """Of the whole fits by each law the one that meets most criteria: the table has all."""
    best: dict[str, tuple[int, FoundFit]] = {}
    for plan in one.fits:
        if plan.start:
            continue
        met = sum(row.verdict == MET for row in found.of(one.name, plan.name))
        if plan.law not in best or met > best[plan.law][0]:
            best[plan.law] = met, found.found(one.name, plan.name)
    return [fit for _, fit in best.values()]


def _named(lines: list[Line]) -> Iterator[tuple[FoundFit, float | None, dict[str, Any]]]:
    """Fits and speeds with the look of their lines: a colour a speed, dashes a law."""
    speeds = list(dict.fromkeys(speed for _, speed in lines))
    laws = list(dict.fromkeys(fit.law for fit, _ in lines))
    for fit, speed in lines:
        k = speeds.index(speed) if len(speeds) > 1 else laws.index(fit.law)
        look = {
            "color": style.LINE_COLOURS[k % len(style.LINE_COLOURS)],
            "linestyle": DASHES[laws.index(fit.law) % len(DASHES)],
        }
        yield fit, speed, look


def _legend(ax: Axes, lines: list[Line]) -> None:
    """Say which colour is which speed, and which dashes are which law."""
    speeds, laws = {}, {}
    several = len({speed for _, speed in lines}) > 1
    for fit, speed, look in _named(lines):
        if several:
            speeds[f"{speed:g} m/s"] = Line2D([], [], color=look["color"])
        law = {**look, "color": "black"} if several else look
        laws[f"{fit.law} law"] = Line2D([], [], **law)
    handles = speeds | laws
    ax.legend(handles.values(), handles.keys(), loc="best")


def _displacements(ax: Axes, found: Comparison, rig: Rig, lines: list[Line]) -> None:
    for fit, speed, look in _named(lines):
        blow = rig.blow(fit.scene, speed)
        # until the piston strikes the bit again
        shown = slice(0, rebound(blow, rig.reading)[0].stop or len(blow.time))
        ax.plot(blow.time[shown] * US, blow.end[shown] * MM, **look)
        ax.plot(blow.time[shown] * US, blow.mean[shown] * MM, linewidth=0.7, **look)
        at = blow.time[deepest(blow)] * US
        for row in _rows(found, fit, speed, "penetration"):
            _measured(ax, at, row.measured * MM, row.error * MM, look["color"])
        for row in _rows(found, fit, speed, "residual_penetration"):
            let_go = blow.time[np.argmax(blow.in_flight & (blow.time > blow.time[deepest(blow)]))]
            _measured(ax, let_go * US, row.measured * MM, row.error * MM, look["color"])
    _legend(ax, lines)
    title = "Displacement of the bit's lower end, thin: of its mean"
    style.label(ax, "time [µs]", "down [mm]", title)


def _forces(ax: Axes, found: Comparison, rig: Rig, lines: list[Line]) -> None:
    for fit, speed, look in _named(lines):
        blow = rig.blow(fit.scene, speed)
        touched = blow.force > 0.0
        ax.plot(blow.end[touched] * MM, blow.force[touched] / KN, **look)
        depths = _rows(found, fit, speed, "penetration")
        for row in _rows(found, fit, speed, "peak_force") if depths else ():
            _measured(ax, depths[0].measured * MM, row.measured / KN, row.error / KN, look["color"])
    style.label(ax, "penetration [mm]", "force on the rock [kN]", "Force over penetration")


def _force_in_time(ax: Axes, found: Comparison, rig: Rig, lines: list[Line]) -> None:
    for fit, speed, look in _named(lines):
        blow = rig.blow(fit.scene, speed)
        ax.plot(blow.time * US, blow.force / KN, **look)
        at = blow.time[int(np.argmax(blow.force))] * US
        for row in _rows(found, fit, speed, "peak_force"):
            _measured(ax, at, row.measured / KN, row.error / KN, look["color"], row.within is None)
    style.label(ax, "time [µs]", "force on the rock [kN]", "Force in time")


def _gauge(ax: Axes, found: Comparison, one: Experiment, fits: list[FoundFit]) -> None:
    """Whole records of the gauge: the first wave is read before anything comes back."""
    for fit, colour in zip(fits, style.LINE_COLOURS, strict=False):
        for row in found.of(one.name, fit.name):
            if row.quantity != "first_wave":
                continue
            scene = resolved(at_speed(fit.scene, row.speed))
            times = np.linspace(0.0, 0.5 * scene.run.duration, SAMPLES)
            stress = gauge_record(scene, times, one.gauge)
            ax.plot(times * US, stress / MPA, color=colour, label=fit.name)
            at = times[int(np.argmax(stress > 0.9 * row.computed))]
            _measured(ax, at * US, row.measured / MPA, row.error / MPA, colour)
    ax.legend(loc="best")
    title = "Stress at the gauge, compression positive"
    style.label(ax, "time [µs]", "stress [MPa]", title)


def _restitution(ax: Axes, found: Comparison, one: Experiment, rig: Rig) -> None:
    """The unloading ratio that each measured restitution would need."""
    base = found.found(one.name, one.fits[0].name)
    rows = {r.speed: r for r in found.of(one.name) if r.quantity == "restitution"}
    ax.set_xscale("log")
    for k, (speed, row) in enumerate(rows.items()):
        colour = style.LINE_COLOURS[k]
        scenes = [base.scene.replace(**{RATIO: float(ratio)}) for ratio in RATIOS]
        values = np.array([rig.read(scene, "restitution", speed) for scene in scenes])
        dashes = (0, (3.0, 3.0)) if k else "-"
        ax.plot(RATIOS, values, color=colour, linestyle=dashes, linewidth=1.8)
        if row.within is not None:
            ax.axhspan(row.measured - row.within, row.measured + row.within, color=colour,
                       alpha=0.12, linewidth=0)  # fmt: skip
        needed = float(np.interp(-row.measured, -values, RATIOS))
        words = f"at {speed:g} m/s: {row.measured:.3g}, which needs $\\gamma$ = {needed:.2g}"
        ax.errorbar([needed], [row.measured], yerr=[row.error], fmt="o", color=colour,
                    markersize=6.0, markeredgecolor="black", zorder=5, label=words)  # fmt: skip
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xticks([1.5, 2, 3, 5, 10, 20, 40])
    ax.set_ylim(0.0, 1.0)
    ax.legend(loc="lower left")
    title = "Stiffness ratio that each restitution needs (bands: criterion)"
    style.label(ax, r"ratio of unloading to loading stiffness $\gamma$", "restitution [–]", title)


def _rows(found: Comparison, fit: FoundFit, speed: float | None, quantity: str) -> list[Row]:
    rows = found.of(fit.experiment, fit.name)
    return [row for row in rows if row.quantity == quantity and row.speed == speed]


def _measured(
    ax: Axes, x: float, y: float, error: float, colour: str, hollow: bool = False
) -> None:
    ax.errorbar([x], [y], yerr=[error], fmt="o", color=colour, markersize=5.0, capsize=3.0,
                markerfacecolor="white" if hollow else colour, elinewidth=1.1,
                markeredgecolor="black", markeredgewidth=0.6, zorder=5)  # fmt: skip


def _deviations(ax: Axes, rows: list[Row]) -> None:
    """Each number with a criterion, by that criterion; a fit after the other."""
    ax.axvspan(-1.0, 1.0, color=style.SHADE_COLOUR, linewidth=0, zorder=0)
    names: list[str] = []
    for fit in dict.fromkeys(row.fit for row in rows):
        drawn = [row for row in rows if row.fit == fit and row.within is not None]
        if not drawn:
            continue
        ax.text(0.01, len(names), f"{drawn[0].law}, {fit}", va="center", fontsize=7.5,
                fontweight="bold", transform=ax.get_yaxis_transform())  # fmt: skip
        names.append("")
        for row in drawn:
            _deviation(ax, row, len(names))
            names.append(row.id)
    ax.set_yticks(range(len(names)), names, fontsize=7.5)
    ax.tick_params(axis="y", length=0)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.axvline(0.0, color=style.RULE_COLOUR, linewidth=0.8)
    style.label(ax, "computed less measured, divided by the criterion", "", "Deviations")


def _deviation(ax: Axes, row: Row, y: int) -> None:
    assert row.within is not None
    scale = row.measured if QUANTITIES[row.quantity].relative else 1.0
    colour = VERDICT_COLOURS[row.verdict]
    ax.errorbar([0.0], [y], xerr=[row.error / scale / row.within], fmt="o", color="black",
                markersize=3.0, capsize=2.0, elinewidth=0.9)  # fmt: skip
    ax.plot([row.deviation / row.within], [y], "D", color=colour, markersize=6.0,
            markerfacecolor="white" if row.role == FITTED else colour, zorder=6)  # fmt: skip
