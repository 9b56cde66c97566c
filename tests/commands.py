"""The command `percussion` in the process of a test."""

from __future__ import annotations

from fmu_src import command_line  # noqa: F401  # adds the commands that make FMUs
from percussion_model.interface.cli import _guarded, app


def percussion(*words: object) -> int:
    """Run the command; return its exit code."""
    return _guarded(lambda: app([str(word) for word in words], standalone_mode=False))
