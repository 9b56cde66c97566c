"""One computed blow of a rig, and what is read off it as it was off the experiment."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from percussion_model.physics.records import Mode
from percussion_model.scene.scene import Scene
from percussion_model.simulation.gauge import gauge_stress
from percussion_model.simulation.simulate import Simulation

# Time step of the waves, and from sample to sample [s]: a hundredth of the shortest time read.
TIME_STEP = 2.5e-7
SAMPLE_STEP = 2.5e-7
# Slopes are taken between these shares of the greatest value.
SLOPE_FROM, SLOPE_TO = 0.1, 0.9
# A slope needs so many samples.
LEAST_SAMPLES = 3


@dataclass(frozen=True)
class Reading:
    """How a blow is read."""

    gauge: float | None = None  # from the top of the bit [m]; None: its middle
    end: bool = False  # whether speeds are those of the bit's lower end in place of its mean
    # share of the greatest displacement to which the slope of indentation is taken
    slope_to: float = SLOPE_TO


@dataclass(frozen=True, repr=False)
class Blow:
    """One blow, sampled; times count from the start of the run."""

    scene: Scene
    time: np.ndarray  # shape (n,), [s]
    mean: np.ndarray  # shape (n,), displacement of the bit's mean, down positive [m]
    end: np.ndarray  # shape (n,), that of its lower end [m]
    force: np.ndarray  # shape (n,), on the rock [N]
    in_flight: np.ndarray  # shape (n,), where the bit is off the rock
    struck: np.ndarray  # shape (n,), where the piston is on the bit

    def __repr__(self) -> str:
        return f"Blow({len(self.time)} samples to {self.time[-1]:.3g} s)"


def resolved(scene: Scene, step: float = TIME_STEP) -> Scene:
    """The scene by waves, with cells that such a time step crosses [s]."""
    first = next(iter(scene.bars.values()))
    transit = sum(one.length / one.wave_speed for one in first.sections)
    cells = max(1, round(transit / step))
    return scene.replace(**{"solver.name": "wave", "solver.cells": cells})


def at_speed(scene: Scene, speed: float | None) -> Scene:
    """The scene with another velocity of its piston [m/s]; None: as it is."""
    return scene if speed is None else scene.replace(**{"start.piston_velocity": speed})


def strike(scene: Scene) -> Blow:
    """Compute a blow.

    Parameters
    ----------
    scene : Scene
        As `resolved` makes it.
    """
    count = math.ceil(scene.run.duration / SAMPLE_STEP) + 1
    time = np.linspace(0.0, scene.run.duration, count)
    seen = Simulation(scene, record_events=False).sample(time)
    return Blow(
        scene, time, seen["bit_position"], seen["bit_end_position"], seen["bit_force"],
        seen["drilling_mode"] == Mode.FF, np.nan_to_num(seen["contact_force"]) > 0.0,
    )  # fmt: skip


def gauge_record(scene: Scene, times: np.ndarray, gauge: float | None) -> np.ndarray:
    """Stress at the gauge, compression positive [Pa]."""
    return gauge_stress(Simulation(scene, record_events=False), times, gauge)


def first_wave(scene: Scene, gauge: float | None) -> float:
    """Greatest stress before a wave can be back from the bit's lower end [Pa]."""
    place = 0.5 * scene.bit.length if gauge is None else gauge
    down = _transit(scene, 0.0, place)
    back = _transit(scene, 0.0, scene.bit.length) + _transit(scene, place, scene.bit.length)
    times = np.arange(down, back, SAMPLE_STEP)
    return float(gauge_record(scene, times, gauge).max())


def _transit(scene: Scene, above: float, below: float) -> float:
    """Time that a wave takes from one place of the bit to another [s]."""
    total, top = 0.0, 0.0
    for section in scene.bit.sections:
        bottom = top + section.length
        part = min(bottom, below) - max(top, above)
        total += max(part, 0.0) / section.wave_speed
        top = bottom
    return total


def deepest(blow: Blow) -> int:
    """Sample of the greatest penetration."""
    return int(np.argmax(blow.end))


def indentation(blow: Blow, how: Reading) -> tuple[slice, float]:
    """Samples from 10 to 90 % of the greatest displacement, and the slope there [m/s]."""
    path = blow.end if how.end else blow.mean
    most = int(np.argmax(path))
    rising = path[: most + 1] / path[most]
    start, stop = (int(np.argmax(rising >= share)) for share in (SLOPE_FROM, how.slope_to))
    return slice(start, stop + 1), _slope(blow.time, path, slice(start, stop + 1))


def rebound(blow: Blow, how: Reading) -> tuple[slice, float]:
    """Samples of the longest free flight that follows, and the upward velocity in it [m/s].

    From the greatest penetration until the piston strikes the bit again, which it may meet on its
    way up; NaN where there is none.
    """
    path = blow.end if how.end else blow.mean
    free = blow.in_flight & ~blow.struck
    free[: deepest(blow)] = False
    if free.any():
        first = int(np.argmax(free))
        again = blow.struck[first:]
        free[first + int(np.argmax(again)) if again.any() else len(free) :] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(int)))
    flights = list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
    if not flights:
        return slice(0, 0), math.nan
    first, end = max(flights, key=lambda one: one[1] - one[0])
    longest = slice(first, end - 1)  # in the last one the flight may have ended
    return longest, -_slope(blow.time, path, longest)


def _slope(time: np.ndarray, path: np.ndarray, part: slice) -> float:
    if len(time[part]) < LEAST_SAMPLES:
        return math.nan
    return float(np.polyfit(time[part] - time[part][0], path[part], 1)[0])


def _residual(blow: Blow) -> float:
    """Penetration [m] where the line of the last two forces of contact has come to nothing.

    Forces are means of time steps, so the middles of these are their places.
    """
    most = deepest(blow)
    gone = blow.force[most:] <= 0.0
    if not gone.any():
        return math.nan
    first = most + int(np.argmax(gone))
    one, other = 0.5 * (blow.end[first - 3 : first - 1] + blow.end[first - 2 : first])
    before, last = blow.force[first - 2 : first]
    falls = before > last
    return float(other - last * (one - other) / (before - last) if falls else blow.end[first])


def _loading_stiffness(blow: Blow) -> float:
    """Slope of force over penetration from 10 to 90 % of the peak force while it rises [N/m]."""
    most = int(np.argmax(blow.force))
    share = blow.force[: most + 1] / blow.force[most]
    part = (share >= SLOPE_FROM) & (share <= SLOPE_TO)
    if np.count_nonzero(part) < LEAST_SAMPLES:
        return math.nan
    return float(np.polyfit(blow.end[: most + 1][part], blow.force[: most + 1][part], 1)[0])


def _secant(blow: Blow) -> float:
    """Peak force divided by the penetration then [N/m]."""
    most = int(np.argmax(blow.force))
    return float(blow.force[most] / blow.end[most])


_READERS: dict[str, Callable[[Blow, Reading], float]] = {
    "first_wave": lambda blow, how: first_wave(blow.scene, how.gauge),
    "indentation_velocity": lambda blow, how: indentation(blow, how)[1],
    "penetration": lambda blow, how: float(blow.end.max()),
    "residual_penetration": lambda blow, how: _residual(blow),
    "rebound_velocity": lambda blow, how: rebound(blow, how)[1],
    "restitution": lambda blow, how: rebound(blow, how)[1] / indentation(blow, how)[1],
    "loading_end": lambda blow, how: float(blow.time[deepest(blow)]),
    "peak_force": lambda blow, how: float(blow.force.max()),
    "loading_stiffness": lambda blow, how: _loading_stiffness(blow),
    "secant_stiffness": lambda blow, how: _secant(blow),
}


class Rig:
    """Blows of one rig, each computed once.

    Parameters
    ----------
    reading : Reading
    step : float
        Time step of the waves [s].
    """

    def __init__(self, reading: Reading, step: float = TIME_STEP) -> None:
        self.reading, self.step = reading, step
        self._blows: dict[Any, Blow] = {}

    def blow(self, scene: Scene, speed: float | None) -> Blow:
        """A blow at a speed of the piston [m/s]; None: that of the scene."""
        whole = resolved(at_speed(scene, speed), self.step)
        key = whole.to_toml()
        if key not in self._blows:
            self._blows[key] = strike(whole)
        return self._blows[key]

    def read(self, scene: Scene, quantity: str, speed: float | None) -> float:
        """What is read off a blow, SI units; NaN where there is no such thing."""
        return _READERS[quantity](self.blow(scene, speed), self.reading)
