"""Rock found as the bit goes on, and what that is worth: `python -m scenarios.rock_following`.

Three controllers drill soft, hard and soft rock: set points held, the seeker of the best rate, and
set points that follow the rock as the filter tells it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from percussion_model import Scene
from percussion_model.analysis.identify.drill import drill_of
from percussion_model.analysis.identify.filter import Noise, RockFilter
from percussion_model.analysis.identify.part import to_numbers
from percussion_model.analysis.identify.prior import prior_of
from percussion_model.analysis.identify.tabulate import REACH, tabulate
from percussion_model.coupling import CoupledRun, Coupling
from percussion_model.interface.progress import progress
from percussion_model.scene.text import read_toml

from .coupled import print_columns, save_runs, whole
from .drawing import in_style
from .results import command_line, system, tell

NAME = "rock_following"
STEP, DURATION = 2e-3, 40.0  # [s]; peaks are those of a step, so rows are as often
SYSTEM = Path(__file__).with_name("systems") / f"{NAME}.toml"
# What the filter's table holds: pressure [Pa], feed on the bit [N].
PRESSURE, FEED = (1.2e6, 2.2e6), (3000.0, 13000.0)
ROCK = "st-anne-limestone"
POINTS = 60
# Of a sample over half a second: whole blows come and go in it.
NOISE = Noise(0.05, 0.02, 0.1)
HELD: dict[str, float | bool] = {
    "filter.follow.on": False, "filter.follow.pressure": 18e5, "filter.follow.feed": 8000.0,
}  # fmt: skip
CASES: dict[str, dict[str, float | bool]] = {
    "held": HELD,
    "sought": {**HELD, "controller.seek.on": True, "controller.seek.pressure_on": True,
               "controller.seek.period": 3.0, "controller.seek.wait": 3.0,
               "controller.seek.pressure_highest": 1.9e6, "controller.seek.lowest": 4000.0,
               "controller.seek.highest": 12000.0},
    "followed": {},
}  # fmt: skip
# Fatigue of steel counts loads by about this power of their height.
FATIGUE = 5.0
SIGNALS = (
    "hammer.bit.force_peak", "hammer.blow_count", "hammer.bit.position", "supply.energy",
    "filter.apparent_energy", "filter.apparent_energy_low", "filter.apparent_energy_high",
    "controller.mode",
    "supply.supply_pressure", "string.feed_force_mean", "rock.crushing_energy", "filter.layers",
)  # fmt: skip
SHOWN = {
    "rate": ("rate", 3600.0, "m/h"),
    "energy": ("energy of the supply for a metre", 1e-6, "MJ/m"),
    "blows": ("blows for a metre", 1e-3, "thousand"),
    "peak": ("mean of peak forces", 1e-3, "kN"),
    "wear": ("blows for a metre by force to the power 5", 1.0, "of held"),
}


def numbers() -> dict[str, float]:
    """Table, prior and noise of the filter in this system, from runs of rigid bodies."""
    tree = read_toml(SYSTEM)
    own = tree["parameters"]["hammer"]
    scene = Scene.from_toml(SYSTEM.parents[1] / "hammers" / f"{tree['hammer']}.toml")
    speed = tree["parameters"]["rig"]["rotation.speed"]
    scene = scene.replace(**own, **{"rotation.speed": speed})
    drill = drill_of(scene, pressure=scene["drive.force"] / AREA)
    prior = prior_of(scene, ROCK)
    ends = {
        name: (math.exp(prior.mean[k] - off), math.exp(prior.mean[k] + off))
        for k, name in ((1, "unloading_ratio"), (2, "loading_stiffness"))
        for off in [REACH * prior.spread[k]]
    }
    ranges = {"pressure": PRESSURE, "feed": FEED, **ends}
    table = tabulate(scene, drill.changes, ranges, points=POINTS, with_splines=False)
    return to_numbers(RockFilter(table, prior.mean, prior.spread, NOISE))


# Area on which pressure drives the piston, as the FMU of this hammer has it [m^2].
AREA = 0.0059


def run(archive: Path, values: Mapping[str, float | bool], duration: float) -> CoupledRun:
    """Run one case."""
    return whole(Coupling(archive, values).run(duration, STEP, SIGNALS, STEP, tell=tell))


def scores(found: CoupledRun, since: float = 2.0) -> dict[str, float]:
    """Rate, energy, blows and loads of a run after a time [s]."""
    late = found["time"] >= since
    depth = found["hammer.bit.position"][late]
    blows = np.diff(found["hammer.blow_count"][late])
    peaks = found["hammer.bit.force_peak"][late][1:]
    way = depth[-1] - depth[0]
    struck = blows > 0
    return {
        "rate": way / (found["time"][late][-1] - since),
        "energy": float(np.ptp(found["supply.energy"][late])) / way,
        "blows": float(blows.sum()) / way,
        "peak": float(np.mean(peaks[struck])),
        "wear": float(np.sum(blows[struck] * peaks[struck] ** FATIGUE)) / way,
    }


@in_style
def draw(runs: Mapping[str, CoupledRun], path: Path) -> Path:
    """Draw what the filter tells over depth, and pressure and feed of all runs."""
    from matplotlib.figure import Figure

    from percussion_model.interface.plotting.style import head, label, save_png

    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    rock, pressure, feed = figure.subplots(3, 1, sharex=True)
    found = runs["followed"]
    depth, share = 1e3 * found["hammer.bit.position"], 0.64
    low, high = (1e-6 * found[f"filter.apparent_energy_{end}"] for end in ("low", "high"))
    rock.fill_between(depth, low, high, alpha=0.25, linewidth=0, label="interval of 95 %")
    rock.plot(depth, 1e-6 * found["filter.apparent_energy"], label="shown by the filter")
    rock.plot(depth, 1e-6 * found["rock.crushing_energy"] / share, "k--", label="rock")
    rock.set_ylim(0.0, 260.0)
    rock.legend(loc="upper right", ncols=3)
    for name, one in runs.items():
        way = 1e3 * one["hammer.bit.position"]
        pressure.plot(way, 1e-5 * one["supply.supply_pressure"], label=name)
        feed.plot(way, 1e-3 * one["string.feed_force_mean"])
    pressure.legend(loc="lower right", ncols=3)
    label(rock, "", "energy / efficiency [MJ/m³]")
    label(pressure, "", "pressure [bar]")
    label(feed, "depth [mm]", "feed on the bit [kN]")
    head(figure, "Rock shown as the bit goes on, and what follows it")
    return save_png(figure, path, 110)


def main(paths: Sequence[Path], folder: Path) -> list[Path]:
    """Write figure and data, and print what each controller comes to."""
    (archive,) = paths
    runs = {}
    for name, values in CASES.items():
        with progress(f"drilling, {name}"):
            runs[name] = run(archive, values, DURATION)
    found = {name: scores(one) for name, one in runs.items()}
    held = found["held"]["wear"]
    for one in found.values():
        one["wear"] /= held
    print_columns(found, SHOWN)
    return [draw(runs, folder / f"{NAME}.png"), *save_runs(runs, NAME, folder)]


if __name__ == "__main__":
    command_line(NAME, __doc__, [system("RockFollowing")], main)
