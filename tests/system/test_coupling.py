"""The runner of systems: what it sets, keeps and balances, and how it ends when parts fail."""

from __future__ import annotations

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from momentum import missing_momentum

from percussion_model.coupling import Coupling, CouplingError
from percussion_model.coupling.coupled_run import known_signals, summary
from percussion_model.interface.cli import main

SHORT = 0.05  # [s]
LOWER, UPPER = 0.02, 0.04  # the hard layer of a short hole [m]


def steady(inputs, time, step):
    """A controller that does nothing but hold what the system starts with."""
    return {"force_command": -800.0, "pressure_command": 2e6, "percussion_on": True}


@pytest.fixture(scope="module")
def layers(feed_control):
    """Three layers within three seconds, every step kept."""
    coupling = Coupling(feed_control, {"rock.layers[2].top": LOWER, "rock.layers[3].top": UPPER})
    return coupling.run(3.4, 1e-3, known_signals(coupling.outputs))


def test_it_drills_through_three_layers(layers):
    assert layers.error == ""
    assert layers.steps == 3400
    stiffness, depth = layers["rock.loading_stiffness"], layers["hammer.bit.position"]
    assert set(stiffness) == {4e8, 1.2e9}
    hard = stiffness == 1.2e9
    assert depth[hard].max() == pytest.approx(UPPER, abs=2e-3)
    assert depth[-1] > UPPER + 5e-3
    rate = layers["hammer.rate_of_penetration"]
    ends = np.flatnonzero(np.diff(hard.astype(int)))
    before, within = rate[ends[0]], rate[ends[1]]
    # the paper's trend: rate by K^-0.55
    assert math.log(within / before) / math.log(3.0) == pytest.approx(-0.54, abs=0.05)


def test_the_pi_holds_the_feed_after_steps_of_stiffness(layers):
    """Within 5 % of what is wanted, from the first step of the rock on."""
    stiffness, time = layers["rock.loading_stiffness"], layers["time"]
    first = time[np.argmax(stiffness == 1.2e9)]
    feed = layers["string.feed_force_mean"][time >= first]
    assert np.all(np.abs(feed / 3000.0 - 1.0) < 0.05)
    # it is the controller that does it: both steps are to be seen in its command
    command = layers["controller.force_command"][time >= first]
    assert np.ptp(command) > 30.0


def test_energy_and_momentum_of_the_string_balance(layers):
    found = summary(layers)
    assert found["string_energy_residual"] < 0.01
    assert found["hammer_energy_residual"] < 1e-12
    # the shoulder may make no more than this share of what the blows bring
    assert found["shoulder_by_blows"] > -0.005
    # what the string gave to the bit, the bit had: the impulse of the held force
    held = np.concatenate([[0.0], np.cumsum(layers["string.feed_force"][:-1]) * layers.step])
    np.testing.assert_allclose(layers["string.bit_impulse"], held, rtol=1e-9, atol=1e-6)


def test_momentum_of_the_whole_system_closes(layers):
    """Rig and weights push down, the rock up; the rest is in motion. Closes within 1 %."""
    missing = missing_momentum(layers, 10.0)
    assert np.max(np.abs(missing)) < 0.01 * layers["hammer.bit.impulse"][-1]


def test_the_order_moves_the_depth_little(feed_control):
    depths = [
        Coupling(feed_control, order=order).run(0.6, 1e-3, interval=0.6)["hammer.bit.position"][-1]
        for order in ("jacobi", "gauss-seidel")
    ]
    assert depths[0] == pytest.approx(depths[1], rel=0.03)
    assert depths[0] != depths[1]


def test_parameters_go_before_those_of_the_archive(feed_control):
    coupling = Coupling(feed_control, {"rock.layers[1].loading_stiffness": 5e8})
    run = coupling.run(2e-3, 1e-3)
    assert set(run["rock.loading_stiffness"]) == {5e8}


def test_a_python_callable_takes_the_place_of_an_fmu(feed_control):
    seen = []

    def controller(inputs, time, step):
        seen.append((time, step, sorted(inputs)))
        return steady(inputs, time, step)

    run = Coupling(feed_control, replaced={"controller": controller}).run(SHORT, 1e-3)
    assert run.error == ""
    assert seen[-1][:2] == (pytest.approx(SHORT - 1e-3), 1e-3)
    assert {"feed_force", "rate_of_penetration", "rotation_torque"} <= set(seen[-1][2])
    # what nothing is connected to has its start, that of the archive first
    assert {"feed_setpoint", "pressure_setpoint"} <= set(seen[0][2])
    assert set(run["controller.force_command"]) == {-800.0}


def test_a_fault_of_a_callable_is_told_with_its_place(feed_control):
    def careless(inputs, time, step):
        assert inputs["feed_setpoint"] == 3000.0  # of the archive; the table has 2500
        return {**steady(inputs, time, step), "force_command": inputs["feed"]}

    with pytest.raises(
        CouplingError, match=r"no input 'feed': did you mean feed_setpoint.*test_coupling.py, line"
    ):
        Coupling(feed_control, replaced={"controller": careless}).run(SHORT, 1e-3)


def test_a_key_of_the_callables_own_is_not_taken_for_an_input(feed_control):
    def careless(inputs, time, step):
        return {**steady(inputs, time, step), "force_command": {"gain": 1.0}["gian"]}

    with pytest.raises(CouplingError, match=r"controller: KeyError: 'gian' \(test_coupling.py"):
        Coupling(feed_control, replaced={"controller": careless}).run(SHORT, 1e-3)


def test_signals_can_be_changed_on_their_way(feed_control):
    def lose(signal, time, value):
        return 0.5 * value if signal == "hammer.supply_pressure" else value

    run = Coupling(feed_control, on_way=lose).run(0.3, 1e-3, ["hammer.blow_energy"])
    whole = Coupling(feed_control).run(0.3, 1e-3, ["hammer.blow_energy"])
    assert run["hammer.blow_energy"][-1] < 0.7 * whole["hammer.blow_energy"][-1]


def crash(inputs, time, step):
    if time > 0.02:
        raise RuntimeError("the sensor is gone")
    return steady(inputs, time, step)


def nonsense(inputs, time, step):
    return steady(inputs, time, step) | {"force_command": math.nan if time > 0.02 else 0.0}


def silent(inputs, time, step):
    return {"force_command": 0.0} if time > 0.02 else steady(inputs, time, step)


def forgetful(inputs, time, step):
    return steady(inputs, time, step) if time <= 0.02 else None


def wordy(inputs, time, step):
    return steady(inputs, time, step) | ({"force_command": "3 kN"} if time > 0.02 else {})


@pytest.mark.parametrize(
    ("controller", "text"),
    [
        (forgetful, "controller: forgetful (test_coupling.py) returned None: must return a dict"),
        (wordy, "controller: {'force_command': '3 kN'}: must be numbers"),
        (crash, "controller: RuntimeError: the sensor is gone"),
        (nonsense, "controller: force_command = nan is no number"),
        (silent, "controller gave no percussion_on, pressure_command"),
    ],
)
def test_a_part_that_fails_ends_the_run_with_what_there_is(feed_control, controller, text):
    run = Coupling(feed_control, replaced={"controller": controller}).run(1.0, 1e-3)
    assert text in run.error
    assert run.error.startswith("at 0.02")
    assert run.steps == len(run["time"]) - 1
    assert 20 <= run.steps <= 22
    assert np.all(np.isfinite(run["hammer.bit.position"]))


def test_an_fmu_that_refuses_says_which_and_why(feed_control):
    def wild(inputs, time, step):
        return steady(inputs, time, step) | ({"force_command": 1e12} if time > 0.02 else {})

    run = Coupling(feed_control, replaced={"controller": wild}).run(SHORT, 1e-3)
    assert "s: rig: force_command = 1000000000000.0 N: must be a number from" in run.error
    assert run.steps >= 20


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"parameters": {"rock.layr": 1.0}}, "rock has no variable layr; did you mean layer"),
        ({"parameters": {"rok.layer": 1.0}}, "there is no FMU rok"),
        ({"replaced": {"pilot": steady}}, "has no component pilot"),
    ],
)
def test_what_is_not_there_is_named(feed_control, changes, text):
    with pytest.raises(CouplingError, match=text):
        Coupling(feed_control, **changes).run(SHORT, 1e-3)


@pytest.mark.parametrize(("duration", "step"), [(0.0, 1e-3), (1.0, -1.0), (1e-3, 1.0)])
def test_times_are_checked(feed_control, duration, step):
    with pytest.raises(CouplingError, match=r"must be above|is longer"):
        Coupling(feed_control).run(duration, step)


def test_no_archive_is_one_line(tmp_path):
    with pytest.raises(CouplingError, match="no such file"):
        Coupling(tmp_path / "Nothing.ssp")
    with pytest.raises(CouplingError, match="is a folder: give the archive"):
        Coupling(tmp_path)
    (tmp_path / "Text.ssp").write_text("text")
    with pytest.raises(CouplingError, match=r"^[^:]*: cannot be unpacked"):
        Coupling(tmp_path / "Text.ssp")


def test_the_command_runs_a_system(feed_control, tmp_path, monkeypatch, capsys):
    out = tmp_path / "out"
    words = ["percussion", "couple", str(feed_control), "--duration", "0.1", "--out", str(out)]
    monkeypatch.setattr("sys.argv", [*words, "--set", "controller.feed_setpoint=2800"])
    with pytest.raises(SystemExit) as ended:
        main()
    said = capsys.readouterr()
    assert ended.value.code == 0, said.err
    assert "Depth of the bit" in said.out
    table = np.genfromtxt(out / "signals.csv", delimiter=",", names=True)
    assert table["time"][-1] == 0.1
    assert (out / "signals.png").stat().st_size > 20_000


@pytest.mark.parametrize("command", ["couple", "bench-controller"])
def test_a_command_says_before_that_an_fmu_compiles(without_library, tmp_path, command):
    words = ["couple", str(without_library)]
    if command == "bench-controller":
        words = [command, "--system", str(without_library)]
    caches = {"NUMBA_CACHE_DIR": str(tmp_path / "numba"), "PERCUSSION_FMU_CACHE": str(tmp_path)}
    child = subprocess.Popen(
        [sys.executable, "-c", "from percussion_model.interface.cli import main; main()", *words],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, cwd=tmp_path,
        env={**os.environ, **caches, "COLUMNS": "1000"},
    )  # fmt: skip
    try:
        said = next(line for line in child.stderr if line.startswith("percussion: "))
    finally:
        child.kill()
        child.communicate()
    assert said.startswith("percussion: hammer: compiling the solver rigid: once, ")
    assert "a minute; kept in" in said
