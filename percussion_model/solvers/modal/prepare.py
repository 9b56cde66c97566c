"""Parameters, tables and first state of the modal solver, from the numbers of a scene."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from percussion_model.physics.kernel import plain
from percussion_model.physics.records import Piston
from percussion_model.scene.bars import bar_transit_time
from percussion_model.scene.rock_law import rock_numbers, rock_springs
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.modal.ends import RINGING
from percussion_model.solvers.modal.laws import laws_of
from percussion_model.solvers.modal.modes import Modes
from percussion_model.solvers.modal.records import STEP, Forms, Laws
from percussion_model.solvers.modal.resolution import asked_modes, default_modes
from percussion_model.solvers.modal.tables import (
    end_compliance,
    forms_of,
    mode_counts,
    piston_tables,
)
from percussion_model.solvers.setup import (
    PISTONS,
    elastic_piston,
    fill_parameters,
    fill_start,
    kelvin_voigt_time,
)

# Steps in the transit time of the first bar at least: with fewer a search missed that the rock end
# turned.
FEWEST_STEPS = 12
# Where rock unloads on another spring than that of the form, the difference bends the path of a
# step by no more than this share of it, with as many modes as by default (docs/modal.md).
MOST_BEND = 0.01
MOST_TICKS = 2.0**62  # that a number of a record holds


class Request(NamedTuple):
    """What the tables of a scene follow from, besides its bars.

    Attributes
    ----------
    piston_mass : float
        0 where there is none [kg].
    springs : (float, float)
        K_R and gamma K_R, 0 where no form stands on them [N/m].
    dashpot : float
        C_R of the rock [N s/m].
    highest : float
        Angular frequency up to which there are modes [rad/s].
    eta, tick : float
        Kelvin-Voigt time and unit of time [s].
    """

    piston_mass: float
    springs: tuple[float, float]
    dashpot: float
    highest: float
    eta: float
    tick: float


class Tables(NamedTuple):
    """What scenes of the same bars and rock share.

    Attributes
    ----------
    forms : Forms
    modes : six Modes
        Of the forms.
    free : Modes
        Of an elastic piston by itself; none else.
    shape_p, move_p : ndarray
        Of its elastic modes, as one of `Forms`.
    laws : Laws
    """

    forms: Forms
    modes: tuple[Modes, ...]
    free: Modes
    shape_p: np.ndarray
    move_p: np.ndarray
    laws: Laws


@plain
def fill_modal_parameters(p, numbers):
    """Fill a MODAL_PAR record; a `Request` for its tables."""
    fill_parameters(p, numbers, True)
    elastic = PISTONS[numbers.values.piston_model] == Piston.ELASTIC
    first = bar_transit_time(numbers.piston if elastic else numbers.bit)
    eta, rock = kelvin_voigt_time(numbers), rock_numbers(numbers)
    modes = asked_modes(numbers)
    dt = first / modes
    highest = math.pi / dt
    p["ringing"], p["asked"] = RINGING << STEP, STEP
    p["most_bend"] = MOST_BEND * default_modes(numbers) / modes
    while dt > first / FEWEST_STEPS:
        dt *= 0.5
        p["ringing"] *= 2
        p["asked"] += 1
    tick = dt / (1 << STEP)
    p["eta"], p["dt"], p["tick"] = eta, dt, tick
    # a period of the highest of few modes; a rigid piston pushes hardest at once
    p["window"] = (2.0 if elastic else 1.0) * first / default_modes(numbers)
    # lengths far apart are refused for their modes
    p["transit"] = int(min(bar_transit_time(numbers.bit) / tick, MOST_TICKS))
    if p["piston"] == Piston.ABSENT:
        p["mass_p"] = 0.0
    else:
        p["start_gap"] = numbers.values.start_gap
    p["bound_p"] = math.sqrt(end_compliance(numbers.piston, False)) if elastic else 0.0
    p["bound_b"] = math.sqrt(end_compliance(numbers.bit, False))
    p["bound_t"] = math.sqrt(end_compliance(numbers.bit, True))
    p["k_r"], p["gamma"], p["c_r"] = rock.k_r, rock.gamma, rock.c_r
    # forces that change from step to step leave no law that pairs could go by
    p["leaps"] = numbers.values.solver_leaps and p["steps"] == 0
    return Request(p["mass_p"], rock_springs(numbers), rock.c_r, highest, eta, tick)


@plain
def modes_wanted(numbers, request):
    """Modes of the bit, of an elastic piston, and of both where they are joined."""
    piston = elastic_piston(numbers)
    return mode_counts(numbers.bit, piston, request.piston_mass, request.highest)


@plain
def forms_for(numbers, request):
    """Forms of a scene, as `forms_of` has them."""
    return forms_of(
        numbers.bit, elastic_piston(numbers), request.piston_mass, request.springs,
        request.highest, request.eta, request.tick,
    )  # fmt: skip


@plain
def tables_of(numbers, request):
    """`Tables` of a scene."""
    eta, tick = request.eta, request.tick
    forms, modes, free = forms_for(numbers, request)
    shape_p, move_p = piston_tables(free, eta, tick)
    laws = laws_of(forms, request.dashpot, eta, tick)
    return Tables(forms, modes, free, shape_p, move_p, laws)


@plain
def begin(p, s, w, active, numbers):
    """Fill state and modes at time zero.

    Parameters
    ----------
    p, s : MODAL_PAR, MODAL_STATE record
    w : ndarray, shape (8, n)
    active : int
        Modes of the free bit.
    numbers : Numbers
    """
    fill_start(s, numbers)
    s["leap_end"] = s["law"] = -1
    s["v_low"] = s["v_b"]
    s["alert"] = 1
    s["active"] = active
    w[1, 0] = math.sqrt(p["mass_b"]) * s["v_b"]
    if p["piston"] != Piston.ABSENT:
        s["u_p"] = s["u_r"] = -s["gap"]
    s["e_start"] = 0.5 * (w[1, 0] * w[1, 0])
    s["e_start"] += 0.5 * p["mass_p"] * s["v_p"] * s["v_p"]
