"""Which solver computes an image, in numbers as `Scene.solver_name` in words."""

from __future__ import annotations

from percussion_model.engine.records import KINDS, Kind
from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Piston
from percussion_model.scene.bars import bar_transit_time
from percussion_model.scene.parameters import row_of
from percussion_model.scene.rock_law import is_wall
from percussion_model.scene.solver_choice import WhyWaves, why_waves
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.setup import PISTONS, Bit

# By the choices of `solver.fidelity` and `solver.name`: 0 for waves, which a name divides, for
# "auto" and for solvers that others added.
BY_FIDELITY = tuple(
    0 if name == "wave" else int(KINDS[name]) for name in row_of("solver.fidelity").choices
)
BY_NAME = tuple(int(KINDS.get(name, 0)) for name in row_of("solver.name").choices)
AUTO = row_of("solver.name").choices.index("auto")


@preparing
def kind_of(numbers):
    """`Kind` of the solver; 0 for one that this library does not have."""
    values = numbers.values
    is_elastic = values.bit_model == Bit.ELASTIC
    if is_elastic and BY_FIDELITY[values.solver_fidelity] > 0:
        return BY_FIDELITY[values.solver_fidelity]
    if values.solver_name != AUTO:
        return BY_NAME[values.solver_name]
    if values.effects_string:
        return Kind.WAVE.value
    if not is_elastic:
        return Kind.RIGID.value
    piston, bit = PISTONS[values.piston_model], bar_transit_time(numbers.bit)
    top = bar_transit_time(numbers.piston) if piston == Piston.ELASTIC else bit
    has_loss = values.effects_loss != 0
    why = why_waves(is_wall(values), has_loss, values.loss_time, top, bit)
    return Kind.MODAL.value if why == WhyWaves.NOT else Kind.WAVE.value
