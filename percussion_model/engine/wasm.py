"""The engine for a page in a browser: `python -m percussion_model.engine.wasm FOLDER`.

Writes `engine.wasm`, all solvers but `fem`; `engine.js`, which calls it; and `table.json`, what
there is to know of scenes and of what is computed (`web_table`). A page needs nothing else.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from pathlib import Path

from percussion_model.engine import compiler, library
from percussion_model.engine.platforms import WASM
from percussion_model.engine.web_table import SOLVERS, table

SCRIPT = compiler.HERE / "engine.js"
# Besides the solvers.
OTHERS = ("scene_checks", "judgement")
MODULES = tuple(map(library.module_of, (*OTHERS, *SOLVERS)))
# A library that calls nothing outside, with all that is said to be exported.
FLAGS = ("-DENGINE_LIBRARY", "-mexec-model=reactor", "-Wl,--export-dynamic", "-Wl,--strip-all")
SOURCES = (compiler.HERE / "memory.c", Path(__file__), compiler.HERE / "objects.py")


def engine_file(report: compiler.Report | None = None) -> Path:
    """Code for browsers, which is made unless it is kept.

    Raises
    ------
    NoCompilerError
        If nothing here compiles, or links.
    """
    stamp = compiler.hash_of(SOURCES, library.stamp())
    file = compiler.kept_folder() / "libraries" / f"engine-{stamp}.wasm"
    if file.is_file():
        return file
    command = compiler.compiler_for(WASM)
    parts = compiler.objects(MODULES, [WASM], report)[WASM]
    file.parent.mkdir(parents=True, exist_ok=True)
    compiler.link(WASM, command, [compiler.HERE / "memory.c"], parts, file, FLAGS)
    compiler.remove_old(file.parent, "engine-*.wasm")
    return file


def write(folder: Path, report: compiler.Report | None = None) -> list[Path]:
    """Write the three files into a folder; their paths."""
    code = engine_file(report)
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".draft-", dir=folder) as work:
        shutil.copyfile(code, Path(work) / "engine.wasm")
        shutil.copyfile(SCRIPT, Path(work) / SCRIPT.name)
        text = json.dumps(table(), allow_nan=False, ensure_ascii=False, separators=(",", ":"))
        (Path(work) / "table.json").write_text(text, encoding="utf-8")
        return [file.replace(folder / file.name) for file in sorted(Path(work).iterdir())]


if __name__ == "__main__":
    for path in write(Path(sys.argv[1])):
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")
