"""The slave that lets a library compute, which the FMU brings along: without numpy and numba.

The library is that of the FMUs that need no Python, with all functions of FMI 2.0. What it is
called with, refuses, logs and saves is left to it: this slave passes calls on. It lies in
`native/<platform>/`, and `model.bin` beside it has all that is special to a scene.
"""

from __future__ import annotations

import ctypes
import os
import platform
import struct
import sys
import weakref
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from pythonfmu.enums import Fmi2Status
from pythonfmu.logmsg import LogMsg

from fmu_src.slave.host import FmuError, Hosted

if sys.platform == "win32":
    from _ctypes import FreeLibrary as close_library
else:
    from _ctypes import dlclose as close_library

# Within the resources of an FMU.
MODEL, FOLDER = "model.bin", "native"
SUFFIXES = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}
# Places in `model.bin` (fmu_src/native/tables.py): where its sections of texts and of the head
# begin; the first number of the head is the place of the GUID among the texts.
TEXT_AT, HEAD_AT = 56, 72
CO_SIMULATION = 1

LOGGER = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p
)


class Callbacks(ctypes.Structure):
    """What the library is given to call: the logger alone."""

    _fields_ = (
        ("logger", LOGGER),
        ("allocate_memory", ctypes.c_void_p),
        ("free_memory", ctypes.c_void_p),
        ("step_finished", ctypes.c_void_p),
        ("environment", ctypes.c_void_p),
    )


def this_platform() -> str:
    """Name of the platform that this is, as FMI 3.0 has them."""
    processor = platform.machine().lower()
    processor = {"amd64": "x86_64", "arm64": "aarch64"}.get(processor, processor)
    return f"{processor}-{platform.system().lower()}"


def library_name(name: str) -> str:
    """Where the library for a platform lies within the resources."""
    return f"{FOLDER}/{name}/hammer{SUFFIXES.get(name.partition('-')[2], '')}"


def open_library(resources: str) -> ctypes.CDLL:
    """Library of an FMU for this platform; `OSError` if there is none, or it does not load."""
    path = Path(resources, library_name(this_platform()))
    if not path.is_file():
        raise OSError(f"the FMU brings no library for {this_platform()}")
    return ctypes.CDLL(str(path))


def reason_against(resources: str) -> str:
    """Why an FMU cannot run by its library; empty if it can."""
    try:
        close_library(open_library(resources)._handle)
    except OSError as error:
        return str(error)
    return ""


def read_guid(resources: str) -> bytes:
    """GUID that the tables of the model belong to; empty if they are none."""
    tables = Path(resources, MODEL).read_bytes()
    try:
        (texts,), (head,) = (struct.unpack_from("<Q", tables, at) for at in (TEXT_AT, HEAD_AT))
        begin = texts + struct.unpack_from("<I", tables, head)[0]
    except struct.error:  # the library says what is wrong with them
        return b""
    return tables[begin : tables.find(b"\0", begin)]


class Component:
    """An instance of the library; freed when nothing refers to it any more.

    Parameters
    ----------
    name : str
        Of the instance.
    resources : str
        Folder.
    log_queue : list of LogMsg
        Where messages of the library go.

    Raises
    ------
    ValueError
        If there is none; the last message tells why.
    """

    def __init__(self, name: str, resources: str, log_queue: list[LogMsg]) -> None:
        self.library = open_library(resources)

        def log(_: Any, __: Any, status: int, category: bytes, text: bytes) -> None:
            log_queue.append(LogMsg(Fmi2Status(status), category.decode(), text.decode()))

        # alive as long as the instance; without a reference to it, so that no ring holds it
        self._callbacks = Callbacks(LOGGER(log))
        instantiate = self.library.fmi2Instantiate
        instantiate.restype = ctypes.c_void_p
        pointer = instantiate(
            os.fsencode(name), CO_SIMULATION, read_guid(resources), resources.encode(),
            ctypes.byref(self._callbacks), 0, 1,
        )  # fmt: skip
        if not pointer:
            close_library(self.library._handle)
            raise ValueError(log_queue[-1].msg if log_queue else "the library gives no instance")
        self.pointer = ctypes.c_void_p(pointer)
        end = weakref.finalize(
            self, _free, self.library.fmi2FreeInstance, self.pointer, self._callbacks,
            self.library._handle,
        )  # fmt: skip
        end.atexit = False  # hosts may still call; the process ends soon


def _free(free: Any, pointer: ctypes.c_void_p, callbacks: Callbacks, handle: int) -> None:
    """Free an instance, and the library, which may be deleted then on Windows too."""
    free(pointer)
    close_library(handle)


class OwnState:
    """A saved state in the memory of the library, and the instance that it was made by."""

    def __init__(self, component: Component, pointer: ctypes.c_void_p) -> None:
        self.component = component
        self.pointer = pointer

    def __del__(self) -> None:
        self.component.library.fmi2FreeFMUstate(self.component.pointer, ctypes.byref(self.pointer))

    def to_bytes(self) -> bytes:
        """State as bytes; empty if the library gives none, which it says in the log."""
        library, pointer = self.component.library, self.component.pointer
        size = ctypes.c_size_t()
        library.fmi2SerializedFMUstateSize(pointer, self.pointer, ctypes.byref(size))
        saved = ctypes.create_string_buffer(size.value)
        library.fmi2SerializeFMUstate(pointer, self.pointer, saved, size)
        return saved.raw


class Accesses(dict[tuple[int, ...], tuple[Callable[[], int], Any]]):
    """Calls of one getter or setter by the references of a list, and the arrays of their values.

    Hosts ask for the same lists again and again; to make the arguments costs more than the call.

    Parameters
    ----------
    function
        Of the library.
    pointer : c_void_p
        Of the instance.
    kind : type
        Of the values, in C.
    """

    def __init__(self, function: Any, pointer: ctypes.c_void_p, kind: Any) -> None:
        super().__init__()
        self.function, self.pointer, self.kind = function, pointer, kind

    def __missing__(self, vrs: tuple[int, ...]) -> tuple[Callable[[], int], Any]:
        count = len(vrs)
        references, values = (ctypes.c_uint * count)(*vrs), (self.kind * count)()
        call = partial(self.function, self.pointer, references, ctypes.c_size_t(count), values)
        self[vrs] = call, values
        return call, values


# Types of values in C.
KINDS = {
    "Real": ctypes.c_double, "Integer": ctypes.c_int, "Boolean": ctypes.c_int,
    "String": ctypes.c_char_p,
}  # fmt: skip


def _getter(word: str) -> Callable[[NativeSlave, list[int]], list[Any]]:
    """Method that returns values of variables of a type."""

    def get(slave: NativeSlave, vrs: list[int]) -> list[Any]:
        call, values = slave.getters[word][tuple(vrs)]
        if call():
            raise slave.refused()
        found: list[Any] = values[:]
        return found

    return get


def _setter(word: str) -> Callable[[NativeSlave, list[int], list[Any]], None]:
    """Method that sets variables of a type."""

    def put(slave: NativeSlave, vrs: list[int], values: list[Any]) -> None:
        call, room = slave.setters[word][tuple(vrs)]
        room[:] = values if word != "String" else [value.encode() for value in values]
        if call():
            raise slave.refused()

    return put


class NativeSlave(Hosted):
    """Passes the calls of a host on to the library."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._component = Component(self.instance_name, arguments["resources"], self.log_queue)
        self._pointer = self._component.pointer
        self._library = library = self._component.library
        self._set_up = library.fmi2SetupExperiment
        self._set_up.argtypes = (
            ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_double, ctypes.c_int,
            ctypes.c_double,
        )  # fmt: skip
        self._time, self._size = ctypes.c_double(), ctypes.c_double()
        self._step = partial(library.fmi2DoStep, self._pointer, self._time, self._size, 0)
        self.getters, self.setters = (
            {
                word: Accesses(getattr(library, f"fmi2{verb}{word}"), self._pointer, kind)
                for word, kind in KINDS.items()
            }
            for verb in ("Get", "Set")
        )

    def refused(self) -> FmuError:
        """What is to be raised after the library has refused a call, and said why."""
        self.hold()
        return FmuError(self.log_queue[-1].msg if self.log_queue else "refused")

    def _call(self, function: Any, *arguments: Any) -> None:
        if function(self._pointer, *arguments):
            raise self.refused()

    # values of variables by reference; enumerations are Integers, and there are no Strings

    get_real, get_integer, get_boolean, get_string = map(_getter, KINDS)
    set_real, set_integer, set_boolean, set_string = map(_setter, KINDS)

    # sequence

    def setup_experiment(
        self, start_time: float, stop_time: float | None, tolerance: float | None
    ) -> None:
        """Take the start time; the stop time is looked at, but bounds no step."""
        if stop_time is not None:
            self._call(self._set_up, 0, 0.0, start_time, 1, stop_time)
        self._call(self._set_up, 0, 0.0, start_time, 0, 0.0)

    def enter_initialization_mode(self) -> None:
        """Check all values."""
        self._call(self._library.fmi2EnterInitializationMode)

    def exit_initialization_mode(self) -> None:
        """Make everything ready for the first step."""
        self._call(self._library.fmi2ExitInitializationMode)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance by a communication step."""
        self._time.value = current_time
        self._size.value = step_size
        if self._step():
            raise self.refused()
        return True

    def terminate(self) -> None:
        """No further steps."""
        self._call(self._library.fmi2Terminate)

    # states: those of the library, or bytes

    def _get_fmu_state(self) -> OwnState:
        pointer = ctypes.c_void_p()
        self._call(self._library.fmi2GetFMUstate, ctypes.byref(pointer))
        return OwnState(self._component, pointer)

    def _set_fmu_state(self, state: Any) -> None:
        if type(state) is bytes:
            state = self._from_bytes(state)
        if not isinstance(state, OwnState):
            raise self.fatal(ValueError("the saved state belongs to another FMU"))
        self._call(self._library.fmi2SetFMUstate, state.pointer)

    def _from_bytes(self, saved: bytes) -> OwnState:
        pointer = ctypes.c_void_p()
        self._call(
            self._library.fmi2DeSerializeFMUstate, saved, ctypes.c_size_t(len(saved)),
            ctypes.byref(pointer),
        )  # fmt: skip
        return OwnState(self._component, pointer)

    @staticmethod
    def _fmu_state_to_bytes(state: Any) -> bytes:
        if isinstance(state, OwnState):
            return state.to_bytes()
        return state if isinstance(state, bytes) else b""  # of another FMU: none here
