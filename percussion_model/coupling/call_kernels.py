"""Steps of a system whose parts are all FMUs, as compiled code does them.

A step is a list of calls: it moves the values of outputs to the inputs that take them, and checks
each status and number.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from percussion_model.coupling.calls import (
    CALL,
    DONE,
    GET_BOOLEAN,
    GET_INTEGER,
    INTEGER,
    LARGEST,
    NOT_FINITE,
    SET_INTEGER,
    SET_REAL,
    STEP,
    TOO_LARGE,
    WARNING,
    WORDS_OF_AT,
    At,
)
from percussion_model.engine.entries import OTHERS
from percussion_model.engine.memory import floats_at, records_at, words_at
from percussion_model.physics.kernel import kernel, preparing, when_compiling

calls_at, integers_at = records_at(CALL), records_at(INTEGER)


def exchange(function: int, component: int, references: int, count: int, values: int) -> int:
    """Call a getter or a setter of an FMU; all arguments are addresses but for the count."""
    raise NotImplementedError("only compiled code makes such calls")


def do_step(function: int, component: int, time: float, step: float, forward: Any) -> int:
    """Call `fmi2DoStep`."""
    raise NotImplementedError("only compiled code makes such calls")


def _teach() -> None:
    from percussion_model.coupling import instructions
    from percussion_model.physics.compiling import instruct

    instruct(exchange, instructions.exchange)
    instruct(do_step, instructions.do_step)


when_compiling(_teach)


@kernel
def make_calls(
    calls: np.ndarray,
    places: np.ndarray,
    values: np.ndarray,
    reals: np.ndarray,
    integers: np.ndarray,
    at: np.ndarray,
    time: float,
    step: float,
) -> None:
    """Make all calls of a step.

    Parameters
    ----------
    calls : ndarray of CALL
    places : ndarray of int64
        Place in `values` for each value of each call.
    values : ndarray
        Present outputs of all parts.
    reals, integers : ndarray, ndarray of INTEGER
        What the calls read and write.
    at : ndarray of int64, shape (WORDS_OF_AT,)
        Where the run is, and what did not succeed (`At`).
    time, step : float
        [s]
    """
    is_last = at[At.STEP] == at[At.STEPS] - 1
    for k in range(len(calls)):
        call = calls[k]
        since = at[At.STEP] % call.every + 1
        if since != call.every and not is_last:
            continue
        status = 0
        if call.kind == STEP:
            begin = time - (since - 1) * step
            status = do_step(call.function, call.component, begin, since * step, np.int32(1))
        elif call.kind == SET_REAL or call.kind == SET_INTEGER:
            new = False
            for i in range(call.count):
                value = values[places[call.place + i]]
                if call.kind == SET_REAL:
                    if reals[call.room + i] != value:
                        reals[call.room + i] = value
                        new = True
                elif not abs(value) < LARGEST:
                    status = TOO_LARGE
                elif integers[call.room + i].value != int(value):
                    integers[call.room + i].value = int(value)
                    new = True
            if new and status == 0:
                status = exchange(
                    call.function, call.component, call.references, call.count, call.values
                )
        else:
            status = exchange(
                call.function, call.component, call.references, call.count, call.values
            )
            if status <= WARNING:
                for i in range(call.count):
                    value = reals[call.room + i]
                    if call.kind == GET_INTEGER:
                        value = float(integers[call.room + i].value)
                    elif call.kind == GET_BOOLEAN:
                        value = 1.0 if integers[call.room + i].value != 0 else 0.0
                    values[places[call.place + i]] = value
                    if not math.isfinite(value):
                        status = NOT_FINITE
        if status > WARNING or status < 0:
            at[At.FAILED_CALL] = k
            at[At.STATUS] = status
            return
    at[At.FAILED_CALL] = DONE


@preparing
def run(
    calls: int,
    places: int,
    values: int,
    reals: int,
    integers: int,
    at: int,
    until: int,
    start: float,
    step: float,
) -> int:
    """Do the steps of a run until so many are done, or a call does not succeed.

    All arguments but the last three are addresses: arrays of `make_calls`.
    """
    where = words_at(at, WORDS_OF_AT)
    room = where[At.ROOM]
    given = calls_at(calls, where[At.CALLS]), words_at(places, where[At.PLACES])
    found, numbers = floats_at(values, where[At.VALUES]), floats_at(reals, room)
    wholes = integers_at(integers, room)
    while where[At.STEP] < until:
        time = start + where[At.STEP] * step
        make_calls(given[0], given[1], found, numbers, wholes, where, time, step)
        if where[At.FAILED_CALL] != DONE:
            break
        where[At.STEP] += 1
    return where[At.STEP]


EXPORTED = {f"calls_{name}": (name, form) for name, form in OTHERS["calls"].items()}
