"""Streams of the process, whatever their encoding: text that each of them bears."""

from __future__ import annotations

import codecs
import contextlib
import errno
import os
import sys
import unicodedata
from collections.abc import Callable
from typing import Any, NoReturn

UNWRITTEN = 1  # exit code where stdout did not take all
# Numbers of the error of a pipe that nobody reads; the second one is that of Windows.
GONE = (errno.EPIPE, errno.EINVAL)
STAND_IN = "percussion_stand_in"  # what bears it as an error handler of codecs
# In place of characters that an encoding lacks; of others their letters without marks.
_STAND_INS = {
    "±": "+-", "×": "x", "·": "*", "−": "-", "–": "-", "—": "-", "…": "...", "≈": "~",
    "≥": ">=", "≤": "<=", "µ": "u", "μ": "u", "σ": "sigma", "²": "^2", "³": "^3",
    "°": "deg", "→": "->", "’": "'", "‘": "'", "“": '"', "”": '"',
}  # fmt: skip


def stand_in(text: str) -> str:
    """Text in ASCII: names of signs, letters without marks, `?` for what has neither."""
    return "".join(map(_character, text))


def _character(one: str) -> str:
    if one.isascii():
        return one
    found = _STAND_INS.get(one)
    if found is None:
        found = unicodedata.normalize("NFKD", one).encode("ascii", "ignore").decode()
    return found or "?"


def _replace(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return stand_in(error.object[error.start : error.end]), error.end


def bear_all_text() -> None:
    """Have stdout and stderr take what their encoding lacks; those that are closed take all."""
    codecs.register_error(STAND_IN, _replace)
    for name in ("stdout", "stderr"):
        stream: Any = getattr(sys, name)
        if stream is None:  # closed by the shell, as by 2>&-: what is printed would go elsewhere
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=STAND_IN)


def end_process(work: Callable[[], int], program: str = "percussion") -> NoReturn:
    """Do the work of a process, and end it with the exit code that the work returns.

    What stdout cannot take, as on a full disk, is one line on stderr; nothing is said of a
    reader that has gone, as `head` does.
    """
    bear_all_text()
    code, failed = UNWRITTEN, None
    try:
        code = work()
    except OSError as error:
        failed = error
    refused = _refused_by(sys.stdout, "" if failed is None else "\n")
    if failed is not None and refused is None:
        raise failed
    if refused is not None:
        code = code or UNWRITTEN
        if refused.errno not in GONE:
            with contextlib.suppress(OSError):
                words = f"{program}: stdout: cannot be written: {refused.strerror}"
                print(words, file=sys.stderr)
    _refused_by(sys.stderr)
    sys.exit(code)


def _refused_by(stream: Any, probe: str = "") -> OSError | None:
    """Error of writing what a stream still holds; that is dropped then, and all that follows.

    Python would try it once more at its end, with words and an exit code of its own. What
    has failed before is held no longer: a `probe` tells whether it was this stream.
    """
    try:
        stream.write(probe)
        stream.flush()
    except OSError as error:
        with contextlib.suppress(OSError, ValueError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)
        return error
    except ValueError:  # has been closed
        pass
    return None
