"""A Python callable as a part of a coupled system."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from percussion_model.coupling.component import CouplingError, kind_of
from percussion_model.coupling.fresh import fresh
from percussion_model.coupling.ssp_xml import is_true
from percussion_model.scene.rows import nearest, said_among

Work = Callable[[dict[str, Any], float, float], Mapping[str, Any]]
# What a user gives: a `Work`, or what makes one (see `fresh`).
Given = Callable[..., Any]


class Inputs(dict[str, Any]):
    """Inputs by name; the error of a missing one names those that are there."""

    def __missing__(self, name: str) -> Any:
        raise CouplingError(f"there is no input {name!r}: {said_among(name, self)}")


class PythonPart:
    """A Python callable in the place of an FMU.

    Parameters
    ----------
    name : str
        Of the component.
    given : callable
        Reads inputs by name, a time and a step [s]; gives outputs by name. Or a class or a
        factory of such callables: each run has a fresh one (`fresh`).
    starts : mapping
        Values of inputs that nothing is connected to, and of the others till they have one.
    """

    can_save = False

    def __init__(self, name: str, given: Given, starts: Mapping[str, Any]) -> None:
        self.name, self.given, self.starts = name, given, dict(starts)
        self.inputs: dict[str, Any] = dict(starts)
        self.outputs: dict[str, Any] = {}
        self.wanted: set[str] = set()  # outputs that are read

    def begin(self) -> None:
        """Make what works in this run."""
        try:
            self.work: Work = fresh(self.name, self.given)
        except CouplingError:
            raise
        except (Exception, SystemExit) as error:
            raise CouplingError(f"{self.name}: {fault_text(error)}") from error

    def step(self, time: float, step: float) -> None:
        """One communication step [s]."""
        try:
            found = self.work(Inputs(self.inputs), time, step)
        except (Exception, SystemExit) as error:
            raise CouplingError(f"{self.name}: {fault_text(error)}") from error
        try:
            self.outputs = dict(found)
        except (TypeError, ValueError):
            raise CouplingError(
                f"{self.name}: {_named(self.work)} returned {found!r:.40}: must return a dict with "
                f"{', '.join(sorted(self.wanted))}"
            ) from None

    def reader(self, names: Sequence[str]) -> PythonSignals:
        """Return a reader of outputs."""
        self.wanted.update(names)
        return PythonSignals(self, names)

    def writer(self, names: Sequence[str]) -> PythonSignals:
        """Return a writer of inputs."""
        return PythonSignals(self, names)


class PythonSignals:
    """Outputs of a Python callable that are read together, or inputs that are set together."""

    def __init__(self, part: PythonPart, names: Sequence[str]) -> None:
        self.part, self.names = part, list(names)

    def read(self) -> list[Any]:
        """Present values of outputs."""
        found = self.part.outputs
        lacking = sorted(name for name in self.names if name not in found)
        if lacking:
            others = [name for name in found if name not in self.names]
            near = [(name, nearest(name, others)) for name in lacking]
            meant = "".join(f"; did you mean {name} by {one}?" for name, one in near if one)
            raise CouplingError(f"{self.part.name} gave no {', '.join(lacking)}{meant}")
        return [found[name] for name in self.names]

    def write(self, values: Sequence[Any]) -> None:
        """Set inputs, in the order of the names."""
        self.part.inputs = self.part.starts | dict(zip(self.names, values, strict=True))


def input_starts(name: str, description: Any, values: Mapping[str, Any]) -> dict[str, Any]:
    """Start values of an FMU's inputs, after what the archive sets.

    Parameters
    ----------
    name : str
        Of the component.
    description : ModelDescription
    values : mapping
        Of the archive, by variable.
    """
    kinds: dict[str, Callable[[str], Any]] = {"Real": float, "Boolean": is_true}
    found = {}
    for one in description.modelVariables:
        if one.causality == "input":
            try:
                own = values.get(one.name)
                found[one.name] = kinds.get(kind_of(one), int)(one.start) if own is None else own
            except (TypeError, ValueError):
                raise CouplingError(f"{name}: {one.name} has no start value") from None
    return found


def fault_text(error: BaseException) -> str:
    """What a fault in Python code of a user is, with its file and line.

    Faults of syntax have these in their text.
    """
    kind = "" if isinstance(error, CouplingError) else type(error).__name__
    text = ": ".join(filter(None, (kind, str(error))))
    if isinstance(error, SyntaxError):
        return text
    frames = [at for at in traceback.extract_tb(error.__traceback__) if at.filename != __file__]
    return f"{text} ({Path(frames[-1].filename).name}, line {frames[-1].lineno})"


def _named(work: Work) -> str:
    """Name of a callable, and of its file where it is written in Python."""
    body: Any = work if hasattr(work, "__code__") else type(work).__call__
    if not hasattr(body, "__code__"):
        return f"an object of {type(work).__name__}"
    return f"{body.__qualname__} ({Path(body.__code__.co_filename).name})"
