"""What a wheel for one platform holds beside the sources: solvers and FMUs' library, compiled."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Names the folder that `fmu_src.wheels` has filled; without it a wheel is for all platforms.
VARIABLE = "PERCUSSION_LIBRARIES"
TAG = "tag"


class LibraryHook(BuildHookInterface):
    """Adds the libraries, and the name of their platform."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """As hatchling calls it before a wheel is built."""
        folder = os.environ.get(VARIABLE)
        if not folder or version == "editable":
            return
        root = Path(folder)
        build_data["pure_python"] = False
        build_data["tag"] = (root / TAG).read_text(encoding="utf-8").strip()
        for file in sorted(root.rglob("*.*")):
            if file.is_file():
                build_data["force_include"][str(file)] = file.relative_to(root).as_posix()
