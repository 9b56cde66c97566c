"""Too little structural loss is warned of where docs/data/undamped.md found that it matters."""

from __future__ import annotations

import math

import pytest

from percussion_model import Scene, simulate
from percussion_model.simulation.warnings import least_loss_time

REFERENCE = Scene()


def run(**changes):
    return simulate(REFERENCE.replace(**changes), 2.0, settle=0.5, record_events=False)


def warned(result):
    return [text for text in result.warnings if "structural loss" in text]


def test_the_limit_is_the_decay_of_the_lowest_mode():
    result = run()
    limit = least_loss_time(result)
    bit = REFERENCE.bit
    frequency = math.pi * bit.sections[0].wave_speed / bit.length
    summary = result.summary()
    left = math.exp(-limit * frequency**2 * summary["blow_period"]) * summary["blow_energy"]
    assert left == pytest.approx(REFERENCE.rock.barrier_energy, rel=1e-3)
    assert limit == pytest.approx(2.9e-8, rel=0.02)


@pytest.mark.parametrize("loss", [0.0, 1e-10, 1e-8, 2.5e-8])
def test_too_little_loss_is_warned_of(loss):
    (text,) = warned(run(**{"loss.time": loss}))
    assert ("off" if loss == 0.0 else "small") in text


# Ranges of the paper's Fig. 9, at its ends and where the limit comes nearest.
FIG_9 = {
    "reference": {},
    "soft rock": {"rock.loading_stiffness": 1e8},
    "hard rock": {"rock.loading_stiffness": 2e9},
    "low gamma": {"rock.unloading_ratio": 2.0},
    "high gamma": {"rock.unloading_ratio": 100.0},
    "low feed": {"feed.force": 500.0},
    "high feed": {"feed.force": 2e4},
    "short stroke": {"drive.reversal_distance": 0.003, "drive.force": 3000 * (40 / 3) ** (1 / 3)},
    "long stroke": {"drive.reversal_distance": 0.08, "drive.force": 3000 * 0.5 ** (1 / 3)},
    "little more than enough": {"loss.time": 3.2e-8},
}


@pytest.mark.parametrize("changes", FIG_9.values(), ids=FIG_9)
def test_enough_loss_is_not_warned_of(changes):
    assert not warned(run(**changes))


def test_without_a_barrier_or_a_bit_that_waves_there_is_no_limit():
    rigid = {"piston.model": "rigid", "bit.model": "rigid"}
    assert least_loss_time(run(**rigid)) == 0.0
    assert least_loss_time(run(**{"effects.barrier": False})) == 0.0


def test_twice_the_limit_is_independent_of_the_cells_and_less_than_it_is_not():
    waves = {"solver.name": "wave"}

    def spread(loss):
        rates = [
            run(**waves, **{"loss.time": loss, "solver.cells": cells}).rate_of_penetration
            for cells in (20, 30, 40)
        ]
        return max(rates) / min(rates) - 1.0

    assert spread(6e-8) < 0.005
    # farther below, the motion is aperiodic and two short runs differ by chance
    assert spread(2e-8) > 0.01
