"""Kernels stand for what numba makes of them, and need no numba before."""

from __future__ import annotations

import copy
import inspect
import pickle
import subprocess
import sys

import numpy as np
import pytest
from numba import njit

from percussion_model.physics import elementary, loads
from percussion_model.physics.kernel import DISABLED, composed, entry_of, kernel, merged

COMPILERS = "{'numba', 'llvmlite'} & set(sys.modules)"


def run(text):
    """What lines of Python print in a process of their own."""
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_solvers_are_imported_without_numba_and_scipy():
    names = [f"percussion_model.solvers.{one}" for one in ("modal", "wave", "fem", "rigid")]
    lines = [
        "import sys, percussion_model.simulation.simulate, percussion_model.coupling.compiled",
        "import percussion_model.engine.solvers",
        *(f"import {name}.advance" for name in names),
        "print(*{'numba', 'llvmlite', 'scipy'} & set(sys.modules))",
    ]
    assert run("\n".join(lines)) == []


def test_plain_python_gets_its_own_numbers_from_elementary_functions_without_numba():
    lines = [
        "import sys, numpy as np",
        "from percussion_model.physics.elementary import cos_and_sin, exp, power_of_two",
        "found = exp(np.float64(800.0)), *cos_and_sin(np.float64(1e22)), power_of_two(np.int64(3))",
        f"print({{type(one).__name__ for one in found}}, {COMPILERS})",
    ]
    assert run("\n".join(lines)) == ["{'float'}", "set()"]


def test_copies_of_a_kernel_are_the_kernel():
    assert copy.copy(elementary.exp) is elementary.exp
    assert copy.deepcopy([elementary.exp])[0] is elementary.exp
    assert pickle.loads(pickle.dumps(elementary.exp)) is elementary.exp


def test_a_kernel_tells_of_its_function():
    assert list(inspect.signature(loads.bit_load).parameters) == ["par", "s"]
    assert loads.bit_load.__doc__.startswith("Constant force")
    assert not hasattr(loads.bit_load, "__len__")
    with pytest.raises(AttributeError):
        _ = loads.bit_load.nothing_of_this_name


@pytest.mark.skipif(DISABLED, reason="nothing is compiled")
def test_kernels_call_kernels_of_every_kind():
    @composed
    def twice(x):
        return 2.0 * x

    @merged
    def shifted(x):
        return twice(x) + 1.0

    @njit
    def foreign(x):
        return shifted(x) + elementary.number_of(elementary.bits_of(x))

    assert foreign(3.0) == 10.0


@kernel
def _first(x):
    return x[0]


@pytest.mark.skipif(DISABLED, reason="nothing is compiled")
def test_an_entry_is_there_once_a_kernel_was_called():
    x = np.array([4.0, 5.0])
    before = entry_of(_first)
    assert before is _first or _first.overloads
    assert _first(x) == entry_of(_first)(x) == 4.0
    assert entry_of(_first) is not _first
