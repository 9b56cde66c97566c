"""Parts alone: compiled ones by their library, the others without FMI."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import struct
import tempfile
from pathlib import Path

import numpy as np

from fmu_src.flat_names import flat_name
from fmu_src.native.library import PARTS as LIBRARY
from fmu_src.native.library import libraries
from fmu_src.native.part_tables import part_tables
from fmu_src.parts.build import PARTS, part_variables
from fmu_src.parts.part import Room, record_of
from fmu_src.slave import native
from fmu_src.slave.native import this_platform
from fmu_src.slave.states import DIGEST, HEADER

GUID = "{0}"
# Bytes of a saved state before its values: the head, and the place (fmu_src/native/state.c).
VALUES_AT = 84 + 32
TIME_AT = 84 + 16
GETTERS = {"Boolean": ("Boolean", ctypes.c_int), "Integer": ("Integer", ctypes.c_int),
           "Enumeration": ("Integer", ctypes.c_int), "Real": ("Real", ctypes.c_double)}  # fmt: skip


@functools.cache
def resources(name):
    """Folder with the library and the tables of a part."""
    folder = Path(tempfile.mkdtemp(prefix="part-"))
    file = folder / native.library_name(this_platform())
    file.parent.mkdir(parents=True)
    file.write_bytes(libraries([this_platform()], which=LIBRARY)[this_platform()])
    tables = part_tables(PARTS[name], part_variables(PARTS[name]), GUID)
    (folder / native.MODEL).write_bytes(tables)
    return str(folder)


class Model:
    """A compiled part.

    Attributes
    ----------
    parameters : dict
        Values by name.
    """

    def __init__(self, name, parameters):
        self.part, self.parameters = PARTS[name], parameters
        self.variables = {one.name: one for one in part_variables(self.part)}
        self.messages = []
        self.component = native.Component(name, resources(name), self.messages)
        self.library, self.pointer = self.component.library, self.component.pointer
        self.time = 0.0
        self._set(parameters)

    def _call(self, name, *arguments):
        if getattr(self.library, f"fmi2{name}")(self.pointer, *arguments):
            raise ValueError(self.messages[-1].msg)

    def _set(self, values):
        for name, value in values.items():
            one = self.variables[name]
            word, kind = GETTERS[one.type]
            if isinstance(value, str):
                value = one.row.choices.index(value) + 1
            self._call(f"Set{word}", (ctypes.c_uint * 1)(one.reference), ctypes.c_size_t(1),
                       (kind * 1)(value))  # fmt: skip

    def begin(self, inputs):
        """Take the state at time zero."""
        self._set(inputs)
        start = ctypes.c_double(0.0)
        self._call("SetupExperiment", 0, ctypes.c_double(), start, 0, ctypes.c_double())
        self._call("EnterInitializationMode")
        self._call("ExitInitializationMode")
        self.inputs = dict(inputs)

    def step(self, inputs, step_size):
        """Advance by a communication step [s], the inputs held."""
        new = {name: value for name, value in inputs.items() if value != self.inputs.get(name)}
        self._set(new)
        self.inputs |= new
        self._call("DoStep", ctypes.c_double(self.time), ctypes.c_double(step_size), 0)
        self.time += step_size

    def outputs(self):
        """Present values by name."""
        found = {}
        for name in self.part.outputs:
            one = self.variables[name]
            word, kind = GETTERS[one.type]
            value = (kind * 1)()
            self._call(f"Get{word}", (ctypes.c_uint * 1)(one.reference), ctypes.c_size_t(1), value)
            found[name] = bool(value[0]) if one.type == "Boolean" else value[0]
        return found

    @property
    def _begin(self):
        """Where what moves begins in a saved state."""
        return VALUES_AT + 8 * (len(self.variables) + len(self.part.inputs))

    def save(self):
        """State as bytes."""
        pointer = ctypes.c_void_p()
        self._call("GetFMUstate", ctypes.byref(pointer))
        return bytearray(native.OwnState(self.component, pointer).to_bytes())

    @property
    def state(self):
        """What moves: the record of the law."""
        return np.frombuffer(self.save(), self.part.law.record, 1, self._begin)[0]

    @property
    def moving(self):
        """Numbers of the state behind the record."""
        return np.frombuffer(self.save(), float, -1, self._begin + self.part.law.record.itemsize)

    def change(self, **fields):
        """Restore the present state with other values of some fields."""
        saved = self.save()
        record = np.frombuffer(saved, self.part.law.record, 1, self._begin)[0]
        for name, value in fields.items():
            record[name] = value
        body = HEADER.size + DIGEST
        saved[HEADER.size : body] = hashlib.sha256(saved[: HEADER.size] + saved[body:]).digest()
        self.restore(saved)

    def restore(self, saved):
        """Go back to a saved state."""
        pointer = ctypes.c_void_p()
        self._call(
            "DeSerializeFMUstate", bytes(saved), ctypes.c_size_t(len(saved)), ctypes.byref(pointer)
        )
        state = native.OwnState(self.component, pointer)
        self._call("SetFMUstate", state.pointer)
        (self.time,) = struct.unpack_from("<d", saved, TIME_AT)
        self.inputs = {}


def make_model(name, **values):
    """Model of a part; `values` are parameters and inputs by name, `__` for a dot."""
    part = PARTS[name]
    given = {key.replace("__", "."): value for key, value in values.items()}
    assert given.keys() <= part.inputs.keys() | part.parameters.keys()
    inputs = {one: value for one, value in given.items() if one in part.inputs}
    parameters = _starts(part.parameters) | {k: v for k, v in given.items() if k not in inputs}
    return begun(name, parameters, start_inputs(name) | inputs)


def begun(name, parameters, inputs):
    """Model of a part at time zero."""
    part = PARTS[name]
    model = part.slave.MODEL(parameters) if part.law is None else Model(name, parameters)
    model.begin(inputs)
    return model


def start_inputs(name):
    """Inputs of a part at their starts."""
    return _starts(PARTS[name].inputs)


def _starts(entries):
    starts = {name: entry[3] for name, entry in entries.items()}
    return {name: s[0] if isinstance(s, tuple) else s for name, s in starts.items()}


def record(entries, values):
    """Record of parameters, or of inputs, as kernels have it."""
    found = np.zeros(1, record_of(entries))[0]
    for name, entry in entries.items():
        value = values.get(name, entry[3])
        choices = entry[3] if isinstance(entry[3], tuple) else ()
        found[flat_name(name)] = choices.index(value) if value in choices else value
    return found


class String:
    """Kernels of a drill string with its state, of any parameters.

    Attributes
    ----------
    p, s, w : record, record, Room
        As kernels take them.
    """

    def __init__(self, table, values):
        law, self.facts = table.law, np.zeros(4)
        self.p = record(table.parameters, values)
        self.s = np.zeros(1, law.record)[0]
        self.w = Room(np.zeros(law.made(self.p)), np.zeros(law.moving(self.p)), self.facts)
        self.s["count"] = self.p["start_rods"]
        if law.make is not None:
            law.make(self.p, self.w.made)

    def __getattr__(self, name):
        return self.s[name].item()
