"""Do the tutorials, and keep their figures: `python -m docs.make_tutorials`."""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path

from tests.test_tutorials import FOLDER, do

IMAGES = Path(__file__).with_name("images")


if __name__ == "__main__":
    for page in sorted(FOLDER.glob("*.md")):
        (shown,) = re.findall(r"images/tutorial_(\w+)\.png", page.read_text(encoding="utf-8"))
        with tempfile.TemporaryDirectory() as folder:
            do(page, Path(folder))
            shutil.copy(Path(folder) / f"{shown}.png", IMAGES / f"tutorial_{shown}.png")
        print(f"tutorial_{shown}.png")
