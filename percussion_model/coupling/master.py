"""The loop over the parts of a system.

fmpy reads the archive. Its own loop (`fmpy.ssp.simulation`) starts every input at 0, takes
no parameters from the archive, keeps one order and every row, and loses all of them with
the first error; so the loop is here, with the same meaning of a step.
"""

from __future__ import annotations

import math
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from fmpy import extract
from fmpy.ssp.ssd import find_components, read_ssd

from percussion_model.coupling.component import Component, CouplingError
from percussion_model.coupling.python_part import PythonPart, Work

Order = Literal["jacobi", "gauss-seidel"]
# Passes over the outputs while all parts are initialised: as many as the longest chain.
INITIAL_PASSES = 4
# A number of steps is whole if it misses by no more than this.
ROUNDING = 1e-9


@dataclass
class CoupledRun:
    """Signals of a coupled run.

    Attributes
    ----------
    columns : dict of ndarray
        "time" [s] and the signals, each `component.variable`.
    step : float
        Communication step [s].
    steps : int
        Steps that were done.
    error : str
        Why it ended before its time; empty if it did not.
    """

    columns: dict[str, np.ndarray]
    step: float
    steps: int
    error: str = ""
    wall_time: float = field(default=0.0, compare=False)

    def __getitem__(self, signal: str) -> np.ndarray:
        return self.columns[signal]


class Coupling:
    """A system of FMUs, ready to be run once.

    Parameters
    ----------
    path : str or Path
        SSP archive.
    parameters : mapping, optional
        Values that go before those of the archive, by `component.variable`.
    replaced : mapping, optional
        Paths of other FMUs, or Python callables, by component.
    order : {"jacobi", "gauss-seidel"}
        Whether a part sees what parts before it in the archive gave in the same step.
    on_way : callable, optional
        Changes what an input receives: takes signal of the input, time [s], value.
    """

    def __init__(
        self,
        path: str | Path,
        parameters: Mapping[str, Any] | None = None,
        replaced: Mapping[str, str | Path | Work] | None = None,
        order: Order = "jacobi",
        on_way: Callable[[str, float, Any], Any] | None = None,
    ) -> None:
        self.path = Path(path)
        self.order, self.on_way = order, on_way
        if not self.path.is_file():
            raise CouplingError(
                f"{self.path}: no such file; `python3 build.py system` makes the archives of dist"
            )
        try:
            system = read_ssd(str(self.path)).system
        except KeyError:
            words = "no SSP archive: it holds no SystemStructure.ssd"
            raise CouplingError(f"{self.path}: {words}") from None
        except Exception as error:
            raise CouplingError(f"{self.path}: no SSP archive: {error}") from error
        self._folder = tempfile.mkdtemp(prefix="ssp-")
        self.parts: dict[str, Any] = {}
        self._parameters: dict[str, dict[str, Any]] = {}
        try:
            self._set_up(system, dict(parameters or {}), dict(replaced or {}))
        except BaseException:
            self.free()
            raise

    def _set_up(self, system: Any, given: dict[str, Any], replaced: dict[str, Any]) -> None:
        extract(str(self.path), self._folder)
        components = {one.name: one for one in find_components(system)}
        for name in replaced.keys() - components.keys():
            raise CouplingError(f"{self.path.name} has no component {name}")
        for name, component in components.items():
            source = replaced.get(name, Path(self._folder) / component.source)
            if callable(source):
                self.parts[name] = PythonPart(name, source)
                continue
            folder = tempfile.mkdtemp(prefix=f"{name}-", dir=self._folder)
            extract(str(source), folder)
            self.parts[name] = Component(name, folder)
            values = _archived(component)
            if name in replaced:  # another FMU takes what it has
                known = self.parts[name].variables
                values = {key: value for key, value in values.items() if key in known}
            self._parameters[name] = values
        for signal, value in given.items():
            name, _, variable = signal.partition(".")
            if name not in self._parameters:
                raise CouplingError(f"{signal}: there is no FMU {name} in {self.path.name}")
            self._parameters[name][variable] = value
        links: dict[str, list[tuple[str, str, str]]] = {name: [] for name in self.parts}
        for one in system.connections:
            links[one.endElement].append((one.endConnector, one.startElement, one.startConnector))
        self._links = links
        self._outputs: dict[str, list[str]] = {
            name: sorted({o for found in links.values() for _, s, o in found if s == name})
            for name in self.parts
        }

    @property
    def outputs(self) -> dict[str, list[str]]:
        """Names of all outputs by component; those of a Python part are not known."""
        return {
            name: [v.name for v in part.variables.values() if v.causality == "output"]
            if isinstance(part, Component)
            else []
            for name, part in self.parts.items()
        }

    def run(
        self,
        duration: float,
        step: float = 1e-3,
        signals: Sequence[str] = (),
        interval: float | None = None,
    ) -> CoupledRun:
        """Run the system from time zero, and end all its parts.

        Parameters
        ----------
        duration, step : float
            [s]
        signals : sequence of str
            To be kept beside those that are connected.
        interval : float, optional
            Time between rows [s]; each step if left out.

        Returns
        -------
        CoupledRun
            With what there is, and the reason, where a part failed on the way.
        """
        count, every = _steps(duration, step, interval)
        try:
            return self._loop(count, step, every, list(signals))
        finally:
            self.free()

    def _loop(self, count: int, step: float, every: int, signals: list[str]) -> CoupledRun:
        self._connect(signals)
        self._initialise()
        names = [f"{name}.{output}" for name in self.parts for output in self._outputs[name]]
        rows = [[0.0, *self._row(names)]]
        error, done = "", 0
        for k in range(count):
            time = k * step
            try:
                self._step(time, step)
            except CouplingError as failure:
                error = f"at {time:.6g} s {failure}"
                break
            done = k + 1
            if done % every == 0:
                rows.append([done * step, *self._row(names)])
        table = np.array(rows, dtype=float)
        columns = {name: table[:, k] for k, name in enumerate(["time", *names])}
        return CoupledRun(columns, step, done, error)

    def _connect(self, signals: list[str]) -> None:
        """Make what reads and sets; everything that is kept is read."""
        for signal in signals:
            name, _, output = signal.partition(".")
            if name not in self.parts:
                raise CouplingError(f"{signal}: there is no component {name}")
            if output not in self._outputs[name]:
                self._outputs[name].append(output)
        self._values: dict[str, dict[str, Any]] = {name: {} for name in self.parts}
        self._readers: dict[str, tuple[list[str], Callable[[], list[Any]]]] = {}
        self._late: dict[str, tuple[list[str], Callable[[], list[Any]]]] = {}
        self._setters: dict[str, Callable[[list[Any]], None]] = {}
        needed = {name: {o for found in self._links.values() for _, s, o in found if s == name}
                  for name in self.parts}  # fmt: skip
        for name, part in self.parts.items():
            outputs = self._outputs[name]
            now = [output for output in outputs if output in needed[name]]
            rest = [output for output in outputs if output not in needed[name]]
            self._outputs[name] = [*now, *rest]  # as `_row` gives them
            self._readers[name] = (now, part.getter(now))
            self._late[name] = (rest, part.getter(rest))
            self._setters[name] = part.setter([link[0] for link in self._links[name]])

    def _initialise(self) -> None:
        for name, part in self.parts.items():
            if isinstance(part, PythonPart):
                continue
            part.set(self._parameters[name])
            part.begin(0.0)
        for _ in range(INITIAL_PASSES):
            for name, part in self.parts.items():
                if isinstance(part, PythonPart):
                    if all(source in self._values[s] for _, s, source in self._links[name]):
                        self._give(name, 0.0)
                        part.step(0.0, 0.0)
                        self._take(name, 0.0)
                    continue
                self._take(name, 0.0)
            for name in self.parts:
                self._give(name, 0.0)
        for part in self.parts.values():
            if isinstance(part, Component):
                part.end_initialisation()
        for name in self.parts:
            self._take(name, 0.0)

    def _step(self, time: float, step: float) -> None:
        for name, part in self.parts.items():
            self._give(name, time)
            part.step(time, step)
            if self.order == "gauss-seidel":
                self._take(name, time + step)
        if self.order == "jacobi":
            for name in self.parts:
                self._take(name, time + step)

    def _take(self, name: str, time: float) -> None:
        """Read the outputs that others need."""
        names, read = self._readers[name]
        for output, value in zip(names, read(), strict=True):
            if not math.isfinite(value):
                raise CouplingError(f"{name}: {output} = {value!r} is no number")
            self._values[name][output] = value

    def _give(self, name: str, time: float) -> None:
        """Set the inputs; those whose source has no value yet stay as they are."""
        values = []
        for sink, source, output in self._links[name]:
            if output not in self._values[source]:
                return
            value = self._values[source][output]
            if self.on_way is not None:
                value = self.on_way(f"{name}.{sink}", time, value)
            values.append(value)
        self._setters[name](values)

    def _row(self, names: list[str]) -> list[Any]:
        row: list[Any] = []
        for name in self.parts:
            row += [self._values[name][output] for output in self._readers[name][0]]
            row += self._late[name][1]() if self._late[name][0] else []
        return row

    def free(self) -> None:
        """End all instances and remove the unpacked archive."""
        for part in self.parts.values():
            if isinstance(part, Component):
                part.free()
        shutil.rmtree(self._folder, ignore_errors=True)


def _archived(component: Any) -> dict[str, Any]:
    """Values that the archive binds to a component."""
    found = {}
    for binding in component.parameterBindings:
        for values in binding.parameterValues:
            for one in values.parameters:
                is_flag = one.type == "Boolean"
                found[one.name] = one.value in ("true", "1") if is_flag else float(one.value)
    return found


def _steps(duration: float, step: float, interval: float | None) -> tuple[int, int]:
    """Number of steps, and of steps between rows."""
    for name, value in (("duration", duration), ("step", step)):
        if not 0.0 < value < math.inf:
            raise CouplingError(f"{name} = {value!r} s: must be above 0 s")
    count = math.floor(duration / step + ROUNDING)
    if count < 1:
        raise CouplingError(f"step = {step!r} s: is longer than the duration of {duration!r} s")
    every = 1 if interval is None else max(1, round(interval / step))
    return count, every
