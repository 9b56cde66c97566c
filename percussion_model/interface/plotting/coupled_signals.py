"""Figure of the signals of a coupled run over time."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from percussion_model.coupling.coupled_run import CoupledRun
from percussion_model.interface.plotting.style import save_png

# Label, factor, signals; a panel is drawn where the run has one of its signals.
PANELS = (
    ("K_R [kN/mm]", 1e-6, ("rock.loading_stiffness",)),
    ("bit [mm]", 1e3, ("hammer.bit.position",)),
    ("rate of a blow [mm/s]", 1e3, ("hammer.rate_of_penetration",)),
    ("feed force [kN]", 1e-3, ("string.feed_force_mean", "controller.feed_wanted")),
    ("rig force [kN]", 1e-3, ("rig.force", "controller.force_command")),
    ("pressure [bar]", 1e-5, ("supply.supply_pressure", "controller.pressure_command")),
    ("mode", 1.0, ("controller.mode",)),
)
MODES = ("drilling", "void", "retract")  # of the controller, by number


def save_signals(run: CoupledRun, path: Path, title: str) -> Path:
    """Draw what a drilling system has of the usual signals; return the PNG file."""
    panels = [
        (label, factor, [name for name in names if name in run.columns])
        for label, factor, names in PANELS
    ]
    panels = [panel for panel in panels if panel[2]] or [("", 1.0, list(run.columns)[1:5])]
    figure = Figure(figsize=(8.0, 1.0 + 1.5 * len(panels)))
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)
    for ax, (label, factor, names) in zip(axes[:, 0], panels, strict=True):
        for name in names:
            ax.plot(run["time"], factor * run[name], linewidth=1.1, label=name)
        ax.set_ylabel(label)
        if names == ["controller.mode"]:
            ax.set_yticks(range(len(MODES)), MODES)
            ax.set_ylim(-0.4, len(MODES) - 0.6)
        ax.grid(alpha=0.3)
        if len(names) > 1:
            ax.legend(fontsize="small", loc="best")
    axes[-1, 0].set_xlabel("time [s]")
    axes[0, 0].set_title(title)
    figure.align_ylabels()
    figure.tight_layout()
    return save_png(figure, path, dpi=110)
