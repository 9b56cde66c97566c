"""A top hammer meets a soft layer, its string watched: `python -m scenarios.top_hammer_feed`.

In soft rock the bit runs ahead of a feed that is short of oil, so its contact with the rock
gets poor and blows come back as tension, which opens the threads. A controller reads a strain
gauge on the last rod every 10 ms: it holds the feed, and takes supply pressure back while the
tension is above a limit.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from percussion_model.interface.progress import progress
from percussion_model.scene.hammers import hammer

from .coupled import Quantity, draw_runs, print_columns, save_table
from .harness import Instance
from .results import DIST, Archive, command_line

NAME = "top_hammer_feed"
FMU = DIST / "TopHammer.fmu"
RODS = 3
GAUGE = f"rod {RODS + 1}"  # the last one; the first bar below the piston is the shank
DURATION, PERIOD = 4.5, 0.01  # of a run, and of the controller [s]
SAMPLES = 100  # of the gauge in a period: a wave of the piston is 0.2 ms long
FIRM, SOFT = 6.9e8, 1.5e8  # K_R [N/m]
LAYER = 0.04, 0.22  # the soft layer by depth of the bit [m]

FULL, LEAST = 20e5, 8e5  # supply pressure [Pa]
LIMIT = 60e6  # of the tension in the last rod [Pa]
MEMORY = 5  # periods of which the greatest tension counts: three blows
PRESSURE_TIME, FEED_TIME = 0.3, 0.15  # in which pressure and feed follow what is wanted [s]

FEED = 10e3  # wanted [N]
PUSH = 15e3  # the most that the rig's cylinder gives at rest [N]
SHORTFALL = 8e4  # of it by the speed of the string: the pump gives so much oil alone [N s/m]
SPEED_TIME = 0.05  # in which that follows [s]
SPEED = 0.055  # of the string at the start [m/s]

Run = dict[str, np.ndarray]
# Label with unit, factor and column of each panel; columns of `simulate`.
PANELS = (
    ("loading stiffness $K_R$ of the rock [kN/mm]", 1e-6, "rock.loading_stiffness"),
    ("depth of the bit [mm]", 1e3, "depth"),
    ("feed force [kN]", 1e-3, "feed_force"),
    ("supply pressure [bar]", 1e-5, "supply_pressure"),
    ("greatest tension in the last rod, of the last 50 ms [MPa]", 1e-6, "tension"),
)
# Numbers as they are printed: words, factor, unit.
SHOWN: dict[str, Quantity] = {
    "entered": ("the bit enters the soft layer at", 1.0, "s"),
    "crossing": ("and is through it after", 1.0, "s"),
    "feed": ("mean feed in its lower half", 1e-3, "kN"),
    "energy": ("mean energy of a blow there", 1.0, "J"),
    "tension": ("mean of the greatest tension there", 1e-6, "MPa"),
    "back": ("rate of penetration at the end, in firm rock again", 1e3, "mm/s"),
}
LATE = 0.5  # the last part of a run, for its rate [s]


def preload() -> float:
    """Preload of the thread below the last rod, as a tension in the rod [Pa]."""
    rod = hammer("t38", RODS).bars[GAUGE]
    return float(rod.preload / rod.sections[-1].area)


class Rig:
    """Feed cylinder whose pump gives so much oil alone: the faster, the less force."""

    def __init__(self) -> None:
        self.feed = FEED
        self._speed, self._depth = SPEED, 0.0

    def push(self, command: float, depth: float) -> float:
        """Feed force [N] for the next period, of a command [N] and the depth reached [m]."""
        self._speed += PERIOD / SPEED_TIME * ((depth - self._depth) / PERIOD - self._speed)
        self._depth = depth
        self.feed = max(0.0, command - SHORTFALL * self._speed)
        return self.feed


class Controller:
    """Holds the feed; takes pressure back while tension is above its limit."""

    def __init__(self, watches: bool) -> None:
        self.command, self.pressure = FEED + SHORTFALL * SPEED, FULL
        self._watches = watches
        self._last: deque[float] = deque([0.0], maxlen=MEMORY)

    @property
    def tension(self) -> float:
        """Greatest tension of late [Pa]."""
        return max(self._last)

    def react(self, feed: float, tension: float) -> None:
        """Take the feed [N] and the greatest tension [Pa] of the last period."""
        self.command += PERIOD / FEED_TIME * (FEED - feed)
        self.command = min(max(self.command, 0.0), PUSH)
        self._last.append(tension)
        if self._watches:
            self.pressure -= PERIOD / PRESSURE_TIME * (self.tension / LIMIT - 1.0) * FULL
            self.pressure = min(max(self.pressure, LEAST), FULL)


def build(path: Path = FMU) -> None:
    """Make the FMU of the T38 drifter with three rods."""
    from fmu_src.hammer.build import build_hammer

    path.parent.mkdir(parents=True, exist_ok=True)
    # the hole gains what buttons press in: four times as fast as drills, which spares time
    scene = hammer("t38", RODS).replace(**{"effects.breaking": False, "effects.rotation": False})
    build_hammer(scene, path)


def simulate(fmu: Path, watches: bool = True, duration: float = DURATION) -> Run:
    """One run; without watching, the pressure stays full.

    Returns
    -------
    dict of ndarray
        A row for each period of the controller: "time" at its end [s], "depth" that the bit
        has reached [m], "tension", the greatest of late [Pa], "blow_energy" of the last blow
        [J]; and the inputs that acted in it, by their names.
    """
    rig, controller, rows, depth = Rig(), Controller(watches), [], 0.0
    with Instance(fmu) as instance:
        instance.set({"gauge.bar": GAUGE})
        instance.start(rock__loading_stiffness=FIRM, feed_force=FEED, supply_pressure=FULL)
        for k in range(round(duration / PERIOD)):
            inputs = {
                "feed_force": rig.push(controller.command, depth),
                "supply_pressure": controller.pressure,
                "rock.loading_stiffness": SOFT if LAYER[0] <= depth < LAYER[1] else FIRM,
            }
            instance.set(inputs)
            least = 0.0
            for j in range(SAMPLES):
                instance.time = PERIOD * (k + j / SAMPLES)
                instance.step(PERIOD / SAMPLES)
                least = min(least, instance.get("gauge_stress"))
            depth = max(depth, instance.get("bit.position"))
            controller.react(rig.feed, -least)
            seen = (PERIOD * (k + 1), depth, controller.tension, instance.get("blow_energy"))
            rows.append((*seen, *inputs.values()))
    names = ("time", "depth", "tension", "blow_energy", *inputs)
    return dict(zip(names, np.array(rows).T, strict=True))


def numbers(found: Run) -> dict[str, float]:
    """What the soft layer does; the names are those of `SHOWN`, in SI units."""
    time, soft = found["time"], found["rock.loading_stiffness"] == SOFT
    lower = soft & (found["depth"] > np.mean(LAYER))  # by then the controller has settled
    late = time > time[-1] - LATE
    return {
        "entered": float(time[soft][0]),
        "crossing": float(np.count_nonzero(soft) * PERIOD),
        "feed": float(found["feed_force"][lower].mean()),
        "energy": float(found["blow_energy"][lower].mean()),
        "tension": float(found["tension"][lower].mean()),
        "back": float(np.ptp(found["depth"][late]) / np.ptp(time[late])),
    }


def draw(runs: Mapping[str, Run], path: Path) -> Path:
    """Draw the runs over time."""
    return draw_runs(
        path,
        "A soft layer: less pressure keeps tension out of the string",
        runs,
        PANELS,
        {
            "feed_force": [(1e-3 * FEED, "wanted")],
            "tension": [(1e-6 * LIMIT, "limit"), (1e-6 * preload(), "preload of\na thread")],
        },
    )


def main(paths: Sequence[Path], folder: Path) -> list[Path]:
    """Write figure and data, and print what the soft layer does."""
    with progress("drilling through a soft layer, twice"):
        runs = {
            "tension watched": simulate(*paths),
            "pressure constant": simulate(*paths, watches=False),
        }
    print_columns({label: numbers(found) for label, found in runs.items()}, SHOWN)
    tables = [
        save_table(found, folder / f"{NAME}_{label.replace(' ', '_')}.csv")
        for label, found in runs.items()
    ]
    return [draw(runs, folder / f"{NAME}.png"), *tables]


if __name__ == "__main__":
    command_line(NAME, __doc__, [Archive("HAMMER.fmu", FMU, "modelDescription.xml", build)], main)
