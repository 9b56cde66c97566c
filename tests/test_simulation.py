"""Simulation: partitions, saving, inputs, reading; and the loop of simulate."""

import pickle
import signal

import numpy as np
import pytest

from percussion_model import Scene, SceneError, Simulation, SimulationError, settled, simulate
from percussion_model.physics.records import SAMPLE_FIELDS
from percussion_model.simulation.simulate import sampling_times, stop_on_interrupt

RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
WAVES = Scene().computed_by("wave")
SCENES = {
    "wave": WAVES,
    "modal": Scene().computed_by("modal"),
    "rigid": Scene().replace(**RIGID),
}
# Of the greatest value of each field: modes that are read within a leap are carried there
# from another time.
READ_ALIKE = 1e-11
END = 0.12  # two whole blows and a part of the third [s]


@pytest.fixture(params=SCENES)
def scene(request):
    return SCENES[request.param]


def bits(simulation):
    """Everything that must repeat, as bytes."""
    state = simulation.save().state
    if isinstance(state, np.ndarray):
        return simulation.blows.tobytes(), simulation.events.tobytes(), state.tobytes()
    record = state.record.copy()
    record["n_blows"] = record["n_events"] = 0  # rows filled in the last call
    plain = record.tobytes() + state.workspace.tobytes()
    return simulation.blows.tobytes(), simulation.events.tobytes(), plain


def one_go(scene, end=END):
    simulation = Simulation(scene)
    simulation.advance(end)
    return simulation


# ------------------------------------------------------------ reading and dividing


def test_any_partition_gives_the_same_bits(scene):
    whole = one_go(scene)
    assert len(whole.blows) == 2
    divided = Simulation(scene)
    for t in np.sort(np.random.default_rng(1).uniform(0.0, END, 2000)):
        divided.advance(float(t))
    divided.advance(END)
    assert bits(divided) == bits(whole)
    assert divided.energy() == whole.energy()


@pytest.mark.parametrize("solver", ["wave", "fem", "rigid"])
def test_a_stop_after_blows_changes_no_bit(solver):
    scene = Scene().computed_by(solver)
    whole = one_go(scene)
    stopped = Simulation(scene)
    stopped.advance_blows(1, END)
    assert len(stopped.blows) == 1
    first = stopped.blows[0]
    assert first["time"] + first["period"] <= stopped.time < END
    stopped.advance_blows(1, END)
    assert len(stopped.blows) == 2
    stopped.advance_blows(1, END)  # comes to its end before the third
    assert (len(stopped.blows), stopped.time) == (2, END)
    assert bits(stopped) == bits(whole)


def test_reading_does_not_touch(scene):
    whole = one_go(scene)
    read = Simulation(scene)
    read.sample(np.linspace(0.0, 0.05, 300))
    for t in np.linspace(0.05, END, 40):
        read.advance(float(t))
        read.observe()
        read.energy()
        read.fields()
        read.statistics()
        read.result()
    read.advance(END)
    assert bits(read) == bits(whole)


def read_one_by_one(simulation, times):
    """Rows of `sample_rows`, each by a call of its own."""
    rows = []
    for t in times:
        simulation.advance(float(t))
        rows.append(list(simulation.observe().values()))
    return np.array(rows)


def test_a_sample_does_not_depend_on_its_neighbours(scene):
    times = np.sort(np.random.default_rng(2).uniform(0.0, 0.06, 200))
    together = Simulation(scene).sample_rows(times)
    alone = read_one_by_one(Simulation(scene), times)
    if scene.solver_name == "modal":
        bound = READ_ALIKE * np.nanmax(np.abs(together), axis=0)
        assert np.all((np.abs(alone - together) <= bound) | (alone == together))
    else:
        np.testing.assert_array_equal(alone, together)


def test_many_samples_leave_blows_and_settling_as_they_are():
    """One kernel reads them all; it gives way at blows, and where settling ends."""
    scene = WAVES.replace(**{"run.duration": END, "run.settle": 0.07})
    times = np.linspace(0.0, END, 700)
    sampled, alone = Simulation(scene), Simulation(scene)
    together = sampled.sample_rows(times)
    np.testing.assert_array_equal(read_one_by_one(alone, times), together)
    assert bits(sampled) == bits(alone)
    assert len(sampled.blows) == 2
    rates = [one.result().rate_of_penetration_fixed_window for one in (sampled, alone)]
    assert rates[0] == rates[1]
    assert np.isfinite(rates[0])


def test_a_state_that_lies_far_in_the_past_is_refused():
    """The time of rigid bodies is that of an event; steps from there would never arrive."""
    simulation = Simulation(SCENES["rigid"])
    good = simulation.save()
    bad = simulation.save()
    bad.state.record["time"] = -1e59
    with pytest.raises(SimulationError, match=r"its time of -1e\+59 s, far before 0"):
        simulation.restore(bad)
    simulation.restore(good)
    simulation.advance(0.03)
    simulation.set_inputs(feed_force=3e3)  # the state is committed, its next event unknown
    simulation.restore(simulation.save())
    simulation.advance(0.05)


def test_observe_names_every_field(scene):
    simulation = Simulation(scene)
    seen = simulation.observe()
    assert tuple(seen) == SAMPLE_FIELDS
    assert seen["time"] == 0.0
    assert seen["piston_velocity"] == pytest.approx(10.0)
    assert seen["gap"] == pytest.approx(1e-5, rel=1e-5)


def test_chunks_change_no_bit(scene):
    result = simulate(scene, END, settle=0.0, trace=1e-3, progress=lambda t: None)
    whole = one_go(scene)
    assert result.blows.tobytes() == whole.blows.tobytes()
    assert result.events.tobytes() == whole.events.tobytes()


@pytest.mark.parametrize("t", [0.05, -1.0, float("nan"), float("inf"), "1", True])
def test_advance_refuses_what_is_no_later_time(t):
    simulation = Simulation(SCENES["rigid"])
    simulation.advance(0.1)
    with pytest.raises(SimulationError, match="t = "):
        simulation.advance(t)
    assert simulation.time == 0.1


# ------------------------------------------------------------------------- saving


def test_a_restored_simulation_repeats_bit_for_bit(scene):
    simulation = Simulation(scene)
    simulation.advance(0.0703)
    snapshot = pickle.loads(pickle.dumps(simulation.save()))
    simulation.advance(END)
    after = bits(simulation), simulation.observe()
    other = Simulation(scene)
    for one in (simulation, other):
        one.restore(snapshot)
        assert one.time == 0.0703
        one.advance(END)
        assert (bits(one), one.observe()) == after


def test_a_snapshot_of_another_scene_is_refused():
    snapshot = Simulation(SCENES["rigid"]).save()
    other = Simulation(SCENES["rigid"].replace(**{"feed.force": 3000.0}))
    with pytest.raises(SimulationError, match="another scene"):
        other.restore(snapshot)
    with pytest.raises(SimulationError, match="snapshot"):
        other.restore(None)


# ------------------------------------------------------------------------- inputs


def test_inputs_act_from_the_next_grid_point(scene):
    simulation = Simulation(scene)
    simulation.advance(0.030001)
    before = simulation.observe()
    simulation.set_inputs(drive_force=2000.0, feed_force=4000)
    assert simulation.time == 0.030001
    now = simulation.observe()
    assert now["drive_force"] == np.copysign(2000.0, before["drive_force"])
    assert now["bit_position"] == pytest.approx(before["bit_position"], abs=1e-8)
    simulation.advance(END)
    assert abs(simulation.energy()["residual_relative"]) < 1e-9
    assert simulation.blows.tobytes() != one_go(scene).blows.tobytes()


def test_inputs_that_do_not_change_hardly_change_the_motion(scene):
    simulation = Simulation(scene)
    simulation.advance(0.03)
    simulation.set_inputs(feed_force=2500.0, loading_stiffness=7.5e8)
    simulation.advance(END)
    whole = one_go(scene).blows
    assert simulation.blows["time"] == pytest.approx(whole["time"], rel=1e-3)


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"feed_force": float("nan")}, r"feed_force = nan N: must be a number from -1e9 to 1e9 N"),
        ({"drive_force": -1.0}, r"drive_force = -1.0 N: must be a number from 0 to 1e9 N"),
        ({"unloading_ratio": 1}, r"unloading_ratio = 1: must be a number above 1"),
        ({"reversal_distance": "far"}, r'reversal_distance = "far"'),
        ({"external_force": 1.0}, r'external_force has no effect .*effects.drive = "external"'),
        ({"feed": 1.0}, r"unknown input feed: there are feed_force"),
    ],
)
def test_bad_inputs_are_refused_and_change_nothing(inputs, message):
    simulation = Simulation(SCENES["rigid"])
    simulation.advance(0.03)
    before = bits(simulation)
    with pytest.raises(SimulationError, match=message):
        simulation.set_inputs(**{"loading_stiffness": 1e9, **inputs})
    assert bits(simulation) == before


# ----------------------------------------------------------------------- simulate


def test_a_trace_has_its_interval_and_every_step_of_a_window():
    result = simulate(SCENES["wave"], 0.05, settle=0.0, trace=1e-3, windows=[(0.02, 0.0201)])
    assert result.trace is not None
    times = result.trace["time"]
    inside = times[(times > 0.02) & (times <= 0.0201)]
    assert len(inside) - int(1e-4 / result.time_step) in (0, 1)  # by where a step begins
    assert np.diff(inside) == pytest.approx(result.time_step)
    assert len(times) == 51 + len(inside)
    assert np.isin(np.arange(50) * 1e-3, times).all()
    assert np.all(np.diff(times) > 0)


@pytest.mark.parametrize(
    "arguments",
    [{"trace": 0.0}, {"trace": "x"}, {"trace": 1e-12}, {"windows": [(0.2, 0.1)]},
     {"windows": [(0.0, 1.0)]}],
)  # fmt: skip
def test_senseless_sampling_is_refused(arguments):
    with pytest.raises(SimulationError):
        simulate(SCENES["rigid"], 0.5, settle=0.0, **arguments)


def test_senseless_times_are_refused():
    with pytest.raises(SceneError, match=r"run\.duration"):
        simulate(SCENES["rigid"], 0.0)
    with pytest.raises(SceneError, match=r"run\.settle"):
        simulate(SCENES["rigid"], 0.5, settle=0.5)


@pytest.mark.parametrize("work", [simulate, Simulation, settled])
def test_a_file_in_place_of_its_scene_is_refused(work):
    with pytest.raises(SceneError, match=r'"drill.toml": must be a Scene; Scene.from_toml'):
        work("drill.toml")


def test_a_settling_time_that_no_longer_fits_is_shortened_and_said():
    result = simulate(SCENES["rigid"], 0.8)
    assert result.settle == 0.2
    assert any("blows count from 0.2 s on" in text for text in result.warnings)


def test_sampling_times_end_with_the_run():
    times = sampling_times(0.3, None, 0.1, [])
    assert times.tolist() == [0.0, 0.1, 0.2, 0.3]


def test_an_interrupted_run_keeps_what_is_finished():
    def interrupt(t):
        signal.raise_signal(signal.SIGINT)

    result = simulate(SCENES["rigid"], 1e4, progress=interrupt, on_interrupt="keep")
    assert result.cut_short
    assert 0 < result.duration < 1
    assert result.warnings[-1].startswith("interrupted at t = ")


def test_a_second_interrupt_raises():
    def ask_twice(stop):
        signal.raise_signal(signal.SIGINT)
        assert stop()
        signal.raise_signal(signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    with stop_on_interrupt(True) as stop, pytest.raises(KeyboardInterrupt):
        ask_twice(stop)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_state_that_is_not_finite_is_an_error_that_names_the_time():
    simulation = Simulation(SCENES["wave"])
    simulation.advance(0.01)
    simulation._state.record["v_p"] = np.nan
    with pytest.raises(SimulationError, match=r"at t = 0\.\d+ s the state is no longer finite"):
        simulation.advance(0.1)
