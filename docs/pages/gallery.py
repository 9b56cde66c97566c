"""Figures of the gallery, of the examples NAME ... or of all: ten minutes of two cores.

Studies are run anew, not taken from an earlier folder.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from docs.blocks import IMAGES, Made
from examples.all import EXAMPLES
from percussion_model.simulation.files import to_json


def made(*names: str) -> Made:
    """Run the examples and keep their figures."""
    known = {example.NAME: example for example in EXAMPLES}
    for name in names or known:
        with TemporaryDirectory() as folder:
            found = known[name].main(Path(folder))
            shutil.copyfile(Path(folder) / f"{name}.png", IMAGES / f"gallery_{name}.png")
        print(name, to_json(found))
    return Made()
