"""What a run found: blows, events, trace, energy ledger, warnings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from percussion_model.physics.records import BLOW, EVENT, EventKind
from percussion_model.scene.scene import Scene
from percussion_model.simulation.files import check_writable, read_result, write_result
from percussion_model.simulation.warnings import find_warnings

if TYPE_CHECKING:
    import pandas

    from percussion_model.solvers.base import Solver

__all__ = ["Result", "check_writable", "make_result"]

# Fewer whole blows than this tell no rate.
LEAST_BLOWS = 3


@dataclass(frozen=True)
class Result:
    """What a run found. SI units; undefined numbers are NaN, in `summary` None.

    Attributes
    ----------
    scene : Scene
    solver : str
        Name of the solver.
    cells : dict of int
        Cells in each elastic bar.
    time_step : float or None
        Of the solver [s].
    wave_speed_error : float
        Largest relative error of a section's wave speed.
    duration, settle : float
        Simulated time, and the time from which blows count [s].
    blows : ndarray of BLOW
        All whole blows.
    events : ndarray of EVENT
        In the order of time.
    trace : dict of ndarray or None
        An array for each of SAMPLE_FIELDS.
    energy : dict of float
        Ledger [J] since the start: `initial` energy; `drive`, `feed` and
        `gravity` work and their sum `input`; `crushing`, `barrier`,
        `standstill`, `loss` and `contact` and their sum `dissipated`;
        `kinetic`, `elastic` and `recoverable` and their sum `stored`;
        `numerical`: what the discretisation dissipates; `overshoot`: what
        springs lose where an event is found just past it; `residual`: what no
        entry explains. Relative figures divide by `initial` and the absolute
        works of drive, feed and gravity.
    statistics : dict of int
        Counts of what the solver did.
    wall_time : float
        Time to compute, without set-up and compilation [s].
    setup_time : float
        Time to make the solver, compilation included [s].
    warnings : list of str
    rate_of_penetration_relative_error : float
        Estimated error of the rate, relative to it, where `solver.accuracy` is
        asked for; NaN where it is not.
    """

    scene: Scene
    solver: str
    cells: dict[str, int]
    time_step: float | None
    wave_speed_error: float
    duration: float
    settle: float
    blows: np.ndarray
    events: np.ndarray
    trace: dict[str, np.ndarray] | None
    energy: dict[str, float]
    statistics: dict[str, int]
    wall_time: float
    setup_time: float
    warnings: list[str]
    rate_of_penetration_relative_error: float = math.nan

    @property
    def counted(self) -> np.ndarray:
        """Whole blows that start after settling."""
        return self.blows[self.blows["time"] >= self.settle]

    @property
    def rate_of_penetration(self) -> float:
        """Bit advance by time between the first and the last blow start after settling [m/s]."""
        blows = self.counted
        if len(blows) < LEAST_BLOWS:
            return math.nan
        first, last = blows[0], blows[-1]
        advance = last["bit_position"] + last["penetration"] - first["bit_position"]
        return float(advance / (last["time"] + last["period"] - first["time"]))

    @property
    def rate_of_penetration_standard_error(self) -> float:
        """Standard error of the rate, from the scatter from blow to blow [m/s].

        That of a ratio of means, s / (sqrt(n) T): s is the standard deviation
        of (penetration - rate * period) and T the mean period of the n counted
        blows, which are taken as independent. Zero where the motion is
        periodic.
        """
        blows = self.counted
        if len(blows) < LEAST_BLOWS:
            return math.nan
        off = blows["penetration"] - self.rate_of_penetration * blows["period"]
        scatter = math.sqrt(float(np.sum(off * off)) / (len(blows) - 1))
        return scatter / (math.sqrt(len(blows)) * float(np.mean(blows["period"])))

    @property
    def mean_bit_force(self) -> float:
        """Mean force on the rock over the counted blows [N]."""
        return _ratio(self.counted, "bit_impulse", "period")

    @property
    def mean_contact_force(self) -> float:
        """Mean force of the piston on the bit over the counted blows [N]."""
        return _ratio(self.counted, "contact_impulse", "period")

    @property
    def cut_short(self) -> bool:
        """Whether the run ended before its duration."""
        return self.duration < self.scene.run.duration

    @property
    def real_time_factor(self) -> float:
        """Simulated time by time to compute."""
        return self.duration / self.wall_time if self.wall_time > 0 else math.nan

    def summary(self) -> dict[str, Any]:
        """Return the numbers of the run as plain values for JSON, SI units.

        Numbers of blows are means over the whole blows after settling, peak
        forces the greatest of them; None is what is not defined.
        """
        rows = self.counted
        period = _mean(rows["period"])
        numbers = {
            "rate_of_penetration": self.rate_of_penetration,
            "rate_of_penetration_standard_error": self.rate_of_penetration_standard_error,
            "rate_of_penetration_relative_error": self.rate_of_penetration_relative_error,
            "blow_period": period,
            "blow_frequency": 1.0 / period,
            **{name: _mean(rows[name]) for name in _MEANS},
            "transfer_efficiency": _ratio(rows, "rock_energy", "blow_energy"),
            "penetration_per_blow": _mean(rows["penetration"]),
            "contacts_per_blow": _mean(rows["contacts"]),
            "drilling_cycles_per_blow": _mean(rows["drilling_cycles"]),
            "peak_bit_force": _greatest(rows["peak_bit_force"]),
            "peak_contact_force": _greatest(rows["peak_contact_force"]),
            "standstill_bit_force": _mean(rows["standstill_force"]),
            "mean_bit_force": self.mean_bit_force,
            "mean_contact_force": self.mean_contact_force,
            "energy": self.energy,
            "blows": len(self.blows),
            "blows_after_settling": len(rows),
            "events": self.statistics.get("events", len(self.events)),
            "cells": self.cells or None,
            "time_step": self.time_step,
            "wave_speed_error": self.wave_speed_error,
            "wall_time": self.wall_time,
            "setup_time": self.setup_time,
            "real_time_factor": self.real_time_factor,
            "solver": self.solver,
            "title": self.scene.title,
            "duration": self.duration,
            "settle": self.settle,
            "statistics": self.statistics,
            "warnings": self.warnings,
        }
        return {name: _plain(value) for name, value in numbers.items()}

    def to_pandas(self) -> pandas.DataFrame:
        """Blow table as a data frame."""
        from pandas import DataFrame

        return DataFrame({name: self.blows[name] for name in BLOW.names or ()})

    def events_to_pandas(self) -> pandas.DataFrame:
        """Event list as a data frame; kinds as words."""
        from pandas import DataFrame

        columns = {name: self.events[name] for name in EVENT.names or ()}
        columns["kind"] = np.array([EventKind(k).name.lower() for k in self.events["kind"]], object)
        return DataFrame(columns)

    def save(self, folder: str | Path) -> list[Path]:
        """Write summary, blows, events, trace and scene to a folder, in one go.

        Returns
        -------
        list of Path
            The files.
        """
        return write_result(self, Path(folder))

    @classmethod
    def load(cls, folder: str | Path) -> Self:
        """Read what `save` has written."""
        return cls(**read_result(Path(folder)))


_MEANS = (
    "impact_velocity",
    "rebound_velocity",
    "stroke",
    "blow_energy",
    "rock_energy",
)


def make_result(
    scene: Scene,
    solver: Solver,
    blows: np.ndarray,
    events: np.ndarray,
    trace: dict[str, np.ndarray] | None,
    energy: dict[str, float],
    statistics: dict[str, int],
    times: tuple[float, float],
    wall_time: float,
    setup_time: float,
) -> Result:
    """Put a result together; `times` are its duration and settling time [s]."""
    result = Result(
        scene=scene,
        solver=solver.name,
        cells=dict(solver.cells),
        time_step=solver.time_step,
        wave_speed_error=solver.wave_speed_error,
        duration=times[0],
        settle=times[1],
        blows=blows,
        events=events,
        trace=trace,
        energy=energy,
        statistics=statistics,
        wall_time=wall_time,
        setup_time=setup_time,
        warnings=[],
    )
    result.warnings.extend(find_warnings(result))
    return result


def _mean(values: np.ndarray) -> float:
    """Mean of what is defined."""
    known = values[np.isfinite(values)]
    return float(np.mean(known)) if len(known) else math.nan


def _greatest(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.max(known)) if len(known) else math.nan


def _ratio(rows: np.ndarray, name: str, by: str) -> float:
    below = float(np.sum(rows[by]))
    return float(np.sum(rows[name])) / below if below > 0 else math.nan


def _plain(value: Any) -> Any:
    """Turn numbers that are not finite into None, in tables too."""
    if isinstance(value, dict):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_plain(entry) for entry in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value
