"""Grids and leap operators that scenes have in common, kept for the next one."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from percussion_model.physics.records import Mode
from percussion_model.scene.numbers import Numbers
from percussion_model.solvers.setup import elastic_piston, kelvin_voigt_time
from percussion_model.solvers.wave.cutting import CutBars, cut_both
from percussion_model.solvers.wave.leaps.operators import (
    LOADED,
    alone,
    bit_in,
    fill_mode,
    fill_piston,
    free_piston,
    operator_shapes,
)
from percussion_model.solvers.wave.leaps.step_map import step_map
from percussion_model.solvers.wave.records import LeapOperators

# Bars of so many scenes are kept [some ten kB each on the default grid].
MOST_BARS = 16
# Operators of so many scenes are kept [a few MB each on the default grid], as long as they
# take no more than so many bytes: those of 250 cells have 0.8 gigabytes.
MOST_KEPT, MOST_BYTES = 4, 400_000_000
_kept: dict[bytes, LeapOperators | None] = {}
# Those of free bars, which scenes on other rock share, are kept apart.
_kept_free: dict[bytes, LeapOperators] = {}


def cut_bars(numbers: Numbers, time_step: float) -> CutBars:
    """Cut the elastic bars of a scene, or find them cut.

    Parameters
    ----------
    numbers : Numbers
    time_step : float
        Transit time of a cell [s].
    """
    piston, bit = elastic_piston(numbers), numbers.bit
    return _cut_bars(piston.tobytes(), bit.tobytes(), time_step, kelvin_voigt_time(numbers))


@lru_cache(MOST_BARS)
def _cut_bars(piston: bytes, bit: bytes, time_step: float, loss_time: float) -> CutBars:
    bars = [np.frombuffer(one).reshape(-1, 4).copy() for one in (piston, bit)]
    return cut_both(*bars, time_step, loss_time)


def leap_operators(par: np.ndarray, bars: CutBars) -> LeapOperators | None:
    """Make the leap operators of a scene, or find them; None where there are none.

    They do not depend on feed, drive, barrier energy or start, so that scenes which differ
    in those alone share them: making them costs as much as tens of blows.

    Parameters
    ----------
    par : WAVE_PAR array of length 1
        With the padded sizes, `can_leap`.
    bars : CutBars
    """
    key = _key(par, bars)
    if key not in _kept:
        _make_room(_kept)
        _kept[key] = _made(par, bars)
    return _kept[key]


def _key(par: np.ndarray, bars: CutBars) -> bytes:
    """Return all that operators depend on."""
    parts = [par, *[part for bar in bars.both for part in (bar.coefficients, bar.grid.mass)]]
    return b"|".join(part.tobytes() for part in parts)


def _make_room(kept: dict[bytes, Any]) -> None:
    while len(kept) >= MOST_KEPT or sum(map(_size_of, kept.values())) > MOST_BYTES:
        del kept[next(iter(kept))]


def _size_of(operators: LeapOperators | None) -> int:
    """Bytes of a set of operators."""
    return 0 if operators is None else sum(part.nbytes for part in operators)


def _room(par: np.ndarray) -> LeapOperators:
    """Zeros; what nobody writes to, as nine tenths of a bit alone, takes no memory."""
    return LeapOperators(*(np.zeros(shape) for shape in operator_shapes(par[0])))


def _made(par: np.ndarray, bars: CutBars) -> LeapOperators | None:
    """Operators of piston and bit, those of free bars perhaps from an earlier scene."""
    key = _key(alone(par), bars)
    if key not in _kept_free:
        _make_room(_kept_free)
        _kept_free[key] = _free(par, bars)
    free, room = _kept_free[key], _room(par)
    room = room._replace(piston=free.piston, piston_loss=free.piston_loss, bottom=free.bottom)
    for name in ("bit", "lookahead", "top", "loss"):
        getattr(room, name)[Mode.FF] = getattr(free, name)[Mode.FF]
    for mode in LOADED:
        if not _fill_mode(room, par, bars, mode):
            return None
    return room


def _free(par: np.ndarray, bars: CutBars) -> LeapOperators:
    """Operators of the free piston and of the bit in free flight."""
    free = _room(par)._replace(squares=np.zeros((1, 1, 1)))
    if bars.piston.grid.n:
        bar = free_piston(par, bars)
        fill_piston(free, bar, *step_map(bar))
    _fill_mode(free, par, bars, Mode.FF)
    return free


def _fill_mode(room: LeapOperators, par: np.ndarray, bars: CutBars, mode: int) -> bool:
    """Fill the operators of a mode, as far as leaps can cross it; whether there are such."""
    bar, leaps = bit_in(par, bars, int(mode))
    return not leaps or fill_mode(room, int(mode), bar, *step_map(bar))
