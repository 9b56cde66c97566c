"""Measurements of the rock: a slow curve, drops of the bit, single numbers; and their checks."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

LEAST_DATA = 10
# No noise is taken to be smaller than this share of the data's spread: data of a model
# without noise would have an infinite likelihood.
LEAST_NOISE = 1e-8
# Residuals below this share of how far the data vary are of data without noise.
ROUNDING = 1e-5
# Signals that can be measured on a bit that falls: unit, and how large they are at most.
SIGNALS = {
    "bit_position": ("m", 1.0),
    "bit_velocity": ("m/s", 200.0),
    "bit_end_position": ("m", 1.0),
    "bit_end_velocity": ("m/s", 200.0),
    "bit_force": ("N", 1e8),
    "gauge_force": ("N", 1e8),
    "gauge_stress": ("Pa", 3e9),
}
# Single numbers that can be measured: unit, and the least and greatest that can be.
QUANTITIES = {
    "rebound_velocity": ("m/s", 1e-3, 100.0),
    "penetration": ("m", 1e-6, 0.5),
    "penetration_per_blow": ("m", 1e-6, 0.5),
    "rate_of_penetration": ("m/s", 1e-7, 1.0),
}
# Widths of priors where nothing else is given: of the zero of a sensor by the unit of its signal,
# of a force or a stress by the share of the greatest; a drift adds as much over the whole record.
# Of the delay of a trigger [s], and at most as a share of the record.
OFFSETS, OFFSET_SHARE = {"m": 1e-4, "m/s": 0.05}, 0.02
DELAY, DELAY_SHARE = 1e-3, 0.1
OF_A_DROP = ("rebound_velocity", "penetration")
# What is possible in a slow test [m], in a drop [s], [m/s].
PENETRATIONS = (5e-6, 0.05)
DURATIONS = (1e-5, 5.0)
SPEEDS = (0.01, 100.0)
# Loading stiffness of rocks under a bit, from the softest to far above the hardest [N/m].
STIFFNESSES = (1e6, 1e11)


class FitError(ValueError):
    """Data that nothing can be fitted to, or a fit that went wrong; the message says why."""


@dataclass(frozen=True)
class Curve:
    """One slow loading and unloading of the rock, SI units.

    Attributes
    ----------
    penetration : array_like
        In the order of time: rising, then falling; any zero [m].
    force : array_like
        On the rock, compression positive [N].
    offset : float, optional
        Standard deviation of the zero of the force, 0: known [N]; default 2 % of the greatest.
    """

    penetration: Any
    force: Any
    name: str = "curve"
    offset: float | None = None


@dataclass(frozen=True)
class DropTest:
    """One measured fall of the bit, SI units.

    Attributes
    ----------
    time : array_like
        Since the bit was `start.rock_gap` above the rock; rising [s].
    values : array_like
        What was measured.
    speed : float
        At time zero, downward [m/s].
    signal : str
        What it is, one of `SIGNALS`.
    gauge : float, optional
        Distance of the gauge from the top of the bit [m]; default its middle.
    offset, drift, delay : float, optional
        Standard deviations of the zero of the sensor, of its drift [1/s] and of how late the
        record begins [s]; 0: known. Default: `OFFSETS` or 2 % of the greatest, as much over the
        record, and 1 ms or a tenth of the record.
    """

    time: Any
    values: Any
    speed: float
    signal: str = "bit_position"
    gauge: float | None = None
    name: str = "drop"
    offset: float | None = None
    drift: float | None = None
    delay: float | None = None


@dataclass(frozen=True)
class Reading:
    """One measured number with its standard error, SI units.

    Attributes
    ----------
    quantity : str
        Greatest upward mean velocity of the bit after a drop [m/s]; what a drop leaves of
        penetration at the end of the scene's duration [m]; mean penetration per blow of the
        scene's hammer after settling [m], and its rate [m/s].
    value, error : float
        Error: its standard deviation.
    speed : float, optional
        Of the drop [m/s]; None for the hammer.
    """

    quantity: Literal[
        "rebound_velocity", "penetration", "penetration_per_blow", "rate_of_penetration"
    ]
    value: float
    error: float
    speed: float | None = None

    @property
    def name(self) -> str:
        """How messages and tables call it."""
        return self.quantity + ("" if self.speed is None else f" at {self.speed:g} m/s")


@contextmanager
def named(name: str) -> Iterator[None]:
    """Say of whose data an error tells."""
    try:
        yield
    except FitError as error:
        if name in str(error):
            raise
        raise FitError(f"{name}: {error}") from None


def checked_curve(curve: Curve) -> Curve:
    """Return a curve as arrays of numbers that can be.

    Raises
    ------
    FitError
    """
    with named(curve.name):
        p, force = checked_columns({"penetration": curve.penetration, "force": curve.force})
        span = float(np.ptp(p))
        if not span > 0:
            raise FitError("penetration: does not change")
        if not force.max() > 0:
            raise FitError("force: never positive; compression counts positive")
        pressed = int(np.argmax(np.abs(force)))
        reversed_ = {"force": force[pressed] < 0.0, "penetration": p[pressed] < p[0] - 0.5 * span}
        for column in (name for name, is_so in reversed_.items() if is_so):
            raise FitError(f"{column}: the sign is reversed: multiply the column by -1")
    slope = float(force.max()) / span
    scales = []
    if not PENETRATIONS[0] <= span <= PENETRATIONS[1]:
        scales.append(("penetration", f"{span:.3g} m", PENETRATIONS, "m"))
    if not STIFFNESSES[0] <= slope <= STIFFNESSES[1]:
        scales.append(("force over penetration", f"{slope:.3g} N/m", STIFFNESSES, "N/m"))
    if scales:
        words = "; ".join(
            f"{name} spans {seen}, possible is {low:g} to {high:g} {unit}"
            for name, seen, (low, high), unit in scales
        )
        raise FitError(
            f"{curve.name}: {words}. A heading without a unit is in SI: is it perhaps "
            f"{_likely_units(span, float(force.max()))}?"
        )
    width = OFFSET_SHARE * float(force.max()) if curve.offset is None else curve.offset
    return Curve(p, force, curve.name, _checked_width(f"offset of {curve.name}", width))


def _checked_width(name: str, width: float) -> float:
    if not (np.isfinite(width) and width >= 0.0):
        raise FitError(f"{name} = {width!r}: must be a number, 0 or above")
    return float(width)


def _likely_units(span: float, force: float) -> str:
    """Headings under which a curve would be possible."""
    middle = np.log(np.sqrt(STIFFNESSES[0] * STIFFNESSES[1]))
    best = []
    for length, metres in (("m", 1.0), ("mm", 1e-3), ("um", 1e-6)):
        for load, newtons in (("N", 1.0), ("kN", 1e3), ("MN", 1e6)):
            if PENETRATIONS[0] <= span * metres <= PENETRATIONS[1]:
                off = abs(np.log(force * newtons / (span * metres)) - middle)
                best.append((float(off), f'"penetration [{length}]", "force [{load}]"'))
    return min(best)[1] if best else "in another unit"


def checked_drop(drop: DropTest) -> DropTest:
    """Return a drop as arrays of numbers that can be.

    Raises
    ------
    FitError
    """
    name = drop.name
    time, values = checked_columns({f"time of {name}": drop.time, f"values of {name}": drop.values})
    if time[0] < 0 or np.any(np.diff(time) <= 0):
        raise FitError(f"time of {name}: must rise, and start at 0 s or later")
    if drop.signal not in SIGNALS:
        raise FitError(f"signal = {drop.signal!r}: must be one of {', '.join(SIGNALS)}")
    if not DURATIONS[0] <= time[-1] <= DURATIONS[1]:
        raise FitError(
            f"{name}: time runs to {time[-1]:g} s, possible is {DURATIONS[0]:g} to "
            f"{DURATIONS[1]:g} s. A heading without a unit is in SI: is it perhaps "
            f'"time [{"ms" if time[-1] < 1e3 * DURATIONS[1] else "us"}]"?'
        )
    unit, most = SIGNALS[drop.signal]
    if not np.ptp(values) <= most:
        raise FitError(
            f"{name}: {drop.signal} spans {np.ptp(values):.3g} {unit}, more than {most:g} {unit} "
            f'cannot be: write its unit into the heading, as in "{drop.signal} [m{unit}]"'
        )
    if not np.ptp(values) > 0.0:
        raise FitError(f"{name}: {drop.signal} does not change")
    check_speed(f"speed of {name}", drop.speed)
    offset = OFFSETS.get(unit, OFFSET_SHARE * float(np.abs(values).max()))
    offset = offset if drop.offset is None else drop.offset
    drift = offset / float(time[-1]) if drop.drift is None else drop.drift
    delay = min(DELAY, DELAY_SHARE * float(time[-1])) if drop.delay is None else drop.delay
    return replace(
        drop, time=time, values=values, speed=float(drop.speed),
        offset=_checked_width(f"offset of {name}", offset),
        drift=_checked_width(f"drift of {name}", drift),
        delay=_checked_width(f"delay of {name}", delay),
    )  # fmt: skip


def check_reading(reading: Reading) -> None:
    """Raise `FitError` unless a single number can be."""
    if reading.quantity not in QUANTITIES:
        raise FitError(f"{reading.quantity!r}: must be one of {', '.join(QUANTITIES)}")
    unit, low, high = QUANTITIES[reading.quantity]
    if not low <= reading.value <= high:
        raise FitError(
            f"{reading.quantity} = {reading.value!r} {unit}: possible is {low:g} to {high:g} {unit}"
        )
    if not 0 < reading.error < reading.value:
        raise FitError(
            f"error of {reading.quantity} = {reading.error!r} {unit}: must be above 0 and below "
            f"the value of {reading.value!r} {unit}"
        )
    of_a_drop = reading.quantity in OF_A_DROP
    if of_a_drop and reading.speed is None:
        raise FitError(f"{reading.quantity}: the speed of the drop is needed")
    if not of_a_drop and reading.speed is not None:
        raise FitError(f"{reading.quantity}: is of the hammer, without the speed of a drop")
    if reading.speed is not None:
        check_speed(f"speed of {reading.quantity}", reading.speed)


def check_speed(name: str, speed: float) -> None:
    """Raise `FitError` unless a bit may fall so fast."""
    if not (np.isfinite(speed) and SPEEDS[0] <= speed <= SPEEDS[1]):
        raise FitError(
            f"{name} = {speed!r} m/s: must be a number from {SPEEDS[0]:g} to {SPEEDS[1]:g} m/s"
        )


def checked_columns(columns: dict[str, Any]) -> list[np.ndarray]:
    """Return columns of data as arrays.

    Raises
    ------
    FitError
        If one is no row of finite numbers, or they differ in length, or are short.
    """
    found = []
    for name, values in columns.items():
        try:
            column = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            raise FitError(f"{name}: must be numbers") from None
        if column.ndim != 1:
            raise FitError(f"{name}: must be one row of numbers, not of shape {column.shape}")
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            raise FitError(f"{name}: number {bad[0]} of the row (from 0) is {column[bad[0]]}")
        found.append(column)
    lengths = [len(column) for column in found]
    if len(set(lengths)) > 1:
        words = ", ".join(f"{name} {n}" for name, n in zip(columns, lengths, strict=True))
        raise FitError(f"columns must be of one length: {words}")
    if lengths[0] < LEAST_DATA:
        raise FitError(
            f"{' and '.join(columns)}: {lengths[0]} data, at least {LEAST_DATA} are needed"
        )
    return found


def is_rounding(noise: float, data: np.ndarray) -> bool:
    """Whether what is left of data is so small that they have no noise."""
    return noise <= ROUNDING * (float(np.std(data)) or 1.0)


def least_noise(data: np.ndarray) -> float:
    """What the estimated noise of data is at least."""
    return LEAST_NOISE * (float(np.ptp(data)) or float(np.abs(data).max()))
