"""Seeker of the best rate: swings feed and pressure, and climbs where the rate follows them.

Feed swings once in a window, pressure a whole number of times: F = F_0 (1 + a sin w t). Over a
whole window such swings, and a constant, know nothing of each other. Feed, pressure and rate are
each demodulated at both frequencies; the slopes of the rate over the *measured* feed and pressure
that explain best what the rate does at these frequencies, by the means, are the logarithmic
slopes, whatever the rig makes of a swing and even if one swing shakes the other quantity.
They move the logarithm of the two centres by a limited amount.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from typing import Any

FEED, PRESSURE = 0, 1
# Less than this share of the product of both swings: they cannot be told apart.
ALIKE = 1e-6


class Seeker:
    """Centres of feed and pressure, and what is summed up in a window.

    Attributes
    ----------
    centres : list of float
        Feed [N] and pressure [Pa] about which the seeker swings.
    since : float
        Windows that begin after this time count [s].
    gradients : list of float
        Logarithmic slopes of the rate, as found last.
    """

    phase: float
    since: float
    counts: bool
    sums: list[float]
    waves: list[float]
    centres: list[float]
    gradients: list[float]
    STATE = tuple(__annotations__)

    def __init__(self, parameters: dict[str, Any]) -> None:
        self.parameters = parameters
        self.cycles = (1, int(parameters["seek.pressure_cycles"]))
        self.centres, self.gradients = [0.0, 0.0], [0.0, 0.0]
        self.pause(0.0)
        self.counts = False

    def pause(self, time: float) -> None:
        """Lose the present window, and count none that begins before the wait is over."""
        self.since = time + self.parameters["seek.wait"]
        self._restart()

    def _restart(self) -> None:
        self.phase = 0.0
        self.sums = [0.0] * 3  # feed, pressure, rate
        self.waves = [0.0] * 12  # the same at both frequencies, real and imaginary

    def sample(self, inputs: Mapping[str, Any], time: float, h: float) -> tuple[float, float]:
        """Take a sample of the inputs; return the feed [N] and the pressure [Pa] to be kept."""
        p = self.parameters
        if self.phase == 0.0:
            self.counts = time > self.since
        self.phase += h
        angle = 2.0 * math.pi * self.phase / p["seek.period"]
        values = inputs["feed_force"], inputs["supply_pressure"], inputs["rate_of_penetration"]
        for k, cycles in enumerate(self.cycles):
            turn = cmath.exp(-1j * cycles * angle)
            for i, value in enumerate(values):
                self.waves[6 * k + 2 * i] += value * turn.real
                self.waves[6 * k + 2 * i + 1] += value * turn.imag
        for i, value in enumerate(values):
            self.sums[i] += value
        if self.phase >= p["seek.period"] - 0.5 * h:
            if self.counts:
                self._climb()
            self._restart()
            angle = 0.0
        feed = self.centres[FEED] * (1.0 + p["seek.swing"] * math.sin(angle))
        swing = p["seek.pressure_swing"] if p["seek.pressure_on"] else 0.0
        return feed, self.centres[PRESSURE] * (1.0 + swing * math.sin(self.cycles[1] * angle))

    def _climb(self) -> None:
        """Move the centres by the slopes of the window that has ended."""
        p = self.parameters
        if min(self.sums) <= 0.0:
            return
        # relative swings: of each quantity at both frequencies
        found = [
            [
                complex(self.waves[6 * k + 2 * i], self.waves[6 * k + 2 * i + 1]) / self.sums[i]
                for k in range(2)
            ]
            for i in range(3)
        ]
        feed, pressure, rate = found
        if p["seek.pressure_on"]:
            slopes = _two_slopes(feed, pressure, rate)
            if slopes is None:
                return
            self.gradients = list(slopes)
            self._move(PRESSURE, "pressure_gain", "pressure_lowest", "pressure_highest")
        else:
            own = abs(feed[0]) ** 2
            if own == 0.0:
                return
            self.gradients[FEED] = (rate[0] * feed[0].conjugate()).real / own
        self._move(FEED, "gain", "lowest", "highest")

    def _move(self, which: int, gain: str, lowest: str, highest: str) -> None:
        p = self.parameters
        most = p["seek.largest_move"]
        move = min(max(p[f"seek.{gain}"] * self.gradients[which], -most), most)
        moved = self.centres[which] * math.exp(move)
        self.centres[which] = min(max(moved, p[f"seek.{lowest}"]), p[f"seek.{highest}"])


def _two_slopes(
    feed: list[complex], pressure: list[complex], rate: list[complex]
) -> tuple[float, float] | None:
    """Real slopes over feed and pressure that explain the rate best; none if they are alike."""
    aa, bb = _product(feed, feed), _product(pressure, pressure)
    ab, ra, rb = _product(feed, pressure), _product(rate, feed), _product(rate, pressure)
    spread = aa * bb - ab * ab
    if spread <= ALIKE * aa * bb:
        return None
    return (ra * bb - rb * ab) / spread, (rb * aa - ra * ab) / spread


def _product(one: list[complex], other: list[complex]) -> float:
    return sum((a * b.conjugate()).real for a, b in zip(one, other, strict=True))
