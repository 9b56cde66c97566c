"""A compressor that gives 70 % of the air it takes: `python -m scenarios.compressor_too_small`.

A 5-inch hammer with chambers of air, in an FMU of its own, is fed by the supply's: compressor,
receiver and hose. Pressure falls until the hammer takes no more than there is, and frequency and
energy with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from percussion_model.interface.progress import progress
from percussion_model.scene.hammers import with_chambers

from .coupled import Quantity, draw_runs, print_columns, save_table
from .harness import Instance
from .results import DIST, Archive, command_line

NAME = "compressor_too_small"
PRESSURE = 24e5  # that the compressor is set to [Pa]
SHARE = 0.7  # of what the hammer takes, that the compressor gives
AMPLE = 2.0  # more than a hammer of this size takes [kg/s]
STEP = 1e-3  # [s]
DURATION, LATE = 20.0, 2.0  # of a run, and of its end for means [s]
STARTED = 0.3  # the figure begins when blows come evenly [s]
# A small receiver, so that the pressure settles within the run.
SUPPLY = {"medium": "air", "start.pressure": PRESSURE, "receiver.volume": 0.05}

Run = dict[str, np.ndarray]
OF_HAMMER = ("pneumatic.air", "pneumatic.consumed", "blow_frequency", "blow_energy",
             "blow_count", "impact_velocity", "hole_depth", "rate_of_penetration")  # fmt: skip
OF_SUPPLY = ("supply_pressure", "hose_pressure", "flow", "energy", "air_given", "air_lost",
             "air_stored")  # fmt: skip
PANELS = (
    ("pressure at the hammer, which swings with each blow [bar]", 1e-5, "supply_pressure"),
    ("air that the hammer takes, by blow [kg/s]", 1.0, "pneumatic.air"),
    ("blow frequency [1/s]", 1.0, "blow_frequency"),
    ("blow energy [J]", 1.0, "blow_energy"),
    ("rate of penetration, last blow [mm/s]", 1e3, "rate_of_penetration"),
)
SHOWN: dict[str, Quantity] = {
    "pressure": ("pressure at the hammer", 1e-5, "bar"),
    "air": ("air that the hammer takes", 1.0, "kg/s"),
    "frequency": ("blows", 1.0, "1/s"),
    "velocity": ("impact velocity", 1.0, "m/s"),
    "power": ("power of the blows", 1e-3, "kW"),
}


def build_hammer_of_air(path: Path = DIST / "AirHammer.fmu") -> None:
    """Make the FMU of a 5-inch hammer with chambers of air."""
    from fmu_src.hammer.build import build_hammer

    path.parent.mkdir(parents=True, exist_ok=True)
    build_hammer(with_chambers("dth5", PRESSURE), path)


def build_supply(path: Path = DIST / "Supply.fmu") -> None:
    """Make the FMU of the supply."""
    from fmu_src.parts.build import PARTS, build_part

    path.parent.mkdir(parents=True, exist_ok=True)
    build_part(PARTS["Supply"], path)


ARCHIVES = (
    Archive("HAMMER.fmu", DIST / "AirHammer.fmu", "modelDescription.xml", build_hammer_of_air),
    Archive("SUPPLY.fmu", DIST / "Supply.fmu", "modelDescription.xml", build_supply),
)


def couple(
    hammer: Path,
    supply: Path,
    duration: float,
    of_hammer: Mapping[str, float] | None = None,
    of_supply: Mapping[str, float] | None = None,
) -> Run:
    """Run hammer and supply side by side, coupled by pressure and air.

    Parameters
    ----------
    duration : float
        [s]
    of_hammer, of_supply : mapping, optional
        Parameters of both.

    Returns
    -------
    dict of ndarray
        "time" [s] and outputs of both after each step.
    """
    rows = []
    with Instance(hammer, "hammer") as drill, Instance(supply, "supply") as source:
        source.set({**SUPPLY, "pressure_command": PRESSURE, **(of_supply or {})})
        source.start()
        drill.set({"supply_pressure": source.get("supply_pressure"), **(of_hammer or {})})
        drill.start()
        for k in range(round(duration / STEP)):
            drill.time = source.time = k * STEP
            drill.set({"supply_pressure": source.get("supply_pressure")})
            drill.step(STEP)
            source.set({"air_used": drill.get("pneumatic.consumed")})
            source.step(STEP)
            rows.append([source.time, *drill.values(OF_HAMMER), *source.values(OF_SUPPLY)])
    return dict(zip(("time", *OF_HAMMER, *OF_SUPPLY), np.array(rows, float).T, strict=True))


def whole_blows(found: Run, late_time: float) -> np.ndarray:
    """Rows of the whole blows in the end of a run [s]."""
    count = found["blow_count"]
    first = count[found["time"] >= found["time"][-1] - late_time][0]
    return np.flatnonzero((count > first) & (count < count[-1]))


def numbers(found: Run, late_time: float = LATE) -> dict[str, float]:
    """Means of the end of a run [s]; the names are those of `SHOWN`, in SI units."""
    late = whole_blows(found, late_time)
    mean = {name: float(column[late].mean()) for name, column in found.items()}
    return {
        "pressure": mean["supply_pressure"],
        "air": mean["pneumatic.air"],
        "frequency": mean["blow_frequency"],
        "velocity": mean["impact_velocity"],
        "power": mean["blow_frequency"] * mean["blow_energy"],
    }


def simulate(hammer: Path, supply: Path, duration: float = DURATION) -> dict[str, Run]:
    """Runs with as much air as the hammer takes, and with a share of that."""
    ample = couple(hammer, supply, duration, of_supply={"compressor.flow_limit": AMPLE})
    limit = SHARE * numbers(ample)["air"]
    small = couple(hammer, supply, duration, of_supply={"compressor.flow_limit": limit})
    return {"as much as it takes": ample, f"{100 * SHARE:.0f} % of that": small}


def draw(runs: Mapping[str, Run], path: Path) -> Path:
    """Draw the runs over time."""
    ample = numbers(next(iter(runs.values())))["air"]
    title = "A compressor that is too small: the pressure falls until its air suffices"
    shown = {
        label: {name: column[found["time"] > STARTED] for name, column in found.items()}
        for label, found in runs.items()
    }
    return draw_runs(path, title, shown, PANELS, {"pneumatic.air": [(SHARE * ample, "given")]})


def main(paths: Sequence[Path], folder: Path) -> list[Path]:
    """Write figure and data, and print what the hammer has at the end."""
    with progress("drilling with two compressors"):
        runs = simulate(*paths)
    print_columns({label: numbers(found) for label, found in runs.items()}, SHOWN)
    names = ("ample", "small")
    tables = [
        save_table(found, folder / f"{NAME}_{name}.csv")
        for name, found in zip(names, runs.values(), strict=True)
    ]
    return [draw(runs, folder / f"{NAME}.png"), *tables]


if __name__ == "__main__":
    command_line(NAME, __doc__, ARCHIVES, main)
