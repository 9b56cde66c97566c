"""What a fit of the rock found: estimates, intervals, rivals, and what they explain."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from percussion_model.analysis.fitting.likelihood import (
    DAMPING,
    ENERGY,
    EXPONENT,
    RATIO,
    STIFFNESS,
    UNLOADING,
)
from percussion_model.analysis.fitting.measurements import (
    QUANTITIES,
    SIGNALS,
    Curve,
    DropTest,
    Reading,
)
from percussion_model.simulation.uncertain import ABOUT, SHOWN_DIGITS, in_digits

NAMES = {
    STIFFNESS: "K_R",
    EXPONENT: "n",
    RATIO: "gamma",
    UNLOADING: "q",
    DAMPING: "C_R",
    ENERGY: "W_R",
}
# Parameters of each rock law that can be fitted.
LAWS = {
    "bilinear": (STIFFNESS, RATIO, DAMPING, ENERGY),
    "power": (STIFFNESS, EXPONENT, RATIO, UNLOADING, DAMPING, ENERGY),
}

Source = Curve | DropTest | Reading
DETERMINED, RIVALLED = "determined", "rival"
OPEN_ABOVE, OPEN_BELOW, OPEN = "open above", "open below", "open"
WIDE = "not determined"
# The model does not explain the data; a parameter that is not told from an unknown of a sensor.
MISFIT, UNTOLD = "not explained", "not distinguished"
# Minima are told up to this deviance above the best: less likely by exp(-10).
TOLD = 20.0
# Digits of a parameter that is not determined.
FEW_DIGITS = 2
# The deviance may be off by the roughness at the best place and at the other: the threshold is
# higher by so many of it. A roughness from `ROUGH` on is told.
ROUGH_FACTOR, ROUGH = 2.0, 1.0


class Estimate(NamedTuple):
    """A fitted parameter, SI units.

    `low` and `high` are the ends of the interval; where it is open, those of what was searched.
    """

    value: float
    low: float
    high: float
    verdict: str

    @property
    def determined(self) -> bool:
        """Whether the interval is closed, and no wider than `fit.MOST_DECADES`."""
        return self.verdict in (DETERMINED, RIVALLED)

    def texts(self) -> tuple[str, str, str]:
        """Value and ends of the interval with the digits that are known.

        To the second digit of half the interval; two digits, and a value that is about so,
        where nothing is determined.
        """
        half = 0.5 * (self.high - self.low)
        numbers = self.value, self.low, self.high
        if not self.determined:
            value, low, high = _shown(numbers, [FEW_DIGITS] * 3)
            return f"{ABOUT}{value}", low, high
        if not half > 0.0:
            return _shown(numbers, [SHOWN_DIGITS] * 3)
        place = math.floor(math.log10(half)) - 1
        digits = [math.floor(math.log10(abs(one) or half)) - place + 1 for one in numbers]
        return _shown(numbers, [min(max(one, FEW_DIGITS), SHOWN_DIGITS) for one in digits])


def _shown(numbers: Sequence[float], digits: Sequence[int]) -> tuple[str, str, str]:
    value, low, high = map(in_digits, numbers, digits)
    return value, low, high


class SensorEstimate(NamedTuple):
    """An unknown of a sensor, SI units; `width` is the standard deviation of its prior, about 0."""

    name: str
    unit: str
    value: float
    error: float
    width: float

    def texts(self) -> tuple[str, str, str]:
        """Value, error and width with their unit."""
        value, error, width = (
            f"{in_digits(one, 2)} {self.unit}" for one in (self.value, self.error, self.width)
        )
        return value, error, width


@dataclass(frozen=True)
class Explained:
    """One series of measurements and what the best fit says of it, SI units."""

    name: str
    data: np.ndarray = field(repr=False)
    fitted: np.ndarray = field(repr=False)
    noise: float
    source: Source = field(repr=False)
    sensor: tuple[SensorEstimate, ...] = ()

    @property
    def noise_is_given(self) -> bool:
        """Whether the noise came with the data; else it is estimated."""
        return isinstance(self.source, Reading)

    def noise_text(self, factor: float = 1.0) -> str:
        """The noise in another unit; what was given has all its digits."""
        noise = factor * self.noise
        return f"{noise:.6g}" if self.noise_is_given else in_digits(noise)

    @property
    def unit(self) -> str:
        """SI unit of the data."""
        if isinstance(self.source, Curve):
            return "N"
        if isinstance(self.source, DropTest):
            return SIGNALS[self.source.signal][0]
        return QUANTITIES[self.source.quantity][0]

    @property
    def residuals(self) -> np.ndarray:
        """Data less fit."""
        return self.data - self.fitted


@dataclass(frozen=True)
class Rival:
    """Another minimum, and how much less likely it is than the best."""

    values: dict[str, float]
    deviance: float

    @property
    def odds(self) -> float:
        """Its likelihood by that of the best."""
        return math.exp(-0.5 * self.deviance)


@dataclass(frozen=True)
class Fit:
    """What a fit found, SI units.

    Attributes
    ----------
    law : str
        Rock law, one of `LAWS`.
    estimates : dict of Estimate
        By the dotted key of the parameter.
    confidence : float
        Of the intervals, all of them together, unless they are widened.
    quantile : float
        Deviance above the best to which the region of that confidence reaches.
    threshold : float
        Deviance above the best at the ends of the intervals: the quantile, and what the
        roughness of the likelihood adds.
    explained : list of Explained
        Each series of measurements.
    rivals : list of Rival
        Other minima, the likeliest first.
    profiles : dict of (ndarray, ndarray)
        Values of a parameter, and the lowest deviance above the best that was found there.
    runs : int
        How many places were computed.
    warnings : list of str
        What one should know before using the numbers.
    """

    law: str
    estimates: dict[str, Estimate]
    confidence: float
    quantile: float
    threshold: float
    explained: list[Explained]
    rivals: list[Rival]
    profiles: dict[str, tuple[np.ndarray, np.ndarray]] = field(repr=False)
    runs: int
    warnings: list[str]

    @property
    def roughness(self) -> float:
        """Size of the many small dips of the deviance."""
        return (self.threshold - self.quantile) / ROUGH_FACTOR

    @property
    def is_widened(self) -> bool:
        """Whether that makes the intervals wider than those of `confidence`."""
        return self.roughness >= ROUGH

    @property
    def kept(self) -> list[str]:
        """Parameters of the law that were not fitted."""
        return [key for key in LAWS[self.law] if key not in self.estimates]

    def changes(self, undetermined: bool = False) -> dict[str, float]:
        """Fitted parameters for `Scene.replace`; without those that are not determined."""
        return {
            key: found.value
            for key, found in self.estimates.items()
            if found.determined or undetermined
        }

    def summary(self) -> dict[str, Any]:
        """Return the numbers as plain values for JSON."""
        return {
            "law": self.law,
            "estimates": {key: found._asdict() for key, found in self.estimates.items()},
            "confidence": self.confidence,
            "quantile": self.quantile,
            "threshold": self.threshold,
            "widened": self.is_widened,
            "measurements": {
                one.name: {
                    "data": len(one.data),
                    "noise": one.noise,
                    "sensor": {it.name: it._asdict() for it in one.sensor},
                }
                for one in self.explained
            },
            "rivals": [
                {"values": one.values, "deviance": one.deviance, "odds": one.odds}
                for one in self.rivals
            ],
            "runs": self.runs,
            "warnings": self.warnings,
        }
