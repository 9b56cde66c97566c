"""The tutorials, done as a reader does them: files as they are shown, commands in their order."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "docs" / "tutorials"
BLOCK = re.compile(r"```(\w+)\n(.*?)```", re.DOTALL)
# Compiles for minutes where no library was kept; tests/native covers it.
LONG = ("percussion native",)


def blocks(page):
    return BLOCK.findall(page.read_text(encoding="utf-8"))


def do(page, folder):
    """Write each file that a page shows into a folder, and run each command there."""
    tools = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    programs = {**os.environ, "PATH": tools, "MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)}
    for language, text in blocks(page):
        if language == "python":
            name = re.match(r"# (\w+\.py)\n", text)[1]
            (folder / name).write_text(text, encoding="utf-8")
            continue
        if language == "toml":  # of files that a reader may need
            continue
        assert language == "sh", language
        for line in text.splitlines():
            if line.startswith(("pip install", *LONG)):
                continue
            done = subprocess.run(
                shlex.split(line), cwd=folder, env=programs, capture_output=True, text=True
            )
            assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(page.stem for page in FOLDER.glob("*.md")))
def test_a_tutorial_ends_with_its_figure(name, tmp_path):
    page = FOLDER / f"{name}.md"
    do(page, tmp_path)
    (shown,) = re.findall(r"images/tutorial_(\w+)\.png", page.read_text(encoding="utf-8"))
    assert (tmp_path / f"{shown}.png").stat().st_size > 5000
