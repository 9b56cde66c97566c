"""Finite elements against travelling waves and rigid bodies, which share no motion with them.

The whole range of parameters, with both refined, runs with PERCUSSION_LONG=1; its table
stands in docs/data/agreement.md. Here some of it, over fewer blows.
"""

from __future__ import annotations

import os
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from percussion_model import EventKind, Scene, Simulation

sys.path.insert(0, str(Path(__file__).parent))
import study

LONG = os.environ.get("PERCUSSION_LONG") == "1"
CASES = {f"{case.group} {case.name}": case for case in study.cases()}
SHORT = ("K_R 1e+08 N/m", "K_R 7.5e+08 N/m", "gamma 10", "F_S 5000 N", "D_1 20 mm")
# Fine enough for these, at a tenth of the cost of the study's finest.
SHORT_LEVEL = (50, 2.0, 1e13)
DURATION, SETTLE = 0.5, 0.15


def agree(waves, elements):
    assert elements.rate == pytest.approx(waves.rate, rel=study.RATE_WITHIN)
    assert elements.period == pytest.approx(waves.period, rel=study.PERIOD_WITHIN)
    assert elements.contacts == pytest.approx(waves.contacts, abs=0.05)


@pytest.mark.parametrize("name", SHORT)
def test_stationary_motion_agrees_with_the_waves(name):
    case = CASES[name]
    waves = study.waves(case, study.CELLS[0], DURATION, SETTLE)
    agree(waves, study.elements(case, SHORT_LEVEL, DURATION, SETTLE))


@pytest.mark.skipif(not LONG, reason="an hour; set PERCUSSION_LONG=1")
@pytest.mark.parametrize("name", CASES)
def test_refined_answers_agree_over_the_range(name):
    case = CASES[name]
    before = study.elements(case, study.LEVELS[0])
    for level in study.LEVELS[1:]:
        found = study.elements(case, level)
        if abs(found.rate / before.rate - 1.0) < study.OWN_CHANGE:
            break
        before = found
    else:
        pytest.fail("the finite elements did not settle")
    agree(study.waves(case, study.CELLS[1]), found)


# The bit alone falls at the speed of section 4.2 of the paper.
DROP = {
    "piston.model": "absent",
    "effects.drive": "none",
    "start.bit_velocity": 5.25,
    "solver.cells": 92,
    "fem.elements": 58,
    "fem.courant": 1.0,
}


def rest(scene, time=0.1):
    """Where the face of the bit comes to rest [m], and how many cycles it took."""
    simulation = Simulation(scene)
    simulation.advance(time)
    cycles = int(sum(simulation.events["kind"] == EventKind.MODE_DFC))
    return simulation.observe()["bit_end_position"], cycles


@pytest.mark.parametrize("damping", [1e3, 3e3, 1e4])
@pytest.mark.parametrize("energy", [0.05, 0.5])
def test_drop_agrees_with_the_waves(damping, energy):
    scene = Scene().replace(
        **DROP, **{"rock.barrier_damping": damping, "rock.barrier_energy": energy}
    )
    waves, cycles = rest(scene.computed_by("wave"))
    elements, same = rest(scene.computed_by("fem"))
    assert elements == pytest.approx(waves, rel=1e-3)
    assert same == cycles


def test_rigid_bodies_are_the_limit_of_a_soft_rock():
    """eta = K_R L_b / EA to zero; at the reference, 0.13, a rigid bit is 4 % off."""
    off = []
    for stiffness in (7.5e8, 1e8, 1e7, 1e6):
        changes = DROP | {"rock.loading_stiffness": stiffness, "fem.courant": 5.0}
        scene = Scene().replace(**changes)
        found = {name: rest(scene.computed_by(name), 0.4)[0] for name in ("wave", "fem", "rigid")}
        assert found["fem"] == pytest.approx(found["wave"], rel=1e-3)
        off.append(abs(found["rigid"] / found["wave"] - 1.0))
    assert off[0] > 2e-2
    assert all(later < 0.5 * sooner for sooner, later in pairwise(off))
    assert off[-1] < 5e-4
