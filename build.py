#!/usr/bin/env python3
"""The one entry: set up, run, test and measure percussion_model.

Needs nothing but Python 3.11 or newer: it makes .venv beside this file,
installs the package there, and works inside it.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
STAMP = VENV / "percussion_model.stamp"  # what is installed
COMPILED = VENV / "percussion_model.compiled"  # what compiling beforehand was done for
OLDEST_PYTHON = (3, 11)
INTERRUPTED = 130  # what shells report for Ctrl-C
EVERY = 3.0  # until a line says that a silent program still runs [s]
RARER = 10.0  # lines after it are so many times as far apart

WARM_UP = "fmu_src.warm_up"
REFERENCE_RUN = [
    "run", "scenarios/reference.toml", "--duration", "4", "--settle", "1", "--out", "out/reference",
]  # fmt: skip


def tool(name: str) -> Path:
    """Return the path of a program in .venv, on Windows too."""
    if os.name == "nt":
        return VENV / "Scripts" / f"{name}.exe"
    return VENV / "bin" / name


def missing_requirement(version: tuple[int, ...], modules: dict[str, bool]) -> str:
    """Say what this Python lacks to set up, nothing if it lacks nothing.

    Parameters
    ----------
    version : tuple of int
        Version of the running Python.
    modules : dict
        Whether each of the modules `venv` and `ensurepip` can be found.
    """
    shown = ".".join(str(part) for part in version[:2])
    if version[:2] < OLDEST_PYTHON:
        oldest = ".".join(str(part) for part in OLDEST_PYTHON)
        return (
            f"This is Python {shown}, but percussion_model needs {oldest} or newer. Install it and "
            f"run build.py with it, for instance: python{oldest} build.py setup"
        )
    lacking = [name for name, found in modules.items() if not found]
    if lacking:
        return (
            f"Python {shown} lacks the module {' and '.join(lacking)}, so no .venv can be made. "
            f"On Debian and Ubuntu install it with: sudo apt install python{shown}-venv\n"
            "Elsewhere install Python with its standard library complete."
        )
    return ""


def wanted_stamp(pyproject: bytes, version: tuple[int, ...]) -> str:
    """Return what the stamp of an up-to-date .venv says: Python version and hash."""
    shown = ".".join(str(part) for part in version[:2])
    return f"{shown} {hashlib.sha256(pyproject).hexdigest()}"


def install() -> int:
    """Make .venv and install the package with what development needs, unless that is done."""
    lacking = missing_requirement(
        sys.version_info[:3],
        {name: importlib.util.find_spec(name) is not None for name in ("venv", "ensurepip")},
    )
    if lacking:
        print(lacking, file=sys.stderr)
        return 1
    wanted, found = stamp_now(), stamp_in(STAMP)
    if found == wanted and tool("python").exists():
        return 0
    made = make_venv(renew=bool(found) and found.split()[0] != wanted.split()[0])
    if made != 0:
        return made
    print("Installing percussion_model and what it needs (a minute or two) ...", flush=True)
    code = call([tool("python"), "-m", "pip", "--disable-pip-version-check", "install", "-q",
                 "-e", ".[dev]"], silent="installing")  # fmt: skip
    if code != 0:
        print("The installation failed, see above. Is the network up? Then run this again.",
              file=sys.stderr)  # fmt: skip
        return code
    STAMP.write_text(wanted, encoding="utf-8")
    return 0


def setup() -> int:
    """Install, and compile what later starts only load, unless that is done."""
    code = install()
    if code != 0 or stamp_in(COMPILED) == stamp_now():
        return code
    print("Compiling the kernels, and the library of FMUs (once, some minutes) ...", flush=True)
    code = call([tool("python"), "-m", WARM_UP])  # says itself how far it is
    if code == 0:
        COMPILED.write_text(stamp_now(), encoding="utf-8")
        print("Ready.", flush=True)
    return code


def stamp_now() -> str:
    """What the stamp of an up-to-date .venv says."""
    return wanted_stamp((ROOT / "pyproject.toml").read_bytes(), sys.version_info[:3])


def stamp_in(file: Path) -> str:
    """What a stamp says; nothing where there is none."""
    return file.read_text(encoding="utf-8") if file.exists() else ""


def make_venv(renew: bool) -> int:
    """Make .venv; `renew` throws away one of another Python version."""
    has_pip = tool("python").exists() and (
        subprocess.call(
            [tool("python"), "-c", "import pip"], stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) == 0
    )  # fmt: skip
    if has_pip and not renew:
        return 0
    print("Making .venv ...", flush=True)
    code = call([sys.executable, "-m", "venv", *(["--clear"] if renew else []), VENV],
                silent="making .venv")  # fmt: skip
    if code != 0:
        print(f"No .venv could be made in {ROOT}, see above.", file=sys.stderr)
    return code


def run(extra: list[str]) -> int:
    """Run the reference scene: first as an FMU, unless `extra` changes it, then in full."""
    code = setup()
    if code == 0 and not extra:
        code = call([tool("python"), "-m", "fmu_src.compare"])
        print(flush=True)
    return code or call([tool("percussion"), *REFERENCE_RUN, *extra])


def percussion(command: str, extra: list[str]) -> int:
    """Run a command of `percussion`; paths count from where the user is."""
    return setup() or call([tool("percussion"), command, *extra], folder=Path.cwd())


def docs(extra: list[str]) -> int:
    """Build the documentation site; what is wrong in a page or a link fails."""
    code = install()
    if code != 0:
        return code
    page = ROOT / "out" / "docs" / "index.html"
    print("Building the documentation (half a minute) ...", flush=True)
    code = call([tool("sphinx-build"), "-q", "-W", "--keep-going", "-b", "html", *extra, "docs",
                 page.parent], silent="building")  # fmt: skip
    if code == 0:
        print(f"Open {page.relative_to(ROOT)} in a browser.")
    return code


def test(extra: list[str]) -> int:
    """Run lint, type checks and tests, all of them; return the first failure."""
    code = install()
    if code != 0:
        return code
    checks: list[tuple[str, list[str | Path]]] = [
        ("ruff check", [tool("ruff"), "check"]),
        ("ruff format", [tool("ruff"), "format", "--check"]),
        # its cache has hidden an error that a fresh clone showed: 40 s, but of all there is
        ("mypy", [tool("mypy"), "--no-incremental"]),
        ("lint-imports", [tool("lint-imports")]),
    ]
    # numba's cache does not see edits in another file's callee, so start afresh.
    with tempfile.TemporaryDirectory(prefix="percussion-numba-") as cache:
        variables: dict[str, Any] = {
            "NUMBA_CACHE_DIR": cache,
            "PERCUSSION_FMU_CACHE": str(Path(cache) / "percussion_fmu"),
            "MPLBACKEND": "Agg",
            # threads of linear algebra would wait for each other: both cores have a process
            "OPENBLAS_NUM_THREADS": "1",
        }
        with ThreadPoolExecutor(max_workers=1) as beside:  # the checks leave cores idle
            print("== kernels", flush=True)
            compiling: list[str | Path] = [tool("python"), "-m", WARM_UP]
            kernels = beside.submit(call, compiling, **variables)
            codes = []
            for name, command in checks:
                print(f"== {name}", flush=True)
                codes.append(call(command, **variables))
            codes.append(kernels.result())
        # pytest comes last, so that its closing line ends the output; it tells how far it is.
        print("== pytest", flush=True)
        # a file stays with one process, which makes its fixtures once, and long files come first
        whole = ["--dist", "loadfile", "--no-loadscope-reorder"]
        shared = [] if "PERCUSSION_LONG" in os.environ else whole  # long trials are for all cores
        codes.append(call([tool("pytest"), "-n", "2", *shared, *extra], **variables))
    return next((code for code in codes if code), 0)


def linker() -> int:
    """Install all, and what links for other platforms."""
    code = install()
    if code == 0 and call([tool("python"), "-c", "import ziglang"]) != 0:
        code = call([tool("python"), "-m", "pip", "--disable-pip-version-check", "install", "-q",
                     "-e", ".[native]"], silent="installing a linker")  # fmt: skip
    return code


def wheels(extra: list[str]) -> int:
    """Build wheels with compiled solvers, of all platforms or those named."""
    return linker() or call([tool("python"), "-m", "fmu_src.wheels", *extra])


def page(extra: list[str]) -> int:
    """Make the page that runs the hammer, and test it in a browser, with its long tests."""
    make: list[str | Path] = [
        tool("python"),
        "-c",
        "from percussion_model.interface.explore.build import page_file; print(page_file())",
    ]
    tests = ["tests/test_explore.py", "tests/test_wasm.py"]
    return (
        linker()
        or call(make, silent="compiling for browsers")
        or call([tool("pytest"), *tests, *extra], PERCUSSION_LONG="1")
    )


def bench(extra: list[str]) -> int:
    """Measure speed."""
    code = install()
    if code != 0:
        return code
    with tempfile.TemporaryDirectory(prefix="percussion-numba-") as cache:
        return call([tool("python"), "-m", "benchmarks", *extra], silent="measuring",
                    NUMBA_CACHE_DIR=cache)  # fmt: skip


def call(command: list[str | Path], folder: Path = ROOT, silent: str = "", **variables: str) -> int:
    """Run a program, from the project's folder unless told otherwise; return its code.

    `silent` says what a program does that tells nothing itself: lines say that it still runs.
    """
    words = [str(part) for part in command]
    try:
        child = subprocess.Popen(words, cwd=folder, env={**os.environ, **variables})
    except FileNotFoundError:
        print(f"{words[0]} is missing. Delete .venv and run this again.", file=sys.stderr)
        return 1
    began, wait = time.monotonic(), EVERY
    try:
        while silent:
            try:
                return child.wait(wait)
            except subprocess.TimeoutExpired:
                wait = RARER * EVERY
                print(f"{time.monotonic() - began:4.0f} s: {silent}", file=sys.stderr, flush=True)
        return child.wait()
    except KeyboardInterrupt:
        # The program was interrupted too: let it keep its finished work.
        try:
            child.wait()
        except KeyboardInterrupt:
            child.kill()
        raise


def main(arguments: list[str]) -> int:
    """Run the sub-command that `arguments` name."""
    parser = argparse.ArgumentParser(prog="build.py", description="Build percussion_model.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    commands.add_parser("setup", help="make .venv and install everything")
    commands.add_parser("run", help="run the reference scene; more goes to `percussion run`")
    commands.add_parser("test", help="lint, type checks and tests; more goes to pytest")
    commands.add_parser("fmu", help="bake a scene into an FMU: SCENE, -o FILE.fmu",
                        add_help=False)  # fmt: skip
    commands.add_parser("native", help="bake a scene into FMUs that need no Python: SCENE, "
                        "--platforms NAMES", add_help=False)  # fmt: skip
    commands.add_parser("system", help="build drilling systems of FMUs as SSP: NAMES "
                        "or all, -o FOLDER; no name: list them", add_help=False)  # fmt: skip
    commands.add_parser("docs", help="build the documentation site; more goes to sphinx-build")
    commands.add_parser("wheels", help="build wheels with compiled solvers: PLATFORMS, -o FOLDER",
                        add_help=False)  # fmt: skip
    commands.add_parser("page", help="make the page that runs the hammer, and test it in a browser")
    commands.add_parser("bench", help="measure speed; more goes to the benchmarks")
    choice, extra = parser.parse_known_args(arguments)
    started = time.monotonic()
    try:
        if choice.command == "setup":
            if extra:
                parser.error(f"setup takes no arguments, not {' '.join(extra)}")
            code = setup()
            print(f".venv is {'up to date' if code == 0 else 'not ready'} "
                  f"({time.monotonic() - started:.1f} s).")  # fmt: skip
            return code
        work = {"run": run, "docs": docs, "test": test, "bench": bench, "wheels": wheels,
                "page": page}  # fmt: skip
        if choice.command not in work:
            return percussion(choice.command, extra)
        return work[choice.command](extra)
    except KeyboardInterrupt:
        print("\nInterrupted.", file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
