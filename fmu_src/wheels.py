"""Wheels for platforms, with the solvers and the libraries of FMUs inside.

`python -m fmu_src.wheels [PLATFORM ...] [-o FOLDER]` makes them, of all platforms if none is named.
LLVM makes the code and zig links it: no other machine is needed.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Sequence
from pathlib import Path

from fmu_src.archive import ROOT
from fmu_src.native.library import MODULES, OF, link_fmus, platform_names
from fmu_src.native.library import brought_file as fmu_file
from percussion_model.engine import library
from percussion_model.engine.compiler import NoCompilerError, objects
from percussion_model.engine.entries import OTHERS, SOLVERS
from percussion_model.engine.platforms import PLATFORMS
from percussion_model.interface.explore.build import BROUGHT, page_file
from percussion_model.interface.progress import lines
from percussion_model.scene.scene import SceneError

# As hatch_build.py reads them.
VARIABLE, TAG = "PERCUSSION_LIBRARIES", "tag"
# By platform, as installers of Python packages call it: with glibc 2.17, or macOS 11, at least.
TAGS = {
    "x86_64-linux": "py3-none-manylinux2014_x86_64",
    "aarch64-linux": "py3-none-manylinux2014_aarch64",
    "x86_64-windows": "py3-none-win_amd64",
    "x86_64-darwin": "py3-none-macosx_11_0_x86_64",
    "aarch64-darwin": "py3-none-macosx_11_0_arm64",
}


def zig(name: str) -> list[str]:
    """Command that links for a platform, and asks for no newer system than its wheel says.

    A fifth of a library is names that nothing looks for: they are left out.
    """
    return [sys.executable, "-m", "ziglang", "cc", "-s", "-target", PLATFORMS[name].zig]


def fill(folder: Path, name: str, command: Sequence[str], page: Path | None = None) -> None:
    """Put into a folder what a wheel for a platform holds beside the sources.

    Parameters
    ----------
    name : str
        Of `PLATFORMS`.
    command : sequence of str
        Of the C compiler that links.
    page : Path, optional
        That which runs the hammer in a browser.
    """
    if page is not None:
        brought = folder / BROUGHT.relative_to(ROOT)
        brought.parent.mkdir(parents=True)
        shutil.copyfile(page, brought)
    (folder / TAG).write_text(TAGS[name], encoding="utf-8")
    for solver in (*SOLVERS, *OTHERS):
        file = folder / library.brought_file(solver, name).relative_to(ROOT)
        file.parent.mkdir(parents=True, exist_ok=True)
        library.link_solver(solver, name, command, file)
    for which in OF:
        packed = folder / fmu_file(name, which).relative_to(ROOT)
        packed.parent.mkdir(parents=True, exist_ok=True)
        link_fmus(name, command, packed.with_suffix(""), which)
        packed.write_bytes(zlib.compress(packed.with_suffix("").read_bytes(), 9))
        packed.with_suffix("").unlink()


def make_wheel(name: str, command: Sequence[str], out: Path, page: Path | None = None) -> Path:
    """Make the wheel for a platform in a folder.

    Raises
    ------
    SceneError
        If it cannot be linked, or built.
    """
    with tempfile.TemporaryDirectory(prefix="percussion-wheel-") as work:
        libraries, made = Path(work) / "libraries", Path(work) / "wheel"
        libraries.mkdir()
        fill(libraries, name, command, page)
        build = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation"]
        done = subprocess.run(
            [*build, "-w", str(made), str(ROOT)], text=True, capture_output=True,
            env={**os.environ, VARIABLE: str(libraries)},
        )  # fmt: skip
        if done.returncode != 0:
            raise SceneError(f"no wheel could be built:\n{done.stderr.strip()[-2000:]}")
        (wheel,) = made.glob("*.whl")
        out.mkdir(parents=True, exist_ok=True)
        return Path(wheel.replace(out / wheel.name))


def main(words: Sequence[str] | None = None) -> int:
    """Make the wheels that the command line names."""
    parser = argparse.ArgumentParser(prog="build.py wheels", description="Wheels for platforms.")
    parser.add_argument("platforms", nargs="*", metavar="PLATFORM", help=", ".join(TAGS))
    parser.add_argument("-o", "--out", type=Path, default=ROOT / "dist" / "wheels")
    given = parser.parse_args(words)
    try:
        names = list(platform_names(given.platforms)) or list(TAGS)
        with lines("compiling") as report:
            objects([*MODULES, *map(library.module_of, OTHERS)], names, report)
            page = page_file(report)
        for name in names:
            print(f"wrote {make_wheel(name, zig(name), given.out, page)}", flush=True)
    except (SceneError, NoCompilerError) as error:
        print(f"wheels: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
