"""The slave of a co-simulation: variables by reference, calling sequence, steps, states, errors.

Hosts ask for the same variables and set the same inputs again and again, in the same order.
What such a list of references needs is found once and kept; new values of inputs are checked
when they are needed, which is in the next step.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from math import inf
from typing import Any

from fmu_src.slave.host import Hosted, guarded
from fmu_src.slave.states import (
    PLACE,
    STEPPING,
    OwnState,
    Phase,
    Place,
    StateError,
    fingerprint,
    pack,
    pack_place,
    pack_values,
    unpack,
    unpack_place,
    unpack_values,
)
from fmu_src.variables import closed_bounds, read_variables
from percussion_model.scene.rows import refuse_value

# Communication points may differ from the present time by rounding: this share
# of a step, and some units in the last place of the time.
SHARE_OF_STEP = 1e-3
LAST_PLACES = 8 * sys.float_info.epsilon
# Beyond, a host's times are more than 2e-6 s apart, and its steps no longer what they seem [s].
LATEST_START = 1e10

# Types that share a getter and a setter.
REAL, INTEGER, BOOLEAN, STRING = ("Real",), ("Integer", "Enumeration"), ("Boolean",), ("String",)

# Gives values of a slave; holds none itself, so that an instance is free as soon as it is left.
Read = Callable[[Any], list[Any]]


def _getter(types: tuple[str, ...]) -> Callable[[Slave, list[int]], list[Any]]:
    """Method that returns values of variables of some types."""

    @guarded
    def get(slave: Slave, vrs: list[int]) -> list[Any]:
        return slave._get(vrs, types)

    return get


def _setter(types: tuple[str, ...]) -> Callable[[Slave, list[int], list[Any]], None]:
    """Method that sets variables of some types."""

    @guarded
    def put(slave: Slave, vrs: list[int], values: list[Any]) -> None:
        slave._set(vrs, [*map(bool, values)] if types is BOOLEAN else values, types)

    return put


class Slave(Hosted):
    """Base of the slaves.

    A slave gives `reset`, `initialise`, `step`, a `reader` of outputs, its `identity`, and its
    motion by `save` and `restore`.

    Attributes
    ----------
    variables : dict
        Variables by reference.
    values : dict
        Of parameters and inputs by name, but for inputs that are `pending`.
    pending : dict
        Values of inputs that were set since the last step, by references, the newest last.
    new : set of str
        Inputs that have changed, for the slave to take and to clear.
    unchecked : list of str
        Inputs whose new values may be out of bounds.
    """

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        folder = arguments["resources"]
        self.phase = Phase.INSTANTIATED
        self.is_set_up = False
        self.start_time = 0.0
        self.now = 0.0  # time of the host [s]
        self.variables = {one.reference: one for one in read_variables(folder)}
        self.by_name = {one.name: one for one in self.variables.values()}
        self.inputs = [one for one in self.by_name.values() if one.causality == "input"]
        self.parameters = [one for one in self.by_name.values() if one.causality == "parameter"]
        self.values = {one.name: one.start for one in (*self.inputs, *self.parameters)}
        self.pending: dict[tuple[int, ...], list[float]] = {}
        self.new: set[str] = set()
        self.unchecked: list[str] = []
        self._fingerprint: bytes | None = None  # of what does not change after the first step
        self._bounds = {name: closed_bounds(one.row) for name, one in self.by_name.items()}
        # by references, for each type
        self._reads: dict[Any, dict[tuple[int, ...], Read]] = {
            types: {} for types in (REAL, INTEGER, BOOLEAN, STRING)
        }
        self._real_reads = self._reads[REAL]
        # lists of Real inputs: name and bounds of each
        self._input_lists: dict[tuple[int, ...], list[tuple[str, float, float]]] = {}

    # what a slave does

    def reset(self) -> None:
        """Drop what was made of values that have changed before the first step."""

    def foretell(self) -> None:
        """Log what takes long in `initialise`: hosts see messages when a call has ended."""

    def initialise(self) -> Any:
        """Make everything ready for the first step."""

    def step(self, time: float, step_size: float) -> None:
        """Advance; `time` is the end of the step since the start [s]."""
        raise NotImplementedError

    def reader(self, names: list[str]) -> Read:
        """What gives the present values of these outputs; asked for once."""
        raise NotImplementedError

    def identity(self) -> Any:
        """Plain values that tell this FMU's sources and variables from all others."""
        raise NotImplementedError

    def save(self) -> bytes:
        """Present motion, once the initialisation has ended."""
        raise NotImplementedError

    def restore(self, values: dict[str, Any], place: Place, saved: bytes, own: bool) -> None:
        """Go back to a motion that `save` gave: all of it or, with a ValueError, nothing.

        Parameters
        ----------
        values : dict
            Of the inputs, by name, which the caller takes over afterwards.
        place : Place
            As it will be.
        saved : bytes
        own : bool
            Whether it was made in this process; else nothing is known of it.
        """
        raise NotImplementedError

    # values

    def check(self, names: Iterable[str]) -> None:
        """Raise ValueError if a value is not allowed; names variable, value, bounds."""
        for name in names:
            value, one = self.values[name], self.by_name[name]
            low, high = self._bounds[name]
            if low <= value <= high:
                continue
            if one.row is None or one.type == "Boolean" or value == one.left_out:
                continue
            allowed = value in one.row.choices if one.row.choices else one.row.allows(value)
            if one.type == "Enumeration":
                allowed = self.choice(name) is not None
            if not allowed:
                raise ValueError(refuse_value(one.row, name, value))

    def choice(self, name: str) -> Any:
        """Word behind the number of an enumeration, None where there is none."""
        row = self.by_name[name].row
        choices = row.choices if row is not None else ()
        value = self.values[name]
        if choices and isinstance(choices[0], int):
            return value if value in choices else None
        return choices[value - 1] if 1 <= value <= len(choices) else None

    def take_pending(self) -> None:
        """Take inputs that were set since the last step into `values`."""
        held = self.values
        for references, values in self.pending.items():
            plan = self._input_lists[references]
            for (name, low, high), value in zip(plan, values, strict=True):
                if held[name] != value:
                    held[name] = value
                    self.new.add(name)
                    if not low <= value <= high:
                        self.unchecked.append(name)
        self.pending.clear()

    def _reader_of(self, references: list[int], types: tuple[str, ...]) -> Read:
        """What reads these variables; raises ValueError if there is one that is not known."""
        found = [self._variable(reference, types) for reference in references]
        outputs = [one.name for one in found if one.causality == "output"]
        if len(outputs) == len(found):
            return self.reader(outputs)
        names = [one.name for one in found]
        reads = {name: self.reader([name]) for name in outputs}

        def read(slave: Slave) -> list[Any]:
            slave.take_pending()
            return [
                reads[name](slave)[0] if name in reads else slave.values[name] for name in names
            ]

        return read

    def _variable(self, reference: int, types: tuple[str, ...]) -> Any:
        one = self.variables.get(reference)
        if one is None or one.type not in types:
            raise ValueError(f"there is no {types[0]} variable of reference {reference}")
        return one

    def _get(self, references: list[int], types: tuple[str, ...]) -> list[Any]:
        """Present values."""
        reads, key = self._reads[types], tuple(references)
        if key not in reads:
            reads[key] = self._reader_of(references, types)
        return reads[key](self)

    def _set(self, references: list[int], values: list[Any], types: tuple[str, ...]) -> None:
        """Set parameters and inputs."""
        if self.phase == Phase.TERMINATED:
            raise ValueError(f"call out of order: no fmi2Set{types[0]} after fmi2Terminate")
        self.take_pending()
        found = []
        for reference, value in zip(references, values, strict=True):
            one = self._variable(reference, types)
            if one.causality == "output":
                raise ValueError(f"{one.name} is an output: it cannot be set")
            if one.causality == "parameter" and self.phase > Phase.INITIALISING:
                raise ValueError(f"{one.name} is fixed: it can be set before the first step only")
            found.append(one)
            if self.values[one.name] == value:
                continue
            self.values[one.name] = value
            if self.phase < STEPPING:
                self._fingerprint = None
                self.reset()
            else:
                self.new.add(one.name)
                self.unchecked.append(one.name)
        if types is REAL and all(one.causality == "input" for one in found):
            self._input_lists[tuple(references)] = [
                (one.name, *self._bounds[one.name]) for one in found
            ]

    # the calls of a host: variables

    def get_real(self, vrs: list[int]) -> list[float]:
        """Values of Real variables."""
        # as `guarded`, without a call more: this is called often, as are `set_real` and `do_step`
        try:
            read = self._real_reads.get(tuple(vrs))
            return self._get(vrs, REAL) if read is None else read(self)
        except Exception as error:
            raise self.fatal(error) from None

    get_integer, get_boolean, get_string = map(_getter, (INTEGER, BOOLEAN, STRING))
    set_integer, set_boolean, set_string = map(_setter, (INTEGER, BOOLEAN, STRING))

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set Real variables."""
        try:
            references = tuple(vrs)
            if references in self._input_lists and self.phase is STEPPING:
                pending = self.pending
                pending.pop(references, None)  # the newest goes last
                pending[references] = values
            else:
                self._set(vrs, values, REAL)
        except Exception as error:
            raise self.fatal(error) from None

    # the calls of a host: sequence

    @guarded
    def setup_experiment(
        self, start_time: float, stop_time: float | None, tolerance: float | None
    ) -> None:
        """Take the start time."""
        self._require("fmi2SetupExperiment", Phase.INSTANTIATED)
        if not abs(start_time) <= LATEST_START:
            raise ValueError(f"startTime = {start_time!r}: must be a time within 1e10 s of 0")
        if stop_time is not None and not stop_time >= start_time:
            raise ValueError(
                f"stopTime = {stop_time!r}: must not lie before startTime = {start_time!r} s"
            )
        self.start_time = self.now = start_time
        self.is_set_up = True

    @guarded
    def enter_initialization_mode(self) -> None:
        """Check all values."""
        self._require("fmi2EnterInitializationMode", Phase.INSTANTIATED)
        if not self.is_set_up:
            # FMI 2.0.4, section 2.1.6: otherwise there is no start time
            raise ValueError(
                "call out of order: fmi2EnterInitializationMode needs fmi2SetupExperiment before it"
            )
        self.check(self.values)
        self.foretell()
        self.phase = Phase.INITIALISING

    @guarded
    def exit_initialization_mode(self) -> None:
        """Check again what may have changed, and make everything ready."""
        self._require("fmi2ExitInitializationMode", Phase.INITIALISING)
        self.check(self.values)
        self.initialise()
        self.phase = STEPPING

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance by a communication step."""
        try:
            if self.phase is not STEPPING:
                self._require("fmi2DoStep", STEPPING)
            if not 0.0 < step_size < inf:
                raise ValueError(f"communicationStepSize = {step_size!r}: must be above 0 s")
            if current_time != self.now:
                self._check_time(current_time, step_size)
            if self.pending:
                self.take_pending()
            if self.unchecked:
                self.check(self.unchecked)
                self.unchecked.clear()
            end = current_time + step_size
            self.step(end - self.start_time, step_size)
            self.now = end
            return True
        except Exception as error:
            raise self.fatal(error) from None

    def _check_time(self, current_time: float, step_size: float) -> None:
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
        self._require("fmi2Terminate", STEPPING)
        self.phase = Phase.TERMINATED

    def _require(self, call: str, phase: Phase) -> None:
        """Raise ValueError if a call comes out of order."""
        if self.phase != phase:
            raise ValueError(
                f"call out of order: {call} is allowed while {phase.name.lower()}, "
                f"but the instance is {self.phase.name.lower()}"
            )

    # the calls of a host: states, which are bytes

    def _in_state(self, phase: Phase) -> list[Any]:
        """Variables whose values a state of this phase brings along.

        Later the parameters are fixed: they are in the hash of what the state belongs to.
        """
        return self.inputs if phase >= STEPPING else [*self.parameters, *self.inputs]

    def _owner(self, phase: Phase) -> bytes:
        """Hash of what a state of this phase belongs to."""
        if phase < STEPPING:
            return fingerprint(self.identity())
        return self.fingerprint()

    def fingerprint(self) -> bytes:
        """Hash of sources, variables and values of the parameters."""
        if self._fingerprint is None:
            parameters = [self.values[one.name] for one in self.parameters]
            self._fingerprint = fingerprint(self.identity(), parameters)
        return self._fingerprint

    @guarded
    def _get_fmu_state(self) -> bytes:
        self.take_pending()
        phase = self.phase
        place = pack_place(Place(phase, self.is_set_up, self.start_time, self.now))
        values = pack_values(self._in_state(phase), self.values)
        # before its end the initialisation can be done again from the values
        motion = self.save() if phase >= STEPPING else b""
        return pack(self._owner(phase), place + values + motion)

    @guarded
    def _set_fmu_state(self, state: Any) -> None:
        if not isinstance(state, bytes):
            raise StateError("the saved state belongs to another FMU")
        owner, body = unpack(state)
        place = unpack_place(body)
        if owner != self._owner(place.phase):
            raise StateError("the saved state belongs to other parameters or to another FMU")
        variables = self._in_state(place.phase)
        values = unpack_values(variables, body, PLACE.size)
        motion = body[PLACE.size + 8 * len(variables) :]
        if place.phase >= STEPPING:
            self.restore(values, place, motion, isinstance(state, OwnState))
        elif motion:
            raise StateError(f"the saved state has {len(motion)} bytes too many")
        else:
            self._fingerprint = None
            self.reset()
        # from here on nothing is refused
        self.pending.clear()
        self.values |= values
        self.phase, self.is_set_up = place.phase, place.is_set_up
        self.start_time, self.now = place.start_time, place.now
        self.unchecked = [one.name for one in self.inputs]  # all are new in the next step
        self.new.update(self.unchecked)

    @staticmethod
    def _fmu_state_to_bytes(state: Any) -> bytes:
        return state if isinstance(state, bytes) else b""  # of another FMU: none here
