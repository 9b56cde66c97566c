"""Outputs at the start: they are those of time zero, and depend on what the description says."""

from __future__ import annotations

import random

import pytest

from fmu_src.parts import (
    controller,
    drill_string,
    rig_feed,
    rock_profile,
    supply,
)
from fmu_src.parts.build import part_variables
from tests.system.models import begun

PARTS = (controller, drill_string, rig_feed, rock_profile, supply)
# Starts at which everything touches, hangs apart, or already moves.
STARTS = (
    {},
    {"start.gap": 0.0, "start.rock_gap": 0.0, "start.bit_velocity": 1.0},
    {"start.gap": 1e-3, "start.rock_gap": 1e-3, "start.bit_velocity": 0.5},
)
TRIES, TRIES_OF_HAMMER = 200, 10


def drawn(rng: random.Random, start, lower, upper):
    """A value of the kind of a start, half to three times as large, within bounds."""
    if isinstance(start, bool):
        return rng.random() < 0.5
    size = abs(start) or 1.0
    value = min(max(start + size * rng.uniform(-0.5, 2.0), lower), upper)
    return round(value) if isinstance(start, int) else value


@pytest.mark.parametrize("module", PARTS, ids=lambda module: module.TABLE.name)
def test_a_part_depends_on_the_inputs_that_it_names(module):
    """Each dependence that shows is described, and each described one shows."""
    part, rng = module.TABLE, random.Random(7)
    described = {one.name: one.at_start for one in part_variables(part) if one.name in part.outputs}
    seen = {name: set() for name in part.outputs}
    values = {name: set() for name in part.outputs}
    for _ in range(TRIES):
        parameters = {}
        for name, (unit, lower, upper, start, _) in part.parameters.items():
            choice = rng.choice(start) if isinstance(start, tuple) else start
            free = rng.random() < 0.3 and not isinstance(start, tuple) and unit != "count"
            parameters[name] = drawn(rng, choice, lower, upper) if free else choice
        inputs = {name: drawn(rng, entry[3], *entry[1:3]) for name, entry in part.inputs.items()}

        def outputs(parameters=parameters, **given):
            return begun(part.name, parameters, given).outputs()

        base = outputs(**inputs)
        for name, value in base.items():
            values[name].add(value)
        for changed, entry in part.inputs.items():
            other = outputs(**inputs | {changed: drawn(rng, entry[3], *entry[1:3])})
            for name in part.outputs:
                if other[name] != base[name]:
                    seen[name].add(changed)
    for name, inputs in described.items():
        if inputs is None:
            assert len(values[name]) == 1, name
        elif name != "in_void":  # no layer that was drawn is that soft
            assert seen[name] == set(inputs), name


@pytest.mark.parametrize("name", ["PercussiveHammer", "RigidHammer"])
def test_a_hammer_depends_on_the_inputs_that_it_names(name, make):
    """No input but those described moves an output, and what depends on nothing is one number."""
    rng, constants = random.Random(3), {}
    for start in STARTS:
        instance = make(name, start=False)
        instance.set(start)
        instance.slave.setupExperiment(startTime=0.0)
        instance.slave.enterInitializationMode()
        described = {
            one.variable.name: {other.name for other in one.dependencies}
            for one in instance.description.initialUnknowns
        }
        inputs = [one for one in instance.variables.values() if one.causality == "input"]
        before = instance.values(instance.outputs)
        for changed in inputs * TRIES_OF_HAMMER:
            if changed.type == "Boolean":
                value = rng.random() < 0.5
            else:
                value = drawn(rng, float(changed.start), float(changed.min), float(changed.max))
            instance.set({changed.name: value})
            after = instance.values(instance.outputs)
            for output, old, new in zip(instance.outputs, before, after, strict=True):
                assert old == new or changed.name in described[output], (output, changed.name)
                if not described[output]:
                    constants.setdefault(output, set()).add(new)
            before = after
    assert constants
    moved = {name: values for name, values in constants.items() if len(values) > 1}
    assert not moved


@pytest.mark.parametrize("name", ["PercussiveHammer", "RigidHammer"])
def test_outputs_at_the_start_are_the_start(name, make):
    instance = make(name, **{"start.bit_velocity": 0.25, "start.piston_velocity": 7.5})
    assert instance.get("bit.velocity") == 0.25
    assert instance.get("piston.velocity") == pytest.approx(7.5, rel=1e-15)
    zeros = (
        "bit.position", "piston.position", "hole_depth", "bit.impulse", "contact.impulse",
        "casing.impulse", "rate_of_penetration", "energy_residual",
    )  # fmt: skip
    assert instance.values(zeros) == [0.0] * len(zeros)
