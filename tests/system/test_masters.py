"""The same archive in masters that are not ours: the same depth."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from fmu_src.system.archive import SYSTEMS, build_fmus, read_plan, write_system
from percussion_model.coupling import Coupling

STEP, COUNT = 1e-3, 1500

# Nothing of ours, and nothing that computes in Python, is in the process.
ALONE = """
import sys
for name in ("numpy", "numba", "llvmlite", "pythonfmu", "percussion_model", "fmu_src"):
    sys.modules[name] = None
"""
# ecospy's library wants tbb, which the wheel of that name brings along.
ECOS = """
import ctypes, json, sys
from pathlib import Path
for library in sorted(Path(sys.prefix, "lib").glob("libtbb.so.*")):
    ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
    break
from ecospy import EcosSimulation
with EcosSimulation(float(sys.argv[2]), ssp_path=sys.argv[1]) as simulation:
    simulation.init(parameter_set="initialValues")
    simulation.step(int(sys.argv[3]))
    print("FOUND", json.dumps([
        simulation.get_real("hammer::bit.position"),
        simulation.get_real("string::feed_force_mean"),
        simulation.get_real("controller::feed_wanted"),
    ]))
    simulation.terminate()
"""

COSIM = """
import json, sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
execution = CosimExecution.from_ssp_file(sys.argv[1], step_size=round(float(sys.argv[2]) * 1e9))
observer = CosimObserver.create_last_value()
execution.add_observer(observer=observer)
execution.step(step_count=int(sys.argv[3]))
found = []
for part, name in (("hammer", "bit.position"), ("string", "feed_force_mean"),
                   ("controller", "feed_wanted")):
    index = execution.slave_index_from_instance_name(part)
    known = {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=index)}
    found += observer.last_real_values(index, [known[name]])
print("FOUND", json.dumps(found))
"""

# Its library, wherever it was built or installed.
OMSIMULATOR = os.environ.get("PERCUSSION_OMSIMULATOR", "")
OMS = """
import ctypes, json, re, sys, zipfile
oms = ctypes.CDLL(sys.argv[4])
number, model = ctypes.c_double, ctypes.c_char_p()
with zipfile.ZipFile(sys.argv[1]) as archive:
    plan = archive.read("SystemStructure.ssd").decode()
def call(name, *arguments):
    status = getattr(oms, name)(*arguments)
    assert status <= 1, (name, status)  # ok, or a warning
call("oms_setTempDirectory", b".")
call("oms_importFile", sys.argv[1].encode(), ctypes.byref(model))
system = model.value + b"." + re.search('<ssd:System [^>]*name="([^"]+)"', plan)[1].encode()
call("oms_setResultFile", model, b"", 0)
step = float(sys.argv[2])
call("oms_setStopTime", model, number(step * int(sys.argv[3])))
call("oms_setFixedStepSize", system, number(step))
for name in ("oms_instantiate", "oms_initialize", "oms_simulate"):
    call(name, model)
found = []
for name in (b"hammer.bit.position", b"string.feed_force_mean", b"controller.feed_wanted"):
    value = number()
    call("oms_getReal", system + b"." + name, ctypes.byref(value))
    found.append(value.value)
print("FOUND", json.dumps(found), flush=True)
call("oms_terminate", model)
call("oms_delete", model)
"""


@pytest.fixture(scope="module")
def ours(feed_control):
    return ours_of(feed_control)


def ours_of(archive):
    run = Coupling(archive).run(
        STEP * COUNT, STEP, ["controller.feed_wanted"], interval=STEP * COUNT
    )
    assert run.error == ""
    names = ("hammer.bit.position", "string.feed_force_mean", "controller.feed_wanted")
    return [run[name][-1] for name in names]


@pytest.mark.parametrize(
    ("package", "script"), [("ecospy", ECOS), ("libcosimpy", COSIM)], ids=["ecospy", "libcosimpy"]
)
def test_another_master_drills_as_deep(feed_control, ours, package, script, tmp_path):
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"{package} is not installed (the extra `hosts` has it on Linux, x86-64)")
    if package == "ecospy" and not list(Path(sys.prefix, "lib").glob("libtbb.so.*")):
        pytest.skip("ecospy needs libtbb.so, which the package tbb brings along")
    check(ALONE + script, feed_control, ours, tmp_path)


def test_what_the_page_says_of_ecospy_runs_as_it_stands(feed_control, tmp_path):
    if importlib.util.find_spec("ecospy") is None:
        pytest.skip("ecospy is not installed (the extra `hosts` has it on Linux, x86-64)")
    page = (Path(__file__).parents[2] / "docs" / "hosts.md").read_text(encoding="utf-8")
    section = page[page.index("## 4 ") : page.index("## 5 ")]
    (code,) = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    (tmp_path / "dist").mkdir()
    (tmp_path / "dist" / "FeedControl.ssp").symlink_to(feed_control)
    short = code.replace("step(6000)", "step(50)")
    assert short != code
    done = subprocess.run(
        [sys.executable, "-c", short], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert float(done.stdout.split()[-1]) > 0.0


needs_omsimulator = pytest.mark.skipif(
    not OMSIMULATOR,
    reason="PERCUSSION_OMSIMULATOR names no library of OMSimulator (docs/data/host_sources.md)",
)


@needs_omsimulator
def test_omsimulator_exchanges_waves(tmp_path):
    plan = read_plan(SYSTEMS / "wave_drilling.toml", hammer="rigid")
    archive = write_system(plan, build_fmus(plan, tmp_path), tmp_path / "WaveDrilling.ssp")
    check(ALONE + OMS, archive, ours_of(archive), tmp_path, OMSIMULATOR)


@needs_omsimulator
def test_omsimulator_drills_as_deep(feed_control, ours, tmp_path):
    """It orders its calls by the description: outputs that may depend on all inputs are a loop."""
    check(ALONE + OMS, feed_control, ours, tmp_path, OMSIMULATOR)


def check(script, archive, ours, folder, *more):
    """Run a master in a process of its own, and compare."""
    done = subprocess.run(
        [sys.executable, "-c", script, str(archive), repr(STEP), str(COUNT), *more],
        capture_output=True, text=True, check=False, cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    (said,) = [line for line in done.stdout.splitlines() if line.startswith("FOUND")]
    found = json.loads(said.removeprefix("FOUND"))
    # the archive's parameters have arrived
    assert found[2] == ours[2] == 3000.0
    assert found[0] == pytest.approx(ours[0], rel=1e-4)
    assert found[1] == pytest.approx(ours[1], rel=1e-3)
