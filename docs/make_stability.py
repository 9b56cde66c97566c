"""Write docs/data/hard_cases.md and what docs/stability.md takes from it.

`python -m docs.make_stability` runs all hard cases by every solver, which takes half an hour of one
core; with a file name it takes them from an earlier `percussion stability --json FILE`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from docs.blocks import DOCS, publish
from percussion_model.interface.plotting.stability_dots import draw_stability
from percussion_model.interface.progress import count_bar
from percussion_model.verification.hard_cases import Collection, run_collection
from percussion_model.verification.hard_cases.stability_page import page, verdict

GUIDE, DATA = DOCS / "stability.md", DOCS / "data" / "hard_cases.md"


def collection(file: str | None) -> Collection:
    """All hard cases, run now or taken from a file."""
    if file is None:
        with count_bar("runs of hard cases") as progress:
            return run_collection(progress=progress)
    found = json.loads(Path(file).read_text(encoding="utf-8"))
    return Collection(found["rows"], found["share"], found["left_out"])


def main(file: str | None = None) -> None:
    """Write both pages and draw the figure."""
    found = collection(file)
    text = page(found, "../images/stability.png", "the [guide to hard cases](../stability.md)")
    DATA.write_text(text, encoding="utf-8")
    blocks = {"verdict": verdict(found).rstrip()}
    publish(blocks, GUIDE, figures=lambda: [("stability", draw_stability(found))])


if __name__ == "__main__":
    main(*sys.argv[1:2])
