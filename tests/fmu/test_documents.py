"""The pages on the FMU tell what it has, and their examples run."""

from __future__ import annotations

import re
from pathlib import Path

from docs.pages import fmu_interface
from fmu_src.description import About
from fmu_src.hammer.variables import hammer_variables
from fmu_src.page import write_page
from percussion_model import Scene

ROOT = Path(__file__).parents[2]
HOW_TO = ROOT / "docs" / "fmu.md"


def test_the_tables_are_those_of_the_model_description():
    ((path, text),) = fmu_interface.made().files().items()
    assert text == path.read_text(encoding="utf-8"), "run: python -m docs.make fmu_interface"


def test_the_examples_run(hammer, capsys):
    examples = re.findall(r"```python\n(.*?)```", HOW_TO.read_text(encoding="utf-8"), re.DOTALL)
    assert len(examples) == 2
    for example in examples:
        assert '"dist/PercussiveHammer.fmu"' in example
        exec(
            compile(example.replace("dist/PercussiveHammer.fmu", str(hammer)), HOW_TO.name, "exec"),
            {},
        )
    rates = [float(line.split()[0]) for line in capsys.readouterr().out.splitlines()]
    assert len(rates) == 2
    assert all(0.01 < rate < 0.03 for rate in rates)


def test_the_page_tells_what_is_known_of_errors():
    variables, about = hammer_variables(Scene()), About("A", "a hammer", 1.0, 1e-3)
    told = {}
    for name in ("wave", "fem", "rigid"):
        page = write_page(about, variables, Scene().computed_by(name))
        told[name] = page[page.index("How sure the outputs are") : page.index("<h2>Scene")]
    assert "cells" in told["wave"]
    assert "elements" in told["fem"]
    assert "no discretisation error" in told["rigid"]
    for text in told.values():
        assert "of one blow" in text
        assert "hole_depth" in text
    by_name = {one.name: one.description for one in variables}
    assert "no mean" in by_name["rate_of_penetration"]
