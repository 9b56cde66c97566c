"""A scene's bars as the arrays that the kernels of waves go by."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Piston
from percussion_model.scene.bars import (
    LENGTH,
    add,
    bar_transit_time,
    section_impedance,
    section_transit_time,
)
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.setup import PISTONS, kelvin_voigt_time
from percussion_model.solvers.wave.records import Body, Chain, Fit, Joint, Place, Steel
from percussion_model.solvers.wave.resolution import (
    DEFAULT_STEPS,
    PULSE_STEPS,
    STEPS_OF_TWO,
    steps_for,
)
from percussion_model.solvers.wave.taps import WHOLE, on_the_way, turning, weights_of, width_of

# Bars are lossy at their ends as well where their sections have this share of their loss: the ends
# of others would make energy. Without them loss is off by up to 5 %, which may stall a hammer; so
# they may only be missing where the Kelvin-Voigt time is this share of a step.
LEAST_OF_ENDS, MOST_WITHOUT_ENDS = 0.9, 0.25
# Where loss needs longer steps, they grow by about this.
LONGER = 1.05
# Where steps are shorter than the Kelvin-Voigt time, sections must have this share of their loss.
LEAST_SPREAD = 0.99
# Steps in which a wave crosses any bar at least, where a scene asks for none.
FEWEST_STEPS = 4
# Steps in which a wave crosses all bars at most, for the sake of a short wave from outside.
MOST_FOR_PULSE = 1 << 14
TOO_FINE = (
    "loss.time = {eta} s: too long for waves in {length} m of a bar in steps of {step} s: must be "
    "at most about an eighth of the time in which a wave crosses the shortest bar; or take fewer "
    'solver.cells, or for two bars modes (solver.name = "modal")'
)
PLACES, STEELS, FITS, BODIES = len(Place), len(Steel), len(Fit), len(Body)
PERFECT = int(Joint.PERFECT)


class Plan(NamedTuple):
    """What the elastic bars of a scene are cut by.

    Attributes
    ----------
    sections : float array, shape (sections, 4)
        Of all these bars from top to bottom, as `section_numbers` has them.
    counts : int array, shape (bars,)
        Sections of each bar.
    time_step, eta : float
        Time step and Kelvin-Voigt time [s].
    cells : float
        About how many there will be.
    """

    sections: np.ndarray
    counts: np.ndarray
    time_step: float
    eta: float
    cells: float


class Network(NamedTuple):
    """Bars cut into sections for a time step.

    Attributes
    ----------
    chain : Chain
    rings : int
        Numbers that all rings hold.
    misfit : float
        Largest relative error of a section's transit time: one shorter than a step.
    struck : int
        The bar that the piston strikes, or the topmost.
    lossy_ends : int
        1 where sections have so much of their loss that ends can have theirs.
    too_fine : float
        0 where all is well; length [m] of a section, or bar, that cannot spread a wave as the loss
        would in such steps. The rest is then not finished.
    """

    chain: Chain
    rings: int
    misfit: float
    struck: int
    lossy_ends: int
    too_fine: float


class Cut(NamedTuple):
    """How a wave crosses a section.

    Attributes
    ----------
    delay : int
        Steps from a wave that is sent to the newest weight.
    row : ndarray
        Weights as they lie in the ring, the newest last; of one to two steps the two of `turning`.
    taps : int
        How many weights it arrives by, in whole lanes.
    mean, spread : float
        Of its time [steps, steps^2].
    """

    delay: int
    row: np.ndarray
    taps: int
    mean: float
    spread: float


@preparing
def first_is_piston(numbers):
    """Whether the topmost elastic bar is the piston."""
    return PISTONS[numbers.values.piston_model] == Piston.ELASTIC


@preparing
def _fill_sections(sections, at, bar):
    """Copy sections to rows from `at` on; the row after them."""
    for k in range(len(bar)):
        for j in range(4):
            sections[at + k, j] = bar[k, j]
    return at + len(bar)


@preparing
def _elastic_chain(numbers):
    """Sections of all elastic bars from top to bottom, and how many each has."""
    first = int(first_is_piston(numbers))
    piston = numbers.piston if first else numbers.piston[:0]
    rods = len(numbers.rod_counts)
    counts = np.zeros(first + rods + 1, np.int64)
    counts[0] = len(piston)  # of a rigid one none, and replaced
    for k in range(rods):
        counts[first + k] = numbers.rod_counts[k]
    counts[-1] = len(numbers.bit)
    sections = np.zeros((counts.sum(), 4))
    end = _fill_sections(sections, 0, piston)
    end = _fill_sections(sections, end, numbers.rod_sections)
    _fill_sections(sections, end, numbers.bit)
    return sections, counts


@preparing
def _step_of_pulse(values, sections):
    """Longest step for a wave that comes down from outside [s]; infinite where there is none."""
    if PISTONS[values.piston_model] != Piston.ABSENT or values.string_pulse_force == 0.0:
        return math.inf
    finest = bar_transit_time(sections) / MOST_FOR_PULSE
    return max(values.string_pulse_duration / PULSE_STEPS, finest)


@preparing
def _time_step(numbers, sections, counts):
    """Time step of a scene [s]: the transit time of the first elastic bar by its steps."""
    values = numbers.values
    first = bar_transit_time(sections[: counts[0]])
    if not math.isnan(values.solver_cells):
        return first / values.solver_cells
    if not math.isnan(values.solver_accuracy):
        return first / steps_for(values.solver_accuracy, len(numbers.rod_counts) > 0)
    steps = DEFAULT_STEPS if first_is_piston(numbers) else FEWEST_STEPS
    longest = first / (steps if len(numbers.rod_counts) > 0 else STEPS_OF_TWO)
    longest = min(longest, _shortest(sections, counts, 1) / FEWEST_STEPS)
    longest = min(longest, _step_of_pulse(values, sections))
    # a section shorter than a step would be longer than it is
    for k in range(len(sections)):
        longest = min(longest, section_transit_time(sections[k]))
    # and in steps shorter than the Kelvin-Voigt time short sections would lose their loss
    eta = kelvin_voigt_time(numbers)
    count = math.ceil(first / longest - 1e-9)
    if min(eta, first) > longest:
        count = math.floor(first / min(eta, first))
    return first / _steps_with_loss(sections, counts, first, count, eta)


@preparing
def _shortest(sections, counts, first):
    """Transit time of the shortest bar from one on [s]; infinite where there is none."""
    shortest, end = math.inf, 0
    for i in range(len(counts)):
        begin, end = end, end + counts[i]
        if i >= first:
            shortest = min(shortest, bar_transit_time(sections[begin:end]))
    return shortest


@preparing
def _steps_with_loss(sections, counts, first, most, eta):
    """Steps through the first bar, at most so many, in which all bars have their loss.

    Where none do, steps so long that ends do not miss it; as many as asked for where they are too
    long for a bar: then `network_of` refuses them.
    """
    count = most
    while count >= 1 and eta > MOST_WITHOUT_ENDS * first / count:
        if _have_loss(sections, counts, first / count, eta):
            return count
        count = min(count - 1, math.floor(count / LONGER))
    too_few = FEWEST_STEPS * first > count * _shortest(sections, counts, 0)
    return most if count < most and too_few else count


@preparing
def _have_loss(sections, counts, dt, eta):
    """Whether the sections of each bar have enough of its loss for it to have it at its ends."""
    k = 0
    for bar in range(len(counts)):
        spread = wanted = 0.0
        for _ in range(counts[bar]):
            transit = section_transit_time(sections[k]) / dt
            spread += _cut(transit, eta * transit / dt).spread
            wanted += eta * transit / dt
            k += 1
        if spread < LEAST_OF_ENDS * wanted:
            return False
    return True


@preparing
def plan_of(numbers):
    """`Plan` of a scene."""
    sections, counts = _elastic_chain(numbers)
    dt = _time_step(numbers, sections, counts)
    cells = bar_transit_time(sections) / dt
    return Plan(sections, counts, dt, kelvin_voigt_time(numbers), cells)


@preparing
def _cut(transit, variance):
    """`Cut` of a section, by its transit time [steps] and the variance that it wants [steps^2]."""
    if 1.0 + WHOLE < transit < 2.0 - WHOLE:
        a = turning(transit)
        return Cut(1, np.array([a, math.sqrt(1.0 - a * a)]), 1, transit, 0.0)
    delay, weights, spread = weights_of(max(transit, 1.0), variance)
    taps, mean, rest = len(weights), float(delay), 0.0
    for k in range(1, taps):
        mean, rest = add(mean, rest, k * weights[k])
    padded = 1 if taps == 1 else (taps + WIDTH - 1) // WIDTH * WIDTH
    row = np.zeros(padded)
    for k in range(taps):
        row[padded - 1 - k] = weights[k]
    return Cut(delay, row, padded, mean + rest, spread)


@preparing
def _appended(weights, count, row):
    """The first `count` weights with a row more, in twice the room where there is too little."""
    if count + len(row) > weights.shape[1]:
        more = np.zeros((1, 2 * (count + len(row))))
        for k in range(count):
            more[0, k] = weights[0, k]
        weights = more
    for k in range(len(row)):
        weights[0, count + k] = row[k]
    return weights


@preparing
def _cells_of(cut):
    """How many cells a section is read in."""
    return max(1, math.floor(cut.mean) if cut.taps == 1 else round(cut.mean))


@preparing
def _fill_place(place, bar, ring, cut, first, passed, reach):
    """Fill a row of `Place`."""
    cells = _cells_of(cut)
    needed = max(cut.delay + cut.taps + 1, cells + reach + 1)
    if reach > 0:
        needed = max(needed, width_of(reach))
    size = 1
    while size < needed:
        size *= 2
    place[Place.BAR], place[Place.RING], place[Place.SIZE] = bar, ring, size
    place[Place.DELAY], place[Place.TAPS] = cut.delay - 1, cut.taps
    place[Place.WEIGHTS] = -1 if len(cut.row) == 1 else first
    place[Place.CELLS], place[Place.PASSAGE], place[Place.REACH] = cells, passed, reach


@preparing
def _fill_steel(steel, k, z, mass, cells, by_loss, by_mixing, is_first):
    """Fill a row of `Steel`."""
    steel[k, Steel.IMPEDANCE], steel[k, Steel.CELL_MASS] = z, mass / cells
    steel[k, Steel.BY_LOSS], steel[k, Steel.BY_MIXING] = by_loss, by_mixing
    if not is_first:
        above = steel[k - 1, Steel.IMPEDANCE]
        steel[k, Steel.ALPHA] = 2.0 * above / (above + z)
        steel[k, Steel.BETA] = 2.0 * z / (above + z)


@preparing
def network_of(numbers, plan):
    """Cut the bars of a scene; a `Network`."""
    dt, eta, count, bars = plan.time_step, plan.eta, len(plan.sections), len(plan.counts)
    places, steel = np.zeros((count, PLACES), np.int64), np.zeros((count, STEELS))
    bodies, weights = np.zeros((bars, BODIES)), np.zeros((1, 64))
    ring, used, misfit, k, too_fine = 0, 0, 0.0, 0, 0.0
    passage, passed, lossy_ends = np.zeros((1, 64)), 0, 1
    for bar in range(bars):
        begin, spread, all_wanted, late = k, 0.0, 0.0, 0.0
        for _ in range(plan.counts[bar]):
            section = plan.sections[k]
            transit = section_transit_time(section) / dt
            wanted = eta * transit / dt
            cut = _cut(transit, wanted)
            if dt < eta and cut.spread < LEAST_SPREAD * wanted and too_fine == 0.0:
                too_fine = section[LENGTH]
            misfit = max(misfit, abs(cut.mean / transit - 1.0))
            row, reach = on_the_way(_cells_of(cut), cut.mean, cut.spread / cut.mean, eta / dt)
            _fill_place(places[k], bar, ring, cut, used, passed, reach)
            weights = _appended(weights, used, cut.row)
            used += len(cut.row)
            spread, all_wanted = spread + cut.spread, all_wanted + wanted
            passage = _appended(passage, passed, row)
            passed += len(row)
            ring += 4 * places[k, Place.SIZE] + 2
            loss = 1.0 if eta > 0.0 else 0.0
            if cut.spread > wanted:  # the rest is what fitting a short section to steps takes
                loss = wanted / cut.spread
            z = section_impedance(section)
            mass = z * cut.mean * dt  # of what is shorter than a step: as much as its waves have
            _fill_steel(
                steel, k, z, mass, places[k, Place.CELLS], z * dt * loss, z * dt * (1.0 - loss),
                k == begin,
            )  # fmt: skip
            bodies[bar, Body.MASS] += mass
            late += 0.5 * z * cut.spread * dt * dt
            k += 1
        bodies[bar, Body.FIRST], bodies[bar, Body.LAST] = begin, k - 1
        bodies[bar, Body.INV_MASS] = 1.0 / bodies[bar, Body.MASS]
        bodies[bar, Body.LATE] = late / bodies[bar, Body.MASS]
        if spread < LEAST_OF_ENDS * all_wanted:
            lossy_ends = 0
            if eta > MOST_WITHOUT_ENDS * dt and too_fine == 0.0:
                for section in plan.sections[begin:k]:
                    too_fine += section[LENGTH]
    struck = int(first_is_piston(numbers))
    fits = _fits(numbers, steel, bodies[struck:])
    chain = Chain(places, steel, _first(weights, used), _first(passage, passed), fits, bodies)
    return Network(chain, ring, misfit, struck, lossy_ends, too_fine)


@preparing
def _first(row, count):
    """The first numbers of a row, in an array of their own."""
    own = np.zeros((1, count))
    for i in range(count):
        own[0, i] = row[0, i]
    return own


@preparing
def _fits(numbers, steel, bodies):
    """Rows of `Fit` of the joints below the rods."""
    fits = np.zeros((len(numbers.joints), FITS))
    for k in range(len(fits)):
        joint, fit = numbers.joints[k], fits[k]
        kind, transmission, relaxation = int(joint[0]), joint[1], joint[2]
        below = int(bodies[k + 1, Body.FIRST])
        give_above = 1.0 / steel[int(bodies[k, Body.LAST]), Steel.IMPEDANCE]
        give_below = 1.0 / steel[below, Steel.IMPEDANCE]
        gives = give_above + give_below
        stiffness, damping = joint[5], 0.0
        if kind == Joint.LOSSY and transmission < 1.0:
            damping = transmission / ((1.0 - transmission) * gives)
            stiffness = (1.0 + damping * gives) / (gives * relaxation)
        elif kind == Joint.LOSSY:
            kind = PERFECT
        fit[Fit.KIND], fit[Fit.YIELD], fit[Fit.PRELOAD] = kind, gives, joint[4]
        fit[Fit.STIFFNESS], fit[Fit.DAMPING], fit[Fit.SECTION] = stiffness, damping, below
        fit[Fit.STIFF], fit[Fit.ABOVE], fit[Fit.BELOW] = 1.0 / gives, give_above, give_below
    return fits
