"""docs/system.md: its tables are current, its example runs."""

from __future__ import annotations

import re
from pathlib import Path

from docs import make_system

PAGE = Path(make_system.__file__).with_name("system.md")


def test_the_tables_are_current():
    assert make_system.page() == PAGE.read_text(encoding="utf-8"), "run: " + make_system.__doc__


def test_the_example_runs(feed_control, capsys):
    (example,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    archive = "dist/FeedControlRigid.ssp"
    assert archive in example
    exec(compile(example.replace(archive, str(feed_control)), "system.md", "exec"), {})
    depth, *error = capsys.readouterr().out.split()
    assert float(depth) > 5e-3
    assert not error
