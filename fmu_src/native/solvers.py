"""Which solver computes an image, in numbers as `Scene.solver_name` in words."""

from __future__ import annotations

from fmu_src.native.image import row_of
from fmu_src.native.layout import Kind
from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Piston, RockKind
from percussion_model.scene.bars import bar_transit_time
from percussion_model.scene.solver_choice import WhyWaves, why_waves
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.setup import PISTONS, ROCKS, Bit

_NAMES, _FIDELITIES = row_of("solver.name").choices, row_of("solver.fidelity").choices
AUTO, MODAL = _NAMES.index("auto"), _NAMES.index("modal")
BY_WAVES = _FIDELITIES.index("wave")


@preparing
def kind_of(numbers):
    """`Kind` of the solver; 0 for one that this library does not have."""
    values = numbers.values
    if values.bit_model != Bit.ELASTIC or values.solver_fidelity != BY_WAVES:
        return 0
    if values.effects_string:
        return 0
    if values.solver_name != AUTO:
        return Kind.MODAL.value if values.solver_name == MODAL else 0
    piston, bit = PISTONS[values.piston_model], bar_transit_time(numbers.bit)
    top = bar_transit_time(numbers.piston) if piston == Piston.ELASTIC else bit
    is_wall = ROCKS[values.effects_rock] == RockKind.WALL
    why = why_waves(
        piston == Piston.RIGID, is_wall, values.effects_loss != 0, values.loss_time, top, bit
    )
    return Kind.MODAL.value if why == WhyWaves.NOT else 0
