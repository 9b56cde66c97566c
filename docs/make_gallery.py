"""Draw the figures of docs/gallery.md again: `python -m docs.make_gallery [NAME ...]`.

All take some ten minutes on two cores. Studies are run anew, not taken from an earlier folder.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from examples.all import EXAMPLES
from percussion_model.simulation.files import to_json

IMAGES = Path(__file__).resolve().parent / "images"


def main(names: list[str]) -> None:
    """Run the examples of these names, all if there are none, and keep their figures."""
    known = {example.NAME: example for example in EXAMPLES}
    unknown = sorted(set(names) - set(known))
    if unknown:
        raise SystemExit(f"unknown examples {', '.join(unknown)}: there are {', '.join(known)}")
    for name in names or known:
        with TemporaryDirectory() as folder:
            found = known[name].main(Path(folder))
            shutil.copyfile(Path(folder) / f"{name}.png", IMAGES / f"gallery_{name}.png")
        print(name, to_json(found))


if __name__ == "__main__":
    main(sys.argv[1:])
