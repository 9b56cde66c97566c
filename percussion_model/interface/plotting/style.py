"""Common style of all figures: colours, units, lines coloured by drilling mode, saving."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.rcsetup import cycler

from percussion_model.interface.progress import Report
from percussion_model.physics.records import Mode
from percussion_model.scene.writing import is_special
from percussion_model.simulation.files import staged, staged_file

# Okabe and Ito's colours, told apart with any colour vision and in grey.
MODE_COLOURS = {
    Mode.FF: "#56B4E9",
    Mode.DFC: "#E69F00",
    Mode.FC: "#D55E00",
    Mode.BC: "#009E73",
    Mode.SS: "#222222",
}
MODE_NAMES = {
    Mode.FF: "FF free flight",
    Mode.DFC: "DFC dissipative forward contact",
    Mode.FC: "FC forward contact",
    Mode.BC: "BC backward contact",
    Mode.SS: "SS standstill",
}
# The short modes are drawn on top.
_DRAWING_ORDER = (Mode.FF, Mode.SS, Mode.BC, Mode.FC, Mode.DFC)
# The same for lines that are told apart by colour alone, the strongest first.
LINE_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#222222")
PISTON_COLOUR = "#CC79A7"
BIT_COLOUR = "#0072B2"
CONTACT_COLOUR = "#CC79A7"
MEAN_COLOUR = "#D55E00"
SHADE_COLOUR = "#D9D9D9"
RULE_COLOUR = "#8C8C8C"

# Legend entries that fit side by side.
MOST_IN_A_ROW = 6

# Factors from SI to what the axes say.
MM = MS = 1e3
US = 1e6
# SI values are divided by these.
KN = 1e3
MPA = 1e6

STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.xmargin": 0.02,
    "axes.prop_cycle": cycler(color=LINE_COLOURS),
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.3,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.dpi": 100,
    "savefig.dpi": 150,
    "savefig.facecolor": "white",
    "path.simplify": True,
    "path.simplify_threshold": 0.2,
    "svg.hashsalt": "percussion_model",
    "image.interpolation": "nearest",
}


def label(ax: Axes, x: str, y: str, title: str = "") -> None:
    """Name both axes, each with its unit, and the panel."""
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    if title:
        ax.set_title(title)


def draw_by_mode(ax: Axes, x: np.ndarray, y: np.ndarray, mode: np.ndarray) -> None:
    """Draw a line whose colour is the drilling mode.

    A piece from one sample to the next has the mode of the first. Each mode is
    one line with gaps, so that matplotlib can thin it out.
    """
    for value, xs, ys in by_mode(x, y, mode):
        ax.plot(xs, ys, color=MODE_COLOURS[value], zorder=2 + 0.1 * _DRAWING_ORDER.index(value))


def by_mode(
    x: np.ndarray, y: np.ndarray, modes: np.ndarray
) -> Iterator[tuple[Mode, np.ndarray, np.ndarray]]:
    """Divide a line by drilling mode: each mode that occurs, and its line with gaps of NaN."""
    for mode in MODE_COLOURS:
        mine = modes == mode
        if mine.any():
            # The sample after a run of this mode closes its last piece.
            shown = mine.copy()
            shown[1:] |= mine[:-1]
            yield mode, *_with_gaps(x, y, shown)


def _with_gaps(x: np.ndarray, y: np.ndarray, shown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Keep what is shown, with one NaN between its runs."""
    index = np.flatnonzero(shown)
    breaks = np.flatnonzero(np.diff(index) > 1) + 1
    return (
        np.insert(np.asarray(x, float)[index], breaks, np.nan),
        np.insert(np.asarray(y, float)[index], breaks, np.nan),
    )


def mode_handles(modes: Sequence[int] | np.ndarray) -> list[Line2D]:
    """Legend entries of the drilling modes that occur."""
    present = {int(value) for value in modes}
    return [
        Line2D([], [], color=colour, linewidth=3, label=MODE_NAMES[mode])
        for mode, colour in MODE_COLOURS.items()
        if int(mode) in present
    ]


def contact_handle() -> Patch:
    """Legend entry of the shading of closed piston/bit contacts."""
    return Patch(facecolor=SHADE_COLOUR, label="piston on bit")


def shade_contacts(ax: Axes, contacts: Sequence[tuple[float, float]], scale: float) -> None:
    """Shade closed piston/bit contacts; those of no length become a line."""
    for start, end in contacts:
        if end > start:
            ax.axvspan(start * scale, end * scale, color=SHADE_COLOUR, linewidth=0, zorder=0)
        else:
            ax.axvline(start * scale, color=SHADE_COLOUR, linewidth=2.5, zorder=0)


def room_above(ax: Axes, share: float) -> None:
    """Leave room above what is drawn, for words; a share of its range."""
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + share * (high - low))


def head(fig: Figure, title: str, handles: Sequence[Any] = ()) -> None:
    """Write the figure's title and, below it, one legend for all panels."""
    fig.suptitle(title, x=0.01, ha="left", fontsize=11.5, fontweight="bold")
    if handles:
        rows = math.ceil(len(handles) / MOST_IN_A_ROW)
        ncols = math.ceil(len(handles) / rows)
        fig.legend(handles=list(handles), loc="outside lower center", ncols=ncols)


def save_figures(
    draw: Callable[[], Iterable[tuple[str, Figure]]],
    folder: str | Path,
    kinds: Sequence[str] = ("png", "svg"),
    names: Sequence[str] = (),
    report: Report | None = None,
    dpi: float | None = None,
) -> list[Path]:
    """Draw figures in this style and write all of them into a folder, or none.

    Parameters
    ----------
    draw : callable
        Returns or yields name and figure; it is called, and gone through, in this style.
    folder : str or Path
        Made if it is not there.
    kinds : sequence of str
        Endings of the files that are written of each figure.
    names : sequence of str
        Of the figures that are to come, for `report`.
    report : callable, optional
        Is told which figure is drawn.
    dpi : float, optional
        Pixels by inch, where not those of the style.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    ResultError
        If the folder cannot be written.
    """
    folder = Path(folder)
    files: list[str] = []
    with staged(folder) as draft, rc_context(STYLE):
        drawn, count = iter(draw()), len(names)
        for k in itertools.count():
            if report is not None and k < count:
                # no share of the time: one may take ten times as long as another
                report(f"drawing figure {k + 1} of {count}, {names[k]}", None)
            one = next(drawn, None)
            if one is None:
                break
            files += save(one[1], draft, one[0], kinds, dpi)
    return [folder / name for name in files]


def save(
    fig: Figure,
    folder: Path,
    name: str,
    kinds: Sequence[str] = ("png", "svg"),
    dpi: float | None = None,
) -> list[str]:
    """Write a figure as PNG and SVG and return the names of the files."""
    fig.draw_without_rendering()
    fig.set_layout_engine("none")  # laid out once, not again for each file
    names = [f"{name}.{kind}" for kind in kinds]
    for file, kind in zip(names, kinds, strict=True):
        fig.savefig(folder / file, dpi=dpi, metadata=_METADATA[kind])
    return names


def shown_in_notebooks(fig: Figure) -> Figure:
    """Let notebooks show a figure that pyplot does not know; return it."""
    fig.__dict__["_repr_png_"] = partial(_png, fig)
    return fig


def _png(fig: Figure) -> bytes:
    picture = BytesIO()
    with rc_context(STYLE):
        fig.savefig(picture, format="png", dpi=STYLE["figure.dpi"], metadata=_METADATA["png"])
    return picture.getvalue()


def save_png(fig: Figure, path: Path, dpi: float) -> Path:
    """Write one figure as PNG in the style it was drawn in, whole or not at all.

    Parameters
    ----------
    fig : Figure
    path : Path
        Its folder is made if it is not there.
    dpi : float
        Pixels by inch.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ResultError
        If it cannot be written.
    """
    if is_special(path):
        picture = BytesIO()
        fig.savefig(picture, format="png", dpi=dpi, metadata=_METADATA["png"])
        staged_file(path, picture.getvalue())
        return path
    with staged(path.absolute().parent) as draft:
        fig.savefig(draft / path.name, format="png", dpi=dpi, metadata=_METADATA["png"])
    return path


# Without a date the same result gives the same file.
_METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": "percussion_model"},
    "svg": {"Date": None, "Creator": "percussion_model"},
    "pdf": {"CreationDate": None, "Creator": "percussion_model", "Producer": "percussion_model"},
}
