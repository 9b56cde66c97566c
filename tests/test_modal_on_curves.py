"""Modes on rock that loads along a curve, against a general integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.coverage import drawn
from percussion_model import Scene, Simulation, simulate
from percussion_model.physics.records import Mode
from percussion_model.solvers.modal.records import Shape
from percussion_model.verification.hard_cases import hard_cases
from tests.engine_views import Tables

ON_ROCK = 1  # form of the bit alone on K_R


def dropped(modes: int, **changes) -> Scene:
    """A bit alone that falls on rock by the power law."""
    return Scene().replace(
        **{
            "piston.model": "absent", "effects.drive": "none", "effects.feed": False,
            "effects.gravity": False, "effects.barrier": False, "effects.rock": "power",
            "start.bit_velocity": 8.0, "start.rock_gap": 0.0, "solver.name": "modal",
            "solver.cells": modes, **changes,
        }
    )  # fmt: skip


def first_peak(scene: Scene) -> float:
    """Force where the bit first turns, by the solver [N]."""
    run = Simulation(scene)
    run.advance(2e-3)
    return float(run.events["value"][run.events["kind"] == Mode.BC][0])


def integrated_peak(scene: Scene) -> float:
    """The same by a general integrator, with the modes of the solver [N]."""
    forms = Tables(Simulation(scene).solver).forms
    n, held = forms.sizes[ON_ROCK], forms.stiff[ON_ROCK]
    shape = forms.shape[ON_ROCK, :, :n]
    low, stiff, bit = shape[Shape.LOW], shape[Shape.STIFF], shape[Shape.BIT]
    rock, eta = scene.rock, scene.loss.time

    def force(p: float) -> float:
        share = max(p, 0.0) / rock.reference_penetration
        return rock.loading_stiffness * rock.reference_penetration * share**rock.loading_exponent

    def motion(_, y):
        q, v = y[:n], y[n:]
        p, speed = low @ q, low @ v
        end = force(p) - held * p - eta * held * speed
        return np.concatenate((v, -stiff * (q + eta * v) - low * end))

    def turns(_, y):
        return low @ y[n:]

    turns.terminal, turns.direction = True, -1.0
    start = np.concatenate((np.zeros(n), 8.0 * bit))
    found = solve_ivp(motion, (0.0, 2e-3), start, "DOP853", events=turns, rtol=1e-11, atol=1e-14)
    return force(low @ found.y_events[0][0][:n])


@pytest.mark.parametrize("modes", [20, 40, 160])
@pytest.mark.parametrize("exponent", [1.3, 1.5, 2.0])
def test_the_peak_of_a_drop_is_that_of_a_general_integrator(exponent, modes):
    scene = dropped(modes, **{"rock.loading_exponent": exponent})
    assert first_peak(scene) == pytest.approx(integrated_peak(scene), rel=2e-6)


def test_a_dissipative_cycle_that_turns_within_a_step_goes_on():
    """Its end was sought by the work of the barrier, which was next to none: for ever."""
    scene = Scene().replace(
        **{
            "piston.sections.0.length": 0.21539445532111212,
            "bit.sections.0.length": 0.5298349872372927,
            "rock.loading_stiffness": 1461444723.1113753,
            "rock.unloading_ratio": 27.08890502274836, "feed.force": 2479.5789572511712,
            "drive.reversal_distance": 0.011158315160164165,
            "drive.force": 4591.363851278547,
            "effects.cuttings": True, "rock.removed_by": "cycle",
            "solver.name": "modal", "solver.cells": 80,
        }
    )  # fmt: skip
    run = Simulation(scene)
    run.advance(2e-2)
    assert run.events["time"][-1] > 9e-3


def test_steps_are_cut_where_rock_unloads_on_a_stiff_line():
    """With steps of one length 20 modes were off by 2 % here."""
    scene = drawn(148).replace(**{"effects.rock": "power", "rock.loading_exponent": 1.3})
    few, many = (
        simulate(scene.replace(**{"solver.cells": modes}), error_estimate=False)
        for modes in (20, 40)
    )
    assert few.rate_of_penetration == pytest.approx(many.rate_of_penetration, rel=1e-3)


@pytest.mark.parametrize("name", ["power_4_stiff", "buttons_1000"])
def test_steps_are_cut_where_a_curve_gets_stiff(name):
    """With steps of one length 20 modes found 0.6 and 0.7 of these rates."""
    scene = hard_cases()[name].scene.computed_by("modal")
    few, many = (
        simulate(scene.replace(**{"solver.cells": modes}), error_estimate=False)
        for modes in (20, 40)
    )
    scatter = few.rate_of_penetration_standard_error + many.rate_of_penetration_standard_error
    off = abs(few.rate_of_penetration - many.rate_of_penetration)
    assert off < 0.01 * many.rate_of_penetration + scatter


def test_a_run_with_half_the_modes_takes_longer_steps_on_rock():
    """So that the comparison behind a stated error sees what steps do to a rate."""
    longest = [Simulation(dropped(modes)).solver._par["asked"][0] for modes in (10, 20)]
    assert longest[0] == longest[1] + 1
