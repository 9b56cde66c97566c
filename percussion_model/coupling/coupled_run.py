"""Result of a coupled run: signals over time, summary and energy balance of the string."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from percussion_model.coupling.verdict import LIMITS, STIFFNESS, Verdict, judge_run
from percussion_model.simulation.files import csv_text, staged_file
from percussion_model.simulation.rate import LEAST_BLOWS, has_stalled, ratio_of_sums
from percussion_model.simulation.uncertain import is_undecided

STRING_ENERGIES = ("head", "reaction", "weight", "bit", "shoulder", "wall", "stored")
# Signals that the verdict reads: each run keeps them.
JUDGED = (
    *(f"string.energy.{name}" for name in STRING_ENERGIES),
    "hammer.blow_energy", "hammer.blow_count", "hammer.energy_residual", STIFFNESS, *LIMITS,
)  # fmt: skip
# What the command keeps beside them.
SIGNALS = (
    *JUDGED,
    "string.head_impulse", "string.bit_impulse", "string.momentum", "string.wall_momentum",
    "string.weight", "string.casing_position", "string.lifted",
    "hammer.bit.impulse", "hammer.contact.impulse", "hammer.bit.velocity",
    "hammer.piston.velocity", "hammer.off_bottom", "hammer.hole_depth", "rock.layer",
    "controller.mode", "controller.feed_wanted", "rig.energy", "supply.energy",
)  # fmt: skip
# Numbers of a summary that have an error, which may be known and stands beside them then;
# residuals are measures of an error themselves.
ESTIMATES = ("depth", "rate_second_half", "shoulder_energy", "feed_work", "shoulder_by_blows")
# What the shoulder takes, by the energy of the blows, is off by up to so much: its damper brakes
# the bit within a blow. That goes with the step, up to one that sees nothing of a blow [1], [s]
# (docs/system.md, section 4).
MISSED_BY_SHOULDER, UNSEEING_STEP = 0.012, 1e-4
# What the error of the rate is of, and what is in none of the errors.
SCATTER, STEP, CELLS = "scatter", "communication step", "cells"


@dataclass
class CoupledRun:
    """Signals of a coupled run.

    Attributes
    ----------
    columns : dict of ndarray
        "time" [s] and the signals, each `component.variable`.
    step : float
        Communication step [s]; the longest one where steps are rejected.
    steps : int
        Steps that were done.
    error : str
        Why it ended before its time; empty if it did not.
    tried, rejected : int
        Steps that were computed beyond those, to know the error, and steps taken back.
    wall_time, processor_time : float
        Of the stepping [s].
    interrupted : bool
        Whether it was Ctrl-C that ended it.
    jumps : dict of float
        Root mean square of the change of what parts exchange in a step, by signal: forces by
        the greatest force [1].
    """

    columns: dict[str, np.ndarray] = field(repr=False)
    step: float
    steps: int
    error: str = ""
    tried: int = 0
    rejected: int = 0
    wall_time: float = field(default=0.0, compare=False)
    processor_time: float = field(default=0.0, compare=False)
    interrupted: bool = False
    jumps: dict[str, float] = field(default_factory=dict, compare=False)

    def __getitem__(self, signal: str) -> np.ndarray:
        return self.columns[signal]

    @property
    def verdict(self) -> Verdict:
        """Whether energies balance, or the step is too long and which one would do."""
        return judge_run(
            self.columns, _balances(self.columns), self.jumps, self.step, self.steps, self.error,
            controlled=self.tried > 0,
        )  # fmt: skip

    def write_csv(self, path: Path) -> Path:
        """Write time and signals as CSV, with all digits."""
        staged_file(path, csv_text(self.columns, quoted=True))
        return path


def known_signals(outputs: dict[str, list[str]], among: tuple[str, ...] = SIGNALS) -> list[str]:
    """Those of SIGNALS, or of others, that a system has.

    Parameters
    ----------
    outputs : dict
        Names of all outputs, by component.
    """
    return [
        signal
        for signal in among
        if signal.partition(".")[2] in outputs.get(signal.partition(".")[0], ())
    ]


def summary(run: CoupledRun) -> dict[str, Any]:
    """Numbers of a run, of what is in it.

    Returns
    -------
    dict
        depth [m], mean rate over the second half with its standard error by the scatter of the
        blows, and whether that hides it [m/s]; greatest residual of the energy
        balance of the string divided by the energy put in and stored at the start; energy that
        the shoulder took and work of the feed [J]; the former divided by the energy of the
        blows [1], and whether step or residual may make up either; names of those whose error
        is not known, `without_error`; what is in none of the errors, `not_in_errors`; the
        verdict.
    """
    columns = run.columns
    found: dict[str, Any] = {
        "time": float(columns["time"][-1] - columns["time"][0]), "step": run.step,
        "steps": run.steps, "error": run.error,
    }  # fmt: skip
    if "hammer.bit.position" in columns:
        found["depth"] = float(columns["hammer.bit.position"][-1])
        if len(columns["time"]) > 2:
            found |= _rate_second_half(columns)
    found |= _balances(columns)
    found |= _undecided_losses(found, columns, run.step)
    unknown = [key for key in ESTIMATES if key in found and found.get(f"{key}_error") is None]
    return found | {
        "without_error": unknown, "not_in_errors": [STEP, CELLS], "verdict": run.verdict.to_dict(),
    }  # fmt: skip


def _undecided_losses(
    found: dict[str, Any], columns: dict[str, np.ndarray], step: float
) -> dict[str, bool]:
    """Whether what the shoulder took is one that step or residual may make, of each number of it.

    A damper gives nothing: what is negative is not known, whatever its size.
    """
    if "shoulder_energy" not in found:
        return {}
    lost = found["shoulder_energy"]
    error = found["string_energy_residual"] * _scale(columns)
    if (share := found.get("shoulder_by_blows")) is not None:
        missed = MISSED_BY_SHOULDER * min(1.0, step / UNSEEING_STEP)
        error = max(error, missed * abs(lost / share) if share else math.inf)
    elif np.any(columns.get("hammer.contact.impulse", 0.0)):
        error = math.inf  # of a part of a blow
    hidden = lost < 0.0 or is_undecided(lost, error)
    names = ("shoulder_energy", "shoulder_by_blows")
    return {f"{name}_undecided": hidden for name in names if name in found}


def _rate_second_half(columns: dict[str, np.ndarray]) -> dict[str, Any]:
    """Mean rate over the second half [m/s], by the depth of the hole where that is kept.

    From the start of a blow to that of another, where there are enough blows to tell an error.
    None where the hammer has stalled.
    """
    time = columns["time"]
    place = columns.get("hammer.hole_depth", columns["hammer.bit.position"])
    rows = np.arange(len(time) // 2, len(time))
    blows = columns.get("hammer.blow_count")
    error = math.nan
    rate = float(place[-1] - place[rows[0]]) / float(time[-1] - time[rows[0]])
    if blows is not None:
        ever = 1 + np.flatnonzero(np.diff(blows) > 0.0)
        begun = ever[ever > rows[0]]
        if len(begun) < 2:  # no whole blow in it: the rate would be that of a part
            return {}
        if has_stalled(np.diff(time[ever]), float(time[ever[-1]]), float(time[-1])):
            return {}
        if len(begun) > LEAST_BLOWS:
            rate, error = ratio_of_sums(np.diff(place[begun]), np.diff(time[begun]))
    return {
        "rate_second_half": rate,
        "rate_second_half_error": None if math.isnan(error) else error,
        "rate_second_half_error_of": None if math.isnan(error) else SCATTER,
        "rate_second_half_undecided": is_undecided(rate, error),
    }


def _balances(columns: dict[str, np.ndarray]) -> dict[str, float]:
    """Residuals of hammer and string, as far as their signals are there."""
    found = {}
    if "hammer.energy_residual" in columns:
        found["hammer_energy_residual"] = float(np.max(np.abs(columns["hammer.energy_residual"])))
    if all(f"string.energy.{name}" in columns for name in STRING_ENERGIES):
        found |= _energies(columns)
    return found


def _energies(columns: dict[str, np.ndarray]) -> dict[str, float]:
    """Residual of the string's energies, and the part of the shoulder."""
    e = {name: columns[f"string.energy.{name}"] for name in STRING_ENERGIES}
    put_in = e["head"] + e["reaction"] + e["weight"]
    gone = e["bit"] + e["shoulder"] + e["wall"] + e["stored"] - e["stored"][0]
    # what is stored at the start was not put in
    residual = put_in - gone - (put_in - gone)[0]
    blows = columns.get("hammer.blow_energy")
    found = {
        "string_energy_residual": float(np.max(np.abs(residual))) / _scale(columns),
        "shoulder_energy": float(e["shoulder"][-1]),
        "feed_work": float(e["bit"][-1]),
    }
    if blows is not None and "hammer.blow_count" in columns:
        count, late = columns["hammer.blow_count"], slice(len(blows) // 2, None)
        known = blows[late][count[late] > 0.0]  # before the first blow it is 0
        if len(known) and (total := float(count[-1] * np.mean(known))) > 0.0:
            found["shoulder_by_blows"] = found["shoulder_energy"] / total
    return found


def _scale(columns: dict[str, np.ndarray]) -> float:
    """Energy that the residual of the string is divided by: put in, and stored at the start [J]."""
    put_in = [columns[f"string.energy.{name}"] for name in ("head", "reaction", "weight")]
    # what is there already has its error too: a short run puts hardly anything in
    stored = float(columns["string.energy.stored"][0])
    return sum(float(np.max(np.abs(one))) for one in put_in) + stored or 1.0
