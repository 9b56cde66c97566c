"""Words of messages: lines that fit a terminal, and what is wrong with the words of a command."""

from __future__ import annotations

import shutil
import textwrap
from typing import Any

from percussion_model.scene.retired import remark

# What pydantic, which reads the options for typer, calls a fault; and what is allowed then.
_ALLOWED = {
    "int_parsing": "must be a whole number",
    "int_from_float": "must be a whole number",
    "float_parsing": "must be a number",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than_equal": "must be at most {le:g}",
}
_CHOICE = " is not one of "


def wrapped(text: str) -> str:
    """Lines of a text that fit the terminal, or 80 columns on a pipe, the first one standing out.

    What has no spaces stays whole: a path or the name of a signal.
    """
    width = shutil.get_terminal_size().columns
    return textwrap.fill(
        text, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )


def usage_text(error: Any) -> str:
    """What is wrong with the words of a command, in one line: option, value, what is allowed.

    Parameters
    ----------
    error : click.UsageError
        As typer raises it, whose class it hides.
    """
    told = " ".join(error.format_message().split()).rstrip(".")
    told = told[:1].lower() + told[1:]
    faults = getattr(error.__cause__, "errors", None)
    if faults is not None:
        fault = faults()[0]
        option = max([*error.param.opts, error.param.name], key=len)
        told = f"{option} {fault['input']!r}: {_allowed(fault)}"
    retired = (word for word in told.split() if word.strip("'\".,;:-") == "blow-map")
    told += remark("", "blow-map") if any(retired) else ""
    if error.ctx is not None:
        told += f"{'' if told.endswith('?') else ';'} see {error.ctx.command_path} --help"
    return told


def _allowed(fault: Any) -> str:
    """What is allowed where a value was not."""
    _, choice, choices = fault["msg"].rstrip(".").partition(_CHOICE)
    if choice:
        return f"must be one of {choices}"
    words = _ALLOWED.get(fault["type"])
    if words is not None and "," in str(fault["input"]):
        words += ", with a decimal point"
    return fault["msg"] if words is None else words.format(**fault.get("ctx", {}))
