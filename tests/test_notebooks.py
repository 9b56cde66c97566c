"""Notebooks of the site: each cell runs, prints what is kept, and fits a screen."""

from __future__ import annotations

import json
import re

import matplotlib
import pytest

from docs.site.notebooks import to_markdown
from tests.notebook_cells import code_cells, notebooks, run

SCREEN, WIDE = 30, 80  # lines and characters
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
# Another machine rounds otherwise, and a fit ends elsewhere within its noise.
CLOSE = 2e-3


def kept(cell):
    """What a cell printed when it was kept, and whether it showed a value or a picture."""
    texts = ["".join(one["text"]) for one in cell["outputs"] if one["output_type"] == "stream"]
    return "".join(texts), [one for one in cell["outputs"] if one["output_type"] != "stream"]


def told(text):
    """A text as its words, and its numbers."""
    return NUMBER.sub("#", text), [float(one) for one in NUMBER.findall(text)]


@pytest.mark.slow
@pytest.mark.parametrize("path", notebooks(), ids=lambda path: path.stem)
def test_a_notebook_runs_and_prints_what_is_kept(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("matplotlib.pyplot.show", lambda: None)
    with matplotlib.rc_context({"figure.max_open_warning": 0}):
        found = list(run(path))
    for cell, (printed, value) in zip(code_cells(path), found, strict=True):
        before, shown = kept(cell)
        words, numbers = told(printed)
        assert (words, numbers) == (told(before)[0], pytest.approx(told(before)[1], rel=CLOSE))
        (kinds,) = [one["data"].keys() for one in shown] or [{}]
        if hasattr(value, "_repr_png_") or "plt.show()" in cell["source"]:
            assert "image/png" in kinds
        elif value is not None:
            assert "text/html" in kinds


@pytest.mark.parametrize("path", notebooks(), ids=lambda path: path.stem)
def test_no_cell_is_longer_than_a_screen(path):
    for cell in code_cells(path):
        lines = cell["source"].splitlines()
        assert len(lines) <= SCREEN
        assert max(map(len, lines)) <= WIDE
    page = to_markdown(json.loads(path.read_text(encoding="utf-8")))
    assert page.startswith("# ")
    assert "Traceback" not in page
