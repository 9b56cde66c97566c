"""Planted faults show in the residual; and the kernels run as plain Python."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
import pure_python  # noqa: E402

# Far above what rounding leaves (1e-13), far below what a fault makes.
SEEN = 1e-5


def run_uncompiled(solver, fault):
    """What the scene gives in plain Python, with a fault."""
    done = subprocess.run(
        [sys.executable, str(HERE / "pure_python.py"), solver, fault],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("solver", pure_python.SCENES)
def test_plain_python_equals_compiled_code(solver):
    plain = run_uncompiled(solver, "none")
    compiled = pure_python.run_scene(solver)
    assert abs(plain["energy"]["residual_relative"]) < 1e-12
    events = np.array([list(map(float, row.item())) for row in compiled.events])
    np.testing.assert_allclose(np.array(plain["events"]), events, rtol=1e-9, atol=1e-9)
    state = compiled.save().state.workspace
    np.testing.assert_allclose(np.array(plain["workspace"]), state, rtol=0, atol=1e-9)


@pytest.mark.parametrize("fault", sorted(set(pure_python.FAULTS) - {"none"}))
def test_a_planted_fault_is_seen(fault):
    solver, _ = pure_python.FAULTS[fault]
    residual = run_uncompiled(solver, fault)["energy"]["residual_relative"]
    assert SEEN < abs(residual) < 0.5
