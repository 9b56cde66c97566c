"""A hash of sources, by which stored numbers know the code that made them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

PACKAGE = Path(__file__).parents[1]
# Kernels and solvers.
SOLVING = ("components/*.py", "engine/*.py", "physics/**/*.py", "solvers/**/*.py")


def source_files(patterns: Iterable[str] = SOLVING) -> list[Path]:
    """Files of the package that match one of the patterns, in the order of their paths."""
    return sorted({path for pattern in patterns for path in PACKAGE.glob(pattern)})


def sources_digest(patterns: Iterable[str] = SOLVING) -> str:
    """Hash of such files, their names included."""
    digest = hashlib.sha256()
    for path in source_files(patterns):
        name = path.relative_to(PACKAGE).as_posix()
        digest.update(f"{name}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()
