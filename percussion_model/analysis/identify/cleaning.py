"""Samples of a log in which a bit drilled on rock, by stated rules."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from percussion_model.analysis.identify.observation import RATE, SETTINGS, SIGNALS, Table
from percussion_model.analysis.identify.tabulate import IdentifyError

# SI units of what a log may have; time, depth, settings and signals are used.
COLUMNS = {
    "time": "s", "depth": "m", "rate": "m/s", "pressure": "Pa", "feed": "N", "speed": "rad/s",
    "frequency": "Hz", "torque": "N m", "feed_pressure": "Pa", "rotation_pressure": "Pa",
}  # fmt: skip
# The bit is back by so much: a rod change, or a retraction [m].
BACK = 0.05
# A leap down by more in one row [m] is a fault where the depth comes back in so many rows.
DEEPER, SOON = 0.5, 60
# Hole that is left out at its collar, and behind each stop [m].
COLLARING, RUN_IN = 0.5, 0.05
# Less of what is usual in the log: percussion or feed is off.
OFF = 0.6
# More than any drill has [m/s, Hz, N m], and a gap in time is this many usual steps.
MOST = (0.5, 500.0, 1e6)
GAP = 10.0
# A rate from depth and time is that over so many samples.
OVER = 5
# Samples by which a signal may lag, the difference that is looked at, and how much more likely a
# lag has to be than none, by the logarithm.
MOST_LAG, DIFFERENCE, LIKELIER = 12, 5, 20.0
# A signal that the settings move by less tells no lag, by the logarithm.
LEAST_SWING = 1e-3
FEWEST = 30
# Part of pressures and feeds at each end of which no table is made.
ENDS = 0.005


@dataclass(frozen=True)
class Log:
    """Columns of a log.

    Attributes
    ----------
    name : str
    columns : dict of ndarray
        By `COLUMNS`, SI, all of one length; NaN is what is missing.
    rows : ndarray of int
        Of the file, from 1.
    notes : list of str
        What reading it had to decide.
    """

    name: str
    columns: dict[str, np.ndarray]
    rows: np.ndarray
    notes: list[str] = field(default_factory=list)


@dataclass
class Samples:
    """What is left of a log.

    Attributes
    ----------
    depth : ndarray, shape (n,)
        [m]
    settings, signals : ndarray, shape (n, 3)
        By `SETTINGS` and `SIGNALS`, SI; NaN is a signal that is missing.
    rows : ndarray of int
        Of the file.
    dropped : dict of int
        Rows that were left out, by the rule.
    notes : list of str
        What else was decided.
    total : int
        Rows of the log.
    """

    depth: np.ndarray
    settings: np.ndarray
    signals: np.ndarray
    rows: np.ndarray
    dropped: dict[str, int]
    notes: list[str]
    total: int

    def kept(self, which: np.ndarray, rule: str) -> Samples:
        """Those that a rule leaves, which is counted."""
        count = int(np.sum(~which))
        dropped = self.dropped | ({rule: self.dropped.get(rule, 0) + count} if count else {})
        return Samples(
            self.depth[which], self.settings[which], self.signals[which], self.rows[which],
            dropped, self.notes, self.total,
        )  # fmt: skip


def clean(log: Log, own: dict[str, float], collaring: float = COLLARING) -> Samples:
    """Return the samples of a log in which the bit drilled.

    Parameters
    ----------
    own : dict of float
        Pressure [Pa], feed [N] and speed [rad/s] of the hammer, for what the log does not have.
    collaring : float
        Hole at its collar that is left out [m].

    Raises
    ------
    IdentifyError
        If a rate cannot be had, or nothing is left.
    """
    notes = list(log.notes)
    columns, total = dict(log.columns), len(log.rows)
    rate = _rate(log, notes)
    depth = columns.get("depth")
    if depth is None:
        depth = np.cumsum(np.nan_to_num(rate * _steps(columns["time"])))
        notes.append("depth: none in the log; the sum of rate and time")
    elif -np.nanmin(depth, initial=0.0) > np.nanmax(depth, initial=0.0):
        depth = -depth
        notes.append("depth: counted negative downwards in the log; turned")
    settings = np.stack([_setting(columns, name, own, total, notes) for name in SETTINGS], axis=1)
    signals = np.full((total, len(SIGNALS)), np.nan)
    for k, (name, most) in enumerate(zip(SIGNALS, MOST, strict=True)):
        values = rate if k == RATE else columns.get(name)
        if values is not None:
            signals[:, k] = values
            wrong = np.isfinite(values) & ((values > most) | (values < 0.0))
            if wrong.any():
                first = log.rows[wrong][0]
                notes.append(f"{name}: {wrong.sum()} values no drill has, the first in row {first}")
            signals[wrong | (values <= 0.0), k] = np.nan
    off_rows = np.isfinite(rate) & (rate <= 0.0)
    found = Samples(depth, settings, signals, log.rows, {}, notes, total)
    time = columns.get("time")
    new = np.ones(total, bool)
    if time is not None:
        same = (np.diff(time) == 0.0) & (np.diff(depth) == 0.0)
        new[1:] = ~same
        resets = int(np.sum(np.diff(time) < 0.0))
        if resets:
            notes.append(f"time: set back {resets} times; the depth shows the order")
    there = np.isfinite(depth) & np.all(np.isfinite(settings), axis=1)
    leaps = _leaps(depth)
    deepest = np.maximum.accumulate(np.where(np.isfinite(depth) & ~leaps, depth, -np.inf))
    back = depth < deepest - BACK
    drills = there & new & ~leaps & ~back & ~off_rows
    usual = np.median(settings[drills], axis=0) if drills.any() else np.ones(len(SETTINGS))
    off = np.any(settings[:, :2] < OFF * usual[:2], axis=1)
    rules = (
        ("repeated", new),
        ("without depth or setting", there),
        ("whose depth leaps away and comes back", ~leaps),
        ("bit back for a rod or in retraction", ~back),
        ("with percussion or feed off", ~off),
        ("without advance", ~off_rows),
        ("at the collar", depth >= np.nanmin(depth, initial=np.inf) + collaring),
        ("behind a stop", ~_behind_stops(depth, deepest, time, back | off | off_rows)),
        ("without a rate", np.isfinite(signals[:, RATE])),
    )
    alive = np.ones(total, bool)
    for rule, good in rules:
        found = found.kept(good[alive], rule)
        alive &= good
    if len(found.depth) < FEWEST:
        told = ", ".join(f"{rule} {count}" for rule, count in found.dropped.items())
        falls = np.mean(np.diff(depth[np.isfinite(depth)]) < 0.0) > 0.5 if total > 1 else False
        raise IdentifyError(
            f"{log.name}: {len(found.depth)} of {total} rows are left, at least {FEWEST} are "
            f"wanted; dropped: {told or 'none'}"
            + ("; depth falls from row to row: are the rows in reverse order?" if falls else "")
        )
    return found


def _leaps(depth: np.ndarray) -> np.ndarray:
    """Whether a depth is a fault: a leap down in one row, from which it comes back soon."""
    found = np.zeros(len(depth), bool)
    down = np.flatnonzero(np.diff(depth) > DEEPER)
    for k in down:
        back = np.flatnonzero(depth[k + 1 : k + 1 + SOON] < depth[k] + DEEPER)
        if len(back):
            found[k + 1 : k + 1 + back[0]] = True
    return found


def _steps(time: np.ndarray) -> np.ndarray:
    """Steps of time; none where it was set back or stood [s]."""
    step = np.diff(time, prepend=time[:1])
    usual = np.nanmedian(step[step > 0.0]) if np.any(step > 0.0) else 0.0
    return np.where((step > 0.0) & (step < GAP * usual), step, 0.0)


def _rate(log: Log, notes: list[str]) -> np.ndarray:
    columns = log.columns
    if "rate" in columns:
        return columns["rate"]
    if "depth" not in columns or "time" not in columns:
        raise IdentifyError(f"{log.name}: no column is rate, and depth over time shows none")
    passed = np.cumsum(_steps(columns["time"]))
    rate = np.full(len(passed), np.nan)
    span = passed[OVER:] - passed[:-OVER]
    way = columns["depth"][OVER:] - columns["depth"][:-OVER]
    shift = OVER // 2
    rate[shift : shift + len(span)] = np.where(span > 0.0, way / np.maximum(span, 1e-12), np.nan)
    rate[np.arange(len(rate)) % OVER != shift] = np.nan  # those between share what they tell
    notes.append(f"rate: none in the log; depth over time, one of {OVER} rows each")
    return rate


def _setting(
    columns: dict[str, np.ndarray], name: str, own: dict[str, float], total: int, notes: list[str]
) -> np.ndarray:
    """A setting; one whose scale is not known has the hammer's own value at its median."""
    values = columns.get(name)
    if values is None and name == "feed" and "feed_pressure" in columns:
        values = columns["feed_pressure"]
        usual = float(np.nanmedian(values[values > 0.0])) if np.any(values > 0.0) else np.nan
        notes.append(
            f"feed: {own['feed']:.4g} N at the median of the feed pressure, {usual:.4g} Pa, and in "
            "proportion; give its area in a mapping file"
        )
        return values * (own["feed"] / usual)
    if values is None:
        notes.append(f"{name}: none in the log; the hammer's, {own[name]:.4g} {COLUMNS[name]}")
        return np.full(total, own[name])
    return np.where(values > 0.0, values, np.where(np.isfinite(values), 1e-9, np.nan))


def _behind_stops(
    depth: np.ndarray, deepest: np.ndarray, time: np.ndarray | None, stopped: np.ndarray
) -> np.ndarray:
    """Whether a row is within the run-in behind a stop or a gap in time."""
    stops = stopped.copy()
    if time is not None and len(time) > 1:
        step = np.diff(time, prepend=time[:1])
        usual = np.nanmedian(step[step > 0.0]) if np.any(step > 0.0) else np.inf
        stops |= (step > GAP * usual) | (step < 0.0)
    began = np.where(stops, deepest, -np.inf)
    return ~stopped & (depth < np.fmax.accumulate(began) + RUN_IN)


def ranges_of(samples: Samples) -> tuple[tuple[float, float], tuple[float, float]]:
    """Least and greatest pressure [Pa] and feed [N] of nearly all samples."""
    low, high = np.quantile(samples.settings[:, :2], [ENDS, 1.0 - ENDS], axis=0)
    return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))


def without_lags(log: Log, samples: Samples, table: Table, mean: np.ndarray) -> Log:
    """Return the log with each signal in the row of the settings that it belongs to.

    A lag is believed that explains the signal's steps much better than none.

    Parameters
    ----------
    samples : Samples
        Those of the log.
    mean : ndarray, shape (6,)
        Unknowns with which the table tells what a change of settings does.
    """
    expected = table.predict(np.tile(mean, (len(samples.depth), 1)), samples.settings)
    step = float(np.median(np.diff(samples.depth)))
    columns, notes = dict(log.columns), list(log.notes)
    for k, name in enumerate(SIGNALS):
        if name not in columns or np.std(expected[:, k]) < LEAST_SWING:
            continue
        lag = _lag(np.log(samples.signals[:, k]), expected[:, k])
        if lag:
            columns[name] = columns[name][_later(log, lag)]
            notes.append(
                f"{name}: {lag} rows ({100.0 * lag * step:.2g} cm) behind the settings; corrected"
            )
    return replace(log, columns=columns, notes=notes)


def _later(log: Log, lag: int) -> np.ndarray:
    """Rows that are so many usual rows later; the last one where there is none."""
    count = len(log.rows)
    time = log.columns.get("time")
    later = np.arange(count) + lag
    if time is not None and np.all(np.diff(time) >= 0.0):
        step = np.diff(time)
        usual = float(np.median(step[step > 0.0])) if np.any(step > 0.0) else 0.0
        later = np.searchsorted(time, time + (lag - 0.5) * usual)
    return np.minimum(later, count - 1)


def _lag(signal: np.ndarray, expected: np.ndarray) -> int:
    scores = []
    for lag in range(MOST_LAG + 1):
        off = signal[lag:] - expected[: len(expected) - lag]
        steps = off[DIFFERENCE:] - off[:-DIFFERENCE]
        steps = steps[MOST_LAG - lag :]
        # limited, so that outliers and layers count little
        scores.append(float(np.nanmean(np.minimum(np.abs(steps), 0.5))))
    best = int(np.argmin(scores))
    gain = len(signal) * np.log(scores[0] / scores[best])
    return best if gain > LIKELIER else 0
