"""Run FMUs with input signals, collect outputs and plot: a thin layer on fmpy."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract
from fmpy.fmi1 import FMICallException

from percussion_model.coupling.component import (
    Component,
    find_variable,
    number_of_word,
    read_description,
)
from percussion_model.interface.progress import progress

from . import results
from .drawing import in_style, stacked
from .results import Archive, ScenarioError

HAMMER = results.DIST / "PercussiveHammer.fmu"
# A constant, or a function of time.
Signal = float | bool | Callable[[float], float | bool]
# "quantity [unit]", its factor, and names of the columns in a panel.
Panel = tuple[str, *tuple[float | str, ...]]


class Instance(Component):
    """One instance of an FMU, its variables by name; what the FMU refuses is an error of fmpy.

    Parameters
    ----------
    fmu : str or Path
        An FMU, or the folder of an unpacked one.
    name : str
        Of the instance.

    Attributes
    ----------
    time : float
        [s]
    messages : list of str
        What came through the logger.
    faults : list of str
        Those of them that are errors: the first one tells the reason.
    """

    def __init__(self, fmu: str | Path, name: str = "instance") -> None:
        self.folder, self._own = str(fmu), None
        if Path(fmu).is_file():
            self._own = tempfile.mkdtemp(prefix="fmu-")
            self.folder = extract(self.folder, self._own)
        self.description = read_description(name, self.folder)
        super().__init__(name, self.folder, self.description)
        self.time = 0.0

    def start(self, time: float = 0.0, **values: Any) -> Instance:
        """Set values by name (`__` for a dot, as in bit__force), then initialise."""
        self.set({name.replace("__", "."): value for name, value in values.items()})
        self.time = time
        self.slave.setupExperiment(startTime=time)
        self.slave.enterInitializationMode()
        for text in self.compilation():
            results.tell(text)
        self.slave.exitInitializationMode()
        return self

    def find(self, name: str) -> Any:
        """A variable by name; the error suggests another one."""
        return find_variable("the FMU", self.variables, name)

    def set(self, values: Mapping[str, Any]) -> None:
        """Set parameters or inputs; enumerations by number or by word."""
        for name, value in values.items():
            one, family = self.find(name), self.family(name)
            if isinstance(value, str):
                value = number_of_word(self.name, one, value)
            kind = {"Real": float, "Boolean": bool}.get(family, int)
            getattr(self.slave, f"set{family}")([one.valueReference], [kind(value)])

    def get(self, name: str) -> Any:
        """Present value of a variable."""
        family = self.family(name)
        value = getattr(self.slave, f"get{family}")([self.find(name).valueReference])[0]
        return bool(value) if family == "Boolean" else value

    def values(self, names: Iterable[str]) -> list[Any]:
        """Present values of several variables."""
        return [self.get(name) for name in names]

    @property
    def outputs(self) -> list[str]:
        """Names of the outputs."""
        return [name for name, one in self.variables.items() if one.causality == "output"]

    def step(self, step_size: float) -> None:
        """Do one communication step [s]."""
        self.slave.doStep(self.time, step_size)
        self.time += step_size

    def save(self) -> bytes:
        """State of the instance as bytes."""
        state = self.slave.getFMUstate()
        try:
            return bytes(self.slave.serializeFMUstate(state))
        finally:
            self.slave.freeFMUstate(state)

    def restore(self, saved: bytes, time: float) -> None:
        """Go back to a saved state of time `time` [s]."""
        state = self.slave.deSerializeFMUstate(saved)
        try:
            self.slave.setFMUstate(state)
        finally:
            self.slave.freeFMUstate(state)
        self.time = time

    def free(self) -> None:
        """End the instance; does nothing the second time."""
        super().free()
        if self._own is not None:
            shutil.rmtree(self._own, ignore_errors=True)
            self._own = None

    def __enter__(self) -> Instance:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self.free()
        if isinstance(error, FMICallException):  # the log has the reason
            raise ScenarioError(self.faults[0] if self.faults else str(error)) from error


def run(
    instance: Instance,
    stop_time: float,
    step_size: float,
    inputs: Mapping[str, Signal] | None = None,
    outputs: Sequence[str] | None = None,
    before_step: Callable[[Instance], None] | None = None,
) -> dict[str, np.ndarray]:
    """Step an initialised instance and collect its outputs.

    Parameters
    ----------
    stop_time, step_size : float
        [s]
    inputs : mapping, optional
        Signals by name; a function is read at the start of each step.
    outputs : sequence of str, optional
        All if left out.
    before_step : callable, optional
        Called before each step, as for a coupling.

    Returns
    -------
    dict of ndarray
        "time" and the outputs, at the start and after each step.
    """
    names = list(outputs if outputs is not None else instance.outputs)
    begin = instance.time
    count = round((stop_time - begin) / step_size)
    rows = [[begin, *instance.values(names)]]
    held: dict[str, Any] = {}
    for k in range(count):
        instance.time = begin + k * step_size
        for name, signal in (inputs or {}).items():
            value = signal(instance.time) if callable(signal) else signal
            if held.get(name) != value:
                instance.set({name: value})
                held[name] = value
        if before_step is not None:
            before_step(instance)
        instance.step(step_size)
        rows.append([instance.time, *instance.values(names)])
    table = np.array(rows, dtype=float)
    return {name: table[:, k] for k, name in enumerate(["time", *names])}


@in_style
def plot(path: Path, title: str, found: Mapping[str, np.ndarray], panels: Sequence[Panel]) -> Path:
    """Draw columns over time, one panel below the other.

    Returns
    -------
    Path
        The PNG file.
    """
    from percussion_model.interface.plotting.style import save_png

    missing = {name for _, _, *names in panels for name in names} - found.keys()
    if missing:
        raise ScenarioError(f"the FMU has no output {min(missing)}")
    labels = [label for label, *_ in panels]
    figure, axes = stacked(title, labels, (8.0, 1.0 + 1.8 * len(panels)))
    for ax, (_, factor, *names) in zip(axes, panels, strict=True):
        for name in names:
            ax.plot(found["time"], float(factor) * found[name], linewidth=1.2, label=name)
        if len(names) > 1:
            ax.legend(loc="upper right")
    return save_png(figure, path, 110)


def command_line(
    name: str,
    simulate: Callable[..., dict[str, np.ndarray]],
    title: str,
    panels: Sequence[Panel],
) -> None:
    """Run a scenario of the hammer by `python -m scenarios.NAME`, and plot it.

    See `plot` and `results.command_line`.
    """

    def work(paths: Sequence[Path], folder: Path) -> list[Path]:
        with progress(f"running {name}"):
            return [plot(folder / f"{name}.png", title, simulate(*paths), panels)]

    about = sys.modules[simulate.__module__].__doc__
    results.command_line(name, about, (fmu("HAMMER.fmu"),), work)


def fmu(metavar: str) -> Archive:
    """The hammer's FMU; that of `dist`, built if it is not there, where none is named."""
    return Archive(metavar, HAMMER, "modelDescription.xml", built)


def built() -> Path:
    """The hammer's FMU of `dist`, built now if it is not there."""
    if not HAMMER.exists():
        from fmu_src.commands.fmu import write_hammer

        write_hammer(output=HAMMER)
    return HAMMER


def ramp(*points: tuple[float, float]) -> Callable[[float], float]:
    """A signal that goes straight from point (time, value) to point."""
    times, values = zip(*points, strict=True)
    return lambda t: float(np.interp(t, times, values))
