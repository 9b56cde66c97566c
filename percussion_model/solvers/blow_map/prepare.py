"""Parameters and first state of a blow map, from a scene and its table as rows of numbers."""

from __future__ import annotations

import math

from percussion_model.physics.kernel import kernel, preparing
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.blow_map.flight import plan
from percussion_model.solvers.blow_map.records import ENTRIES, Axis
from percussion_model.solvers.blow_map.words import FORMAT, SECTIONS, Word, WordFault
from percussion_model.solvers.setup import fill_parameters, fill_start

# A bit that hangs further above the rock at the start does not stand on it [m].
MOST_ROCK_GAP = 1e-3
NO_STAND = (
    "start.rock_gap = {gap} m, start.bit_velocity = {velocity} m/s: the blow map needs a bit "
    f"that stands on the rock, within {MOST_ROCK_GAP:g} m and at 0 m/s"
)
AXES = len(Axis)
# More sections or nodes of an axis than these are no numbers of them.
MOST_SECTIONS, MOST_COUNT = 10_000, 1_000_000


@preparing
def stands_on_rock(numbers):
    """Whether the bit does so at the start, as the map needs it."""
    values = numbers.values
    return values.start_rock_gap <= MOST_ROCK_GAP and values.start_bit_velocity == 0.0


@preparing
def fill_map_parameters(p, numbers, words):
    """Fill a MAP_PAR record.

    Parameters
    ----------
    p : MAP_PAR record
    numbers : Numbers
    words : float array
        The table, at least all but its values (`words`).
    """
    fill_parameters(p, numbers, True)
    p.gamma = numbers.values.rock_unloading_ratio
    p.start_gap = numbers.values.start_gap
    for k in range(AXES):
        p.lowest[k], p.highest[k] = words[Word.LOWEST + k], words[Word.HIGHEST + k]
        p.origin[k], p.step[k] = words[Word.ORIGIN + k], words[Word.STEP + k]


@preparing
def begin(p, s, numbers):
    """Fill a MAP_STATE record at time zero: the bit stands on the rock, the piston flies."""
    fill_start(s, numbers)
    s.p = 0.0
    s.y = -numbers.values.start_gap
    static = s.feed + p.mass_b * p.gravity
    s.e_start = 0.5 * p.mass_p * (s.v_p * s.v_p)
    s.e_start += static * static / (2.0 * p.gamma * s.k_r)
    plan(p, s)


@kernel
def made_for(values):
    """Parameters of a scene for which a table is made, in the order of FIXED."""
    return (
        float(values.effects_gravity),
        float(values.effects_feed),
        float(values.effects_loss),
        float(values.effects_barrier),
        float(values.effects_rock),
        float(values.effects_standstill_tension),
        float(values.piston_model),
        float(values.bit_model),
        float(values.gravity_acceleration),
        float(values.loss_time),
        float(values.rock_unloading_ratio),
        float(values.rock_barrier_damping),
        float(values.rock_barrier_energy),
        float(values.rock_barrier_threshold),
        float(values.solver_cells),
    )


@kernel
def _is_count(number, least, most):
    return least <= number <= most and number == math.floor(number)


@kernel
def first_value(words):
    """Where the values begin."""
    return SECTIONS + 4 * (int(words[Word.PISTON]) + int(words[Word.BIT]))


@kernel
def _axes_fault(words, weight):
    """`NODES` where an axis or a range could not be looked up."""
    for k in range(AXES):
        low, high = words[Word.LOWEST + k], words[Word.HIGHEST + k]
        least = low + weight if k == Axis.LOAD else low
        # not even an infinite number is below this one
        if not (0.0 < least and low <= high < math.inf):
            return WordFault.NODES
        if not (abs(words[Word.ORIGIN + k]) < math.inf and 0.0 < words[Word.STEP + k] < math.inf):
            return WordFault.NODES
    return WordFault.NONE


@kernel
def words_fault(words, weight):
    """Check that a row of numbers from outside is a whole table; a `WordFault`.

    Parameters
    ----------
    words : float array
    weight : float
        M_b G of the scene [N].
    """
    if len(words) < SECTIONS or words[Word.FORMAT] != FORMAT:
        return WordFault.FORMAT
    for k in range(Word.PISTON, Word.BIT + 1):
        if not _is_count(words[k], 1.0, MOST_SECTIONS):
            return WordFault.FORMAT
    nodes = 1.0
    for k in range(Word.COUNTS, Word.COUNTS + AXES):
        if not _is_count(words[k], 2.0, MOST_COUNT):
            return WordFault.NODES
        nodes *= words[k]
    if first_value(words) + nodes * ENTRIES != len(words):
        return WordFault.LENGTH
    return _axes_fault(words, weight)


@kernel
def _bar_fault(words, first, sections, before):
    """Compare the sections of a bar; what is different and where, as `scene_fault`."""
    for k in range(len(sections)):
        for j in range(4):
            if words[first + 4 * k + j] != sections[k, j]:
                return WordFault.SECTION, 4 * (before + k) + j
    return WordFault.NONE, 0


@kernel
def scene_fault(words, numbers):
    """Look whether a table was made for a scene.

    Parameters
    ----------
    words : float array
        At least all but the values.
    numbers : Numbers

    Returns
    -------
    fault : int
        A `WordFault`.
    place : int
        What is different.
    """
    piston, bit = numbers.piston, numbers.bit
    if words[Word.PISTON] != len(piston):
        return WordFault.SECTIONS, 0
    if words[Word.BIT] != len(bit):
        return WordFault.SECTIONS, 1
    wanted = made_for(numbers.values)
    for k in range(len(wanted)):
        made = words[Word.FIXED + k]
        # what is left out is no number in both
        if made != wanted[k] and not (math.isnan(made) and math.isnan(wanted[k])):
            return WordFault.FIXED, k
    fault, place = _bar_fault(words, SECTIONS, piston, 0)
    if fault == WordFault.NONE:
        return _bar_fault(words, SECTIONS + 4 * len(piston), bit, len(piston))
    return fault, place


@kernel
def shape_of(words):
    """Shape of the values, from `first_value` on, of a table that `words_fault` has found whole."""
    return (
        int(words[Word.COUNTS]),
        int(words[Word.COUNTS + 1]),
        int(words[Word.COUNTS + 2]),
        int(words[Word.COUNTS + 3]),
        ENTRIES,
    )
