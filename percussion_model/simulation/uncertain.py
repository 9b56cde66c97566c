"""Numbers with their errors, and differences of them, as text."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from percussion_model.simulation.means import COUNTS
from percussion_model.simulation.rate import LEAST_BLOWS

# Digits after the point; smaller errors are not shown.
MOST_DIGITS = 5
# Digits of a number that is known to rounding, of one whose error does not show in them, and
# of one of whose error nothing is known: coarse grids are off by some per mille.
SURE_DIGITS, SHOWN_DIGITS, UNSURE_DIGITS = 5, 4, 3
# Digits of a time that was taken once, and of what is made of it.
TIMED = 2
# An error below this share of a number does not show in the four digits of a narrow column.
SMALL_ERROR = 1e-4
# The same where numbers are in SI units, in which rates are some 1e-2.
SMALLEST_UNIT = 8
# Greater numbers are written with an exponent.
LARGEST_PLAIN = 1e8
# Changes below this show in no digit, and their errors neither.
LEAST_CHANGE = 5e-5
# Errors whose first digits are less are written with two.
TWO_DIGITS = 3.55
UNDECIDED = "undecided"
# Before a number in a narrow column, or a difference, whose error is not, or not all, known.
ABOUT = "≈"
ABOUT_NUMBER = f"{ABOUT} stands before a number whose error is not known"
ABOUT_CHANGE = f"{ABOUT_NUMBER}, and before a difference of which one of the numbers has none."
# Numbers that depend on the cells where waves are not damped, and the flag of a summary for it.
OF_THE_CELLS = (
    "rate_of_penetration", "rate_of_penetration_fixed_window", "penetration_per_blow",
    "energy_per_advance", "specific_energy",
)  # fmt: skip
BY_CELLS = "rate_of_penetration_depends_on_cells"
NOT_ESTIMATED = "error not estimated"
# What stands below tables of means.
NOT_THE_MODEL = "Whether model and rock are right is not in it."
PLUS_MINUS = (
    "± is the estimated numerical error of this motion, by discretisation and the scatter "
    f"of the blows; without it a mean is known to its four digits. {NOT_THE_MODEL[:-1]}, nor "
    "whether another start leads to another motion."
)
PLUS_MINUS_OF_FALL = (
    "± is the estimated discretisation error; without it a number is known "
    f"to its four digits. {NOT_THE_MODEL}"
)
NOT_RIGID = "How far rigid bodies are from real ones is not in it."
EXACT = (
    "Rigid bodies have no cells: ± is the scatter of the blows, and without it a number is exact "
    f"to the digits shown. {NOT_RIGID}"
)
EXACT_FALL = f"Rigid bodies have no cells: a number is exact to the digits shown. {NOT_RIGID}"
OF_FEW_BLOWS = "The numbers are those of so few blows that neither error nor scatter is known."
UNDAMPED = (
    "Without structural loss waves never decay, and numbers depend on the cells. No error by them "
    "is known: numbers have that of their scatter, or three digits."
)
WITHOUT_ESTIMATE = (
    "The discretisation error was not estimated: numbers have that of their scatter, "
    "or three digits."
)


def about_errors(summary: Mapping[str, Any]) -> str:
    """What stands below a table of a run: what its ± is, and what is not in it."""
    if not summary["errors"]:
        if summary[BY_CELLS]:
            return UNDAMPED
        few = 0 < summary["blows_after_settling"] < LEAST_BLOWS
        return OF_FEW_BLOWS if few else WITHOUT_ESTIMATE
    if summary["solver"] == "rigid":
        return EXACT if summary["blows"] else EXACT_FALL
    return PLUS_MINUS if summary["blows"] else PLUS_MINUS_OF_FALL


def is_undecided(value: float, error: float) -> bool:
    """Whether the error is no smaller than the number, so that not even its sign is known.

    Zero without an error is known, and so is what has no error (NaN) as far as anyone can tell.
    """
    return bool(error > 0.0 and error >= abs(value))


def scaled(factor: float, value: float | None) -> float | None:
    """A number in another unit, None where there is none."""
    return None if value is None else factor * value


def with_error(value: float, error: float, most_digits: int = MOST_DIGITS) -> str:
    """Return a number and its error, both to the second digit of the error."""
    hidden = is_undecided(value, error)
    if error < 10.0**-most_digits and not hidden:
        return in_digits(value, SURE_DIGITS)
    place = 1 - math.floor(math.log10(error))
    place = place if hidden else min(place, most_digits)
    digits = max(place, 0)
    text = f"{round(value, place):.{digits}f} ± {round(error, place):.{digits}f}"
    return f"{UNDECIDED}, {text}" if hidden else text


def depends_on_cells(summary: Mapping[str, Any], key: str) -> bool:
    """Whether a number of a summary, if there is any, is one of the cells and of nothing else."""
    return bool(summary.get(BY_CELLS) and key in OF_THE_CELLS and summary.get(key))


def of_the_cells(value: float, scatter: float | None = None) -> str:
    """Return a number that depends on the cells, with the standard error of its scatter."""
    shown = in_digits(value)
    if scatter is not None and scatter > SMALL_ERROR * abs(value):
        shown = with_short_error(value, scatter)
    return f"{UNDECIDED}, at this resolution {shown}"


def with_short_error(value: float, error: float) -> str:
    """Return a number to the digits that its error is known to: 17.5 ± 0.4, or 19.3 ± 2.5.

    One digit of the error, two where one would put it off by more than a seventh.
    """
    place = math.floor(math.log10(error))
    place -= error < TWO_DIGITS * 10.0**place
    digits = max(-place, 0)
    return f"{round(value, -place):.{digits}f} ± {round(error, -place):.{digits}f}"


def in_few_characters(value: float | None, error: float | None, share: float = SMALL_ERROR) -> str:
    """Return a number for a narrow column: 16.35, 17.5±0.4, "undecided" or a dash.

    Parameters
    ----------
    value, error : float or None
        None is what is not defined.
    share : float
        A smaller error, relative to the number, is not shown.
    """
    if value is None:
        return "-"
    if error is None or error <= share * abs(value):
        return in_digits(value, SHOWN_DIGITS)
    if is_undecided(value, error):
        return UNDECIDED
    return with_short_error(value, error).replace(" ", "")


def hides_change(change: float, error: float) -> bool:
    """Whether a relative change is within its error, in the digits that are shown of both.

    Not where the error shows in none: there is no change, or it is known.
    """
    if error < LEAST_CHANGE:
        return False
    place = _place(error)
    return is_undecided(change, error) or is_undecided(round(change, -place), round(error, -place))


def _place(error: float) -> int:
    """Decimal place of the last digit of an error: one digit, two of what begins with 1."""
    place = math.floor(math.log10(error))
    return place - (error < 2.0 * 10.0**place)


def change_text(change: float | None, error: float | None, rough: bool = False) -> str:
    """Return a relative change in per cent, with its error, for a narrow column.

    It is undecided where the change is within its error; an error that shows in none of the
    decimals is left out.

    Parameters
    ----------
    change, error : float or None
        Relative.
    rough : bool
        Whether the error is only a part of the whole: the change has a sign that says so, at
        most two digits, and no error.
    """
    if change is None:
        return "-"
    error = error or 0.0
    if hides_change(change, error):
        return UNDECIDED
    shows = error >= LEAST_CHANGE
    change, error = 100.0 * change, 100.0 * error
    if rough:
        place = math.floor(math.log10(max(abs(change), error))) - 1
        place = max(place, -1, math.floor(math.log10(error)) if error > 0.0 else place)
        rounded = round(change, -place)
        return f"{ABOUT}{rounded:+.{max(-place, 0)}f}" if rounded else f"{ABOUT}0"
    if shows:
        place = _place(error)
        digits = max(-place, 0)
        return f"{round(change, -place):+.{digits}f}±{round(error, -place):.{digits}f}"
    decimals = 2 if abs(change) < 10.0 else 1 if abs(change) < 100.0 else 0
    shown = f"{change:+.{decimals}f}"
    return "0.00" if float(shown) == 0.0 else shown


def known_error(summary: Mapping[str, Any], key: str) -> float | None:
    """What a number of a summary may be off by grid and scatter, SI units.

    None where that was not estimated.
    """
    error: float | None = summary.get(f"{key}_error")
    return (summary.get("errors") or {}).get(key) if error is None else error


def known_scatter(summary: Mapping[str, Any], key: str) -> float | None:
    """Standard error of a number of a summary by the scatter of the blows alone, SI units."""
    error: float | None = summary.get(f"{key}_standard_error")
    return (summary.get("standard_errors") or {}).get(key) if error is None else error


def shown_error(summary: Mapping[str, Any], key: str) -> float | None:
    """What a number of a summary is known to be off: by grid and scatter, or by scatter alone."""
    error = known_error(summary, key)
    return known_scatter(summary, key) if error is None else error


def mean_text(
    summary: Mapping[str, Any], key: str, factor: float = 1.0, most_digits: int = SMALLEST_UNIT
) -> str:
    """A number of a summary with its error.

    Four digits where the error does not show in them; where that of the grid was not
    estimated, the scatter alone, or three digits, with a ≈ among others that have one.

    Parameters
    ----------
    factor : float
        From SI to the unit that is shown.
    most_digits : int
        Behind the point.
    """
    value, error, scatter = factor * summary[key], known_error(summary, key), None
    if depends_on_cells(summary, key):
        return of_the_cells(value, scaled(factor, known_scatter(summary, key)))
    if error is None:
        scatter = known_scatter(summary, key)
    for known, what in ((error, ""), (scatter, " (scatter alone)")):
        if known is not None and factor * known > SMALL_ERROR * abs(value):
            return with_error(value, factor * known, most_digits) + what
    if key in COUNTS and value == round(value):
        return f"{value:.0f}"
    if error is not None:
        return in_digits(value, SHOWN_DIGITS)
    return (ABOUT if summary.get("errors") else "") + in_digits(value, UNSURE_DIGITS)


def in_digits(value: float, digits: int = UNSURE_DIGITS) -> str:
    """Return a number with so many digits, zeros too: 0.850, 22.0; what is large plain: 595000."""
    rounded = float(f"{value:.{digits}g}")
    if rounded == 0.0:
        return "0"
    large = 10 ** (digits - 1) <= abs(rounded) < LARGEST_PLAIN
    return f"{rounded:.0f}" if large else f"{rounded:#.{digits}g}"


def rate_field(summary: Mapping[str, Any]) -> str:
    """Rate of penetration as a field of a short representation; nothing where there is none."""
    if summary["rate_of_penetration"] is None:
        return ""
    return f"rate='{rate_text(summary)} mm/s', "


def rate_text(summary: Mapping[str, Any], factor: float = 1e3) -> str:
    """Rate of penetration of a summary and, where it is known, how far it may be off.

    Parameters
    ----------
    summary : mapping
        Of a `Result` or a `Settled`.
    factor : float
        From m/s to the unit that is shown; default to mm/s.
    """
    rate, error = summary["rate_of_penetration"], summary["rate_of_penetration_error"]
    if rate is None:
        return "-"
    if depends_on_cells(summary, "rate_of_penetration"):
        return of_the_cells(
            factor * rate, scaled(factor, known_scatter(summary, "rate_of_penetration"))
        )
    if error is not None:
        return with_error(factor * rate, factor * error)
    scatter = known_scatter(summary, "rate_of_penetration")
    # of the two parts of the error one is known, and may be enough to hide the rate
    if scatter is not None and "±" in (text := with_error(factor * rate, factor * scatter)):
        return f"{text} (scatter alone)"
    return f"{in_digits(factor * rate)}, {NOT_ESTIMATED}"
