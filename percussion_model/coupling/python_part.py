"""A Python callable as a part of a coupled system."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from percussion_model.coupling.component import CouplingError

Work = Callable[[dict[str, Any], float, float], Mapping[str, Any]]


class PythonPart:
    """A Python callable in the place of an FMU.

    Parameters
    ----------
    name : str
        Of the component.
    work : callable
        Reads inputs by name, a time and a step [s]; gives outputs by name.
    """

    def __init__(self, name: str, work: Work) -> None:
        self.name, self.work = name, work
        self.inputs: dict[str, Any] = {}
        self.outputs: dict[str, Any] = {}

    def step(self, time: float, step: float) -> None:
        """One communication step [s]."""
        try:
            self.outputs = dict(self.work(dict(self.inputs), time, step))
        except Exception as error:
            raise CouplingError(f"{self.name}: {type(error).__name__}: {error}") from error

    def getter(self, names: list[str]) -> Callable[[], list[Any]]:
        """What reads outputs."""

        def read() -> list[Any]:
            lacking = [name for name in names if name not in self.outputs]
            if lacking:
                raise CouplingError(f"{self.name} gave no {', '.join(lacking)}")
            return [self.outputs[name] for name in names]

        return read

    def setter(self, names: list[str]) -> Callable[[list[Any]], None]:
        """What sets inputs."""

        def write(values: list[Any]) -> None:
            self.inputs = dict(zip(names, values, strict=True))

        return write
