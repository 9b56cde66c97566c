"""What hosts of the FMUs met: events, short steps, start times, instances, trapped exceptions."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from percussion_model import Scene, Simulation
from percussion_model.scene.hammers import hammer
from tests.native import shell_build as build

HERE = Path(__file__).parent
CASES = tomllib.loads((HERE / "cases.toml").read_text(encoding="utf-8"))
LONG = bool(os.environ.get("PERCUSSION_LONG"))
STEPS = (1e-2, 5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4, 2e-5)  # s
CLOCK = 1e-9  # s
needs_compiler = pytest.mark.skipif(
    build.COMPILER is None or sys.platform != "linux", reason="a host in C by dlopen"
)


def named(kind):
    return pytest.mark.parametrize("case", CASES[kind], ids=lambda case: case["id"])


def scene_of(case):
    if "hammer" in case:
        return hammer(case["hammer"], case["rods"])
    return Scene().replace(**case.get("scene", {}))


def ends_of_blows(scene, duration):
    """Times at which blows end in the package, and the solver's longest step [s]."""
    simulation = Simulation(scene)
    simulation.advance(duration)
    blows = simulation.blows
    return blows["time"] + blows["period"], simulation.solver.time_step or 0.0


def events_in_fmpy(path, step, duration):
    """Times of the events, which fmpy records twice: before and after [s]."""
    found = simulate_fmu(
        str(path), stop_time=duration, output_interval=step, output=["blow_count"],
        use_event_mode=True, early_return_allowed=True,
    )  # fmt: skip
    again = np.flatnonzero(np.diff(found["time"]) == 0.0)
    assert np.array_equal(found["blow_count"][again], 1 + np.arange(len(again)))
    return found["time"][again], int(found["blow_count"][-1])


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """The host in C."""
    out = tmp_path_factory.mktemp("host") / "event_host"
    headers = Path(fmpy.__file__).parent / "c-code"
    command = [build.COMPILER, "-std=c11", "-O1", "-D_GNU_SOURCE", f"-isystem{headers}"]
    subprocess.run([*command, str(HERE / "event_host.c"), "-o", str(out), "-ldl"], check=True)
    return out


def events_in_c(host, path, step, duration):
    """The same by the host in C."""
    description, folder = read_model_description(str(path)), Path(unpacked(path))
    (count,) = [v for v in description.modelVariables if v.name == "blow_count"]
    done = subprocess.run(
        [str(host), str(next((folder / "binaries").rglob("*.so"))),
         description.instantiationToken, f"{folder / 'resources'}{os.sep}",
         str(count.valueReference), step.hex(), str(round(duration / step))],
        capture_output=True, text=True, check=True, timeout=300,
    )  # fmt: skip
    *events, end = [line.split() for line in done.stdout.splitlines()]
    assert [int(number) for _, number in events] == list(range(1, len(events) + 1))
    return np.array([float.fromhex(time) for time, _ in events]), int(end[1])


def check_events(found, blows, right, grain):
    """One event a blow, at the end of the solver's step in which the blow ends."""
    assert blows == len(found) == len(right) > 0
    assert np.all(found >= right - CLOCK)
    assert np.all(found <= right + grain + CLOCK)


@named("events")
def test_each_blow_is_an_event_at_every_step(write, case):
    scene, duration = scene_of(case), case["duration"]
    path = write(scene, "3.0")
    right, grain = ends_of_blows(scene, duration)
    times = []
    for step in STEPS:
        found, blows = events_in_fmpy(path, step, duration)
        check_events(found, blows, right, grain)
        times.append(found)
    assert np.ptp(times, axis=0).max() <= CLOCK


@needs_compiler
@named("events")
def test_each_blow_is_an_event_in_c(write, host, case):
    scene, duration = scene_of(case), (1.0 if LONG else case["duration"])
    path = write(scene, "3.0")
    right, grain = ends_of_blows(scene, duration)
    found = [events_in_c(host, path, step, duration) for step in STEPS]
    for times, blows in found:
        check_events(times, blows, right, grain)
    assert np.ptp([times for times, _ in found], axis=0).max() <= CLOCK


@named("events")
def test_blow_count_rises_where_the_blow_ends(write, case):
    """Also by FMI 2.0, and in the package: at the first point behind it, a step at most later."""
    scene, duration, step = scene_of(case), case["duration"], 1e-4
    right, grain = ends_of_blows(scene, duration)
    found = simulate_fmu(
        str(write(scene, "2.0")), stop_time=duration, output_interval=step, output=["blow_count"]
    )
    rises = found["time"][np.flatnonzero(np.diff(found["blow_count"])) + 1]
    assert np.all(rises >= right - CLOCK)
    assert np.all(rises <= right + grain + step + CLOCK)
    simulation = Simulation(scene)
    for end in right:
        simulation.advance(end + grain + CLOCK)
        assert len(simulation.blows) == 1 + np.flatnonzero(right == end)[0]


def unpacked(path):
    """Folder of an FMU beside it: instances of one folder share a library."""
    folder = Path(path).with_suffix("")
    return str(folder) if folder.is_dir() else extract(str(path), str(folder))


class Hosted:
    """An instance of FMI 2.0 that is ready to step."""

    def __init__(self, path, start=0.0, **values):
        description = read_model_description(str(path))
        self.messages = []
        self.reference = {v.name: v.valueReference for v in description.modelVariables}
        self.fmu = FMU2Slave(
            guid=description.guid, unzipDirectory=unpacked(path),
            modelIdentifier=description.coSimulation.modelIdentifier, instanceName="one",
        )  # fmt: skip
        self.fmu.instantiate()
        for name, value in values.items():
            self.fmu.setReal([self.reference[name]], [value])
        self.fmu.setupExperiment(startTime=start)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.time = start

    def step(self, size):
        self.fmu.doStep(self.time, size)
        self.time += size

    def get(self, *names):
        return self.fmu.getReal([self.reference[name] for name in names])


FORCES = ("bit.force", "bit.force_mean", "bit.force_peak")


@named("short_steps")
@pytest.mark.parametrize("version", ["native", "pythonfmu"])
def test_a_short_step_has_the_force_that_acts(write, package_motion, version, case):
    scene = scene_of(case)
    one = Hosted(write(scene, "2.0")) if version == "native" else package_motion(scene)
    one.step(case["from"])
    # the bit stands on the rock, where it rings with some newtons
    right = scene.feed.force + scene.gravity.acceleration * scene.bit.mass
    for size in case["steps"]:
        one.step(size)
        force, mean, peak = one.get(*FORCES)
        assert force == pytest.approx(right, rel=2e-3)
        assert mean == pytest.approx(force, rel=5e-4)
        assert peak == pytest.approx(force, rel=5e-4)


@pytest.fixture
def package_motion():
    """The same by the package, as an FMU without a library runs it."""
    from fmu_src.hammer.motion import Motion
    from fmu_src.hammer.outputs import OUTPUTS

    class Stepped:
        def __init__(self, scene):
            self.motion = Motion(scene, None)

        def step(self, size):
            self.motion.advance_to(self.motion.time + size, size, {})

        def get(self, *names):
            return [OUTPUTS[name].read(self.motion) for name in names]

    return Stepped


@named("start_times")
def test_a_start_far_from_zero_shifts_the_clock_or_is_refused(write, case):
    path = write(Scene(), "2.0")
    if not case["is_allowed"]:
        with pytest.raises(Exception, match="fmi2SetupExperiment"):
            Hosted(path, case["start"])
        return
    here, there = Hosted(path), Hosted(path, case["start"])
    impulses = []
    for one in (here, there):
        impulse = 0.0
        for _ in range(60):
            one.step(1e-3)
            impulse += 1e-3 * one.get("bit.force_mean")[0]
        impulses.append(impulse)
    # as far as the times of the host tell a step
    slack = 60 * np.spacing(abs(case["start"])) / 0.06
    assert impulses[1] == pytest.approx(impulses[0], rel=1e-9 + slack)


def memory_of_process():
    """Memory in use [bytes]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("changes", [{}, {"solver.cells": 100}, {"solver.name": "wave"}])
def test_equal_instances_share_their_tables(write, changes):
    """And what one has done is not seen by the next."""
    path = write(Scene().replace(**changes), "2.0")
    first = Hosted(path)
    for _ in range(60):
        first.step(1e-3)
    wanted = first.get(*FORCES)
    before = memory_of_process()
    others = [Hosted(path) for _ in range(20)]
    assert memory_of_process() - before < 20 * 0.5e6
    for _ in range(60):
        others[-1].step(1e-3)
    assert others[-1].get(*FORCES) == wanted
    first.fmu.freeInstance()  # the tables stay while others use them
    for _ in range(60):
        others[0].step(1e-3)
    assert others[0].get(*FORCES) == wanted
    stiffer = Hosted(path, **{"rock.loading_stiffness": 1.2e9})
    for _ in range(60):
        stiffer.step(1e-3)
    assert stiffer.get(*FORCES) != wanted


TRAPS = """
import ctypes, sys
sys.path.insert(0, {root!r})
from tests.corpus.fmi.test_fmi_corpus import FORCES, Hosted
mathematics = ctypes.CDLL("libm.so.6")
mathematics.feenableexcept(0x01 | 0x04)  # invalid, division by zero
one = Hosted({path!r})
for _ in range({steps}):
    one.step(1e-3)
    one.get(*FORCES)
"""


@pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "gnu_get_libc_version"),
    reason="glibc traps",
)
@pytest.mark.parametrize(
    "case", [{}, *CASES["events"][1:]], ids=lambda case: case.get("id", "reference")
)
def test_no_floating_point_exception_is_raised(write, case):
    """Some hosts end at a division by zero."""
    path = write(scene_of(case), "2.0")
    code = TRAPS.format(root=str(HERE.parents[2]), path=str(path), steps=1000 if LONG else 100)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]


def test_a_discrete_input_in_step_mode_is_taken_with_a_word(write, capfd):
    """FMI 3.0 sets it in event mode; fmpy sets it before a step."""
    path = write(Scene(), "3.0")
    description = read_model_description(str(path))
    reference = {v.name: v.valueReference for v in description.modelVariables}
    one = FMU3Slave(
        guid=description.instantiationToken, unzipDirectory=unpacked(path),
        modelIdentifier=description.coSimulation.modelIdentifier, instanceName="one",
    )  # fmt: skip
    one.instantiate(eventModeUsed=True, earlyReturnAllowed=True, loggingOn=True)
    one.enterInitializationMode(startTime=0.0)
    one.exitInitializationMode()
    one.setBoolean([reference["percussion_on"]], [True])  # in event mode
    one.enterStepMode()
    assert "discrete" not in capfd.readouterr().out
    for _ in range(2):
        one.setBoolean([reference["percussion_on"]], [False])
    one.doStep(0.0, 1e-3)
    assert capfd.readouterr().out.count("percussion_on is discrete") == 1
    assert one.getFloat64([reference["casing_force"]]) == [0.0]
