"""Leap operators of a grid: powers of the step map, by mode (docs/numerics.md, section 5)."""

from __future__ import annotations

from typing import Any

import numpy as np

from percussion_model.physics.records import DriveKind, Mode, Piston, RockKind
from percussion_model.solvers.wave.grid import Grid
from percussion_model.solvers.wave.leaps.linear import DIGITS, PADDING
from percussion_model.solvers.wave.leaps.lookahead import LOOKAHEAD, LOOKAHEAD_LEVELS
from percussion_model.solvers.wave.leaps.step_map import (
    Configuration,
    end_row,
    step_forms,
    step_map,
)
from percussion_model.solvers.wave.records import Coef, LeapOperators, no_operators

# Longest leap: 4^LEVELS - 1 steps, 0.1 s on the default grid of the reference.
LEVELS = 8
# Without their operators a scene is stepped through; beyond this size they
# would cost more memory and set-up time than they save [numbers].
MOST_NUMBERS = 60_000_000

# Operators of so many scenes are kept [a few MB each on the default grid], as long as they
# take no more than so many bytes: those of 250 cells have 0.8 gigabytes.
MOST_KEPT, MOST_BYTES = 4, 400_000_000
_kept: dict[bytes, LeapOperators | None] = {}
# Those of free bars, which scenes on other rock share, are kept apart.
_kept_free: dict[bytes, dict[str, np.ndarray]] = {}


def padded(size: int) -> int:
    """Size of an operator with its padding."""
    return -(-size // PADDING) * PADDING


def leap_operators(
    par: np.ndarray, piston: Grid | None, cp: np.ndarray, bit: Grid, cb: np.ndarray
) -> LeapOperators | None:
    """Leap operators of a scene, or None where they would be too large.

    They do not depend on feed, drive, barrier energy or start, so that scenes which differ
    in those alone share them: making them costs as much as tens of blows.
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
    if LEVELS * DIGITS * (size_p * size_p + len(Mode) * size * size) > MOST_NUMBERS:
        return None
    par["size_p"], par["size_r"] = size_p, size
    key = _key(par, cp, cb, piston, bit)
    if key not in _kept:
        _make_room(_kept)
        _kept[key] = _build(par, piston, cp, bit, cb)
    return _kept[key]


def _key(par: np.ndarray, cp: np.ndarray, cb: np.ndarray, piston: Grid | None, bit: Grid) -> bytes:
    """Return all that operators depend on."""
    masses = [grid.mass for grid in (piston, bit) if grid is not None]
    return b"|".join(part.tobytes() for part in (par, cp, cb, *masses))


def _make_room(kept: dict[bytes, Any]) -> None:
    while len(kept) >= MOST_KEPT or sum(map(_size_of, kept.values())) > MOST_BYTES:
        del kept[next(iter(kept))]


def _size_of(arrays: Any) -> int:
    """Bytes of a set of operators."""
    if arrays is None:
        return 0
    return sum(a.nbytes for a in (arrays.values() if isinstance(arrays, dict) else arrays))


def _build(
    par: np.ndarray, piston: Grid | None, cp: np.ndarray, bit: Grid, cb: np.ndarray
) -> LeapOperators | None:
    """Operators of piston and bit; arguments as in `leap_operators`."""
    alone = _alone(par)
    key = _key(alone, cp, cb, piston, bit)
    if key not in _kept_free:
        _make_room(_kept_free)
        _kept_free[key] = _free(alone, piston, cp, bit, cb)
    free = _kept_free[key]
    try:
        loaded = _of_loaded_bit(alone, bit, cb, free, _loads(par))
    except np.linalg.LinAlgError:
        return None
    return LeapOperators(**(free | loaded))


def _free(
    alone: np.ndarray, piston: Grid | None, cp: np.ndarray, bit: Grid, cb: np.ndarray
) -> dict[str, np.ndarray]:
    """Operators of the free piston and of the bit in free flight.

    The contact modes have room in them.
    """
    found = no_operators()._asdict()
    if piston is not None:
        of_piston = alone.copy()
        of_piston["n_b"], of_piston["mass_b"] = piston.n, piston.mass.sum()
        for end in ("z", "kappa"):
            of_piston[f"{end}_t"], of_piston[f"{end}_b"] = alone[f"{end}_f"], alone[f"{end}_p"]
        free_piston = Configuration(of_piston, piston, cp)
        by_column, faces = step_map(free_piston)
        found["piston"] = _powers(by_column, LEVELS, int(alone["size_p"][0]))
        if alone["loss"][0]:
            form = step_forms(free_piston, by_column, faces)[0]
            found["piston_loss"] = _sums(form, found["piston"])
        found["bottom"] = _lookahead(
            found["piston"], by_column @ _offset(cp, piston.n, Coef.BOTTOM)
        )
    size = int(alone["size_r"][0])
    powers = np.zeros((len(Mode), LEVELS * DIGITS, size, size))
    lookahead, top = np.zeros((2, len(Mode), size, LOOKAHEAD))
    free_bit = Configuration(alone, bit, cb)
    by_column, faces = step_map(free_bit)
    powers[Mode.FF] = _powers(by_column, LEVELS, size)
    loss = np.zeros(powers.shape if alone["loss"][0] else (len(Mode), 1, 1, 1))
    if alone["loss"][0]:
        loss[Mode.FF] = _sums(step_forms(free_bit, by_column, faces)[0], powers[Mode.FF])
    for rows, row in ((lookahead, Coef.BOTTOM), (top, Coef.TOP)):
        rows[Mode.FF] = _lookahead(powers[Mode.FF], by_column @ _offset(cb, bit.n, row))
    return found | {"bit": powers, "lookahead": lookahead, "top": top, "loss": loss}


def _loads(par: np.ndarray) -> dict[Mode, tuple[float, float]]:
    """Stiffness and damping of the contact modes that leaps can cross."""
    p = par[0]
    if p["rock"] != RockKind.BILINEAR:
        return {}
    standstill = {Mode.SS: (p["ss_stiffness"], p["ss_damping"])}
    if not p["ss_loading"]:
        return standstill
    return standstill | {
        Mode.DFC: (p["ss_loading"], p["ss_damping"]),
        Mode.FC: (p["ss_loading"], 0.0),
        Mode.BC: (p["ss_stiffness"], 0.0),
    }


def _offset(c: np.ndarray, n: int, row: Coef) -> np.ndarray:
    """Strain offset of an end as a row over the waves, see `solvers.wave.bar.strain_offset`."""
    return np.concatenate([c[row, :n], -c[row, :n]])


def _alone(par: np.ndarray) -> np.ndarray:
    """Parameters of the bit by itself, without forces and rock."""
    alone = par.copy()
    for name in ("gravity", "ss_stiffness", "ss_loading", "ss_damping", "release"):
        alone[name] = 0.0
    alone["piston"] = Piston.ABSENT
    alone["n_p"] = 0
    alone["drive"] = DriveKind.NONE
    alone["rock"] = RockKind.NONE
    alone["barrier"] = 1
    return alone


def _of_loaded_bit(
    alone: np.ndarray,
    bit: Grid,
    cb: np.ndarray,
    free: dict[str, np.ndarray],
    loads: dict[Mode, tuple[float, float]],
) -> dict[str, np.ndarray]:
    """Operators of the bit, those of `free` among them, in all modes."""
    names = ("bit", "lookahead", "top", "loss")
    # nine tenths stay zero in a bit alone, which costs nothing as long as nobody writes there
    powers, lookahead, top, loss = (np.zeros(free[name].shape) for name in names)
    for name, of_modes in zip(names, (powers, lookahead, top, loss), strict=True):
        of_modes[Mode.FF] = free[name][Mode.FF]
    size = int(alone["size_r"][0])
    sums, squares = np.zeros((len(Mode), size)), no_operators().squares
    rock = alone.copy()
    rock["rock"] = RockKind.BILINEAR
    way = np.append(_offset(cb, bit.n, Coef.TOP) + _offset(cb, bit.n, Coef.BOTTOM), 1.0)
    for mode, (stiffness, damping) in loads.items():
        configuration = Configuration(rock, bit, cb, float(stiffness), float(damping))
        by_column, faces = step_map(configuration)
        levels = LEVELS if mode == Mode.SS else LOOKAHEAD_LEVELS
        count = levels * DIGITS
        powers[mode, :count] = _powers(by_column, levels, size)
        lookahead[mode] = _lookahead(powers[mode], end_row(configuration, by_column))
        top[mode] = _lookahead(powers[mode], by_column @ way)
        sums[mode, : len(by_column)] = _path_to_rest(configuration, by_column)
        lost, of_end = step_forms(configuration, by_column, faces)
        if mode == Mode.SS:
            lost_sums, squares = _sums(np.stack([lost, of_end]), powers[mode])
        else:
            lost_sums = _sums(lost, powers[mode, :count])
        if alone["loss"][0]:
            loss[mode, :count] = lost_sums
    found = {"bit": powers, "lookahead": lookahead, "sums": sums, "top": top}
    return found | {"loss": loss, "squares": squares}


def _lookahead(powers: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Rows that show at the start of each of the next steps what `row` shows now.

    Parameters
    ----------
    powers : ndarray, shape (powers, size, size)
        As of `_powers`.
    row : ndarray
        Filled up with zeros to `size`.

    Returns
    -------
    ndarray, shape (size, LOOKAHEAD)
    """
    shown = np.zeros((powers.shape[-1], 1))
    shown[: len(row), 0] = row
    for power in powers[: (LOOKAHEAD_LEVELS - 1) * DIGITS : DIGITS]:  # one to four of each
        later = [shown]
        for _ in range(3):
            later.append(power @ later[-1])
        shown = np.hstack(later)
    return shown


def _powers(by_column: np.ndarray, levels: int, size: int) -> np.ndarray:
    """Powers 1, 2, 3, 4, 8, 12, 16, 32, 48, ... of a step map, padded."""
    out = np.zeros((levels, DIGITS, size, size))
    out[0, 0, : len(by_column), : len(by_column)] = by_column
    for level, (once, twice, thrice) in enumerate(out):
        if level:
            np.matmul(out[level - 1, 1], out[level - 1, 1], out=once)
        np.matmul(once, once, out=twice)
        np.matmul(once, twice, out=thrice)
    return out.reshape(-1, size, size)


def _path_to_rest(configuration: Configuration, by_column: np.ndarray) -> np.ndarray:
    """Row that shows the path of the bit's mean motion until it rests [m]."""
    n = configuration.grid.n
    share = configuration.grid.mass / configuration.grid.mass.sum()
    mean = np.zeros(len(by_column))
    mean[:n] = mean[n : 2 * n] = share
    a_step = 0.5 * (mean + by_column @ mean) * configuration.par[0]["dt"]
    path: np.ndarray = np.linalg.solve(np.eye(len(by_column)) - by_column, a_step)
    return path


def _sums(form: np.ndarray, powers: np.ndarray) -> np.ndarray:
    """Sums of a step's quadratic form over many steps, as `carry_and_sum` wants them.

    Parameters
    ----------
    form : ndarray, shape (..., used, used)
        One or more, not larger than the padded powers; each need not be symmetric.
    powers : ndarray, shape (powers, size, size)
        As of `_powers`.

    Returns
    -------
    ndarray, shape (..., powers, size, size)
    """
    used = form.shape[-1]
    total = np.zeros((*form.shape[:-2], *powers.shape[1:]))
    total[..., :used, :used] = 0.5 * (form + form.swapaxes(-1, -2))
    sums = np.empty((*form.shape[:-2], *powers.shape))
    for k in range(0, len(powers), DIGITS):
        power, squared = powers[k], powers[k + 1]
        twice = total + power @ total @ power.T
        sums[..., k, :, :], sums[..., k + 1, :, :] = total, twice
        sums[..., k + 2, :, :] = total + power @ twice @ power.T
        total = twice + squared @ twice @ squared.T
    # column by column, the upper triangle says it all
    sums *= 2.0 * np.tri(powers.shape[-1], k=-1) + np.eye(powers.shape[-1])
    return sums
