"""A part of a system at its place in the loop: where its inputs come from, where its outputs go."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import Any

from percussion_model.coupling.component import CouplingError

OnWay = Callable[[str, float, Any], Any]


class Port:
    """A part with what reads and sets it.

    The values of all outputs lie in one list, `values`, each at a place of its own.

    Parameters
    ----------
    part : Component or PythonPart
    links : sequence of tuple
        Name of an input, component and output that it takes.
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
        links: Sequence[tuple[str, str, str]],
        taken: Sequence[str],
        kept: Sequence[str],
        on_way: OnWay | None,
    ) -> None:
        self.part, self.name, self.on_way = part, part.name, on_way
        self.step: Callable[[float, float], None] = part.step
        self.reader, late = part.reader(taken), part.reader(kept)
        self.taken: list[str] = self.reader.names
        self.kept: list[str] = late.names
        self.writer = part.writer([sink for sink, _, _ in links])
        self.read: Callable[[], list[Any]] = self.reader.read
        self.read_kept: Callable[[], list[Any]] = late.read
        self.write: Callable[[Sequence[Any]], None] = self.writer.write
        self.begin = self.end = 0
        self._links = {sink: (source, output) for sink, source, output in links}

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

    def give(self, time: float) -> None:
        """Set the inputs."""
        chosen = self._chosen(self.values)
        if self.on_way is not None:
            change = self.on_way
            pairs = zip(self._signals, chosen, strict=True)
            chosen = tuple(change(signal, time, value) for signal, value in pairs)
        self.write(chosen)

    def take(self) -> None:
        """Read the outputs that others take; they have to be numbers."""
        found = self.read()
        try:
            sound = math.isfinite(sum(found))
        except TypeError:
            said = dict(zip(self.taken, found, strict=False))
            raise CouplingError(f"{self.name}: {said} are not all numbers") from None
        if not sound:
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
