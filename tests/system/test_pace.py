"""Compiled calls give what Python's give; slow parts take longer steps, at their own time."""

from __future__ import annotations

import ctypes
import math
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

from percussion_model.coupling import Coupling, CouplingError
from percussion_model.coupling.calls import CALL, DONE, At
from percussion_model.coupling.calls import STEP as STEP_CALL
from percussion_model.coupling.port import PacedPort
from percussion_model.engine.library import entries_of

SLOW = {"rock": 10, "supply": 7}
STEP = 1e-3  # [s]


@pytest.mark.parametrize("order", ["jacobi", "gauss-seidel"])
@pytest.mark.parametrize("every", [{}, SLOW], ids=["one pace", "slow parts"])
def test_compiled_calls_give_the_same_bits(feed_control, order, every):
    """Some steps more than slow parts do at once, so that their last step is a shorter one."""
    runs = [
        Coupling(feed_control, order=order, every=every, compiled=compiled).run(
            0.173, STEP, ["string.rod_count", "controller.mode"]
        )
        for compiled in (True, False)
    ]
    assert runs[0].steps == 173
    assert runs[0]["hammer.bit.position"][-1] > 1e-3
    for name, column in runs[1].columns.items():
        np.testing.assert_array_equal(runs[0][name], column, err_msg=name)


def test_slow_parts_move_the_depth_little(feed_control):
    """Rock and hose change in tenths of a second: their steps of 10 ms cost no accuracy."""
    depths = [
        Coupling(feed_control, every=every).run(1.0, STEP, interval=1.0)["hammer.bit.position"][-1]
        for every in ({}, {"rock": 10, "supply": 10})
    ]
    assert depths[0] != depths[1]
    assert depths[1] == pytest.approx(depths[0], rel=2e-3)


def test_a_slow_part_is_told_of_whole_steps_and_shows_nothing_before_its_time(feed_control):
    calls = []

    def controller(inputs, time, step):
        calls.append((time, step))
        return {"force_command": time + step, "pressure_command": 2e6, "percussion_on": True}

    coupling = Coupling(feed_control, replaced={"controller": controller}, every={"controller": 4})
    run = coupling.run(10 * STEP, STEP)
    told = [call for call in calls if call[1] > 0.0]
    wanted = [(0.0, 4e-3), (4e-3, 4e-3), (8e-3, 2e-3)]
    np.testing.assert_allclose(told, wanted, rtol=0, atol=1e-15)
    # its first outputs are those of time zero
    expected = [0.0] * 4 + [4e-3] * 4 + [8e-3] * 2 + [10e-3]
    assert run["controller.force_command"] == pytest.approx(expected, abs=1e-15)


def test_all_parts_end_at_the_end(feed_control):
    run = Coupling(feed_control, every={"rock": 1000}).run(0.2, STEP, ["rock.depth"])
    assert run["rock.depth"][-2] == 0.0
    assert run["rock.depth"][-1] == pytest.approx(run["hammer.bit.position"][-2])


@pytest.mark.parametrize(
    ("every", "words"),
    [
        ({"rok": 2}, r"no component rok: did you mean rock\? Known are rock, supply"),
        ({"rock": 0}, "rock=0: must be a whole number from 1"),
        ({"rock": 2.0}, "must be a whole number"),
        ({"rock": True}, "must be a whole number"),
    ],
)
def test_a_pace_that_makes_no_sense_is_refused(feed_control, every, words):
    with pytest.raises(CouplingError, match=words):
        Coupling(feed_control, every=every)


def test_a_pace_and_a_tolerance_do_not_go_together(feed_control):
    with pytest.raises(CouplingError, match="do not go together"):
        Coupling(feed_control, every=SLOW).run(0.1, STEP, tolerance=0.1)


def test_one_step_at_once_is_no_pace(feed_control):
    coupling = Coupling(feed_control, every={"rock": 1})
    coupling.run(3 * STEP, STEP)
    assert not any(isinstance(port, PacedPort) for port in coupling.ports)


@pytest.mark.parametrize("compiled", [True, False])
def test_a_failure_of_an_fmu_is_told_alike(feed_control, compiled):
    """A shoulder that throws the bit about until its force is more than a hammer takes."""
    wild = {"string.shoulder.passive": False, "string.shoulder.stiffness": 1e10}
    run = Coupling(feed_control, wild, compiled=compiled).run(0.5, STEP)
    assert "hammer: feed_force = " in run.error
    assert "must be" in run.error
    assert run.error.startswith("at 0.0")
    assert 0 < run.steps < 500
    assert len(run["time"]) == run.steps + 1


@pytest.mark.skipif(sys.platform == "win32", reason="needs usleep")
def test_other_threads_go_on_while_an_fmu_computes():
    """An FMU may wait for a thread of its own that logs, by way of Python."""
    calls = np.zeros(1, CALL)
    # usleep stands in for fmi2DoStep: its time is where the instance would be
    calls["kind"], calls["component"], calls["every"] = STEP_CALL, 300_000, 1
    calls["function"] = ctypes.cast(ctypes.CDLL(None).usleep, ctypes.c_void_p).value
    at, room = np.array([0, 1, 0, 0, 1, 1, 1, 1]), np.zeros((4, 1))
    ticks, over = [], threading.Event()

    def tick():
        while not over.wait(1e-3):
            ticks.append(None)

    thread = threading.Thread(target=tick, daemon=True)
    thread.start()
    before = len(ticks)
    arrays = [one.ctypes.data for one in (calls, *room, at)]
    assert entries_of("calls").run(*arrays, 1, 0.0, 1e-3) == 1
    during = len(ticks) - before
    over.set()
    thread.join()
    assert at[At.FAILED_CALL] == DONE
    assert during > 10


INTERRUPTED = """
import sys
from percussion_model.coupling import Coupling
coupling = Coupling(sys.argv[1], compiled=sys.argv[2] == "True")
tell = lambda at: at > 0.0205 or print("going", flush=True)
run = coupling.run(1e4, 1e-3, interval=1e-2, progress=tell, on_interrupt="keep")
print(run.error)
print(len(run["time"]) - 1, round(run.steps * run.step, 3))
"""


@pytest.mark.parametrize("compiled", [True, False])
def test_an_interrupted_run_keeps_what_there_is(feed_control, compiled):
    """An FMU is never broken off within a call, where it would be left in pieces."""
    run = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED, str(feed_control), str(compiled)],
        stdout=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    assert run.stdout is not None
    run.stdout.readline()
    run.send_signal(signal.SIGINT)
    said, _ = run.communicate(timeout=120)
    assert run.returncode == 0
    *_, error, counts = said.strip().splitlines()
    assert "it was interrupted" in error
    rows, until = counts.split()
    # a row each ten steps, and the last state
    assert int(rows) == math.ceil(float(until) / 1e-2 - 1e-6)


def test_a_part_of_fixed_steps_gets_no_shorter_one(feed_control):
    coupling = Coupling(feed_control, every={"rock": 10})
    coupling.parts["rock"].can_vary = False
    with pytest.raises(CouplingError, match="25 steps are no multiple of 10"):
        coupling.run(25 * STEP, STEP)


def test_a_pace_beyond_the_run_is_the_whole_run(feed_control):
    runs = [Coupling(feed_control, every={"rock": n}).run(5 * STEP, STEP) for n in (5, 10**30)]
    for name, column in runs[0].columns.items():
        np.testing.assert_array_equal(runs[1][name], column, err_msg=name)
