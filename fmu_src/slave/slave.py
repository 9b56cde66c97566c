"""A slave that behaves: what plain pythonfmu leaves to wish, mended in one place."""

from __future__ import annotations

import ctypes
import sys
from typing import Any

from pythonfmu.enums import Fmi2Status

from fmu_src.slave.calls import INFINITE, STEPPING, FmuError, Phase, guarded
from fmu_src.slave.folder import finalise_in_time
from fmu_src.slave.values import Variables

# Communication points may differ from the present time by rounding: this share
# of a step, and some units in the last place of the time.
SHARE_OF_STEP = 1e-3
LAST_PLACES = 8 * sys.float_info.epsilon


class Slave(Variables):
    """Base of the slaves: phases, steps, and errors that hosts see.

    A slave gives a `reader` of outputs and overrides `check`, `begin` and `step`.
    """

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        folder = arguments["resources"]
        # The export library adds the folder for each instance; once loaded it is not needed.
        while folder in sys.path:
            sys.path.remove(folder)
        finalise_in_time(folder)
        self.phase = Phase.INSTANTIATED
        self.start_time = 0.0
        self.now = 0.0  # time of the host [s]

    # what a slave does

    def begin(self) -> None:
        """Make everything ready for the first step."""

    def step(self, time: float, step_size: float) -> None:
        """Go on; `time` is the end of the step since the start [s]."""
        raise NotImplementedError

    # calling sequence

    @guarded
    def setup_experiment(
        self, start_time: float, stop_time: float | None, tolerance: float | None
    ) -> None:
        """Take the start time."""
        self.require(Phase.INSTANTIATED)
        if not abs(start_time) < float("inf"):
            raise ValueError(f"startTime = {start_time!r}: must be a finite time in s")
        self.start_time = self.now = start_time

    @guarded
    def enter_initialization_mode(self) -> None:
        """Check all values."""
        self.require(Phase.INSTANTIATED)
        self.check(self.values)
        self.phase = Phase.INITIALISING

    @guarded
    def exit_initialization_mode(self) -> None:
        """Check again what may have changed, and make everything ready."""
        self.require(Phase.INITIALISING)
        self.check(self.values)
        self.begin()
        self.phase = Phase.STEPPING

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Go on by a communication step."""
        # as `guarded`, without a call more: this and what reads and sets is called often
        try:
            if self.phase is not STEPPING:
                self.require(STEPPING)
            if not 0.0 < step_size < INFINITE:
                raise ValueError(f"communicationStepSize = {step_size!r}: must be above 0 s")
            if current_time != self.now:
                self._follow(current_time, step_size)
            end = current_time + step_size
            self.step(end - self.start_time, step_size)
            self.now = end
            return True
        except Exception as error:
            raise self.fatal(error) from None

    def _follow(self, current_time: float, step_size: float) -> None:
        """Raise ValueError if a step does not begin where the last one has ended."""
        slack = SHARE_OF_STEP * step_size + LAST_PLACES * abs(self.now)
        if not abs(current_time - self.now) <= slack:
            where = "before" if current_time < self.now else "after"
            raise ValueError(
                f"currentCommunicationPoint = {current_time!r} s lies {where} the present time "
                f"of {self.now!r} s: steps must follow each other; to go back, restore a state"
            )

    @guarded
    def terminate(self) -> None:
        """No further steps."""
        self.phase = Phase.TERMINATED

    def require(self, phase: Phase) -> None:
        """Raise ValueError if a call comes out of order."""
        if self.phase != phase:
            raise ValueError(
                f"call out of order: allowed while {phase.name.lower()}, "
                f"but the instance is {self.phase.name.lower()}"
            )

    # states: bytes, made and read by the slave

    @staticmethod
    def _fmu_state_to_bytes(state: bytes) -> bytes:
        return state

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> bytes:
        return state

    # messages

    def log(
        self,
        msg: str,
        status: Fmi2Status = Fmi2Status.ok,
        category: str | None = None,
        debug: bool | None = None,
    ) -> None:
        """Log a message; hosts take it for a printf format, so percent signs are doubled."""
        super().log(msg.replace("%", "%%"), status, category)

    def warn(self, message: str) -> None:
        """Log a warning."""
        self.log(message, Fmi2Status.warning, "logStatusWarning")

    def fatal(self, error: Exception) -> FmuError:
        """Log an error and return what is to be raised.

        After an exception the export library gives the instance, its class and its
        message queue back twice: one reference more to each keeps the heap whole.
        """
        for held in (self, type(self), self.log_queue):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(held))
        text = str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
        self.log(f"{self.instance_name}: {text}", Fmi2Status.error, "logStatusError")
        return FmuError(text.replace("%", "%%"))
