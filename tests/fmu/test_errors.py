"""What goes wrong is said: in the log, with variable, value and bound, and to the host."""

from __future__ import annotations

import math

import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException

NAN, INFINITE = math.nan, math.inf


@pytest.fixture(params=["RigidHammer", "NumbaRigidHammer"])
def make(make, request):
    """Make instances that run by a library, and by numba."""

    def one(**arguments):
        instance = make(request.param, **arguments)
        del instance.messages[:]  # the first one says why it runs by numba
        return instance

    return one


def fails(instance, action, *words):
    """Do what must fail; the log has all the words in one message."""
    before = len(instance.messages)
    with pytest.raises(FMICallException):
        action()
    said = instance.messages[before:]
    assert any(all(word in text for word in words) for text in said), said


@pytest.mark.parametrize(
    ("name", "value", "bound"),
    [
        ("loss.time", -1.0, "from 0 to 0.001 s"),
        ("bit.sections[1].length", 0.0, "above 0"),
        ("bit.sections[1].density", NAN, "above 0"),
        ("start.gap", 101.0, "from 0 to 100 m"),
        ("solver.cells", -3, "from 1 to 100000"),
        ("solver.accuracy", 0.5, "from 0.0001 to 0.1"),
        ("effects.rock", 9, '"wall"'),
        ("drive.effective_area", 11.0, "from 0 to 10 m^2"),
        ("gauge.position", 7.0, "0.20125 m long"),
        ("feed_force", INFINITE, "from -1e9 to 1e9 N"),
        ("supply_pressure", -1.0, "from 0 to 1e9 Pa"),
        ("rock.unloading_ratio", 1.0, "above 1"),
        ("drive.reversal_distance", 0.0, "above 0"),
    ],
)
def test_a_bad_start_fails_in_the_initialisation(make, name, value, bound):
    instance = make(start=False)
    instance.set({name: value})
    shown = "nan" if value != value else f"{value}".rstrip("0").rstrip(".")
    fails(instance, instance.start, name, shown, bound)


def test_contradictions_fail_in_the_initialisation(make):
    instance = make(start=False)
    instance.set({"piston.model": "absent"})
    fails(instance, instance.start, "effects.drive", "needs a piston")
    instance = make(start=False)
    instance.set({"solver.accuracy": 1e-3, "solver.cells": 40})
    fails(instance, instance.start, "solver.accuracy = 0.001", "solver.cells = 40", "one of them")


TURNS = {"effects.rotation": True, "rotation.mean_radius": 0.03}


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"effects.breaking": True}, "needs hole_diameter"),
        ({"effects.breaking": True, "hole_diameter": 0.1}, "needs breaking.buttons"),
        ({"effects.rotation": True}, "needs rotation.mean_radius"),
        (
            {**TURNS, "rotation.old_line": True, "effects.cuttings": True},
            "effects.rotation and effects.cuttings both say",
        ),
        (
            {**TURNS, "rotation.full_torque": 500.0, "rotation.stall_torque": 400.0},
            "must be at most rotation.stall_torque = 400.0 N m",
        ),
    ],
)
def test_contradictions_of_breaking_and_rotation_are_refused_as_well(make, values, words):
    instance = make(start=False)
    instance.set(values)
    fails(instance, instance.start, words)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("feed_force", NAN),
        ("feed_force", -INFINITE),
        ("supply_pressure", NAN),
        ("piston_force", NAN),  # though it has no effect here
        ("rock.loading_stiffness", 0.0),
        ("rock.barrier_energy", -1.0),
    ],
)
def test_a_bad_input_ends_the_step_and_touches_nothing(make, name, value):
    instance, twin = make(), make()
    for one in (instance, twin):
        for _ in range(9):
            one.step(7e-3)
    good = instance.get(name)
    instance.set({name: value})
    before = instance.save()
    fails(instance, lambda: instance.slave.doStep(instance.time, 7e-3), name, "must be")
    assert instance.save() == before
    instance.set({name: good})
    for one in (instance, twin):
        one.step(7e-3)
    assert instance.values(instance.outputs) == twin.values(twin.outputs)


def test_a_host_sees_the_failure_of_a_step(rigid):
    import numpy as np

    signals = np.array([(0.0, 2500.0), (0.1, NAN), (0.2, NAN)],
                       dtype=[("time", float), ("feed_force", float)])  # fmt: skip
    with pytest.raises(FMICallException):
        simulate_fmu(str(rigid), stop_time=0.2, step_size=0.01, input=signals)


@pytest.mark.parametrize("step", [0.0, -1e-3, NAN, INFINITE])
def test_a_step_of_no_length_is_refused(make, step):
    instance = make()
    fails(instance, lambda: instance.slave.doStep(0.0, step), "communicationStepSize")


def test_stepping_backwards_is_refused(make):
    instance = make()
    instance.step(0.1)
    fails(instance, lambda: instance.slave.doStep(0.05, 0.1), "0.05 s lies before", "0.1 s")
    fails(instance, lambda: instance.slave.doStep(0.2, 0.1), "0.2 s lies after")
    instance.step(0.1)  # and from where it was it goes on


def test_points_that_differ_by_rounding_are_accepted(make):
    instance = make()
    step = 1e-3
    for k in range(2000):  # one master multiplies, another one adds
        instance.slave.doStep(k * step, step)
    time = 2000 * step
    for _ in range(2000):
        instance.slave.doStep(time, step)
        time += step
    assert instance.get("blow_count") > 80


def test_calls_out_of_order_are_refused(make):
    instance = make(start=False)
    fails(instance, lambda: instance.slave.doStep(0.0, 0.1), "out of order")
    instance.start()
    fails(instance, instance.slave.enterInitializationMode, "out of order")
    instance.slave.terminate()
    fails(instance, lambda: instance.slave.doStep(0.0, 0.1), "out of order", "terminated")


def test_what_is_fixed_or_computed_cannot_be_set(make):
    instance = make()
    instance.step(0.01)
    fails(instance, lambda: instance.set({"loss.time": 1e-7}), "loss.time is fixed")
    fails(instance, lambda: instance.set({"bit.force": 1.0}), "bit.force is an output")
    fails(instance, lambda: instance.slave.getReal([987654]), "987654")


def test_percent_signs_reach_the_log_as_they_are(make):
    instance = make(start=False)
    other = type(instance)(instance.folder, name="100%s%n of it")
    other.set({"loss.time": -1.0})
    with pytest.raises(FMICallException):
        other.start()
    other.free()
    # as a printf format, which doubles none
    assert any("100%%s%%n of it" in text for text in other.messages)


def test_an_input_without_effect_is_noted_in_the_log(make):
    instance = make()
    instance.step(0.01)
    assert not instance.messages
    instance.set({"piston_force": 100.0})
    instance.step(0.01)
    assert any("no effect" in text for text in instance.messages)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"feed_force": -5000.0}, "off bottom"),
        ({"rock.loading_stiffness": 1e6}, "deeper than the buttons"),
        ({"drive.reversal_distance": 1e-18}, "storm"),
    ],
)
def test_the_log_says_once_where_the_motion_leaves_the_model(make, values, words):
    instance = make()
    instance.set(values)
    for _ in range(8):
        instance.step(0.05)
    said = [text for text in instance.messages if words in text]
    assert len(said) == 1, instance.messages
    assert "at t = " in said[0]


@pytest.mark.parametrize(("buttons", "deep"), [(1, 1), (1000, 0)])
def test_the_log_knows_the_power_law_and_its_buttons(make, buttons, deep):
    """2 MN/m of one button are too soft, those of a thousand are not."""
    changes = {"effects__rock": "power", "rock__loading_exponent": 1.5, "rock__buttons": buttons}
    instance = make(rock__loading_stiffness=2e6, **changes)
    for _ in range(8):
        instance.step(0.05)
    assert len([text for text in instance.messages if "deeper than the buttons" in text]) == deep


def test_the_log_says_once_that_the_barrier_is_not_small(make):
    instance = make(rock__barrier_energy=15.0)
    for _ in range(8):
        instance.step(0.05)
    assert len([text for text in instance.messages if "barrier is not small" in text]) == 1


def test_the_log_of_the_reference_is_silent(make):
    instance = make()
    for _ in range(40):
        instance.step(0.05)
    assert instance.messages == []
