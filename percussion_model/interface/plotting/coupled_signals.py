"""Figure of the signals of a coupled run over time."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from matplotlib import rc_context
from matplotlib.figure import Figure

from percussion_model.coupling.coupled_run import CoupledRun
from percussion_model.interface.plotting import style


class Panel(NamedTuple):
    """What a panel shows: its title, unit, SI units in one of those, and names of its signals."""

    title: str
    unit: str
    factor: float
    signals: dict[str, str]


MODE = "controller.mode"
# Room for a legend above the lines, as a share of their range.
ROOM_OF_LEGEND = 0.35
# A panel is drawn where the run has one of its signals.
PANELS = (
    Panel("Stiffness of the rock under the bit (loading stiffness $K_R$)", "kN/mm", 1e-6,
          {"rock.loading_stiffness": ""}),
    Panel("Depth of the bit", "mm", 1e3, {"hammer.bit.position": ""}),
    Panel("Rate of penetration by the last blow", "mm/s", 1e3,
          {"hammer.rate_of_penetration": ""}),
    Panel("Feed force on the bit", "kN", 1e-3,
          {"string.feed_force_mean": "filtered", "controller.feed_wanted": "wanted"}),
    Panel("Force of the rig on the head of the string", "kN", 1e-3,
          {"rig.force": "as it is", "controller.force_command": "asked for"}),
    Panel("Pressure of the supply", "bar", 1e-5,
          {"supply.supply_pressure": "as it is",
           "controller.pressure_command": "asked for"}),
    Panel("What the controller does", "", 1.0, {MODE: ""}),
)  # fmt: skip
# By the number of its mode.
MODES = ("drills", "in a void", "retracts")


def save_signals(run: CoupledRun, path: Path, title: str) -> Path:
    """Draw what a drilling system has of the usual signals; return the PNG file."""
    with rc_context(style.STYLE):
        return style.save_png(draw_signals(run, title), path, dpi=110)


def draw_signals(run: CoupledRun, title: str) -> Figure:
    """Draw a panel for each of the usual signals, or the first four of a system that has none."""
    kept = set(run.columns)
    panels = [panel for panel in PANELS if kept & set(panel.signals)]
    if not panels:
        panels = [Panel("", "", 1.0, dict.fromkeys(list(run.columns)[1:5], "signal"))]
    figure = Figure(figsize=(8.0, 1.0 + 1.7 * len(panels)), layout="constrained")
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)
    for ax, panel in zip(axes[:, 0], panels, strict=True):
        names = [name for name in panel.signals if name in kept]
        for name in names:
            label = f"{panel.signals[name]}: {name}"
            ax.plot(run["time"], panel.factor * run[name], linewidth=1.1, label=label)
        unit = f" [{panel.unit}]" if panel.unit else ""
        ax.set_title(panel.title + unit, loc="left")
        if names == [MODE]:
            ax.set_yticks(range(len(MODES)), MODES)
            ax.set_ylim(-0.4, len(MODES) - 0.6)
        if any(panel.signals.values()):
            ax.legend(loc="upper right", ncols=2)
            style.room_above(ax, ROOM_OF_LEGEND)
    axes[-1, 0].set_xlabel("time [s]")
    style.head(figure, f"{title}: signals of a coupled run")
    return figure
