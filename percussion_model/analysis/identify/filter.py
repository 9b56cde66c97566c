"""Filter of rock and bit along a hole, and its test for layers.

Samples of like settings are gathered while a layer lasts: many of them tell no more than the mean
that they come to, and the table's error there, which they share, is no noise that they would
average out. What the means tell is one update of what was known when the layer began. It is the
unscented update of S. J. Julier and J. K. Uhlmann (Proc. IEEE 92 (2004) 401), made again about
what it found (A. F. Garcia-Fernandez et al., IEEE Trans. Signal Process. 63 (2015) 5561): along
the ridges of rates that two unknowns tell together, updates sample by sample grow sure of what
nobody told. It is written here, of numpy alone, as it runs in FMUs, where no more may be needed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from percussion_model.analysis.identify.observation import (
    FRICTION,
    RATE,
    RENEWAL,
    SIGNALS,
    THRESHOLD,
    UNKNOWNS,
    Q,
    Table,
)

COUNT = len(UNKNOWNS)
# What stays in a new layer but for this share of the prior's standard deviation; the other
# unknowns are those of any rock again, and of q no less is unknown than so (by the logarithm).
SLOW, LEAP, LEAST_SPREAD = (RENEWAL, THRESHOLD, FRICTION), 0.35, 0.5
# Settings within this are alike (by the logarithm): they are gathered. The table's errors go
# together up to about the second.
ALIKE, TOGETHER = 0.05, 0.15
MOST_GROUPS = 8
# Rock differs from place to place in a layer, by the logarithm of its rate; hole in which samples
# lose 63 % of their weight [m].
VARIES, FORGOTTEN = 0.02, 4.0
# Errors of a sample that count; beyond, a sample weighs less, as an outlier.
HUBER = 2.5
# Samples whose mean is held against what is known, and how many standard deviations make a layer:
# so many in thousands of samples only if there is one.
WINDOWS, LAYER = (4, 8, 16), 5.0
MEMORY = max(WINDOWS)
FEWEST = 2  # of a new layer
# Samples behind a change of layer before the next is looked for; those that make a mean that is
# known by itself.
PAUSE, KNOWN = 8, 6.0
# Sigma points, by alpha and beta of the literature; parts of its way that an update may go.
ALPHA, BETA, STEPS = 0.8, 2.0, (0.0, 0.25, 0.5, 1.0)
# Of less weight a mean says nothing.
LEAST_WEIGHT = 1e-3
# Columns of a group: weight, logarithms of settings; by signal weight and mean of the logarithm.
_SETTINGS, _WEIGHTS, _MEANS = slice(1, 4), slice(4, 7), slice(7, 10)
WIDTH = 10


@dataclass(frozen=True)
class Noise:
    """Standard deviations of one sample, by the logarithm, in the order of `SIGNALS`."""

    rate: float = 0.05
    frequency: float = 0.005
    torque: float = 0.1

    def values(self) -> np.ndarray:
        """As an array."""
        return np.array([self.rate, self.frequency, self.torque])


@dataclass
class Taken:
    """A sample that was taken: what was before it, and how far it is off."""

    deeper: float
    settings: np.ndarray
    signals: np.ndarray
    groups: np.ndarray  # before it
    off: float
    variance: float  # of what it is held against


class RockFilter:
    """What is known of rock and bit after the samples so far.

    Parameters
    ----------
    table : Table
    mean, spread : ndarray, shape (6,)
        Of the prior, by `UNKNOWNS`: logarithms, and their standard deviations.
    noise : Noise

    Attributes
    ----------
    x, p : ndarray
        Mean and covariance of the unknowns' logarithms.
    layers : int
        Changes of layer that were found.
    """

    def __init__(
        self, table: Table, mean: np.ndarray, spread: np.ndarray, noise: Noise | None = None
    ) -> None:
        self.table, self.mean, self.spread = table, np.array(mean, float), np.array(spread, float)
        self.spread[Q] = max(self.spread[Q], LEAST_SPREAD)
        self.noise = (noise or Noise()).values()
        self.x0, self.p0 = self.mean.copy(), np.diag(self.spread**2)
        self.x, self.p = self.x0, self.p0
        self.groups = np.empty((0, WIDTH))
        self.memory: list[Taken] = []
        self.since, self.layers = 0, 0

    def sample(self, deeper: float, settings: np.ndarray, signals: np.ndarray) -> int:
        """Take a sample.

        Parameters
        ----------
        deeper : float
            Depth drilled since the last one [m].
        settings : ndarray, shape (3,)
            By `SETTINGS`, SI.
        signals : ndarray, shape (3,)
            By `SIGNALS`, SI; NaN where there is none.

        Returns
        -------
        int
            Samples ago at which a layer began that was found now; else 0.
        """
        self._take(deeper, np.log(settings), np.log(signals))
        self.since += 1
        ago = self._layer_began()
        if ago:
            self._begin_layer(ago)
        self.solve()
        return ago

    def _take(self, deeper: float, settings: np.ndarray, signals: np.ndarray) -> None:
        before = self.groups.copy()
        self.groups[:, 0] *= (fading := math.exp(-max(deeper, 0.0) / FORGOTTEN))
        self.groups[:, _WEIGHTS] *= fading
        which = self._group(settings)
        row = self.groups[which]
        expected, variance = row[_MEANS].copy(), self.noise**2 / np.maximum(row[_WEIGHTS], 1.0)
        if row[4 + RATE] < KNOWN:
            expected, variance = self.expect(np.exp(settings))
        off = signals - expected
        there = np.isfinite(off)
        size = np.where(there, np.abs(off), 0.0) / np.sqrt(self.noise**2 + variance)
        weights = np.where(there, HUBER / np.maximum(size, HUBER), 0.0)
        row[0] += 1.0
        row[_SETTINGS] += (settings - row[_SETTINGS]) / row[0]
        row[_WEIGHTS] += weights
        step = np.where(there, signals - row[_MEANS], 0.0)
        row[_MEANS] += weights * step / np.maximum(row[_WEIGHTS], 1e-12)
        most = 2.0 * HUBER * math.sqrt(self.noise[RATE] ** 2 + variance[RATE])
        held = float(np.clip(off[RATE], -most, most)) if there[RATE] else 0.0
        self.memory.append(Taken(deeper, settings, signals, before, held, float(variance[RATE])))
        del self.memory[:-MEMORY]

    def _group(self, settings: np.ndarray) -> int:
        """Number of the group of samples with settings like these, made if there is none."""
        off = np.max(np.abs(self.groups[:, _SETTINGS] - settings), axis=1)
        if len(off) and (np.min(off) < ALIKE or len(off) == MOST_GROUPS):
            if np.min(off) < ALIKE:
                return int(np.argmin(off))
            self.groups = np.delete(self.groups, np.argmin(self.groups[:, 0]), axis=0)
        new = np.zeros((1, WIDTH))
        new[0, _SETTINGS] = settings
        self.groups = np.concatenate([self.groups, new])
        return len(self.groups) - 1

    def expect(self, settings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Logarithms of the signals that are expected at settings, and their variances."""
        points, weights, _ = self._points()
        values = self.table.predict(points, settings)
        mean = weights @ values
        off = values - mean
        return mean, weights @ off**2 + BETA * off[0] ** 2 + self.table.errors**2

    def _points(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sigma points of what is known, weights of their mean and of covariances."""
        root = ALPHA * math.sqrt(COUNT) * np.linalg.cholesky(self.p)
        points = np.concatenate([[self.x], self.x + root.T, self.x - root.T])
        weights = np.full(len(points), 0.5 / (ALPHA * ALPHA * COUNT))
        weights[0] = 1.0 - 1.0 / (ALPHA * ALPHA)
        wide = weights.copy()
        wide[0] += 1.0 - ALPHA * ALPHA + BETA
        return points, weights, wide

    def solve(self) -> None:
        """Update what was known when the layer began with the means of its groups."""
        at = np.flatnonzero(self.groups[:, _WEIGHTS] > LEAST_WEIGHT)
        if not len(at):
            self.x, self.p = self.x0, self.p0
            return
        measured = self.groups[:, _MEANS].ravel()[at]
        noise = self._noise_of_means()[np.ix_(at, at)]
        points, weights, wide = self._points()
        values = self._means_at(points)[:, at]
        mean = weights @ values
        off, from_x = values - mean, points - self.x
        slopes = np.linalg.solve(self.p, (wide * from_x.T) @ off).T
        own = (wide * off.T) @ off
        curved = own - slopes @ self.p @ slopes.T
        size = np.abs(values[0] - measured) / np.sqrt(np.diag(own + noise))
        # a mean of samples on both sides of a layer fits nothing
        noise += np.diag(np.diag(noise) * (np.maximum(size / HUBER, 1.0) ** 2 - 1.0))
        total = slopes @ self.p0 @ slopes.T + noise + curved
        gain = np.linalg.solve(total, slopes @ self.p0).T
        move = self.x0 + gain @ (measured - mean - slopes @ (self.x0 - self.x)) - self.x
        self._go(move, measured, noise, at)
        p = self.p0 - gain @ total @ gain.T
        self.p = 0.5 * (p + p.T)

    def _means_at(self, points: np.ndarray) -> np.ndarray:
        """Logarithms of the signals of all groups, by group and signal, for unknowns at points."""
        settings = np.exp(self.groups[:, _SETTINGS])
        many, count = len(settings), len(points)
        unknowns = np.repeat(points, many, axis=0)
        return self.table.predict(unknowns, np.tile(settings, (count, 1))).reshape(count, -1)

    def _go(
        self, move: np.ndarray, measured: np.ndarray, noise: np.ndarray, at: np.ndarray
    ) -> None:
        """Go the most likely part of a way, or to the q that the rates tell with all else as it is.

        Where hardly anything breaks, slopes lead astray.
        """
        tried = self.x + np.outer(STEPS, move)
        from_here = np.stack([self.x, self.x0])
        rates = np.flatnonzero(at % len(SIGNALS) == RATE)
        if len(rates):
            off = self._means_at(from_here)[:, at[rates]] - measured[rates]
            from_here[:, Q] += np.mean(off, axis=1)
            tried = np.concatenate([tried, from_here])
        off = self._means_at(tried)[:, at] - measured
        from_x0 = tried - self.x0
        unlikely = np.sum(off * np.linalg.solve(noise, off.T).T, axis=1)
        unlikely += np.sum(from_x0 * np.linalg.solve(self.p0, from_x0.T).T, axis=1)
        self.x = tried[int(np.argmin(unlikely))]

    def _noise_of_means(self) -> np.ndarray:
        """Covariance of the groups' means, by group and signal: noise, rock, and the table."""
        settings = self.groups[:, _SETTINGS] / TOGETHER
        apart = settings[:, np.newaxis] - settings
        alike = np.exp(-0.5 * np.sum(apart**2, axis=2))
        found = np.kron(alike, np.diag(self.table.errors**2))
        own = self.noise**2 / np.maximum(self.groups[:, _WEIGHTS], LEAST_WEIGHT)
        own[:, RATE] += VARIES**2
        return found + np.diag(own.ravel())

    def _layer_began(self) -> int:
        """Samples ago at which a layer began, by the mean of those since; 0 where none did."""
        if self.since <= PAUSE or max(map(self._size, WINDOWS)) <= LAYER:
            return 0
        return max(range(FEWEST, MEMORY + 1), key=self._size)

    def _size(self, window: int) -> float:
        """How far the latest samples are off, in standard deviations of their mean."""
        if len(self.memory) < window:
            return 0.0
        last = self.memory[-window:]
        common = sum(one.variance for one in last) / window
        error = math.sqrt(self.noise[RATE] ** 2 / window + common)
        return abs(sum(one.off for one in last)) / window / error

    def _begin_layer(self, ago: int) -> None:
        """Go back by some samples, forget what a new layer may change, and take them again."""
        again = self.memory[-ago:]
        self.groups = again[0].groups
        self.solve()
        slow = np.ix_(SLOW, SLOW)
        kept = self.p[slow] + np.diag((LEAP * self.spread[list(SLOW)]) ** 2)
        self.x0, self.p0 = self.mean.copy(), np.diag(self.spread**2)
        self.x0[list(SLOW)], self.p0[slow] = self.x[list(SLOW)], kept
        self.x, self.p = self.x0, self.p0
        self.groups, self.memory = np.empty((0, WIDTH)), []
        for one in again:
            self._take(one.deeper, one.settings, one.signals)
        self.since = 0
        self.layers += 1

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviations of the logarithms."""
        return np.sqrt(np.diag(self.p))

    def save(self) -> dict[str, Any]:
        """State as plain values."""
        return {
            **{name: getattr(self, name).ravel().tolist() for name in _ARRAYS},
            "memory": [v for one in self.memory for v in _flat(one)],
            "since": self.since, "layers": self.layers,
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go back to a state."""
        for name, shape in _ARRAYS.items():
            setattr(self, name, np.array(saved[name], float).reshape(shape))
        self.memory, flat = [], np.array(saved["memory"], float)
        while len(flat):
            size = int(flat[0])
            self.memory.append(_unflat(flat[1:size]))
            flat = flat[size:]
        self.since, self.layers = int(saved["since"]), int(saved["layers"])


_ARRAYS = {
    "x0": (COUNT,), "p0": (COUNT, COUNT), "x": (COUNT,), "p": (COUNT, COUNT), "groups": (-1, WIDTH),
}  # fmt: skip
# Plain values have no NaN: a signal that is missing, far below any logarithm.
_MISSING = -1e9


def _flat(one: Taken) -> list[float]:
    signals = np.where(np.isfinite(one.signals), one.signals, _MISSING)
    values = [one.deeper, one.off, one.variance, *one.settings, *signals, *one.groups.ravel()]
    return [float(len(values) + 1), *map(float, values)]


def _unflat(flat: np.ndarray) -> Taken:
    many = 3 + 3
    signals = flat[many : many + len(SIGNALS)]
    return Taken(
        float(flat[0]), flat[3:many], np.where(signals == _MISSING, np.nan, signals),
        flat[many + len(SIGNALS) :].reshape(-1, WIDTH), float(flat[1]), float(flat[2]),
    )  # fmt: skip
