"""Step rejection: steps are taken back where their error is too large.

A step is done whole and again as two halves; the difference of the forces that the parts
exchange tells the error, and the halves count. A position that is wrong shows in them by the
stiffness behind it. Where the error is too large the parts go back to where they were, which
all of them have to be able to, and a shorter step is tried.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from percussion_model.coupling.component import CouplingError
from percussion_model.coupling.port import Port

# Steps are the longest one over powers of two, down to this one; what counts are their halves.
HALVINGS = 6
# The error of a step goes by the square of its size, so a double one is tried from here.
SAFE_SHARE = 0.25

Step = Callable[[float, float], None]


class StepControl:
    """Size of the steps within each communication step of a run.

    Parameters
    ----------
    ports : sequence of Port
        All parts; each must be able to save its state.
    longest : float
        Step [s].
    tolerance : float
        Greatest difference of a force between one step and two halves, divided by the greatest
        force so far [1]; of any number, divided by its own size, where parts exchange no forces.

    Attributes
    ----------
    done, tried, rejected : int
        Steps that count; steps that were computed beside them; those of these that were
        taken back with the ones that had to be repeated.
    """

    def __init__(self, ports: Sequence[Port], longest: float, tolerance: float) -> None:
        if not 0.0 < tolerance < math.inf:
            raise CouplingError(f"tolerance = {tolerance!r}: must be above 0")
        unable = [port.name for port in ports if not port.part.can_save]
        if unable:
            raise CouplingError(
                f"{', '.join(unable)}: cannot save and restore a state, which steps that are "
                "taken back need; omit the tolerance"
            )
        fixed = [port.name for port in ports if not port.part.can_vary]
        if fixed:
            raise CouplingError(
                f"{', '.join(fixed)}: takes no steps of varying size; omit the tolerance"
            )
        self.ports, self.longest, self.tolerance = list(ports), longest, tolerance
        self.done = self.tried = self.rejected = 0
        self._level = 0  # of the present step: longest / 2**level
        self._values = self.ports[0].values
        forces = [
            port.begin + k
            for port in ports
            for k, name in enumerate(port.taken)
            if port.part.variables[name].unit == "N"
        ]
        self._compared, self._is_force = forces or list(range(len(self._values))), bool(forces)
        self._sizes = [abs(float(value)) for value in self._values]

    def stepping(self, step: Step) -> Step:
        """Return what does a communication step by steps of its own choice."""

        def step_controlled(time: float, length: float) -> None:
            ticks, at = 2**HALVINGS, 0
            while at < ticks:
                # a longer step only where it fits the grid of its size
                while at % (ticks >> self._level):
                    self._level += 1
                at += self._try(step, time, length, at)

        return step_controlled

    def _try(self, step: Step, time: float, length: float, at: int) -> int:
        """Do one step, by halves; return its ticks."""
        tick = length / 2**HALVINGS
        saved = [port.part.save() for port in self.ports]
        before = list(self._values)
        while True:
            ticks = 2**HALVINGS >> self._level
            size, begin = ticks * tick, time + at * tick
            step(begin, size)
            self.tried += 1
            whole = list(self._values)
            self._go_back(saved, before)
            step(begin, 0.5 * size)
            step(begin + 0.5 * size, 0.5 * size)
            error = self._error(whole)
            if error <= self.tolerance or self._level == HALVINGS:
                break
            self.tried += 2
            self.rejected += 1
            self._level += 1
            self._go_back(saved, before)
        for port, state in zip(self.ports, saved, strict=True):
            port.part.drop(state)
        self.done += 2
        for place in self._compared:
            self._sizes[place] = max(self._sizes[place], abs(self._values[place]))
        if error < SAFE_SHARE * self.tolerance and self._level > 0:
            self._level -= 1
        return ticks

    def _go_back(self, saved: Sequence[Any], before: Sequence[Any]) -> None:
        for port, state in zip(self.ports, saved, strict=True):
            port.part.restore(state)
            port.writer.forget()
        self._values[:] = before

    def _error(self, whole: Sequence[Any]) -> float:
        """Greatest difference from the result of one whole step, divided by size."""
        greatest = max(self._sizes[place] for place in self._compared) if self._is_force else 0.0
        error = 0.0
        for place in self._compared:
            halves = self._values[place]
            size = greatest or max(self._sizes[place], abs(halves), abs(whole[place]))
            if whole[place] != halves:
                error = max(error, abs(whole[place] - halves) / size)
        return error
