"""Scores of controllers as text: the numbers that are shown, each with its error."""

from __future__ import annotations

from collections.abc import Sequence

from percussion_model.coupling.bench import (
    STANDARD_RUNS,
    STEP,
    WITHIN_A_BLOW,
    Score,
    mean_points,
    mean_points_error,
)
from percussion_model.simulation.uncertain import in_digits, scaled, with_short_error

# Name, head, factor, and what it is.
COLUMNS = (
    ("depth", "depth [mm]", 1e3, "of the bit at the end"),
    ("energy_per_metre", "energy [MJ/m]", 1e-6, "work of supply and rig divided by the depth"),
    ("feed_error", "feed error [%]", 100.0, "mean distance of the feed from what is wanted"),
    ("overshoot", "overshoot [%]", 100.0, "greatest feed above what is wanted"),
    ("swing", "swing [%]", 100.0, "half the range of the feed in the last second"),
    ("time_off_bottom", "off bottom [s]", 1.0, "time in which the shoulder is off the bit"),
    ("dry_blows", "dry blows", 1.0, "blows in a void with the bit or the shoulder off"),
    ("peak_force", "peak force [kN]", 1e-3, "greatest force of the rock on the bit"),
    ("violations", "beyond limits [s]", 1.0, "time beyond the limits of feed and torque"),
)
# What happens in each run.
TEXTS = {trial.name: trial.text for trial in STANDARD_RUNS}
# A smaller error, by the number, does not show in three digits.
SMALL = 5e-4
# Points have one decimal; with an error that could change it they have more.
SMALL_POINTS = 0.005


def number_text(value: float, error: float | None) -> str:
    """Return a number with its error; three digits where that does not show or is not known."""
    if error is None or error <= SMALL * abs(value):
        return in_digits(value)
    return with_short_error(value, error).replace(" ", "")


def cells(score: Score) -> list[str]:
    """Numbers of a run in the order of the columns, in their units."""
    return [
        number_text(factor * score.numbers[name], scaled(factor, score.errors.get(name)))
        for name, _, factor, _ in COLUMNS
    ]


def points_text(points: float, error: float | None) -> str:
    """Return points with their error."""
    if error is None or error < SMALL_POINTS:
        return f"{points:.1f}"
    return with_short_error(points, error).replace(" ", "")


def mean_text(scores: Sequence[Score]) -> str:
    """Return the mean of the points with its error."""
    return points_text(mean_points(scores), mean_points_error(scores))


def about_columns() -> str:
    """What each column is."""
    texts = [f"{head.partition(' [')[0]}, {text}" for _, head, _, text in COLUMNS]
    points = "points, 100 less what the feed error and time beyond the limits take"
    return f"Columns: {'; '.join([points, *texts])}."


def about_runs(scores: Sequence[Score]) -> str:
    """What happens in the runs."""
    texts = [f"{one.trial}, {TEXTS.get(one.trial, 'one of your own')}" for one in scores]
    return f"Runs: {'; '.join(texts)}."


def about_errors(scores: Sequence[Score]) -> str:
    """What the ± of the scores is, or that no error was estimated."""
    step = f"the communication step of {1e3 * STEP:g} ms"
    if all(score.points_error is None for score in scores):
        return f"The error by {step} was not estimated: how many digits are right is not known."
    return (
        f"± is the error by {step}: twice what half the step changes, and at least "
        f"{100 * WITHIN_A_BLOW:g} % for what goes on within a blow, and one blow's share of depth, "
        "energy per depth, time off bottom and dry blows where there are any; without it a number "
        "is known to its digits. The error by the cells of the hammer is not in it, nor whether "
        "model and rock are right."
    )
