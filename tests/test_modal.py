"""The modal solver: modes, what bars and ends do, ledger, leaps, and other solvers beside it."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest

from percussion_model import Scene, Simulation, simulate
from percussion_model.engine.solvers import ModalSolver
from percussion_model.physics.kernel import kernel
from percussion_model.physics.records import EventKind
from percussion_model.scene.bars import bar_mass, bar_transit_time
from percussion_model.simulation.gauge import gauge_stress
from percussion_model.solvers.modal.bars import carry, try_move
from percussion_model.solvers.modal.ends import falls_below, least_at, parabola
from percussion_model.solvers.modal.laws import MOST_PAIRS
from percussion_model.solvers.modal.modes import (
    bar_modes,
    enough_nodes,
    products,
    quadrature,
    shape_above,
    shape_low,
    totals,
    with_residual,
)
from percussion_model.solvers.modal.records import STEP, Shape
from tests.engine_views import Tables

LONG = os.environ.get("PERCUSSION_LONG") == "1"
ROOT = Path(__file__).parents[1]
STEEL = 2.1e11, 7850.0
UNIFORM = np.array([[0.2, 5.5e-3, *STEEL]])
STEPPED = np.array([[0.08, 5.5e-3, *STEEL], [0.05, 2.5e-3, *STEEL], [0.11, 4e-3, 1.1e11, 4500.0]])


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
    found = bar_modes(UNIFORM, 13)
    order = np.arange(13)
    np.testing.assert_allclose(found.frequency, order * np.pi / bar_transit_time(UNIFORM), 1e-13)
    end = math.sqrt(2.0 / bar_mass(UNIFORM))
    np.testing.assert_allclose(shape_above(found, 0)[1:], end, 1e-12)
    np.testing.assert_allclose(shape_low(found)[1:], end * (-1.0) ** order[1:], 1e-11)


def test_modes_of_a_stepped_bar_are_those_of_many_masses():
    found = bar_modes(STEPPED, 7)
    frequency, top, low = lumped(STEPPED, 1200)
    np.testing.assert_allclose(found.frequency[1:], frequency[:6], 3e-5)
    np.testing.assert_allclose(shape_above(found, 0)[1:], top[:6], 1e-3)
    np.testing.assert_allclose(np.abs(shape_low(found))[1:], low[:6], 1e-3)


def test_no_mode_is_left_out():
    """Where impedances differ by thousands too."""
    extreme = np.array([[0.1, 1e-2, *STEEL], [0.003, 2e-6, *STEEL], [0.15, 1e-2, *STEEL]])
    found = bar_modes(extreme, 61).frequency
    assert np.all(np.diff(found) > 0)
    np.testing.assert_allclose(found[1:9], lumped(extreme, 2500)[0][:8], 2e-3)


@pytest.mark.parametrize("spring", [1e6, 7.5e8, 1e11])
def test_modes_on_a_spring_meet_its_law(spring):
    """w tan(w T) = K / Z of a uniform bar."""
    found, transit = bar_modes(UNIFORM, 20, spring), bar_transit_time(UNIFORM)
    impedance = bar_mass(UNIFORM) / transit
    off = found.frequency * np.sin(found.frequency * transit)
    off -= spring / impedance * np.cos(found.frequency * transit)
    assert np.all(np.abs(off) < 1e-11 * (found.frequency + spring / impedance))


@pytest.mark.parametrize("sections", [UNIFORM, STEPPED, STEPPED[::-1]])
@pytest.mark.parametrize(("spring", "mass"), [(0.0, 0.0), (2e9, 0.0), (2e9, 7.5), (0.0, 7.5)])
def test_modes_are_orthogonal_by_mass(sections, spring, mass):
    found = bar_modes(sections, 24, spring, mass)
    np.testing.assert_allclose(products(found, 0, found, 0, len(sections)), np.eye(24), atol=1e-11)


@pytest.mark.parametrize("count", [4, 61, 400])
def test_a_quadrature_is_exact_for_polynomials(count):
    nodes, weights = quadrature(count)
    for power in (0, 2, 6, 2 * count - 2):
        assert weights @ nodes**power == pytest.approx(2.0 / (power + 1.0), rel=1e-12)
    np.testing.assert_allclose(nodes, -nodes[::-1], rtol=0.0, atol=1e-15)


def test_modes_on_a_spring_yield_as_the_spring_does():
    """A constant force at the end of a bar moves it by F / K, whatever the bar."""
    found = bar_modes(STEPPED, 4000, 5e8)
    assert np.sum(shape_low(found) ** 2 / found.frequency**2) == pytest.approx(1.0 / 5e8, rel=1e-3)
    # and no further under its weight than its mass asks for
    whole = totals(found, 0, len(STEPPED))
    sag = np.sum(shape_low(found) * whole / found.frequency**2)
    assert sag == pytest.approx(bar_mass(STEPPED) / 5e8, rel=1e-9)


@pytest.mark.parametrize(("spring", "mass"), [(5e7, 0.0), (7.5e8, 7.5), (1e10, 0.0)])
def test_the_last_shape_yields_what_left_out_modes_would(spring, mass):
    """A force at the end moves 24 modes as far as the whole bar, and the shape is their like."""
    plain = bar_modes(STEPPED, 24, spring, mass)
    found = with_residual(plain, spring, *quadrature(enough_nodes(24)))
    assert np.sum(shape_low(found) ** 2 / found.frequency**2) == pytest.approx(
        1.0 / spring, rel=1e-12
    )
    assert np.sum(shape_low(plain) ** 2 / plain.frequency**2) < (1.0 - 1e-4) / spring
    np.testing.assert_allclose(products(found, 0, found, 0, len(STEPPED)), np.eye(24), atol=2e-6)
    np.testing.assert_array_equal(found.frequency[:-1], plain.frequency[:-1])
    assert found.frequency[-2] < found.frequency[-1] < 2.5 * found.frequency[-2]
    # as a whole: also under the loads, by the same far end as near end
    whole = totals(found, 0, len(STEPPED)) + mass * shape_above(found, 0)
    sag = shape_above(found, 0) * whole / found.frequency**2
    assert np.sum(shape_above(found, 0) * shape_low(found) / found.frequency**2) == pytest.approx(
        1.0 / spring
    )
    assert np.sum(sag) > (bar_mass(STEPPED) + mass) / spring


def test_what_falls_below_zero_between_two_looks_is_found():
    """(x - 0.4)^2 less 0.01, which is above zero at both, and 0.01 more than it."""
    assert falls_below(0.16 - 0.01, -0.8, 0.36 - 0.01, 1.2) == pytest.approx(0.35, abs=0.05)
    assert falls_below(0.16 + 0.01, -0.8, 0.36 + 0.01, 1.2) == 0.0
    assert least_at(parabola(-0.8, 1.2, 0.2)) == pytest.approx(0.4)


def made(cells=20, **changes):
    return Tables(ModalSolver(modal(cells=cells, **changes)))


def test_what_a_bar_loses_is_what_its_energy_lacks():
    """The loss is integrated, the energy is not; over any time and under forces."""
    forms = made().forms
    shape, move = forms.shape[1], forms.move[1]
    n = int(forms.sizes[1])
    w, rows = np.zeros((3, forms.shape.shape[2])), np.zeros((2, forms.shape.shape[2]))
    w[:2, :n] = np.random.default_rng(3).standard_normal((2, n))
    w[0, :n] /= np.sqrt(shape[Shape.STIFF, :n])

    def energy(w):
        return 0.5 * float(w[1] @ w[1] + shape[Shape.STIFF] @ (w[0] * w[0]))

    before = energy(w)
    assert carry(w, move, 0, n, 12345) == pytest.approx(before - energy(w), rel=1e-12)
    w[2, :n] = 900.0 * shape[Shape.BIT, :n]
    for level in (0, STEP):
        ends = moved(w, rows, shape, move[level], n, 3e4)
        work = w[2] @ (rows[0] - w[0]) - 3e4 * (shape[Shape.LOW] @ (rows[0] - w[0]))
        assert ends[0] == pytest.approx(energy(w) + work - energy(rows), rel=1e-9)
        assert ends[1] == pytest.approx(shape[Shape.LOW] @ rows[0], rel=1e-12)
        assert ends[4] == pytest.approx(shape[Shape.BIT] @ rows[0], rel=1e-12)
        w[:2] = rows


@kernel
def moved(w, rows, shape, m, n, force):
    ends = try_move(w, rows, shape, m, n, force, 1.94e-7, True)
    return (ends.lost, ends.low, ends.speed, ends.top, ends.bit)


def test_what_moves_as_one_stays_as_it_is_when_joined():
    tables = made()
    one, n = tables.forms.change[0, 0, 0], int(tables.forms.sizes[3])
    piston = tables.forms.shape[3, Shape.PISTON, :n]
    # bit and piston of the same velocity
    bit = math.sqrt(bar_mass(np.array([[0.20125, 5.5e-3, *STEEL]])))
    velocities = one[:n] * bit + piston
    whole = math.sqrt(bit**2 + bar_mass(np.array([[0.175, 5.5e-3, *STEEL]])))
    np.testing.assert_allclose(velocities, np.eye(n)[0] * whole, atol=1e-10)


def test_a_blow_is_right_with_few_modes():
    """What the bit has after a blow by a piston of another length, on nothing."""
    changes = {
        "effects.drive": "none", "effects.rock": "none", "effects.barrier": False,
        "effects.gravity": False, "effects.feed": False, "start.piston_velocity": 9.0,
    }  # fmt: skip
    speeds = []
    for cells in (20, 40, 80):
        run = advanced(modal(cells=cells, **changes), 1e-3)
        assert run.events["kind"][:2].tolist() == [
            EventKind.CONTACT_CLOSED,
            EventKind.CONTACT_OPENED,
        ]
        speeds.append(float(run.sample([1e-3])["bit_velocity"][0]))
    assert speeds[0] == pytest.approx(speeds[2], rel=2e-5)
    assert speeds[1] == pytest.approx(speeds[2], rel=1e-6)


def test_equal_bars_pass_on_what_loss_leaves():
    """All of the velocity but for what disperses, as with waves in fine cells."""
    changes = {
        "effects.drive": "none", "effects.rock": "none", "effects.barrier": False,
        "effects.gravity": False, "effects.feed": False, "start.piston_velocity": 9.0,
        "bit.sections.0.length": 0.175,
    }  # fmt: skip
    ours = advanced(modal(**changes), 1e-3).sample([1e-3])
    scene = Scene().computed_by("wave", **changes, **{"solver.cells": 160})
    waves = advanced(scene, 1e-3).sample([1e-3])
    assert ours["bit_velocity"][0] == pytest.approx(waves["bit_velocity"][0], rel=1e-4)
    momentum = ours["bit_velocity"][0] + ours["piston_velocity"][0]
    assert momentum == pytest.approx(9.0, rel=1e-9)


REFERENCE = 16.3505e-3  # m/s, +- 0.0004e-3: limit of three solvers (docs/modal.md, section 8)


@pytest.mark.parametrize(("cells", "off"), [(20, 1.2e-4), (30, 1e-4), (40, 6e-5), (80, 3e-5)])
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
    """Fewer modes have the same rate there, but for millionths, and others are not that close."""
    scene = Scene.from_toml(ROOT / "scenarios" / "top_hammer.toml")
    result = simulate(modal(scene, **{"run.duration": 1.5}))
    # explicit elements of 100, 200, 300: 82.23356, 82.23436, 82.23438 mm/s
    off = abs(result.rate_of_penetration / 82.2344e-3 - 1.0)
    assert off < 1e-4 < result.rate_of_penetration_relative_error


@pytest.mark.parametrize(
    "modes", [80, pytest.param(112, marks=pytest.mark.skipif(not LONG, reason="12 s"))]
)
def test_a_bit_of_too_many_modes_for_pairs_drills_as_well(modes):
    """Stepped, with modes that have died left out: what goes must not show."""
    scene = Scene.from_toml(ROOT / "scenarios" / "top_hammer.toml")
    scene = modal(scene, modes, **{"run.duration": 1.5})
    run = simulate(scene, error_estimate=False, record_events=False)
    assert run.cells["bit"] > MOST_PAIRS
    # explicit elements of 200 and 300, as above; with fewer modes 82.2350, 82.2348 (40, 56)
    assert run.rate_of_penetration == pytest.approx(82.2344e-3, rel=1e-5)


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
    assert leaping.statistics()["leaps"] > 0 == stepping.statistics()["leaps"]
    # steps are looks, of which bars need few without leaps too
    assert leaping.statistics()["steps"] < stepping.statistics()["steps"]
    assert leaping.statistics()["steps"] < 0.15 * 0.05 / leaping.solver.time_step
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
    ("field", "value"),
    [
        ("active", 7),
        ("form", 4),
        ("leap_end", 2**40),
        ("piston_time", 2**50),
        ("mode", 9),
        ("law", 5),
        ("law", 12),
        ("pairs", 7),
        ("stride", 1000),
    ],
)
def test_a_state_out_of_bounds_is_refused(field, value):
    solver = ModalSolver(modal())
    state = solver.new_state()
    assert solver.state_fault(state, 0.0) == ""
    state.record[0]["parked"] = 1
    state.record[0][field] = value
    assert field in solver.state_fault(state, 0.0)


def sections(generator, length):
    """One to three sections, at times of another material."""
    parts = generator.dirichlet(np.full(int(generator.integers(1, 4)), 4.0))
    return [
        {
            "length": length * float(part),
            "area": generator.uniform(2e-3, 8e-3),
            "youngs_modulus": generator.choice([210e9, 210e9, 70e9, 600e9]),
            "density": generator.choice([7850.0, 7850.0, 2700.0, 14500.0]),
        }
        for part in parts
    ]


def test_energy_is_never_made_in_drawn_bars():
    """Geometry, rock and start by seed; what is lost beside the physics is no gain."""
    generator = np.random.default_rng(18)
    for _ in range(2000 if LONG else 25):
        length = generator.uniform(0.15, 0.35)
        scene = modal(cells=int(generator.integers(6, 30)), **{
            "piston.sections": sections(generator, length),
            "bit.sections": sections(generator, length * generator.uniform(0.7, 2.5)),
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
    """In the middle of the bit, through the first blow, but for what finer grids still change."""
    at = np.linspace(2e-5, 2e-4, 200)

    def stress(scene):
        return gauge_stress(Simulation(scene, record_events=False), at)

    waves = [stress(Scene().computed_by("wave", **{"solver.cells": n})) for n in (80, 160)]
    modes = [stress(modal(cells=n)) for n in (40, 80)]
    whole = np.sum(np.abs(waves[1]))
    left = sum(np.sum(np.abs(fine - coarse)) for coarse, fine in (waves, modes)) / whole
    assert left < 2e-3
    assert np.sum(np.abs(waves[1] - modes[1])) / whole < left


def test_drives_turn_and_blows_come_when_they_do_with_waves():
    scene = Scene().computed_by("wave", **{"solver.cells": 40})
    ours, waves = (advanced(one, 0.3) for one in (modal(cells=40), scene))
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


def test_the_peak_of_the_contact_force_does_not_rise_with_the_modes():
    """A bar with loss resists the first instants without bound; 963.70 +- 0.11 kN by waves."""
    peaks = []
    for modes in (40, 96):
        scene = Scene().computed_by("modal", **{"solver.cells": modes})
        result = simulate(scene, 0.5, settle=0.2, record_events=False, error_estimate=False)
        peaks.append(result.summary()["peak_contact_force"])
    assert peaks == pytest.approx([963.6e3, 963.6e3], abs=0.3e3)


def test_a_rigid_piston_pushes_hardest_at_once():
    """1841 kN by waves of 20, 80 and 160 cells: the speed times the impedance of the bit."""
    for modes in (20, 80):
        changes = {"solver.cells": modes, "piston.model": "rigid"}
        result = simulate(
            Scene().computed_by("modal", **changes), 0.5, settle=0.2, record_events=False,
            error_estimate=False,
        )  # fmt: skip
        assert result.summary()["peak_contact_force"] == pytest.approx(1.8413e6, rel=0.02)


def test_no_drilling_cycle_is_missed_where_the_bit_just_touches():
    """Four cycles a blow by waves; a search by wider looks found 3.3 with 40 modes."""
    changes = {"rock.barrier_damping": 4e5, "rock.barrier_energy": 0.5, "solver.cells": 40}
    result = simulate(Scene().computed_by("modal", **changes), error_estimate=False)
    assert result.summary()["drilling_cycles_per_blow"] == 4.0
