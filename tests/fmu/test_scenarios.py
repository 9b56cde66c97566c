"""Scripted scenarios: each draws its figure, and shows the physics that it is about."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from percussion_model import Scene, simulate
from percussion_model.interface.commands.common import BAD_INPUT, INTERRUPTED
from percussion_model.scene.hammers import with_chambers
from percussion_model.simulation.origin import ORIGIN
from scenarios import (
    collaring_ramp,
    compressor_too_small,
    constant_reference,
    hammer_at_altitude,
    harness,
    layered_rock,
    percussion_off_on,
    pressure_loss,
)
from scenarios.harness import Instance, plot, ramp, run
from scenarios.results import ScenarioError

ROOT = Path(__file__).parents[2]
# What others share is no scenario.
SHARED = {"__init__", "coupled", "drawing", "harness", "results"}
SCRIPTS = sorted({path.stem for path in (ROOT / "scenarios").glob("*.py")} - SHARED)
SCENE = Scene()
MASS, GRAVITY = SCENE.piston.mass, SCENE.gravity.acceleration
START = SCENE.start.piston_velocity


def at(found, name, time):
    """Value of a column at a time."""
    return found[name][np.searchsorted(found["time"], time)]


def draws(module, found, folder):
    path = plot(folder / f"{module.__name__}.png", module.TITLE, found, module.PANELS)
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert path.stat().st_size > 20_000


def piston_momentum_balances(found):
    """Contact impulse = drive and weight, less what the piston still has."""
    wanted = -found["casing.impulse"] + MASS * GRAVITY * found["time"]
    wanted -= MASS * (found["piston.velocity"] - START)
    np.testing.assert_allclose(found["contact.impulse"], wanted, rtol=1e-9, atol=1e-6)


def test_constant_reference(hammer, tmp_path):
    found = constant_reference.simulate(hammer)
    draws(constant_reference, found, tmp_path)
    piston_momentum_balances(found)
    # the bit: feed and both weights and the drive, less what moves still
    bit = SCENE.bit.mass
    wanted = (2500.0 + (MASS + bit) * GRAVITY) * found["time"] - found["casing.impulse"]
    wanted -= MASS * (found["piston.velocity"] - START) + bit * found["bit.velocity"]
    np.testing.assert_allclose(found["bit.impulse"], wanted, rtol=1e-9, atol=1e-6)
    steady = found["time"] > 0.5
    for name in ("rate_of_penetration", "blow_frequency", "blow_energy"):
        np.testing.assert_allclose(found[name][steady], found[name][-1], rtol=1e-5)
    assert found["contact.force_peak"][steady].max() == pytest.approx(963e3, rel=2e-3)
    assert found["energy_residual"][-1] == pytest.approx(0.0, abs=1e-12)
    assert not found["off_bottom"][steady].all()


def test_collaring_ramp(hammer, tmp_path):
    found = collaring_ramp.simulate(hammer)
    draws(collaring_ramp, found, tmp_path)
    piston_momentum_balances(found)
    early, late = collaring_ramp.LOW, collaring_ramp.DURATION
    # over a cycle the weight gives nothing and the drive 2 F_0 D_1
    energy = np.array([at(found, "blow_energy", t) for t in (early, late)])
    ratio = collaring_ramp.PRESSURE[1] / collaring_ramp.PRESSURE[0]
    assert energy[1] / energy[0] == pytest.approx(ratio, rel=0.02)
    rising = found["time"] > early
    for name in ("blow_energy", "rate_of_penetration", "blow_frequency"):
        column = found[name][rising]
        assert np.all(np.diff(column) > -1e-3 * column[-1]), name
    assert at(found, "rate_of_penetration", late) == pytest.approx(0.016351, rel=1e-3)
    assert late > collaring_ramp.HIGH + 0.5


def test_pressure_loss(hammer, tmp_path):
    found = pressure_loss.simulate(hammer)
    draws(pressure_loss, found, tmp_path)
    piston_momentum_balances(found)
    before, low, after = 0.69, 1.59, pressure_loss.DURATION
    ratio = pressure_loss.LEFT / pressure_loss.FULL
    frequency, energy, rate = (
        np.array([at(found, name, t) for t in (before, low, after)])
        for name in ("blow_frequency", "blow_energy", "rate_of_penetration")
    )
    assert energy[1] / energy[0] == pytest.approx(ratio, rel=0.03)
    assert frequency[1] / frequency[0] == pytest.approx(np.sqrt(ratio), rel=0.06)
    assert rate[1] < 0.5 * rate[0]
    for column in (frequency, energy, rate):
        assert column[2] == pytest.approx(column[0], rel=1e-4)


def test_layered_rock(hammer, tmp_path):
    found = layered_rock.simulate(hammer)
    draws(layered_rock, found, tmp_path)
    hard = found["rock.loading_stiffness"] == layered_rock.HARD
    begin, end = found["time"][hard][[0, -1]]
    rates = [at(found, "rate_of_penetration", t) for t in (begin, end, found["time"][-1])]
    assert rates[0] == pytest.approx(rates[2], rel=1e-4)
    exponent = np.log(rates[1] / rates[0]) / np.log(layered_rock.HARD / layered_rock.SOFT)
    assert -0.56 < exponent < -0.49  # the paper: -0.55
    piston_momentum_balances(found)


def test_percussion_off_on(hammer, tmp_path):
    found = percussion_off_on.simulate(hammer)
    draws(percussion_off_on, found, tmp_path)
    piston_momentum_balances(found)
    times = found["time"]
    off = (times > percussion_off_on.OFF + 1e-9) & (times <= percussion_off_on.ON + 1e-9)
    assert np.all(found["casing_force"][off] == 0.0)
    assert np.all(found["casing_force"][~off & (times > 0)] != 0.0)
    assert np.ptp(found["casing.impulse"][off]) == 0.0
    # feed and weight are all that is left on the rock in the end
    still = (times > percussion_off_on.ON - 0.2) & off
    weight = 2500.0 + (SCENE.bit.mass + MASS) * GRAVITY
    mean = np.mean(found["bit.force_mean"][still])
    assert mean == pytest.approx(weight, rel=0.01)
    assert at(found, "rate_of_penetration", percussion_off_on.ON) < 2e-3
    before = at(found, "rate_of_penetration", percussion_off_on.OFF)
    assert found["rate_of_penetration"][-1] == pytest.approx(before, rel=1e-3)


@pytest.fixture(scope="module")
def air_hammer(tmp_path_factory):
    """The FMU with chambers of air."""
    path = tmp_path_factory.mktemp("air") / "AirHammer.fmu"
    compressor_too_small.build_hammer_of_air(path)
    return path


def test_compressor_too_small(air_hammer, fmus, tmp_path):
    """It settles where the hammer takes what is given, as at that pressure without a limit."""
    runs = compressor_too_small.simulate(air_hammer, fmus / "Supply.fmu")
    assert compressor_too_small.draw(runs, tmp_path / "small.png").stat().st_size > 20_000
    ample, small = map(compressor_too_small.numbers, runs.values())
    given = compressor_too_small.SHARE * ample["air"]
    assert small["air"] == pytest.approx(given, rel=0.01)
    for name, found in zip(("as much", "70 %"), (ample, small), strict=True):
        scene = with_chambers("dth5", found["pressure"])
        blows = simulate(scene, 2.0, settle=1.0).counted
        assert found["frequency"] == pytest.approx(1.0 / blows["period"].mean(), rel=0.01), name
        assert found["velocity"] == pytest.approx(blows["impact_velocity"].mean(), rel=0.01), name
    # an independent model of this hammer, bit at rest: 25.8 Hz, 10.7 m/s
    assert small["frequency"] == pytest.approx(25.8, rel=0.04)
    assert small["velocity"] == pytest.approx(10.7, rel=0.04)
    for found in runs.values():  # all air is somewhere
        stored = found["air_stored"] - found["air_stored"][0]
        gone = found["pneumatic.consumed"] + found["air_lost"] - found["air_given"]
        np.testing.assert_allclose(stored + gone - gone[0], 0.0, atol=1e-9)


def test_hammer_at_altitude(air_hammer, fmus, tmp_path):
    """Gauge pressure decides; air taken in goes with that of the place, as work by its log."""
    found = hammer_at_altitude.simulate(air_hammer, fmus / "Supply.fmu", (0.0, 3000.0))
    assert hammer_at_altitude.draw(found, tmp_path / "high.png").stat().st_size > 20_000
    thin = hammer_at_altitude.atmosphere(3000.0)[0]
    assert thin == pytest.approx(70_108.0, rel=1e-4)  # ISO 2533
    ratio = {name: column[1] / column[0] for name, column in found.items() if name != "height"}
    # an independent model of this hammer: 0.6 % less air, equal power
    assert ratio["air"] == pytest.approx(1.0 - 0.006, abs=0.003)
    assert ratio["power"] == pytest.approx(1.0, abs=0.01)
    assert ratio["intake"] == pytest.approx(ratio["air"] * 101_325.0 / thin, rel=5e-3)
    work = [math.log((24e5 + around) / around) for around in (101_325.0, thin)]
    assert ratio["compressor"] == pytest.approx(ratio["air"] * work[1] / work[0], rel=5e-3)


def test_a_signal_is_held_from_the_start_of_each_step(make):
    signal = ramp((0.0, 1000.0), (0.1, 3000.0))
    assert (signal(-1.0), signal(0.05), signal(1.0)) == (1000.0, 2000.0, 3000.0)
    found = run(make(feed_force=1000.0), 0.19, 0.01, {"feed_force": signal}, ["bit.position"])
    other = make(feed_force=1000.0)
    for k in range(19):
        other.time = 0.01 * k
        other.set({"feed_force": signal(other.time)})
        other.step(0.01)
    assert found["bit.position"][-1] == other.get("bit.position")


@pytest.fixture
def scenario(monkeypatch, tmp_path, capsys):
    """The command of a scenario, in a folder of its own: code, and what it said on stderr."""
    monkeypatch.chdir(tmp_path)

    def call(module, *words):
        name = module.__name__.removeprefix("scenarios.")
        monkeypatch.setattr("sys.argv", ["scenario", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            harness.command_line(name, module.simulate, module.TITLE, module.PANELS)
        return ended.value.code, capsys.readouterr().err

    return call


def test_each_scenario_has_a_folder_and_does_not_replace_what_another_hammer_gave(
    scenario, hammer, rigid, monkeypatch
):
    monkeypatch.setattr(pressure_loss, "DURATION", 0.1)
    for _ in range(2):
        code, said = scenario(pressure_loss, hammer)
        assert (code, "holds" in said) == (0, False)
    folder = Path("out/scenarios/pressure_loss")
    assert {one.name for one in folder.iterdir()} == {"pressure_loss.png", ORIGIN}
    assert f"wrote {folder / 'pressure_loss.png'}" in said
    made_by = json.loads((folder / ORIGIN).read_text())["made_by"]
    assert made_by["command"] == "python -m scenarios.pressure_loss"
    before = (folder / "pressure_loss.png").read_bytes()
    # a folder of the scenario's own is numbered, one that is named is kept
    code, said = scenario(pressure_loss, rigid)
    assert (code, "this one goes to out/scenarios/pressure_loss-2" in " ".join(said.split())) == (
        0, True,
    )  # fmt: skip
    code, said = scenario(pressure_loss, rigid, "--out", folder)
    assert code == BAD_INPUT
    assert said.startswith(f"scenarios.pressure_loss: {folder} holds another result (")
    assert said.count("\n") == 1
    assert (folder / "pressure_loss.png").read_bytes() == before
    assert scenario(pressure_loss, rigid, "--out", folder, "--force")[0] == 0
    assert (folder / "pressure_loss.png").read_bytes() != before
    code, said = scenario(collaring_ramp, hammer, "--out", folder)
    assert code == BAD_INPUT
    assert "holds the result of `python -m scenarios.pressure_loss`" in said


def test_what_a_scenario_cannot_run_is_one_line(scenario, fmus, tmp_path):
    (tmp_path / "text.fmu").write_text("text")
    for words, told in (
        (["none.fmu"], "none.fmu: no such file"),
        (["text.fmu"], "text.fmu: is no FMU: there is no modelDescription.xml in it"),
        ([fmus / "Supply.fmu"], "the FMU has no output bit.force_mean"),
        (["--fast"], "unrecognized arguments: --fast; see python -m scenarios.constant_reference"),
    ):
        code, said = scenario(constant_reference, *words)
        assert code == BAD_INPUT
        assert said.startswith(f"scenarios.constant_reference: {told}"), said
        assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_what_an_fmu_refuses_is_told_by_its_log(rigid):
    with (
        pytest.raises(ScenarioError, match=r"rock\.loading_stiffness = -1\.0 N/m: must be"),
        Instance(rigid) as one,
    ):
        one.start(rock__loading_stiffness=-1.0)


def test_interrupted_scenarios_say_so(scenario, hammer, monkeypatch):
    def stop(*paths):
        raise KeyboardInterrupt

    stop.__module__ = pressure_loss.__name__
    monkeypatch.setattr(pressure_loss, "simulate", stop)
    code, said = scenario(pressure_loss, hammer)
    assert code == INTERRUPTED
    assert said == "scenarios.pressure_loss: interrupted before there was a result\n"


# What `python -m` does, with one start for both calls.
BOTH = """
import runpy, sys
name = sys.argv.pop()
for word in ("--help", "none.there"):
    sys.argv[1:] = [word]
    try:
        runpy.run_module(name, run_name="__main__", alter_sys=True)
    except SystemExit as ended:
        print(word, "ended with", ended.code)
"""


@pytest.mark.parametrize("name", SCRIPTS)
def test_every_scenario_has_the_same_words(name, tmp_path):
    """As a person types them, with the clone on the path."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}
    command = [sys.executable, "-c", BOTH, f"scenarios.{name}"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    for word in (f"python -m scenarios.{name}", "--out DIR", f"out/scenarios/{name}", "--force"):
        assert word in done.stdout
    ends = f"--help ended with 0\nnone.there ended with {BAD_INPUT}\n"
    assert done.stdout.endswith(ends)
    assert done.stderr == f"scenarios.{name}: none.there: no such file\n"
    assert list(tmp_path.iterdir()) == []
