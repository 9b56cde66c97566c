"""Compiled calls: all FMU calls of a step, one after another.

Python takes longer to make a call of an FMU than a small FMU takes to answer it. So where all
parts are FMUs a step is a list of calls, and one compiled function makes them: it moves the
values of outputs to the inputs that take them, and checks each status and number.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Mapping, Sequence
from enum import IntEnum
from importlib.util import find_spec
from typing import Any

import numpy as np

from percussion_model.coupling.component import LARGEST, WARNING, Component, Group
from percussion_model.coupling.port import Port
from percussion_model.physics.kernel import entry_of, nogil, when_compiling

STEP, SET_REAL, SET_INTEGER, GET_REAL, GET_INTEGER, GET_BOOLEAN = range(6)
SETTERS = {"Real": SET_REAL, "Integer": SET_INTEGER, "Boolean": SET_INTEGER}
GETTERS = {"Real": GET_REAL, "Integer": GET_INTEGER, "Boolean": GET_BOOLEAN}
DONE, NOT_FINITE, TOO_LARGE = -1, -2, -3  # statuses of FMI are from 0 on

CALL = np.dtype(
    [
        ("kind", np.int64),
        ("port", np.int64),  # whose call it is
        ("function", np.int64),  # address
        ("component", np.int64),  # address
        ("references", np.int64),  # address
        ("values", np.int64),  # address of the first one in `reals` or `integers`
        ("count", np.int64),
        ("room", np.int64),  # place of the first one there
        ("place", np.int64),  # of the first one in `places`
        ("every", np.int64),  # steps of the loop that are done as one
    ]
)


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


class At(IntEnum):
    """Where the calls of a run are."""

    STEP = 0  # number of the present step
    STEPS = 1  # in all
    FAILED_CALL = 2  # the call that did not succeed, `DONE` where all did
    STATUS = 3  # of that call


@nogil
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
    reals, integers : ndarray
        What the calls read and write.
    at : ndarray of int64, shape (len(At),)
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
                elif integers[call.room + i] != int(value):
                    integers[call.room + i] = int(value)
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
                        value = float(integers[call.room + i])
                    elif call.kind == GET_BOOLEAN:
                        value = 1.0 if integers[call.room + i] != 0 else 0.0
                    values[places[call.place + i]] = value
                    if not math.isfinite(value):
                        status = NOT_FINITE
        if status > WARNING or status < 0:
            at[At.FAILED_CALL] = k
            at[At.STATUS] = status
            return
    at[At.FAILED_CALL] = DONE


class CompiledStep:
    """A step of a system as a list of calls.

    Parameters
    ----------
    ports : sequence of Port
        All of them of FMUs, with nothing on the way.
    order : {"jacobi", "gauss-seidel"}
    count : int
        Steps of the run.
    every : mapping
        Steps that a part does as one, by component.
    """

    def __init__(
        self, ports: Sequence[Port], order: str, count: int, every: Mapping[str, int]
    ) -> None:
        self.ports = list(ports)
        self._every, self._count = every, count
        self._calls: list[tuple[Any, ...]] = []
        self._names: list[str] = []
        self._places: list[int] = []
        groups = [g for port in ports for g in (*port.writer.groups, *port.reader.groups)]
        room = sum(group.end - group.begin for group in groups)
        # no number is equal to these: all inputs are set in the first step
        self._reals = np.full(room, np.nan)
        self._integers = np.full(room, np.iinfo(np.int32).min, np.int32)
        self._room = 0
        for port in ports:
            self._set_and_step(port)
            if order == "gauss-seidel":
                self._read(port)
        if order == "jacobi":
            for port in ports:
                self._read(port)
        self._all = np.array(self._calls, CALL)
        self._values = np.array(self.ports[0].values, float)
        self._at = np.array([0, count, DONE, 0], np.int64)
        places = np.array(self._places, np.int64)
        self._arrays = (self._all, places, self._values, self._reals, self._integers, self._at)
        # with no calls: so that the kernel is there, and its entry known
        make_calls(self._all[:0], *self._arrays[1:], 0.0, 0.0)
        self._make = entry_of(make_calls)

    def _set_and_step(self, port: Port) -> None:
        for group in port.writer.groups:
            sources = port.places[group.begin : group.end]
            self._exchange(port, group, SETTERS[group.family], sources)
        function = ctypes.cast(port.part.stepper, ctypes.c_void_p).value
        self._calls.append((STEP, self.ports.index(port), function, port.part.pointer.value,
                            0, 0, 0, 0, 0, self._pace(port)))  # fmt: skip
        self._names.append("fmi2DoStep")

    def _read(self, port: Port) -> None:
        begin = port.begin
        for group in port.reader.groups:
            places = list(range(begin + group.begin, begin + group.end))
            self._exchange(port, group, GETTERS[group.family], places)

    def _pace(self, port: Port) -> int:
        return min(int(self._every.get(port.name, 1)), int(self._count))

    def _exchange(self, port: Port, group: Group, kind: int, places: Sequence[int]) -> None:
        room = self._reals if group.family == "Real" else self._integers
        self._calls.append(
            (
                kind,
                self.ports.index(port),
                ctypes.cast(group.call, ctypes.c_void_p).value,
                port.part.pointer.value,
                ctypes.addressof(group.arguments[1]),
                room.ctypes.data + room.itemsize * self._room,
                len(places),
                self._room,
                len(self._places),
                self._pace(port),
            )
        )
        self._names.append(group.name)
        self._places += places
        self._room += len(places)

    def __call__(self, time: float, step: float) -> None:
        """Let all parts do a communication step [s]."""
        at = self._at
        self._make(*self._arrays, time, step)
        if at[At.FAILED_CALL] != DONE:
            self._fail(int(at[At.FAILED_CALL]), int(at[At.STATUS]))
        at[At.STEP] += 1

    def _fail(self, call: int, status: int) -> None:
        port = self.ports[self._all[call]["port"]]
        self.publish()
        if status == NOT_FINITE:
            port.refuse(port.values[port.begin : port.end])
        if status == TOO_LARGE:
            values = [port.values[place] for place in port.places]
            port.part.refuse_large(port.writer.names, values)
        port.part.fail(self._names[call], status)

    def publish(self) -> None:
        """Put the present values where the ports look for them."""
        self.ports[0].values[:] = self._values.tolist()


def can_compile(ports: Sequence[Port]) -> bool:
    """Whether all are FMUs of FMI 2.0, with nothing on the way, and there is what compiles."""
    return find_spec("numba") is not None and all(
        type(port.part) is Component and port.on_way is None and not port.converts for port in ports
    )
