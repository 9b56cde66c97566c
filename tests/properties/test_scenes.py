"""Random scenes under random calls: 200 each time, many more with PERCUSSION_LONG=1."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from percussion_model import Scene, SceneError, Simulation
from percussion_model.scene.parameters import rows_by_key
from tests.properties import checks
from tests.properties.campaign import campaign, run_case
from tests.properties.scenes import BOTH_SIGNS, BOUNDS, ZERO, Case, draw_case
from tests.properties.source import Generator

SHORT_COUNT, LONG_COUNT, SEED = 200, 20_000, 2026


class Drawn:
    """Hypothesis as a source of choices, which shrinks what fails."""

    def __init__(self, draw):
        self._draw = draw

    def pick(self, options):
        return self._draw(st.sampled_from(list(options)))

    def between(self, low, high):
        return self._draw(st.floats(low, high))

    def count(self, low, high):
        return self._draw(st.integers(low, high))


@st.composite
def cases(draw):
    return draw_case(Drawn(draw))


@pytest.mark.parametrize("first", range(0, SHORT_COUNT, 20))
def test_random_scenes_stay_finite_and_close_their_ledger(first):
    """The same cases each time: what is random here would make the suite a lottery."""
    faults = {index: run_case(SEED, index).get("fault") for index in range(first, first + 20)}
    assert not {index: fault for index, fault in faults.items() if fault}


# Hypothesis draws by the constants of the modules that are loaded, too: other cases in each run.
@pytest.mark.slow
@pytest.mark.skipif("PERCUSSION_LONG" not in os.environ, reason="set PERCUSSION_LONG=1")
@settings(
    max_examples=200,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(cases())
def test_scenes_that_are_sought_to_fail(case):
    checks.check_case(case)


@pytest.mark.slow
@pytest.mark.skipif("PERCUSSION_LONG" not in os.environ, reason="set PERCUSSION_LONG=1")
def test_twenty_thousand_random_scenes(tmp_path):
    record = campaign(LONG_COUNT, SEED, tmp_path / "record.json", "wide")
    assert record["run"] == LONG_COUNT
    assert set(record["solvers"]) == {"wave", "modal", "fem", "rigid"}
    assert not record["failures"], record["failures"]


# ------------------------------------------------------------ of the cases themselves


def test_cases_can_be_drawn_again():
    first, again = (draw_case(Generator(5, 17)) for _ in range(2))
    assert (first.scene, first.calls) == (again.scene, again.calls)
    assert draw_case(Generator(5, 18)).scene != first.scene


def test_cases_cover_solvers_effects_and_parameters():
    drawn = []
    for index in range(400):
        try:
            drawn.append(draw_case(Generator(3, index)))
        except SceneError:
            pytest.fail("scenes that are drawn make sense")
    scenes = [case.scene for case in drawn]
    assert {scene.solver_name for scene in scenes} == {"wave", "modal", "fem", "rigid"}
    for key, row in rows_by_key().items():
        if key.startswith(("string.", "effects.string", "effects.joints", "effects.damper")):
            continue  # drill strings have random chains of their own
        if row.kind in ("flag", "choice") and key not in (
            "solver.name",
            "run.check",
            "run.error_estimate",
        ):
            found = {scene[key] for scene in scenes}
            allowed = set(row.choices) if row.kind == "choice" else {True, False}
            assert found == allowed, key
    for key, (low, high, *more) in BOUNDS.items():
        values = np.array([scene[key] for scene in scenes if scene[key] is not None])
        sizes = np.abs(values[values != 0.0])
        assert sizes.min() < low * (high / low) ** 0.3, key
        assert sizes.max() > low * (high / low) ** 0.7, key
        assert ZERO not in more or 0.0 in values, key
        assert BOTH_SIGNS not in more or values.min() < 0.0 < values.max(), key
    assert {len(scene.bit.sections) for scene in scenes} == {1, 2, 3, 4}
    assert {call[1] for case in drawn for call in case.calls} == {
        *("advance", "sample", "read", "detour", "pickle", "inputs")
    }


# ----------------------------------------------------------------- faults that are seen


@pytest.fixture
def rigid_case():
    changes = {"piston.model": "rigid", "bit.model": "rigid"}
    return Case(Scene().replace(**changes), 0.1, [(0.5, "read", "energy")], "near")


def spoil(monkeypatch, name, change):
    """Let a method of `Simulation` return something else."""
    right = getattr(Simulation, name)
    monkeypatch.setattr(Simulation, name, lambda self: change(right(self)))


def test_a_sound_case_passes(rigid_case):
    told = checks.check_case(rigid_case)
    assert told["blows"] > 0
    assert told["residual"] < 1e-12


@pytest.mark.parametrize(
    ("method", "change", "words"),
    [
        ("energy", lambda ledger: ledger | {"residual": 1e-5 * ledger["initial"]}, "residual"),
        ("energy", lambda ledger: ledger | {"crushing": float("nan")}, "crushing"),
        ("observe", lambda seen: seen | {"bit_velocity": float("inf")}, "bit_velocity"),
        ("observe", lambda seen: seen | {"bit_force": -1e3}, "rock pulls"),
        ("observe", lambda seen: seen | {"gap": -1e-9}, "gap"),
        ("observe", lambda seen: seen | {"bit_impulse": 1.01 * seen["bit_impulse"]}, "momentum"),
        ("statistics", lambda counts: counts | {"events": 10_000_000}, "storm"),
    ],
)
def test_a_fault_is_seen(rigid_case, monkeypatch, method, change, words):
    spoil(monkeypatch, method, change)
    with pytest.raises(AssertionError, match=words):
        checks.check_case(rigid_case)


@pytest.mark.parametrize("share", [0.5, 1.5])
def test_more_broken_than_crushed_is_seen(rigid_case, monkeypatch, share):
    advance = {"effects.breaking": True, "hole_diameter": 0.1, "breaking.buttons": 1}
    rigid_case.scene = rigid_case.scene.replace(**advance, **{"breaking.threshold": 0.0})
    spoil(monkeypatch, "energy", lambda ledger: ledger | {"crushing": share * ledger["crushing"]})
    monkeypatch.setattr(checks, "MOST_RESIDUAL", 1.0)
    if share < 1.0:
        with pytest.raises(AssertionError, match="broken more than crushed"):
            checks.check_case(rigid_case)
    else:
        checks.check_case(rigid_case)


def test_a_lost_blow_is_seen(rigid_case):
    simulation = Simulation(rigid_case.scene)
    simulation.advance(0.3)
    blows = simulation.blows
    checks.check_blows(blows, rigid_case.scene)
    with pytest.raises(AssertionError):
        checks.check_blows(np.delete(blows, 2), rigid_case.scene)


def test_a_fault_stands_in_the_record_with_its_scene(monkeypatch):
    spoil(monkeypatch, "energy", lambda ledger: ledger | {"drive": float("nan")})
    outcome = run_case(5, 17)
    assert "drive = nan" in outcome["fault"]
    assert "[effects]" in outcome["scene"]
    assert outcome["calls"]


def test_a_campaign_goes_on_where_it_stopped(tmp_path, monkeypatch):
    path = tmp_path / "record.json"
    monkeypatch.setattr("tests.properties.campaign.Worker", StandIn)
    campaign(3, 5, path, report=silent)
    record = campaign(7, 5, path, report=silent)
    assert (record["run"], record["drawn"], record["refused"]) == (7, 8, 1)
    assert list(record["failures"]) == ["4"]
    with pytest.raises(SystemExit, match="seed 5"):
        campaign(9, 6, path, report=silent)


def silent(*_, **__):
    """No progress."""


class StandIn:
    """A worker that only says what a case could give."""

    def __init__(self, seed, reach):
        self.seed, self.reach = seed, reach

    def run(self, index):
        told = {"solver": "wave", "blows": 1, "events": 2, "locked": 0, "residual": 1e-12}
        told |= {"modes": {"FF": 2}, "wall_time": 0.01}
        if index == 2:
            return {"refused": "contradiction", "wall_time": 0.01}
        return told | ({"fault": "hang"} if index == 4 else {})

    def stop(self):
        """Nothing to stop."""
