"""Figures of the tutorials, which are done for them."""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path

from docs.blocks import IMAGES, Made
from tests.test_tutorials import FOLDER, do


def made() -> Made:
    """Do the tutorials, and keep their figures."""
    for page in sorted(FOLDER.glob("*.md")):
        (shown,) = re.findall(r"images/tutorial_(\w+)\.png", page.read_text(encoding="utf-8"))
        with tempfile.TemporaryDirectory() as folder:
            do(page, Path(folder))
            shutil.copy(Path(folder) / f"{shown}.png", IMAGES / f"tutorial_{shown}.png")
    return Made()
