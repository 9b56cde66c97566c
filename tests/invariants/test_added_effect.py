"""An effect that is one file: viscous drag on the bit, in waves, modes, elements and rigid bodies.

Added as CONTRIBUTING.md tells it, to a copy of the package. Waves, modes and elements run as
plain Python, which spares a minute of compiling, but with PERCUSSION_LONG=1.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import percussion_model

ROOT = Path(percussion_model.__file__).parents[1]
LONG = os.environ.get("PERCUSSION_LONG") == "1"

DRAG = '''
"""Viscous drag on the bit, F = -c v."""

from percussion_model.physics.effects import Effect
from percussion_model.physics.kernel import inlined


@inlined
def drag_force(par, s):
    """Force of the drag on the bit in the present state [N]."""
    return -par.drag_damping * s.v_b


EFFECT = Effect(
    "drag",
    "viscous drag on the bit",
    {"damping": (0.0, "N s/m", "force by velocity", 0.0, 1e6)},
    drag_force,
)
'''

# A bit that the feed alone moves, and a blow on the rock, both on coarse grids.
RUN = """
import json, os, sys
if os.environ.get("NUMBA_DISABLE_JIT"):
    from tests.invariants.pure_python import use_attribute_records
    use_attribute_records()
from percussion_model import Scene, Simulation
drill = Scene().computed_by(sys.argv[1], **json.loads(sys.argv[2]))
assert "drag" in drill.effects_on and drill.replace(**{"effects.drag": False}).unused
alone = {"start.gap": 50.0, "start.piston_velocity": 0.0, "effects.gravity": False}
alone |= {"effects.drive": "none", "effects.rock": "none", "effects.barrier": False}
found = {}
for name, scene, end in (("alone", drill.replace(**alone), 4e-3), ("drill", drill, 2e-3)):
    simulation = Simulation(scene)
    simulation.advance(end)
    found[name] = simulation.energy() | simulation.observe()
print(json.dumps(found))
"""
COARSE = {
    "wave": {"solver.cells": 4},
    "modal": {"solver.cells": 8},
    "fem": {"fem.elements": 4, "fem.courant": 1.0},
    "rigid": {},
}
DAMPING = 2e3  # [N s/m]


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("with_drag")
    copy = folder / "percussion_model"
    leave_out = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "percussion_model", copy, ignore=leave_out)
    (copy / "physics" / "effects" / "drag.py").write_text(DRAG)
    return folder


@pytest.mark.parametrize("solver", COARSE)
def test_an_effect_of_one_file_acts_and_closes_the_ledger(package, solver):
    changes = COARSE[solver] | {"effects.drag": True, "drag.damping": DAMPING, "run.settle": 0.0}
    kept = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    kept["PYTHONPATH"] = os.pathsep.join((str(package), str(ROOT)))
    if solver != "rigid" and not LONG:
        kept["NUMBA_DISABLE_JIT"] = "1"
    command = [sys.executable, "-W", "ignore", "-c", RUN, solver, json.dumps(changes)]
    run = subprocess.run(command, cwd=package, env=kept, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    found = json.loads(run.stdout)
    # M v' = F - c v from rest
    force, mass, end = 2500.0, percussion_model.Scene().bit.mass, 4e-3
    rate = DAMPING / mass
    fade = -math.expm1(-rate * end)
    velocity = force / DAMPING * fade
    taken = force**2 / DAMPING * (end - fade / rate - 0.5 * fade * fade / rate)
    alone = found["alone"]
    assert alone["bit_velocity"] == pytest.approx(velocity, rel=0.01)
    assert alone["drag"] == pytest.approx(taken, rel=0.01)
    assert alone["dissipated"] >= alone["drag"]
    for name, entries in found.items():
        assert entries["drag"] > 0.0, name
        assert abs(entries["residual_relative"]) < 1e-12, name
