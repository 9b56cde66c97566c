"""An FMU in a process of its own: what it needs, prints and leaves behind."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# A host with nothing but fmpy and, unless they are hidden, numpy and numba.
HOST = """
import importlib.abc, sys

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

callbacks = fmi2CallbackFunctions()
callbacks.logger = logger = fmi2CallbackLoggerTYPE(
    lambda environment, name, status, category, text: print(text.decode()) if status > 1 else None)
absent = sys.argv[2].split(",")
class Refuse(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in absent:
            raise ModuleNotFoundError(f"{name} is not installed here")

folder = extract(sys.argv[1])
model = read_model_description(folder)
for name in [*sys.modules]:  # what fmpy has needed itself
    if name.split(".")[0] in absent:
        del sys.modules[name]
sys.meta_path.insert(0, Refuse())
slaves = []
for k in range(3):
    slave = FMU2Slave(guid=model.guid, unzipDirectory=folder, instanceName=f"i{k}",
                      modelIdentifier=model.coSimulation.modelIdentifier)
    slave.instantiate(callbacks=callbacks, loggingOn=True)
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    for i in range(20):
        slave.doStep(0.01 * i, 0.01)
    slaves.append(slave)
refs = [one.valueReference for one in model.modelVariables if one.name == sys.argv[3]]
values = {slave.getReal(refs)[0] for slave in slaves}
slaves[0].terminate()
slaves[0].freeInstance()
assert len(values) == 1
sys.stderr.write(repr(values.pop()))
"""
ABSENT = "percussion_model,fmu_src,pythonfmu,scipy,pandas,matplotlib,typer,rich,tomli_w,pint"


def host(fmu, cwd, output="blow_position", absent=ABSENT, **environment):
    return subprocess.run(
        [sys.executable, "-c", HOST, str(fmu), absent, output],
        cwd=cwd, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": "", **environment},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "output"),
    [
        ("PercussiveHammer", "blow_position"),
        ("RigidHammer", "blow_position"),
        ("Supply", "supply_pressure"),
    ],
)
def test_with_a_library_neither_numpy_nor_numba_nor_a_cache_is_needed(
    fmus, tmp_path, make, name, output
):
    cache = tmp_path / "cache"
    done = host(
        fmus / f"{name}.fmu", tmp_path, output, absent=f"{ABSENT},numpy,numba,llvmlite",
        PERCUSSION_FMU_CACHE=str(cache),
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    assert not cache.exists()
    instance = make(name)
    for _ in range(20):
        instance.step(0.01)
    assert float(done.stderr) == instance.get(output)


def test_without_a_library_and_without_numba_the_reason_is_told(fmus, tmp_path):
    cache = str(tmp_path / "cache")  # of its own, with nothing compiled
    done = host(
        fmus / "NumbaRigidHammer.fmu", tmp_path, absent=f"{ABSENT},numba",
        PERCUSSION_FMU_CACHE=cache,
    )  # fmt: skip
    assert done.returncode != 0
    assert "no library for" in done.stderr
    assert "install numba" in done.stdout


LOGGED = """
import sys, time
from fmpy import simulate_fmu

def log(environment, name, status, category, message):
    print(status, message.decode(), flush=True)

for _ in range(2):
    simulate_fmu(sys.argv[1], stop_time=0.01, output_interval=0.01, logger=log, debug_logging=True)
    print("done", flush=True)
"""


@pytest.mark.slow
def test_the_log_says_once_that_kernels_are_compiled(fmus, tmp_path):
    """Before they are, in a process with an empty cache; not again where they are kept."""
    told, kept = [], tmp_path / "kept"
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", LOGGED, str(fmus / "NumbaRigidHammer.fmu")],
            cwd=tmp_path, capture_output=True, text=True, check=True,
            env={**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": "",
                 "PERCUSSION_FMU_CACHE": str(kept)},
        )  # fmt: skip
        told.append(done.stdout.splitlines())
        # hosts see the log when a call has ended
        assert "runs by Python, and compiles its solver for a minute" in done.stderr
    first, again = told
    because = first.pop(0)
    assert because.startswith("1 NumbaRigidHammer: runs by Python")
    assert because == again.pop(0)
    assert first[0].startswith("0 NumbaRigidHammer: compiling the solver rigid")
    assert str(kept) in first[0]
    assert first[1:] == again == ["done", "done"]
    # what took so long serves all tests that come later
    (made,) = kept.iterdir()
    there = Path(os.environ["PERCUSSION_FMU_CACHE"]) / made.name
    if not there.exists():
        there.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        draft = shutil.copytree(made, there.with_name(f".{made.name}.{os.getpid()}"))
        draft.replace(there)


def test_numpy_and_numba_are_enough_and_one_line_tells_of_compiling(fmus, tmp_path, make):
    done = host(fmus / "NumbaRigidHammer.fmu", tmp_path)
    assert done.returncode == 0, done.stderr  # no crash at the end either
    assert done.stdout == ""
    instance = make("RigidHammer")
    for _ in range(20):
        instance.step(0.01)
    said, value = done.stderr.splitlines()
    assert "runs by Python, and compiles its solver for a minute" in said
    assert float(value) == instance.get("blow_position")


def test_without_a_cache_folder_it_runs_from_a_temporary_one(fmus, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    cache = str(blocked / "in it")
    fmu = fmus / "RockFilter.fmu"
    done = host(fmu, tmp_path, "apparent_energy", PERCUSSION_FMU_CACHE=cache, TMPDIR=str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert float(done.stderr) == 1.0
    assert not list(tmp_path.glob("drilling*"))  # and takes it away


def test_processes_that_start_together_share_one_copy_of_the_sources(fmus, tmp_path):
    cache = tmp_path / "cache"
    fmu = str(fmus / "RockFilter.fmu")
    command = [sys.executable, "-c", HOST, fmu, ABSENT, "apparent_energy"]
    environment = {**os.environ, "PYTHONPATH": "", "PERCUSSION_FMU_CACHE": str(cache)}
    several = [
        subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True, env=environment)
        for _ in range(4)
    ]
    said = [process.communicate()[1] for process in several]
    assert [process.returncode for process in several] == [0] * 4, said
    assert len(set(said)) == 1
    assert [path.name[:16] for path in cache.iterdir()] == ["drilling_system_"]
    assert len(list(cache.glob("*"))) + len(list(cache.glob(".*"))) == 1  # no drafts are left
