"""Momentum, rest and energy of chains of bars, and the two ways to write one down."""

from __future__ import annotations

import numpy as np
import pytest

from percussion_model import Scene, Simulation
from percussion_model.physics.records import EventKind
from percussion_model.solvers.wave.records import Bar, Has
from tests.core.chain_scenes import (
    AREA,
    CELL,
    DT,
    RHO,
    after,
    bar,
    of_joint,
    rigid,
    struck,
)
from tests.engine_views import chain_of

# --------------------------------------------------------------- momentum, static load


@pytest.mark.parametrize("loss", [False, True])
def test_momentum_of_all_bars_is_what_outer_forces_gave(loss):
    """Impulses in joints and of the piston cancel; feed, weight, drive and rock remain."""
    simulation = struck(
        bar(18), bar(40, 1.4 * AREA, joint="threaded", preload=2e4),
        bar(31, joint="contact", gap=1e-4), bar(25, joint="lossy", transmission=0.7),
        bar(22, 2 * AREA),
        effects={"feed": True, "gravity": True, "rock": "bilinear", "loss": loss,
                 "drive": "external"},
        drive={"external_force": 1500.0}, start={"piston_velocity": 9.0},
    )  # fmt: skip
    bodies = chain_of(simulation.solver).bodies
    first = bodies[:, 0] @ simulation._state.arrays[0][Bar.VELOCITY]
    weight = bodies[:, 0].sum() * 10.0
    for steps in (50, 300, 2000):
        fields = after(simulation, steps)
        seen, t = simulation.observe(), simulation.solver.time(simulation._state)
        moving = bodies[:, 0] @ simulation._state.arrays[0][Bar.VELOCITY]
        given = (weight + 2500.0 + 1500.0) * t - seen["bit_impulse"]
        # what loss adds to the force of waves that are still to come
        par = simulation.solver._par[0]
        given += par["viscous"] * par["dt"] * simulation._state.record[0]["g_rock"]
        scale = first + seen["bit_impulse"]
        assert abs(moving - first - given) < 2e-8 * scale  # read 1e-6 steps later
        if not loss:  # waves in cells are all that there is
            names = ("piston", "rod 1", "rod 2", "rod 3", "bit")
            cells = sum(
                simulation.solver.grid_of(name).mass @ fields[f"{name}_velocity"] for name in names
            )
            assert abs(cells - moving) < 1e-10 * scale


def at_rest(joint, top="open"):
    """A string that has come to rest on a spring; its open top took its waves away.

    Returns
    -------
    simulation : Simulation
    seen : dict
        Samples between 0.1 and 1 s.
    load, stiffness : float
        Feed and weight [N], and of the spring [N/m].
    """
    more = {
        "threaded": {"preload": 1e3, "thread_stiffness": 1e8},
        "lossy": {"transmission": 0.6, "relaxation": 1e-4},
    }.get(joint, {})
    K = 1e8
    simulation = struck(
        bar(80, joint=joint, **more), bar(60, joint=joint, **more), bar(30.5, 3 * AREA),
        piston={"model": "absent"}, string={"top": top},
        effects={"feed": True, "gravity": True, "rock": "spring", "loss": True},
        rock={"loading_stiffness": K},
    )  # fmt: skip
    load = 2500.0 + 10.0 * RHO * AREA * CELL * (80 + 60 + 3 * 30.5)
    return simulation, simulation.sample([0.1, 0.4, 0.7, 1.0]), load, K


@pytest.mark.parametrize("joint", ["perfect", "threaded", "contact", "lossy"])
def test_static_load_does_not_creep(joint):
    """A string under feed and weight rests on a spring for a second, as it is.

    The mean velocity of a bar keeps about g eta/2: momentum of waves that loss has spread, which
    no cell shows. The mean position is derived anew every 256 steps.
    """
    simulation, seen, _, K = at_rest(joint)
    np.testing.assert_allclose(seen["bit_force"], seen["bit_force"][0], rtol=1e-10)
    np.testing.assert_allclose(seen["penetration"], seen["penetration"][0], rtol=1e-10)
    np.testing.assert_allclose(K * seen["penetration"], seen["bit_force"], rtol=1e-8)
    kept = 10.0 * simulation.scene.loss.time
    np.testing.assert_allclose(seen["bit_velocity"], 0.0, atol=kept)
    assert np.ptp(seen["bit_position"]) < 256 * DT * kept
    if joint in ("threaded", "contact"):
        assert of_joint(simulation, Has.CLOSED) == 1.0
        assert of_joint(simulation, Has.GAP) == 0.0
    if joint == "lossy":  # its spring carries the load of the bar above
        fit = chain_of(simulation.solver).fits[0]
        short = (2500.0 + 10.0 * RHO * AREA * CELL * 80) / fit[3]
        assert of_joint(simulation, Has.GAP) == pytest.approx(short, rel=1e-2)


@pytest.mark.parametrize("joint", ["perfect", "threaded", "contact", "lossy"])
def test_static_load_is_feed_and_weight(joint):
    """What rests on the spring is all of the feed and the weight, and no more."""
    _, seen, load, _ = at_rest(joint)
    np.testing.assert_allclose(seen["bit_force"], load, rtol=1e-8)


def test_damper_that_has_parted_stores_nothing():
    """Casing and string part for good: what they are worth in energy is their motion alone."""
    simulation = struck(
        rigid(5.0), bar(40), bar(40), start={"piston_velocity": 8.0}, effects={"damper": True},
        damper={"stiffness": 1e6, "damping": 0.0, "preload": 1e3, "casing_mass": 100.0},
    )  # fmt: skip
    after(simulation, 3000)
    ledger = simulation.energy()
    assert abs(ledger["residual_relative"]) < 1e-11
    assert ledger["joints"] == 0.0


@pytest.mark.parametrize("damping", [0.0, 1e4, 2e5])
@pytest.mark.parametrize("stiffness", [0.0, 2e6, 1e10])
def test_damper_only_takes(stiffness, damping):
    """Its dashpot takes in every step or not, however often it parts; without one nothing goes.

    What the steps cost is apart, and falls with their square.
    """
    errors = []
    for cells in (20, 80):
        simulation = struck(
            bar(40), bar(40), bar(22), start={"piston_velocity": 8.0, "gap": 1e-4},
            effects={"damper": True, "rock": "bilinear", "feed": True}, solver={"cells": cells},
            damper={"stiffness": stiffness, "damping": damping, "preload": 1e3},
        )  # fmt: skip
        simulation.advance(1e-5)
        taken = []
        while simulation.time < 4e-3:
            simulation.advance(simulation.time + simulation.solver.time_step)
            taken.append(simulation.energy()["joints"])
        ledger = simulation.energy()
        assert min(np.diff(taken)) >= 0.0
        assert (taken[-1] > 0.0) == (damping > 0.0)
        assert abs(ledger["residual_relative"]) < 1e-11
        errors.append(abs(ledger["numerical_relative"]))
    assert errors[0] < 4e-3
    assert errors[1] < 0.3 * errors[0]


@pytest.mark.parametrize(("stiffness", "damping"), [(1e9, 1e8), (1e10, 1e9)])
def test_strong_damper_makes_no_energy(stiffness, damping):
    """A damper within the bounds of its parameters, however strong, holds or takes."""
    simulation = struck(
        rigid(5.0), bar(40), bar(40), start={"piston_velocity": 8.0}, effects={"damper": True},
        damper={"stiffness": stiffness, "damping": damping, "casing_mass": 100.0},
    )  # fmt: skip
    for steps in (100, 1000, 5000):
        after(simulation, steps)
        ledger = simulation.energy()
        assert ledger["joints"] >= 0.0
        assert ledger["kinetic"] <= ledger["initial"]


def test_sections_shorter_than_a_step_balance():
    """Feed on bars whose sections are shorter than a step: the ledger closes."""
    thin = [{"length": length * CELL, "area": AREA} for length in (6.0, 0.4, 7.3, 0.7)]
    simulation = struck(
        bar(20), {"sections": thin}, bar(20),
        start={"piston_velocity": 1.0}, effects={"feed": True, "gravity": True},
    )  # fmt: skip
    after(simulation, 400)
    assert abs(simulation.energy()["residual_relative"]) < 1e-9


def test_recoil_is_the_opposite_of_the_drive():
    """Piston, string and casing keep their momentum, also in a step in which the drive turns."""
    simulation = struck(
        rigid(5.0), bar(40), bar(40), effects={"damper": True, "drive": "pressure"},
        start={"piston_velocity": 5.0, "gap": 1e-4},
    )  # fmt: skip
    after(simulation, 600)
    assert simulation.events["kind"].tolist().count(EventKind.DRIVE_UP) == 1
    bodies, state = chain_of(simulation.solver).bodies, simulation._state
    moving = bodies[:, 0] @ state.arrays[0][Bar.VELOCITY]
    moving += 5.0 * state.record[0]["v_p"] + 150.0 * state.record[0]["v_c"]
    assert moving == pytest.approx(25.0, rel=1e-10)


# --------------------------------------------------------------------- two ways to say it


def test_two_bars_are_piston_and_bit():
    """[[bars]] of a piston and a bit are the scene with [piston] and [bit], to the last bit."""
    piston = {"sections": [{"length": 0.175, "area": 5.5e-3}]}
    bit = {"sections": [{"length": 0.1, "area": 5.5e-3}, {"length": 0.1, "area": 7e-3}]}
    listed, grouped = Scene(bars=[piston, bit]), Scene(piston=piston, bit=bit)
    assert listed == grouped
    assert listed.to_toml() == grouped.to_toml()
    runs = []
    for scene in (listed, grouped):
        # by the solver of chains, which computes these as well
        simulation = Simulation(scene.replace(**{"solver.name": "wave"}))
        simulation.advance(0.08)
        assert len(simulation.blows) > 0
        runs.append(simulation.blows.tobytes())
    assert runs[0] == runs[1]


def test_rods_in_a_list_are_those_of_the_string():
    """[[bars]] of a chain are the scene with string.rods, to the last bit."""
    piston, bit = bar(18), bar(20)
    rods = [bar(40, joint="lossy", transmission=0.9), bar(30, 2 * AREA)]
    listed = Scene(bars=[piston, *rods, bit])
    grouped = Scene(
        piston=piston, bit=bit, string={"rods": rods}, effects={"string": True}
    )  # fmt: skip
    assert listed == grouped
    runs = []
    for scene in (listed, grouped):
        simulation = Simulation(scene)
        simulation.advance(0.01)
        runs.append([values.tobytes() for values in simulation.fields().values()])
    assert runs[0] == runs[1]
