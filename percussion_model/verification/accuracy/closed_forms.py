"""Motions with a closed form: references without a solver (docs/model.md, section 12)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import Simulation

_BARE = {
    "effects.gravity": False,
    "effects.feed": False,
    "effects.drive": "none",
    "effects.loss": False,
    "effects.barrier": False,
}
_SPRING = {**_BARE, "effects.rock": "spring", "start.rock_gap": 0.0}
_ALONE = {"piston.model": "absent", "start.bit_velocity": 5.25}


@dataclass(frozen=True)
class ClosedForm:
    """A motion whose answer is known."""

    name: str
    scene: Scene
    time: float  # at which the answer is known [s]
    column: str  # the quantity, of `SAMPLE_FIELDS`
    value: float  # its value then, SI units


def closed_forms() -> list[ClosedForm]:
    """Single impact, its first peak on rock, and a drop, with the bars of the reference."""
    usual = Scene()
    piston, bit, start = usual.piston, usual.bit, usual.start
    section = bit.sections[0]
    transit, speed = piston.transit_time, start.piston_velocity
    impact = start.gap / speed
    impedance = section.area * math.sqrt(section.youngs_modulus * section.density)
    stiffness = usual.rock.loading_stiffness

    def pressed_in(velocity: float, time: float) -> float:
        """Spring at the end of a bar that a wave of constant velocity meets [m]."""
        return impedance * velocity / stiffness * -math.expm1(-stiffness * time / impedance)

    meeting = usual.replace(**{**_BARE, "effects.rock": "none"})
    striking = usual.replace(**_SPRING)
    falling = usual.replace(**{**_SPRING, **_ALONE})
    passage = 2.0 * bit.transit_time
    return [
        ClosedForm(
            "equal bars meet: mean velocity of the bit",
            meeting,
            impact + 3.0 * transit,
            "bit_velocity",
            speed * piston.length / bit.length,
        ),
        ClosedForm(
            "piston on bit on a spring: first peak",
            striking,
            impact + bit.transit_time + 2.0 * transit,
            "bit_end_position",
            pressed_in(speed, 2.0 * transit),
        ),
        ClosedForm(
            "a bar falls on a spring: after two transits",
            falling,
            passage,
            "bit_end_position",
            pressed_in(falling.start.bit_velocity, passage),
        ),
    ]


def solver_error(case: ClosedForm, solver: str, count: int) -> float:
    """Relative error of a solver at a closed form.

    Parameters
    ----------
    case : ClosedForm
    solver : {"wave", "fem"}
    count : int
        Steps in the piston, or in the bit where it is alone; of the elements
        likewise, at the CFL step and with a stiff penalty.
    """
    if solver == "fem":
        changes = {"fem.elements": count, "fem.courant": 0.5, "fem.contact_stiffness": 1e14}
        if case.scene.piston.model == "absent":
            del changes["fem.contact_stiffness"]
    else:
        changes = {"solver.cells": count}
    simulation = Simulation(case.scene.computed_by(solver, **changes), record_events=False)
    simulation.advance(case.time)
    return abs(simulation.observe()[case.column] / case.value - 1.0)
