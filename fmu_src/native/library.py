"""The library of the native FMU for each platform: compiled once for all scenes, and kept."""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

from fmu_src.archive import ROOT
from fmu_src.slave.native import this_platform
from percussion_model.scene.scene import SceneError

HERE = Path(__file__).resolve().parent
KEPT = ROOT / "dist" / "native"
# What the library follows from, besides the versions of what compiles.
SOURCES = (
    *("fmu_src/native", "fmu_src/hammer"),
    *("percussion_model/physics", "percussion_model/scene", "percussion_model/solvers"),
)
COMPILERS = ("numba", "llvmlite", "numpy")
FLAGS = ("-std=c11", "-O2", "-D_POSIX_C_SOURCE=200809L", "-fvisibility=hidden", "-shared")
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
    "x86_64-darwin": Platform("x86_64-apple-macosx11.0", "x86_64-macos", ".dylib"),
    "aarch64-linux": Platform("aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", ".so"),
    "aarch64-darwin": Platform("arm64-apple-macosx11.0", "aarch64-macos", ".dylib"),
}


class NoCompilerError(SceneError):
    """Nothing here can compile the library."""


def platform_names(words: Sequence[str]) -> list[str]:
    """Names of platforms as hosts of either version of FMI call them.

    Raises
    ------
    SceneError
        If one is not known.
    """
    names = [ALIASES.get(word, word) for word in words]
    for name, word in zip(names, words, strict=True):
        if name not in PLATFORMS:
            known = ", ".join([*PLATFORMS, *ALIASES])
            raise SceneError(f"--platforms {word}: must be one or more of {known}")
    return list(dict.fromkeys(names))


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


def compiler_for(name: str) -> list[str]:
    """Command of a compiler for a platform.

    Raises
    ------
    NoCompilerError
        If there is none.
    """
    if name not in PLATFORMS:
        raise NoCompilerError(f"no compiler for {name}: known are {', '.join(PLATFORMS)}")
    if name == this_platform():
        found = next((shutil.which(one) for one in ("cc", "gcc", "clang") if shutil.which(one)), "")
        if found:
            return [found]
    if importlib.util.find_spec("ziglang") is None:
        raise NoCompilerError(
            f"no compiler for {name}: install a C compiler (cc, gcc or clang) for this machine, "
            "or the package ziglang for any platform"
        )
    return [sys.executable, "-m", "ziglang", "cc", "-target", PLATFORMS[name].zig]


def libraries(names: Sequence[str], kept: Path = KEPT) -> dict[str, bytes]:
    """Libraries by platform: those that are kept, the others compiled now.

    Parameters
    ----------
    names : sequence of str
        Of `PLATFORMS`.
    kept : Path
        Folder; libraries of other sources are taken out of it.
    """
    folder = kept / stamp()
    files = {name: folder / f"{name}{PLATFORMS[name].suffix}" for name in names}
    missing = [name for name in names if not files[name].is_file()]
    compilers = {name: compiler_for(name) for name in missing}
    if missing:
        for old in kept.glob("*/"):
            if old != folder:
                shutil.rmtree(old, ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as work:
            make_objects(Path(work), missing)
            for name in missing:
                link(name, compilers[name], Path(work), files[name])
    return {name: file.read_bytes() for name, file in files.items()}


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
    kept = {"NUMBA_CACHE_DIR": str(work / "kernels"), "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "fmu_src.native.objects", str(work), *names]
    done = subprocess.run(
        command, env=os.environ | plain | kept, cwd=ROOT, text=True, capture_output=True
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
    with tempfile.TemporaryDirectory(dir=out.parent) as folder:
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
