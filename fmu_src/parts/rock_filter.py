"""The filter of `percussion identify` beside a controller: rock found as the bit goes on.

It takes the means of what a rig measures over each interval, and gives the crushing energy by the
efficiency of the bit with its interval. Set points may follow it,

    p = p_0 (q / q_0)^a,   F = F_0 (q / q_0)^b,

within bounds. Its table comes from `percussion identify --part`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fmu_src.parts.part import COUNT, Entries, PartTable
from fmu_src.parts.python_part import Model, slave_of
from percussion_model.analysis.identify.filter import RockFilter as Filter
from percussion_model.analysis.identify.observation import SETTINGS, SIGNALS, UNKNOWNS, Q
from percussion_model.analysis.identify.part import AXES, POWERS, ROWS, from_numbers

# What it measures, by the names of settings and signals.
MEASURED = ("supply_pressure", "feed_force", "rotation_speed", "rate_of_penetration",
            "blow_frequency", "rotation_torque")  # fmt: skip
# Standard deviations of an interval of 95 %.
SURE = 1.96
# Less of a signal or of a setting is no drilling.
LEAST = 1e-9


class RockFilter(Model):
    """The filter, and the means of the present interval."""

    sums: list[float]
    time: float
    place: float
    last: float
    filter: Filter
    STATE = ("sums", "time", "place", "last")

    def __init__(self, parameters: dict[str, Any]) -> None:
        super().__init__(parameters)
        self.filter = from_numbers(parameters)
        self.sums, self.time, self.place, self.last = [0.0] * len(MEASURED), 0.0, 0.0, 0.0

    def begin(self, inputs: dict[str, Any]) -> None:
        """Start where the bit is."""
        self.place = self.last = inputs["bit_position"]

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """Sum up, and take a sample where an interval ends."""
        self.time += step_size
        for k, name in enumerate(MEASURED):
            self.sums[k] += inputs[name] * step_size
        self.place = inputs["bit_position"]
        if self.time >= self.parameters["interval"] - 0.5 * step_size:
            self._take(np.array(self.sums) / self.time)
            self.sums, self.time = [0.0] * len(MEASURED), 0.0

    def _take(self, means: np.ndarray) -> None:
        settings, signals = means[: len(SETTINGS)], means[len(SETTINGS) :]
        drills = settings[2] > LEAST and signals[0] > LEAST and np.all(settings[:2] > LEAST)
        if drills and self.filter.table.contains(settings[np.newaxis])[0]:
            signals = np.where(signals > LEAST, signals, math.nan)
            self.filter.sample(self.place - self.last, settings, signals)
        self.last = self.place

    def signals(self) -> dict[str, Any]:
        """What a controller takes."""
        p, value = self.parameters, math.exp(float(self.filter.x[Q]))
        hard = value / p["follow.energy"] if p["follow.on"] else 1.0
        found = {"apparent_energy": value}
        for name in ("pressure", "feed"):
            wanted = p[f"follow.{name}"] * hard ** p[f"follow.{name}_power"]
            least, most = p[f"follow.lowest_{name}"], p[f"follow.highest_{name}"]
            found[f"{name}_setpoint"] = min(max(wanted, least), most)
        return found

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        x, sigma = float(self.filter.x[Q]), float(self.filter.sigma[Q])
        return self.signals() | {
            "apparent_energy_low": math.exp(x - SURE * sigma),
            "apparent_energy_high": math.exp(x + SURE * sigma),
            "layers": self.filter.layers,
        }

    def save(self) -> dict[str, Any]:
        """State as plain values, that of the filter with it."""
        return super().save() | {"filter": self.filter.save()}

    def restore(self, saved: dict[str, Any]) -> None:
        """Go back to a state, which is right."""
        super().restore(saved)
        self.filter.restore(saved["filter"])

    def state_fault(self, saved: Mapping[str, Any]) -> str:
        """As in `Model`: lengths of lists, and covariances."""
        if len(saved["sums"]) != len(MEASURED):
            return f"{len(saved['sums'])} numbers in sums, which must be {len(MEASURED)}"
        try:
            tried = from_numbers(self.parameters)
            tried.restore(saved["filter"])
            np.linalg.cholesky(tried.ps), np.linalg.cholesky(tried.p0)
            rows = (tried.x0[tried.cells], tried.xs, tried.weights, tried.ps)
            if len(set(map(len, rows))) > 1:
                raise ValueError
        except (ValueError, IndexError, np.linalg.LinAlgError):
            return "a filter whose numbers do not belong together"
        return ""


RockFilterPart = slave_of(RockFilter)

_LOG = (-200.0, 200.0)


def _numbers() -> Entries:
    """Parameters of table, prior and noise; starts are those of no hammer."""
    found: Entries = {
        "hole_area": ("m^2", 1e-6, 10.0, 0.0154, "area of the hole"),
        "mean_radius": ("m", 1e-4, 10.0, 0.048, "mean radius of the buttons"),
        "buttons": ("1", 1.0, 1e3, 17.0, "buttons of the bit"),
        "loading_exponent": ("1", 0.1, 10.0, 1.0, "exponent of the loading"),
    }
    for axis in AXES:
        found[f"middle.{axis}"] = ("1", *_LOG, 0.0, f"middle of ln {axis} in the table, SI")
        found[f"half.{axis}"] = ("1", 1e-6, 100.0, 1.0, f"half the range of ln {axis}")
    for row in ROWS:
        for j in range(len(POWERS)):
            text = f"term {j + 1} of ln {row}, SI"
            found[f"{row}[{j + 1}]"] = ("1", *_LOG, 0.0, text)
    for name, noise in zip(SIGNALS, (0.05, 0.005, 0.1), strict=True):
        found[f"error.{name}"] = ("1", 0.0, 10.0, 0.03, f"error of the table in ln {name}")
        found[f"noise.{name}"] = ("1", 1e-6, 10.0, noise, f"noise of a sample in ln {name}")
    varies = "rock from place to place in a layer, in ln rate"
    found["noise.varies"] = ("1", 0.0, 10.0, 0.01, varies)
    for name in UNKNOWNS:
        found[f"prior.{name}"] = ("1", *_LOG, 0.0, f"ln {name} before the first sample, SI")
        found[f"spread.{name}"] = ("1", 1e-6, 100.0, 0.5, f"its standard deviation, of {name}")
    return found


TABLE = PartTable(
    name="RockFilter",
    slave=RockFilterPart,
    description="Rock from rate, pressure, feed, rotation: crushing energy divided by efficiency",
    inputs={
        "bit_position": ("m", -1e6, 1e6, 0.0, "displacement of the bit"),
        "rate_of_penetration": ("m/s", -1e4, 1e4, 0.0, "measured rate of penetration"),
        "blow_frequency": ("Hz", 0.0, 1e6, 0.0, "measured frequency of the blows; 0: none"),
        "supply_pressure": ("Pa", 0.0, 1e9, 2e6, "measured supply pressure"),
        "feed_force": ("N", -1e9, 1e9, 2500.0, "measured feed force, as the table has it"),
        "rotation_speed": ("rad/s", -1e4, 1e4, 4.0, "measured speed of the rotation"),
        "rotation_torque": ("N m", -1e9, 1e9, 0.0, "measured torque of the rotation; 0: none"),
    },
    outputs={
        "apparent_energy": ("J/m^3", "crushing energy divided by the efficiency of the bit"),
        "apparent_energy_low": ("J/m^3", "low end of its interval of 95 %"),
        "apparent_energy_high": ("J/m^3", "high end of its interval of 95 %"),
        "layers": (COUNT, "changes of layer that were found"),
        "pressure_setpoint": ("Pa", "pressure that follows the rock"),
        "feed_setpoint": ("N", "feed that follows the rock"),
    },
    parameters={
        "interval": ("s", 1e-3, 1e3, 1.0, "time over which a sample is the mean"),
        "follow.on": ("", 0, 1, True, "set points follow the rock; off: they stay"),
        "follow.energy": ("J/m^3", 1.0, 1e12, 9e7, "crushing energy at which they are these"),
        "follow.pressure": ("Pa", 0.0, 1e9, 2e6, "pressure there"),
        "follow.pressure_power": ("1", -10.0, 10.0, 0.0, "how it grows with the crushing energy"),
        "follow.lowest_pressure": ("Pa", 0.0, 1e9, 1e6, "lowest pressure"),
        "follow.highest_pressure": ("Pa", 0.0, 1e9, 3e6, "highest pressure"),
        "follow.feed": ("N", 0.0, 1e9, 2500.0, "feed there"),
        "follow.feed_power": ("1", -10.0, 10.0, 0.0, "how it grows with the crushing energy"),
        "follow.lowest_feed": ("N", 0.0, 1e9, 500.0, "lowest feed"),
        "follow.highest_feed": ("N", 0.0, 1e9, 2e4, "highest feed"),
        **_numbers(),
    },
    at_start={
        "apparent_energy": (), "apparent_energy_low": (), "apparent_energy_high": (),
        "pressure_setpoint": (), "feed_setpoint": (),
    },
)  # fmt: skip
