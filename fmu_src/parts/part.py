"""A part of a drilling system: a plain model, and the slave around it."""

from __future__ import annotations

import importlib
import json
from collections.abc import Mapping
from operator import itemgetter
from typing import Any, ClassVar

from fmu_src.slave.calls import STEPPING, Phase, guarded
from fmu_src.slave.slave import Slave
from fmu_src.slave.states import StateError, fingerprint, pack, unpack
from fmu_src.slave.values import Read


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
        """Go on by a communication step [s], the inputs held."""
        raise NotImplementedError

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        raise NotImplementedError

    def signals(self) -> dict[str, Any]:
        """Those outputs that other parts take; to be cheaper than all."""
        return self.outputs()

    def save(self) -> dict[str, Any]:
        """State as plain values; `restore` takes them back."""
        return {name: _plain(getattr(self, name)) for name in self.STATE}

    def restore(self, saved: dict[str, Any]) -> None:
        """Go back to a state."""
        for name in self.STATE:
            setattr(self, name, saved[name])


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else value


class Part(Slave):
    """Slave around the model that the class attributes name."""

    MODEL: ClassVar[tuple[str, str]] = ("", "")  # module beside this one, and class in it

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        package = __name__.rpartition(".")[0]
        module = importlib.import_module(f"{package}.{self.MODEL[0]}")
        self._model_class = getattr(module, self.MODEL[1])
        known = self.known.values()
        self._inputs = [(one.name, one.reference) for one in known if one.causality == "input"]
        self._fixed = [one for one in known if one.causality == "parameter"]
        self._input_references = [reference for _, reference in self._inputs]
        self._names = {one.reference: one.name for one in known}
        self._model: Model | None = None
        self._found: Mapping[str, Any] | None = None  # outputs that were asked for
        self._fingerprint: bytes | None = None
        self._given = self.inputs()  # as `inputs` gives them
        self._doubtful: list[int] = []  # inputs to be checked

    def changed(self, references: list[int]) -> None:
        """Check inputs before the next step; before the first one, make the model anew."""
        if self.phase < STEPPING:
            self._model = self._found = self._fingerprint = None
            return
        for reference in references:
            self._given[self._names[reference]] = self.values[reference]
        self._doubtful += references

    def take_late(self) -> None:
        """Take inputs that were set and not yet looked at."""
        held, given = self.values, self._given
        for references, values in self.late.items():
            plan = self._inputs_alone[references]
            for (reference, name, low, high), value in zip(plan, values, strict=True):
                held[reference] = given[name] = value
                if not low <= value <= high:
                    self._doubtful.append(reference)
        self.late.clear()

    def inputs(self) -> dict[str, Any]:
        """Present inputs by name."""
        values = self.values
        return {name: values[reference] for name, reference in self._inputs}

    def parameters(self) -> dict[str, Any]:
        """Parameters by name, words for enumerations."""
        return {
            one.name: self.choice(one.reference)
            if one.type == "Enumeration"
            else self.values[one.reference]
            for one in self._fixed
        }

    def ready(self) -> Model:
        """The model, made where there is none."""
        if self._model is None:
            self._model = self._model_class(self.parameters())
            self._given = self.inputs()
            self._model.begin(self._given)
            self._found = None
        return self._model

    def begin(self) -> None:
        """Make the model, unless reading an output has made it already."""
        self.ready()

    def step(self, time: float, step_size: float) -> None:
        """Pass on changed inputs, then go on."""
        if self.late:
            self.take_late()
        if self._doubtful:
            self.check(self._doubtful)
            self._doubtful.clear()
        (self._model or self.ready()).step(self._given, step_size)
        self._found = None

    def reader(self, references: list[int]) -> Read:
        """What gives the present values of these outputs; 0 before there are any."""
        names = [self._names[reference] for reference in references]
        pick = itemgetter(*names) if len(names) > 1 else lambda found: [found[n] for n in names]

        def read(part: Part) -> list[Any]:
            found = part._found
            if found is None:
                if part._model is None and part.phase != Phase.INITIALISING:
                    return [0] * len(names)
                found = part._found = part.ready().signals()
            try:
                return list(pick(found))
            except KeyError:  # one that no other part takes
                found = part._found = part.ready().outputs()
            return list(pick(found))

        return read

    def fingerprint(self) -> bytes:
        """Hash of the kind of part and its parameters."""
        if self._fingerprint is None:
            self._fingerprint = fingerprint(*self.MODEL, self.parameters())
        return self._fingerprint

    @guarded
    def _get_fmu_state(self) -> bytes:
        if self._model is None:
            raise ValueError("there is no state to save before the initialisation has ended")
        self.take_late()
        body = {
            "phase": int(self.phase),
            "times": [self.start_time, self.now],
            "inputs": self.inputs(),
            "model": self._model.save(),
        }
        return pack(self.fingerprint(), json.dumps(body).encode())

    @guarded
    def _set_fmu_state(self, state: bytes) -> None:
        try:
            body = json.loads(unpack(self.fingerprint(), state))
        except json.JSONDecodeError as error:
            raise StateError(f"the saved state cannot be read: {error}") from None
        self.late.clear()
        for name, value in body["inputs"].items():
            self.values[self.by_name[name]] = value
        self.ready().restore(body["model"])
        self.phase = Phase(body["phase"])
        self.start_time, self.now = body["times"]
        self._given, self._found = self.inputs(), None
        self._doubtful = list(self._input_references)


class DrillStringPart(Part):
    """Drill string with head, casing and shoulder."""

    MODEL = ("drill_string", "DrillString")


class RigFeedPart(Part):
    """Hydraulic cylinder that pushes the head."""

    MODEL = ("rig_feed", "RigFeed")


class SupplyPart(Part):
    """Source, hose and relief valve of the drive's fluid."""

    MODEL = ("supply", "Supply")


class RockProfilePart(Part):
    """Rock by depth."""

    MODEL = ("rock_profile", "RockProfile")


class DrillControllerPart(Part):
    """Controller of feed, pressure and percussion."""

    MODEL = ("controller", "DrillController")
