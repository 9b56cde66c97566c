"""The same gauge pressure from the sea to 4,000 m: `python -m scenarios.hammer_at_altitude`.

A 5-inch hammer with chambers of air and its supply, each in an FMU of its own. The hammer takes
about the same mass of air and gives the same power; its compressor has to take in thinner air,
and to compress it further.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from percussion_model.interface.progress import progress
from percussion_model.scene.hammers import atmosphere

from .compressor_too_small import AMPLE, ARCHIVES, couple, numbers, whole_blows
from .coupled import Quantity, print_columns, save_table
from .drawing import in_style, stacked
from .results import command_line

NAME = "hammer_at_altitude"
HEIGHTS = tuple(range(0, 4001, 500))  # [m]
DURATION, LATE = 2.5, 2.0  # of a run, and of its end for means [s]
TOLD = (0, 2000, 4000)  # heights whose numbers are printed [m]
# Label with unit, factor and column of each panel.
PANELS: tuple[Quantity, ...] = (
    ("air that the hammer takes, by mass [kg/s]", 1.0, "air"),
    ("air that the compressor takes in [m³/min]", 60.0, "intake"),
    ("power of the blows [kW]", 1e-3, "power"),
    ("power that the compressor takes, 60 % efficient [kW]", 1e-3, "compressor"),
)
SHOWN: dict[str, Quantity] = {
    "pressure": ("pressure at the hammer", 1e-5, "bar"),
    "air": ("air that the hammer takes", 1.0, "kg/s"),
    "intake": ("air that the compressor takes in", 60.0, "m³/min"),
    "frequency": ("blows", 1.0, "1/s"),
    "power": ("power of the blows", 1e-3, "kW"),
    "compressor": ("power that the compressor takes, 60 % efficient", 1e-3, "kW"),
}


def simulate(
    hammer: Path, supply: Path, heights: Sequence[float] = HEIGHTS
) -> dict[str, np.ndarray]:
    """Means of a run at each height, by name, with "height" [m]; else as `numbers`.

    And intake, the air taken in at the place's pressure [m^3/s], and compressor, its power [W].
    """
    rows = []
    for height in heights:
        around = atmosphere(height)[0]
        found = couple(
            hammer, supply, DURATION, {"pneumatic.ambient_pressure": around},
            {"ambient.pressure": around, "compressor.flow_limit": AMPLE},
        )  # fmt: skip
        late = whole_blows(found, LATE)
        power = np.ptp(found["energy"][late]) / np.ptp(found["time"][late])
        means = {"intake": found["flow"][late].mean(), "compressor": power}
        rows.append({"height": height, **numbers(found, LATE), **means})
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


@in_style
def draw(found: Mapping[str, np.ndarray], path: Path) -> Path:
    """Draw all over the height, each panel from zero."""
    from percussion_model.interface.plotting.style import save_png

    labels = [label for label, _, _ in PANELS]
    title = "Altitude at 24 bar: the hammer stays as it is, its compressor does not"
    figure, axes = stacked(title, labels, (8.0, 1.0 + 1.8 * len(PANELS)))
    for ax, (_, factor, name) in zip(axes, PANELS, strict=True):
        ax.plot(found["height"], factor * found[name], marker="o", markersize=4, linewidth=1.2)
        ax.set_ylim(0.0, 1.2 * factor * found[name].max())
    axes[-1].set_xlabel("altitude [m]")
    return save_png(figure, path, 110)


def main(paths: Sequence[Path], folder: Path) -> list[Path]:
    """Write figure and data, and print what there is at some heights."""
    with progress("drilling at nine altitudes"):
        found = simulate(*paths)
    at = {f"{height} m": list(found["height"]).index(height) for height in TOLD}
    columns = {label: {name: float(found[name][k]) for name in SHOWN} for label, k in at.items()}
    print_columns(columns, SHOWN)
    return [draw(found, folder / f"{NAME}.png"), save_table(found, folder / f"{NAME}.csv")]


if __name__ == "__main__":
    command_line(NAME, __doc__, ARCHIVES, main)
