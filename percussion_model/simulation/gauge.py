"""A strain gauge on an elastic bit."""

from __future__ import annotations

import numpy as np

from percussion_model.physics.records import READING
from percussion_model.scene.bars import AREA, LENGTH, section_mass
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.numbers import section_numbers
from percussion_model.simulation.simulate import Simulation


def gauge_stress(
    simulation: Simulation, times: np.ndarray, place: float | None = None
) -> np.ndarray:
    """Elastic stress in the bit, as a strain gauge there shows it [Pa].

    Between the centres of cells, and between grid points in time, it is taken as linear.

    Parameters
    ----------
    simulation : Simulation
        Of an elastic bit; is advanced through the times.
    times : ndarray
        Rising [s].
    place : float, optional
        From the top of the bit [m]; default its middle.
    """
    bit = simulation.scene.bit
    return gauge_force(simulation, times, place) / _at(bit.length, section_numbers(bit), place)[1]


def gauge_force(
    simulation: Simulation, times: np.ndarray, place: float | None = None
) -> np.ndarray:
    """Elastic force in the bit [N]; otherwise as `gauge_stress`."""
    solver, grid, bit = simulation.solver, simulation.solver.grid_of("bit"), simulation.scene.bit
    if grid is None:
        raise SimulationError("a gauge is on an elastic bit: this one is rigid")
    above = _at(bit.length, section_numbers(bit), place)[0]
    centres = np.cumsum(grid.mass) - 0.5 * grid.mass
    reading, seen, force = np.zeros(1, READING), [], []
    # a solver may tell the state of its last grid point: so read a step later as well
    later = np.concatenate([times, times + (solver.time_step or 0.0)])
    for t in np.unique(later):
        simulation.advance(float(t))
        state = solver.read(simulation.save().state, float(t), reading, peaks=False)
        seen.append(solver.time(state))
        force.append(np.interp(above, centres, solver.fields(state)["bit_force"]))
    known, first = np.unique(seen, return_index=True)
    return np.interp(times, known, np.array(force)[first])


def _at(length: float, sections: np.ndarray, place: float | None) -> tuple[float, float]:
    """Mass of a bar above a place [kg], and the area there [m2]."""
    above, place = 0.0, 0.5 * length if place is None else place
    if not 0.0 <= place <= length:
        raise SimulationError(f"gauge at {place!r} m: the bit is {length!r} m long")
    for section in sections:
        own = float(section[LENGTH])
        if place <= own:
            break
        above += section_mass(section)
        place -= own
    return above + section_mass(section) * min(place / own, 1.0), float(section[AREA])
