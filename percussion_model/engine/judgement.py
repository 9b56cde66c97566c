"""Errors of numbers over blows by one call each, for pages (`physics.judgement`).

Blows are rows as the engine lists them. A column of them is known by its word; -1 is that of ones.
"""

from __future__ import annotations

import numpy as np

from percussion_model.engine import layout
from percussion_model.engine.image import new_values, numbers_in
from percussion_model.engine.memory import floats_at, hold, matrix_at, words_at, words_in
from percussion_model.engine.records import Kind
from percussion_model.physics import judgement
from percussion_model.physics.judgement import Grid, Row
from percussion_model.physics.kernel import preparing, when_compiling
from percussion_model.physics.ledger import NUMERICAL_AT, put_in
from percussion_model.physics.records import BLOW, BLOW_COLUMNS
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.modal.resolution import (
    COARSER,
    asked_modes,
    fill_coarser,
    promised_error,
)
from percussion_model.solvers.wave.resolution import error_by_steps, fill_comparable


def _running_sums(values):
    def running_sums(values):
        sums = np.zeros(len(values) + 1)
        for k in range(len(values)):
            sums[k + 1] = sums[k] + values[k]
        return sums

    return running_sums


def _median(values):
    def median(values):
        found = values.copy()
        for k in range(1, len(found)):
            one, place = found[k], k
            while place > 0 and found[place - 1] > one:
                found[place] = found[place - 1]
                place -= 1
            found[place] = one
        half = len(found) // 2
        return found[half] if len(found) % 2 else 0.5 * (found[half - 1] + found[half])

    return median


def _teach():
    from percussion_model.physics.compiling import replace

    # those of numpy need more of numba's library than a page has
    replace(judgement.running_sums, _running_sums)
    replace(judgement.median, _median)


when_compiling(_teach)
WIDTH, ROW = BLOW.itemsize // 8, len(Row)
_NAMES = [column.name for column in BLOW_COLUMNS]
ADVANCE, CYCLES, MARGIN = map(_NAMES.index, ("hole_advance", "drilling_cycles", "barrier_margin"))


@preparing
def _column(blows, word):
    """A column of rows of blows."""
    if word < 0:
        return np.ones(len(blows))
    if word == CYCLES:
        return blows.view(np.int64)[:, word].astype(np.float64)
    found = blows[:, word].copy()
    if word == ADVANCE:
        found[np.abs(found) < judgement.LEAST_ADVANCE] = 0.0
    return found


@preparing
def number(blows, count, over, under, stretches, shares, least, out):
    """Fill in a ratio of sums over blows, its standard error, and how far kinds are apart.

    Parameters
    ----------
    over, under : int
        Columns.
    stretches, shares : int
        Address, and how many (`ratio_of_sums`).
    least : int
        Fewer blows than this have no such number.
    """
    rows, found = matrix_at(blows, count, WIDTH), floats_at(out, 3)
    one, other = _column(rows, over), _column(rows, under)
    lengths = floats_at(stretches, shares)
    found[:] = np.nan
    if count < least or not np.sum(other) > 0.0:
        return 0
    value, error = judgement.ratio_of_sums(one, other, lengths)
    first = judgement.first_kind(_column(rows, CYCLES))
    found[0], found[1], found[2] = value, error, 0.0
    if np.any(first):
        kinds = np.full(2, np.nan)
        for k in range(2):
            kind = first if k == 0 else ~first
            if np.sum(kind) >= least:
                kinds[k] = np.sum(one[kind]) / np.sum(other[kind])
        found[2] = judgement.apart(value, kinds[0], kinds[1])
    return 0


@preparing
def cycles(blows, count):
    """Mean drilling cycles of blows; 0 without blows."""
    if count == 0:
        return 0.0
    return np.mean(_column(matrix_at(blows, count, WIDTH), CYCLES))


@preparing
def barriers(addresses, counts, runs, out):
    """Fill in the barriers, by the present one, that tell of close decisions; NaN: none is close.

    Parameters
    ----------
    addresses, counts : int
        Of the addresses of the blows of runs, that of which decisions are meant first, and of
        how many they are.
    out : int
        Two numbers.
    """
    at, many = words_at(addresses, runs), words_at(counts, runs)
    middles, turns = np.zeros(runs), np.zeros(runs)
    for k in range(runs):
        middles[k] = judgement.middle(matrix_at(at[k], many[k], WIDTH)[:, MARGIN].copy())
        turns[k] = cycles(at[k], many[k])
    unsure = judgement.unsure_of_barrier(middles[0], turns[0], middles[1:], turns[1:])
    margins, found = matrix_at(at[0], many[0], WIDTH)[:, MARGIN].copy(), floats_at(out, 2)
    found[0] = judgement.other_barrier(1.0, margins, unsure)
    found[1] = judgement.other_barrier(-1.0, margins, unsure)
    return 0


@preparing
def error(grid, rows, runs, others, kinds, promised, floor_share, numerical):
    """Relative error of a number (`error_of_number`); rows of so many runs."""
    return judgement.error_of_number(
        grid, matrix_at(rows, runs, ROW), others, kinds, promised, floor_share, numerical
    )


@preparing
def coarser(image, grid, present, out):
    """Fill in modes or steps of runs to compare with; how many there are.

    Of modes all are run, the fewest first; of steps the first that loss does not refuse.

    Parameters
    ----------
    present : int
        Modes or steps in the first elastic bar: as many there may be.
    """
    values = new_values()
    numbers = numbers_in(image, values)
    if grid == Grid.MODES.value:
        count = fill_coarser(asked_modes(numbers), COARSER, words_at(out, len(COARSER)))
    else:
        count = fill_comparable(present, words_at(out, present))
    hold(values)
    return count


@preparing
def promised(image, grid, present):
    """Relative error of the rate that modes or steps promise."""
    values = new_values()
    numbers = numbers_in(image, values)
    if grid == Grid.MODES.value:
        found = promised_error(numbers, present)
    else:
        found = error_by_steps(present, numbers.values.effects_string != 0)
    hold(values)
    return found


@preparing
def modes(base, is_piston):
    """Modes of an elastic piston, or of the bit."""
    head, rows = layout.head_records(base, 1)[0], layout.directory(base)
    if head.kind != Kind.MODAL.value:
        return 0
    if is_piston:
        return rows[head.moving_row + 1, 2]
    return words_in(base + rows[0, 0], (rows[0, 1],))[0]


@preparing
def numerical(reading, energies):
    """Share of the energy put in that a ledger has as numerical.

    Parameters
    ----------
    reading : int
        Address of the energies at its end, so many.
    """
    found = floats_at(reading, energies)
    return found[NUMERICAL_AT] / put_in(found)


@preparing
def longer_step(step, longest):
    """As of `judgement.longer_step`."""
    return judgement.longer_step(step, longest)


# What hosts call: function, and its result and arguments as in `engine.entries`.
EXPORTED = {
    f"judge_{name}": (name, form)
    for name, form in {
        "number": "w:wwwwwwww",
        "cycles": "n:ww",
        "barriers": "w:wwww",
        "error": "n:wwwwnnnn",
        "coarser": "w:wwww",
        "promised": "n:www",
        "modes": "w:ww",
        "numerical": "n:ww",
        "longer_step": "n:nn",
    }.items()
}
