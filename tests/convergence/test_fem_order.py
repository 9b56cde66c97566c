"""Measured orders of the finite elements: in time, over events, and of the mesh."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh, expm

from percussion_model import Mode, Scene, Simulation
from percussion_model.engine.solvers import FemSolver
from percussion_model.physics.ledger import energies
from percussion_model.physics.records import BLOW, EVENT, READING
from percussion_model.solvers.fem.records import Node
from tests.engine_views import refresh_nodes

# The bit alone on a linear spring, with weight, feed and loss.
BIT = {
    "solver.name": "fem",
    "piston.model": "absent",
    "effects.drive": "none",
    "effects.barrier": False,
    "start.rock_gap": 0.0,
}
SPRING = {**BIT, "effects.rock": "spring", "rock.loading_stiffness": 2e9}

# For the rows of a blow, and none of events.
ROOM = np.zeros(1, BLOW), np.zeros(1, EVENT), False


def order(steps, errors):
    """Slope of error against step, both logarithmic."""
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


def dense(scene, n):
    """Mass and stiffness of the bit with the spring, and its forces, assembled anew."""
    section = scene.bit.sections[0]
    length = section.length / n
    mass, stiffness = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    for i in range(n):
        ij = np.ix_([i, i + 1], [i, i + 1])
        mass[ij] += section.density * section.area * length / 6 * np.array([[2, 1], [1, 2]])
        stiffness[ij] += (
            section.youngs_modulus * section.area / length * np.array([[1, -1], [-1, 1]])
        )
    force = mass @ np.full(n + 1, scene.gravity.acceleration + scene.feed.force / scene.bit.mass)
    return mass, stiffness, force


def exact(scene, n, u, v, t):
    """State of the semi-discrete spring problem at `t`, by the matrix exponential."""
    mass, bars, force = dense(scene, n)
    stiffness = bars.copy()
    stiffness[-1, -1] += scene.rock.loading_stiffness
    system = np.zeros((2 * n + 3, 2 * n + 3))
    system[: n + 1, n + 1 : -1] = np.eye(n + 1)
    system[n + 1 : -1, : n + 1] = -np.linalg.solve(mass, stiffness)
    system[n + 1 : -1, n + 1 : -1] = -scene.loss.time * np.linalg.solve(mass, bars)
    system[n + 1 : -1, -1] = np.linalg.solve(mass, force)
    end = expm(system * t) @ np.concatenate([u, v, [1.0]])
    return end[: n + 1], end[n + 1 : -1]


@pytest.mark.parametrize(("radius", "declared"), [(0.0, 3.0), (0.3, 3.0), (0.7, 3.0), (1.0, 4.0)])
def test_order_in_time_with_damping_and_forcing(radius, declared):
    n, t = 6, 4e-5
    base = Scene().replace(**SPRING, **{"fem.elements": n, "fem.spectral_radius": radius})
    x = np.linspace(0.0, 1.0, n + 1)
    u = 1e-3 + 1e-4 * np.cos(np.pi * x)
    v = 1.0 - 2.0 * np.cos(2.0 * np.pi * x)
    u_end, v_end = exact(base, n, u, v, t)
    counts, errors = np.array([36, 54, 81, 122]), []
    transit = base.bit.transit_time / n
    for count in counts:
        scene = base.replace(**{"fem.courant": t / count / transit})
        solver = FemSolver(scene)
        state = solver.new_state()
        state.record[0]["mode"] = Mode.FC
        nodes = state.arrays[0]
        nodes[Node.U], nodes[Node.V] = u, v
        refresh_nodes(solver, state)
        solver.commit(state, t, *ROOM)
        assert solver.statistics(state)["steps"] == count
        off = np.concatenate([(nodes[Node.U] - u_end) / 1e-4, (nodes[Node.V] - v_end) / 2.0])
        errors.append(np.abs(off).max())
    assert order(1.0 / counts, errors) == pytest.approx(declared, abs=0.2)
    assert errors[-1] < 1e-3


# Falls on the bilinear rock: FF, DFC, FC, BC and FF again, four events.
DROP = {
    "solver.name": "fem",
    "piston.model": "absent",
    "effects.drive": "none",
    "start.bit_velocity": 5.25,
    "start.rock_gap": 1e-5,
    "fem.elements": 3,
    "loss.time": 2e-6,
}
DROP_END = 4.5e-4


def drop(courant, **changes):
    """Velocities and positions of the bit after the four events."""
    scene = Scene().replace(**DROP, **{"fem.courant": courant}, **changes)
    simulation = Simulation(scene)
    simulation.advance(DROP_END)
    kinds = [Mode(int(kind)).name for kind in simulation.events["kind"]]
    assert kinds == ["DFC", "FC", "BC", "FF"]
    seen = simulation.observe()
    return np.array([seen["bit_velocity"], seen["bit_end_velocity"], seen["bit_position"] / 1e-4])


def test_order_over_four_events():
    tight = {"fem.event_tolerance": 1e-12, "fem.time_tolerance": 1e-12}
    best = drop(0.005, **tight)
    steps = np.array([0.4, 0.28, 0.2, 0.14, 0.1])
    errors = [np.abs(drop(step, **tight) - best).max() for step in steps]
    assert order(steps, errors) > 2.8
    # where events lie at the ends of steps, the first order is left
    loose = {"fem.event_tolerance": 1.0, "fem.time_tolerance": 1.0}
    at_ends = [np.abs(drop(step, **loose) - best).max() for step in steps]
    assert order(steps, at_ends) < 1.6
    assert at_ends[-1] > 100.0 * errors[-1]


def test_default_tolerances_cost_no_accuracy():
    best = drop(0.02, **{"fem.event_tolerance": 1e-12, "fem.time_tolerance": 1e-12})
    assert np.abs(drop(0.02) - best).max() < 1e-6


def test_order_of_the_mesh():
    """A damped free vibration in its third mode, against its closed form."""
    base = Scene().replace(
        **BIT, **{"effects.rock": "none", "effects.gravity": False, "effects.feed": False}
    )
    section = base.bit.sections[0]
    wave = 3.0 * np.pi / section.length
    omega = wave * section.wave_speed
    rate = 0.5 * base.loss.time * omega * omega
    swing = np.sqrt(omega * omega - rate * rate)
    t = 2.2 * base.bit.transit_time
    counts, errors = np.array([20, 30, 45, 68]), []
    for n in counts:
        solver = FemSolver(base.replace(**{"fem.elements": int(n), "fem.courant": 0.1}))
        state = solver.new_state()
        nodes = state.arrays[0]
        shape = np.cos(wave * np.linspace(0.0, section.length, n + 1))
        nodes[Node.V] = shape
        refresh_nodes(solver, state)
        solver.commit(state, t, *ROOM)
        fade = np.exp(-rate * t)
        closed = fade * (np.cos(swing * t) - rate / swing * np.sin(swing * t)) * shape
        errors.append(np.abs(nodes[Node.V] - closed).max())
    assert order(1.0 / counts, errors) == pytest.approx(2.0, abs=0.1)


def test_highest_mode_of_the_mesh_is_damped_by_zeta():
    scene = Scene().replace(
        **BIT, **{"fem.elements": 20, "fem.damping_ratio": 0.3, "effects.rock": "none"}
    )
    mass, stiffness, _ = dense(scene, 20)
    highest = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[-1])
    assert 0.5 * FemSolver(scene).loss_time * highest == pytest.approx(0.3, rel=1e-9)


@pytest.mark.parametrize("radius", [0.0, 0.5, 1.0])
def test_stable_at_fifty_times_the_cfl_step(radius):
    """The energy of the lossless bars on a spring never grows; at radius 1 it stays."""
    scene = Scene().replace(
        **SPRING,
        **{"effects.loss": False, "fem.courant": 50.0, "fem.spectral_radius": radius},
        **{"effects.gravity": False, "effects.feed": False, "fem.elements": 50},
    )
    solver = FemSolver(scene)
    state = solver.new_state()
    state.record[0]["mode"] = Mode.FC
    nodes = state.arrays[0]
    nodes[Node.U] = 1e-2  # pressed in for good
    nodes[Node.V] = np.random.default_rng(1).uniform(-1.0, 1.0, nodes.shape[1])
    refresh_nodes(solver, state)
    stored, reading = [], np.zeros(1, READING)
    for k in range(400):
        solver.commit(state, (k + 1) * solver.time_step, *ROOM)
        solver.read(state, (k + 1) * solver.time_step, reading)
        ledger = energies(reading)
        stored.append(sum(ledger[name] for name in ("kinetic", "elastic", "recoverable")))
    growth = np.diff(stored) / stored[0]
    assert growth.max() < 1e-12
    if radius == 1.0:
        assert stored[-1] == pytest.approx(stored[0], rel=1e-9)
