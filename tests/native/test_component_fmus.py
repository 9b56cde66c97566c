"""FMUs of a scene with components that were added as one file each, with and without Python.

Each builds a library for ten minutes: with PERCUSSION_LONG=1.
"""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys

import pytest
from fmpy import extract, instantiate_fmu, read_model_description, simulate_fmu

from fmu_src.archive import ROOT
from tests.invariants.test_added_component import CHAMBERS, SWIVEL

LONG = os.environ.get("PERCUSSION_LONG") == "1"
END, STEP = 4e-3, 2.5e-4  # [s]
# A piston and a bit that nothing but their components and the feed moves.
SCENE = """
[effects]
gravity = false
drive = "none"
rock = "none"
barrier = false
chambers = true
swivel = true

[start]
gap = 0.5
piston_velocity = 0.0
"""


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    """The FMUs, by their names; made by the command of a copy with the components."""
    folder = tmp_path_factory.mktemp("with_components")
    for name in ("percussion_model", "fmu_src", "scenarios"):
        leave_out = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, folder / name, ignore=leave_out)
    for name, text in (("chambers", CHAMBERS), ("swivel", SWIVEL)):
        (folder / "percussion_model" / "components" / f"{name}.py").write_text(text)
    (folder / "with.toml").write_text(SCENE)
    shutil.copy(ROOT / "LICENSE", folder)
    kept = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    kept["PYTHONPATH"] = str(folder)
    for words in (["native", "with.toml", "-o", "."], ["fmu", "with.toml", "-o", "slave.fmu"]):
        command = [sys.executable, "-m", "fmu_src.command_line", *words]
        ran = subprocess.run(command, cwd=folder, env=kept, capture_output=True, text=True)
        assert ran.returncode == 0, ran.stderr
    return {path.stem: path for path in folder.glob("*.fmu")}


@pytest.mark.skipif(not LONG, reason="set PERCUSSION_LONG=1")
def test_components_move_an_fmu_as_their_closed_forms_do(fmus):
    assert len(fmus) == 3
    supply, area, t1, t2 = 1e6, 2e-3, 1e-3, 4e-4
    fade_1, fade_2 = math.exp(-END / t1), math.exp(-END / t2)
    turned = -math.expm1(-500.0 * END)
    wanted = {
        "chambers.first": supply * (1.0 - fade_1),
        "chambers.second": supply * (1.0 - (t1 * fade_1 - t2 * fade_2) / (t1 - t2)),
        "swivel.speed": 50.0 * turned,
        "swivel.angle": 50.0 * (END - turned / 500.0),
    }
    impulse = END - (t1**2 * (1.0 - fade_1) - t2**2 * (1.0 - fade_2)) / (t1 - t2)
    for name, path in fmus.items():
        names = [*wanted, "casing.impulse", "energy_residual"]
        found = simulate_fmu(
            path, stop_time=END, step_size=STEP, output_interval=STEP, output=names
        )
        for key, value in wanted.items():
            assert found[key][-1] == pytest.approx(value, rel=1e-10), (name, key)
        # the drive's recoil
        assert found["casing.impulse"][-1] == pytest.approx(-area * supply * impulse, rel=1e-8)
        assert abs(found["energy_residual"]).max() < 1e-12


@pytest.mark.skipif(not LONG, reason="set PERCUSSION_LONG=1")
def test_the_state_of_components_is_saved_and_restored(fmus):
    for path in fmus.values():
        about, folder = read_model_description(path), extract(path)
        instance = instantiate_fmu(folder, about, "CoSimulation")
        fields = [one.valueReference for one in about.modelVariables if "chambers." in one.name]
        read = getattr(instance, "getFloat64", None) or instance.getReal
        if about.fmiVersion == "2.0":
            instance.setupExperiment(startTime=0.0)
        instance.enterInitializationMode()
        instance.exitInitializationMode()

        def step(at, instance=instance):
            instance.doStep(currentCommunicationPoint=at, communicationStepSize=STEP)

        step(0.0)
        state = instance.getFMUState()
        step(STEP)
        once = read(fields)
        instance.setFMUState(state)
        step(STEP)
        assert list(read(fields)) == list(once)
        instance.terminate()
        instance.freeInstance()
        shutil.rmtree(folder)
