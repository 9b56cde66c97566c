"""Leap operators of a grid: powers of the step map, by mode (docs/numerics.md, section 5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from percussion_model.core.contact_leap import WATCH_LEVELS, WATCHED
from percussion_model.core.linear import PADDING
from percussion_model.core.records import DriveKind, Mode, Piston, RockKind
from percussion_model.core.wave_records import Coef
from percussion_model.solvers.grid import Grid
from percussion_model.solvers.step_map import (
    Configuration,
    end_row,
    no_operators,
    step_forms,
    step_map,
)

# Longest leap: 4^LEVELS - 1 steps, 0.1 s on the default grid of the reference.
LEVELS = 8
# Without their operators a scene is stepped through; beyond this size they
# would cost more memory and set-up time than they save [numbers].
MOST_NUMBERS = 40_000_000

# What a standstill will ever lose is summed over at most 2^40 steps; what is
# left then is lost too slowly to tell.
MOST_DOUBLINGS = 40


@dataclass(frozen=True)
class LeapOperators:
    """Powers of the step map, and what can be seen of the next steps.

    Maps are stored column by column and padded with zeros, forms as
    their upper triangles; `size` is the padded number of waves, with the
    penetration for the bit.

    Attributes
    ----------
    piston : ndarray, shape (LEVELS, size, size)
        Powers 1, 4, 16, ... of the free piston's step map.
    bit : ndarray, shape (5, LEVELS, size, size)
        The same for the bit by `Mode`.
    watch : ndarray, shape (5, size, WATCHED)
        By mode: strain offset of the rock end at the end of the next steps in
        FF, its velocity at their start in DFC, FC, BC and SS.
    sums : ndarray, shape (5, size)
        By contact mode: path of the bit's mean motion until it rests.
    top : ndarray, shape (5, size, WATCHED)
        By mode: motion of the bit's top end by the end of the next steps, in
        FF its strain offset.
    bottom : ndarray, shape (size, WATCHED)
        Strain offset of the piston's bottom end.
    forms : ndarray, shape (2, size, size)
        What a standstill will ever lose in the dashpot and by averaging [J].
    """

    piston: np.ndarray
    bit: np.ndarray
    watch: np.ndarray
    sums: np.ndarray
    top: np.ndarray
    bottom: np.ndarray
    forms: np.ndarray

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """The arrays in the order in which the kernels take them."""
        return tuple(getattr(self, name) for name in self.__dataclass_fields__)


def padded(size: int) -> int:
    """Size of an operator with its padding."""
    return -(-size // PADDING) * PADDING


def build_operators(
    par: np.ndarray, piston: Grid | None, cp: np.ndarray, bit: Grid, cb: np.ndarray
) -> LeapOperators | None:
    """Leap operators of a scene, or None where they would be too large.

    None as well where a loaded bit does not come to rest within the digits of a
    number, as with a loss that freezes its stress: then there is no path to rest.

    Parameters
    ----------
    par : WAVE_PAR array of length 1
        Its padded sizes are filled in.
    cp, cb : ndarray
        Coefficients of piston and bit.
    """
    n_p = piston.n if piston is not None else 0
    size_p, size = padded(2 * n_p), padded(2 * bit.n + 1)
    if LEVELS * (size_p * size_p + len(Mode) * size * size) > MOST_NUMBERS:
        return None
    par["size_p"], par["size_r"] = size_p, size
    alone = _alone(par)
    found = dict(zip(_NAMES, no_operators(), strict=True))
    if piston is not None:
        of_piston = alone.copy()
        of_piston["n_b"], of_piston["mass_b"] = piston.n, piston.mass.sum()
        of_piston["z_t"], of_piston["z_b"] = par["z_f"], par["z_p"]
        of_piston["kappa_t"], of_piston["kappa_b"] = par["kappa_f"], par["kappa_p"]
        by_column = step_map(Configuration(of_piston, piston, cp))
        found["piston"] = _powers(by_column, LEVELS, LEVELS, size_p)
        found["bottom"] = _watch(by_column, by_column @ _offset(cp, n_p, Coef.BOTTOM), size_p)
    try:
        found |= _of_bit(alone, bit, cb, size, loads=_loads(par))
    except np.linalg.LinAlgError:
        return None
    return LeapOperators(**found)


_NAMES = tuple(LeapOperators.__dataclass_fields__)


def _loads(par: np.ndarray) -> dict[Mode, tuple[float, float]]:
    """Stiffness and damping of the contact modes that leaps can cross."""
    p = par[0]
    if p["rock"] != RockKind.BILINEAR:
        return {}
    return {
        Mode.DFC: (p["ss_loading"], p["ss_damping"]),
        Mode.FC: (p["ss_loading"], 0.0),
        Mode.BC: (p["ss_stiffness"], 0.0),
        Mode.SS: (p["ss_stiffness"], p["ss_damping"]),
    }


def _offset(c: np.ndarray, n: int, row: Coef) -> np.ndarray:
    """Strain offset of an end as a row over the waves, see `core.bar.strain_offset`."""
    return np.concatenate([c[row, :n], -c[row, :n]])


def _alone(par: np.ndarray) -> np.ndarray:
    """Parameters of the bit by itself, without forces."""
    alone = par.copy()
    alone["gravity"] = 0.0
    alone["piston"] = Piston.ABSENT
    alone["n_p"] = 0
    alone["drive"] = DriveKind.NONE
    alone["rock"] = RockKind.NONE
    alone["barrier"] = 1
    alone["release"] = 0
    return alone


def _of_bit(
    alone: np.ndarray,
    bit: Grid,
    cb: np.ndarray,
    size: int,
    loads: dict[Mode, tuple[float, float]],
) -> dict[str, np.ndarray]:
    """Operators of the bit in free flight and in the contact modes."""
    powers = np.zeros((len(Mode), LEVELS, size, size))
    watch, top = np.zeros((2, len(Mode), size, WATCHED))
    sums, forms = np.zeros((len(Mode), size)), np.zeros((2, size, size))
    to_top, to_bottom = (_offset(cb, bit.n, row) for row in (Coef.TOP, Coef.BOTTOM))
    by_column = step_map(Configuration(alone, bit, cb))
    powers[Mode.FF] = _powers(by_column, LEVELS, LEVELS, size)
    watch[Mode.FF] = _watch(by_column, by_column @ to_bottom, size)
    top[Mode.FF] = _watch(by_column, by_column @ to_top, size)
    rock = alone.copy()
    rock["rock"] = RockKind.BILINEAR
    way = np.append(to_top + to_bottom, 1.0)
    for mode, (stiffness, damping) in loads.items():
        configuration = Configuration(rock, bit, cb, float(stiffness), float(damping))
        by_column = step_map(configuration)
        levels = LEVELS if mode == Mode.SS else WATCH_LEVELS
        powers[mode] = _powers(by_column, levels, LEVELS, size)
        watch[mode] = _watch(by_column, end_row(configuration, by_column), size)
        top[mode] = _watch(by_column, by_column @ way, size)
        sums[mode, : len(by_column)] = _path_to_rest(configuration, by_column)
        if mode == Mode.SS:
            for k, form in enumerate(step_forms(configuration, by_column)[1:]):
                forms[k] = _ever_lost(by_column, form, size)
    return {"bit": powers, "watch": watch, "sums": sums, "top": top, "forms": forms}


def _watch(by_column: np.ndarray, row: np.ndarray, size: int) -> np.ndarray:
    """Rows, padded to `size`, that show at the start of each step what `row` shows now."""
    out = np.zeros((size, WATCHED))
    for k in range(WATCHED):
        out[: len(row), k] = row
        row = by_column @ row
    return out


def _powers(by_column: np.ndarray, levels: int, room: int, size: int) -> np.ndarray:
    """Powers 1, 4, 16, ... of a step map, padded; `levels` of them in `room` places."""
    out = np.zeros((room, size, size))
    for level in range(levels):
        out[level, : len(by_column), : len(by_column)] = by_column
        by_column = by_column @ by_column
        by_column = by_column @ by_column
    return out


def _path_to_rest(configuration: Configuration, by_column: np.ndarray) -> np.ndarray:
    """Row that shows the path of the bit's mean motion until it rests [m]."""
    n = configuration.grid.n
    share = configuration.grid.mass / configuration.grid.mass.sum()
    mean = np.zeros(len(by_column))
    mean[:n] = mean[n : 2 * n] = share
    a_step = 0.5 * (mean + by_column @ mean) * configuration.par[0]["dt"]
    path: np.ndarray = np.linalg.solve(np.eye(len(by_column)) - by_column, a_step)
    return path


def _ever_lost(by_column: np.ndarray, form: np.ndarray, size: int) -> np.ndarray:
    """Sum of a quadratic form over all steps to come, as a padded upper triangle."""
    total = 0.5 * (form + form.T)
    for _ in range(MOST_DOUBLINGS):
        more = by_column @ total @ by_column.T
        total += 0.5 * (more + more.T)
        by_column = by_column @ by_column
    out = np.zeros((size, size))
    # symmetric: column by column, the upper triangle says it all
    out[: len(total), : len(total)] = 2.0 * np.tril(total, -1) + np.diag(np.diag(total))
    return out
