"""Notebooks run cell by cell, without Jupyter: what they print, and what they show."""

from __future__ import annotations

import ast
import contextlib
import io
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "notebooks"
TOOLS = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"


def notebooks() -> list[Path]:
    """All of them."""
    return sorted(FOLDER.glob("*.ipynb"))


def code_cells(path: Path) -> list[dict[str, Any]]:
    """Cells of code, each a table with `source` as one text and `outputs`."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    code = [one for one in cells if one["cell_type"] == "code"]
    return [one | {"source": "".join(one["source"])} for one in code]


def run(path: Path) -> Iterator[tuple[str, Any]]:
    """Run each cell; yield what it printed, and the value of its last line."""
    space: dict[str, Any] = {"__name__": "__main__"}
    for cell in code_cells(path):
        if cell["source"].startswith("!"):
            words = shlex.split(cell["source"][1:])
            done = subprocess.run(words, capture_output=True, env={**os.environ, "PATH": TOOLS})
            assert done.returncode == 0, done.stderr.decode()
            yield "", None
            continue
        tree = ast.parse(cell["source"])
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            exec(compile(tree, path.name, "exec"), space)
            value = None
            if isinstance(last, ast.Expr):
                value = eval(compile(ast.Expression(last.value), path.name, "eval"), space)
        yield printed.getvalue(), value
