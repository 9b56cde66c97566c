"""Filter of rock and bit along a hole, and its test for layers.

Samples of like settings are gathered while a layer lasts: many of them tell no more than the mean
that they come to, and the table's error there, which they share, is no noise that they would
average out. What the means tell is one update of what was known when the layer began.

A blow meets the waves of earlier ones, so that its work goes up and down with the stiffness of the
rock: several rocks may explain a log. Unloading ratio and stiffness are therefore divided into
cells, each narrow enough for a table that is linear there, with a weight by how well it explains
the means (H. W. Sorenson and D. L. Alspach, Automatica 7 (1971) 465). In a cell the update is that
of central differences (M. Norgaard et al., Automatica 36 (2000) 1627), made again
about what it found (A. F. Garcia-Fernandez et al., IEEE Trans. Signal Process. 63 (2015)
5561). It is written here, of numpy alone, as it runs in FMUs, where no more may be needed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from percussion_model.analysis.identify.observation import (
    FRICTION,
    GAMMA,
    RATE,
    RENEWAL,
    SIGNALS,
    STIFFNESS,
    THRESHOLD,
    UNKNOWNS,
    Q,
    Table,
)

COUNT = len(UNKNOWNS)
# What stays in a new layer but for this share of the prior's standard deviation; the other
# unknowns are those of any rock again, and of q no less is unknown than so (by the logarithm).
SLOW, LEAP, LEAST_SPREAD = [RENEWAL, THRESHOLD, FRICTION], 0.2, 0.5
# Settings within this are alike (by the logarithm): they are gathered. The table's errors of
# pressures and feeds go together up to about the second, as those of 200 rocks of a hammer showed;
# the motion knows of no rotation.
ALIKE, TOGETHER = 0.05, np.array([0.15, 0.15, np.inf])
MOST_GROUPS = 8
# Hole in which samples lose 63 % of their weight [m].
FORGOTTEN = 8.0
# Errors of a sample that count; beyond, a sample weighs less, as an outlier. One at the edge of a
# group may belong to its neighbour, and be off by so many.
HUBER, EDGE = 2.5, 1.0
# By how many of the first a sample counts for a change of layer: two outliers in four make none.
HELD = 1.6
# Samples whose mean is held against what is known, and how many standard deviations make a layer:
# so many in thousands of samples only if there is one.
WINDOWS, LAYER = (4, 8, 16, 32, 64), 5.0
MEMORY = max(WINDOWS)
FEWEST = 2  # of a new layer
# Less hole between two changes is one change, of signals that lag behind each other [m].
THIN = 0.2
# Samples behind a change of layer before the next is looked for; those that make a mean that is
# known by itself; behind so many, what is known is renewed with each fifth alone.
PAUSE, KNOWN, SOON, SELDOM = 8, 6.0, 20, 5
# Cells of the unknown in which a table is smoother, of polynomials, and at most; standard
# deviations to both sides, deviation in a cell by its width, and the least weight that is kept.
CELLS, FEW_CELLS, MOST_CELLS, SIDES, OWN, LEAST_CELL = 9, 3, 32, 2.2, 0.6, 1e-4
OF_CELL = [GAMMA, STIFFNESS]
# Points of an update, and parts of its way that it may go.
AROUND = np.concatenate([np.zeros((1, COUNT)), np.eye(COUNT), -np.eye(COUNT)])
STEPS = np.array([0.0, 0.25, 0.5, 1.0])
# Of less weight a mean says nothing.
LEAST_WEIGHT = 1e-3
# Columns of a group: weight, logarithms of settings; by signal weight and mean of the logarithm;
# the settings with which it began. Of a sample: depth drilled, settings; by signal the logarithm,
# weight, how far it is off, and the variance of what it is held against.
_SETTINGS, _WEIGHTS, _MEANS, _BEGAN = (slice(k, k + 3) for k in (1, 4, 7, 10))
_SIGNALS, _WEIGHED, _OFF, _VARIANCE = (slice(k, k + 3) for k in (4, 7, 10, 13))
GROUP, SAMPLE = 13, 16


@dataclass(frozen=True)
class Noise:
    """Standard deviations by the logarithm: of one sample, and of rock from place to place."""

    rate: float = 0.05
    frequency: float = 0.005
    torque: float = 0.1
    varies: float = 0.01

    def values(self) -> np.ndarray:
        """Those of a sample in the order of `SIGNALS`."""
        return np.array([self.rate, self.frequency, self.torque])


class RockFilter:
    """What is known of rock and bit after the samples so far.

    Parameters
    ----------
    table : Table
    mean, spread : ndarray, shape (6,)
        Of the prior, by `UNKNOWNS`: logarithms, and their standard deviations.
    noise : Noise
    cells : tuple of int, optional
        Numbers of cells of unloading ratio and stiffness; as fine as the table if left out.

    Attributes
    ----------
    x, p : ndarray
        Mean and covariance of the unknowns' logarithms.
    layers : int
        Changes of layer that were found.
    """

    def __init__(
        self,
        table: Table,
        mean: np.ndarray,
        spread: np.ndarray,
        noise: Noise | None = None,
        cells: tuple[int, int] | None = None,
    ) -> None:
        self.table, self.mean, self.spread = table, np.array(mean, float), np.array(spread, float)
        self.spread[Q] = max(self.spread[Q], LEAST_SPREAD)
        noise = noise or Noise()
        self.noise, self.varies = noise.values(), noise.varies
        fine = self.spread[OF_CELL] * table.stretch / table.half[2:]
        least = CELLS if len(table.nodes) else FEW_CELLS
        counts = cells or np.clip(least * fine / fine.min(), least, MOST_CELLS).astype(int)
        axes, own = zip(*map(_axis, counts), strict=True)
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(OF_CELL))
        self.places = self.mean[OF_CELL] + places * self.spread[OF_CELL]
        self.own = np.array(own)
        self.known = -0.5 * np.sum(places**2 / np.maximum(1.0 - self.own**2, 1e-9), axis=1)
        self.layers = 0
        self._start(self.mean, np.diag(self.spread**2))

    def _start(self, x: np.ndarray, p: np.ndarray) -> None:
        """Forget all but what is known when a layer begins."""
        self.p0 = p.copy()
        self.p0[OF_CELL] = self.p0[:, OF_CELL] = 0.0
        self.p0[OF_CELL, OF_CELL] = (self.own * self.spread[OF_CELL]) ** 2
        self.cells = np.arange(len(self.places))
        self.x0 = np.tile(x, (len(self.cells), 1))
        self.x0[:, OF_CELL] = self.places
        self.xs, self.ps = self.x0.copy(), np.tile(self.p0, (len(self.cells), 1, 1))
        # all samples of the layer, and those before the memory
        self.groups = self.before = np.empty((0, GROUP))
        self.memory = np.empty((0, SAMPLE))
        self.local: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}
        self.since, self.deep = 0, 0.0
        self._gather(self.known)

    def _gather(self, likely: np.ndarray) -> None:
        """Mean and covariance of all cells, by the logarithms of their weights."""
        weights = np.exp(likely - likely.max())
        self.weights = weights / weights.sum()
        self.x = self.weights @ self.xs
        off = self.xs - self.x
        self.p = np.tensordot(self.weights, self.ps, 1) + (self.weights * off.T) @ off

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
        if ago or self.since < SOON or self.since % SELDOM == 0:
            self.solve()
        return ago

    def _take(self, deeper: float, settings: np.ndarray, signals: np.ndarray) -> None:
        self.deep += deeper
        self.groups, row = _with_group(self.groups, settings)
        expected, variance = row[_MEANS], self._own(np.maximum(row[_WEIGHTS], 1.0))
        if row[_WEIGHTS][RATE] < KNOWN:
            expected, variance = self._expect(row)
        off = np.where(np.isfinite(signals), signals - expected, 0.0)
        most = HUBER * np.sqrt(self.noise**2 + variance)
        weights = np.where(np.isfinite(signals), most / np.maximum(np.abs(off), most), 0.0)
        off = np.clip(off, -HELD * most, HELD * most)
        one = np.concatenate([[deeper], settings, np.nan_to_num(signals), weights, off, variance])
        _add(self.groups, row, one)
        self.memory = np.concatenate([self.memory, one[np.newaxis]])
        if len(self.memory) > MEMORY:
            self.before = _added(self.before, self.memory[:1])
            self.memory = self.memory[1:]

    def _signals(self, row: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Logarithms of the signals of a group, for unknowns by cell and point."""
        began = row[_BEGAN]
        if (key := began.tobytes()) not in self.local:
            pressure_and_feed = np.tile(began[:2], (len(self.places), 1))
            self.local[key] = self.table.about(np.hstack([pressure_and_feed, self.places]))
        values, slopes = self.local[key]
        off = np.empty((*points.shape[:2], 4))
        off[..., :2] = row[_SETTINGS][:2] - began[:2]
        off[..., 2:] = points[..., OF_CELL] - self.places[self.cells, np.newaxis]
        rows = values[self.cells, np.newaxis] + off @ slopes[self.cells]
        return self.table.signals(rows, points, math.exp(row[_SETTINGS][2]))

    def _means_at(self, points: np.ndarray) -> np.ndarray:
        """The same of all groups, by group and signal."""
        return np.concatenate([self._signals(row, points) for row in self.groups], axis=2)

    def _expect(self, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Logarithms of the signals that are expected of a group, and their variances."""
        points = self.xs[:, np.newaxis] + AROUND @ _turned(np.linalg.cholesky(self.ps))
        mean, slopes, bent = _moments(self._signals(row, points))
        own = np.sum(slopes**2, axis=1) + np.diagonal(bent, axis1=1, axis2=2)
        whole = self.weights @ mean
        return whole, self.weights @ (own + (mean - whole) ** 2) + self.table.errors**2

    def solve(self) -> None:
        """Update what was known when the layer began with the means of its groups."""
        at = np.flatnonzero(self.groups[:, _WEIGHTS] > LEAST_WEIGHT)
        if not len(at):
            return
        measured = self.groups[:, _MEANS].ravel()[at]
        noise = self._noise_of_means()[np.ix_(at, at)]
        x0, root = self.x0[self.cells], _turned(np.linalg.cholesky(self.ps))
        values = self._means_at(self.xs[:, np.newaxis] + AROUND @ root)[..., at]
        mean, scaled, bent = _moments(values)
        slopes = _turned(np.linalg.solve(root, scaled))
        # a mean of samples on both sides of a layer fits nothing
        best = int(np.argmax(self.weights))
        own = np.diag(scaled[best].T @ scaled[best] + bent[best] + noise)
        size = np.abs(mean[best] - measured) / (HUBER * np.sqrt(own))
        noise += np.diag(np.diag(noise) * (np.maximum(size, 1.0) ** 2 - 1.0))
        total = slopes @ self.p0 @ _turned(slopes) + noise + bent
        left = measured - mean - np.einsum("cij,cj->ci", slopes, x0 - self.xs)
        solved = np.linalg.solve(total, np.dstack([slopes @ self.p0, left]))
        gain, weighed = _turned(solved[..., :-1]), solved[..., -1]
        self._go(x0 + np.einsum("cij,cj->ci", gain, left), measured, noise, at)
        rest = np.eye(COUNT) - gain @ slopes
        p = rest @ self.p0 @ _turned(rest) + gain @ (noise + bent) @ _turned(gain)
        self.ps = 0.5 * (p + _turned(p))
        unlikely = np.sum(left * weighed, axis=1) + np.linalg.slogdet(total)[1]
        self._gather(self.known[self.cells] - 0.5 * unlikely)
        if self.since > PAUSE:
            kept = self.weights > LEAST_CELL * self.weights.max()
            self.cells, self.xs, self.ps = self.cells[kept], self.xs[kept], self.ps[kept]
            self.weights = self.weights[kept] / self.weights[kept].sum()

    def _go(self, to: np.ndarray, measured: np.ndarray, noise: np.ndarray, at: np.ndarray) -> None:
        """Go the most likely part of a way, or to the q that the rates tell with all else as it is.

        Where hardly anything breaks, slopes lead astray.
        """
        x0 = self.x0[self.cells]
        tried = self.xs[:, np.newaxis] + STEPS[:, np.newaxis] * (to - self.xs)[:, np.newaxis]
        rates = np.flatnonzero(at % len(SIGNALS) == RATE)
        if len(rates):
            from_here = np.stack([self.xs, x0], axis=1)
            off = self._means_at(from_here)[..., at[rates]] - measured[rates]
            from_here[..., Q] += np.mean(off, axis=2)
            tried = np.concatenate([tried, from_here], axis=1)
        off, from_x0 = self._means_at(tried)[..., at] - measured, tried - x0[:, np.newaxis]
        unlikely = np.sum(off @ np.linalg.inv(noise) * off, axis=2)
        unlikely += np.sum(from_x0 @ np.linalg.inv(self.p0) * from_x0, axis=2)
        self.xs = tried[np.arange(len(tried)), np.argmin(unlikely, axis=1)]

    def _noise_of_means(self) -> np.ndarray:
        """Covariance of the groups' means, by group and signal: noise, rock, and the table."""
        shared = np.kron(alike(self.groups[:, _SETTINGS]), np.diag(self.table.errors**2))
        own = self._own(np.maximum(self.groups[:, _WEIGHTS], LEAST_WEIGHT))
        own[:, RATE] += self.varies**2
        return shared + np.diag(own.ravel())

    def _own(self, weights: np.ndarray) -> np.ndarray:
        """Variances of means of samples, by their weights, for what is noise in them."""
        return np.asarray(self.noise**2 * (1.0 + EDGE**2 / weights) / weights)

    def _layer_began(self) -> int:
        """Samples ago at which a layer began, by the mean of those since; 0 where none did."""
        if self.since <= PAUSE or max(map(self._size, WINDOWS)) <= LAYER:
            return 0
        return max(range(FEWEST, len(self.memory) + 1), key=self._size)

    def _size(self, window: int) -> float:
        """How far the latest samples are off, in standard deviations of their mean."""
        last = self.memory[-window:]
        if len(last) < window:
            return 0.0
        count = np.maximum(np.sum(last[:, _WEIGHED] > 0.0, axis=0), 1.0)
        error = np.sqrt(self.noise**2 / count + last[:, _VARIANCE].max(axis=0))
        error[RATE] = math.hypot(error[RATE], self.varies)
        return float(np.max(np.abs(last[:, _OFF].sum(axis=0)) / count / error))

    def _begin_layer(self, ago: int) -> None:
        """Go back by some samples, forget what a new layer may change, and take them again."""
        again, before = self.memory[-ago:], self.memory[:-ago]
        x, p, slow = self.mean.copy(), np.diag(self.spread**2), np.ix_(SLOW, SLOW)
        if self.layers and self.deep - again[:, 0].sum() < THIN:
            x[SLOW], p[slow] = self.x0[0, SLOW], self.p0[slow]
        else:
            self.groups = _added(self.before, before)
            self.solve()
            x[SLOW], p[slow] = self.x[SLOW], self.p[slow] + np.diag((LEAP * self.spread[SLOW]) ** 2)
            self.layers += 1
        self._start(x, p)
        for one in again:
            signals = np.where(one[_WEIGHED] > 0.0, one[_SIGNALS], math.nan)
            self._take(one[0], one[_SETTINGS], signals)

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviations of the logarithms."""
        return np.sqrt(np.diag(self.p))

    def save(self) -> dict[str, Any]:
        """State as plain values."""
        arrays = {name: getattr(self, name).ravel().tolist() for name in _ARRAYS}
        return {**arrays, "since": self.since, "deep": self.deep, "layers": self.layers}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go back to a state."""
        for name, shape in _ARRAYS.items():
            setattr(self, name, np.array(saved[name], float).reshape(shape))
        self.cells = self.cells.astype(int)
        self.since, self.layers = int(saved["since"]), int(saved["layers"])
        self.deep = float(saved["deep"])


_ARRAYS = {
    "x0": (-1, COUNT), "p0": (COUNT, COUNT), "xs": (-1, COUNT), "ps": (-1, COUNT, COUNT),
    "cells": (-1,), "weights": (-1,), "x": (COUNT,), "p": (COUNT, COUNT),
    "groups": (-1, GROUP), "before": (-1, GROUP), "memory": (-1, SAMPLE),
}  # fmt: skip


def _axis(count: int) -> tuple[np.ndarray, float]:
    """Centres of cells, and their own standard deviation, by that of the prior."""
    if count == 1:
        return np.zeros(1), 1.0
    centres = np.linspace(-SIDES, SIDES, count)
    return centres, OWN * float(centres[1] - centres[0])


def alike(settings: np.ndarray) -> np.ndarray:
    """How far the table's errors go together at settings, by their logarithms."""
    apart = settings[:, np.newaxis] - settings
    return np.exp(-0.5 * np.sum((apart / TOGETHER) ** 2, axis=2))


def _turned(matrices: np.ndarray) -> np.ndarray:
    return matrices.transpose(0, 2, 1)


def _moments(values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means, slopes by standard deviations, and covariance of what bends, of values `AROUND`."""
    middle, up, down = values[:, :1], values[:, 1 : COUNT + 1], values[:, COUNT + 1 :]
    bent = up + down - 2.0 * middle
    mean = middle[:, 0] + 0.5 * bent.sum(axis=1)
    return mean, 0.5 * (up - down), 0.5 * _turned(bent) @ bent


def _with_group(groups: np.ndarray, settings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Groups with one of samples with settings like these, and that one."""
    off = np.max(np.abs(groups[:, _SETTINGS] - settings), axis=1)
    if len(off) and np.min(off) < ALIKE:
        return groups, groups[np.argmin(off)]
    if len(off) == MOST_GROUPS:
        groups = np.delete(groups, np.argmin(groups[:, 0]), axis=0)
    new = np.zeros((1, GROUP))
    new[0, _SETTINGS] = new[0, _BEGAN] = settings
    groups = np.concatenate([groups, new])
    return groups, groups[-1]


def _add(groups: np.ndarray, row: np.ndarray, one: np.ndarray) -> None:
    """Add a sample that was weighed to its group; all fade with the depth."""
    fading = math.exp(-max(one[0], 0.0) / FORGOTTEN)
    groups[:, 0] *= fading
    groups[:, _WEIGHTS] *= fading
    row[0] += 1.0
    row[_SETTINGS] += (one[_SETTINGS] - row[_SETTINGS]) / row[0]
    row[_WEIGHTS] += one[_WEIGHED]
    step = one[_WEIGHED] / np.maximum(row[_WEIGHTS], 1e-12)
    row[_MEANS] += step * (one[_SIGNALS] - row[_MEANS])


def _added(groups: np.ndarray, samples: np.ndarray) -> np.ndarray:
    for one in samples:
        groups, row = _with_group(groups, one[_SETTINGS])
        _add(groups, row, one)
    return groups
