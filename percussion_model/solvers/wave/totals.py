"""Sums over the bars: mean motion, stored energy and booked loss of a state."""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import Piston
from percussion_model.physics.rock import recoverable
from percussion_model.solvers.wave.bar import (
    elastic_energy,
    kinetic_energy,
    mean_velocity,
    strain_offset,
)
from percussion_model.solvers.wave.records import Coef, Row


@merged
def time_of(par, s):
    """Time of a state [s]."""
    return s.t_base + s.step * par.dt


@inlined
def bit_position(s, wb, cb, n, r):
    """Mean displacement of the bit since the start [m]."""
    return s.x_r + s.p + strain_offset(wb, cb, n, r, Coef.BOTTOM) - s.offset_start


@kernel
def resync(par, s, bars):
    """Derive the mean velocities and u_r from gap and waves."""
    r = 2 * s.parity
    s.v_b = mean_velocity(bars.wb, bars.cb, par.n_b, r, par.mass_b)
    if par.piston == Piston.ABSENT or s.dormant == 1:
        return
    s.u_r = strain_offset(bars.wb, bars.cb, par.n_b, r, Coef.TOP) - s.gap
    if par.piston == Piston.ELASTIC:
        s.v_p = mean_velocity(bars.wp, bars.cp, par.n_p, r, par.mass_p)
        s.u_r += strain_offset(bars.wp, bars.cp, par.n_p, r, Coef.BOTTOM)


@kernel
def stored_energy(par, s, bars):
    """Energy stored in bars and rock.

    Returns
    -------
    kinetic, elastic, rock : float
        [J]
    """
    r = 2 * s.parity
    kinetic = kinetic_energy(bars.wb, bars.cb, par.n_b, r)
    elastic = elastic_energy(bars.wb, bars.cb, par.n_b, r)
    if par.piston == Piston.ELASTIC:
        kinetic += kinetic_energy(bars.wp, bars.cp, par.n_p, r)
        elastic += elastic_energy(bars.wp, bars.cp, par.n_p, r)
    elif par.piston == Piston.RIGID:
        kinetic += 0.5 * par.mass_p * s.v_p * s.v_p
    return kinetic, elastic, recoverable(par, s)


@kernel
def lost_in_faces(par, bars):
    """Structural loss booked interface by interface [J]."""
    total = 0.0
    for i in range(par.n_b):
        total += bars.wb[Row.LOSS, i]
    for i in range(par.n_p):
        total += bars.wp[Row.LOSS, i]
    return total * par.dt


@kernel
def begin(par_, state, bars):
    """Complete a new state: mean velocities, u_r, and what is counted from them.

    Parameters
    ----------
    par_, state : WAVE_PAR, WAVE_STATE array of length 1
    bars : Bars
    """
    par = par_[0]
    s = state[0]
    resync(par, s, bars)
    s.u_start = s.u_r
    kinetic, elastic, rock = stored_energy(par, s, bars)
    s.e_start = kinetic + elastic + rock
