"""Values of all kinds by all setters: a clear failure of the call, or outputs that are finite."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

NASTY = (
    *(math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, -5e-324, 2.2e-308),
    *(1e-12, -1e-12, 1.0, -1.0, 1e6, 1e9, -1e9, 1.8e308, -1.8e308),
)
WHOLE = (0, 1, -1, 2, 7, 2**31 - 1, -(2**31))
STEP = 1e-3
# Outputs that may be undefined before there was a blow, and of rigid bodies.
NUMBERS = ("Real", "Integer")


def settable(instance, kinds, stepping):
    """Names of inputs, and of parameters that can be set now."""
    names = []
    for name, one in instance.variables.items():
        if one.type not in kinds or one.causality == "output":
            continue
        if stepping and one.causality != "input" and one.variability != "tunable":
            continue
        if one.causality in ("input", "parameter") and not (
            not stepping and one.causality == "parameter" and name.startswith("run.")
        ):
            names.append(name)
    return names


def attempt(instance, action):
    """Do something; where it fails the log says so in one clear message."""
    before = len(instance.messages)
    try:
        action()
    except FMICallException:
        said = instance.messages[before:]
        assert any(text.strip() for text in said), "failed without a word"
        assert not any("Traceback" in text for text in said), said
        return False
    return True


def not_finite(instance):
    """What of the motion that can be read is not finite: names and values."""
    moving = [name for name in instance.outputs if "position" in name or "velocity" in name]
    moving += [name for name in instance.outputs if name.endswith("force")]
    assert moving
    values = [instance.get(name) for name in moving]
    return [
        (name, value)
        for name, value in zip(moving, values, strict=True)
        if isinstance(value, float) and not math.isfinite(value)
    ]


def test_inputs_of_all_values_fail_clearly_or_stay_finite(make):
    instance = make()
    instance.step(STEP)
    undefined = {name for name, _ in not_finite(instance)}
    saved, time = instance.save(), instance.time
    accepted = 0
    for name in settable(instance, ("Real",), stepping=True):
        refused = set()
        for value in NASTY:
            instance.restore(saved, time)

            def go(name=name, value=value):
                instance.set({name: value})
                instance.step(STEP)

            if attempt(instance, go):
                accepted += 1
                bad = [one for one in not_finite(instance) if one[0] not in undefined]
                assert not bad, (name, value, bad)
            else:
                refused.add(str(value))
        assert {"nan", "inf", "-inf"} <= refused, name  # never an input
    assert accepted > 20


def test_random_values_at_every_step_fail_clearly_or_stay_finite(make):
    instance = make()
    undefined = {name for name, _ in not_finite(instance)}
    rng = np.random.default_rng(6)
    names = settable(instance, ("Real",), stepping=True)
    fine = 0
    for _ in range(300):
        saved, time = instance.save(), instance.time
        name = str(rng.choice(names))
        size = 10.0 ** rng.uniform(-3, 6)
        value = float(rng.choice([size, -size, NASTY[rng.integers(len(NASTY))]]))

        def go(name=name, value=value):
            instance.set({name: value})
            instance.step(STEP)

        if attempt(instance, go):
            fine += 1
            bad = [one for one in not_finite(instance) if one[0] not in undefined]
            assert not bad, (name, value, bad)
        else:
            instance.restore(saved, time)
    assert fine > 50


def test_parameters_of_all_values_fail_clearly_or_stay_finite(make):
    rng = np.random.default_rng(7)
    first = make(start=False)
    reals = settable(first, ("Real",), stepping=False)
    others = settable(first, ("Integer", "Enumeration"), stepping=False)
    drawn = [(name, NASTY[rng.integers(len(NASTY))]) for name in rng.permutation(reals)[:30]]
    drawn += [(name, WHOLE[rng.integers(len(WHOLE))]) for name in rng.permutation(others)[:10]]
    undefined = {name for name, _ in not_finite(make())}
    outcomes = {True: 0, False: 0}
    for name, value in drawn:
        instance = make(start=False)

        def go(instance=instance, name=name, value=value):
            instance.set({str(name): value})
            instance.start()
            instance.step(STEP)

        accepted = attempt(instance, go)
        outcomes[accepted] += 1
        if isinstance(value, float) and not math.isfinite(value):
            assert not accepted, (name, value)
        if accepted:
            bad = [one for one in not_finite(instance) if one[0] not in undefined]
            assert not bad, (name, value, bad)
        instance.free()
    assert min(outcomes.values()) > 5


@pytest.mark.parametrize("setter", ["setReal", "setInteger", "setBoolean", "setString"])
def test_values_of_the_wrong_type_are_refused(make, setter):
    instance = make(start=False)  # then parameters are refused for their type alone
    given = [one for one in instance.variables.values() if one.causality != "output"]
    before = instance.values(one.name for one in given)
    wrong = {"setReal": 1.5, "setInteger": 3, "setBoolean": True, "setString": "x"}[setter]
    right = {"setReal": ("Real",), "setInteger": ("Integer", "Enumeration")}
    right |= {"setBoolean": ("Boolean",), "setString": ("String",)}
    others = [one for one in given if one.type not in right[setter]]
    assert len(others) > 10
    for one in others:
        call = getattr(instance.slave, setter)
        assert not attempt(instance, lambda c=call, one=one: c([one.valueReference], [wrong]))
    np.testing.assert_array_equal(instance.values(one.name for one in given), before)
