"""Parts that change slowly take longer steps than the loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from percussion_model.coupling.component import Component, CouplingError
from percussion_model.coupling.port import Port


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

    def give(self, time: float) -> None:
        """Set the inputs where a step is due."""
        if self._count:
            self._done += 1
            self._since += 1
            self.is_due = self._since == self._every or self._done == self._count
        if self.is_due:
            super().give(time)

    def _step(self, time: float, step: float) -> None:
        if self.is_due:
            before = self._since - 1
            self._whole_step(time - before * step, step * self._since)

    def take(self) -> None:
        """Read the outputs where a step was done."""
        if self.is_due:
            super().take()
            self._since = 0


def check_pace(every: Mapping[str, int], components: Sequence[str]) -> dict[str, int]:
    """Those parts that are slower than the loop; `CouplingError` if one is not known."""
    for name, steps in every.items():
        if name not in components:
            raise CouplingError(
                f"every {name}={steps}: there is no component {name}, only {', '.join(components)}"
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
