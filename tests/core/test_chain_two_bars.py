"""Waves of two bars: closed forms at their ends, ledger, and modes beside them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from percussion_model import Scene, Simulation, simulate
from percussion_model.solvers.base import make_solver
from tests.core.chain_scenes import AREA, C0, CELL, DT, F0, Z, bar, driven, struck


def alone(**changes):
    """A piston above a bit on nothing, at 10 m/s."""
    effects = {"drive": "none", "feed": False, "gravity": False, "rock": "none"}
    scene = Scene(effects={**effects, "barrier": False}, run={"settle": 0.0, "duration": 1e-3})
    return Simulation(scene.computed_by("wave", **changes))


@pytest.mark.parametrize("cells", [7, 16, 40])
@pytest.mark.parametrize("gap", [1e-6, 1.23e-5, 3.1e-4])
def test_a_contact_closes_between_steps(cells, gap):
    """M v' = -Z v from the closure at gap / v on, wherever it comes in a step, without loss."""
    simulation = alone(**{
        "solver.cells": cells, "start.gap": gap, "piston.model": "rigid", "effects.loss": False,
    })  # fmt: skip
    mass, z = simulation.scene.piston.mass, simulation.scene.bit.sections[0].impedance
    simulation.advance(gap / 10.0 + 2.5e-5)
    seen = simulation.observe()
    assert seen["piston_velocity"] == pytest.approx(10.0 * math.exp(-z * 2.5e-5 / mass), rel=1e-9)
    assert simulation.result().blows.size == 0
    assert abs(simulation.energy()["residual_relative"]) < 1e-12


STIFFNESS, CELLS = 1e10, 60


def force_on_a_spring(wavelength, **loss):
    """Fourier sum of the force on a spring at the end of a bar, by a wave of one step from above.

    Returns
    -------
    found : complex
        Per force of the wave.
    s : complex
        i w [1/s].
    """
    simulation = driven(
        bar(40), bar(CELLS - 40), steps=1, bottom="rock", rock={"loading_stiffness": STIFFNESS},
        effects={"loss": bool(loss), "rock": "spring"}, loss=loss,
    )  # fmt: skip
    times = DT * np.arange(CELLS - 25, CELLS + 2 * CELLS)
    impulse = simulation.sample(times)["bit_impulse"]
    s = 2j * math.pi * C0 / wavelength
    return np.diff(impulse) @ np.exp(-s * times[:-1]) / (F0 * DT), s


@pytest.mark.parametrize("eta", [2e-7, 8e-7])
@pytest.mark.parametrize("wavelength", [200 * CELL, 100 * CELL])
def test_loss_changes_the_impedance_of_an_end(eta, wavelength):
    """It is Z sqrt(1 + i eta w): the force on a spring, to that without loss, by long waves."""
    found, s = force_on_a_spring(wavelength, time=eta)
    without, _ = force_on_a_spring(wavelength)
    root, spring = np.sqrt(1 + eta * s), STIFFNESS / s
    arrives = np.exp(-s * CELLS * DT * (1 / root - 1))
    exact = root * (Z + spring) / (Z * root + spring) * arrives
    of_end = abs(exact / arrives - 1)
    assert found / without == pytest.approx(exact, abs=0.1 * of_end)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"piston.model": "rigid"},
        {"effects.rock": "wall", "effects.barrier": False},
        {"effects.rock": "spring", "effects.barrier": False},
        {"effects.rock": "power"},
        {"effects.cuttings": True},
        {"effects.cuttings": True, "rock.removed_by": "cycle"},
        {"effects.loss": False},
        {"loss.time": 1e-8},
        {"bit.sections.0.length": 0.9137},
        {"effects.standstill_tension": "paper"},
        {"effects.damper": False, "effects.drive": "external", "drive.external_force": 2500.0},
    ],
    ids=str,
)
def test_the_ledger_of_two_bars_closes(changes):
    """Through blows, cut steps, flight and standstill."""
    scene = Scene(run={"duration": 0.15, "settle": 0.0}).computed_by("wave", **changes)
    result = simulate(scene)
    assert abs(result.energy["residual_relative"]) < 1e-11
    assert len(result.events) > 0


def test_the_ledger_closes_where_a_section_turns_waves():
    """A cut step mixes what a section of one to two steps keeps as well."""
    simulation = struck(
        bar(16),
        {"sections": [{"length": k * CELL, "area": k * AREA} for k in (20.6, 1.37)]},
        start={"piston_velocity": 9.0, "gap": 3.3e-5}, drive={"external_force": 3e4},
        effects={"loss": True, "gravity": True, "rock": "spring", "drive": "external"},
        solver={"name": "wave"},
    )  # fmt: skip
    simulation.advance(4000 * DT)
    assert simulation._state.record[0]["t_base"] < 0.0
    ledger = simulation.energy()
    assert ledger["numerical"] > 0.0
    assert abs(ledger["residual_relative"]) < 1e-13


@pytest.mark.parametrize("model", ["elastic", "rigid", "absent"])
def test_the_first_elastic_bar_of_two_has_24_steps(model):
    """Those of a rigid piston, or of none, are counted in the bit."""
    drive = {} if model != "absent" else {"effects.drive": "none"}
    solver = make_solver(Scene().computed_by("wave", **{"piston.model": model, **drive}))
    assert next(iter(solver.cells.values())) == 24


@pytest.mark.parametrize(
    ("name", "changes", "cells", "error"),
    [
        ("reference", {}, 24, 2e-4),
        ("reference", {"piston.model": "rigid"}, 64, 1e-3),
        ("hammers/dth4_kuru", {}, 32, 5e-3),
        ("hammers/dth5_st_anne", {}, 64, 2e-3),
    ],
)
def test_waves_and_modes_agree(name, changes, cells, error):
    """The rate of penetration by two methods that share no motion of a bar."""
    path = name if "/" not in name else f"scenarios/{name}.toml"
    scene = Scene.from_toml(path).replace(**{"run.duration": 2.0, "run.settle": 0.5})
    modes = simulate(scene.computed_by("modal", **{**changes, "solver.cells": 40}))
    waves = simulate(scene.computed_by("wave", **{**changes, "solver.cells": cells}))
    expected = modes.rate_of_penetration
    assert waves.rate_of_penetration == pytest.approx(expected, rel=error)
