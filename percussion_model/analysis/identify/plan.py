"""Which change of settings in the next metre would tell most of the rock."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from percussion_model.analysis.identify.filter import alike
from percussion_model.analysis.identify.observation import (
    RATE,
    SETTINGS,
    UNKNOWNS,
    Q,
    Table,
)
from percussion_model.analysis.identify.profile import SURE, Profile

# Shares of a setting that are tried, and hole that is drilled [m], half of it changed.
SHARES = {
    "pressure": (0.85, 0.88, 0.92, 0.96, 1.04, 1.08), "feed": (0.85, 0.92, 1.08, 1.15, 1.22, 1.3),
    "speed": (0.4, 0.5, 0.6, 0.8, 1.25, 1.5),
}  # fmt: skip
METRE, CHANGED = 1.0, 0.5
# Room of a table beyond the settings of a log, so that changes lie in it.
ROOM = {"pressure": (0.84, 1.09), "feed": (0.84, 1.31)}
_STEP = 0.01  # of slopes, by the logarithm


@dataclass(frozen=True)
class Change:
    """A setting that is changed for half of the next metre.

    Attributes
    ----------
    setting : str
        By `SETTINGS`; empty for none.
    share, value : float
        Of the present value; the new one, SI.
    spread : float
        Standard deviation of ln q after that metre.
    narrowed : dict of float
        Standard deviations of other unknowns by those without the change, where less than 0.9.
    """

    setting: str
    share: float
    value: float
    spread: float
    narrowed: dict[str, float]

    @property
    def interval(self) -> float:
        """Half the interval of 95 % of q, by its value."""
        return math.exp(SURE * self.spread) - 1.0


def plan(profile: Profile, table: Table | None = None) -> list[Change]:
    """Return changes by what they tell, the best first; no change is among them.

    Of a table that reaches beyond the settings of the log, where one is given.

    By Fisher's information of the next metre: half of it as now, half with one setting changed,
    added to what is known behind the last sample.
    """
    now = np.median(profile.samples.settings[-20:], axis=0)
    given = np.isfinite(profile.samples.signals).any(axis=0)
    rate = float(np.nanmedian(profile.samples.signals[-100:, RATE]))
    step = np.diff(profile.depth)
    spacing = float(np.median(step[step > 0.0])) if np.any(step > 0.0) else rate
    count = METRE / max(spacing, 1e-4)
    table = table or profile.table
    none = _after(profile, table, [now], [count], given)
    found = [Change("", 1.0, 0.0, float(none[Q]), {})]
    for k, name in enumerate(SETTINGS):
        for share in SHARES[name]:
            other = now.copy()
            other[k] *= share
            if not table.contains(other[np.newaxis])[0]:
                continue
            both = [(1.0 - CHANGED) * count, CHANGED * count]
            spread = _after(profile, table, [now, other], both, given)
            less = {
                one: float(spread[j] / none[j])
                for j, one in enumerate(UNKNOWNS)
                if j != Q and spread[j] < 0.9 * none[j]
            }
            found.append(Change(name, share, float(other[k]), float(spread[Q]), less))
    return sorted(found, key=lambda one: one.spread)


def _after(
    profile: Profile,
    table: Table,
    settings: Sequence[np.ndarray],
    counts: Sequence[float],
    given: np.ndarray,
) -> np.ndarray:
    """Standard deviations of the unknowns after samples at settings."""
    logs = np.log(settings)
    slopes = slopes_of(table, profile.mean[-1], np.array(settings))[:, given]
    own = profile.noise.values() ** 2 / np.array(counts)[:, np.newaxis]
    own[:, RATE] += profile.noise.varies**2
    matrix = np.concatenate(slopes)
    errors = np.diag(table.errors[given] ** 2)
    total = matrix @ profile.covariance @ matrix.T + np.kron(alike(logs), errors)
    total += np.diag(own[:, given].ravel())
    gain = np.linalg.solve(total, matrix @ profile.covariance).T
    return np.sqrt(np.diag(profile.covariance - gain @ matrix @ profile.covariance))


def slopes_of(table: Table, unknowns: np.ndarray, settings: np.ndarray) -> np.ndarray:
    """Slopes of the signals' logarithms by those of the unknowns, shape (n, 3, 6).

    Parameters
    ----------
    unknowns : ndarray, shape (6,)
    settings : ndarray, shape (n, 3)
    """
    steps = _STEP * np.eye(len(unknowns))
    up, down = (
        np.stack([table.predict(np.tile(unknowns + step, (len(settings), 1)), settings)
                  for step in sign * steps], axis=2)
        for sign in (1.0, -1.0)
    )  # fmt: skip
    return (up - down) / (2.0 * _STEP)
