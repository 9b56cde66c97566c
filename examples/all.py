"""All examples, one after the other: `python -m examples.all [--out DIR] [--quick]`."""

from __future__ import annotations

import sys
from pathlib import Path

from examples import bifurcation, calibration, chambers, drill_design, rate_map, sensitivity
from examples.shared import arguments, write_example
from percussion_model.interface.commands.common import end_script

EXAMPLES = (bifurcation, rate_map, sensitivity, calibration, drill_design, chambers)


def main(out: Path, quick: bool = False, force: bool = False) -> None:
    """Run every example; each gets a folder with its figure and what it found."""
    for example in EXAMPLES:
        print(example.NAME, file=sys.stderr)
        write_example(example.main, example.NAME, Path(out) / example.NAME, quick, force)


if __name__ == "__main__":
    words = arguments(main, "all", Path("out/examples"))
    end_script("examples.all", lambda: main(words.out, words.quick, words.force))
