"""Figure of rock along a hole, from a log."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from percussion_model.analysis.identify.observation import RATE, SETTINGS
from percussion_model.analysis.identify.profile import Profile
from percussion_model.interface.plotting import style

HOUR = 3600.0
# Hole without samples that is left open [m].
GAP = 0.2
# Colours of settings, by their share of what is usual in the hole.
SHOWN = {"pressure": "pressure", "feed": "feed", "speed": "rotation"}


def draw_profile(found: Profile, title: str, truth: np.ndarray | None = None) -> Figure:
    """Draw crushing energy by efficiency, strength, rate and settings over depth, downwards.

    Parameters
    ----------
    truth : ndarray, optional
        Crushing energy by efficiency at the samples, where it is known [J/m^3].
    """
    figure = Figure(figsize=(10.0, 7.4), layout="constrained")
    axes = figure.subplots(1, 4, sharey=True, width_ratios=(1.3, 1.0, 1.0, 0.9))
    blue, red = style.LINE_COLOURS[0], style.LINE_COLOURS[1]
    depth, gaps = found.depth.copy(), np.flatnonzero(np.diff(found.depth) > GAP)
    depth[gaps] = np.nan  # lines and bands are open where the log has nothing
    for ax, (low, value, high) in zip(axes, (found.interval(), found.strength()), strict=False):
        ax.fill_betweenx(depth, 1e-6 * low, 1e-6 * high, color=blue, alpha=0.22, linewidth=0)
        ax.plot(1e-6 * value, depth, color=blue)
    axes[0].set_xlim(0.0, 1.15e-6 * float(np.quantile(found.interval()[2], 0.98)))
    axes[1].set_xlim(0.0, 1.15e-6 * float(np.quantile(found.strength()[2], 0.98)))
    if truth is not None:
        axes[0].plot(1e-6 * truth, depth, color="black", linestyle="--", linewidth=1.0)
    rate = HOUR * found.samples.signals[:, RATE]
    axes[2].plot(rate, found.depth, ".", color=style.RULE_COLOUR, markersize=1.6)
    axes[2].set_xlim(0.0, 1.1 * float(np.quantile(rate, 0.99)))
    usual = np.median(found.samples.settings, axis=0)
    for k, name in enumerate(SETTINGS):
        axes[3].plot(found.samples.settings[:, k] / usual[k], depth, linewidth=0.9,
                     color=style.LINE_COLOURS[k + 2], label=SHOWN[name])  # fmt: skip
    for ax in axes:
        for top in found.layers:
            ax.axhline(top, color=red, linewidth=0.8, linestyle=":")
    style.label(axes[0], "crushing energy / efficiency [MJ/m³]", "depth [m]", "What the rate shows")
    style.label(axes[1], "strength [MPa]", "", "By the library's relation")
    style.label(axes[2], "rate [m/h]", "", "Log")
    style.label(axes[3], "by the median [–]", "", "Settings")
    axes[0].set_ylim(float(found.depth[-1]), float(found.depth[0]))
    handles = [
        Line2D([], [], color=blue, label="from the log"),
        Patch(facecolor=blue, alpha=0.22, label="interval of 95 %"),
        Line2D([], [], color=red, linestyle=":", label="change of layer"),
        *axes[3].get_legend_handles_labels()[0],
    ]
    if truth is not None:
        handles.insert(2, Line2D([], [], color="black", linestyle="--", label="truth"))
    style.head(figure, title, handles)
    return figure
