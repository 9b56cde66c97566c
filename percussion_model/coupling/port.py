"""Ports: the parts of a system wired into the loop, each at its own pace."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from typing import Any

from percussion_model.coupling.component import Component, CouplingError
from percussion_model.coupling.wiring import Link
from percussion_model.scene.rows import said_among

OnWay = Callable[[str, float, Any], Any]


class Port:
    """A part with what reads and sets it.

    The values of all outputs lie in one list, `values`, each at a place of its own.

    Parameters
    ----------
    part : Component or PythonPart
    links : sequence of Link
        Of its inputs.
    taken : sequence of str
        Outputs that other parts take.
    kept : sequence of str
        Outputs that are read for the rows of the result alone.
    on_way : callable, optional
        Changes what an input receives.
    """

    def __init__(
        self,
        part: Any,
        links: Sequence[Link],
        taken: Sequence[str],
        kept: Sequence[str],
        on_way: OnWay | None,
    ) -> None:
        self.part, self.name, self.on_way = part, part.name, on_way
        self.step: Callable[[float, float], None] = part.step
        self.reader, late = part.reader(taken), part.reader(kept)
        self.taken: list[str] = self.reader.names
        self.kept: list[str] = late.names
        self.writer = part.writer([link.input for link in links])
        self.read: Callable[[], list[Any]] = self.reader.read
        self.read_kept: Callable[[], list[Any]] = late.read
        self.write: Callable[[Sequence[Any]], None] = self.writer.write
        self.begin = self.end = 0
        self._links = {link.input: (link.source, link.output) for link in links}
        changes = {link.input: link.change for link in links}
        self._changes = [changes[sink] for sink in self.writer.names]
        # whether values are not as they were given
        self.converts = any(self._changes)

    def connect(self, values: list[Any], places: dict[tuple[str, str], int]) -> None:
        """Find the places of inputs and outputs; `places` has those of all outputs."""
        self.values = values
        if self.taken:
            self.begin = places[self.name, self.taken[0]]
            self.end = self.begin + len(self.taken)
        sinks = self.writer.names
        self.places = [places[self._links[sink]] for sink in sinks]
        self._signals = [f"{self.name}.{sink}" for sink in sinks]
        places_of_mine = self.places
        self._chosen: Callable[[list[Any]], tuple[Any, ...]] = (
            itemgetter(*places_of_mine)
            if len(places_of_mine) > 1
            else lambda values: tuple(values[place] for place in places_of_mine)
        )

    @property
    def is_fed(self) -> bool:
        """Whether all inputs have a value."""
        return None not in [self.values[place] for place in self.places]

    def set_inputs(self, time: float) -> None:
        """Set the inputs."""
        chosen = self._chosen(self.values)
        if self.converts:
            both = zip(chosen, self._changes, strict=True)
            chosen = tuple(value if change is None else change(value) for value, change in both)
        if self.on_way is not None:
            change = self.on_way
            pairs = zip(self._signals, chosen, strict=True)
            chosen = tuple(change(signal, time, value) for signal, value in pairs)
        self.write(chosen)

    def read_outputs(self) -> None:
        """Read the outputs that others take; they have to be numbers."""
        found = self.read()
        try:
            are_finite = math.isfinite(sum(found))
        except TypeError:
            given = dict(zip(self.taken, found, strict=False))
            wrong = {name: one for name, one in given.items() if not hasattr(one, "__float__")}
            raise CouplingError(f"{self.name}: {wrong or given}: must be numbers") from None
        if not are_finite:
            self.refuse(found)
        self.values[self.begin : self.end] = found

    def refuse(self, found: Sequence[Any]) -> None:
        """Raise the error of outputs of which one is no number."""
        for output, value in zip(self.taken, found, strict=True):
            if not math.isfinite(value):
                raise CouplingError(f"{self.name}: {output} = {value!r} is no number")

    def row(self) -> list[Any]:
        """Values of all outputs that are kept."""
        return [*self.values[self.begin : self.end], *self.read_kept()]


class PacedPort(Port):
    """A part that does several steps of the loop as one.

    It does so with the last of them, and takes the inputs that this one takes: those at its
    beginning, and with Gauss-Seidel what parts before it gave in it. Until then the others
    see what it gave before. So nothing is known before its time.
    """

    is_due = True
    _every = _count = _done = _since = 0

    def start(self, every: int, count: int) -> None:
        """Do `every` steps at once from now on, and fewer at the end of `count` steps."""
        self._every, self._count = every, count
        self._whole_step, self.step = self.step, self._step

    def set_inputs(self, time: float) -> None:
        """Set the inputs where a step is due."""
        if self._count:
            self._done += 1
            self._since += 1
            self.is_due = self._since == self._every or self._done == self._count
        if self.is_due:
            super().set_inputs(time)

    def _step(self, time: float, step: float) -> None:
        if self.is_due:
            before = self._since - 1
            self._whole_step(time - before * step, step * self._since)

    def read_outputs(self) -> None:
        """Read the outputs where a step was done."""
        if self.is_due:
            super().read_outputs()
            self._since = 0


def check_pace(every: Mapping[str, int], components: Sequence[str]) -> dict[str, int]:
    """Those parts that are slower than the loop; `CouplingError` if one is not known."""
    for name, steps in every.items():
        if name not in components:
            raise CouplingError(
                f"every {name}={steps}: there is no component {name}: "
                f"{said_among(name, components)}"
            )
        if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
            raise CouplingError(f"every {name}={steps!r}: must be a whole number from 1")
    return {name: steps for name, steps in every.items() if steps > 1}


def refuse_remainder(every: Mapping[str, int], parts: Mapping[str, Any], count: int) -> None:
    """Raise `CouplingError` for a part that would have a shorter last step, and takes none."""
    for name, steps in every.items():
        if count % steps and isinstance(parts[name], Component) and not parts[name].can_vary:
            raise CouplingError(
                f"every {name}={steps}: {name} takes no steps of varying size, and {count} steps "
                f"are no multiple of {steps}"
            )
