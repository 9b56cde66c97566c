"""docs/system.md: its tables are current, its example runs."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

from typer.main import get_command

from docs import make_system
from percussion_model.interface.cli import app

PAGE = Path(make_system.__file__).with_name("system.md")


def test_the_tables_are_current():
    assert make_system.page() == PAGE.read_text(encoding="utf-8"), "run: " + make_system.__doc__


def test_commands_are_those_of_the_venv_and_exist():
    """As README has them: they run from a clone, as they are printed."""
    text = PAGE.read_text(encoding="utf-8")
    assert not re.findall(r"(?m)(?:^    |`)(?:python|percussion) .*(?:-m|dist|--out)", text)
    modules = re.findall(r"\.venv/bin/python -m ([\w.]+)", text)
    assert len(modules) > 8
    assert [name for name in modules if importlib.util.find_spec(name) is None] == []
    words = re.findall(r"\.venv/bin/percussion ([\w-]+)", text)
    known = get_command(app).commands
    assert set(words) == {"couple", "bench-controller"} <= set(known)


def test_the_example_runs(feed_control, brief, capsys):
    examples = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    archive = "dist/FeedControlRigid.ssp"
    said = []
    for example in examples:
        assert archive in example
        exec(compile(example.replace(archive, str(feed_control)), "system.md", "exec"), {})
        said.append(capsys.readouterr().out.split())
    (depth,), (first, good, second, slow) = said
    assert float(depth) > 5e-3
    assert first == second == "soft"
    assert float(slow) + 1.0 < float(good) < 100.0
