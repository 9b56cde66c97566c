"""States that come from outside: what kernels index, count and loop by is held to limits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from state_bits import run_bits

from percussion_model import Scene, Simulation, SimulationError
from percussion_model.physics.state import COMMON_UNDEFINED

RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
WAVES = Scene().computed_by("wave")
SCENES = {
    "wave": WAVES,
    "wave, rigid piston": WAVES.replace(**{"piston.model": "rigid"}),
    "modal": Scene().computed_by("modal"),
    "fem": Scene().computed_by("fem"),
    "rigid": Scene().replace(**RIGID),
}
SCENE_NAMES = pytest.mark.parametrize("name", SCENES)
# Counts of what was done: any that is not negative will do.
COUNTS = ("n_", "count_", "b_con", "b_cyc", "standing_events", "window_events")


@pytest.fixture(scope="module")
def runs():
    """A run of each scene, some blows old, and what it was like."""
    found = {}
    for name, scene in SCENES.items():
        run = Simulation(scene)
        run.advance(0.11)
        found[name] = run, run.save()
    return found


def refused(run, good, **changes):
    """Restore a snapshot with other numbers in its record, which must not be taken."""
    state = good.state.copy()
    for field, value in changes.items():
        state.record[0][field] = value
    before = run_bits(run)
    try:
        run.restore(replace(good, state=state))
    except SimulationError as error:
        assert run_bits(run) == before
        return str(error)
    run.restore(good)
    return ""


@SCENE_NAMES
def test_no_whole_number_is_without_limits(runs, name):
    run, good = runs[name]
    dtype = good.state.dtype
    whole = [field for field in dtype.names if dtype[field].base.kind == "i"]
    assert len(whole) > 15
    for field in whole:
        assert field in refused(run, good, **{field: -(2**62)}), field
        assert field in refused(run, good, **{field: 2**62}), field
        if not field.startswith(COUNTS):
            value = int(good.state.record[0][field])
            assert value in range(-1, 5) or field in (*STEPS, *OF_MODES), field


# Steps of the waves, which have their own test.
STEPS = ("step", "leap_end")
# Ticks, sets and counts of modes of the modal solver, of which tests/test_modal.py has a test.
OF_MODES = (
    *(
        "time",
        "look",
        "piston_time",
        "no_park",
        "closed_at",
        "rest_until",
        "held_from",
        "held_until",
    ),
    *("active", "pairs", "stride", "law"),
)


@pytest.mark.parametrize(
    ("field", "value"),
    [("mode", 5), ("mode", -1), ("alpha", 2), ("closed", 2), ("live", 0), ("armed", -1),
     ("cuts", 3), ("cuts", -1), ("next_kind", 14)],
)  # fmt: skip
def test_no_index_leads_out_of_an_array(runs, field, value):
    having = [one for one in runs.values() if field in one[1].state.dtype.names]
    assert having
    for run, good in having:
        assert f"{field} = {float(value)}" in refused(run, good, **{field: value})


@SCENE_NAMES
def test_numbers_are_finite(runs, name):
    run, good = runs[name]
    dtype = good.state.dtype
    may_be_infinite = {
        "gap",
        "t_open",
        "peak_from",
        "next_time",
        "next_tau",
        "late_from",
        "line_end",
    }
    undefined = {*COMMON_UNDEFINED, "ss_force"}
    if name == "rigid":
        undefined |= {"peak_contact_force"}
    for field in dtype.names:
        if dtype[field].base.kind != "f":
            continue
        if field not in may_be_infinite:
            assert field in refused(run, good, **{field: math.inf}), field
            assert field in refused(run, good, **{field: -1e300}), field
        assert bool(refused(run, good, **{field: math.nan})) == (field not in undefined), field


@SCENE_NAMES
def test_the_workspace_is_finite(runs, name):
    run, good = runs[name]
    for at in range(0, len(good.state.workspace), 17):
        for value in (math.nan, math.inf, -1e300):
            state = good.state.copy()
            state.workspace[at] = value
            with pytest.raises(SimulationError, match="workspace"):
                run.restore(replace(good, state=state))


@pytest.mark.parametrize("name", ["wave", "wave, rigid piston"])
def test_steps_of_waves_fit_the_time(runs, name):
    run, good = runs[name]
    step = int(good.state.record[0]["step"])
    for other in (step + 10**13, step - 10**4, -1):
        assert refused(run, good, step=other), other


@pytest.mark.parametrize(
    ("name", "field"),
    [("wave", "t_base"), ("fem", "time"), ("rigid", "next_time")],
)
def test_no_time_makes_an_endless_loop(runs, name, field):
    run, good = runs[name]
    for value in (-1e9, 1e50 if field != "next_time" else -1.0):
        assert refused(run, good, **{field: value})


@SCENE_NAMES
def test_a_state_of_another_form_or_time_is_refused(runs, name):
    run, good = runs[name]
    for other in SCENES:
        state = runs[other][1].state
        if (state.dtype, state.shapes) != (good.state.dtype, good.state.shapes):
            with pytest.raises(SimulationError, match="does not fit"):
                run.restore(replace(good, state=state))
    for time in (math.nan, -1.0, math.inf, "soon"):
        with pytest.raises(SimulationError, match="time"):
            run.restore(replace(good, time=time))


@SCENE_NAMES
def test_after_refusals_a_run_goes_on_bit_for_bit(runs, name):
    _, good = runs[name]
    run, twin = Simulation(SCENES[name]), Simulation(SCENES[name])
    for one in (run, twin):
        one.restore(good)
    rng = np.random.default_rng(3)
    count = 0
    for _ in range(40):
        here = run.save()
        state = here.state.copy()
        state.words[rng.integers(len(state.words))] = rng.choice([-(2**62), 2**62, -1, 7])
        try:
            run.restore(replace(here, state=state))
        except SimulationError:
            count += 1
        else:
            run.restore(here)
        time = run.time + 1e-3
        for one in (run, twin):
            one.advance(time)
    assert count > 5
    assert run_bits(run) == run_bits(twin)
