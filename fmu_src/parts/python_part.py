"""A part of a drilling system that runs by Python: a plain model, and the slave around it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from copy import copy
from operator import itemgetter
from typing import Any, ClassVar

from fmu_src.parts.part import LARGEST
from fmu_src.slave.slave import Read, Slave
from fmu_src.slave.states import Phase, Place, StateError


class Model:
    """What a part computes, without FMI.

    Parameters
    ----------
    parameters : dict
        Values by name; words for enumerations.

    Attributes
    ----------
    STATE : tuple of str
        Attributes that change in a step: numbers, flags, lists of numbers, or objects that have
        a `STATE` themselves.
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
        return dict(plain(self))

    def state_fault(self, saved: Mapping[str, Any]) -> str:
        """What is wrong with a state from outside, which is of the right form; empty: nothing."""
        return ""

    def restore(self, saved: dict[str, Any]) -> None:
        """Go back to a state, which is right."""
        _restore(self, saved)


def form_fault(saved: Any, own: Any, name: str = "state") -> str:
    """Where values from outside are not of the form of a model's own; empty: nowhere.

    Flags are flags, numbers are finite numbers, tables have the same names; lists are of
    numbers, and of any length.
    """
    if isinstance(own, dict):
        if not isinstance(saved, dict) or saved.keys() != own.keys():
            return f"{name}, which must have {', '.join(own)}"
        faults = (form_fault(saved[key], own[key], key) for key in own)
        return next(filter(None, faults), "")
    if isinstance(own, list):
        if not isinstance(saved, list) or not all(map(_is_number, saved)):
            return f"{name}, which must be a list of finite numbers"
    elif isinstance(own, bool):
        if not isinstance(saved, bool):
            return f"{name} = {saved!r:.40}, which must be true or false"
    elif not _is_number(saved):
        return f"{name} = {saved!r:.40}, which must be a finite number"
    return ""


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) <= LARGEST


def plain(value: Any) -> Any:
    """A number, a list of numbers, or the state of an object, as JSON writes it; a copy."""
    if hasattr(value, "STATE"):
        return {name: plain(getattr(value, name)) for name in value.STATE}
    return value.tolist() if hasattr(value, "tolist") else copy(value)


def _restore(owner: Any, saved: Mapping[str, Any]) -> None:
    """Set what `plain` gave of an object."""
    for name in owner.STATE:
        if isinstance(saved[name], dict):
            _restore(getattr(owner, name), saved[name])
        else:
            setattr(owner, name, copy(saved[name]))


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

    def identity(self) -> Any:
        """Sources, whose hash is in the name of the module, and names of the variables."""
        return [type(self).__module__, type(self).__name__, list(self.by_name)]

    def save(self) -> bytes:
        """State of the model."""
        return json.dumps(self.initialise().save()).encode()

    def restore(self, values: dict[str, Any], place: Place, saved: bytes, own: bool) -> None:
        """Go back to a motion; as in `Slave`."""
        try:
            found = json.loads(saved)
        except (ValueError, RecursionError) as error:
            raise StateError(f"the saved state cannot be read: {error}") from None
        model = self._model
        if model is None:
            model = self.MODEL(self._parameters())
            model.begin(values)
        if not own and (fault := form_fault(found, model.save()) or model.state_fault(found)):
            raise StateError(f"the saved state has {fault}")
        model.restore(found)
        self._model, self._found = model, None


def slave_of(model: type[Model]) -> type[Part]:
    """Slave around a model; FMUs find it in the model's module, by this name."""
    names = {"MODEL": model, "__module__": model.__module__, "__doc__": model.__doc__}
    return type(f"{model.__name__}Part", (Part,), names)
