"""Peers against closed forms, stored references and the finite elements."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from percussion_model import Scene, SceneError, Simulation
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.parameters import parameter_table
from percussion_model.verification.accuracy.exact_flow import ExactFlowSolver
from percussion_model.verification.accuracy.explicit import ExplicitSolver, explicit_rate
from percussion_model.verification.accuracy.ladders import fem_scene, stiffness_of
from percussion_model.verification.accuracy.problems import (
    CONTACT_HISTORY,
    HISTORY,
    RATE,
    STRESS_HISTORY,
    Run,
    pose,
    relative_error,
)
from percussion_model.verification.accuracy.references import find_reference

SCENARIOS = Path(__file__).parents[2] / "scenarios"
BARE = {
    "effects.gravity": False,
    "effects.feed": False,
    "effects.drive": "none",
    "effects.loss": False,
    "run.settle": 0.0,
    "start.rock_gap": 0.0,
    "start.gap": 0.0,
}
SECTION = Scene().piston.sections[0]
WAVE_SPEED = math.sqrt(SECTION.youngs_modulus / SECTION.density)
IMPEDANCE = SECTION.area * math.sqrt(SECTION.youngs_modulus * SECTION.density)


PEERS = [ExplicitSolver, ExactFlowSolver]


def explicit(scene, elements):
    return Simulation(scene, solver=ExplicitSolver(scene, elements))


@pytest.mark.parametrize(("peer", "elements"), [(ExplicitSolver, 80), (ExactFlowSolver, 20)])
def test_impact_of_two_bars_of_one_section(peer, elements):
    """Oracle 1: the force is Z v / 2 for two transits; then the piston is at rest."""
    scene = Scene().replace(
        **BARE | {"effects.rock": "none", "effects.loss": True, "start.piston_velocity": 10.0}
    )
    simulation = Simulation(scene, solver=peer(scene, elements))
    rows = simulation.sample(np.linspace(10e-6, 100e-6, 91))
    early = rows["time"] < 50e-6
    assert rows["contact_force"][early].mean() == pytest.approx(IMPEDANCE * 5.0, rel=2e-3)
    assert rows["piston_velocity"][-1] == pytest.approx(0.0, abs=0.06)  # loss rounds the front
    momentum = scene.piston.mass * rows["piston_velocity"] + scene.bit.mass * rows["bit_velocity"]
    assert momentum == pytest.approx(10.0 * scene.piston.mass, rel=1e-9)
    closed, opened = simulation.events["time"][:2]
    transit = scene.piston.length / WAVE_SPEED
    assert opened - closed == pytest.approx(2.0 * transit, abs=0.2 * transit)


def test_piston_drives_bit_into_linear_rock():
    """Oracle 2: penetration at the end of the incident wave, p = (Z v / K)(1 - exp(-beta))."""
    scene = Scene().replace(**BARE | {"effects.rock": "spring", "start.piston_velocity": 8.5})
    end = (scene.bit.length + 2.0 * scene.piston.length) / WAVE_SPEED
    stiffness = scene.rock.loading_stiffness
    beta = 2.0 * stiffness * scene.piston.length / (SECTION.youngs_modulus * SECTION.area)
    wanted = IMPEDANCE * 8.5 / stiffness * -math.expm1(-beta)
    errors = []
    for elements in (40, 160):
        found = explicit(scene, elements).sample(np.array([end]))["bit_end_position"][0]
        errors.append(abs(found / wanted - 1.0))
    # the front rings without loss: its place, not its height, converges
    assert errors[1] < 0.5 * errors[0] < 0.01


@pytest.mark.parametrize("peer", PEERS)
def test_bit_dropped_on_linear_rock(peer):
    """Oracle 3: the greatest penetration of an elastic bar, where a rigid one has 0.565084 mm."""
    scene = Scene().replace(
        **BARE | {"effects.rock": "spring", "piston.model": "absent", "start.bit_velocity": 5.25}
    )
    simulation = Simulation(scene, solver=peer(scene, 20))
    rows = simulation.sample(np.linspace(1.6e-4, 1.8e-4, 201))
    peak = rows["bit_force"].max() / scene.rock.loading_stiffness
    assert peak == pytest.approx(0.554510e-3, rel=1e-4)
    assert rows["time"][rows["bit_force"].argmax()] == pytest.approx(0.1722e-3, abs=1e-6)


@pytest.mark.parametrize(
    ("peer", "name", "elements", "rate", "others"),
    [
        (ExplicitSolver, "reference", 40, 5e-4, 1e-3),
        (ExplicitSolver, "stiff_rock", 60, 3e-3, 1e-3),
        (ExplicitSolver, "chatter", 60, 4e-3, 1e-3),
        (ExactFlowSolver, "reference", 20, 4e-4, 2e-3),
        (ExactFlowSolver, "chatter", 15, 2e-3, 2e-3),
    ],
)
def test_stored_references_are_met(peer, name, elements, rate, others):
    """All quantities of a periodic motion; measured errors are about half of what is allowed."""
    scene = Scene.from_toml(SCENARIOS / f"{name}.toml")
    problem = pose(scene)
    reference = find_reference(problem, scene)
    answer = Run(problem, scene, lambda one: peer(one, elements)).answer()
    untold = set(problem.quantities) - set(answer.values) - set(answer.histories)
    assert untold <= {"loss_share"}  # explicit elements book no loss
    for key in (one for one in problem.quantities if one not in untold):
        off = relative_error(answer, reference.values, reference.histories, key)
        if reference.bars[key].threshold:  # its middle is the rate of no motion
            off -= reference.floor(key)
        if key == "rebound_velocity" and abs(reference.values[key]) < 0.1:
            continue  # next to nothing is left of it
        shapes = {HISTORY: 8e-3, CONTACT_HISTORY: 4e-2, STRESS_HISTORY: 5e-2}
        shapes |= {"peak_contact_force": 1.2e-2, "peak_stress": 8e-3}
        allowed = {RATE: rate, **shapes}.get(key, others)
        assert off < allowed, key


@pytest.mark.parametrize("peer", PEERS)
def test_a_drop_keeps_its_resting_place(peer):
    scene = Scene.from_toml(SCENARIOS / "drop_test.toml")
    problem = pose(scene)
    reference = find_reference(problem, scene)
    answer = Run(problem, scene, lambda one: peer(one, 20)).answer()
    for key in ("resting_place", "peak_bit_force", "rock_energy"):
        assert relative_error(answer, reference.values, None, key) < 2e-4, key


def test_the_exact_flow_converges_with_the_square_of_its_elements():
    """Force through a drop: next to nothing but the mesh is wrong."""
    scene = Scene.from_toml(SCENARIOS / "drop_test.toml")
    problem = pose(scene)
    reference = find_reference(problem, scene)
    answers = [
        Run(problem, scene, lambda one, n=n: ExactFlowSolver(one, n)).answer() for n in (5, 10)
    ]
    coarse, fine = (
        relative_error(answer, reference.values, None, "resting_place") for answer in answers
    )
    assert 3.0 < coarse / fine < 7.0
    assert fine < 2e-4


def test_lengths_that_share_no_cell():
    """Against the finite elements, whose elements need not fit either."""
    scene = Scene().replace(**{"piston.sections.0.length": 0.18, "bit.sections.0.length": 0.2113})
    elements = fem_scene(scene, 60, 2.0, stiffness_of(60))
    simulation = Simulation(elements, record_events=False)
    simulation.advance(0.9)
    rows = simulation.blows[simulation.blows["time"] > 0.4]
    wanted = rows["penetration"].sum() / rows["period"].sum()
    assert explicit_rate(scene, 60, 0.9, 0.4) == pytest.approx(wanted, rel=1.5e-3)


def test_a_bar_of_two_equal_sections_is_one_bar():
    half = SECTION.__class__(length=0.5 * SECTION.length, area=SECTION.area)
    one = Scene()
    two = one.replace(**{"piston.sections": (half, half)})
    first, second = explicit(one, 20), explicit(two, 20)
    for simulation in (first, second):
        simulation.advance(0.08)
    for name in ("time", "period", "penetration", "impact_velocity", "rock_energy"):
        assert second.blows[0][name] == pytest.approx(first.blows[0][name], rel=1e-6)


@pytest.mark.parametrize("peer", PEERS)
def test_what_peers_cannot_do_is_refused(peer):
    with pytest.raises(SceneError, match="must not be 'rigid'"):
        peer(Scene.from_toml(SCENARIOS / "rigid.toml"), 10)
    with pytest.raises(SceneError, match="wall"):
        peer(Scene().replace(**{"effects.rock": "wall"}), 10)


STRING = {
    "effects.string": True, "string.rods": [{"sections": [{"length": 1.0, "area": 8e-4}]}],
}  # fmt: skip
# What goes with a switch, so that it does something.
WITH = {
    "effects.cuttings": {"rock.removed_share": 0.3},
    "effects.drive": {"drive.external_force": 2000.0},
    "effects.breaking": {"hole_diameter": 0.08, "breaking.buttons": 10},
    "effects.rotation": {"rotation.mean_radius": 0.03},
    **dict.fromkeys(("effects.string", "effects.joints", "effects.damper"), STRING),
}
SWITCHES = [
    (row.key, value)
    for row in parameter_table()
    if row.key.startswith("effects.")
    for value in (row.choices or (True, False))
    if value != row.default
]
SEEN = ("piston_velocity", "bit_position", "bit_end_position")


def with_switch(key, value):
    return Scene().replace(**{**WITH.get(key, {}), key: value})


@cache
def seen(peer, key, value):
    """What a peer, or waves, see 1.5 ms after the start; None where the scene is refused."""
    scene = with_switch(key, value)
    try:
        solver = None if peer is None else peer(scene, 10 if peer is ExactFlowSolver else 30)
        simulation = Simulation(scene if solver else scene.computed_by("wave"), solver=solver)
    except SceneError:
        return None
    simulation.advance(1.5e-3)
    found = simulation.observe()
    return np.array([found[name] for name in SEEN])


@pytest.mark.parametrize("peer", [*PEERS, ExplicitSolver])
@pytest.mark.parametrize(("key", "value"), SWITCHES)
def test_a_peer_carries_an_effect_or_refuses_it(peer, key, value):
    """What it carries changes as much as by waves."""
    found = seen(peer, key, value)
    if found is None:
        assert (key, value) not in [("effects.gravity", False), ("effects.feed", False)]
        return
    if key in ("effects.string", "effects.joints", "effects.damper"):
        assert peer is ExplicitSolver  # which test_chain_elements compares
        return
    usual = [seen(one, "effects.gravity", True) for one in (peer, None)]
    change, wanted = found - usual[0], seen(None, key, value) - usual[1]
    if key == "effects.loss":  # fronts stay as steep as each mesh lets them
        assert np.all(change * wanted > 0.0)
    else:  # the barrier takes so little that a sixth of it depends on the mesh
        assert change == pytest.approx(wanted, rel=0.25, abs=1e-12)


@pytest.mark.parametrize("peer", [*PEERS, ExplicitSolver])
def test_a_rock_that_is_curved_chips_or_keeps_cuttings_is_refused_in_one_sentence(peer):
    for law in ({}, {"rock.loading_exponent": 1.0, "rock.chipping_penetration": 1e-4}):
        with pytest.raises(SceneError, match=r"must not be 'power'$"):
            peer(Scene().replace(**{"effects.rock": "power"}, **law), 10)
    with pytest.raises(SceneError, match=r"effects\.cuttings must be false$"):
        peer(with_switch("effects.cuttings", True), 10)


def test_the_exact_flow_refuses_other_inputs():
    simulation = Simulation(Scene(), solver=ExactFlowSolver(Scene(), 5))
    with pytest.raises(SimulationError, match="exact flow: feed_force cannot change"):
        simulation.set_inputs(feed_force=1e3)


def test_a_rate_needs_blows():
    with pytest.raises(SceneError, match="blows after"):
        explicit_rate(Scene(), 5, 0.05, 0.0)
