"""Leap operators of a grid: powers of two of the step map (docs/numerics.md, section 5)."""

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

# Longest leap: 2^LEVELS - 1 steps, 0.1 s on the default grid of the reference.
LEVELS = 16
# Without their operators a scene is stepped through; beyond this size they
# would cost more memory and set-up time than they save [numbers].
MOST_NUMBERS = 40_000_000

# Contact modes in the order of their operators.
LOADING_MODES = (Mode.DFC, Mode.FC, Mode.BC)


@dataclass(frozen=True)
class LeapOperators:
    """Powers of the step map by configuration, and their quadratic forms.

    Maps are stored column by column and padded with zeros, forms as
    their upper triangles; `size` below is
    the padded 2 n or, on the rock, 2 n + 1.

    Attributes
    ----------
    piston, free : ndarray, shape (LEVELS, 1, size, size)
        Map of the free piston and of the free bit.
    rest : ndarray, shape (LEVELS, 3, size, size)
        Bit in standstill: map, forms of dashpot and averaging.
    loading : ndarray, shape (3, WATCH_LEVELS, 1, size, size)
        Map of the bit in DFC, FC and BC.
    watch : ndarray, shape (5, size, WATCHED)
        By mode: strain offset of the rock end at the end of the next steps in
        FF, its velocity at their start in DFC, FC, BC and SS.
    sums : ndarray, shape (4, LEVELS, size)
        Path of the bit's mean motion over a leap in SS, DFC, FC and BC.
    """

    piston: np.ndarray
    free: np.ndarray
    rest: np.ndarray
    loading: np.ndarray
    watch: np.ndarray
    sums: np.ndarray

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

    Parameters
    ----------
    par : WAVE_PAR array of length 1
        Its padded sizes are filled in.
    cp, cb : ndarray
        Coefficients of piston and bit.
    """
    n_p = piston.n if piston is not None else 0
    if LEVELS * (8 * n_p * n_p + 24 * bit.n * bit.n) > MOST_NUMBERS:
        return None
    par["size_p"], par["size_b"] = padded(2 * n_p), padded(2 * bit.n)
    par["size_r"] = padded(2 * bit.n + 1)
    alone = _alone(par)
    found = {"free": _powers(Configuration(alone, bit, cb), LEVELS, 1)[0]}
    if piston is not None:
        of_piston = alone.copy()
        of_piston["n_b"], of_piston["mass_b"] = piston.n, piston.mass.sum()
        of_piston["z_t"], of_piston["z_b"] = par["z_f"], par["z_p"]
        of_piston["kappa_t"], of_piston["kappa_b"] = par["kappa_f"], par["kappa_p"]
        found["piston"] = _powers(Configuration(of_piston, piston, cp), LEVELS, 1)[0]
    if par[0]["rock"] == RockKind.BILINEAR:
        found |= _on_rock(par, alone, bit, cb)
        flight = found["free"][0, 0, : 2 * bit.n, : 2 * bit.n]
        offset = np.concatenate([cb[Coef.BOTTOM, : bit.n], -cb[Coef.BOTTOM, : bit.n]])
        found["watch"][Mode.FF] = _watch(flight, flight @ offset, padded(2 * bit.n + 1))
    return LeapOperators(
        **{
            name: found.get(name, stand_in)
            for name, stand_in in zip(_NAMES, no_operators(), strict=True)
        }
    )


_NAMES = tuple(LeapOperators.__dataclass_fields__)


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


def _on_rock(
    par: np.ndarray, alone: np.ndarray, bit: Grid, cb: np.ndarray
) -> dict[str, np.ndarray]:
    """Operators of the contact modes."""
    rock = alone.copy()
    rock["rock"] = RockKind.BILINEAR
    p = par[0]
    loads = {
        Mode.DFC: (p["ss_loading"], p["ss_damping"]),
        Mode.FC: (p["ss_loading"], 0.0),
        Mode.BC: (p["ss_stiffness"], 0.0),
        Mode.SS: (p["ss_stiffness"], p["ss_damping"]),
    }
    size = padded(2 * bit.n + 1)
    loading = np.zeros((len(LOADING_MODES), WATCH_LEVELS, 1, size, size))
    watch = np.zeros((1 + len(loads), size, WATCHED))
    sums = np.zeros((len(loads), LEVELS, size))
    for mode, (stiffness, damping) in loads.items():
        configuration = Configuration(rock, bit, cb, float(stiffness), float(damping))
        levels, forms = (LEVELS, 3) if mode == Mode.SS else (WATCH_LEVELS, 1)
        powers, paths = _powers(configuration, levels, forms)
        by_column = powers[0, 0, : configuration.size, : configuration.size]
        watch[mode] = _watch(by_column, end_row(configuration, by_column), size)
        if mode == Mode.SS:
            rest, sums[0] = powers, paths
        else:
            loading[mode - 1], sums[mode, :levels] = powers, paths
    return {"rest": rest, "loading": loading, "watch": watch, "sums": sums}


def _watch(by_column: np.ndarray, row: np.ndarray, size: int) -> np.ndarray:
    """Rows, padded to `size`, that show at the start of each step what `row` shows now."""
    out = np.zeros((size, WATCHED))
    for k in range(WATCHED):
        out[: len(row), k] = row
        row = by_column @ row
    return out


def _powers(configuration: Configuration, levels: int, forms: int) -> tuple[np.ndarray, np.ndarray]:
    """Dyadic powers of one configuration's step map, padded.

    Returns
    -------
    powers : ndarray, shape (levels, forms, size, size)
    paths : ndarray, shape (levels, size)
    """
    size = configuration.size
    by_column = step_map(configuration)
    full = padded(size)
    powers, paths = np.zeros((levels, forms, full, full)), np.zeros((levels, full))
    powers[0, 0, :size, :size] = by_column
    for form, matrix in enumerate(step_forms(configuration, by_column)[1:forms], start=1):
        powers[0, form, :size, :size] = 0.5 * (matrix + matrix.T)
    mass = np.zeros(size)
    n = configuration.grid.n
    mass[:n] = mass[n : 2 * n] = configuration.grid.mass / configuration.grid.mass.sum()
    paths[0, :size] = 0.5 * (mass + by_column @ mass) * configuration.par[0]["dt"]
    _double(powers, paths)
    return powers, paths


def _double(powers: np.ndarray, paths: np.ndarray) -> None:
    """Square the map again and again, and sum its forms along, in place."""
    for level in range(1, len(powers)):
        last = powers[level - 1]
        by_column = last[0]  # the transpose of the map
        powers[level, 0] = by_column @ by_column
        for form in range(1, powers.shape[1]):
            carried = by_column @ last[form] @ by_column.T
            powers[level, form] = last[form] + 0.5 * (carried + carried.T)
        paths[level] = paths[level - 1] + by_column @ paths[level - 1]
    for power in powers:
        for form in range(1, powers.shape[1]):
            # symmetric: column by column, the upper triangle says it all
            power[form] = 2.0 * np.tril(power[form], -1) + np.diag(np.diag(power[form]))
