"""What a sensor adds to a signal: its zero, its drift, and the delay of its trigger.

None of them is known, but each has a prior: a normal distribution about 0 of a stated width.
For any rock they are where data and priors together are likeliest (docs/data/calibration.md).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from percussion_model.analysis.fitting.curve import best_datum_and_peak
from percussion_model.analysis.fitting.measurements import (
    SIGNALS,
    Curve,
    DropTest,
    least_noise,
)
from percussion_model.analysis.fitting.predictions import DropOnRocks, bit_alone
from percussion_model.scene.scene import Scene

OFFSET, DRIFT, DELAY = "offset", "drift", "delay"
# A trigger is looked for within so many widths of its prior.
REACH = 3.0
# Samples of the model between which a delayed signal is read are no farther apart than this, of
# positions and of all else [s], twice as far in a search by few data; and no more in number.
FINE, FINER, MOST_SAMPLES = 5e-5, 2.5e-5, 20_000
# The delay is first tried at so many values in so many data; the best is improved, and the second
# best if it leaves a noise that is no greater by this.
TRIED, TRIED_IN, NEAR = 61, 60, 2.0
# Steps of least squares at most, the size of the last in widths, and halvings of one.
ROUNDS, ARRIVED, HALVINGS = 30, 1e-7, 8

# Signal, and its slope over the pull of the delay.
Shown = tuple[np.ndarray, np.ndarray]


class Unknown(NamedTuple):
    """Something of a sensor that is not known, SI units; `width`: standard deviation."""

    name: str
    unit: str
    width: float


class Sensed(NamedTuple):
    """What a sensor shows of the model, its unknowns by the widths of their priors, and their
    covariance with this rock."""

    fitted: np.ndarray
    pulls: np.ndarray
    spread: np.ndarray


class Tried(NamedTuple):
    """Delays that are tried first: their pulls, samples of the model and places between them, the
    data, and directions of the other unknowns."""

    pulls: np.ndarray
    samples: np.ndarray
    between: np.ndarray
    data: np.ndarray
    base: np.ndarray


class DropSensor:
    """Sensor of a drop test.

    Parameters
    ----------
    drop : DropTest
        Checked.
    kept : ndarray
        Which of its samples count.
    """

    def __init__(self, drop: DropTest, kept: np.ndarray) -> None:
        self._drop, self._time, self._data = drop, drop.time[kept], drop.values[kept]
        self._floor = least_noise(self._data) ** 2  # variance of the noise at least
        unit = SIGNALS[drop.signal][0]
        offset, drift, self._delay = (one or 0.0 for one in (drop.offset, drop.drift, drop.delay))
        given = (
            Unknown(OFFSET, unit, offset),
            Unknown(DRIFT, unit + "/s", drift),
            Unknown(DELAY, "s", self._delay),
        )
        self.unknowns = tuple(one for one in given if one.width > 0.0)
        columns = {OFFSET: np.ones(len(self._time)), DRIFT: self._time}
        steady = [one.width * columns[one.name] for one in self.unknowns if one.name != DELAY]
        self._steady = np.stack(steady, axis=1) if steady else np.zeros((len(self._time), 0))
        self._ahead = 0
        self._early: np.ndarray | None = None
        if self._delay > 0.0:
            self._step = _step_of(drop, 1.0 if len(kept) == len(drop.time) else 2.0)
            self._ahead = math.ceil(REACH * self._delay / self._step) + 2
            count = math.ceil(drop.time[-1] / self._step) + self._ahead + 2
            self._model = DropOnRocks(drop, self._step * np.arange(count))
            self._tried = self._places_tried(count + self._ahead)
        else:
            self._model = DropOnRocks(drop, self._time)

    def sensed(self, scene: Scene) -> Sensed:
        """What it shows of a rock where its unknowns are likeliest."""
        signal = self._model(scene)
        if not np.isfinite(signal).all():
            count = len(self.unknowns)
            return Sensed(np.full(len(self._data), math.nan), np.zeros(count), np.eye(count))
        if not self._ahead:
            return self._best(lambda _: (signal, np.zeros((len(signal), 0))), 0)
        if self._early is None:  # it does not depend on the rock
            early = -self._step * np.arange(self._ahead, 0, -1)
            self._early = _before(self._drop, scene, early)
        signal = np.concatenate([self._early + signal[0], signal])

        def delayed(pull: np.ndarray) -> Shown:
            return self._read(signal, float(pull[0]))

        found = [self._best(delayed, 1, one) for one in self._first_delays(signal)]
        return min(found, key=self._deviance)

    def _read(self, signal: np.ndarray, pull: float) -> Shown:
        """Signal at the times of the data with a delay, by cubics, and its slope over the pull."""
        place = (self._time + pull * self._delay) / self._step + self._ahead
        k = np.clip(place.astype(int), 1, len(signal) - 3)
        x = place - k
        before, here, there, after = signal[k - 1], signal[k], signal[k + 1], signal[k + 2]
        a, b = 0.5 * (there - before), before - 2.5 * here + 2.0 * there - 0.5 * after
        c = 0.5 * (after - before) + 1.5 * (here - there)
        slope = (a + x * (2.0 * b + 3.0 * c * x)) * (self._delay / self._step)
        return here + x * (a + x * (b + x * c)), slope[:, None]

    def _places_tried(self, count: int) -> Tried:
        """Where among so many samples of the model the delays that are tried first are read."""
        every = np.arange(0, len(self._time), math.ceil(len(self._time) / TRIED_IN))
        pulls = np.linspace(-REACH, REACH, TRIED)
        place = self._time[every] + (pulls * self._delay)[:, None]
        k, x = np.divmod(place / self._step + self._ahead, 1.0)
        k = np.clip(k.astype(int), 0, count - 2)
        return Tried(pulls, k, x, self._data[every], np.linalg.qr(self._steady[every])[0])

    def _first_delays(self, signal: np.ndarray) -> list[float]:
        """Delays, in widths, near which data are best explained in a few samples."""
        pulls, k, x, data, base = self._tried
        here = signal[k]
        off = data - (here + x * (signal[k + 1] - here))
        off -= (off @ base) @ base.T
        square = np.einsum("ij,ij->i", off, off) / len(data)
        above = len(data) * np.log(np.maximum(square, self._floor)) + pulls**2
        padded = np.pad(above, 1, constant_values=math.inf)
        dips = np.flatnonzero((above <= padded[:-2]) & (above <= padded[2:]))
        dips = dips[np.argsort(above[dips])]
        near = above[dips] <= above[dips[0]] + 2.0 * len(data) * math.log(NEAR)
        return [float(pulls[dip]) for dip in dips[near][:2]]

    def _deviance(self, found: Sensed) -> float:
        return self._deviance_of(self._data - found.fitted, found.pulls)

    def _variance_of(self, off: np.ndarray) -> float:
        return max(float(off @ off) / len(off), self._floor)

    def _deviance_of(self, off: np.ndarray, pulls: np.ndarray) -> float:
        return len(off) * math.log(self._variance_of(off)) + float(pulls @ pulls)

    def _best(self, model: Callable[[np.ndarray], Shown], free: int, first: float = 0.0) -> Sensed:
        """Least squares over all unknowns from a delay; the noise is estimated along."""
        steady, data = self._steady, self._data
        split = steady.shape[1]
        pulls = np.append(np.zeros(split), np.full(free, first))

        def at(pulls: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
            signal, slope = model(pulls[split:])
            off = data - signal - steady @ pulls[:split]
            return off, slope, self._deviance_of(off, pulls)

        off, slope, deviance = at(pulls)
        for _ in range(ROUNDS):
            columns = np.concatenate([steady, slope], axis=1)
            variance = self._variance_of(off)
            spread = np.linalg.inv(columns.T @ columns / variance + np.eye(len(pulls)))
            step = spread @ (columns.T @ off / variance - pulls)
            for _ in range(HALVINGS):
                there = pulls + step
                there[split:] = np.clip(there[split:], -REACH, REACH)
                tried = at(there)
                if tried[2] <= deviance:
                    break
                step = 0.5 * step
            else:
                break
            moved = float(np.abs(there - pulls).max(initial=0.0))
            pulls, (off, slope, deviance) = there, tried
            if moved < ARRIVED:
                break
        return Sensed(data - off, pulls, spread)


def _step_of(drop: DropTest, share: float) -> float:
    """Time between samples of the model: a whole part of that between the data."""
    between = float(np.median(np.diff(drop.time)))
    fine = share * (FINE if drop.signal.endswith("position") else FINER)
    fine = max(fine, float(drop.time[-1]) / MOST_SAMPLES)
    return between / math.ceil(between / fine)


def _before(drop: DropTest, scene: Scene, times: np.ndarray) -> np.ndarray:
    """Signal before time zero, less that at zero, while the bit falls freely."""
    scene = bit_alone(scene)
    weight = scene["gravity.acceleration"] if scene.effects.gravity else 0.0
    acceleration = weight + scene.feed.force / scene.bit.mass
    if drop.signal.endswith("position"):
        return times * (drop.speed + 0.5 * acceleration * times)
    if drop.signal.endswith("velocity"):
        return acceleration * times
    return np.zeros(len(times))


class CurveSensor:
    """Sensors of a slow test: the force has an unknown zero; that of the penetration is free.

    Parameters
    ----------
    curve : Curve
        Checked.
    guess : (float, float)
        Datum and peak [m].
    """

    def __init__(self, curve: Curve, guess: tuple[float, float]) -> None:
        self._curve, self._guess = curve, guess
        width = curve.offset or 0.0
        self.unknowns: tuple[Unknown, ...] = (Unknown(OFFSET, "N", width),) if width > 0.0 else ()

    def sensed(self, scene: Scene) -> Sensed:
        """What it shows of a rock where its unknowns are likeliest."""
        found = best_datum_and_peak(self._curve, scene, self._guess)
        count = len(self.unknowns)
        return Sensed(found.force, np.full(count, found.pull), found.variance * np.eye(count))


Sensor = DropSensor | CurveSensor
