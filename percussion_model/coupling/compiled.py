"""Compiled calls: all FMU calls of a step, one after another.

Python takes longer to make a call of an FMU than a small FMU takes to answer it. So where all
parts are FMUs a step is a list of calls, and compiled code makes them (`calls`).
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from percussion_model.coupling.calls import (
    CALL,
    DONE,
    GET_BOOLEAN,
    GET_INTEGER,
    GET_REAL,
    INTEGER,
    NOT_FINITE,
    SET_INTEGER,
    SET_REAL,
    STEP,
    TOO_LARGE,
    At,
)
from percussion_model.coupling.component import Component, Group
from percussion_model.coupling.port import Port
from percussion_model.engine.compiler import NoCompilerError
from percussion_model.engine.library import entries_of
from percussion_model.physics.kernel import DISABLED

SETTERS = {"Real": SET_REAL, "Integer": SET_INTEGER, "Boolean": SET_INTEGER}
GETTERS = {"Real": GET_REAL, "Integer": GET_INTEGER, "Boolean": GET_BOOLEAN}


class CompiledSteps:
    """Steps of a system as a list of calls.

    Parameters
    ----------
    ports : sequence of Port
        All of them of FMUs, with nothing on the way.
    order : {"jacobi", "gauss-seidel"}
    start, step : float
        Of the run [s].
    count : int
        Steps of the run.
    every : mapping
        Steps that a part does as one, by component.
    """

    def __init__(
        self,
        ports: Sequence[Port],
        order: str,
        start: float,
        step: float,
        count: int,
        every: Mapping[str, int],
    ) -> None:
        self.ports = list(ports)
        self._every, self._count = every, count
        self._calls: list[tuple[Any, ...]] = []
        self._names: list[str] = []
        self._places: list[int] = []
        groups = [g for port in ports for g in (*port.writer.groups, *port.reader.groups)]
        room = sum(group.end - group.begin for group in groups)
        self._reals, self._integers = np.empty(room), np.empty(room, np.int32).view(INTEGER)
        self._forget()
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
        self._where = np.array(self._places, np.int64)
        sizes = len(self._all), len(self._where), len(self._values), room
        self._at = np.array([0, count, DONE, 0, *sizes], np.int64)
        self._exchange_once()
        addresses = self._addresses(self._all, self._values, self._at)
        make = entries_of("calls").run

        def go(until: int) -> None:
            make(*addresses, until, start, step)

        self._go = go

    def _addresses(self, *arrays: np.ndarray) -> list[int]:
        calls, values, at = arrays
        used = calls, self._where, values, self._reals, self._integers, at
        return [one.ctypes.data for one in used]

    def _forget(self) -> None:
        """Set all inputs in the next step: no number is equal to these."""
        self._reals[:] = np.nan
        self._integers["value"] = np.iinfo(np.int32).min

    def _exchange_once(self) -> None:
        """Set and read all, so that the first step has not to bring all of it into memory."""
        calls = self._all[self._all["kind"] != STEP]
        values, at = self._values.copy(), self._at.copy()
        at[At.CALLS] = len(calls)
        entries_of("calls").run(*self._addresses(calls, values, at), 1, 0.0, 0.0)
        if at[At.FAILED_CALL] != DONE:  # which the first step tells
            self._forget()

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

    def go(self, until: int) -> None:
        """Let all parts do their steps until so many are done."""
        self._go(until)
        if self._at[At.FAILED_CALL] != DONE:
            self._fail(int(self._at[At.FAILED_CALL]), int(self._at[At.STATUS]))

    @property
    def done(self) -> int:
        """Steps that all parts have done."""
        return int(self._at[At.STEP])

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
    """Whether all are FMUs of FMI 2.0, with nothing on the way, and there is compiled code."""
    if DISABLED or not all(
        type(port.part) is Component and port.on_way is None and not port.converts for port in ports
    ):
        return False
    try:
        entries_of("calls")
    except NoCompilerError:
        return False
    return True
