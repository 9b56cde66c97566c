"""The library of the native FMU for each platform: compiled once for all scenes, and kept.

It is kept in `dist/native` of a clone, else in the folder `native` of the user's cache
(`PERCUSSION_CACHE`).
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

from fmu_src.archive import ROOT
from fmu_src.slave.native import this_platform
from percussion_model.physics.user_cache import cache_folder, can_write
from percussion_model.scene.presets import is_clone
from percussion_model.scene.scene import SceneError
from percussion_model.scene.writing import own_prefix

HERE = Path(__file__).resolve().parent
# So many libraries are kept, the newest: installations of other versions share a user's cache.
MOST_KEPT = 4
# What the library follows from, besides the versions of what compiles.
SOURCES = (
    *("fmu_src/native", "fmu_src/hammer"),
    *("percussion_model/physics", "percussion_model/scene", "percussion_model/solvers"),
)
COMPILERS = ("numba", "llvmlite", "numpy")
FLAGS = ("-std=c11", "-O2", "-D_POSIX_C_SOURCE=200809L", "-fvisibility=hidden", "-shared")
# What a command says meanwhile.
COMPILING = "compiling the library of FMUs, once for these sources: ten minutes on one core"
# Names of platforms that FMI 2.0 has.
ALIASES = {"linux64": "x86_64-linux", "win64": "x86_64-windows", "darwin64": "x86_64-darwin"}


class Platform(NamedTuple):
    """A system and processor that the library is made for.

    Attributes
    ----------
    triple : str
        For LLVM.
    zig : str
        For zig, which compiles for all of them.
    suffix : str
        Of the library.
    """

    triple: str
    zig: str
    suffix: str


PLATFORMS = {
    "x86_64-linux": Platform("x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17", ".so"),
    "x86_64-windows": Platform("x86_64-pc-windows-gnu", "x86_64-windows-gnu", ".dll"),
    "x86_64-darwin": Platform("x86_64-apple-macosx11.0", "x86_64-macos.11.0", ".dylib"),
    "aarch64-linux": Platform("aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", ".so"),
    "aarch64-darwin": Platform("arm64-apple-macosx11.0", "aarch64-macos.11.0", ".dylib"),
}


class NoCompilerError(SceneError):
    """Nothing here can compile the library."""


def platform_names(words: Sequence[str]) -> dict[str, str]:
    """Names of platforms as hosts of FMI 3.0 call them, with the words that stand for them.

    Raises
    ------
    SceneError
        If one is not known.
    """
    names = {ALIASES.get(word, word): word for word in map(str.strip, words)}
    for name, word in names.items():
        if name not in PLATFORMS:
            known = ", ".join([*PLATFORMS, *ALIASES])
            raise SceneError(f"--platforms {word}: must be one or more of {known}")
    return names


def stamp() -> str:
    """Hash of all that the library follows from."""
    digest = hashlib.sha256()
    for name in COMPILERS:
        digest.update(f"{name} {version(name)}\0".encode())
    for folder in SOURCES:
        for source in sorted((ROOT / folder).rglob("*.[pch]*")):
            if source.suffix in (".py", ".c", ".h"):
                digest.update(source.relative_to(ROOT).as_posix().encode() + b"\0")
                digest.update(hashlib.sha256(source.read_bytes()).digest())
    return digest.hexdigest()[:16]


def compiler_for(name: str, word: str = "") -> list[str]:
    """Command of a compiler for a platform.

    Parameters
    ----------
    name : str
        Of `PLATFORMS`.
    word : str
        What the user calls it.

    Raises
    ------
    NoCompilerError
        If there is none.
    """
    if name not in PLATFORMS:
        raise NoCompilerError(f"no compiler for {name}: known are {', '.join(PLATFORMS)}")
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
    return [sys.executable, "-m", "ziglang", "cc", "-target", PLATFORMS[name].zig]


def kept_folder() -> Path:
    """Folder that libraries are kept in; of a clone that cannot be written where it has one."""
    own = ROOT / "dist" / "native"
    if is_clone() and (can_write(own) or (own / stamp()).is_dir()):
        return own
    return cache_folder() / "native"


def libraries(
    names: Sequence[str] | Mapping[str, str], kept: Path | None = None
) -> dict[str, bytes]:
    """Libraries by platform: those that are kept, the others compiled now.

    Of several processes one compiles, and the others wait for it.

    Parameters
    ----------
    names : sequence of str, or mapping
        Of `PLATFORMS`, perhaps with the words of the user.
    kept : Path, optional
        Folder; `kept_folder` if left out.
    """
    words = names if isinstance(names, Mapping) else {name: name for name in names}
    folder = (kept or kept_folder()) / stamp()
    files = {
        name: folder / f"{name}{PLATFORMS[name].suffix}" for name in words if name in PLATFORMS
    }
    compilers = {
        name: compiler_for(name, words[name])
        for name in words
        if name not in files or not files[name].is_file()
    }
    if compilers:
        folder.mkdir(parents=True, exist_ok=True)
        with only_one(folder.with_suffix(".lock")):
            _compile({name: file for name, file in files.items() if not file.is_file()}, compilers)
            _remove_old(folder.parent)
    return {name: files[name].read_bytes() for name in words}


@contextmanager
def only_one(file: Path) -> Iterator[None]:
    """Work that one process does at a time; another one says that it waits.

    Parameters
    ----------
    file : Path
        The lock, which ends with the process that holds it.
    """
    from filelock import FileLock, Timeout

    lock = FileLock(file)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        print("another process compiles the library of FMUs: waiting for it", file=sys.stderr)
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


def _compile(files: Mapping[str, Path], compilers: Mapping[str, Sequence[str]]) -> None:
    """Compile libraries by platform."""
    if not files:
        return
    with tempfile.TemporaryDirectory(prefix=own_prefix()) as work:
        make_objects(Path(work), list(files))
        for name, file in files.items():
            link(name, compilers[name], Path(work), file)


def _remove_old(kept: Path) -> None:
    """Remove all folders of libraries but the newest."""
    folders = sorted(kept.glob("*/"), key=lambda one: one.stat().st_mtime, reverse=True)
    for old in folders[MOST_KEPT:]:
        shutil.rmtree(old, ignore_errors=True)


@functools.cache
def library_here() -> dict[str, bytes]:
    """Library for this machine by its platform; none, and a line that says so, without compiler."""
    try:
        return libraries([this_platform()])
    except NoCompilerError as error:
        print(f"FMUs are built without a library and run by numba: {error}", file=sys.stderr)
        return {}


def make_objects(work: Path, names: Sequence[str]) -> None:
    """Compile the kernels for platforms, by a process in which numba knows no processor."""
    plain = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_DISABLE_JIT": "0"}
    kept = {"NUMBA_CACHE_DIR": str(work / "kernels")}
    if is_clone():  # what is installed is found as this process has found it
        kept["PYTHONPATH"] = str(ROOT)
    command = [sys.executable, "-m", "fmu_src.native.objects", str(work), *names]
    done = subprocess.run(
        command, env=os.environ | plain | kept, cwd=work, text=True, capture_output=True
    )
    if done.returncode != 0:
        raise SceneError(f"the kernels could not be compiled:\n{done.stderr.strip()[-2000:]}")


def link(name: str, compiler: Sequence[str], work: Path, out: Path) -> None:
    """Compile the shell for a platform, and link it with the kernels."""
    import fmpy

    objects = sorted(work.glob(f"{name}_*.o"))
    flags = [*FLAGS, f"-I{HERE}", f"-isystem{Path(fmpy.__file__).parent / 'c-code'}"]
    if any(one.stem.endswith("_avx2") for one in objects):
        flags.append("-DHAVE_AVX2_KERNELS")
    if "windows" not in name:
        flags.append("-fPIC")
    if "darwin" in name:
        flags.append(f"-Wl,-install_name,@rpath/{out.name}")
    sources = sorted(HERE.glob("*.c"))
    # the name stands in some libraries, and some linkers put more beside them
    with tempfile.TemporaryDirectory(prefix=own_prefix(out.parent), dir=out.parent) as folder:
        draft = Path(folder) / out.name
        given = [*map(str, sources), *map(str, objects)]
        done = subprocess.run(
            [*compiler, *flags, *given, "-lm", "-o", str(draft)], text=True, capture_output=True
        )
        if done.returncode != 0:
            raise SceneError(
                f"the library for {name} could not be built:\n{done.stderr.strip()[-2000:]}"
            )
        draft.replace(out)
