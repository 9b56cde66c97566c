"""Relative change of a number against another, with what is known of its error."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from percussion_model.simulation.uncertain import (
    UNDECIDED,
    change_text,
    depends_on_cells,
    hides_change,
    known_error,
    known_scatter,
)

__all__ = ["SIGMAS", "Change", "change_error", "change_of", "relative_change"]

# A change is decided beyond so many standard errors of the scatter: a table has dozens of
# them, and beyond two one in twenty is chance.
SIGMAS = 3.0


@dataclass(frozen=True)
class Change:
    """Relative change of a number against another.

    Attributes
    ----------
    value : float or None
        None where it is not defined.
    error : float or None
        By grid and scatter of both numbers; None where that of one of them is not known.
    known : float
        What of the error is known: `error`, or what one of the numbers, or scatter, makes.
    scatter : float
        The part of the scatter of both, a standard error.
    hidden : bool
        Whether it is undecided for another reason.
    """

    value: float | None
    error: float | None = None
    known: float = 0.0
    scatter: float = 0.0
    hidden: bool = False

    @property
    def is_undecided(self) -> bool:
        """Whether what is known of the error may explain all of the change.

        Not where both are too small to be shown: there is none then.
        """
        if self.value is None or self.hidden:
            return self.hidden
        return hides_change(self.value, max(self.known, SIGMAS * self.scatter))

    @property
    def is_rough(self) -> bool:
        """Whether there is a change, and a part of its error is not known."""
        return bool(self.value) and self.error is None and not self.is_undecided

    def text(self) -> str:
        """The change in per cent with its error; a dash where there is none."""
        if self.is_undecided:
            return UNDECIDED
        return change_text(self.value, self.known if self.is_rough else self.error, self.is_rough)


def change_of(
    here: Mapping[str, Any], base: Mapping[str, Any], key: str, same_grid: bool = False
) -> Change:
    """Return the change of a number of a summary against that of another.

    Parameters
    ----------
    here, base : mapping
        Of two results, or of two trials of a study of effects.
    key : str
        Name of the number.
    same_grid : bool
        Whether both are of the same grid, which puts both off by the same, so that scatter
        is left.

    Returns
    -------
    Change
    """
    pair = here, base
    value = relative_change(here[key], base[key])
    if value is None:
        return Change(None)
    scatters = [known_scatter(one, key) for one in pair]
    errors = scatters if same_grid else [known_error(one, key) for one in pair]
    known = [
        (scatter or 0.0) if error is None else error
        for error, scatter in zip(errors, scatters, strict=True)
    ]

    def by(parts: list[float | None]) -> float:
        return change_error(here[key], parts[0] or 0.0, base[key], parts[1] or 0.0) or 0.0

    error = change_error(here[key], errors[0], base[key], errors[1])
    hidden = any(depends_on_cells(one, key) for one in pair)
    return Change(value, error, by([*known]), by(scatters), hidden)


def relative_change(value: float | None, base: float | None) -> float | None:
    """Return value / base - 1, None where that is not defined."""
    if value is None or base is None or base == 0 or not math.isfinite(value / base):
        return None
    return value / base - 1.0


def change_error(
    value: float | None, error: float | None, base: float | None, base_error: float | None
) -> float | None:
    """Error of value / base - 1, where those of both are independent.

    No less than that of value - base, relative to the base: a difference within the errors
    stays within them, however large they are. None where it is not defined, or one of the
    errors is not known.
    """
    if value is None or base is None or relative_change(value, base) is None:
        return None
    if error is None or base_error is None:
        return None
    return math.hypot(error, max(abs(value / base), 1.0) * base_error) / abs(base)
