"""Rock along a hole: a log through the filter."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from percussion_model.analysis.identify.cleaning import (
    COLLARING,
    FEWEST,
    Log,
    Samples,
    clean,
    ranges_of,
    without_lags,
)
from percussion_model.analysis.identify.drill import Drill
from percussion_model.analysis.identify.filter import ALIKE, Noise, RockFilter
from percussion_model.analysis.identify.observation import (
    GAMMA,
    RATE,
    SIGNALS,
    STIFFNESS,
    UNKNOWNS,
    Q,
    Table,
)
from percussion_model.analysis.identify.part import AXES, POINTS
from percussion_model.analysis.identify.prior import WITHIN, Prior, prior_of
from percussion_model.analysis.identify.tabulate import REACH, IdentifyError, tabulate
from percussion_model.scene.rocks.breaking import (
    EFFICIENCY,
    ENERGY_SHARES,
    energy_by_strength,
)
from percussion_model.scene.scene import Scene

# Standard deviations of an interval of 95 %.
SURE = 1.96
# The data determine what they narrow to less than this share of its prior.
DETERMINED = 0.4
# Noise that is assumed at least, and at most, by the logarithm, in the order of `SIGNALS`.
LEAST_NOISE, MOST_NOISE = (0.02, 0.003, 0.04), (0.4, 0.1, 0.6)
# Rocks of a table; fewer where no rock is named, whose motions often do not settle; blows of a
# drill string take fifty times as long.
MANY, WIDE, FEW = 300, 180, 25
SAMPLES = 100  # that are filtered in the time of a rock
# Rock from place to place, by the logarithm of its rate: by samples of a block, of which there have
# to be so many pairs at like settings; what is assumed without, at least, and at most.
BLOCK, FEWEST_STEPS, VARIES, LEAST_VARIES, MOST_VARIES = 20, 8, 0.01, 0.003, 0.1
# A rate so many times what is usual, or less by that, is likely in another unit than is said.
ODD = 10.0
# Mean absolute deviation of a normal variable, by its standard deviation.
MAD = 0.6745


@dataclass(frozen=True)
class Profile:
    """What a log tells of the rock.

    Attributes
    ----------
    depth : ndarray, shape (n,)
        Of the samples [m].
    mean, spread : ndarray, shape (n, 6)
        Logarithms of `UNKNOWNS` after each sample, and their standard deviations.
    layers : list of float
        Depths at which a layer was found to begin [m].
    samples : Samples
    table : Table
    prior : Prior
    noise : Noise
    worn : ndarray, shape (n,)
        Efficiency of the bit by that of a sharp one, as the scene has it.
    covariance : ndarray, shape (6, 6)
        Of the logarithms behind the last sample.
    """

    depth: np.ndarray
    mean: np.ndarray
    spread: np.ndarray
    layers: list[float]
    samples: Samples
    table: Table
    prior: Prior
    noise: Noise
    worn: np.ndarray
    covariance: np.ndarray

    def __repr__(self) -> str:
        ends = f"{self.depth[0]:.4g} to {self.depth[-1]:.4g} m"
        return f"Profile({ends}, samples={len(self.depth)}, layers={len(self.layers) + 1})"

    def interval(self, which: int = Q) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Low end, value and high end of an unknown, of 95 %, SI."""
        off = SURE * self.spread[:, which]
        return tuple(np.exp(self.mean[:, which] + k * off) for k in (-1.0, 0.0, 1.0))  # type: ignore[return-value]

    def strength(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Compressive strength by the library's relation: low end, value and high end [Pa].

        The crushing energy is what the log shows times the efficiency of the bit; the interval has
        that of the efficiency and that of the relation as well.
        """
        eta = math.sqrt(EFFICIENCY.low * EFFICIENCY.high) * self.worn
        sigma = math.hypot(
            math.log(EFFICIENCY.high / EFFICIENCY.low) / WITHIN,
            math.log(ENERGY_SHARES[1] / ENERGY_SHARES[0]) / WITHIN,
        )
        off = SURE * np.hypot(self.spread[:, Q], sigma)
        energy = self.mean[:, Q] + np.log(eta)
        return tuple(strength_by_energy(np.exp(energy + k * off)) for k in (-1.0, 0.0, 1.0))  # type: ignore[return-value]

    def determined(self) -> dict[str, bool]:
        """Whether the log determines an unknown, or it keeps its prior."""
        narrow = self.spread[-1] < DETERMINED * self.prior.spread
        return {name: bool(narrow[k]) for k, name in enumerate(UNKNOWNS)}

    def every(self, step: float) -> np.ndarray:
        """Samples at which rows are written: the last one in each step of depth [m]."""
        cell = np.floor(self.depth / step)
        return np.flatnonzero(np.append(np.diff(cell) > 0.0, True))

    def summary(self) -> dict[str, Any]:
        """Return the numbers as plain values."""
        low, value, high = self.interval()
        ends = [float(self.depth[0]), *self.layers, float(self.depth[-1])]
        found = []
        for top, bottom in pairwise(ends):
            k = max(int(np.searchsorted(self.depth, bottom)) - 1, 0)
            strength = [float(one[k]) for one in self.strength()]
            found.append(
                {"top": top, "bottom": bottom, "apparent_energy": float(value[k]),
                 "low": float(low[k]), "high": float(high[k]), "strength": strength[1],
                 "strength_low": strength[0], "strength_high": strength[2]}
            )  # fmt: skip
        return {
            "layers": found, "determined": self.determined(), "rows": self.samples.total,
            "samples": len(self.depth), "dropped": self.samples.dropped,
            "noise": dict(zip(SIGNALS, self.noise.values().tolist(), strict=True)),
            "table_errors": dict(zip(SIGNALS, self.table.errors.tolist(), strict=True)),
            "notes": self.samples.notes,
        }  # fmt: skip


def strength_by_energy(energy: np.ndarray) -> np.ndarray:
    """Compressive strength of a crushing energy [J/m^3], not below 0 [Pa]."""
    none, some = energy_by_strength(0.0), energy_by_strength(1.0e8)
    return np.maximum((energy - none) / (some - none) * 1.0e8, 0.0)


def identify(
    log: Log,
    drill: Drill,
    rock: str | None = None,
    collaring: float = COLLARING,
    table: Table | None = None,
    progress: Callable[[str, float | None], None] | None = None,
) -> Profile:
    """Return the rock along a hole.

    Parameters
    ----------
    log : Log
    drill : Drill
        Hammer and bit; the solver of its scene makes the table.
    rock : str, optional
        Whose numbers are the prior; any rock if left out.
    collaring : float
        Hole that is left out at its collar [m].
    table : Table, optional
        One made before, whose range must hold the log's.
    progress : callable, optional
        Called with words and the share that is done.

    Raises
    ------
    IdentifyError
        If the log, or the hammer at its settings, tells nothing.
    """
    tell = progress or (lambda words, share: None)
    drill, said = drill.at_pressure_of(log)
    scene = drill.scene
    own = {"pressure": drill.pressure or 1.0, "feed": scene["feed.force"],
           "speed": scene["rotation.speed"]}  # fmt: skip
    samples = clean(log, own, collaring)
    prior = prior_of(scene, rock)
    ends = 0.0
    if table is None:
        wanted = _ranges(samples, prior)
        size = FEW if scene["effects.string"] else MANY if rock else WIDE
        ends = size / (size + len(samples.depth) / SAMPLES)
        table = tabulate(
            scene, drill.changes, wanted, lambda s: tell("runs a table", ends * s), size
        )
    samples = clean(without_lags(log, samples, table, prior.mean), own, collaring)
    samples = samples.kept(table.contains(samples.settings), "pressure or feed out of the usual")
    if len(samples.depth) < FEWEST:
        raise IdentifyError(
            f"{log.name}: {len(samples.depth)} rows have pressure and feed in the range of the "
            f"table, at least {FEWEST} are wanted"
        )
    samples.notes += [said] * bool(said)
    samples.notes += _odd_rate(samples, table, prior)
    noise = noise_of(samples, table, prior)
    return _along(
        samples, table, prior, noise, scene,
        lambda share: tell("filters the log", ends + (1.0 - ends) * share),
    )  # fmt: skip


def _odd_rate(samples: Samples, table: Table, prior: Prior) -> list[str]:
    """Say so if rates are far from what the hammer drills in the rock of the prior."""
    unknowns = np.broadcast_to(prior.mean, (len(samples.depth), len(UNKNOWNS)))
    usual = np.exp(table.predict(unknowns, samples.settings)[:, RATE])
    times = float(np.nanmedian(samples.signals[:, RATE] / usual))
    if 1.0 / ODD < times < ODD:
        return []
    return [f"rate: {times:.2g} times what this hammer drills in usual rock: is its unit right?"]


def table_with_room(
    profile: Profile,
    drill: Drill,
    room: Mapping[str, tuple[float, float]],
    progress: Callable[[float], None] | None = None,
) -> Table:
    """Return a table that reaches beyond the settings of a log.

    Parameters
    ----------
    drill : Drill
        At the pressure of the log.
    room : mapping of tuple
        Shares of the least and the greatest pressure and feed.
    """
    ranges = _ranges(profile.samples, profile.prior, room)
    size = FEW if drill.scene["effects.string"] else MANY // 4
    return tabulate(drill.scene, drill.changes, ranges, progress, size)


def part_filter(profile: Profile, drill: Drill) -> RockFilter:
    """Return a filter for a part, whose table reaches as far as that of a profile."""
    middle, half = profile.table.middle, profile.table.half
    ends = zip(np.exp(middle - half).tolist(), np.exp(middle + half).tolist(), strict=True)
    ranges = dict(zip(AXES, ends, strict=True))
    table = tabulate(drill.scene, drill.changes, ranges, points=POINTS, with_splines=False)
    return RockFilter(table, profile.prior.mean, profile.prior.spread, profile.noise)


def _ranges(
    samples: Samples, prior: Prior, room: Mapping[str, tuple[float, float]] | None = None
) -> dict[str, tuple[float, float]]:
    found = {}
    for name, (low, high) in zip(("pressure", "feed"), ranges_of(samples), strict=True):
        less, more = (room or {}).get(name, (1.0, 1.0))
        found[name] = less * low, more * high
    for name, k in (("unloading_ratio", GAMMA), ("loading_stiffness", STIFFNESS)):
        off = REACH * prior.spread[k]
        found[name] = math.exp(prior.mean[k] - off), math.exp(prior.mean[k] + off)
    return found


def noise_of(samples: Samples, table: Table, prior: Prior) -> Noise:
    """Noise of each signal by what it does from sample to sample beyond its settings.

    Noise that goes on from one sample to the next counts for more, as many of its samples tell no
    more than few.
    """
    unknowns = np.broadcast_to(prior.mean, (len(samples.depth), len(UNKNOWNS)))
    off = np.log(samples.signals) - table.predict(unknowns, samples.settings)
    found = dict(zip(SIGNALS, LEAST_NOISE, strict=True))
    for k, name in enumerate(SIGNALS):
        values = off[np.isfinite(off[:, k]), k]
        if len(values) < 3:
            continue
        one, two = (_scatter(values[n:] - values[:-n]) for n in (1, 2))
        # of noise that fades by r from sample to sample, differences over 2 and 1 are as 1 + r
        kept = (two / max(one, 1e-9)) ** 2 - 1.0 - SURE / math.sqrt(len(values))
        kept = min(max(kept, 0.0), 0.9)
        one = float(np.median(np.abs(np.diff(values)))) / MAD  # which outliers hardly move
        sigma = one / math.sqrt(2.0 * (1.0 - kept)) * math.sqrt((1.0 + kept) / (1.0 - kept))
        found[name] = float(np.clip(sigma, LEAST_NOISE[k], MOST_NOISE[k]))
    return Noise(**found, varies=_varies(off[:, RATE], samples.settings, found["rate"]))


def _varies(off: np.ndarray, settings: np.ndarray, sigma: float) -> float:
    """What rock differs by from place to place in a layer, as far as rates show it beyond noise.

    Medians of a block have 1.57 times the variance of its mean.
    """
    known = np.flatnonzero(np.isfinite(off))
    there = known[: len(known) // BLOCK * BLOCK].reshape(-1, BLOCK)
    logs = np.log(settings)[there]
    even = np.ptp(np.concatenate([logs[1:], logs[:-1]], axis=1), axis=1).max(axis=1) < ALIKE
    steps = np.diff(np.median(off[there], axis=1))[even]
    if len(steps) < FEWEST_STEPS:
        return VARIES
    noise = 1.57 * sigma**2 / BLOCK * (1.0 + SURE * math.sqrt(2.0 / len(steps)))
    beyond = 0.5 * _scatter(steps) ** 2 - noise
    return float(np.clip(math.sqrt(max(beyond, 0.0)), LEAST_VARIES, MOST_VARIES))


def _scatter(steps: np.ndarray) -> float:
    """Standard deviation of differences, of which outliers and layers count as three of them."""
    most = 3.0 * float(np.median(np.abs(steps))) / MAD
    return float(np.sqrt(np.mean(np.minimum(np.abs(steps), most) ** 2)))


def _along(
    samples: Samples,
    table: Table,
    prior: Prior,
    noise: Noise,
    scene: Scene,
    tell: Callable[[float], None],
) -> Profile:
    found = RockFilter(table, prior.mean, prior.spread, noise)
    count = len(samples.depth)
    mean, spread = np.empty((count, len(UNKNOWNS))), np.empty((count, len(UNKNOWNS)))
    layers: list[float] = []
    deeper = np.diff(samples.depth, prepend=samples.depth[:1])
    for k in range(count):
        ago = found.sample(float(deeper[k]), samples.settings[k], samples.signals[k])
        if ago:
            layers[found.layers - 1 :] = [float(samples.depth[k - ago + 1])]
            # found by samples that had been taken for the layer above
            mean[k - ago + 1 : k], spread[k - ago + 1 : k] = found.x, found.sigma
        mean[k], spread[k] = found.x, found.sigma
        if k % 500 == 0:
            tell(k / count)
    length, worn = scene["breaking.wear_length"], np.ones(count)
    if length:
        fresh = np.exp(-(scene["breaking.drilled"] + samples.depth - samples.depth[0]) / length)
        worn = scene["breaking.worn"] + (1.0 - scene["breaking.worn"]) * fresh
    return Profile(
        samples.depth, mean, spread, layers, samples, found.table, prior, noise, worn, found.p
    )
