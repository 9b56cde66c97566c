"""Co-simulation master: the loop over the parts of a system.

The loop of fmpy (`fmpy.ssp.simulation`) starts every input at 0, takes no parameters from
the archive, keeps one order and every row, and loses all of them with the first error; so the
loop is here, with the same meaning of a step.
"""

from __future__ import annotations

import gc
import math
import shutil
import tempfile
import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np

from percussion_model.coupling.compiled import CompiledSteps, can_compile
from percussion_model.coupling.component import (
    Component,
    CouplingError,
    naming,
    number_of_text,
    read_description,
)
from percussion_model.coupling.component3 import Component3
from percussion_model.coupling.coupled_run import JUDGED, CoupledRun, known_signals
from percussion_model.coupling.port import (
    OnWay,
    PacedPort,
    Port,
    check_pace,
    refuse_remainder,
)
from percussion_model.coupling.python_part import Given, PythonPart, input_starts
from percussion_model.coupling.rejection import StepControl
from percussion_model.coupling.ssp import place_of, unpack
from percussion_model.coupling.unpack import Allowance, check_xml, new_folder, unpack_zip
from percussion_model.coupling.verdict import Jumps
from percussion_model.coupling.wiring import Wiring
from percussion_model.scene.rows import said_among
from percussion_model.simulation.simulate import stop_on_interrupt

Order = Literal["jacobi", "gauss-seidel"]
# Passes over the outputs while all parts are initialised: as many as the longest chain.
INITIAL_PASSES = 4
# New objects that may be there before garbage is looked for.
YOUNG = 50_000
DESCRIPTION = "modelDescription.xml"
# Steps that compiled code does before it is looked whether the run is to end.
AT_ONCE = 200
# A number of steps is whole if it misses by no more than this.
ROUNDING = 1e-9
# Parameter of parts whose steps must all be of a length known beforehand, as a string of waves,
# and their input from the part of which that holds too.
STEP, TIMED = "communication_step", "returned_begin"


class Coupling:
    """A system of FMUs, ready to be run once.

    Parameters
    ----------
    path : str or Path
        SSP archive.
    parameters : mapping, optional
        Values that go before those of the archive, by `component.variable`; enumerations
        by number or by word.
    replaced : mapping, optional
        Paths of other FMUs, or Python callables, by component; a class or a factory of them
        makes one at the begin of the run, and an object that keeps values is reset or copied
        (`percussion_model.coupling.fresh`).
    order : {"jacobi", "gauss-seidel"}
        Whether a part sees what parts before it in the archive gave in the same step.
    on_way : callable, optional
        Changes what an input receives: takes signal of the input, time [s], value.
    every : mapping, optional
        Steps of the loop that a part does as one, by component: for parts that change slowly.
    compiled : bool
        Whether compiled code makes the calls where all parts are FMUs; the bits are the same.
    trust : bool
        Whether the archive may be of any size and name FMUs outside of it (docs/data/trust.md).

    Attributes
    ----------
    start : float
        Time at which the run begins [s]; that of the archive's default experiment, unless it is
        set before the run.
    stop : float or None
        Where the default experiment ends [s].
    remark : str
        What is not sure of the archive: units that its connections lack.
    """

    def __init__(
        self,
        path: str | Path,
        parameters: Mapping[str, Any] | None = None,
        replaced: Mapping[str, str | Path | Given] | None = None,
        order: Order = "jacobi",
        on_way: OnWay | None = None,
        every: Mapping[str, int] | None = None,
        compiled: bool = True,
        trust: bool = False,
    ) -> None:
        self.path = Path(path)
        self.order, self.on_way, self.compiled = order, on_way, compiled
        self._compiled: CompiledSteps | None = None
        self._folder = new_folder()
        self.parts: dict[str, Any] = {}
        try:
            self._set_up(dict(parameters or {}), dict(replaced or {}), Allowance(trust))
            self.every = check_pace(every or {}, list(self.parts))
        except BaseException:
            self.free()
            raise

    def _set_up(
        self, given: dict[str, Any], replaced: dict[str, Any], allowance: Allowance
    ) -> None:
        inside = tempfile.mkdtemp(prefix="archive-", dir=self._folder)
        archive = unpack(self.path, inside, allowance)
        for name in replaced.keys() - archive.sources.keys():
            raise CouplingError(f"{self.path.name} has no component {name}")
        folders, descriptions = {}, {}
        for name, source in archive.sources.items():
            chosen = replaced.get(name, source)
            fmu = source if callable(chosen) else Path(chosen)
            folders[name] = tempfile.mkdtemp(prefix="fmu-", dir=self._folder)
            with naming(f"{name}: {fmu.name}"):
                unpack_zip(fmu, Path(folders[name]), allowance)
            with naming(name):
                check_xml(Path(folders[name]) / DESCRIPTION, DESCRIPTION, allowance)
            descriptions[name] = read_description(name, folders[name])
        others = {name for name, chosen in replaced.items() if not callable(chosen)}
        with naming(self.path):
            wiring = Wiring(archive, descriptions, others)
            self._links, values = wiring.links(), wiring.values()
        self.remark = wiring.remark
        self.start, self.stop = archive.start or 0.0, archive.stop
        for name, description in descriptions.items():
            if callable(chosen := replaced.get(name)):
                starts = input_starts(name, description, values.pop(name))
                self.parts[name] = PythonPart(name, chosen, starts)
            else:
                kind = {"2.0": Component, "3.0": Component3}[description.fmiVersion]
                self.parts[name] = kind(name, folders[name], description)
        self._parameters, self._asked = values, given
        for signal, value in given.items():  # before those of the archive
            component, variable = place_of(signal, descriptions)
            if component not in values and component in descriptions:
                raise CouplingError(
                    f"{signal}: {component} is a Python callable, which has no variables to set"
                )
            if component not in values:
                raise CouplingError(
                    f"{signal}: there is no FMU {component} in {self.path.name}: "
                    f"{said_among(component, values)}"
                )
            values[component][variable] = value

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
        tolerance: float | None = None,
        progress: Callable[[float], None] | None = None,
        on_interrupt: Literal["raise", "keep"] = "raise",
        tell: Callable[[str], object] | None = None,
    ) -> CoupledRun:
        """Run the system from its `start`, and end all its parts.

        Parameters
        ----------
        duration, step : float
            [s]
        signals : sequence of str
            To be kept beside those that are connected.
        interval : float, optional
            Time between rows [s]; each step if left out.
        tolerance : float, optional
            Greatest error of a step, by the size of each signal [1]: steps are shortened,
            and taken back, to keep to it. `step` is the longest one then.
        progress : callable, optional
            Called with the time since the start at each row [s].
        on_interrupt : {"raise", "keep"}
            What Ctrl-C does when the present step is over: raise KeyboardInterrupt, or return
            what there is.
        tell : callable, optional
            Called with `remark` and what an FMU says of kernels that it is going to compile,
            before it does.

        Returns
        -------
        CoupledRun
            With what there is, and the reason, where a part failed on the way.
        """
        try:
            count, every = whole_steps(duration, step, interval)
            if not self.start < self.start + step < math.inf:
                raise CouplingError(
                    f"start = {self.start!r} s: must be a finite time that a step of {step:g} s "
                    "changes"
                )
            self._refuse_contradictions(count, tolerance)
            self._tell_of_step(step, tolerance)
            if self.remark and tell is not None:
                tell(self.remark)
            self._connect([*signals, *known_signals(self.outputs, JUDGED)])
            self._initialise(tell)
            control = None if tolerance is None else StepControl(self.ports, step, tolerance)
            with rare_garbage_collection():
                run = self._loop(count, step, every, control, progress)
            if run.interrupted and on_interrupt == "raise":
                raise KeyboardInterrupt
            return run
        finally:
            self.free()

    def _refuse_contradictions(self, count: int, tolerance: float | None) -> None:
        if tolerance is not None and self.on_way is not None:
            raise CouplingError("on_way cannot be taken back with a step: omit the tolerance")
        if tolerance is not None and self.every:
            slow = ", ".join(f"{name}={steps}" for name, steps in self.every.items())
            raise CouplingError(
                f"tolerance {tolerance:g} and every {slow} do not go together (--tolerance, "
                "--every): omit one of them"
            )
        refuse_remainder(self.every, self.parts, count)

    def _tell_of_step(self, step: float, tolerance: float | None) -> None:
        """Give parts that want to know it the length of the steps [s], which they all must have."""
        for name, part in self.parts.items():
            if not isinstance(part, Component) or not {STEP, TIMED} <= part.variables.keys():
                continue
            signal = f"{name}.{STEP}"
            if tolerance is not None:
                raise CouplingError(f"tolerance {tolerance:g} and {signal}, a fixed step, do not "
                                    "go together: omit --tolerance")  # fmt: skip
            partners = {link.source for link in self._links[name] if link.input == TIMED}
            for slow in self.every.keys() & {name, *partners}:
                raise CouplingError(f"every {slow}={self.every[slow]}: {slow} exchanges waves, in "
                                    "steps of the run: omit --every of it")  # fmt: skip
            asked = self._asked.get(signal, step)
            if isinstance(asked, str):
                asked = number_of_text(name, part.variables[STEP], asked)
            if abs(asked - step) > ROUNDING * step:
                raise CouplingError(f"{signal} = {asked:g} s: must be the step of the run, "
                                    f"{step:g} s (--step), or omitted")  # fmt: skip
            self._parameters[name][STEP] = step

    def _loop(
        self,
        count: int,
        step: float,
        every: int,
        control: StepControl | None,
        progress: Callable[[float], None] | None,
    ) -> CoupledRun:
        names = [f"{port.name}.{name}" for port in self.ports for name in port.taken + port.kept]
        start = self.start
        rows, jumps = [[start, *self._row()]], Jumps(self.ports, self.every, self._by_waves())
        go, error, done, interrupted = self._stepping(count, step, control), "", 0, False
        began, used = clock.perf_counter(), clock.process_time()
        with stop_on_interrupt(keep=True) as stop:
            while done < count:
                due = min((done // every + 1) * every, count)
                has_row = done + 1 == due
                before = self._present() if has_row else None
                try:
                    # the last step before a row alone: it tells by how much signals change
                    done = go(done, due if has_row else due - 1)
                except CouplingError as failure:
                    done = done if self._compiled is None else self._compiled.done
                    error = f"at {start + done * step:.6g} s: {failure}"
                    break
                interrupted = stop()
                if has_row or interrupted:
                    rows.append([start + done * step, *self._row()])
                    if before is not None:
                        jumps.add(before, self._present())
                    if progress is not None:
                        progress(done * step)
                if interrupted:
                    error = f"at {start + done * step:.6g} s it was interrupted"
                    break
        times = clock.perf_counter() - began, clock.process_time() - used
        table = np.array(rows, dtype=float)
        columns = {name: table[:, k] for k, name in enumerate(["time", *names])}
        run = CoupledRun(columns, step, done, error, 0, 0, *times, interrupted, jumps.by_size())
        if control is not None:
            run.steps, run.tried, run.rejected = control.done, control.tried, control.rejected
        return run

    def _by_waves(self) -> set[tuple[str, str]]:
        """Outputs that go from a part to its partner in waves alone: forces act by these there."""
        found: set[tuple[str, str]] = set()
        others: set[tuple[str, str]] = set()
        for links in self._links.values():
            partners = {link.source for link in links if link.input == TIMED}
            for link in links:
                (found if link.source in partners else others).add((link.source, link.output))
        return found - others

    def _stepping(
        self, count: int, step: float, control: StepControl | None
    ) -> Callable[[int, int], int]:
        """Return what does steps from one number on, up to another or not as far.

        It gives the number that it has come to. Compiled code does them where that is possible,
        else Python.
        """
        start = self.start
        if control is None and self.compiled and can_compile(self.ports):
            self._compiled = CompiledSteps(self.ports, self.order, start, step, count, self.every)
            compiled = self._compiled

            def go(done: int, until: int) -> int:
                compiled.go(min(until, done + AT_ONCE))
                return compiled.done

            return go
        for port in self.ports:
            if isinstance(port, PacedPort) and control is None:
                port.start(self.every[port.name], count)
        one = self.step if control is None else control.stepping(self.step)

        def go_on(done: int, until: int) -> int:
            one(start + done * step, step)
            return done + 1

        return go_on

    def _connect(self, signals: list[str]) -> None:
        """Make the ports; everything that is kept is read."""
        taken: dict[str, list[str]] = {name: [] for name in self.parts}
        kept: dict[str, list[str]] = {name: [] for name in self.parts}
        for links in self._links.values():
            for link in links:
                if link.output not in taken[link.source]:
                    taken[link.source].append(link.output)
        for signal in signals:
            name, output = place_of(signal, self.parts)
            if name not in self.parts:
                raise CouplingError(f"{signal}: there is no component {name}")
            if output not in taken[name] + kept[name]:
                kept[name].append(output)
        self.ports = [
            (PacedPort if name in self.every else Port)(
                part, self._links[name], taken[name], kept[name], self.on_way
            )
            for name, part in self.parts.items()
        ]
        places: dict[tuple[str, str], int] = {}
        for port in self.ports:
            for output in port.taken:
                places[port.name, output] = len(places)
        values: list[Any] = [None] * len(places)
        for port in self.ports:
            port.connect(values, places)

    def _initialise(self, tell: Callable[[str], object] | None) -> None:
        for name, part in self.parts.items():
            if isinstance(part, Component):
                part.set(self._parameters[name])
                part.begin(self.start)
                if tell is not None:
                    for text in part.compilation():
                        tell(text)
            else:
                part.begin()
        for _ in range(INITIAL_PASSES):
            for port in self.ports:
                if isinstance(port.part, Component):
                    port.read_outputs()
                elif port.is_fed:
                    port.set_inputs(self.start)
                    port.step(self.start, 0.0)
                    port.read_outputs()
            for port in self.ports:
                if port.is_fed:
                    port.set_inputs(self.start)
        for part in self.parts.values():
            if isinstance(part, Component):
                part.end_initialisation()
        for port in self.ports:
            port.read_outputs()

    def step(self, time: float, step: float) -> None:
        """Let all parts do a communication step [s]."""
        one_after_another = self.order == "gauss-seidel"
        for port in self.ports:
            port.set_inputs(time)
            port.step(time, step)
            if one_after_another:
                port.read_outputs()
        for port in () if one_after_another else self.ports:
            port.read_outputs()

    def _present(self) -> list[Any]:
        """Present values of all outputs that parts take."""
        if self._compiled is not None:
            self._compiled.publish()
        return list(self.ports[0].values)

    def _row(self) -> list[Any]:
        self._present()
        return [value for port in self.ports for value in port.row()]

    def free(self) -> None:
        """End all instances and remove the unpacked archive."""
        for part in self.parts.values():
            if isinstance(part, Component):
                part.free()
        shutil.rmtree(self._folder, ignore_errors=True)


@contextmanager
def rare_garbage_collection() -> Iterator[None]:
    """Collect garbage rarely, and not what is there already: a step makes hardly any."""
    thresholds = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(YOUNG, *thresholds[1:])
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)
        gc.unfreeze()


def whole_steps(duration: float, step: float, interval: float | None) -> tuple[int, int]:
    """Number of steps, and of steps between rows."""
    given = {"duration": duration, "step": step}
    if interval is not None:
        given["interval"] = interval
    for name, value in given.items():
        if not 0.0 < value < math.inf:
            raise CouplingError(f"{name} = {value!r} s: must be above 0 s")
    count = math.floor(duration / step + ROUNDING)
    if count < 1:
        raise CouplingError(f"step = {step!r} s: is longer than the duration of {duration!r} s")
    every = 1 if interval is None else max(1, round(interval / step))
    return count, every
