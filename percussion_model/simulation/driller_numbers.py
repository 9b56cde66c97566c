"""Numbers of a run in the units of drillers, each defined here once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from percussion_model.scene.html_table import html_table
from percussion_model.simulation.columns import SUMMARY_COLUMNS
from percussion_model.simulation.uncertain import known_error, mean_text, rate_text, scaled


class DrillerNumber(NamedTuple):
    """One number of a summary.

    Attributes
    ----------
    name : str
    factor : float
        From SI, which a summary is in, to `unit`.
    unit : str
    behind : str
        Its name in a table behind the same number in SI.
    """

    name: str
    factor: float
    unit: str
    behind: str


# By the key of a summary; what each is stands in `SUMMARY_COLUMNS`.
DRILLER_NUMBERS = {
    "rate_of_penetration": DrillerNumber("Rate of penetration", 3600.0, "m/h", "Rate in an hour"),
    "blow_frequency": DrillerNumber("Blow frequency", 60.0, "blows/min", "Blows per minute"),
    "percussive_power": DrillerNumber("Percussive power", 1e-3, "kW", ""),
    "specific_energy": DrillerNumber("Specific energy", 1e-6, "MJ/m^3", ""),
}
_DEFINITIONS = {column.name: column.meaning for column in SUMMARY_COLUMNS}


def driller_numbers(summary: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the numbers of a summary in the units of drillers, of those that are known.

    Parameters
    ----------
    summary : mapping
        Of a `Result` or a `Settled`, SI units.

    Returns
    -------
    dict of dict
        By key of the summary: `value`, `error` by grid and scatter, None where that is not
        known, `unit` and `definition`.
    """
    return {
        key: {
            "value": one.factor * summary[key],
            "error": scaled(one.factor, known_error(summary, key)),
            "unit": one.unit,
            "definition": _DEFINITIONS[key],
        }
        for key, one in DRILLER_NUMBERS.items()
        if summary.get(key) is not None
    }


def driller_text(summary: Mapping[str, Any], key: str) -> str:
    """A number of a summary in the unit of drillers, with its error, as text without the unit."""
    factor = DRILLER_NUMBERS[key].factor
    if key == "rate_of_penetration":
        return rate_text(summary, factor)
    return mean_text(summary, key, factor)


def result_html(title: str, summary: Mapping[str, Any]) -> str:
    """The numbers of drillers as a table for notebooks, with a run's length and its warnings."""
    about = (
        f"{summary['blows_after_settling']} blows counted in {summary['duration']:g} s, "
        f"solver {summary['solver']}"
    )
    rows = [
        (one.name, driller_text(summary, key), one.unit)
        for key, one in DRILLER_NUMBERS.items()
        if summary.get(key) is not None
    ]
    rows += [("Warning", text, "") for text in summary["warnings"]]
    return html_table(title or "Result", about, ("number", "value", "unit"), rows)
