"""Readings of a state: what every solver tells of it at a time."""

from __future__ import annotations

import math
from typing import Any

from percussion_model.physics.blows import filled_from_state
from percussion_model.physics.kernel import merged, when_compiling
from percussion_model.physics.loads import drive_force, drive_on_bit
from percussion_model.physics.records import LEDGER_ENTRIES, PEAK_FIELDS, SAMPLE_COLUMNS, Piston
from percussion_model.physics.rock import hole_depth

# What a reading takes over from a state as it is.
_KEPT = (*LEDGER_ENTRIES, *PEAK_FIELDS)


def each(names: Any) -> Any:
    """Names one after another; in kernels, each a constant: numba's own function stands there."""
    return names


def _teach() -> None:
    from numba import literal_unroll

    globals()["each"] = literal_unroll  # numba knows no other name for it


when_compiling(_teach)


# fill_columns(s, reading): write the columns that are fields of a state.
fill_columns = filled_from_state(SAMPLE_COLUMNS)


@merged
def fill_motion(par, s, reading, time, piston_position, bit_position):
    """Write what the common fields of a state tell of motion, modes and impulses.

    Forces, kinetic energy and velocity of the bit's end are left to the solver.

    Parameters
    ----------
    reading : record of READING
    time : float
        [s]
    piston_position, bit_position : float
        Mean displacements since the start of the run [m].
    """
    reading.time = time
    reading.piston_position = piston_position - s.climb
    reading.bit_position = bit_position - s.climb
    reading.bit_end_position = s.x_r + s.p - s.climb
    reading.hole_depth = hole_depth(par, s)
    reading.drive_force = drive_force(par, s)
    reading.recoil_force = reading.drive_force + drive_on_bit(s)
    reading.recoil_impulse = s.i_drive + s.i_on_bit
    fill_columns(s, reading)
    if par.piston == Piston.ABSENT:
        reading.piston_position = math.nan
        reading.piston_velocity = math.nan
        reading.gap = math.nan
        reading.relative_displacement = math.nan


@merged
def fill_forces(s, reading, tau, bit, contact, at_grid_point):
    """Write mean forces since a grid point, running impulses and peaks.

    Parameters
    ----------
    s : record
        Its impulses count from that grid point.
    reading : record of READING
    tau : float
        Time since then [s].
    bit, contact : float
        Impulses until then [N s].
    at_grid_point : bool
        Whether it is read there, where no impulse has come on top.
    """
    reading.bit_force = s.i_bit / tau
    reading.contact_force = s.i_contact / tau
    reading.bit_impulse = bit
    reading.contact_impulse = contact
    if not at_grid_point:
        reading.bit_impulse += s.i_bit
        reading.contact_impulse += s.i_contact
    reading.peak_bit_force = s.peak_bit_force
    reading.peak_contact_force = s.peak_contact_force


@merged
def fill_ledger(s, reading, kinetic, elastic, recoverable):
    """Write the energies of a state and the peaks that its observer asked for.

    Parameters
    ----------
    reading : record of READING
    kinetic, elastic, recoverable : float
        Stored energies [J].
    """
    for name in each(_KEPT):
        reading[name] = s[name]
    reading.kinetic = kinetic
    reading.elastic = elastic
    reading.recoverable = recoverable
