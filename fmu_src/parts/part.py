"""A part of a drilling system: a plain model, its table of variables, and the slave around it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Any, ClassVar

from fmu_src.slave.slave import Phase, Read, Slave
from fmu_src.slave.states import StateError, fingerprint

Entries = dict[str, tuple[Any, ...]]

COUNT = "count"  # in place of a unit, makes a whole number


class Model:
    """What a part computes, without FMI.

    Parameters
    ----------
    parameters : dict
        Values by name; words for enumerations.

    Attributes
    ----------
    STATE : tuple of str
        Attributes that change in a step: numbers, flags, or lists of numbers.
    """

    STATE: ClassVar[tuple[str, ...]] = ()

    def __init__(self, parameters: dict[str, Any]) -> None:
        self.parameters = parameters

    def begin(self, inputs: dict[str, Any]) -> None:
        """Take the state at time zero."""

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """Advance by a communication step [s], the inputs held."""
        raise NotImplementedError

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        raise NotImplementedError

    def signals(self) -> dict[str, Any]:
        """Those outputs that other parts take; to be cheaper than all."""
        return self.outputs()

    def save(self) -> dict[str, Any]:
        """State as plain values; `restore` takes them back."""
        return {name: plain(getattr(self, name)) for name in self.STATE}

    def restore(self, saved: dict[str, Any]) -> None:
        """Go back to a state."""
        for name in self.STATE:
            setattr(self, name, saved[name])


def plain(value: Any) -> Any:
    """A number, or a list of numbers, as JSON writes it."""
    return value.tolist() if hasattr(value, "tolist") else value


class Part(Slave):
    """Slave around the model that the class attribute names."""

    MODEL: ClassVar[type[Model]] = Model

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.reset()

    def reset(self) -> None:
        """Make the model anew when it is needed."""
        self._model: Model | None = None
        self._found: Mapping[str, Any] | None = None  # outputs that were asked for
        self._fingerprint: bytes | None = None

    def _parameters(self) -> dict[str, Any]:
        """Parameters by name, words for enumerations."""
        return {
            one.name: self.choice(one.name) if one.type == "Enumeration" else self.values[one.name]
            for one in self.parameters
        }

    def initialise(self) -> Model:
        """The model, made where there is none."""
        if self._model is None:
            self._model = self.MODEL(self._parameters())
            self._model.begin(self.values)
            self._found = None
        return self._model

    def step(self, time: float, step_size: float) -> None:
        """Advance with the present inputs."""
        (self._model or self.initialise()).step(self.values, step_size)
        self._found = None

    def reader(self, names: list[str]) -> Read:
        """What gives the present values of these outputs; 0 before there are any."""
        pick = itemgetter(*names) if len(names) > 1 else lambda found: [found[n] for n in names]

        def read(part: Part) -> list[Any]:
            found = part._found
            if found is None:
                if part._model is None and part.phase != Phase.INITIALISING:
                    return [0] * len(names)
                found = part._found = part.initialise().signals()
            try:
                return list(pick(found))
            except KeyError:  # one that no other part takes
                found = part._found = part.initialise().outputs()
            return list(pick(found))

        return read

    def fingerprint(self) -> bytes:
        """Hash of the kind of part and its parameters."""
        if self._fingerprint is None:
            self._fingerprint = fingerprint(self.MODEL.__name__, self._parameters())
        return self._fingerprint

    def save(self) -> bytes:
        """Phase, times, inputs, and the state of the model."""
        if self._model is None:
            raise ValueError("there is no state to save before the initialisation has ended")
        body = {
            "phase": int(self.phase),
            "times": [self.start_time, self.now],
            "inputs": {one.name: self.values[one.name] for one in self.inputs},
            "model": self._model.save(),
        }
        return json.dumps(body).encode()

    def restore(self, body: bytes) -> None:
        """Go back to a state."""
        try:
            saved = json.loads(body)
        except json.JSONDecodeError as error:
            raise StateError(f"the saved state cannot be read: {error}") from None
        self.values |= saved["inputs"]
        self.initialise().restore(saved["model"])
        self.phase = Phase(saved["phase"])
        self.start_time, self.now = saved["times"]
        self._found = None


@dataclass(frozen=True)
class PartTable:
    """Description and variables of a part; SI, forces and positions down positive.

    An entry of inputs and parameters is (unit, lower, upper, start, description), one of
    outputs (unit, description) or (unit, lower, upper, nominal, description). A start that is
    a flag makes a Boolean, as does False for the unit of an output; the unit COUNT makes a
    whole number, and a tuple in place of the start an enumeration, whose first word is the
    start.

    Attributes
    ----------
    name : str
        Of the FMU.
    slave : type
        What runs in it.
    at_start : dict of tuple
        Inputs that an output depends on at the start, beside parameters; outputs that are
        left out are the same at every start.
    first : dict of int
        First value reference by causality.
    displays : dict of str
        Units to display, by unit of the interface.
    stop_time, step_size : float
        Of the default experiment [s].
    bundle : str
        Beginning of the name under which the FMU keeps its sources.
    """

    name: str
    slave: type[Part]
    description: str
    inputs: Entries
    outputs: Entries
    parameters: Entries
    at_start: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    first: Mapping[str, int] = field(
        default_factory=lambda: {"input": 1, "output": 100, "parameter": 200}
    )
    displays: Mapping[str, str] = field(
        default_factory=lambda: {"Pa": "bar", "N": "kN", "m/s": "mm/s", "Hz": "1/min"}
    )
    stop_time: float = 4.0
    step_size: float = 1e-3
    bundle: str = "drilling_system"
