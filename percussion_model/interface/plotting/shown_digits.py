"""Digits that a page shows of its numbers: those that are known, as `in_digits` has them."""

from __future__ import annotations

from collections.abc import Mapping

from bokeh.models import CustomJSHover, HTMLTemplateFormatter, Model

from percussion_model.simulation.uncertain import LARGEST_PLAIN, UNSURE_DIGITS

# Digits of an error; of what a user gave; and the sign for counts, which are whole or a mean.
OF_ERRORS, GIVEN, COUNT = 2, 5, 0

# `in_digits` of `simulation/uncertain.py` for a browser; what was given has no zeros at its end.
_SHOWN = f"""
function shown(value, digits) {{
  if (!Number.isFinite(value)) return "–";
  if (digits == {COUNT} && Number.isInteger(value)) return String(value);
  const known = digits == {COUNT} ? {UNSURE_DIGITS} : digits;
  const rounded = Number(value.toPrecision(known)), size = Math.abs(rounded);
  if (rounded == 0 || digits == {GIVEN}) return String(rounded);
  return 10 ** (known - 1) <= size && size < {LARGEST_PLAIN} ? rounded.toFixed(0)
    : rounded.toPrecision(known);
}}
"""


def in_hover(digits: int) -> CustomJSHover:
    """Show a number beside the pointer with so many digits."""
    return CustomJSHover(args={"digits": digits}, code=f"{_SHOWN} return shown(value, digits);")


def of_choice(choice: Model, digits: Mapping[str, int], name: str | None = None) -> CustomJSHover:
    """Show a number beside the pointer with the digits of the quantity that is chosen."""
    return CustomJSHover(
        args={"choice": choice, "digits": dict(digits)},
        code=f"{_SHOWN} return shown(value, Object.fromEntries(Object.entries(digits))"
        "[choice.value]);",
        name=name,
    )


def in_column(digits: int) -> HTMLTemplateFormatter:
    """Show the numbers of a column of a table with so many digits; they sort as they are."""
    return HTMLTemplateFormatter(template=f"<% {_SHOWN} %><%= shown(value, {digits}) %>")
