"""Object code of entries: of one solver, or of another module that has some.

Numba compiles the entries for a plain processor; LLVM then makes code for each target out of
that. All but the entries becomes internal, so that what only Python calls falls away, and what
is left undefined must be on a short list, or be an entry of a solver.
"""

from __future__ import annotations

import ctypes
import gc
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import llvmlite.binding as llvm
from numba import njit, types
from numba.core.codegen import CPUCodeLibrary
from numba.core.cpu import CPUContext

from percussion_model.engine.compiler import WITH_AVX512, suffixes_of
from percussion_model.engine.entries import ENTRIES, SOLVERS
from percussion_model.engine.orphans import end_with_parent
from percussion_model.engine.platforms import TARGETS, WASM
from percussion_model.engine.translations import Translations, stamp_of_translations
from percussion_model.physics import compiling

_KINDS = {"w": types.int64, "n": types.float64}
# What an entry returns where memory ends: Fault.MEMORY.
NO_MEMORY = 1
# What the shell and the C library give.
ALLOWED = frozenset(
    [
        *("native_allocate", "NRT_MemInfo_alloc_aligned", "NRT_MemInfo_alloc_safe_aligned"),
        *("NRT_MemInfo_alloc", "NRT_MemInfo_call_dtor", "NRT_Allocate", "NRT_Free"),
        *("memset", "memcpy", "memmove"),
        *("exp", "expm1", "log", "sin", "cos", "atan2", "sqrt", "floor", "ceil", "rint", "trunc"),
        *("acos", "atanh", "fmod", "sincos"),
    ]
)


# First argument of a process that makes one object.
WRITE = "--write"


class Build(NamedTuple):
    """Code for a processor: its name and features for LLVM, and what names of entries end with."""

    cpu: str
    features: str
    suffix: str


# Vectors of AVX2, but no sum and product in one: it would round otherwise. With those of AVX-512
# the modes of the reference are faster by a sixth, other solvers by nothing.
AVX2 = "+avx2,+bmi,+bmi2,-fma"
AVX512 = f"{AVX2},+evex512,+avx512f,+avx512vl,+avx512dq,+avx512bw,+avx512cd"
# For each processor: on x86, the library chooses when it is loaded.
BUILDS = {
    "x86_64": (
        Build("x86-64", "", "_base"),
        Build("x86-64", AVX2, "_avx2"),
        Build("x86-64", AVX512, "_avx512"),
    ),
    "aarch64": (Build("generic", "", "_base"),),
    WASM: (Build("mvp", "+simd128,+bulk-memory,+mutable-globals,+sign-ext", "_base"),),
}


class Exported(NamedTuple):
    """An entry by its name in C.

    Attributes
    ----------
    function : kernel
    result : type of numba
    arguments : tuple of types
        Addresses are whole numbers.
    """

    function: Any
    result: Any
    arguments: tuple[Any, ...]


def exported_by(module: str) -> dict[str, Exported]:
    """Entries of a module: those of a solver, or of what it calls EXPORTED (C name: form)."""
    found = import_module(module)
    solver = module.rpartition(".")[2]
    forms: dict[str, tuple[str, str]] = getattr(found, "EXPORTED", {})
    if not forms:
        forms = {f"{solver}_{name}": (name, form) for name, form in ENTRIES.items()}
    entries = {}
    for name, (function, form) in forms.items():
        result, _, arguments = form.partition(":")
        kinds = tuple(_KINDS[one] for one in arguments)
        entries[name] = Exported(getattr(found, function), _KINDS[result], kinds)
    return entries


def is_solvers(name: str) -> bool:
    """Whether a name in C is that of an entry of a solver."""
    solver, _, entry = name.partition("_")
    return solver in SOLVERS and entry in ENTRIES


def _ir_type(kind: Any) -> str:
    return "double" if kind == types.float64 else "i64"


def _wrapper(name: str, called: str, one: Exported) -> str:
    """Function in LLVM's language that calls one of numba's, with a plain result."""
    given = ", ".join(f"{_ir_type(kind)} %a{k}" for k, kind in enumerate(one.arguments))
    kind, end = _ir_type(one.result), NO_MEMORY if one.result == types.int64 else "0.0"
    return f"""
define {kind} @{name}({given}) {{
  %result = alloca {kind}
  %error = alloca ptr
  store ptr null, ptr %error
  %status = call i32 @"{called}"(ptr %result, ptr %error, {given})
  %good = icmp eq i32 %status, 0
  %value = load {kind}, ptr %result
  %found = select i1 %good, {kind} %value, {kind} {end}
  ret {kind} %found
}}
declare i32 @"{called}"(ptr, ptr, {", ".join(map(_ir_type, one.arguments))})
"""


@contextmanager
def _each_by_itself() -> Iterator[None]:
    """Let numba translate functions of its own and entries too, and leave it at that.

    All are optimised together, and nothing but C calls them: by wrappers that we write.
    """

    def mark(library: Any) -> None:
        library._finalized = True

    def call_nothing(*_: Any) -> Callable[..., Any]:
        return [].append  # some built-in function, another each time: numba tells them apart by it

    def make_nothing(*_: Any, **__: Any) -> None:
        pass

    with (
        patch.object(CPUCodeLibrary, "finalize", mark),
        patch.object(CPUContext, "get_executable", call_nothing),
        patch.object(CPUContext, "create_cpython_wrapper", make_nothing),
        patch.object(CPUContext, "create_cfunc_wrapper", make_nothing),
    ):
        yield


def _leave_functions() -> None:
    """Let numba optimise no function by itself, for good.

    It would write down where fields of its structures are, for addresses of eight bytes.
    """

    def lay_out(library: Any, module: Any) -> None:
        module.data_layout = library._codegen._data_layout

    patch.object(CPUCodeLibrary, "_optimize_functions", lay_out).start()
    patch.object(CPUCodeLibrary, "_optimize_final_module", lambda _: None).start()


def compile_entries(entries: Mapping[str, Exported]) -> str:
    """Compile entries; LLVM's text of one module with all that they call."""
    # numba wants to know where they are, though nothing calls them here
    somewhere = ctypes.cast(ctypes.CDLL(None).malloc, ctypes.c_void_p).value
    for name in ("native_allocate", *(f"{a}_{b}" for a in SOLVERS for b in ENTRIES)):
        llvm.add_symbol(name, somewhere)
    wrappers, libraries = [], dict[int, Any]()
    with _each_by_itself():
        for name, one in entries.items():
            fresh = njit(error_model="numpy")(one.function.py_func)
            if compiling.keeper_of is not None:
                fresh._cache = compiling.keeper_of(fresh.py_func, {})
            # a result of True or False is a whole number to C
            fresh.compile(one.result(*one.arguments))
            (compiled,) = fresh.overloads.values()
            wrappers.append(_wrapper(name, compiled.fndesc.llvm_func_name, one))
            compiling.add_callees_first(compiled.library, libraries)
        whole = llvm.parse_assembly("")
        for text in wrappers:
            whole.link_in(llvm.parse_assembly(text))
        # what nothing calls yet is left out: so what calls comes before what is called
        for library in reversed(libraries.values()):
            whole.link_in(compiling.module_of(library), preserve=True)
    return _counting_plainly(_without_words(str(whole)))


# How numba's code counts who holds an array. Numba's own two functions are never inlined, so that
# each view of plain memory, which nobody holds, costs some calls. Inlined, a count of nothing is
# left out. Nor need the count be atomic: an array lives within one call, in one thread.
_COUNTING = """
define linkonce_odr void @NRT_incref(ptr %array) alwaysinline {
  %none = icmp eq ptr %array, null
  br i1 %none, label %end, label %some
some:
  %before = load i64, ptr %array
  %count = add i64 %before, 1
  store i64 %count, ptr %array
  br label %end
end:
  ret void
}
define linkonce_odr void @NRT_decref(ptr %array) alwaysinline {
  %none = icmp eq ptr %array, null
  br i1 %none, label %end, label %some
some:
  call void @native_let_go(ptr %array)
  br label %end
end:
  ret void
}
define internal void @native_let_go(ptr %array) noinline {
  %before = load i64, ptr %array
  %count = sub i64 %before, 1
  store i64 %count, ptr %array
  %unheld = icmp eq i64 %count, 0
  br i1 %unheld, label %free, label %end
free:
  tail call void @NRT_MemInfo_call_dtor(ptr %array)
  br label %end
end:
  ret void
}
"""
_NUMBAS_COUNTING = re.compile(
    r"^define [^\n]*@NRT_(?:inc|dec)ref\(.*?^\}$", re.MULTILINE | re.DOTALL
)


def _counting_plainly(text: str) -> str:
    """The module with counts of arrays in its functions themselves.

    Raises
    ------
    ValueError
        If numba counts in another way.
    """
    text, found = _NUMBAS_COUNTING.subn("", text)
    if found != 2:
        raise ValueError(f"numba counts arrays with {found} functions here, not 2")
    return text + _COUNTING


# Functions that put the words of an error together, for Python: an error is a status here.
_WORDS = re.compile(
    r"^(define [^\n]*? (i32|ptr) @\"?[^\n(]*(?:ol_raise_with_shape_context|excinfo_unwrap_args)"
    r"[^\n]*\{)\n.*?^\}$",
    re.MULTILINE | re.DOTALL,
)


# What errors are made of in Python, with places in files of this machine.
_PLACES = re.compile(
    r"^(@\.const\.picklebuf\.\S+ = internal constant \{[^{}]*\}) \{.*$", re.MULTILINE
)


def _without_words(text: str) -> str:
    """The module without what writes errors for Python."""
    text = _PLACES.sub(r"\1 zeroinitializer", text)
    return _WORDS.sub(
        lambda found: f"{found[1]}\n  ret {found[2]} {'1' if found[2] == 'i32' else 'null'}\n}}",
        text,
    )


def builds_of(module: str, platform: str) -> list[Build]:
    """Code of a module for the processors of a platform."""
    return [
        build
        for build in BUILDS[platform.partition("-")[0]]
        if build.suffix in suffixes_of(module, platform)
    ]


def plain_name(name: str) -> str:
    """Name of an entry without what it has for a processor."""
    return re.sub("_(base|avx2|avx512)$", "", name)


def _suffix_of(name: str, build: Build) -> str:
    """What the name of a solver's entry ends with that other code calls."""
    if build.suffix == "_avx512" and name.partition("_")[0] not in WITH_AVX512:
        return "_avx2"
    return build.suffix


def undefined(module: Any) -> set[str]:
    """Functions that a module calls and does not have, LLVM's own left out."""
    return {
        one.name
        for one in module.functions
        if one.is_declaration and not one.name.startswith("llvm.")
    }


def make_object(text: str, triple: str, build: Build, names: Iterable[str]) -> bytes:
    """Object code of a module for a system.

    Parameters
    ----------
    text : str
        As `compile_entries` gives it.
    triple : str
        The system, as LLVM and compilers call it.
    build : Build
    names : iterable of str
        Entries.

    Raises
    ------
    ValueError
        If something is left undefined that neither the shell nor the C library has.
    """
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(triple).create_target_machine(
        cpu=build.cpu, features=build.features, opt=3, codemodel="default",
        reloc="static" if triple.startswith(WASM) else "pic",
    )  # fmt: skip
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = triple, str(machine.target_data)
    kept = set(names)
    for one in module.functions:
        if one.name in kept or (one.is_declaration and is_solvers(one.name)):
            one.name += _suffix_of(one.name, build) if one.is_declaration else build.suffix
            one.visibility = "hidden" if one.is_declaration else "default"
        elif not one.is_declaration:
            one.linkage = "internal"
    for one in module.global_variables:
        if not one.is_declaration:
            one.linkage = "private"  # names of some follow from where files of this machine lie
    options = llvm.create_pipeline_tuning_options(3)
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    missing = {one for one in undefined(module) - ALLOWED if not is_solvers(plain_name(one))}
    if missing:
        raise ValueError(f"left undefined for {triple}: {', '.join(sorted(missing))}")
    if baked := re.search(r"inttoptr \(i64 [0-9]{6,}", str(module)):
        raise ValueError(f"an address of this process is in the code: {baked.group()}")
    code: bytes = machine.emit_object(module)
    return code


def write_object(file: Path, platform: str, build: Build, names: Iterable[str]) -> None:
    """Write an object of a module beside the module's text, `<platform>_<build>.o`.

    Parameters
    ----------
    file : Path
        With what `compile_entries` gives.
    platform : str
        Of `TARGETS`.
    build, names
        As of `make_object`.
    """
    code = make_object(file.read_text(), TARGETS[platform].triple, build, names)
    (file.parent / f"{platform}{build.suffix}.o").write_bytes(code)


def main(module: str, kept: str, folder: str, *platforms: str) -> None:
    """Write the objects of a module's entries for platforms into a folder.

    Parameters
    ----------
    module : str
    kept : str
        File of the translations of its kernels (`Translations`).
    folder : str
    *platforms : str
        Of `TARGETS`; WASM, if at all, alone.
    """
    gc.disable()  # it would take a tenth of the time, and find nothing
    if WASM in platforms:
        _leave_functions()
    entries = exported_by(module)
    translations = Translations(Path(kept), stamp_of_translations(module))
    text = Path(folder) / "entries.ll"
    text.write_text(compile_entries(entries))
    translations.save()
    builds = [(one, *build) for one in platforms for build in builds_of(module, one)]
    # each in a process: LLVM works in one thread at a time
    command = [sys.executable, "-m", __spec__.name, WRITE, str(text)]
    running = [subprocess.Popen([*command, *build, *entries]) for build in builds]
    if any(process.wait() for process in running):
        sys.exit("an object could not be made")
    text.unlink()


if __name__ == "__main__":
    end_with_parent()
    if sys.argv[1] == WRITE:
        file, platform, cpu, features, suffix, *names = sys.argv[2:]
        write_object(Path(file), platform, Build(cpu, features, suffix), names)
    else:
        main(*sys.argv[1:])
