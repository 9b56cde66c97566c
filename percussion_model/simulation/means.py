"""Numbers of a run over its blows, and how far they scatter."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from percussion_model.physics.gas import AIR
from percussion_model.physics.records import BLOW_COLUMNS
from percussion_model.simulation.rate import LEAST_BLOWS, advances, ratio_of_sums

# Means over blows, and the columns of the blow table behind them.
_MEANS = {
    "blow_period": "period",
    "impact_velocity": "impact_velocity",
    "rebound_velocity": "rebound_velocity",
    "stroke": "stroke",
    "blow_energy": "blow_energy",
    "rock_energy": "rock_energy",
    "penetration_per_blow": "hole_advance",
    "contacts_per_blow": "contacts",
    "drilling_cycles_per_blow": "drilling_cycles",
    "standstill_bit_force": "standstill_force",
    **{column.name: column.name for column in BLOW_COLUMNS if column.of},
}
_OF_COMPONENTS = tuple(column.name for column in BLOW_COLUMNS if column.of)
# Means of whole numbers.
COUNTS = ("contacts_per_blow", "drilling_cycles_per_blow")
# Ratios of sums over blows: numerator and denominator.
RATIOS = {
    "transfer_efficiency": ("rock_energy", "blow_energy"),
    "mean_bit_force": ("bit_impulse", "period"),
    "mean_contact_force": ("contact_impulse", "period"),
    "percussive_power": ("blow_energy", "period"),
    "energy_per_advance": ("blow_energy", "hole_advance"),
    "net_percussive_power": ("net_energy", "time_on_air"),
    "energy_per_air": ("blow_energy", "air_used"),
}
# Columns that are summed up; those that the blow table has as they are, by their word there.
_SUMMED = tuple(dict.fromkeys((*_MEANS.values(), *(one for two in RATIOS.values() for one in two))))
_WORD = {column.name: k for k, column in enumerate(BLOW_COLUMNS) if column.kind == "f8"}
del _WORD["hole_advance"]  # less rounding
_AS_THEY_ARE = [_WORD.get(name, 0) for name in _SUMMED]
_MADE = [(k, name) for k, name in enumerate(_SUMMED) if name not in _WORD]
# The greatest of all blows.
_GREATEST = ("peak_bit_force", "peak_contact_force")
# Blows take back less of these than of the advance of the hole, and stretches of a quarter of
# all blows are few: by chance they hide what lasts.
STRETCHES = 1 / 16, 1 / 8, 1 / 4
# A greatest value is one that so many blows come near to: those of a cycle do, those of
# aperiodic motion do not.
_NEAR_GREATEST = 0.1


def _column(blows: np.ndarray, name: str) -> np.ndarray:
    """A column of the blow table, or what is made of some of it."""
    if name == "net_energy":  # less what the piston has after the blow
        before, after = blows["impact_velocity"], blows["rebound_velocity"]
        share = np.divide(after, before, out=np.zeros(len(blows)), where=before != 0.0)
        return np.asarray(blows["blow_energy"] * (1.0 - share * share))
    if name == "time_on_air":  # without chambers there is none, and nothing is told
        return np.where(blows["pneumatic_air"] > 0.0, blows["period"], 0.0)
    if name == "air_used":
        return np.asarray(blows["pneumatic_air"] * blows["period"])
    if name == "hole_advance":
        return advances(blows)
    return np.asarray(blows[name])


def _columns(blows: np.ndarray) -> np.ndarray:
    """`_SUMMED`, a row for each."""
    words = np.ascontiguousarray(blows).view(np.float64).reshape(len(blows), len(BLOW_COLUMNS))
    found = words.T[_AS_THEY_ARE]
    for k, name in _MADE:
        found[k] = _column(blows, name)
    return found


def numbers_over(blows: np.ndarray) -> dict[str, float]:
    """Return the numbers over some blows, SI units; NaN is what is not defined.

    Parameters
    ----------
    blows : ndarray of BLOW

    Returns
    -------
    dict of float
        Means, ratios of sums and greatest values, by their names in a summary.
    """
    count = len(blows) or math.nan
    sums = dict(zip(_SUMMED, np.sum(_columns(blows), axis=1).tolist(), strict=True))
    found = {name: sums[column] / count for name, column in _MEANS.items()}
    for name, column in _MEANS.items():
        if math.isnan(found[name]):
            found[name] = _mean_of_known(blows[column])
    # of a component that is off, all are zero
    found |= {name: math.nan for name in _OF_COMPONENTS if not found[name]}
    found["blow_frequency"] = 1.0 / found["blow_period"]
    for name, (column, by) in RATIOS.items():
        found[name] = sums[column] / sums[by] if sums[by] > 0.0 else math.nan
    return found | {name: _greatest(blows[name]) for name in _GREATEST}


def numbers_of_each(blows: np.ndarray) -> dict[str, np.ndarray]:
    """`numbers_over` of each blow alone.

    Parameters
    ----------
    blows : ndarray of BLOW, shape (n,)

    Returns
    -------
    dict of ndarray, shape (n,)
    """
    columns = dict(zip(_SUMMED, _columns(blows), strict=True))
    found = {name: columns[column] for name, column in _MEANS.items()}
    for name in _OF_COMPONENTS:
        found[name] = np.where(found[name] == 0.0, math.nan, found[name])
    found["blow_frequency"] = 1.0 / found["blow_period"]
    for name, (column, by) in RATIOS.items():
        nothing, known = np.full(len(blows), math.nan), columns[by] > 0.0
        found[name] = np.divide(columns[column], columns[by], out=nothing, where=known)
    greatest = {name: blows[name] for name in _GREATEST}
    return found | {
        name: np.where(np.isfinite(values), values, math.nan) for name, values in greatest.items()
    }


def by_volume(numbers: Mapping[str, float], diameter: float | None) -> dict[str, float]:
    """Specific energy of a hole: `energy_per_advance` by its area, or the error of both.

    Parameters
    ----------
    numbers : mapping
        Numbers over blows, or their errors, by name.
    diameter : float or None
        Of the hole [m]; None where it is not known.

    Returns
    -------
    dict of float
        `specific_energy` [J/m^3]; empty where it is not known.
    """
    if diameter is None or "energy_per_advance" not in numbers:
        return {}
    return {"specific_energy": numbers["energy_per_advance"] / (0.25 * math.pi * diameter**2)}


def air_work(pressure: float, ambient: float, temperature: float) -> float:
    """Most work that compressed air can do in the surroundings, R T ln(p/p_a) [J/kg].

    By expansion at their temperature: the pneumatic power of Y. Shi, M. Cai, W. Xu, Y. Wang,
    Chin. J. Mech. Eng. 32 (2019) 42, by mass.

    Parameters
    ----------
    pressure : float
        Above that of the surroundings [Pa].
    ambient, temperature : float
        Of the surroundings [Pa], [K].
    """
    return AIR * temperature * math.log1p(pressure / ambient) if ambient > 0.0 else math.inf


def by_air(numbers: Mapping[str, float], work: float) -> dict[str, float]:
    """Efficiency of air: `energy_per_air` by the work that air can do [J/kg], or the error of both.

    Empty where it is not known.
    """
    if not (0.0 < work < math.inf and "energy_per_air" in numbers):
        return {}
    return {"air_efficiency": numbers["energy_per_air"] / work}


def scatter_over(blows: np.ndarray) -> dict[str, float]:
    """Return the standard errors of the numbers over some blows, SI units.

    Of the scatter alone: zero where the motion is periodic, NaN for fewer blows than tell
    one. That of a greatest value is its distance to what a tenth of the blows reach.

    Parameters
    ----------
    blows : ndarray of BLOW

    Returns
    -------
    dict of float
        By their names in a summary; empty without blows.
    """
    if len(blows) == 0:
        return {}
    ones = np.ones(len(blows))
    means = {
        name: column
        for name, column in _MEANS.items()
        if name not in _OF_COMPONENTS or blows[column].any()
    }
    pairs = {name: (_column(blows, column), ones) for name, column in means.items()}
    for name, (column, by) in RATIOS.items():
        if float(np.sum(_column(blows, by))) > 0.0:
            pairs[name] = _column(blows, column), _column(blows, by)
    found = {name: ratio_of_sums(*series, STRETCHES)[1] for name, series in pairs.items()}
    for name, column in means.items():
        if math.isnan(found[name]):
            found[name] = _scatter_of_known(blows[column])
    found["blow_frequency"] = found["blow_period"] / float(np.mean(blows["period"])) ** 2
    return found | {name: _scatter_of_greatest(blows[name]) for name in _GREATEST}


def _mean_of_known(values: np.ndarray) -> float:
    """Mean of what is defined, where not all is."""
    known = values[np.isfinite(values)]
    return float(np.mean(known)) if len(known) else math.nan


def _scatter_of_known(values: np.ndarray) -> float:
    """Standard error of the mean of what is defined, where not all is."""
    known = values[np.isfinite(values)]
    return ratio_of_sums(known, np.ones(len(known)), STRETCHES)[1] if len(known) else math.nan


def _greatest(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.max(known)) if len(known) else math.nan


def _scatter_of_greatest(values: np.ndarray) -> float:
    """How far the greatest value stands out from those of a tenth of the blows."""
    known = np.sort(values[np.isfinite(values)])
    if len(known) < LEAST_BLOWS:
        return math.nan
    near = max(LEAST_BLOWS, math.ceil(_NEAR_GREATEST * len(known)))
    return float(known[-1] - known[-near])
