"""What every slave owes to the export library of pythonfmu: messages, errors, a clean end."""

from __future__ import annotations

import ctypes
import functools
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status


class FmuError(ValueError):
    """An error that the host must see; the text has its percent signs doubled."""


def guarded(method: Callable) -> Callable:
    """Let an error end the call as a fatal one in the host, without a crash."""

    @functools.wraps(method)
    def call(self: Any, *arguments: Any) -> Any:
        while self.start_notes:
            self.warn(self.start_notes.pop(0))
        try:
            return method(self, *arguments)
        except Exception as error:
            raise self.fatal(error) from None

    return call


@functools.cache
def finalise_in_time(folder: str) -> None:
    """Let the export library end before its own static variables do (Linux).

    Left alone, it finalises the same pointer twice at the end of the process.
    """
    if not sys.platform.startswith("linux"):
        return
    libraries = sorted((Path(folder).parent / "binaries" / "linux64").glob("*.so"))
    if not libraries:
        return
    library = ctypes.CDLL(str(libraries[0]))
    # by getattr, since a class would mangle a name of two underscores
    at_exit = getattr(ctypes.CDLL(None), "__cxa_atexit")
    at_exit(ctypes.cast(library.finalizePythonInterpreter, ctypes.c_void_p), None, None)


class Hosted(Fmi2Slave):
    """Base of all slaves: what they log, and how their calls fail."""

    # Of the loader; told by the first call. The export library crashes where it frees an instance
    # that has logged and was never called, since it then logs after its logger has gone.
    start_notes: ClassVar[list[str]] = []

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        folder = arguments["resources"]
        # The export library adds the folder for each instance; once loaded it is not needed.
        while folder in sys.path:
            sys.path.remove(folder)
        finalise_in_time(folder)

    def log(
        self,
        msg: str,
        status: Fmi2Status = Fmi2Status.ok,
        category: str | None = None,
        debug: bool | None = None,
    ) -> None:
        """Log a message; hosts take it for a printf format, so percent signs are doubled."""
        super().log(msg.replace("%", "%%"), status, category)

    def note(self, message: str) -> None:
        """Log what is no warning."""
        self.log(f"{self.instance_name}: {message}", Fmi2Status.ok, "logEvents")

    def warn(self, message: str) -> None:
        """Log a warning."""
        self.log(f"{self.instance_name}: {message}", Fmi2Status.warning, "logStatusWarning")

    def fatal(self, error: Exception) -> FmuError:
        """Log an error and return what is to be raised."""
        self.hold()
        text = str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
        self.log(f"{self.instance_name}: {text}", Fmi2Status.error, "logStatusError")
        return FmuError(text.replace("%", "%%"))

    def hold(self) -> None:
        """Prepare for an exception that the export library will see.

        It gives the instance, its class and its message queue back twice then: one reference
        more to each keeps the heap whole.
        """
        for held in (self, type(self), self.log_queue):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(held))

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> bytes:
        # looked at when it is set: an error here would bring the export library down
        return state
