"""The shell of the native FMU with the kernels of a toy, built by the system's compiler."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import fmpy

from fmu_src.hammer.variables import hammer_variables
from fmu_src.native.tables import FILE, model_tables
from percussion_model import Scene
from percussion_model.scene.values import SCENE_NUMBERS

HERE = Path(__file__).parent
SHELL = HERE.parents[1] / "fmu_src" / "native"
ENGINE = HERE.parents[1] / "percussion_model" / "engine"
HEADERS = Path(fmpy.__file__).parent / "c-code"
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
FILES = ("fmi2", "fmi3", "fmi3_none", "fmi3_values", "hash", "instance", "kernels", "place",
         "shared", "state", "tables", "text", "values")  # fmt: skip
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror")
SANITIZERS = ("-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
# Words of the image and outputs that the toy uses, by the names of its macros.
WORDS = {
    "FEED_FORCE": "feed_force",
    "START_GAP": "start_gap",
    "STIFFNESS": "rock_loading_stiffness",
}
OUTPUTS = {
    "POSITION": "bit.position",
    "VELOCITY": "bit.velocity",
    "FORCE": "bit.force",
    "FORCE_MEAN": "bit.force_mean",
    "FORCE_PEAK": "bit.force_peak",
    "GAUGE_STRESS": "gauge_stress",
    "BLOW_COUNT": "blow_count",
    "DRILLING_MODE": "drilling_mode",
    "OFF_BOTTOM": "off_bottom",
}
GUID = "{12345678-90ab-cdef-1234-567890abcdef}"
FAULTS = (
    "",
    "memory is exhausted",
    "gauge.position = {0} m: lies below the {1:|bit|}",
    "a storm at {0:.6g} s",
    "the saved state has {0:r} and {1:d} blows",
    "the gap of {0:r} m is {0:.3g} m, below the {1:|piston|bit|} {{",
)
NOTES = ("", "at t = {0:.6g} s: 100% off bottom by {1}")
SECTIONS = ({"length": 0.2, "area": 5e-3}, {"length": 0.1, "area": 3e-3})


def toy_scene() -> Scene:
    """Scene whose piston has two sections."""
    return Scene().replace(**{"piston.sections": list(SECTIONS)})


def compile_c(out: Path, sources: Sequence[Path], flags: Sequence[str]) -> Path:
    """Compile and link."""
    assert COMPILER is not None
    subprocess.run(
        [COMPILER, "-std=c11", "-O2", "-D_POSIX_C_SOURCE=200809L", *WARNINGS,
         f"-I{SHELL}", f"-I{ENGINE}", f"-isystem{HEADERS}", *map(str, sources),
         *flags, "-o", str(out), "-lm"],
        check=True,
    )  # fmt: skip
    return out


def build_library(folder: Path, flags: Sequence[str] = ()) -> Path:
    """Library of the shell and the toy."""
    fields = SCENE_NUMBERS.names or ()
    outputs = [one.name for one in hammer_variables(Scene()) if one.causality == "output"]
    macros = {"VALUES": len(fields)}
    macros |= {name: fields.index(field) for name, field in WORDS.items()}
    macros |= {name: outputs.index(output) for name, output in OUTPUTS.items()}
    defined = [f"-D{name}={value}" for name, value in macros.items()]
    sources = [SHELL / f"{name}.c" for name in FILES]
    sources += [ENGINE / "memory.c", HERE / "fake_kernels.c"]
    shared = ("-shared", "-fPIC", "-fvisibility=hidden")
    return compile_c(folder / "toy.so", sources, (*shared, *defined, *flags))


def build_host(folder: Path, flags: Sequence[str] = ()) -> Path:
    """The host in C."""
    sources = [
        HERE / f"{name}.c" for name in ("host", "host2", "host3", "host_any", "host_real")
    ] + [SHELL / "hash.c"]
    return compile_c(
        folder / "host", sources, (f"-DSECTIONS={len(SECTIONS)}", "-pthread", "-ldl", *flags)
    )


def write_resources(folder: Path) -> Path:
    """Folder with the toy's tables."""
    folder.mkdir(parents=True, exist_ok=True)
    tables = model_tables(toy_scene(), GUID, FAULTS, NOTES)
    (folder / FILE).write_bytes(tables)
    return folder
