"""All hard cases by every solver: half an hour of one core, or FILE of `percussion stability`."""

from __future__ import annotations

import json
from pathlib import Path

from docs.blocks import Made
from percussion_model.interface.plotting.stability_dots import draw_stability
from percussion_model.interface.progress import count_bar
from percussion_model.verification.hard_cases import Collection, run_collection
from percussion_model.verification.hard_cases.stability_page import page, verdict


def collection(file: str | None) -> Collection:
    """All hard cases, run now or taken from a file."""
    if file is None:
        with count_bar("runs of hard cases") as progress:
            return run_collection(progress=progress)
    found = json.loads(Path(file).read_text(encoding="utf-8"))
    return Collection(found["rows"], found["share"], found["left_out"])


def made(file: str | None = None) -> Made:
    """Both pages and the figure."""
    found = collection(file)
    text = page(found, "../images/stability.png", "the [guide to hard cases](stability.md)")
    return Made(
        ("data/stability.md",), {"verdict": verdict(found).rstrip()}, {"data/hard_cases.md": text},
        figures=lambda: [("stability", draw_stability(found))],
    )  # fmt: skip
