"""Controller of a user's own, in Python: the FMU has its file, and runs what a name of it gives."""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from pathlib import Path
from types import BuiltinFunctionType, FunctionType, ModuleType, NoneType
from typing import Any

from fmu_src.parts.python_part import Model, Part, form_fault
from fmu_src.slave.states import StateError
from percussion_model.scene.rows import said_among

# Within the resources of the FMU: the file, and the name in it.
SOURCE, NAME = "controller.py", "controller_name.txt"
# Those of the compiled controller, which this one takes the place of.
INPUTS = ("feed_setpoint", "pressure_setpoint", "feed_force", "rate_of_penetration",
          "supply_pressure", "blow_frequency", "rotation_torque", "head_velocity")  # fmt: skip
SIGNALS = "force_command", "pressure_command", "percussion_on"
# Of an argument, whose bounds nobody knows; whole numbers are those of FMI.
LARGEST = {bool: 1, int: 2**31 - 1, float: 1e12}


class ControllerError(ValueError):
    """What is wrong with a controller, as its message says."""


class Inputs(dict[str, Any]):
    """Inputs by name; the error of a missing one names those that are there."""

    def __missing__(self, name: str) -> Any:
        raise ControllerError(f"there is no input {name!r}: {said_among(name, self)}")


@contextmanager
def no_exit() -> Iterator[None]:
    """A file that ends the program, as `sys.exit` does, is at fault: its host shall go on."""
    try:
        yield
    except SystemExit as error:
        raise ControllerError(f"the controller ends the program: SystemExit({error})") from error


def loaded(file: Path, name: str) -> Callable[..., Any]:
    """What a name of a file stands for, the file run anew: nothing is left of another instance."""
    spec = importlib.util.spec_from_file_location("controller_of_user", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    with no_exit():
        spec.loader.exec_module(module)
    found: Callable[..., Any] | None = getattr(module, name, None)
    if not callable(found):
        raise ControllerError(f"has no function or class {name}")
    return found


def arguments_of(given: Callable[..., Any]) -> dict[str, Any]:
    """Numbers and flags that a class or a factory can be given, with their defaults."""
    found = {one.name: one.default for one in inspect.signature(given).parameters.values()}
    taken = sorted(found.keys() & {*INPUTS, *SIGNALS})
    if taken:
        raise ControllerError(
            f"{taken[0]}: an argument cannot be called as an input or an output is"
        )
    return {name: one for name, one in found.items()
            if type(one) in (bool, int, float) and abs(one) <= LARGEST[type(one)]}  # fmt: skip


def is_maker(given: Callable[..., Any]) -> bool:
    """Whether a call without arguments makes a controller, as of a class or a factory."""
    parameters = inspect.signature(given).parameters.values()
    return inspect.isclass(given) or all(one.default is not one.empty for one in parameters)


class OwnController(Model):
    """What the user's callable gives; its state is that of its object and of its file."""

    time = 0.0  # at which the step begins [s]

    def __init__(self, parameters: dict[str, Any]) -> None:
        own = dict(parameters)
        given = loaded(own.pop(SOURCE), own.pop(NAME))
        super().__init__(own)
        with no_exit():
            self.work: Callable[..., Any] = given(**own) if is_maker(given) else given
        self.sent: dict[str, Any] = {}

    def begin(self, inputs: dict[str, Any]) -> None:
        """As a master that has Python in this place: a step of no length."""
        self.step(inputs, 0.0)

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """One call of the callable."""
        given = Inputs({name: inputs[name] for name in INPUTS})
        with no_exit():
            sent = self.work(given, self.time, step_size)
        if not isinstance(sent, Mapping):
            raise ControllerError(
                f"the controller returned {sent!r:.40}: must return a dict with "
                f"{', '.join(SIGNALS)}"
            )
        lacking = [name for name in SIGNALS if name not in sent]
        if lacking:
            raise ControllerError(f"the controller gave no {', '.join(lacking)}")
        found: dict[str, Any] = {}
        for name in SIGNALS:
            try:
                found[name] = (bool if name == "percussion_on" else float)(sent[name])
            except (TypeError, ValueError):
                found[name] = math.nan
            if not math.isfinite(found[name]):
                raise ControllerError(
                    f"the controller gave {name} = {sent[name]!r:.40}: must be a finite number"
                )
        self.sent = found

    def outputs(self) -> dict[str, Any]:
        """What it gave last."""
        return self.sent

    def _places(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Where it keeps values: the file's globals, and the attributes of its object."""
        owner = getattr(self.work, "__self__", self.work)
        body = getattr(self.work, "__func__", self.work)
        if inspect.isfunction(owner):
            return owner.__globals__, {}
        body = body if inspect.isfunction(body) else type(owner).__call__
        return getattr(body, "__globals__", {}), getattr(owner, "__dict__", {})

    def save(self) -> dict[str, Any]:
        """Numbers, flags, and lists and tables of them that it keeps."""
        of_file, of_object = self._places()
        kept = {name: _plain(one) for name, one in of_file.items() if _is_plain(one)}
        own = {name: _plain(one) for name, one in of_object.items()}
        return {"sent": dict(self.sent), "file": kept, "object": own}

    def restore(self, saved: dict[str, Any]) -> None:
        """Put them back."""
        self.sent = dict(saved["sent"])
        of_file, of_object = self._places()
        of_object.clear()  # of what came later too
        for place, name in ((of_file, "file"), (of_object, "object")):
            place.update(deepcopy(saved[name]))

    def why_not_saved(self) -> str:
        """What it keeps that no state can hold; empty where all can be saved."""
        of_file, of_object = self._places()
        kind = type(getattr(self.work, "__self__", self.work))
        body = getattr(self.work, "__func__", self.work)
        if getattr(body, "__closure__", None):
            return "values of the function around it"
        if inspect.isfunction(body) and (vars(body) or body.__defaults__):
            return "attributes or defaults of a function"
        if not of_file or any(getattr(one, "__slots__", ()) for one in kind.__mro__[:-1]):
            return f"what an object of type {kind.__name__} hides"
        others = {name: one for name, one in of_file.items()
                  if name[:2] != "__" and not isinstance(one, FIXED)
                  and type(one).__module__ not in ("__future__", "typing", "types")}  # fmt: skip
        named = (f"{name}, of type {type(one).__name__}"
                 for name, one in (others | of_object).items() if not _is_plain(one))  # fmt: skip
        return next(named, "")


# What does not change, among the globals of a file.
FIXED = (ModuleType, type, FunctionType, BuiltinFunctionType, str, bytes, tuple, NoneType)


def _plain(value: Any) -> Any:
    """A number of numpy as one of Python, which JSON gives back."""
    return float(value) if isinstance(value, float) else value


def _is_plain(value: Any) -> bool:
    """Whether JSON gives a value back as it was."""
    own = _plain(value)
    return not form_fault(own, own) and bool(json.loads(json.dumps(own)) == own)


class OwnControllerPart(Part):
    """Slave around it."""

    MODEL = OwnController

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._file = Path(arguments["resources"]) / SOURCE
        self._name = self._file.with_name(NAME).read_text(encoding="utf-8")

    def _parameters(self) -> dict[str, Any]:
        return super()._parameters() | {SOURCE: self._file, NAME: self._name}

    def step(self, time: float, step_size: float) -> None:
        """Advance with the present inputs; `time` is the end of the step since the start [s]."""
        model = self.initialise()
        assert isinstance(model, OwnController)
        model.time = self.start_time + time - step_size
        super().step(time, step_size)

    def save(self) -> bytes:
        """State of the model, where it is known."""
        model = self.initialise()
        assert isinstance(model, OwnController)
        if why := model.why_not_saved():
            raise StateError(f"the controller keeps {why}, which no saved state holds")
        return super().save()

    def identity(self) -> Any:
        """As of other parts, and the user's file."""
        text = hashlib.sha256(self._file.read_bytes()).hexdigest()
        return [*super().identity(), self._name, text]
