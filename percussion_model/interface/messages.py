"""Words of messages: lines that fit a terminal, and what is wrong with the words of a command."""

from __future__ import annotations

import shutil
import textwrap
from typing import Any

from percussion_model.scene.retired import remark

# What typer says that a value is not, and what is allowed then.
_ALLOWED = {"a valid int": "must be a whole number", "a valid float": "must be a number"}
_CHOICE = "one of "


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
    value, _, fault = getattr(error, "message", "").rstrip(".").partition(" is not ")
    value = value.strip("'").removesuffix(".0")
    if allowed := _allowed(value, fault, error):
        option = max([*error.param.opts, error.param.name], key=len)
        told = f"{option} {value!r}: {allowed}"
    retired = (word for word in told.split() if word.strip("'\".,;:-") == "blow-map")
    told += remark("", "blow-map") if any(retired) else ""
    if error.ctx is not None:
        told += f"{'' if told.endswith('?') else ';'} see {error.ctx.command_path} --help"
    return told


def _allowed(value: str, fault: str, error: Any) -> str:
    """What is allowed where a value was not; nothing of other faults."""
    if fault.startswith("in the range"):
        low, high = error.param.type.min, error.param.type.max
        is_low = low is not None and float(value) < low
        return f"must be at least {low:g}" if is_low else f"must be at most {high:g}"
    if fault.startswith(_CHOICE):
        return f"must be {fault}"
    words = next((words for start, words in _ALLOWED.items() if fault.startswith(start)), "")
    return words + (", with a decimal point" if words and "," in value else "")
