"""docs/fmu.md tells what the FMU has, and its example runs."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "fmu.md"


def test_the_tables_are_those_of_the_model_description():
    path = ROOT / "docs" / "make_fmu_interface.py"
    spec = importlib.util.spec_from_file_location("make_fmu_interface", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.page() == PAGE.read_text(encoding="utf-8"), "run: " + module.__doc__


def test_the_examples_run(hammer, capsys):
    examples = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(examples) == 2
    for example in examples:
        assert '"dist/PercussiveHammer.fmu"' in example
        exec(
            compile(example.replace("dist/PercussiveHammer.fmu", str(hammer)), "fmu.md", "exec"), {}
        )
    rates = [float(line.split()[0]) for line in capsys.readouterr().out.splitlines()]
    assert len(rates) == 2
    assert all(0.01 < rate < 0.03 for rate in rates)
