"""Objects and libraries of entries, made from the sources and kept.

Objects are kept by a hash of all sources that their module imports, so that an edit compiles
what it concerns alone. They lie in `dist/engine` of a clone, else in the folder `engine` of the
user's cache (`PERCUSSION_CACHE`).
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import contextmanager, nullcontext
from importlib.metadata import version
from pathlib import Path

from percussion_model.engine.platforms import TARGETS, WASM, this_platform
from percussion_model.physics.user_cache import cache_folder, can_write, is_clone
from percussion_model.scene.scene import SceneError

HERE = Path(__file__).resolve().parent
PACKAGE = HERE.parent
# Name of the package: FMUs bring it along under another one.
NAME = __name__.removesuffix(".engine.compiler")
ROOT = PACKAGE.parents[NAME.count(".")]  # what modules are found in
COMPILERS = ("numba", "llvmlite", "numpy")
# Modules that are imported, and of which nothing is compiled.
OF_FILES = (
    *("physics.kept_kernels", "physics.user_cache", "scene.presets", "scene.text", "scene.units"),
    "scene.writing",
)
# So many sets of objects of a module are kept, and so many libraries: the newest.
MOST_KEPT = 4
FLAGS = ("-std=c11", "-O2", "-D_POSIX_C_SOURCE=200809L", "-fvisibility=hidden", "-shared")
# Takes what is being done, and the share that is done of it.
Report = Callable[[str, float | None], None]
# Compiling takes about as long, for the share that is told [s].
USUAL = {"modal": 72.0, "wave": 35.0, "fem": 37.0, "rigid": 14.0}
USUAL_ELSE = 10.0
# Modules with code for AVX-512 as well: that of modes, and that of FMUs which calls it.
WITH_AVX512 = {"modal", "entries"}
# What is under way counts for no more than this share, and is looked at so often [s].
ALMOST, LOOK = 0.95, 1.0


class NoCompilerError(SceneError):
    """Nothing here can compile."""


def _file_of(module: str) -> Path | None:
    """Source of a module of the project; None of another, or where there is none."""
    project = {NAME: PACKAGE, "fmu_src": ROOT / "fmu_src"}
    for name, folder in project.items():
        if module == name or module.startswith(f"{name}."):
            path = folder.joinpath(*module.removeprefix(name).strip(".").split("."))
            for file in (path.with_suffix(".py"), path / "__init__.py"):
                if file.is_file():
                    return file
    return None


def _imported_by(file: Path) -> Iterator[str]:
    """Names of modules that a source imports, or may import."""
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{one.name}" for one in node.names)


@functools.cache
def sources_of(module: str) -> tuple[Path, ...]:
    """Sources that the entries of a module follow from: its own, and all that they import."""
    found, todo = set[Path](), [module]
    seen = {module, *(f"{NAME}.{one}" for one in OF_FILES)}
    while todo:
        file = _file_of(todo.pop())
        if file is None or file in found:
            continue
        found.add(file)
        if file == PACKAGE / "components" / "__init__.py":  # which imports them by their names
            todo += [f"{NAME}.components.{one.stem}" for one in file.parent.glob("*.py")]
        for name in _imported_by(file):
            if name not in seen:
                seen.add(name)
                todo.append(name)
    return tuple(sorted(found))


def hash_of(files: Iterable[Path], *words: str) -> str:
    """Hash of sources and of words."""
    digest = hashlib.sha256()
    for word in words:
        digest.update(f"{word}\0".encode())
    for file in files:
        digest.update(file.name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()[:16]


@functools.cache
def stamp_of(module: str) -> str:
    """Hash of all that the objects of a module follow from."""
    return hash_of(sources_of(module), *versions())


def versions() -> list[str]:
    """Names and versions of what compiles."""
    return [f"{name} {version(name)}" for name in COMPILERS]


def kept_folders() -> list[Path]:
    """Folders in which objects and libraries may be kept: of a clone, and of the user.

    What an FMU has brought along is closed to others; so is what is made of it.
    """
    if NAME != "percussion_model":
        return [PACKAGE.parent / "compiled"]
    return [ROOT / "dist" / "engine"] * is_clone() + [cache_folder() / "engine"]


def kept_folder() -> Path:
    """The first of them that can be written."""
    return next((one for one in kept_folders() if can_write(one)), kept_folders()[-1])


def can_compile() -> bool:
    """Whether there is what makes objects."""
    try:
        return importlib.util.find_spec("numba") is not None
    except ImportError:
        return False


@contextmanager
def only_one(file: Path) -> Iterator[None]:
    """Work that one process does at a time; another one says that it waits.

    Parameters
    ----------
    file : Path
        The lock, which ends with the process that holds it.
    """
    try:
        from filelock import FileLock, Timeout
    except ImportError:  # in an FMU: two of them do the same work twice
        with nullcontext():
            yield
        return
    lock = FileLock(file)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        print("another process compiles the engine: waiting for it", file=sys.stderr)
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


def _folder_of(module: str, kept: Path) -> Path:
    return kept / f"{module.rpartition('.')[2]}-{stamp_of(module)}"


def suffixes_of(module: str, platform: str) -> tuple[str, ...]:
    """What files and entries of a module end with, for each kind of processor of a platform."""
    if not platform.startswith("x86_64"):
        return ("_base",)
    wide = module.rpartition(".")[2] in WITH_AVX512
    return ("_base", "_avx2", *["_avx512"] * wide)


def _names(module: str, platform: str) -> list[str]:
    """Files of a module's objects for a platform."""
    return [f"{platform}{suffix}.o" for suffix in suffixes_of(module, platform)]


def definitions(parts: Iterable[Path]) -> list[str]:
    """What a C compiler is told of the processors for which there are objects."""
    kinds = {one.stem.rpartition("_")[2] for one in parts}
    return [f"-DHAVE_{kind.upper()}_KERNELS" for kind in ("avx2", "avx512") if kind in kinds]


def missing(modules: Iterable[str], platforms: Sequence[str]) -> list[str]:
    """Modules of which some objects have yet to be made."""
    kept = kept_folder()
    return [
        module
        for module in modules
        for names in [[name for platform in platforms for name in _names(module, platform)]]
        if not all((_folder_of(module, kept) / name).is_file() for name in names)
    ]


def objects(
    modules: Sequence[str], platforms: Sequence[str], report: Report | None = None
) -> dict[str, list[Path]]:
    """Objects of the entries of modules: those that are kept, the others made now.

    Parameters
    ----------
    modules : sequence of str
        In which `objects.exported_by` finds entries.
    platforms : sequence of str
        Of `TARGETS`.

    Returns
    -------
    dict
        Files by platform.

    Raises
    ------
    NoCompilerError
        If numba is not installed.
    SceneError
        If the sources cannot be compiled.
    """
    kept = kept_folder()
    if missing(modules, platforms):
        if not can_compile():
            raise NoCompilerError(
                "the sources of the solvers have changed, or this installation has no library of "
                'them: install numba: pip install "percussion_model[compile]"'
            )
        kept.mkdir(parents=True, exist_ok=True)
        with only_one(kept / "objects.lock"):
            _make(missing(modules, platforms), platforms, kept, report)
    return {
        platform: [
            _folder_of(one, kept) / name for one in modules for name in _names(one, platform)
        ]
        for platform in platforms
    }  # fmt: skip


def _make(modules: list[str], platforms: Sequence[str], kept: Path, report: Report | None) -> None:
    """Make objects, two modules at a time, the longest first."""
    takes = {module: USUAL.get(module.rpartition(".")[2], USUAL_ELSE) for module in modules}
    began: dict[str, float] = {}

    def make(module: str) -> None:
        began[module] = time.monotonic()
        _make_one(module, platforms, kept)

    with ThreadPoolExecutor(max_workers=2) as pool:
        jobs = {pool.submit(make, one): one for one in sorted(modules, key=lambda one: -takes[one])}
        left, done = set(jobs), 0.0
        try:
            while left:
                if report is not None:
                    now = time.monotonic()
                    part = sum(
                        min(now - began.get(one, now), ALMOST * takes[one])
                        for one in (jobs[job] for job in left)
                    )
                    report("compiling the engine", (done + part) / sum(takes.values()))
                ready, left = wait(left, timeout=LOOK, return_when=FIRST_COMPLETED)
                done += sum(takes[jobs[job]] for job in ready)
                for job in ready:
                    job.result()
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def python() -> str:
    """Python that this process runs; a host of FMUs is none itself.

    Raises
    ------
    NoCompilerError
        If it is not found.
    """
    name = "python.exe" if sys.platform == "win32" else "bin/python3"
    for path in (sys.executable, str(Path(sys.prefix) / name), str(Path(sys.base_prefix) / name)):
        if "python" in Path(path or "").name.lower() and os.access(path, os.X_OK):
            return path
    raise NoCompilerError(f"no Python is found in {sys.prefix}, which would compile the engine")


def _make_one(module: str, platforms: Sequence[str], kept: Path) -> None:
    """Make the objects of a module, by a process in which numba knows no processor.

    Numba is told to translate otherwise for WASM, which therefore comes alone.
    """
    folder = _folder_of(module, kept)
    with tempfile.TemporaryDirectory(prefix=".draft-", dir=kept) as work:
        plain = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_DISABLE_JIT": "0"}
        plain["NUMBA_CACHE_DIR"] = str(Path(work) / "kernels")
        if is_clone() or NAME != "percussion_model":  # found as this process has found it
            plain["PYTHONPATH"] = str(ROOT)
        out = Path(work) / "objects"
        out.mkdir()
        ending = f".{WASM}" * (WASM in platforms) + ".translations"
        translations = kept / f"{module.rpartition('.')[2]}{ending}"
        command = [python(), "-m", f"{NAME}.engine.objects"]
        command += [module, str(translations), str(out), *platforms]
        done = subprocess.run(
            command, env=os.environ | plain, cwd=work, text=True, capture_output=True
        )
        if done.returncode != 0:
            raise SceneError(f"{module} could not be compiled:\n{done.stderr.strip()[-2000:]}")
        folder.mkdir(exist_ok=True)
        for file in out.iterdir():
            file.replace(folder / file.name)
    remove_old(kept, f"{module.rpartition('.')[2]}-*")


def remove_old(kept: Path, pattern: str) -> None:
    """Remove all files or folders of a kind but the newest."""
    found = sorted(kept.glob(pattern), key=lambda one: one.stat().st_mtime, reverse=True)
    for old in found[MOST_KEPT:]:
        if old.is_dir():
            shutil.rmtree(old, ignore_errors=True)
        else:
            old.unlink(missing_ok=True)


def compiler_for(name: str, word: str = "") -> list[str]:
    """Command of a C compiler for a platform.

    Parameters
    ----------
    name : str
        Of `TARGETS`.
    word : str
        What the user calls it.

    Raises
    ------
    NoCompilerError
        If there is none.
    """
    if name not in TARGETS:
        raise NoCompilerError(f"no compiler for {name}: known are {', '.join(TARGETS)}")
    own = ""
    if name == this_platform():
        own = "a C compiler (cc, gcc or clang), or "
        found = next((shutil.which(one) for one in ("cc", "gcc", "clang") if shutil.which(one)), "")
        if found:
            return [found]
    if importlib.util.find_spec("ziglang") is None:
        raise NoCompilerError(
            f"no compiler for {word or name}: install {own}ziglang: "
            'pip install "percussion_model[native]"'
        )
    return [sys.executable, "-m", "ziglang", "cc", "-target", TARGETS[name].zig]


def link(
    name: str, compiler: Sequence[str], sources: Iterable[Path], parts: Iterable[Path], out: Path,
    flags: Iterable[str] = (),
) -> None:  # fmt: skip
    """Compile C sources for a platform, and link them with objects of entries.

    Parameters
    ----------
    name : str
        Of `TARGETS`.
    compiler : sequence of str
        As `compiler_for` gives it.
    sources, parts : Path
        Of C, and objects.
    out : Path
        The library.
    """
    parts = list(parts)
    given = [*FLAGS, f"-I{HERE}", *flags]
    given += definitions(parts)
    if name == WASM:
        given.remove("-shared")  # it would need a loader
    elif "windows" not in name:
        given.append("-fPIC")
    if "darwin" in name:
        given.append(f"-Wl,-install_name,@rpath/{out.name}")
    # the name stands in some libraries, and some linkers put more beside them
    with tempfile.TemporaryDirectory(prefix=".draft-", dir=out.parent) as folder:
        draft = Path(folder) / out.name
        files = [*map(str, sources), *map(str, parts)]
        done = subprocess.run(
            [*compiler, *given, *files, "-lm", "-o", str(draft)], text=True, capture_output=True
        )
        if done.returncode != 0:
            raise SceneError(
                f"the library for {name} could not be built:\n{done.stderr.strip()[-2000:]}"
            )
        draft.replace(out)
