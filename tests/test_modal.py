"""The modal solver: modes, what bars and ends do, ledger, leaps, and other solvers beside it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from percussion_model import Scene, Simulation, simulate
from percussion_model.physics.records import EventKind
from percussion_model.scene.bars import bar_mass, bar_transit_time
from percussion_model.solvers.modal.bar import carry, ends_after, move_bar
from percussion_model.solvers.modal.modes import end_compliance, free_modes
from percussion_model.solvers.modal.records import STEP, Move, Reply, Shape
from percussion_model.solvers.modal.solver import ModalSolver
from percussion_model.solvers.modal.tables import end_offset, modal_bar

ROOT = Path(__file__).parents[1]
STEEL = 2.1e11, 7850.0
UNIFORM = np.array([[0.2, 5.5e-3, *STEEL]])
STEPPED = np.array([[0.08, 5.5e-3, *STEEL], [0.05, 2.5e-3, *STEEL], [0.11, 4e-3, 1.1e11, 4500.0]])
ETA = 1.94e-7


def modal(scene=None, cells=20, **changes):
    scene = (scene or Scene()).replace(**{"solver.accuracy": None, "solver.cells": None})
    return scene.replace(**{"solver.name": "modal", "solver.cells": cells, **changes})


def advanced(scene, duration):
    run = Simulation(scene, record_events=True)
    run.advance(duration)
    return run


def lumped(sections, count):
    """Frequencies and ends of the elastic modes of many lumped masses, by LAPACK."""
    masses, springs = [], []
    for length, area, modulus, density in sections:
        n = round(count * length / sections[:, 0].sum())
        masses += [density * area * length / n] * n
        springs += [modulus * area * n / length] * n
    masses, springs = np.array(masses), np.array(springs)
    joined = np.concatenate([[masses[0] / 2], (masses[1:] + masses[:-1]) / 2, [masses[-1] / 2]])
    stiff = np.diag(np.append(springs, 0.0) + np.append(0.0, springs))
    stiff -= np.diag(springs, 1) + np.diag(springs, -1)
    root = np.sqrt(joined)
    squares, vectors = np.linalg.eigh(stiff / np.outer(root, root))
    shapes = vectors / root[:, None]
    return np.sqrt(squares[1:]), np.abs(shapes[0, 1:]), np.abs(shapes[-1, 1:])


def test_modes_of_a_uniform_bar_are_cosines():
    found = free_modes(UNIFORM, 12)
    order = np.arange(1, 13)
    np.testing.assert_allclose(found.frequency, order * np.pi / bar_transit_time(UNIFORM), 1e-13)
    end = math.sqrt(2.0 / bar_mass(UNIFORM))
    np.testing.assert_allclose(found.top, end, 1e-12)
    np.testing.assert_allclose(found.low, end * (-1.0) ** order, 1e-11)


def test_modes_of_a_stepped_bar_are_those_of_many_masses():
    found = free_modes(STEPPED, 6)
    frequency, top, low = lumped(STEPPED, 1200)
    np.testing.assert_allclose(found.frequency, frequency[:6], 3e-5)
    np.testing.assert_allclose(found.top, top[:6], 1e-3)
    np.testing.assert_allclose(np.abs(found.low), low[:6], 1e-3)


def test_no_mode_is_left_out():
    """Where impedances differ by thousands too."""
    extreme = np.array([[0.1, 1e-2, *STEEL], [0.003, 2e-6, *STEEL], [0.15, 1e-2, *STEEL]])
    found = free_modes(extreme, 60).frequency
    assert np.all(np.diff(found) > 0)
    np.testing.assert_allclose(found[:8], lumped(extreme, 2500)[0][:8], 2e-3)


@pytest.mark.parametrize("sections", [UNIFORM, STEPPED, STEPPED[::-1]])
def test_an_end_yields_as_all_modes_together(sections):
    """To a lasting force by the static closed form, to a short one by that of a long bar."""
    found = free_modes(sections, 4000)
    by_modes = np.sum(found.low**2 / found.frequency**2)
    # what is beyond falls with the number of modes
    assert by_modes == pytest.approx(end_compliance(sections), rel=1e-3)
    h = 1e-6
    delta = 0.5 * ETA * found.frequency**2
    slow = np.exp(-delta * h + 0j)
    root = np.sqrt(found.frequency**2 - delta**2 + 0j)
    with np.errstate(all="ignore"):
        decay = slow * (np.cos(root * h) + delta * np.sin(root * h) / root)
    decay = np.where(delta * h > 300.0, np.exp(-h / ETA), decay.real)
    offset = 0.5 * h * h / bar_mass(sections)
    offset += np.sum(found.low**2 / found.frequency**2 * (1.0 - decay))
    area, modulus, density = sections[-1, 1:]
    impedance = area * math.sqrt(modulus * density)
    assert offset == pytest.approx(end_offset(impedance, ETA, h), rel=3e-3)


def test_what_a_bar_loses_is_what_its_energy_lacks():
    """The loss is integrated, the energy is not; over any time and under forces."""
    bar = modal_bar(STEPPED, 1.6e6, ETA, 2.6e-8)
    n = bar.shape.shape[1]
    generator = np.random.default_rng(3)
    w = generator.standard_normal((2, n))
    w[0] /= np.sqrt(bar.shape[Shape.STIFF])

    def energy():
        return 0.5 * float(w[1] @ w[1] + bar.shape[Shape.STIFF] @ (w[0] * w[0]))

    before = energy()
    lost = carry(w, bar, n, 12345)
    assert lost == pytest.approx(before - energy(), rel=1e-12)
    for level in (0, STEP):
        before, place = energy(), bar.shape[Shape.LOW] @ w[0]
        high = bar.shape[Shape.TOP] @ w[0]
        lost = move_bar(w, bar, n, level, 3e4, -2e4)
        work = 3e4 * (bar.shape[Shape.TOP] @ w[0] - high)
        work -= 2e4 * (bar.shape[Shape.LOW] @ w[0] - place)
        assert lost == pytest.approx(before + work - energy(), rel=1e-9)


def test_a_free_move_is_what_the_ends_are_said_to_do():
    bar = modal_bar(STEPPED, 1.6e6, ETA, 2.6e-8)
    n = bar.shape.shape[1]
    w = np.random.default_rng(4).standard_normal((2, n))
    told = ends_after(w, bar, n, STEP)
    move_bar(w, bar, n, STEP, 0.0, 0.0)
    seen = bar.shape[Shape.TOP] @ w[0], bar.shape[Shape.LOW] @ w[0], bar.shape[Shape.LOW] @ w[1]
    np.testing.assert_allclose(told, seen, rtol=1e-12)


def test_tables_do_not_depend_on_the_number_of_modes_where_they_should_not():
    """A force moves an end as far, however few modes there are."""
    few, many = (modal_bar(UNIFORM, highest, ETA, 2.6e-8) for highest in (8e5, 3e6))
    np.testing.assert_allclose(few.reply[..., Reply.LOW][0], many.reply[..., Reply.LOW][0], 1e-12)
    assert np.all(few.move[:, Move.LOSS_VV] >= 0.0)


REFERENCE = 16.3494e-3  # m/s, +- 0.0003e-3: limit of waves and of explicit elements


@pytest.mark.parametrize(("cells", "off"), [(20, 5e-4), (30, 2e-4), (40, 1e-4)])
def test_the_reference_keeps_its_rate(cells, off):
    result = simulate(modal(cells=cells), error_estimate=False)
    assert result.rate_of_penetration == pytest.approx(REFERENCE, rel=off)
    assert abs(result.energy["residual_relative"]) < 1e-12
    assert 0.0 <= result.energy["numerical_relative"] < 1e-8


# Scenes whose rate waves and elements agree on, and their limit (docs/accuracy) [m/s].
DRAWN = {"drawn_1": 47.0346e-3, "drawn_3": 95.35e-3, "drawn_4": 51.0672e-3}


@pytest.mark.parametrize("name", list(DRAWN))
def test_lengths_that_fit_no_cells_are_as_good(name):
    scene = Scene.from_toml(ROOT / "scenarios" / "drawn" / f"{name}.toml")
    result = simulate(modal(scene))
    assert result.rate_of_penetration == pytest.approx(DRAWN[name], rel=1.5e-3)
    off = abs(result.rate_of_penetration / DRAWN[name] - 1.0)
    assert off < result.rate_of_penetration_relative_error < 1e-2


def test_grids_that_agree_by_luck_do_not_make_an_error_small():
    """Fewer modes have the same rate there, but for a millionth; it is off by 0.03 %."""
    scene = Scene.from_toml(ROOT / "scenarios" / "top_hammer.toml")
    result = simulate(modal(scene, **{"run.duration": 1.5}))
    off = abs(result.rate_of_penetration / 82.2353e-3 - 1.0)
    assert 1e-4 < off < result.rate_of_penetration_relative_error


SCENES = {
    "reference": {},
    "stiff rock": {"rock.loading_stiffness": 1.8e9, "rock.unloading_ratio": 80.0},
    "rigid piston": {"piston.model": "rigid"},
    "weak feed": {"feed.force": 600.0},
    "soft, strong feed": {"rock.loading_stiffness": 1.5e8, "feed.force": 15e3},
    "no barrier": {"effects.barrier": False, "rock.unloading_ratio": 3.0},
    "external drive": {"effects.drive": "external", "drive.external_force": 900.0},
    "spring": {"effects.rock": "spring", "effects.barrier": False},
    "wall": {"effects.rock": "wall", "effects.barrier": False},
    "stepped": {"piston.sections.0.length": 0.1931, "bit.sections.0.length": 0.2917},
}


@pytest.mark.parametrize("name", list(SCENES))
def test_the_ledger_is_closed(name):
    run = advanced(modal(**SCENES[name]), 0.12)
    energy = run.energy()
    assert abs(energy["residual_relative"]) < 1e-11, energy
    assert -1e-12 < energy["numerical_relative"] < 1e-6
    assert len(run.events) > 10


@pytest.mark.parametrize("name", ["reference", "stiff rock", "weak feed", "stepped"])
def test_leaps_change_nothing_but_the_time_that_it_takes(name):
    """First blows: when modes are left out differs, and bounces amplify it."""
    scene = modal(**SCENES[name])
    leaping, stepping = (
        advanced(one, 0.05) for one in (scene, scene.replace(**{"solver.leaps": False}))
    )
    assert leaping.statistics()["steps"] < 0.3 * stepping.statistics()["steps"]
    first, second = (run.events[run.events["time"] < 4e-3] for run in (leaping, stepping))
    assert first["kind"].tolist() == second["kind"].tolist()
    np.testing.assert_allclose(first["time"], second["time"], atol=1e-7)


def test_observing_changes_nothing():
    """Numbers read on the way leave the run as it is, to the bit."""
    quiet, seen = (Simulation(modal(), record_events=True) for _ in range(2))
    for time in np.linspace(1e-4, 0.1, 500):
        seen.advance(float(time))
        seen.sample([float(time)])
    quiet.advance(0.1)
    assert quiet.events.tobytes() == seen.events.tobytes()
    assert quiet.blows.tobytes() == seen.blows.tobytes()


def test_a_bit_that_stands_does_not_creep():
    scene = modal(**{
        "piston.model": "absent", "effects.drive": "none", "start.bit_velocity": 0.0,
        "start.rock_gap": 0.0, "feed.force": 2000.0, "run.duration": 10.0,
    })  # fmt: skip
    run = Simulation(scene)
    places = run.sample(np.array([1.0, 9.0]))["bit_end_position"]
    assert abs(places[1] - places[0]) < 1e-13


def test_a_saved_state_goes_on_as_it_was():
    run = advanced(modal(), 0.06)
    saved = run.save()
    run.advance(0.1)
    again = Simulation(modal(), record_events=True)
    again.restore(saved)
    again.advance(0.1)
    assert run.blows["time"][-1] == again.blows["time"][-1]
    assert run.sample([0.1])["bit_position"] == again.sample([0.1])["bit_position"]


@pytest.mark.parametrize(
    ("field", "value"), [("set", 7), ("leap_end", 2**40), ("piston_time", 2**50), ("mode", 9)]
)
def test_a_state_out_of_bounds_is_refused(field, value):
    solver = ModalSolver(modal())
    state = solver.new_state()
    assert solver.state_fault(state, 0.0) == ""
    state.record[0]["parked"] = 1
    state.record[0][field] = value
    assert field in solver.state_fault(state, 0.0)


def test_energy_is_never_made_in_drawn_bars():
    """Geometry, rock and start by seed; what is lost beside the physics is no gain."""
    generator = np.random.default_rng(18)
    for _ in range(12):
        length = generator.uniform(0.15, 0.35)
        scene = modal(cells=int(generator.integers(6, 30)), **{
            "piston.sections.0.length": length,
            "bit.sections.0.length": length * generator.uniform(0.7, 2.5),
            "bit.sections.0.area": generator.uniform(2e-3, 8e-3),
            "rock.loading_stiffness": math.exp(generator.uniform(math.log(1e8), math.log(2e9))),
            "rock.unloading_ratio": generator.uniform(2.0, 40.0),
            "feed.force": generator.uniform(500.0, 20e3),
        })  # fmt: skip
        energy = advanced(scene, 0.1).energy()
        assert energy["numerical_relative"] > -1e-12
        assert energy["overshoot_relative"] > -1e-12
        assert energy["loss"] > 0.0
        assert abs(energy["residual_relative"]) < 1e-11


def test_forces_along_the_bars_are_those_at_their_ends():
    """While the bit stands the force grows from none at the top to the rock's at the end."""
    scene = modal(**{
        "piston.model": "absent", "effects.drive": "none", "start.bit_velocity": 0.0,
        "start.rock_gap": 0.0, "feed.force": 2000.0,
    })  # fmt: skip
    run = Simulation(scene)
    run.advance(3.0)
    force = run.fields()["bit_force"]
    rock = run.sample([3.0])["bit_force"][0]
    n = len(force)
    np.testing.assert_allclose(force, rock * (np.arange(n) + 0.5) / n, rtol=1e-6)


def test_stress_agrees_with_that_of_waves():
    """In the middle of the bit, through the first blow."""
    at = np.linspace(2e-5, 2e-4, 60)
    seen = []
    for scene in (modal(cells=40), Scene().replace(**{"solver.cells": 80})):
        run, rows = Simulation(scene), []
        for time in at:
            run.advance(float(time))
            force = run.fields()["bit_force"]
            rows.append(np.interp(0.5, (np.arange(len(force)) + 0.5) / len(force), force))
        seen.append(np.array(rows))
    assert np.mean(np.abs(seen[0] - seen[1])) < 0.02 * np.mean(np.abs(seen[1]))


def test_drives_turn_and_blows_come_when_they_do_with_waves():
    ours, waves = (
        advanced(one, 0.3) for one in (modal(cells=40), Scene().replace(**{"solver.cells": 40}))
    )
    for kind in (EventKind.DRIVE_UP, EventKind.DRIVE_DOWN):
        times = [run.events["time"][run.events["kind"] == kind] for run in (ours, waves)]
        np.testing.assert_allclose(times[0], times[1], rtol=1e-3, atol=1e-7)
    np.testing.assert_allclose(
        ours.blows["peak_bit_force"], waves.blows["peak_bit_force"], rtol=3e-3
    )


def test_the_reference_is_periodic():
    """Events are found so closely that blows repeat to a millionth."""
    blows = advanced(modal(), 3.0).blows[20:]
    for name in ("impact_velocity", "hole_advance", "period"):
        assert np.std(blows[name]) < 3e-6 * np.mean(blows[name]), name
