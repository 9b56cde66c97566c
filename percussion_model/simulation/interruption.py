"""Ctrl-C, also where compiled code makes another error of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


def is_interruption(error: BaseException) -> bool:
    """Whether an error is Ctrl-C, or comes of it.

    Ctrl-C within compiled code that takes no heed of it, as where numba loads kernels, ends in
    a `SystemError` with the `KeyboardInterrupt` behind it.
    """
    if not isinstance(error, SystemError):
        return isinstance(error, KeyboardInterrupt)
    looked_at: set[int] = set()
    behind: list[BaseException | None] = [error]
    while behind:
        one = behind.pop()
        if isinstance(one, KeyboardInterrupt):
            return True
        if one is not None and id(one) not in looked_at:
            looked_at.add(id(one))
            behind += [one.__cause__, one.__context__]
    return False


@contextmanager
def interruptible() -> Iterator[None]:
    """Have all that comes of Ctrl-C be a `KeyboardInterrupt`."""
    try:
        yield
    except SystemError as error:
        if not is_interruption(error):
            raise
        raise KeyboardInterrupt from error
