"""Leap operators of a grid: powers of the step map, by mode (docs/numerics.md, section 5)."""

from __future__ import annotations

import numpy as np

from percussion_model.physics.kernel import kernel, preparing
from percussion_model.physics.records import Mode, Piston, RockKind
from percussion_model.solvers.wave.leaps.linear import DIGITS, PADDING
from percussion_model.solvers.wave.leaps.lookahead import LOOKAHEAD, LOOKAHEAD_LEVELS
from percussion_model.solvers.wave.leaps.products import (
    multiply_matrices,
    multiply_narrow,
    solve,
    transpose,
)
from percussion_model.solvers.wave.leaps.step_map import (
    Configuration,
    fill_end_row,
    loss_of_step,
    square_at_end,
)
from percussion_model.solvers.wave.records import Coef, LeapOperators

# Longest leap: 4^LEVELS - 1 steps, 0.1 s on the default grid of the reference.
LEVELS = 8
# Without their operators a scene is stepped through; beyond this size they
# would cost more memory and set-up time than they save [numbers].
MOST_NUMBERS = 60_000_000
MODES = len(Mode)
# Modes that leaps can cross, and those of a loaded bit among them.
LOADED = (int(Mode.SS), int(Mode.DFC), int(Mode.FC), int(Mode.BC))
LEAPING = (int(Mode.FF), *LOADED)


@kernel
def padded(size):
    """Size of an operator with its padding."""
    return (size + PADDING - 1) // PADDING * PADDING


@preparing
def fill_sizes(p, bars):
    """Fill the padded sizes of the operators; whether these are not too large.

    Parameters
    ----------
    p : WAVE_PAR record
    bars : CutBars
    """
    size_p, size = padded(2 * len(bars.piston.grid.mass)), padded(2 * len(bars.bit.grid.mass) + 1)
    if LEVELS * DIGITS * (size_p * size_p + MODES * size * size) > MOST_NUMBERS:
        return False
    p.size_p, p.size_r = size_p, size
    return True


@preparing
def operator_shapes(p):
    """Shapes of `LeapOperators` for the sizes, the loss and the rock of a scene.

    Parameters
    ----------
    p : WAVE_PAR record
    """
    powers, size, size_p = LEVELS * DIGITS, p.size_r, p.size_p
    piston, bottom = (1, 1, 1), (1, 1)
    if p.n_p > 0:
        piston, bottom = (powers, size_p, size_p), (size_p, LOOKAHEAD)
    lost = p.loss > 0
    of_rows, of_end = (MODES, size, LOOKAHEAD), (1, 1, 1)
    if p.rock == RockKind.BILINEAR:
        of_end = (powers, size, size)
    return (
        piston,
        (MODES, powers, size, size),
        of_rows,
        (MODES, size),
        of_rows,
        bottom,
        piston if lost else (1, 1, 1),
        (MODES, powers, size, size) if lost else (MODES, 1, 1, 1),
        of_end,
    )


@preparing
def room_for_operators(p):
    """Return `LeapOperators` to be filled, for a WAVE_PAR record: zeros."""
    shapes = operator_shapes(p)
    return LeapOperators(
        np.zeros(shapes[0]), np.zeros(shapes[1]), np.zeros(shapes[2]), np.zeros(shapes[3]),
        np.zeros(shapes[4]), np.zeros(shapes[5]), np.zeros(shapes[6]), np.zeros(shapes[7]),
        np.zeros(shapes[8]),
    )  # fmt: skip


@preparing
def alone(par):
    """Parameters of the bit by itself, without forces and rock.

    Parameters
    ----------
    par : WAVE_PAR array of length 1

    Returns
    -------
    WAVE_PAR array of length 1
    """
    of_bit = par.copy()
    p = of_bit[0]
    p.gravity = p.ss_stiffness = p.ss_loading = p.ss_damping = 0.0
    p.piston, p.n_p = Piston.ABSENT, 0
    p.rock = RockKind.NONE
    p.release, p.barrier = 0, 1
    return of_bit


@preparing
def free_piston(par, bars):
    """`Configuration` of the free piston, as if it were a bit alone.

    Parameters
    ----------
    par : WAVE_PAR array of length 1
    bars : CutBars
    """
    of_piston = alone(par)
    p = of_piston[0]
    p.n_b, p.mass_b = par[0].n_p, par[0].mass_p
    p.z_t, p.z_b = p.z_f, p.z_p
    p.kappa_t, p.kappa_b = p.kappa_f, p.kappa_p
    return Configuration(of_piston, bars.piston.grid, bars.piston.coefficients, 0.0, 0.0)


@kernel
def _load(p, mode):
    """Stiffness and damping of a contact mode; no stiffness where leaps cannot cross it."""
    if p.rock != RockKind.BILINEAR:
        return 0.0, 0.0
    if mode == Mode.SS:
        return p.ss_stiffness, p.ss_damping
    if p.ss_loading == 0.0:
        return 0.0, 0.0
    if mode == Mode.BC:
        return p.ss_stiffness, 0.0
    return p.ss_loading, p.ss_damping if mode == Mode.DFC else 0.0


@preparing
def bit_in(par, bars, mode):
    """`Configuration` of the bit in a mode, and whether leaps can cross this.

    Parameters
    ----------
    par : WAVE_PAR array of length 1
    bars : CutBars
    mode : int
    """
    of_bit = alone(par)
    stiffness, damping, leaps = 0.0, 0.0, True
    if mode != Mode.FF:
        of_bit[0].rock = RockKind.BILINEAR
        stiffness, damping = _load(par[0], mode)
        leaps = stiffness > 0.0
    return Configuration(of_bit, bars.bit.grid, bars.bit.coefficients, stiffness, damping), leaps


@kernel
def _fill_offset(c, n, row, out):
    """Fill the strain offset of an end as a row over the waves (`wave.bar.strain_offset`)."""
    for i in range(n):
        out[i], out[n + i] = c[row, i], -c[row, i]


@kernel
def _fill_shown(by_column, row, out):
    """Fill what a row shows after a step into the first column of `out`."""
    for i in range(len(by_column)):
        total = 0.0
        for k in range(len(by_column)):
            total += by_column[i, k] * row[k]
        out[i, 0] = total


@preparing
def fill_piston(ops, bar, by_column, faces):
    """Fill the operators of the free piston.

    Parameters
    ----------
    ops : LeapOperators
        Zeros of the shapes that `operator_shapes` tells.
    bar : Configuration
        `free_piston`.
    by_column, faces : ndarray
        From `step_map`.
    """
    fill_powers(by_column, ops.piston)
    if bar.par[0].loss > 0:
        fill_sums(loss_of_step(bar, by_column, faces), ops.piston, ops.piston_loss)
    row = np.zeros(len(by_column))
    _fill_offset(bar.c, len(bar.grid.mass), Coef.BOTTOM, row)
    _fill_shown(by_column, row, ops.bottom)
    _fill_lookahead(ops.piston, ops.bottom)


@preparing
def fill_mode(ops, mode, bar, by_column, faces):
    """Fill the operators of the bit in a mode.

    Parameters
    ----------
    ops : LeapOperators
        As for `fill_piston`.
    mode : int
    bar : Configuration
        `bit_in` that mode.
    by_column, faces : ndarray
        From `step_map`.

    Returns
    -------
    bool
        Whether there are such operators. A loaded bit may not come to rest within the
        digits of a number, as with a loss that freezes its stress: then there is no
        path to rest.
    """
    loaded = mode != Mode.FF
    if loaded and not _fill_path_to_rest(bar, by_column, ops.sums[mode]):
        return False
    levels = LOOKAHEAD_LEVELS if loaded and mode != Mode.SS else LEVELS
    powers, loss = ops.bit[mode, : levels * DIGITS], ops.loss[mode, : levels * DIGITS]
    fill_powers(by_column, powers)
    _fill_rows(bar, by_column, ops.lookahead[mode], ops.top[mode])
    _fill_lookahead(powers, ops.lookahead[mode])
    _fill_lookahead(powers, ops.top[mode])
    if bar.par[0].loss > 0:
        fill_sums(loss_of_step(bar, by_column, faces), powers, loss)
    if mode == Mode.SS:
        fill_sums(square_at_end(bar, faces), powers, ops.squares)
    return True


@preparing
def _fill_rows(bar, by_column, lookahead, top):
    """Fill the first columns of what the next steps show of the rock end and of the top."""
    n, used = len(bar.grid.mass), len(by_column)
    low, row = np.zeros(used), np.zeros(used)
    _fill_offset(bar.c, n, Coef.BOTTOM, low)
    _fill_offset(bar.c, n, Coef.TOP, row)
    if bar.stiffness > 0.0:
        fill_end_row(bar, by_column, lookahead)
        for i in range(2 * n):
            row[i] += low[i]
        row[2 * n] = 1.0
    else:
        _fill_shown(by_column, low, lookahead)
    _fill_shown(by_column, row, top)


@preparing
def _fill_lookahead(powers, shown):
    """Fill rows that show at the start of each of the next steps what the first one shows now.

    Parameters
    ----------
    powers : ndarray, shape (powers, size, size)
        As of `fill_powers`.
    shown : ndarray, shape (size, LOOKAHEAD)
        Column by column.
    """
    count = first = 1
    while count < LOOKAHEAD:  # one to four of each
        power = powers[first - 1]
        for k in range(1, 4):
            before = shown[:, (k - 1) * count : k * count].copy()
            multiply_narrow(power, before, shown, k * count, (k + 1) * count)
        count, first = 4 * count, first + DIGITS


@kernel
def fill_powers(by_column, out):
    """Fill powers 1, 2, 3, 4, 8, 12, 16, 32, 48, ... of a step map, padded with zeros.

    Parameters
    ----------
    by_column : ndarray, shape (used, used)
    out : ndarray, shape (powers, size, size)
        Zeros.
    """
    used, size = len(by_column), out.shape[1]
    for i in range(used):
        for j in range(used):
            out[0, i, j] = by_column[i, j]
    for k in range(0, len(out), DIGITS):
        if k > 0:
            multiply_matrices(out[k - 2], out[k - 2], out[k], size, False)
        multiply_matrices(out[k], out[k], out[k + 1], size, False)
        multiply_matrices(out[k], out[k + 1], out[k + 2], size, False)


@preparing
def _fill_path_to_rest(bar, by_column, path):
    """Fill the row that shows the path of the bit's mean motion until it rests [m].

    Returns
    -------
    bool
        Whether it does come to rest.
    """
    grid, used = bar.grid, len(by_column)
    n, dt, mean, whole = len(grid.mass), bar.par[0].dt, np.zeros(used), 0.0
    for i in range(n):
        whole += grid.mass[i]
    for i in range(n):
        mean[i] = mean[n + i] = grid.mass[i] / whole
    change = np.zeros((used, used))
    for i in range(used):
        total = mean[i]
        for k in range(used):
            total += by_column[i, k] * mean[k]
            change[i, k] = (1.0 if i == k else 0.0) - by_column[i, k]
        path[i] = 0.5 * total * dt
    return solve(change, path)


@kernel
def _add_carried(power, across, before, form, out, room):
    """out = form + P before P', symmetric forms all.

    Parameters
    ----------
    power, across : ndarray, shape (size, size)
        P and P'.
    room : ndarray, shape (size, size)
    """
    size = len(power)
    multiply_matrices(power, before, room, size, False)
    multiply_matrices(room, across, out, size, True)
    for i in range(size):
        for j in range(i + 1):
            out[i, j] += form[i, j]
            out[j, i] = out[i, j]


@kernel
def _store_triangle(form, out):
    """Store a symmetric form as the triangle that gives the same, column by column."""
    for i in range(len(form)):
        for j in range(i):
            out[i, j] = 2.0 * form[i, j]
        out[i, i] = form[i, i]


@preparing
def fill_sums(form, powers, out):
    """Fill sums of a step's quadratic form over many steps, as `carry_and_sum` wants them.

    Parameters
    ----------
    form : ndarray, shape (used, used)
        Not larger than the padded powers; it need not be symmetric.
    powers : ndarray, shape (powers, size, size)
        As of `fill_powers`.
    out : ndarray, shape (powers, size, size)
        Zeros.
    """
    used, size = len(form), powers.shape[1]
    once, twice, room = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, size))
    across, thrice = np.zeros((size, size)), np.zeros((size, size))
    for i in range(used):
        for j in range(used):
            once[i, j] = 0.5 * (form[i, j] + form[j, i])
    for k in range(0, len(powers), DIGITS):
        transpose(powers[k], across)
        _add_carried(powers[k], across, once, once, twice, room)
        _add_carried(powers[k], across, twice, once, thrice, room)
        _store_triangle(once, out[k])
        _store_triangle(twice, out[k + 1])
        _store_triangle(thrice, out[k + 2])
        if k + DIGITS < len(powers):
            transpose(powers[k + 1], across)
            _add_carried(powers[k + 1], across, twice, twice, once, room)
