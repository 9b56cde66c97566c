"""Guards act on storms alone: never on the reference, nor anywhere in the paper's ranges."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from percussion_model import Scene, Simulation, simulate
from percussion_model.simulation.validity import BUTTON_LENGTH, LONGEST_FLIGHT, MOST_RATE
from tests.state_bits import state_bits

REFERENCE = Scene()
# The paper's figure 9: K_R, gamma, F_S and D_1, the last at constant power.
RANGES = {
    "rock.loading_stiffness": (1e8, 7.5e8, 2e9),
    "rock.unloading_ratio": (2.0, 5.0, 30.0),
    "feed.force": (500.0, 2500.0, 20_000.0),
    "drive.reversal_distance": (4e-3, 0.04, 0.08),
}
DURATION = {"wave": 0.2, "fem": 0.05, "rigid": 0.4}
GUARDS = ("locked", "storms")
# A drive that turns at once, on bodies that do not rebound.
STORM = {"drive.reversal_distance": 5e-324, "contact.restitution": 0.0}
VALIDITY = ("beyond", "off bottom", "no drilling", "negative", "storm", "ledger", "modes")


def grid():
    """The corners of the ranges, and each range by itself."""
    ends = [(values[0], values[-1]) for values in RANGES.values()]
    points = [dict(zip(RANGES, values, strict=True)) for values in product(*ends)]
    for name, values in RANGES.items():
        points += [{name: value} for value in values]
    return [with_power_kept(point) for point in points]


def with_power_kept(point):
    reversal = point.get("drive.reversal_distance", 0.04)
    return point | {"drive.force": 3000.0 * (0.04 / reversal) ** (1 / 3)}


def run(scene, factor):
    """Run with thresholds multiplied by a factor."""
    simulation = Simulation(scene)
    par = simulation.solver._par
    for name in ("most_changes", "most_changes", "most_events"):
        if name in par.dtype.names:
            par[name] *= factor
    simulation.advance(DURATION[scene.solver_name])
    return simulation


@pytest.mark.parametrize("solver", DURATION)
def test_guards_never_act_in_the_papers_ranges_and_their_thresholds_do_not_matter(solver):
    for point in grid():
        scene = REFERENCE.computed_by(solver, **point, **{"run.settle": 0.0})
        one, other = run(scene, 1), run(scene, 10)
        assert sum(one.statistics().get(name, 0) for name in GUARDS) == 0, point
        assert len(one.events) > 10, point
        assert one.events.tobytes() == other.events.tobytes(), point
        assert one.blows.tobytes() == other.blows.tobytes(), point
        assert one._state.workspace.tobytes() == other._state.workspace.tobytes(), point
        for text in one.result().warnings:
            assert not any(word in text for word in VALIDITY), (point, text)


def test_the_thresholds_of_the_test_above_are_those_of_the_kernels():
    """A threshold of one step or event does change the run, so that ten times it could."""
    thresholds = {"wave": "most_changes", "fem": "most_events", "rigid": "most_events"}
    for solver, name in thresholds.items():
        simulation = Simulation(REFERENCE.computed_by(solver, **{"run.settle": 0.0}))
        simulation.solver._par[name] = 1
        simulation.advance(0.02)
        assert sum(simulation.statistics().get(name, 0) for name in GUARDS) > 0, solver
        result = simulation.result()
        assert abs(result.energy["residual_relative"]) < 1e-6, solver
        assert any("modes" in text or "storm" in text for text in result.warnings), solver


def test_a_storm_of_blows_is_put_off_counted_and_said():
    scene = REFERENCE.computed_by("rigid", **STORM)
    result = simulate(scene, 0.02, settle=0.0)
    assert result.statistics["storms"] > 0
    transit = max(scene.bit.transit_time, scene.piston.transit_time)
    # 200 come unhindered, as many put off; each of them lists four events at the most
    assert result.statistics["events"] < 4 * (2 * 200 * 0.02 / transit + 200)
    assert abs(result.energy["residual_relative"]) < 1e-9
    assert np.all(np.isfinite(result.blows["period"]))
    assert any("storm" in text for text in result.warnings)


def test_a_storm_does_not_depend_on_the_calls():
    scene = REFERENCE.computed_by("rigid", **STORM)
    whole, divided = Simulation(scene), Simulation(scene)
    whole.advance(0.02)
    for t in np.linspace(0.0, 0.02, 777):
        divided.advance(float(t))
        divided.observe()
    assert whole.statistics()["storms"] > 0
    assert state_bits(whole._state) == state_bits(divided._state)


def test_inputs_that_change_in_a_storm_do_not_hold_events_up():
    simulation = Simulation(REFERENCE.computed_by("rigid", **STORM))
    simulation.advance(0.02)
    before = simulation.statistics()["events"]
    for k in range(2000):  # far more often than events are put off by
        simulation.advance(0.02 + 1e-8 * (k + 1))
        simulation.set_inputs(feed_force=2500.0 + k % 2)
    assert simulation.statistics()["events"] > before
    assert simulation.observe()["gap"] > -1e-9
    assert abs(simulation.energy()["residual_relative"]) < 1e-9


# ------------------------------------------------------------- limits of validity


def warnings_of(duration=0.3, solver="rigid", **changes):
    scene = REFERENCE.computed_by(
        solver, **{key.replace("__", "."): v for key, v in changes.items()}
    )
    return " ".join(simulate(scene, duration, settle=0.0).warnings)


def test_limits_of_validity_are_said():
    assert "deeper than the buttons" in warnings_of(rock__loading_stiffness=1e6)
    assert "off bottom" in warnings_of(feed__force=-5000.0, duration=2 * LONGEST_FLIGHT)
    assert "no drilling" in warnings_of(rock__loading_stiffness=1e6)
    assert "longer than a wave" in warnings_of(0.001, "fem", loss__time=1e-3)
    said = warnings_of()
    for word in VALIDITY:
        assert word not in said


def test_the_limits_lie_beyond_the_references():
    result = simulate(REFERENCE.computed_by("rigid"), 0.5, settle=0.1)
    depth = result.blows["peak_bit_force"].max() / REFERENCE.rock.loading_stiffness
    assert depth < 0.2 * BUTTON_LENGTH
    assert result.rate_of_penetration < 0.05 * MOST_RATE


def test_an_early_end_of_contact_is_no_flight():
    result = simulate(REFERENCE.computed_by("rigid"), 0.5, settle=0.1, record_events=False)
    assert "off bottom" not in " ".join(result.warnings)
    scene = REFERENCE.computed_by("rigid", **{"feed.force": -5000.0})
    result = simulate(scene, 0.6, settle=0.1, record_events=False)
    assert len(result.events) == 0
