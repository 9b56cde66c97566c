"""The joint likelihood of all measurements of a rock, each with a noise of its own."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from percussion_model.analysis.fitting.measurements import (
    Curve,
    DropTest,
    Reading,
    least_noise,
)
from percussion_model.analysis.fitting.predictions import bit_alone, predicted_reading
from percussion_model.analysis.fitting.sensor import CurveSensor, DropSensor, Sensor
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.scene import Scene

STIFFNESS, RATIO = "rock.loading_stiffness", "rock.unloading_ratio"
EXPONENT, UNLOADING = "rock.loading_exponent", "rock.unloading_exponent"
DAMPING, ENERGY = "rock.barrier_damping", "rock.barrier_energy"
# What a slow test tells; the barrier it does not.
SLOW = (STIFFNESS, EXPONENT, RATIO, UNLOADING)
# Coordinates of the search are logarithms, but of exponents, which are so already: those of
# powers, and so logarithms of what they do to a force.
EXPONENTS = (EXPONENT, UNLOADING)
# Points that are not computed again.
KEPT = 256


def coordinates(names: Sequence[str], values: Sequence[float]) -> np.ndarray:
    """Where values of parameters lie in the search."""
    return np.array(
        [
            value if name in EXPONENTS else math.log(value) if value > 0.0 else -math.inf
            for name, value in zip(names, values, strict=True)
        ]
    )


def values_at(name: str, at: Any) -> Any:
    """Value of a parameter at a coordinate of the search, or at several."""
    return at if name in EXPONENTS else np.exp(at)


def with_unit(scene: Scene, name: str, text: str) -> str:
    """A value of a parameter with its unit."""
    return f"{text} {scene.row_of(name).unit.replace('-', '')}".rstrip()


def decades(name: str, low: float, high: float) -> float:
    """How far two values are apart, in powers of ten of what they do to a force."""
    return high - low if name in EXPONENTS else math.log10(high / low)


@dataclass(frozen=True)
class Series:
    """Measurements whose common noise is unknown (`error` None), or one with a known error.

    The unknowns of a sensor follow its data in what the model says, by the widths of priors.
    """

    name: str
    data: np.ndarray
    error: float | None
    model: Callable[[Scene], np.ndarray] = field(repr=False)
    simulated: bool = True
    sensor: Sensor | None = None

    @classmethod
    def sensed(cls, name: str, data: np.ndarray, sensor: Sensor, simulated: bool) -> Series:
        """Measurements by a sensor."""

        def model(scene: Scene) -> np.ndarray:
            return np.concatenate(sensor.sensed(scene)[:2])

        return cls(name, data, None, model, simulated, sensor)

    @property
    def unknowns(self) -> int:
        """How many the sensor has."""
        return 0 if self.sensor is None else len(self.sensor.unknowns)

    @cached_property
    def floor(self) -> float:
        """What their noise is at least."""
        return least_noise(self.data)

    @cached_property
    def wanted(self) -> np.ndarray:
        """What the model is to say: the data, and 0 of each unknown."""
        return np.append(self.data, np.zeros(self.unknowns))


@dataclass(frozen=True)
class Place:
    """Parameters and how well they explain the data."""

    at: np.ndarray  # coordinates of the parameters: logarithms, but of `EXPONENTS`
    # twice the negative logarithm of the likelihood, noise at its best, but for a constant
    deviance: float
    # data less model of each series, then its unknowns with a minus
    residuals: list[np.ndarray] = field(repr=False)
    noise: list[float]  # standard deviation of each series


class Likelihood:
    """Deviance of parameters of the rock; counts how often the model is computed.

    Parameters
    ----------
    scene : Scene
    series : sequence of Series
    names : sequence of str
        Dotted keys of the free parameters.
    ranges : ndarray, shape (parameters, 2)
        Coordinates between which they lie.
    tick : callable
        Called once for each place that is computed.
    """

    def __init__(
        self,
        scene: Scene,
        series: Sequence[Series],
        names: Sequence[str],
        ranges: np.ndarray,
        tick: Callable[[], None],
    ) -> None:
        self.scene, self.series, self.names = scene, series, tuple(names)
        self.low, self.high = ranges.T
        # below that the law itself has no values, so that nothing is open there
        self.ends_low = np.array(
            [
                name in EXPONENTS and low == scene.row_of(name).lower
                for name, low in zip(names, self.low, strict=True)
            ],
            bool,
        )
        self._tick = tick
        self._known: OrderedDict[bytes, Place] = OrderedDict()
        self._least = [math.inf] * len(series)  # deviance of each that was seen

    @property
    def box(self) -> np.ndarray:
        """Coordinates between which each parameter lies."""
        return np.stack([self.low, self.high], axis=1)

    def with_series(self, series: Sequence[Series]) -> Likelihood:
        """That of other measurements, with the same parameters."""
        return Likelihood(self.scene, series, self.names, self.box, self._tick)

    def at(self, at: np.ndarray) -> Place:
        """Compute the place of parameters (coordinates), within their ranges."""
        found = self.below(at, math.inf, 0.0)
        assert found is not None
        return found

    def below(self, at: np.ndarray, limit: float, slack: float) -> Place | None:
        """Compute a place, or return None as soon as its deviance cannot be below a limit.

        Series that are still to be computed are taken to explain their data no better than
        they did at any place so far, but for a slack in the deviance of each.
        """
        at = np.clip(at, self.low, self.high)
        key = at.tobytes()
        if key not in self._known:
            self._tick()
            residuals = self._residuals(self.scene_at(at), limit, slack)
            if residuals is None:
                return None
            deviance, noise = self.deviance_of(residuals)
            self._known[key] = Place(at, deviance, residuals, noise)
            if len(self._known) > KEPT:
                self._known.popitem(last=False)
        return self._known[key]

    def scene_at(self, at: np.ndarray) -> Scene:
        """Scene with these parameters."""
        values = {
            name: float(values_at(name, one)) for name, one in zip(self.names, at, strict=True)
        }
        return self.scene.replace(**values)

    def _residuals(self, scene: Scene, limit: float, slack: float) -> list[np.ndarray] | None:
        """Data less model of each series; None where `below` gives up."""
        residuals, seen = [], []
        for one in self.series:
            residuals.append(one.wanted - _finite(one, scene))
            seen.append(_deviance(one, residuals[-1])[0])
            rest = self._least[len(seen) :]
            if limit < sum(seen) + sum(rest) - slack * len(rest) < math.inf:
                return None
        self._least = [min(pair) for pair in zip(self._least, seen, strict=True)]
        return residuals

    def deviance_of(
        self, residuals: Sequence[np.ndarray], of: Sequence[int] | None = None
    ) -> tuple[float, list[float]]:
        """Deviance of residuals, and the noise of each series; of some of them, by their places."""
        some = range(len(residuals)) if of is None else of
        parts = [_deviance(self.series[k], residuals[k]) for k in some]
        return sum(deviance for deviance, _ in parts), [noise for _, noise in parts]

    def weights(self, noise: Sequence[float]) -> np.ndarray:
        """Weights of all residuals, one after the other."""
        rows = [
            np.append(np.full(len(one.data), 1.0 / sigma), np.ones(one.unknowns))
            for one, sigma in zip(self.series, noise, strict=True)
        ]
        return np.concatenate(rows)


def _deviance(one: Series, off: np.ndarray) -> tuple[float, float]:
    """Deviance of the residuals of a series, and its noise."""
    if one.error is None:
        off, pulls = off[: len(one.data)], off[len(one.data) :]
        sigma = max(math.sqrt(float(off @ off) / len(off)), one.floor)
        return len(off) * 2.0 * math.log(sigma) + float(pulls @ pulls), sigma
    return float(off @ off) / one.error**2, one.error


def _finite(one: Series, scene: Scene) -> np.ndarray:
    """What the model says, or what no data agree with where it says nothing."""
    try:
        found = one.model(scene)
    except SimulationError:
        found = np.array([math.nan])
    if np.isfinite(found).all():
        return found
    return one.wanted + 10.0 * (float(np.ptp(one.data)) or float(np.abs(one.data).max()))


def curve_series(curve: Curve, guess: tuple[float, float]) -> Series:
    """Series of a slow curve; its datum and peak, guessed, are at their best for any rock."""
    return Series.sensed(curve.name, curve.force, CurveSensor(curve, guess), simulated=False)


def drop_series(drop: DropTest, most: int | None = None) -> Series:
    """Series of a drop test, or of at most so many of its samples, evenly taken."""
    count = len(drop.time)
    kept = np.arange(count)
    if most is not None and count > most:
        kept = np.unique(np.linspace(0, count - 1, most).round().astype(int))
    return Series.sensed(drop.name, drop.values[kept], DropSensor(drop, kept), simulated=True)


def reading_series(reading: Reading) -> Series:
    """Series of a single number with a known error."""

    def model(scene: Scene) -> np.ndarray:
        whole = scene if reading.speed is None else bit_alone(scene)
        return np.array([predicted_reading(whole, reading)])

    return Series(reading.name, np.array([reading.value]), reading.error, model)
