"""All examples, one after the other: `python -m examples.all [--out DIR] [--quick]`."""

from __future__ import annotations

import sys
from pathlib import Path

from examples import bifurcation, calibration, drill_design, rate_map, sensitivity
from examples.shared import arguments
from percussion_model.simulation.files import staged_text, to_json

EXAMPLES = (bifurcation, rate_map, sensitivity, calibration, drill_design)


def main(out: Path, quick: bool = False) -> None:
    """Run every example; each gets a folder with its figure and what it found."""
    for example in EXAMPLES:
        print(example.NAME, file=sys.stderr)
        folder = Path(out) / example.NAME
        staged_text(folder / "found.json", to_json(example.main(folder, quick)) + "\n")


if __name__ == "__main__":
    words = arguments(main, "all", Path("out/examples"))
    main(words.out, words.quick)
