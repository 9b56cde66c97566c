"""State of a hammer as bytes: numbers of the instance, its inputs, its motion."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np

from fmu_src.slave.calls import Phase
from fmu_src.slave.states import fill_solver, pack, solver_bytes, unpack
from percussion_model.scene.inputs import INPUTS

if TYPE_CHECKING:
    from fmu_src.hammer.slave import PercussiveHammer

# Numbers of an instance in a saved state.
NUMBERS = struct.Struct("<BBdddQd")  # phase, moving, start, now, time, blows, step size


def save(hammer: PercussiveHammer) -> bytes:
    """State of a hammer; ValueError before there is one."""
    if hammer.phase == Phase.INSTANTIATED or hammer.motion is None:
        raise ValueError("there is no state to save before the initialisation has ended")
    hammer.take_late()
    motion = hammer.motion
    motion.peaks()
    numbers = NUMBERS.pack(
        hammer.phase, 1, hammer.start_time, hammer.now, motion.time,
        motion.blow_count, motion.step_size,
    )  # fmt: skip
    inputs = [hammer.values[one.reference] for one in hammer.inputs]
    acting = [hammer.acting[name] for name in INPUTS]
    floats = np.array(
        [*hammer.given_inputs, *inputs, *acting, motion.stress(), *motion.before()], float
    )
    body = numbers + floats.tobytes() + motion.row.tobytes()
    body += motion.row_of_blow.view(np.uint8).tobytes() + solver_bytes(motion._state)
    return pack(hammer.fingerprint, body)


def restore(hammer: PercussiveHammer, state: bytes) -> None:
    """Go back to a state; `StateError` if it is none of this hammer."""
    if hammer.motion is None:
        hammer.check(hammer.values)
        hammer.ready()
    body = unpack(hammer.fingerprint, state)
    hammer.late.clear()
    phase, _, start, now, time, blows, step_size = NUMBERS.unpack_from(body)
    at = NUMBERS.size
    count = len(hammer.inputs)
    floats = np.frombuffer(body, np.float64, 2 * count + len(INPUTS) + 4, at)
    at += floats.nbytes
    _set_inputs(hammer, floats[:count])
    if [hammer.values[one.reference] for one in hammer.inputs] != hammer.given_inputs:
        hammer.motion = None  # the solver was made with other inputs
    motion = hammer.ready()
    _set_inputs(hammer, floats[count : 2 * count])
    acting = floats[2 * count :][: len(INPUTS)]
    row = np.frombuffer(body, np.float64, len(motion.row), at)
    at += row.nbytes
    blow = np.frombuffer(body, np.uint8, motion.row_of_blow.nbytes, at)
    at += blow.nbytes
    fill_solver(motion._state, body[at:])
    motion.adopt((time, step_size), (blows, blow), row, floats[-4:])
    hammer.acting = dict(zip(INPUTS, acting.tolist(), strict=True))
    hammer.phase, hammer.start_time, hammer.now = Phase(phase), start, now
    hammer.look_at_inputs()


def _set_inputs(hammer: PercussiveHammer, values: np.ndarray) -> None:
    for one, value in zip(hammer.inputs, values, strict=True):
        hammer.values[one.reference] = bool(value) if one.type == "Boolean" else float(value)
