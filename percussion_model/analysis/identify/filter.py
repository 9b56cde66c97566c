"""Unscented Kalman filter of rock and bit along a hole, and its test for layers.

Logarithms of the unknowns walk at random with the depth drilled; a layer is a leap of those of
the rock. The offset of the table stays as long as the settings do and is another one elsewhere:
what a table is off by is no noise that many samples would average out.

The update is the unscented one of S. J. Julier and J. K. Uhlmann (Proc. IEEE 92 (2004) 401); it is
written here, of numpy alone, as it runs in FMUs, where no more may be needed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from percussion_model.analysis.identify.observation import (
    FRICTION,
    GAMMA,
    OFFSET,
    Q,
    RATE,
    RENEWAL,
    SETTINGS,
    SIGNALS,
    STIFFNESS,
    THRESHOLD,
    UNKNOWNS,
    Table,
)

COUNT = len(UNKNOWNS)
# Random walk in a metre [1/sqrt(m)], by the logarithm.
WALK = {Q: 0.05, GAMMA: 0.03, STIFFNESS: 0.03, RENEWAL: 0.02, THRESHOLD: 0.02, FRICTION: 0.02}
# What a new layer may bring: share of the prior's standard deviation, by the logarithm.
LEAP = {Q: 1.0, GAMMA: 1.0, STIFFNESS: 1.0, RENEWAL: 0.2, THRESHOLD: 0.2, FRICTION: 0.2}
# A change of settings by this, by the logarithm, makes another offset of the table.
ALIKE = 0.15
# Errors of a sample that count; beyond, a sample weighs less, as an outlier.
HUBER = 2.5
# Samples over which innovations are summed up for a layer, and the sum in standard deviations:
# once in some ten thousand samples without one.
WINDOWS, LAYER = (4, 8, 16), 4.7
MEMORY = max(WINDOWS)
# Samples after a layer before the next is looked for.
PAUSE = 8
# Spread of the sigma points, by alpha, beta and kappa of the literature.
ALPHA, BETA = 0.7, 2.0


@dataclass(frozen=True)
class Noise:
    """Standard deviations of one sample, by the logarithm, in the order of `SIGNALS`."""

    rate: float = 0.05
    frequency: float = 0.005
    torque: float = 0.1

    def values(self) -> np.ndarray:
        """As an array."""
        return np.array([self.rate, self.frequency, self.torque])


class RockFilter:
    """What is known of rock and bit after the samples so far.

    Parameters
    ----------
    table : Table
    mean, spread : ndarray, shape (7,)
        Of the prior, by `UNKNOWNS`: logarithms, and their standard deviations.
    noise : Noise

    Attributes
    ----------
    x, p : ndarray
        Mean and covariance of the unknowns.
    layers : int
        Changes of layer that were found.
    """

    STATE = ("x", "p", "last", "memory", "sums", "since", "layers", "samples")

    def __init__(
        self, table: Table, mean: np.ndarray, spread: np.ndarray, noise: Noise | None = None
    ) -> None:
        self.table, self.prior, self.spread = table, np.array(mean, float), np.array(spread, float)
        self.spread[OFFSET] = table.errors[RATE]
        self.noise = (noise or Noise()).values()
        # errors of the table where no offset stands for them
        self.floor = np.array([0.0, table.errors[1], table.errors[2]])
        self.x, self.p = self.prior.copy(), np.diag(self.spread**2)
        self.last: np.ndarray | None = None
        # before each of the latest samples: depth step, settings, signals, mean and covariance
        self.memory: list[tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = []
        self.sums: list[float] = []
        self.since, self.layers, self.samples = 0, 0, 0

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
        self.memory.append((deeper, settings, signals, self.x, self.p))
        del self.memory[:-MEMORY]
        self.sums.append(self._step(deeper, settings, signals))
        del self.sums[:-MEMORY]
        self.since += 1
        self.samples += 1
        ago = self._layer_began()
        if ago:
            self._begin_layer(ago)
        return ago

    def _step(self, deeper: float, settings: np.ndarray, signals: np.ndarray) -> float:
        """Predict and update; the innovation of the rate in standard deviations, limited."""
        self._predict(deeper, settings)
        return self._update(settings, signals)

    def _predict(self, deeper: float, settings: np.ndarray) -> None:
        self.x, self.p = self.x.copy(), self.p.copy()
        walked = max(deeper, 0.0)
        for k, rate in WALK.items():
            self.p[k, k] += rate * rate * walked
        if self.last is not None:
            off = np.log(settings / self.last) / ALIKE
            kept = math.exp(-0.5 * float(off @ off))
            self.x[OFFSET] *= kept
            self.p[OFFSET] *= kept
            self.p[:, OFFSET] *= kept
            self.p[OFFSET, OFFSET] += (1.0 - kept * kept) * self.spread[OFFSET] ** 2
        self.last = settings

    def _update(self, settings: np.ndarray, signals: np.ndarray) -> float:
        there = np.flatnonzero(np.isfinite(signals))
        if not len(there):
            return 0.0
        scale = ALPHA * math.sqrt(COUNT)
        root = scale * np.linalg.cholesky(self.p)
        points = np.concatenate([[self.x], self.x + root.T, self.x - root.T])
        outer = 0.5 / (ALPHA * ALPHA * COUNT)
        weights = np.full(len(points), outer)
        weights[0] = 1.0 - 1.0 / (ALPHA * ALPHA)
        values = self.table.predict(points, settings)[:, there]
        mean = weights @ values
        weights[0] += 1.0 - ALPHA * ALPHA + BETA
        off, from_x = values - mean, points - self.x
        own = (weights * off.T) @ off
        cross = (weights * from_x.T) @ off
        noise = np.hypot(self.noise, self.floor)[there] ** 2
        innovation = np.log(signals[there]) - mean
        size = innovation / np.sqrt(np.diag(own) + noise)
        heavy = np.maximum(np.abs(size) / HUBER, 1.0)
        gain = np.linalg.solve(own + np.diag(noise * heavy**2), cross.T).T
        self.x = self.x + gain @ innovation
        p = self.p - gain @ cross.T
        self.p = 0.5 * (p + p.T)
        return float(np.clip(size[0], -2.0 * HUBER, 2.0 * HUBER)) if there[0] == RATE else 0.0

    def _layer_began(self) -> int:
        """Samples ago at which a layer began, by the sum of innovations; 0 where none did."""
        if self.since <= PAUSE:
            return 0
        most, found = LAYER, 0
        for window in WINDOWS:
            if len(self.sums) >= window:
                size = abs(sum(self.sums[-window:])) / math.sqrt(window)
                if size > most:
                    most, found = size, window
        return found

    def _begin_layer(self, ago: int) -> None:
        """Go back by some samples, widen what a layer may change, and take them again."""
        again = self.memory[-ago:]
        *_, self.x, self.p = again[0]
        self.widen()
        self.last = again[0][1] if len(self.memory) == ago else self.memory[-ago - 1][1]
        del self.memory[-ago:]
        del self.sums[-ago:]
        for deeper, settings, signals, _, _ in again:
            self.memory.append((deeper, settings, signals, self.x, self.p))
            self.sums.append(self._step(deeper, settings, signals))
        # the sum of what led to this layer must not find it again
        self.sums = [0.0] * len(self.sums)
        self.since = 0
        self.layers += 1

    def widen(self) -> None:
        """Forget what a new layer may change."""
        self.p = self.p.copy()
        for k, share in LEAP.items():
            self.p[k, k] += (share * self.spread[k]) ** 2

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviations of the logarithms."""
        return np.sqrt(np.diag(self.p))

    def innovations_of(self, settings: np.ndarray) -> np.ndarray:
        """Logarithms of the signals that are expected at settings."""
        return self.table.predict(self.x[np.newaxis], settings)[0]

    def save(self) -> dict[str, Any]:
        """State as plain values."""
        return {
            "x": self.x.tolist(), "p": self.p.ravel().tolist(),
            "last": [] if self.last is None else self.last.tolist(),
            "memory": [
                float(v) for d, s, y, x, p in self.memory
                for v in (d, *s, *np.nan_to_num(y, nan=-1.0), *x, *p.ravel())
            ],
            "sums": list(self.sums), "since": self.since, "layers": self.layers,
            "samples": self.samples,
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go back to a state."""
        self.x = np.array(saved["x"], float)
        self.p = np.array(saved["p"], float).reshape(COUNT, COUNT)
        self.last = np.array(saved["last"], float) if saved["last"] else None
        self.memory = list(_rows(saved["memory"]))
        self.sums = list(saved["sums"])
        self.since, self.layers = int(saved["since"]), int(saved["layers"])
        self.samples = int(saved["samples"])


def _rows(flat: Sequence[float]) -> Any:
    inputs = 1 + len(SETTINGS) + len(SIGNALS)
    for row in np.array(flat, float).reshape(-1, inputs + COUNT + COUNT * COUNT):
        signals = np.where(row[4:inputs] < 0.0, np.nan, row[4:inputs])
        x, p = row[inputs : inputs + COUNT], row[inputs + COUNT :].reshape(COUNT, COUNT)
        yield float(row[0]), row[1:4], signals, x, p
