"""Notebooks, run as Jupyter does, with what they show; by their names, all if none is named."""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

from docs.blocks import DOCS, Made

FOLDER = DOCS / "notebooks"
TIMEOUT = 600  # of a cell, in which a clone may compile [s]
# Of each notebook, so that a run changes nothing but what a cell shows.
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}


def made(*names: str) -> Made:
    """Run them one by one."""
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"
    texts = {}
    for path in sorted(FOLDER.glob("*.ipynb")):
        if not names or path.stem in names:
            began = time.monotonic()
            texts[f"notebooks/{path.name}"] = executed(path)
            print(f"{path.name}: {time.monotonic() - began:.1f} s", flush=True)
    return Made(texts=texts)


def executed(path: Path) -> str:
    """Text of a notebook that was run in an empty folder."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        where = {"metadata": {"path": folder}}
        NotebookClient(notebook, timeout=TIMEOUT, resources=where).execute()
    notebook.metadata = nbformat.from_dict(METADATA)
    for cell in notebook.cells:
        cell.metadata = {}
        for output in cell.get("outputs", ()):
            if output.output_type == "stream" and output.name == "stderr":
                raise SystemExit(f"{path.name}: a cell warns: {output.text}")
        if cell["source"].startswith("!"):  # paths of this machine
            cell.outputs = []
    return f"{nbformat.writes(notebook)}\n"
