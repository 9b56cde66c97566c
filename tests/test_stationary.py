"""The stationary response: cycles made by hand, and scenes against long runs."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from percussion_model import Scene, SceneError, settled, simulate
from percussion_model.analysis.stationary import (
    FEWEST_SCATTERED,
    JUDGED,
    MEANS,
    MOST_BLOWS,
    NEXT_CHECK,
    rate_so_far,
)
from percussion_model.engine.solver import EngineSolver
from percussion_model.interface.cli import app
from percussion_model.interface.terminal import show_settled
from percussion_model.physics import settling
from percussion_model.physics.records import BLOW
from percussion_model.physics.settling import COMPARED
from percussion_model.scene.hammers import with_chambers
from percussion_model.simulation.rate import rate_of_blows
from percussion_model.solvers.base import Solver, make_solver

SCENARIOS = Path(__file__).parents[1] / "scenarios"
TOLERANCE = 1e-4
WAVES = {"solver.name": "wave"}
RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
# Drive force that keeps the power of the reference at another reversal distance.
REFERENCE_FORCE, REFERENCE_DISTANCE = 3000.0, 0.040


def blows(velocity):
    """Blows of which one follows from another by the impact velocity alone."""
    velocity = np.asarray(velocity, dtype=float)
    rows = np.zeros(len(velocity), BLOW)
    rows["impact_velocity"] = velocity
    rows["period"] = 0.05 + 1e-3 * (velocity - 8.0)
    rows["penetration"] = rows["hole_advance"] = 1e-3 * velocity / 8.0
    return rows


def cycle(rows, order, tolerance):
    """Rate, error and multiplier of a cycle; None where the last blows are none."""
    found = settling.cycle(rows.view(float).reshape(len(rows), -1), len(rows), order, tolerance)
    return found[1:] if found.order else None


def order_of(rows):
    """Blows in the shortest cycle that the last blows are; 0 where they are none."""
    return settling.cycle_in(rows.view(float).reshape(len(rows), -1), len(rows), TOLERANCE).order


def rate_of(velocity):
    row = blows([velocity])[0]
    return row["hole_advance"] / row["period"]


@pytest.mark.parametrize("multiplier", [0.16, -0.5, 0.7])
def test_a_converging_sequence_is_extrapolated_to_its_limit(multiplier):
    for count in range(3, 80):
        rows = blows(8.0 + 0.5 * multiplier ** np.arange(count))
        found = cycle(rows, 1, TOLERANCE)
        if found is not None:
            break
    rate, error, ratio = found
    assert ratio == pytest.approx(multiplier, rel=1e-6)
    assert abs(rate / rate_of(8.0) - 1.0) < TOLERANCE
    assert abs(rate - rate_of(8.0)) <= error


def test_slow_convergence_is_not_taken_for_a_cycle():
    """Each change is within the tolerance; all those to come are not."""
    rows = blows(8.0 + 0.05 * 0.99 ** np.arange(40))
    assert np.max(np.abs(np.diff(rows["impact_velocity"])) / 8.0) < TOLERANCE
    assert cycle(rows, 1, TOLERANCE) is None


@pytest.mark.parametrize("order", [2, 3, 5])
def test_a_cycle_of_several_blows_is_found_by_its_order(order):
    rows = blows(np.tile(8.0 + 0.3 * np.arange(order), 4))
    found = [n for n in range(1, 9) if cycle(rows, n, TOLERANCE) is not None]
    assert found[0] == order


def test_scatter_is_no_cycle_and_its_error_covers_correlated_blows():
    generator = np.random.default_rng(7)
    errors, off = [], []
    for _ in range(200):
        drift = np.zeros(400)
        for k in range(1, 400):
            drift[k] = 0.8 * drift[k - 1] + generator.normal(scale=0.1)
        rows = blows(8.0 + drift)
        assert all(cycle(rows, n, TOLERANCE) is None for n in range(1, 9))
        rate, error = rate_of_blows(rows)
        errors.append(error)
        off.append(rate - rate_of(8.0))
    assert 0.7 < np.std(off) / np.mean(errors) < 1.4


def test_a_settled_rate_has_the_error_of_its_grid():
    """A grid of ten times as many cells lies within it, and not within that of convergence."""
    scenes = [Scene().replace(**WAVES, **{"solver.cells": n}) for n in (10, 100)]
    coarse, fine = map(settled, scenes)
    judged = settled(scenes[0], error_estimate=True)
    coarse_numbers, fine_numbers, numbers = (one.summary() for one in (coarse, fine, judged))
    for name in ("rate_of_penetration", "blow_period", *MEANS):
        off = abs(coarse_numbers[name] - fine_numbers[name])
        assert coarse_numbers[f"{name}_error"] < off < numbers[f"{name}_error"]
    assert judged.rate_of_penetration == coarse.rate_of_penetration
    assert len(judged.blows) == len(coarse.blows)
    assert judged.summary()["rate_of_penetration_error_of"] == "discretisation and convergence"
    # where it was not estimated, that is told
    assert coarse.summary()["rate_of_penetration_error_of"] == "convergence"
    assert coarse.summary()["grid_errors"] == {}
    assert "error_of='convergence'" in repr(coarse)
    rigid = settled(Scene().replace(**RIGID), error_estimate=True)
    assert rigid.grid_errors == dict.fromkeys(JUDGED, 0.0)


def chatter(cells):
    return Scene.from_toml(SCENARIOS / "chatter.toml").replace(**WAVES, **{"solver.cells": cells})


def test_a_deviation_has_the_error_of_convergence_and_grid(capsys):
    scenes = [Scene().replace(**WAVES, **{"solver.cells": n}) for n in (36, 100)]
    coarse, fine = settled(scenes[0], error_estimate=True), settled(scenes[1])
    assert coarse.same_motion is True
    off = abs(coarse.multiplier - fine.multiplier)
    assert off <= coarse.multiplier_error < 0.1 * coarse.multiplier
    show_settled(coarse)
    (line,) = [one for one in capsys.readouterr().out.splitlines() if "Stability multiplier" in one]
    assert f"{coarse.multiplier:.3f} ± {coarse.multiplier_error:.3f}" in line
    rigid = settled(Scene().replace(**RIGID), error_estimate=True)
    assert rigid.others == ()
    assert 0.0 < rigid.multiplier_error < 0.01 * rigid.multiplier


def test_a_motion_that_changes_with_the_cells_is_said_to(capsys):
    """By the longer steps that these are compared with, no blow is as another."""
    found = settled(chatter(44), error_estimate=True)
    assert (found.order, found.others[0].order) == (1, 0)
    assert found.same_motion is False
    assert math.isnan(found.multiplier_error)
    assert found.summary()["multiplier_error"] is None
    show_settled(found)
    shown = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "not the same on a second resolution: aperiodic" in shown
    assert "it may be many times that of a run" in shown
    assert "Stability multiplier undecided, at this resolution" in shown
    show_settled(settled(chatter(24)))
    shown = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "on no second resolution tried" in shown


def test_a_settled_motion_has_the_warnings_of_a_run(capsys):
    scene = Scene().replace(**{"effects.loss": False, "solver.cells": 4})
    found = settled(scene, most_blows=40, error_estimate=True)
    assert any("structural loss is off" in text for text in found.warnings)
    assert not any("run.duration" in text for text in found.warnings)
    show_settled(found)
    assert "structural loss is off" in " ".join(capsys.readouterr().out.split())
    assert settled(Scene(), error_estimate=True).warnings == []


def test_an_aperiodic_rate_has_the_error_of_scatter_and_no_other_name(capsys):
    scene = Scene().replace(**RIGID, **{"feed.force": 300.0})
    found = settled(scene, error_estimate=True)
    assert found.kind == "aperiodic"
    assert found.summary()["rate_of_penetration_error_of"] == "scatter"
    show_settled(found)
    shown = " ".join(capsys.readouterr().out.split())
    assert "by the scatter of blows alone, since this solver has no grid" in shown
    assert "convergence" not in shown


@pytest.mark.parametrize("solver", ["wave", "modal"])
def test_reference_agrees_with_a_long_run(solver):
    scene = Scene().computed_by(solver)
    long = simulate(scene, 4.0, 1.0)
    short = settled(scene)
    assert (short.kind, short.order) == ("periodic", 1)
    assert short.rate_of_penetration == pytest.approx(long.rate_of_penetration, rel=5e-4)
    assert short.blow_period == pytest.approx(long.summary()["blow_period"], rel=5e-4)
    assert abs(short.rate_of_penetration - long.rate_of_penetration) < (
        short.rate_of_penetration_error
    )
    assert 0.0 < short.multiplier < 0.3
    assert len(short.blows) < len(long.blows) / 10


CASES = [
    *({"rock.loading_stiffness": value} for value in (1e8, 3e8, 1.5e9, 2e9)),
    *({"rock.unloading_ratio": value} for value in (2.0, 10.0, 20.0, 30.0)),
    *({"feed.force": value} for value in (500.0, 1000.0, 5000.0, 1e4, 2e4)),
    *(
        {"drive.reversal_distance": value}
        for value in (0.08, 0.06, 0.03, 0.02, 0.006, 0.004, 0.003)
    ),
]


@pytest.mark.parametrize("changes", CASES, ids=str)
def test_motion_is_classified_as_by_long_runs(changes):
    changes = dict(changes)
    if "drive.reversal_distance" in changes:
        ratio = REFERENCE_DISTANCE / changes["drive.reversal_distance"]
        changes["drive.force"] = REFERENCE_FORCE * ratio ** (1.0 / 3.0)
    scene = Scene().replace(**changes)
    long = simulate(scene, 4.0, 1.0)
    numbers = [long.counted[name] for name in COMPARED]
    differ = max(np.ptp(values) / np.mean(values) for values in numbers)
    found = settled(scene)
    # what differs by about the tolerance may be called either
    if not TOLERANCE < differ < 10 * TOLERANCE:
        assert found.kind == ("periodic" if differ <= TOLERANCE else "aperiodic")
    spread = math.hypot(found.rate_of_penetration_error, long.rate_of_penetration_standard_error)
    assert abs(found.rate_of_penetration - long.rate_of_penetration) < 4 * spread


def test_a_drill_that_stops_is_said_to_have_stalled():
    found = settled(Scene().replace(**{"effects.drive": "none"}))
    assert found.kind == "stalled"
    assert math.isnan(found.rate_of_penetration)
    assert found.summary()["rate_of_penetration"] is None


def test_where_no_rock_breaks_the_rate_is_zero_and_the_period_has_its_error():
    """Not the rounding of the depth, 3e-14 mm/s."""
    weak = with_chambers("dth5", 24e5).replace(**{"pneumatic.back_pressure": 10e5})
    found = settled(weak, error_estimate=True)
    assert found.order
    assert found.rate_of_penetration == found.rate_of_penetration_error == 0.0
    assert found.blow_period_error > 0.0


def test_senseless_requests_are_refused():
    with pytest.raises(SceneError, match=r"piston\.model"):
        settled(Scene().replace(**{"piston.model": "absent"}))
    with pytest.raises(SceneError, match=r"tolerance = 0\.0: must be"):
        settled(Scene(), tolerance=0.0)
    with pytest.raises(SceneError, match="most_blows = 5: must be"):
        settled(Scene(), most_blows=5)
    with pytest.raises(SceneError, match=r"scatter = 1\.0: must be"):
        settled(Scene(), scatter=1.0)


def test_command_tells_the_cycle(tmp_path):
    scene = tmp_path / "scene.toml"
    Scene().to_toml(scene)
    answer = CliRunner().invoke(app, ["settled", str(scene), "--json", "-"])
    assert answer.exit_code == 0
    found = json.loads(answer.stdout)
    assert found["kind"] == "periodic"
    assert found["rate_of_penetration"] == settled(Scene()).rate_of_penetration
    shown = CliRunner().invoke(app, ["settled", str(scene)])
    assert "periodic" in shown.stdout


def test_chance_repetitions_of_an_aperiodic_motion_are_no_cycle():
    """Blows of this motion agree by chance within the tolerance before it goes on."""
    changes = WAVES | {"feed.force": 500 + 9500 / 6, "rock.loading_stiffness": 2e9}
    scene = Scene().replace(**changes, **{"drive.reversal_distance": 0.01 + 0.07 * 4 / 19})
    found = settled(scene, most_blows=200)
    alike = np.all(
        [
            np.abs(np.diff(found.blows[name])) < TOLERANCE * found.blows[name][1:]
            for name in COMPARED
        ],
        axis=0,
    )
    assert np.any(alike[1:] & alike[:-1])
    assert found.kind == "aperiodic"


# Wandering motions in which that happens; where, depends on rounding.
@pytest.mark.parametrize(
    ("feed", "distance"),
    [(500 + 9500 * 7 / 24, 0.01), (2875.0, 0.01 + 0.07 / 19)],
)
def test_a_few_blows_that_converge_by_chance_are_no_cycle(feed, distance):
    """After tens of blows a few fall evenly to less than the tolerance, and rise again."""
    changes = WAVES | {"feed.force": feed, "rock.loading_stiffness": 2e9}
    scene = Scene().replace(**changes, **{"drive.reversal_distance": distance})
    found = settled(scene, most_blows=120)
    assert any(converge(found.blows[:n]) for n in range(10, 100))
    assert found.kind == "aperiodic"


def converge(rows):
    """Whether the last four blows look like a converging motion."""
    off = [np.abs(np.diff(rows[name][-4:])) / np.abs(rows[name][-1]) for name in COMPARED]
    first, second, third = np.max(off, axis=0)
    return first > 10 * TOLERANCE and second < 0.5 * first and third < min(0.5 * second, TOLERANCE)


def test_convergence_after_wandering_is_believed_once_it_has_lasted():
    wandering = np.random.default_rng(5).normal(scale=0.05, size=30)
    rows = blows(8.0 + np.concatenate([wandering, 0.05 * 0.2 ** np.arange(12)]))
    found = [n for n in range(4, len(rows) + 1) if cycle(rows[:n], 1, TOLERANCE)]
    assert found
    change = np.abs(np.diff(rows["impact_velocity"][: found[0]]))[-1] / 8.0
    assert change <= 1e-4 * TOLERANCE


def test_a_rare_blow_that_is_different_is_not_missed():
    """All is within the tolerance for tens of blows, then one gains two per cent more."""
    changes = WAVES | {"feed.force": 6437.5, "rock.loading_stiffness": 2e9}
    scene = Scene().replace(**changes, **{"drive.reversal_distance": 0.08 / 3.8})
    found = settled(scene)
    long = simulate(scene, 20.0, 2.0)
    spread = math.hypot(found.rate_of_penetration_error, long.rate_of_penetration_standard_error)
    assert abs(found.rate_of_penetration - long.rate_of_penetration) < 3 * spread


def test_scatter_within_the_tolerance_must_last():
    rows = blows(8.0 + 2e-5 * np.random.default_rng(3).standard_normal(100))
    found = [n for n in range(3, 100) if order_of(rows[:n]) == 1]
    assert found[0] == 60
    assert len(found) > 30


def test_blows_that_alternate_while_they_converge_are_one_cycle():
    rows = blows(8.0 + 0.01 * (-0.8) ** np.arange(60))
    orders = [order_of(rows[:n]) for n in range(3, 60)]
    assert set(orders) == {0, 1}
    both = blows(8.0 + 0.01 * (-0.8) ** np.arange(60) + 0.02 * (-1.0) ** np.arange(60))
    orders = [order_of(both[:n]) for n in range(3, 60)]
    assert set(orders) == {0, 2}


@pytest.mark.parametrize("kept", [0.0, 0.5, 0.8])
def test_an_error_at_which_a_run_ends_is_not_small_by_chance(kept):
    """What one blow keeps of the scatter of the one before; nominal are 68 and 95 %."""
    random, off = np.random.default_rng(7), []
    for _ in range(150):
        shift = np.zeros(MOST_BLOWS)
        for k, new in enumerate(random.standard_normal(MOST_BLOWS - 1)):
            shift[k + 1] = kept * shift[k] + new
        rows, n, check, error = blows(8.0 + 0.05 * shift), FEWEST_SCATTERED, 0.0, math.inf
        while n < MOST_BLOWS:
            if n >= check:
                rate, error = rate_so_far(rows[:n])
                check = NEXT_CHECK * n
            if error <= 1e-3 * rate:
                break
            n = min(n + n // 16, MOST_BLOWS)
        off.append(abs(rate - rate_of(8.0)) / error)
    assert np.mean(np.array(off) < 1.0) > 0.55
    assert np.mean(np.array(off) < 2.0) > 0.85


def test_solvers_that_others_add_settle_as_those_of_the_engine():
    scene, found = Scene(), []
    for kind in (Solver, EngineSolver):
        solver, rows = make_solver(scene), np.zeros(40, BLOW)
        state, asked = solver.new_state(), settling.request_for(TOLERANCE, len(rows), 0.0)
        while asked[0].verdict == settling.Verdict.OPEN:
            assert kind.settle(solver, state, asked, rows) == 0
        found.append((rows.tobytes(), asked.tobytes()))
    assert found[0] == found[1]
    assert asked[0].verdict == settling.Verdict.PERIODIC


def test_an_aperiodic_motion_ends_at_the_wanted_standard_error():
    scene = Scene().replace(**{"feed.force": 500.0})
    long, short = settled(scene), settled(scene, scatter=1e-3)
    assert (long.kind, short.kind) == ("aperiodic", "aperiodic")
    assert len(short.blows) < len(long.blows)
    assert short.rate_of_penetration_error <= 1e-3 * short.rate_of_penetration
    spread = math.hypot(short.rate_of_penetration_error, long.rate_of_penetration_error)
    assert abs(short.rate_of_penetration - long.rate_of_penetration) < 3 * spread
