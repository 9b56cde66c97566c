"""Objects of entries in this process, without a linker: LLVM loads them."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from numba.core.registry import cpu_target
from numba.core.runtime import _nrt_python

from percussion_model.engine import plain_memory

# Features of a processor without which it cannot run a kind of objects, or not well (processor.h).
AVX2 = ("avx2", "bmi", "bmi2")
AVX512 = (*AVX2, "avx512f", "avx512dq", "avx512cd", "avx512bw", "avx512vl", "avx512vbmi2")
NEEDED = {"_avx2": AVX2, "_avx512": AVX512}
_kept: list[Any] = []  # what must live as long as the process


def _tell_of_memory() -> None:
    """Let LLVM find what entries ask memory from: numba's own functions, and those of Python."""
    if _kept:
        return
    cpu_target.target_context.refresh()  # numba's own memory is ready from here on
    for name, address in _nrt_python.c_helpers.items():
        llvm.add_symbol(f"NRT_{name}", address)
    allocate = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(plain_memory.allocate)
    address = ctypes.cast(allocate, ctypes.c_void_p).value
    llvm.add_symbol("native_allocate", address)
    _kept.append(allocate)


def load_objects(
    files: Sequence[Path],
) -> tuple[Callable[[str], int], str, Callable[[int], None]]:
    """Load the best objects for this processor.

    Parameters
    ----------
    files : sequence of Path
        For a plain processor and, perhaps, for those with wider vectors.

    Returns
    -------
    address_of : callable
        Address of an entry by its name in C.
    suffix : str
        Of these names.
    free : callable
        Takes an address that an entry has allocated.
    """
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    _tell_of_memory()
    features, suffix = llvm.get_host_cpu_features(), "_base"
    for kind, needed in NEEDED.items():
        if all(features.get(name, False) for name in needed):
            suffix = next((kind for one in files if one.stem.endswith(kind)), suffix)
    machine = llvm.Target.from_default_triple().create_target_machine()
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    for file in files:
        if file.stem.endswith(suffix):
            engine.add_object_file(str(file))
    engine.finalize_object()
    _kept.append(engine)
    return engine.get_function_address, suffix, plain_memory.free
