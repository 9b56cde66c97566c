"""Object code of the kernels, for the C shell to be linked with.

Numba compiles the entries for a plain processor; LLVM then makes code for each target out of
that. All but the entries becomes internal, so that what only Python calls falls away, and what
is left undefined must be on a short list.
"""

from __future__ import annotations

import ctypes
import gc
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import llvmlite.binding as llvm
from numba import njit, types
from numba.core.caching import FunctionCache
from numba.core.codegen import CPUCodeLibrary
from numba.core.cpu import CPUContext

from fmu_src.native import entries
from fmu_src.native.library import PLATFORMS
from percussion_model.simulation.orphans import end_with_parent

_WORD, _NUMBER = types.int64, types.float64
# Entries by their names in C, with the types of their arguments: pointers are addresses.
ENTRIES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "kernel_check": (entries.check, (_WORD,) * 2),
    "kernel_create": (entries.create, (_WORD,) * 3),
    "kernel_step": (entries.take_step, (*(_WORD,) * 3, _NUMBER, _NUMBER, _WORD, _WORD)),
    "kernel_read": (entries.read_outputs, (_WORD,) * 3),
    "kernel_fault": (entries.find_fault, (_WORD, _WORD, _NUMBER, _WORD)),
}
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


class Target(NamedTuple):
    """A processor and system to make code for.

    Attributes
    ----------
    triple : str
        As LLVM and compilers call it.
    cpu, features : str
    suffix : str
        Of the names of the entries.
    """

    triple: str
    cpu: str = "generic"
    features: str = ""
    suffix: str = "_base"


# Vectors of AVX2, but no sum and product in one: it would round otherwise.
AVX2 = "+avx2,+bmi,+bmi2,-fma"


def _ir_type(kind: Any) -> str:
    return "double" if kind == types.float64 else "i64"


def _wrapper(name: str, called: str, arguments: tuple[Any, ...]) -> str:
    """Function in LLVM's language that calls one of numba's, with a plain result."""
    given = ", ".join(f"{_ir_type(kind)} %a{k}" for k, kind in enumerate(arguments))
    return f"""
define i64 @{name}({given}) {{
  %result = alloca i64
  %error = alloca ptr
  store ptr null, ptr %error
  %status = call i32 @"{called}"(ptr %result, ptr %error, {given})
  %good = icmp eq i32 %status, 0
  %value = load i64, ptr %result
  %found = select i1 %good, i64 %value, i64 {NO_MEMORY}
  ret i64 %found
}}
declare i32 @"{called}"(ptr, ptr, {", ".join(map(_ir_type, arguments))})
"""


@contextmanager
def _each_by_itself() -> Iterator[None]:
    """Let numba translate functions, and leave it at that.

    It would link each with all that it calls, optimise the whole and make machine code of it,
    again for each caller: here this is done once, for all entries together.
    """

    def mark(library: Any) -> None:
        library._finalized = True

    def call_nothing(*_: Any) -> Callable[..., Any]:
        return [].append  # some built-in function, another each time: numba tells them apart by it

    def keep_nothing(*_: Any) -> None:
        pass

    with (
        patch.object(CPUCodeLibrary, "finalize", mark),
        patch.object(CPUContext, "get_executable", call_nothing),
        patch.object(FunctionCache, "load_overload", keep_nothing),
        patch.object(FunctionCache, "save_overload", keep_nothing),
    ):
        yield


def _add_callees_first(library: Any, found: dict[int, Any]) -> None:
    """Add those that a library calls to those found, and then itself."""
    if id(library) in found:
        return
    for one in library._linking_libraries:
        _add_callees_first(one, found)
    found[id(library)] = library


def compile_entries() -> str:
    """Compile all entries; LLVM's text of one module with all that they call."""
    # numba wants to know where it is, though nothing calls it here
    llvm.add_symbol("native_allocate", ctypes.cast(ctypes.CDLL(None).malloc, ctypes.c_void_p).value)
    wrappers, libraries = [], dict[int, Any]()
    with _each_by_itself():
        for name, (function, arguments) in ENTRIES.items():
            fresh = njit(error_model="numpy")(function.py_func)
            fresh.compile(arguments)
            compiled = fresh.overloads[arguments]
            wrappers.append(_wrapper(name, compiled.fndesc.llvm_func_name, arguments))
            _add_callees_first(compiled.library, libraries)
        whole = llvm.parse_assembly("")
        for text in wrappers:
            whole.link_in(llvm.parse_assembly(text))
        # what nothing calls yet is left out: so what calls comes before what is called
        for library in reversed(libraries.values()):
            whole.link_in(library._get_module_for_linking(), preserve=True)
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


def undefined(module: Any) -> set[str]:
    """Functions that a module calls and does not have, LLVM's own left out."""
    return {
        one.name
        for one in module.functions
        if one.is_declaration and not one.name.startswith("llvm.")
    }


def make_object(text: str, target: Target, names: Iterable[str] = tuple(ENTRIES)) -> bytes:
    """Object code of the module for a target.

    Parameters
    ----------
    text : str
        As `compile_entries` gives it.
    names : iterable of str
        Entries.

    Raises
    ------
    ValueError
        If something is left undefined that neither the shell nor the C library has.
    """
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(target.triple).create_target_machine(
        cpu=target.cpu, features=target.features, opt=3, reloc="pic", codemodel="default"
    )
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = target.triple, str(machine.target_data)
    kept = set(names)
    for one in module.functions:
        if not one.is_declaration:
            if one.name in kept:
                one.name += target.suffix
            else:
                one.linkage = "internal"
    for one in module.global_variables:
        if not one.is_declaration:
            one.linkage = "private"  # names of some follow from where files of this machine lie
    options = llvm.create_pipeline_tuning_options(3)
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    if missing := undefined(module) - ALLOWED:
        raise ValueError(f"left undefined for {target.triple}: {', '.join(sorted(missing))}")
    if baked := re.search(r"inttoptr \(i64 [0-9]{6,}", str(module)):
        raise ValueError(f"an address of this process is in the code: {baked.group()}")
    code: bytes = machine.emit_object(module)
    return code


# Builds for each processor: on x86, the library chooses when it is loaded.
BUILDS = {
    "x86_64": (("x86-64", "", "_base"), ("x86-64", AVX2, "_avx2")),
    "aarch64": (("generic", "", "_base"),),
}


def main(folder: str, *platforms: str) -> None:
    """Write the objects for platforms, `<platform>_<build>.o`, into a folder."""
    gc.disable()  # it would take a tenth of the time, and find nothing
    text = compile_entries()
    for platform in platforms:
        for cpu, features, suffix in BUILDS[platform.partition("-")[0]]:
            target = Target(PLATFORMS[platform].triple, cpu, features, suffix)
            file = Path(folder) / f"{platform}{suffix}.o"
            file.write_bytes(make_object(text, target))


if __name__ == "__main__":
    end_with_parent()
    main(*sys.argv[1:])
