"""Numbers with their errors as text."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

# Digits after the point; smaller errors are not shown.
MOST_DIGITS = 5


def with_error(value: float, error: float) -> str:
    """Return a number and its error, both to the second digit of the error."""
    if error < 10.0**-MOST_DIGITS:
        return f"{value:.5g}"
    digits = min(max(1 - math.floor(math.log10(error)), 0), MOST_DIGITS)
    text = f"{value:.{digits}f} ± {error:.{digits}f}"
    return f"undecided, {text}" if error >= abs(value) else text


def with_short_error(value: float, error: float) -> str:
    """Return a number to the one digit that its error is known to: 17.5 ± 0.4, or 40 ± 30."""
    place = math.floor(math.log10(float(f"{error:.0e}")))
    digits = max(-place, 0)
    return f"{round(value, -place):.{digits}f} ± {round(error, -place):.{digits}f}"


def rate_text(summary: Mapping[str, Any]) -> str:
    """Rate of penetration in mm/s and, where it is known, how far it may be off."""
    rate, error = summary["rate_of_penetration"], summary["rate_of_penetration_relative_error"]
    if rate is None:
        return "-"
    if error is None:
        return f"{1e3 * rate:.5g}, error not estimated"
    return with_error(1e3 * rate, 1e3 * abs(rate) * error)
