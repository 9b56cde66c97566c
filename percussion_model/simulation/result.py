"""Result of a run: blows, events, trace, energy ledger, warnings; saved and loaded."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from percussion_model.components import FORCES
from percussion_model.physics.records import BLOW, EVENT, EventKind, Mode
from percussion_model.scene.rows import shortened
from percussion_model.scene.scene import Scene
from percussion_model.scene.text import read_toml
from percussion_model.simulation.driller_numbers import driller_numbers, result_html
from percussion_model.simulation.files import (
    LARGEST_TABLE,
    LARGEST_TEXT,
    ResultError,
    csv_text,
    damaged,
    load_arrays,
    plain,
    read_csv,
    reason,
    refuse_large,
    rows_of,
    staged,
    to_json,
)
from percussion_model.simulation.means import (
    air_work,
    by_air,
    by_volume,
    numbers_over,
    scatter_over,
)
from percussion_model.simulation.origin import ORIGIN
from percussion_model.simulation.rate import has_stalled, rate_of_blows, ratio_of_sums
from percussion_model.simulation.uncertain import BY_CELLS, is_undecided, rate_field

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

__all__ = ["Result"]

# A longer trace goes into a compressed NumPy file.
LONGEST_CSV = 100_000

# What tells a result from any other folder.
_MARKS = ("summary.json", "scene.toml")
_TRACES = ("trace.csv", "trace.npz")
# What is made of a result beside it: the page, and figures as PNG and SVG.
REPORT = "report.html"
FIGURES = (
    "overview", "bit_motion", "activation", "stress_waves",
    "string_waves", "string_energy", "string_gauges",
)  # fmt: skip
_DERIVED = (REPORT, *(f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg")))


@dataclass(frozen=True)
class Result:
    """What a run found. SI units; undefined numbers are NaN, in `summary` None.

    Attributes
    ----------
    scene : Scene
    solver : str
        Name of the solver.
    cells : dict of int
        Modes, cells or elements of each elastic bar.
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
        Estimated error of the rate, relative to it; NaN where it was not estimated. The
        short runs that tell it are not in the times, those for `solver.accuracy` are.
    errors : dict of float
        Estimated errors of the other numbers over blows, of grid and scatter as that of the
        rate, by their names in `summary`, SI units; of what was not estimated there is none.
        Those of `fall` where there are no blows.
    rate_of_penetration_fixed_window : float
        Advance of the mean bit position from the settling time to the end of the
        run by that time, wherever in a blow they lie (eq. 58 of the paper) [m/s];
        NaN where the run was not read at its settling time.
    end : dict of float
        Sample at the end of the run, by SAMPLE_FIELDS, and `peak_bit_force` since the last
        blow began [N]; empty where that is not known.
    interrupted : bool
        Whether Ctrl-C ended this run, or another one that was to tell its error.
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
    errors: dict[str, float] = field(default_factory=dict)
    rate_of_penetration_fixed_window: float = math.nan
    end: dict[str, float] = field(default_factory=dict)
    interrupted: bool = False

    def __repr__(self) -> str:
        rate = rate_field(self.summary())
        return (
            f"Result({self.scene.title!r}, solver={self.solver!r}, duration={self.duration:g}, "
            f"{rate}blows={len(self.blows)}, events={len(self.events)}, "
            f"warnings={len(self.warnings)})"
        )

    def _repr_html_(self) -> str:
        return result_html(self.scene.title, self.summary())

    def plot(self, figure: str = "overview") -> Figure:
        """Draw a figure of the run, which a notebook shows and `savefig` writes.

        Parameters
        ----------
        figure : str
            A key of `percussion_model.interface.plotting.CAPTIONS`.

        Raises
        ------
        ResultError
            If there is no such figure, or none of this run.
        """
        # by its name, as pandas finds what draws: this layer knows nothing of figures
        drawing = import_module("percussion_model.interface.plotting")
        drawn: Figure = drawing.plot(self, figure)
        return drawn

    @property
    def counted(self) -> np.ndarray:
        """Whole blows that start after settling."""
        return self.blows[self.blows["time"] >= self.settle]

    @property
    def has_stalled(self) -> bool:
        """Whether blows ended long before the run did, so that there is no rate."""
        return has_stalled(self.blows["period"], end_of(self.blows), self.duration)

    @property
    def rate_of_penetration(self) -> float:
        """Advance of the hole by time between first and last blow start after settling [m/s].

        NaN where fewer than `LEAST_BLOWS` tell none, and where the hammer has stalled.
        """
        return math.nan if self.has_stalled else rate_of_blows(self.counted)[0]

    @property
    def rate_of_penetration_standard_error(self) -> float:
        """Standard error of the rate, from the scatter of the counted blows [m/s].

        See `ratio_of_sums`. Zero where the motion is periodic.
        """
        return math.nan if self.has_stalled else rate_of_blows(self.counted)[1]

    @property
    def rate_of_penetration_error(self) -> float:
        """How far the rate may be off, by grid and scatter [m/s]; NaN where not estimated."""
        return abs(self.rate_of_penetration) * self.rate_of_penetration_relative_error

    @property
    def rate_of_penetration_undecided(self) -> bool:
        """Whether what is known of its error is no smaller than the rate, or it is of the cells."""
        if self.scene.is_undamped and abs(self.rate_of_penetration) > 0.0:
            return True
        known = self.rate_of_penetration_error, self.rate_of_penetration_standard_error
        return any(is_undecided(self.rate_of_penetration, error) for error in known)

    @property
    def rate_of_penetration_fixed_window_error(self) -> float:
        """How far the rate over the fixed window may be off [m/s].

        By grid and scatter of the rate, and by the advance of one blow: the window ends
        wherever in a blow. NaN where the rate is not defined or its error not estimated.
        """
        rows, window = self.counted, self.duration - self.settle
        if len(rows) == 0 or not window > 0.0 or math.isnan(self.rate_of_penetration_fixed_window):
            return math.nan
        _, scatter = ratio_of_sums(rows["penetration"], rows["period"])
        by_window = scatter + float(np.max(np.abs(rows["penetration"]))) / window
        return by_window + self.rate_of_penetration_error

    @property
    def standard_errors(self) -> dict[str, float]:
        """Standard errors of the numbers over blows, by their names in `summary`, SI units.

        Of the scatter alone: see `scatter_over`.
        """
        return scatter_over(self.counted)

    @property
    def mean_bit_force(self) -> float:
        """Mean force on the rock over the counted blows [N]."""
        return numbers_over(self.counted)["mean_bit_force"]

    @property
    def mean_contact_force(self) -> float:
        """Mean force of the piston on the bit over the counted blows [N]."""
        return numbers_over(self.counted)["mean_contact_force"]

    @property
    def hammer_pressure(self) -> float:
        """Pressure of the supply of chambers at the end, above the surroundings [Pa]; else NaN."""
        if self.scene.effects.drive != "pneumatic":
            return math.nan
        ambient = self.scene["pneumatic.ambient_pressure"]
        return float(self.end.get("pneumatic_supply", math.nan) - ambient)

    @property
    def fall(self) -> dict[str, float]:
        """How a bit fell that nothing has struck: a drop test. Empty where there are blows.

        Returns
        -------
        dict of float
            `depth` of the bit's end below the rock as it was, unless the bit is in the air at
            the end of the run [m]; `first_contact` with the
            rock [s]; `rebound_velocity` with which the mean bit leaves it for the first
            time, upwards, where no piston can strike it [m/s]; `rest_time`, from which it
            stands still [s]; `peak_bit_force` [N]; `crushed` energy [J];
            `transfer_efficiency`, what the rock keeps by the energy of the wave that came
            from outside. Only what is known.
        """
        return {} if len(self.blows) else _fall(self)

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
        forces the greatest of them; None is what is not defined. `driller_numbers` has some
        of them once more, each with its unit, its error and its definition.
        """
        over_blows, hole, air = numbers_over(self.counted), self.scene.hole_diameter, math.nan
        if self.hammer_pressure > 0.0:
            names = (f"pneumatic.ambient_{name}" for name in ("pressure", "temperature"))
            air = air_work(self.hammer_pressure, *(self.scene[name] for name in names))

        def with_more(of_blows: dict[str, float]) -> dict[str, float]:
            return of_blows | by_volume(of_blows, hole) | by_air(of_blows, air)

        more = {"specific_energy": None, "air_efficiency": None} | with_more(over_blows)
        numbers = {
            "rate_of_penetration": self.rate_of_penetration,
            "rate_of_penetration_standard_error": self.rate_of_penetration_standard_error,
            "rate_of_penetration_relative_error": self.rate_of_penetration_relative_error,
            "rate_of_penetration_error": self.rate_of_penetration_error,
            "rate_of_penetration_undecided": self.rate_of_penetration_undecided,
            BY_CELLS: self.scene.is_undamped,
            "rate_of_penetration_fixed_window": self.rate_of_penetration_fixed_window,
            "rate_of_penetration_fixed_window_error": self.rate_of_penetration_fixed_window_error,
            **over_blows,
            "specific_energy": more["specific_energy"],
            "hammer_pressure": self.hammer_pressure,
            "air_efficiency": more["air_efficiency"],
            "standard_errors": with_more(self.standard_errors),
            "errors": with_more(self.errors),
            "energy": self.energy,
            "blows": len(self.blows),
            "blows_after_settling": len(self.counted),
            "events": self.statistics.get("events", len(self.events)),
            "cells": self.cells or None,
            "time_step": self.time_step,
            "wave_speed_error": self.wave_speed_error,
            "wall_time": self.wall_time,
            "setup_time": self.setup_time,
            "real_time_factor": self.real_time_factor,
            "end": self.end,
            "fall": self.fall,
            "interrupted": self.interrupted,
            "solver": self.solver,
            "title": self.scene.title,
            "duration": self.duration,
            "settle": self.settle,
            "statistics": self.statistics,
            "warnings": self.warnings,
        }
        values: dict[str, Any] = plain(numbers)
        return values | {"driller_numbers": driller_numbers(values)}

    def to_pandas(self) -> pandas.DataFrame:
        """Blow table as a data frame."""
        from pandas import DataFrame

        return DataFrame({name: self.blows[name] for name in BLOW.names or ()})

    def events_to_pandas(self) -> pandas.DataFrame:
        """Event list as a data frame; kinds as words."""
        from pandas import DataFrame

        columns = _event_columns(self.events)
        return DataFrame(columns | {"kind": np.array(columns["kind"], object)})

    def save(self, folder: str | Path) -> list[Path]:
        """Write summary, blows, events, trace and scene to a folder, in one go.

        Trace, figures and report of a result that was there are removed.

        Returns
        -------
        list of Path
            The files.
        """
        return _write_result(self, Path(folder))

    @classmethod
    def load(cls, folder: str | Path) -> Self:
        """Read what `save` has written."""
        return cls(**_read_result(Path(folder)))


def end_of(blows: np.ndarray) -> float:
    """When the last whole blow ended [s]; 0 where there is none."""
    return float(blows["time"][-1] + blows["period"][-1]) if len(blows) else 0.0


def _fall(result: Result) -> dict[str, float]:
    """Numbers of a run without blows; see `Result.fall`."""
    scene, found = result.scene, {}
    if result.end and scene.effects.rock != "none" and result.end["drilling_mode"] != Mode.FF:
        found["depth"] = result.end["bit_end_position"] - scene.start.rock_gap
    modes = result.events[result.events["kind"] <= EventKind.MODE_SS]
    touching = np.flatnonzero(modes["kind"] != Mode.FF)
    if len(touching):
        found["first_contact"] = float(modes["time"][touching[0]])
        left = np.flatnonzero(modes["kind"][touching[0] :] == Mode.FF) + touching[0]
        pushed = any(scene[one.switch[0]] == one.switch[1] for one in FORCES)
        if len(left) and not pushed and scene.piston.model == "absent":  # a flight undisturbed
            found["rebound_velocity"] = _leaving_velocity(result, modes, int(left[0]))
        if modes["kind"][-1] == Mode.SS:
            found["rest_time"] = float(modes["time"][-1])
        found["peak_bit_force"] = result.end.get("peak_bit_force", math.nan)
    if "crushing" in result.energy:
        found["crushed"] = result.energy["crushing"]
        if len(touching) and (given := _energy_of_pulse(scene)):
            kept = sum(result.energy[name] for name in _KEPT_BY_ROCK)
            found["transfer_efficiency"] = kept / given
    return {name: value for name, value in found.items() if math.isfinite(value)}


# Entries of the ledger that are in the rock.
_KEPT_BY_ROCK = ("crushing", "barrier", "standstill", "recoverable")


def _energy_of_pulse(scene: Scene) -> float:
    """Energy of the wave that comes down the topmost bar from outside [J]; 0 without one."""
    if scene.piston.model != "absent" or not scene.effects.string:
        return 0.0
    top = next(iter(scene.bars.values())).sections[0]
    return scene.string.pulse_force**2 * scene.string.pulse_duration / top.impedance


def _leaving_velocity(result: Result, modes: np.ndarray, k: int) -> float:
    """Upward mean velocity of the bit at the start of a flight: its mean motion is a parabola."""
    scene, begin = result.scene, modes[k]
    if k + 1 < len(modes):
        time, place = float(modes[k + 1]["time"]), float(modes[k + 1]["bit_position"])
    else:
        time, place = result.duration, result.end.get("bit_position", math.nan)
    taken = time - float(begin["time"])
    if not taken > 0.0:
        return math.nan
    return 0.5 * flight_acceleration(scene) * taken - (place - float(begin["bit_position"])) / taken


def flight_acceleration(scene: Scene) -> float:
    """Downward acceleration of a bit in flight, by weight and feed [m/s^2]."""
    feed = scene.feed.force / scene.bit.mass if scene.effects.feed else 0.0
    return feed + (scene.gravity.acceleration if scene.effects.gravity else 0.0)


def _write_result(result: Result, folder: Path) -> list[Path]:
    """Write a result to a folder; see `Result.save`.

    What an earlier result left there goes: its trace, its figures and its report would
    stand beside numbers that they do not belong to.
    """
    was_result = all((folder / name).is_file() for name in _MARKS)
    left = (*_TRACES, ORIGIN, *_DERIVED) if was_result else (*_TRACES, ORIGIN)
    with staged(folder, outdated=left) as draft:
        (draft / "summary.json").write_text(to_json(result.summary()) + "\n", encoding="utf-8")
        (draft / "scene.toml").write_text(result.scene.to_toml(), encoding="utf-8")
        blows = result.blows
        tables = {"blows": {name: blows[name] for name in BLOW.names or ()}}
        tables["events"] = _event_columns(result.events)
        for name, columns in tables.items():
            (draft / f"{name}.csv").write_bytes(csv_text(columns).encode())
        if result.trace is not None:
            _write_trace(draft, result.trace)
        names = sorted(path.name for path in draft.iterdir())
    return [folder / name for name in names]


def _event_columns(events: np.ndarray) -> dict[str, Any]:
    """Columns of the event list; kinds as words."""
    columns = {name: events[name] for name in EVENT.names or ()}
    return columns | {"kind": [EventKind(k).name.lower() for k in columns["kind"]]}


def _write_trace(draft: Path, trace: dict[str, np.ndarray]) -> None:
    if len(trace["time"]) <= LONGEST_CSV:
        (draft / "trace.csv").write_bytes(csv_text(trace).encode())
    else:
        arrays: dict[str, Any] = dict(trace)
        np.savez_compressed(draft / "trace.npz", **arrays)


def _read_result(folder: Path) -> dict[str, Any]:
    """Read the fields of a `Result` that was saved in a folder."""
    if not folder.is_dir():
        raise ResultError(f"{folder}: there is no such result folder")
    missing = [name for name in _MARKS if not (folder / name).is_file()]
    if missing:
        raise ResultError(
            f"{folder}: no result folder, it has no {' and no '.join(missing)}; "
            "percussion run SCENE --out DIR writes one"
        )
    for name in ("summary.json", "blows.csv", "events.csv", "trace.csv"):
        refuse_large(folder / name, LARGEST_TEXT if name == "summary.json" else LARGEST_TABLE)
    scene = _read_scene(folder / "scene.toml")
    summary, fields = _read_summary(folder / "summary.json")
    blows = read_csv(folder / "blows.csv", float)
    tables = {"blows": rows_of(folder / "blows.csv", blows, BLOW)}
    count = summary.get("blows")
    if count is not None and count != len(tables["blows"]):
        raise damaged(folder / "blows.csv", f"has {len(tables['blows'])} of {count} blows")
    events = read_csv(folder / "events.csv", _number_or_kind)
    tables["events"] = rows_of(folder / "events.csv", events, EVENT)
    return {"scene": scene, **fields, **tables, "trace": _read_trace(folder)}


def _read_scene(path: Path) -> Scene:
    """Scene of a result: its last table, which it always has, tells that it is whole."""
    run = read_toml(path).get("run")
    missing = [key for key in _LAST if not isinstance(run, dict) or key not in run]
    if missing:
        raise damaged(path, f"has no run.{missing[0]}")
    return Scene.from_toml(path)


def _read_summary(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Summary, and the fields of a `Result` that are in it."""
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ResultError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise damaged(path, f"no JSON: {reason(error)}") from None
    if not isinstance(summary, dict):
        raise damaged(path, "no table of names and values")
    fields = {}
    for name, (kind, allowed) in _FROM_SUMMARY.items():
        if name not in summary:
            raise damaged(path, f"has no {name}")
        fields[name] = value = summary[name]
        if not kind(value):
            raise damaged(path, f"{name} = {shortened(repr(value))}: must be {allowed}")
    for name in ("energy", "end", "errors", "cells"):
        given = fields[name] or {}
        fields[name] = {key: math.nan if one is None else one for key, one in given.items()}
    for name in _RATES:
        value = summary.get(name)
        fields[name] = math.nan if value is None else value
    return summary, fields


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))


def _are_numbers(value: Any) -> bool:
    return isinstance(value, dict) and all(map(_is_number, value.values()))


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(one, str) for one in value)


_NUMBER = _is_number, "a number"
_TIME = (lambda value: value is not None and _is_number(value)), "a number"
_NUMBERS = _are_numbers, "numbers by their names"
_OR_NONE = (lambda value: value is None or _are_numbers(value)), "numbers by their names, or null"
_FROM_SUMMARY: dict[str, tuple[Callable[[Any], bool], str]] = {
    "solver": (lambda value: isinstance(value, str), "a word"),
    "cells": _OR_NONE,
    "time_step": _NUMBER,
    "wave_speed_error": _NUMBER,
    "duration": _TIME,
    "settle": _TIME,
    "energy": _NUMBERS,
    "statistics": _NUMBERS,
    "wall_time": _NUMBER,
    "setup_time": _NUMBER,
    "warnings": (_are_texts, "a list of texts"),
    "end": _NUMBERS,
    "errors": _NUMBERS,
    "interrupted": (lambda value: isinstance(value, bool), "true or false"),
}
# Parameters that stand last in a scene which is written, and always.
_LAST = ("duration", "settle")
_RATES = ("rate_of_penetration_relative_error", "rate_of_penetration_fixed_window")


def _number_or_kind(text: str) -> float:
    kind = EventKind.__members__.get(text.upper())
    return float(text) if kind is None else float(kind)


def _read_trace(folder: Path) -> dict[str, np.ndarray] | None:
    path = folder / "trace.npz"
    if path.exists():
        trace = load_arrays(path)
    elif (path := folder / "trace.csv").exists():
        columns = read_csv(path, float)
        trace = {name: np.array(column) for name, column in columns.items()}
    else:
        return None
    if "time" not in trace:
        raise damaged(path, "has no column time")
    for name, values in trace.items():
        if values.shape != trace["time"].shape or values.ndim != 1 or values.dtype.kind != "f":
            raise damaged(path, f"column {name} is not one of numbers, as many as times")
    return trace
