"""Chains of bars for closed forms: whole cells of 10 mm, and nothing on but what one is about."""

from __future__ import annotations

import math

import numpy as np

from percussion_model import Scene, Simulation
from percussion_model.solvers.wave.records import Place, Steel
from tests.engine_views import chain_of, first_section

E, RHO, AREA = 210e9, 7850.0, 2e-3
C0 = math.sqrt(E / RHO)
Z = AREA * math.sqrt(E * RHO)
CELL = 0.01  # [m]
DT = CELL / C0
F0 = 1e5  # of incident waves [N]
BARE = {"drive": "none", "gravity": False, "feed": False, "loss": False, "rock": "none"}
ROUNDING = 1e-11


def bar(cells, area=AREA, **joint):
    """A bar of one section, and its joint to the bar below."""
    return {"sections": [{"length": cells * CELL, "area": area}], **joint}


def struck(*bars, effects=(), **groups):
    """A chain that begins with a piston, of cells of 10 mm."""
    first = next(one for one in bars if one.get("model") != "rigid")
    cells = round(sum(one["length"] for one in first["sections"]) / CELL)
    start = {"gap": 0.0, "rock_gap": 0.0, **groups.pop("start", {})}
    solver = {"cells": cells, **groups.pop("solver", {})}
    effects = BARE | dict(effects)
    return Simulation(
        Scene(
            bars=list(bars), effects=effects, start=start, solver=solver, run={"settle": 0.0},
            **groups,
        )
    )  # fmt: skip


def driven(*bars, steps, force=F0, bottom="open", **groups):
    """A chain without a piston, into which a wave of so many steps comes."""
    end = {"top": "open", "pulse_force": force, "pulse_duration": steps * DT, "bottom": bottom}
    return struck(*bars, piston={"model": "absent"}, string=end, **groups)


def after(simulation, steps):
    """The fields after so many steps from the start."""
    simulation.advance(steps * simulation.solver.time_step)
    return simulation.fields()


def sent_down(simulation, name, steps):
    """Mean force that was sent into a bar in each step so far, where none comes up in it."""
    after(simulation, steps)
    solver, state = simulation.solver, simulation._state
    section = first_section(solver, name)
    ring, size = chain_of(solver).places[section, [Place.RING, Place.SIZE]]
    assert size >= steps
    ages = (int(state.record[0]["step"]) - np.arange(steps)) & (size - 1)
    sent = chain_of(solver).steel[section, Steel.IMPEDANCE] * state.arrays[-1][0, ring + ages]
    return sent[::-1]


def of_joint(simulation, row, joint=0):
    """What a row of `Has` says of a joint."""
    return float(simulation._state.arrays[1][row, joint])


def mean_of_exponential(rate, steps, dt=DT):
    """Mean of exp(-rate t) over each of so many steps."""
    return np.exp(-rate * dt * np.arange(steps)) * -math.expm1(-rate * dt) / (rate * dt)


def rigid(mass):
    """A rigid piston of some mass [kg]."""
    return {"model": "rigid", "sections": [{"length": mass / (RHO * 0.01), "area": 0.01}]}
