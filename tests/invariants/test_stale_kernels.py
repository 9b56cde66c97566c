"""Compiled kernels that are kept from an earlier start must not outlive an edit."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import percussion_model

# The force of the drive as a kernel of each solver sees it: 7 N from outside, masses of 1 kg.
FORCES = """
import json
import numpy as np
from percussion_model.physics.records import BLOW, EVENT, DriveKind, Piston
from percussion_model.solvers.fem.records import FEM_PAR, FEM_STATE, Mesh, Node, Stage
from percussion_model.solvers.fem.scheme import load
from percussion_model.solvers.rigid.forces import contact_force
from percussion_model.solvers.rigid.records import RIGID_PAR, RIGID_STATE
from percussion_model.solvers.wave.records import WAVE_PAR, WAVE_STATE, Waves
from percussion_model.solvers.wave.step import record_contact

def records(par, state):
    par, state = np.zeros(1, par), np.zeros(1, state)
    par["mass_p"] = par["mass_b"] = 1.0
    par["drive"], state["external"] = DriveKind.EXTERNAL, 7.0
    return par, state

found = {}
par, state = records(WAVE_PAR, WAVE_STATE)
# the speed at a closure after 1 s, which starts a blow
state["armed"] = 1
waves = Waves(*np.zeros((4, 16, 16)))
lists = np.zeros(1, BLOW), np.zeros(8, EVENT)
record_contact(par[0], state[0], waves, 0, 1.0, 1.0, 0.0, 0.0, 1.0, *lists)
found["wave"] = float(state[0]["b_impact"])
par, state = records(FEM_PAR, FEM_STATE)
par["n_p"], par["n_b"] = 1, 2
nodes, mesh, x = np.zeros((len(Node), 3)), np.ones((len(Mesh), 3)), np.zeros((len(Stage), 3))
load(par[0], state[0], nodes, mesh, x, 1.0)
found["fem"] = x[Stage.RE, 0]
par, state = records(RIGID_PAR, RIGID_STATE)
found["rigid"] = contact_force(par[0], state[0], 0.0)
print(json.dumps(found))
"""


@pytest.mark.slow
def test_every_solver_sees_an_edit_of_a_function_that_its_kernels_call(tmp_path):
    source = Path(percussion_model.__file__).parent
    package = tmp_path / source.name
    shutil.copytree(source, package, ignore=shutil.ignore_patterns("__pycache__"))

    def forces() -> dict[str, float]:
        kept = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
        run = subprocess.run(
            [sys.executable, "-c", FORCES], cwd=tmp_path, env=kept | {"PYTHONPATH": str(tmp_path)},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        return json.loads(run.stdout)

    def kernels() -> dict[Path, int]:
        found = [path for path in package.rglob("*.nb[ci]") if path.parent.name == "__pycache__"]
        return {path: path.stat().st_mtime_ns for path in found}

    assert forces() == dict.fromkeys(("wave", "fem", "rigid"), 7.0)
    compiled = kernels()
    # kept, so that they could be stale
    assert {"wave", "fem", "rigid"} <= {path.parent.parent.name for path in compiled}
    callee = package / "physics" / "loads.py"
    text = callee.read_text(encoding="utf-8")
    assert "return s.external + " in text
    callee.write_text(text.replace("return s.external + ", "return s.external + 1000.0 + "))
    assert forces() == dict.fromkeys(("wave", "fem", "rigid"), 1007.0)
    assert kernels() != compiled
    callee.write_text(text, encoding="utf-8")
    assert forces() == dict.fromkeys(("wave", "fem", "rigid"), 7.0)
    assert kernels() == compiled  # back with their sources, and not compiled again
