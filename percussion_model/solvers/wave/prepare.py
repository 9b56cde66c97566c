"""Grid, parameters, leap operators and first state of waves, from the numbers of a scene."""

from __future__ import annotations

from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Piston
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.setup import (
    MOST_CHANGES,
    elastic_piston,
    fill_parameters,
    fill_start,
    kelvin_voigt_time,
    rock_numbers,
)
from percussion_model.solvers.wave.cutting import cut_both
from percussion_model.solvers.wave.grid import (
    Refused,
    choose_time_step,
    wish_for,
)
from percussion_model.solvers.wave.leaps.lookahead import LOOKAHEAD
from percussion_model.solvers.wave.leaps.operators import (
    LEAPING,
    LEVELS,
    bit_in,
    fill_mode,
    fill_piston,
    fill_sizes,
    free_piston,
    padded,
    room_for_operators,
)
from percussion_model.solvers.wave.leaps.step_map import step_map
from percussion_model.solvers.wave.records import Row, no_operators
from percussion_model.solvers.wave.resolution import asked_cells, asked_wish
from percussion_model.solvers.wave.totals import begin

# A bit alone loads and unloads the rock in a few percent of its steps. To make the maps that
# leap these takes as long as some ten thousand steps, which a run of fewer than so many spares.
LONG_RUN = 65_536


@preparing
def wanted_grid(numbers):
    """Transit time of a cell that a scene asks for [s], and the `Wish` that tells of refusals."""
    wish = asked_wish(numbers)
    if wish.refused != Refused.NOT:
        return 0.0, wish
    time_step = choose_time_step(numbers, asked_cells(numbers))
    return time_step, wish_for(numbers, time_step)


@preparing
def cut_bars(numbers, time_step):
    """`CutBars` of a scene; its grid must not be refused."""
    return cut_both(elastic_piston(numbers), numbers.bit, time_step, kelvin_voigt_time(numbers))


@preparing
def fill_wave_parameters(p, numbers, bars):
    """Fill a WAVE_PAR record of zeros, without leaps."""
    bit, piston, rock = bars.bit, bars.piston, rock_numbers(numbers)
    n, n_p = len(bit.grid.mass), len(piston.grid.mass)
    fill_parameters(p, numbers, n_p > 0)
    p.dt, p.loss, p.front = bars.time_step, bars.substeps, bars.front
    p.most_changes = MOST_CHANGES
    p.n_b = n
    p.z_t, p.z_b = bit.grid.impedance[0], bit.grid.impedance[n - 1]
    p.kappa_t, p.kappa_b = bit.kappa
    p.bound_t, p.bound_b = bit.bound
    if n_p > 0:
        p.n_p = n_p
        p.z_f, p.z_p = piston.grid.impedance[0], piston.grid.impedance[n_p - 1]
        p.kappa_f, p.kappa_p = piston.kappa
        p.bound_p = piston.bound[1]
    p.ss_stiffness = rock.gamma * rock.k_r
    many = p.piston != Piston.ABSENT or numbers.values.run_duration > LONG_RUN * p.dt
    p.ss_loading = rock.k_r if many else 0.0
    p.ss_damping = rock.c_r


@preparing
def can_leap(p, numbers, bars):
    """Whether leaps are wanted and their operators not too large; fills the sizes of these."""
    # forces that change from step to step leave no step a constant map
    if not numbers.values.solver_leaps or p.effects != 0:
        return False
    return fill_sizes(p, bars)


@preparing
def make_operators(par, numbers, bars):
    """`LeapOperators` of a scene, or stand-ins; fills how many levels there are.

    Parameters
    ----------
    par : WAVE_PAR array of length 1
    numbers : Numbers
    bars : CutBars
    """
    if can_leap(par[0], numbers, bars):
        ops = room_for_operators(par[0])
        if par[0].n_p > 0:
            bar = free_piston(par, bars)
            by_column, faces = step_map(bar)
            fill_piston(ops, bar, by_column, faces)
        rests = True
        for mode in LEAPING:
            bar, leaps = bit_in(par, bars, mode)
            if leaps and rests:
                by_column, faces = step_map(bar)
                rests = fill_mode(ops, mode, bar, by_column, faces)
        if rests:
            par[0].leaps = LEVELS
            return ops
    return no_operators()


@preparing
def scratch_size(p):
    """Numbers in each row of `Scratch`."""
    return max(padded(2 * max(p.n_b, p.n_p) + 1), LOOKAHEAD)


@preparing
def fill_wave_start(par, state, bars, numbers):
    """Fill record and waves at time zero.

    Parameters
    ----------
    par, state : WAVE_PAR, WAVE_STATE array of length 1
        The state of zeros.
    bars : Bars
        Its waves of zeros.
    numbers : Numbers
    """
    s, values = state[0], numbers.values
    fill_start(s, numbers)
    s.leap_end = -1
    for row in (Row.DOWN, Row.UP):
        bars.wb[row, : par[0].n_b] = 0.5 * values.start_bit_velocity
        bars.wp[row, : par[0].n_p] = 0.5 * values.start_piston_velocity
    begin(par, state, bars)
