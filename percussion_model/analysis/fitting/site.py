"""Breaking and rotation fitted to rates and torques of a site, or to craters of one button.

Rates tell the crushing energy by the efficiency of the bit; rates at two speeds of rotation the
renewal length; torques the friction; rates at two pressures the threshold. What the data do not
tell stays close to its prior, the interval of the rock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from percussion_model.analysis.fitting.measurements import FitError
from percussion_model.scene.rocks import Number, read_rock
from percussion_model.scene.rocks.breaking import EFFICIENCY, numbers_under, rock_of
from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import simulate

# Parameters that are fitted, all by their logarithms.
FITTED = (
    "breaking.crushing_energy", "breaking.threshold", "rotation.renewal_length",
    "rotation.friction",
)  # fmt: skip
# What may be measured, by key of a summary: unit, error as a share, and more than any drill has.
RATE = "rate_of_penetration"
MEASURED = {
    RATE: ("m/s", 0.03, 0.5),
    "rotation_torque": ("N m", 0.1, 1e6),
}
# Errors that a number may be off by, and be explained.
EXPLAINED = 3.0
# Without an interval a parameter is known within a factor e.
UNKNOWN = 1.0
# Standard deviations from low to high of an interval that holds nine tenths.
WITHIN = 3.29
# The data tell what they narrow to less than this share of its prior.
TOLD = 0.5
DURATION, SETTLE = 6.0, 1.0  # of a run [s]
STEP, MOST_STEPS, SETTLED = 0.03, 8, 0.003  # in logarithms
LONGEST_MOVE = 0.7
# More than a button of any bit breaks [m^3].
MOST_CRATER = 1e-3


@dataclass(frozen=True)
class SiteEstimate:
    """A parameter: its value and standard error as a factor, and those before."""

    key: str
    value: float
    factor: float
    prior: float
    prior_factor: float

    @property
    def is_told(self) -> bool:
        """Whether the data narrow it to less than half, by the logarithm."""
        return math.log(self.factor) < TOLD * math.log(self.prior_factor)


@dataclass(frozen=True)
class SiteFit:
    """What data tell of a scene."""

    estimates: tuple[SiteEstimate, ...]
    rows: tuple[tuple[str, float, float], ...]  # name, measured and of the model, at each setting
    rate: float  # of the scene with what was fitted [m/s]
    rate_factor: float  # its standard error by that of the parameters, as a factor

    def rate_interval(self) -> tuple[float, float]:
        """Rates between which that of the scene lies with nine tenths, by the parameters [m/s]."""
        wide = self.rate_factor ** (WITHIN / 2.0)
        return self.rate / wide, self.rate * wide

    def unexplained(self) -> list[str]:
        """Names of the measured numbers that the model misses by more than their error."""
        return [
            name
            for name, measured, model in self.rows
            if abs(math.log(model / measured)) > EXPLAINED * MEASURED[name.split()[0]][1]
        ]

    def changes(self) -> dict[str, float]:
        """Values of the parameters, which hold together."""
        return {one.key: one.value for one in self.estimates}


def fit_site(
    scene: Scene,
    columns: Mapping[str, Sequence[float]],
    progress: Callable[[int], None] | None = None,
) -> SiteFit:
    """Fit crushing energy, threshold, renewal length and friction to rates and torques.

    Parameters
    ----------
    scene : Scene
        With effects.breaking and effects.rotation.
    columns : mapping of sequence of float
        Of equal length, SI units: settings by keys of the scene, and measured numbers by
        `MEASURED`; NaN where a number was not measured.
    progress : callable, optional
        Called with the number of settings that were run.

    Raises
    ------
    FitError
        If there is nothing to fit, or a setting has no rate.
    """
    if not (scene["effects.breaking"] and scene["effects.rotation"]):
        raise FitError("a fit to a site needs effects.breaking and effects.rotation: give --bit")
    names = [name for name in MEASURED if name in columns]
    for name in names:
        _refuse_impossible(name, columns[name])
    data = [
        (name, k, math.log(value))
        for name in names
        for k, value in enumerate(columns[name])
        if value > 0.0
    ]
    if not data:
        raise FitError(f"nothing was measured: give a column {' or '.join(MEASURED)}")
    settings = [
        {key: float(values[k]) for key, values in columns.items() if key not in MEASURED}
        for k in range(len(columns[names[0]]))
    ]
    count = 0

    def run(place: np.ndarray, setting: Mapping[str, float]) -> dict[str, float]:
        nonlocal count
        count += 1
        if progress is not None:
            progress(count)
        fitted = dict(zip(FITTED, np.exp(place).tolist(), strict=True))
        return _summary(scene.replace(**fitted), setting)

    def model(place: np.ndarray) -> np.ndarray:
        found = [run(place, setting) for setting in settings]
        return np.array([_log_of(found[k], name, settings[k]) for name, k, _ in data])

    def own_rate(place: np.ndarray) -> np.ndarray:
        return np.array([_log_of(run(place, {}), RATE, {})])

    center, spread = _prior(scene)
    measured = np.array([value for *_, value in data])
    sigma = np.array([MEASURED[name][1] for name, *_ in data])
    place, covariance, last = _best(model, center, spread, measured, sigma)
    errors = np.sqrt(np.diag(covariance))
    estimates = tuple(
        SiteEstimate(key, *(math.exp(one) for one in four))
        for key, *four in zip(FITTED, place, errors, center, spread, strict=True)
    )
    rows = tuple(
        (f"{name} {k + 1}", math.exp(value), math.exp(found))
        for (name, k, value), found in zip(data, last.tolist(), strict=True)
    )
    log_rate = own_rate(place)
    slope = _slopes(own_rate, place, log_rate)[0]
    error = math.sqrt(slope @ covariance @ slope)
    return SiteFit(estimates, rows, math.exp(log_rate[0]), math.exp(error))


def _refuse_impossible(name: str, values: Sequence[float]) -> None:
    """Raise `FitError` for numbers that no drill has."""
    unit, _, most = MEASURED[name]
    for row, value in enumerate(values, 1):
        if not 0.0 < value <= most:
            raise FitError(
                f"{name} = {value:g} {unit} in row {row} of numbers: must be above 0 and at most "
                f"{most:g} {unit}; a heading may carry another unit, as rate_of_penetration [m/h]"
            )


def _summary(scene: Scene, setting: Mapping[str, float]) -> dict[str, float]:
    changed = scene.replace(**setting)
    found: dict[str, float] = simulate(
        changed, DURATION, SETTLE, error_estimate=False, record_events=False
    ).summary()
    return found


def _log_of(summary: Mapping[str, float], name: str, setting: Mapping[str, float]) -> float:
    value = summary[name]
    if not value or value <= 0.0:
        told = ", ".join(f"{key} = {one:g}" for key, one in setting.items()) or "the scene"
        raise FitError(f"the model has no {name} at {told}: it is not drilling there")
    return math.log(value)


def _prior(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Logarithms of the parameters before, and their standard deviations."""
    name = rock_of(scene)
    known = {one.key: one for one in numbers_under(read_rock(name), scene)} if name else {}
    spread = {key: _spread(known[key]) if key in known else UNKNOWN for key in FITTED}
    # rates tell it by the efficiency of the bit alone
    spread[FITTED[0]] = math.hypot(spread[FITTED[0]], _spread(EFFICIENCY))
    return np.log([scene[key] for key in FITTED]), np.array(list(spread.values()))


def _spread(number: Number) -> float:
    """Standard deviation of the logarithm of a number, by its interval."""
    return math.log(number.high / number.low) / WITHIN


def _best(
    model: Callable[[np.ndarray], np.ndarray],
    center: np.ndarray,
    spread: np.ndarray,
    measured: np.ndarray,
    sigma: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Most likely place by Gauss-Newton, its covariance, and the model there."""
    place, prior = center.copy(), np.diag(1.0 / spread**2)
    here = model(place)
    for _ in range(MOST_STEPS):
        slopes = _slopes(model, place, here)
        weighted = slopes / sigma[:, np.newaxis] ** 2
        matrix = slopes.T @ weighted + prior
        pull = weighted.T @ (measured - here) - prior @ (place - center)
        move = np.clip(np.linalg.solve(matrix, pull), -LONGEST_MOVE, LONGEST_MOVE)
        place = place + move
        here = model(place)
        if np.max(np.abs(move)) < SETTLED:
            break
    return place, np.linalg.inv(matrix), here


def _slopes(
    model: Callable[[np.ndarray], np.ndarray], place: np.ndarray, here: np.ndarray
) -> np.ndarray:
    """How a model changes with each parameter; `here` is what it gives at the place."""
    steps = STEP * np.eye(len(place))
    return np.stack([(model(place + step) - here) / STEP for step in steps], axis=1)


def fit_craters(energy: Sequence[float], volume: Sequence[float]) -> tuple[float, ...]:
    """Crushing energy and threshold of one button from single craters.

    Parameters
    ----------
    energy, volume : sequence of float
        Energy crushed [J] and volume of each crater [m^3]; at least three of different energy.

    Returns
    -------
    crushing_energy, error : float
        By least squares of W = W_0 + e_c V [J/m^3].
    threshold, error : float
        [J]

    Raises
    ------
    FitError
        If there are fewer, or the volumes do not grow.
    """
    x, y = np.asarray(volume, float), np.asarray(energy, float)
    if not (np.all(x >= 0.0) and np.all(y > 0.0) and np.all(x < MOST_CRATER)):
        raise FitError(
            f"craters of {x.min():g} to {x.max():g} m^3 at {y.min():g} to {y.max():g} J: volumes "
            f"must be from 0 to {MOST_CRATER:g} m^3 and energies above 0 J; a heading may carry "
            "another unit, as volume [cm^3]"
        )
    if len(np.unique(x)) < 3 or len(x) != len(y):
        raise FitError(f"{len(x)} craters: at least three of different volume are wanted")
    ones = np.stack([x, np.ones_like(x)], axis=1)
    (slope, start), *_ = np.linalg.lstsq(ones, y, rcond=None)
    off = y - ones @ np.array([slope, start])
    variance = float(off @ off) / max(len(x) - 2, 1)
    errors = np.sqrt(np.diag(variance * np.linalg.inv(ones.T @ ones)))
    if not slope > 0.0:
        raise FitError("the volumes do not grow with the energy: no crushing energy follows")
    return float(slope), float(errors[0]), float(start), float(errors[1])
