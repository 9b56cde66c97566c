"""Components that are one file each, in waves, modes, elements and rigid bodies.

Added as docs/developers/extend.md does, to a copy of the package, which compiles as an installation
does. Waves, modes and elements run as plain Python, which spares a minute of compiling, but with
PERCUSSION_LONG=1.
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

HERTZ = '''
"""Loading of the rock as by a sphere, F = K_R P_0 x^1.5."""

import math

from percussion_model.components import Component
from percussion_model.physics.kernel import inlined


@inlined
def loading(par, x):
    """Force, slope and work by those of K_R at P_0."""
    root = math.sqrt(x)
    return x * root, 1.5 * root, 0.4 * x * x * root


needs = {"effects.rock": ("power",)}
COMPONENT = Component("hertz", "loading by a sphere", {}, loading=loading, needs=needs)
'''

CHAMBERS = '''
"""Two chambers in a row that fill through orifices; the second one's pressure drives the piston.

p1' = (p_s - p1) / t1, p2' = (p1 - p2) / t2, F = A p2.
"""

import math

from percussion_model.components import Component
from percussion_model.physics.kernel import inlined


@inlined
def fading(par, s, h):
    """How far the chambers are below the supply, of now and after h [Pa]."""
    t1, t2 = par.chambers_first_time, par.chambers_second_time
    far, near = s.chambers_first - par.chambers_supply, s.chambers_second - par.chambers_supply
    share = far * t1 / (t1 - t2)
    return far, near, share


@inlined
def push(par, s, h):
    """Mean force of the second chamber over h [N]."""
    t1, t2 = par.chambers_first_time, par.chambers_second_time
    far, near, share = fading(par, s, h)
    sum_1, sum_2 = -t1 * math.expm1(-h / t1), -t2 * math.expm1(-h / t2)
    return par.chambers_area * (
        par.chambers_supply + ((near - share) * sum_2 + share * sum_1) / h
    )


@inlined
def fill(par, s, h):
    """Fill both chambers for h."""
    far, near, share = fading(par, s, h)
    fade_1 = math.exp(-h / par.chambers_first_time)
    fade_2 = math.exp(-h / par.chambers_second_time)
    s.chambers_first = par.chambers_supply + far * fade_1
    s.chambers_second = par.chambers_supply + (near - share) * fade_2 + share * fade_1


COMPONENT = Component(
    "chambers",
    "two chambers that fill through orifices and push the piston",
    {
        "supply": (1e6, "Pa", "pressure of the supply", 0.0, 1e8),
        "start": (0.0, "Pa", "pressure of the first chamber at the start", 0.0, 1e8),
        "area": (2e-3, "m^2", "area of the piston's rear face", 0.0, 1.0),
        "first_time": (1e-3, "s", "in which the first chamber fills", 1e-6, 1e3),
        "second_time": (4e-4, "s", "in which the second chamber fills", 1e-6, 1e3),
    },
    on_piston=push,
    state={
        "first": ("Pa", "pressure of the first chamber", "start"),
        "second": ("Pa", "pressure of the second chamber", 0.0),
    },
    pass_time=fill,
)
'''

SWIVEL = '''
"""A mass that turns with the bit and rubs on the wall, whose screw thrusts the bit downward.

J w' = T - k w, F = T / r.
"""

import math

from percussion_model.components import Component
from percussion_model.physics.kernel import inlined


@inlined
def thrust(par, s, h):
    """Force on the bit by its torque of friction [N]."""
    rate = par.swivel_friction / par.swivel_inertia
    fade = -math.expm1(-rate * h)
    steady = par.swivel_torque / par.swivel_friction
    mean = steady + (s.swivel_speed - steady) * fade / (rate * h)
    return par.swivel_friction * mean / par.swivel_lead


@inlined
def turn(par, s, h):
    """Go on turning for h."""
    rate = par.swivel_friction / par.swivel_inertia
    steady = par.swivel_torque / par.swivel_friction
    fade, off = -math.expm1(-rate * h), s.swivel_speed - steady
    s.swivel_angle += steady * h + off * fade / rate
    s.swivel_speed -= off * fade


COMPONENT = Component(
    "swivel",
    "a mass that turns and rubs, and thrusts the bit",
    {
        "inertia": (2e-3, "kg m^2", "moment of inertia", 1e-9, 1e3),
        "friction": (1.0, "N m s", "torque of friction divided by speed", 1e-9, 1e6),
        "torque": (50.0, "N m", "that turns it", -1e6, 1e6),
        "lead": (0.1, "m", "torque divided by thrust", 1e-6, 1e3),
    },
    on_bit=thrust,
    state={
        "angle": ("rad", "angle that it has turned", 0.0),
        "speed": ("rad/s", "speed at which it turns", 0.0),
    },
    pass_time=turn,
)
'''

# A free piston and a bit that feed and components move, and a blow on the rock, on coarse grids.
RUN = """
import json, sys
from percussion_model import Scene, Simulation
drill = Scene().computed_by(sys.argv[1], **json.loads(sys.argv[2]))
alone = {"start.gap": 0.5, "start.piston_velocity": 0.0, "effects.gravity": False}
alone |= {"effects.drive": "none", "effects.rock": "none", "effects.barrier": False}
found = {}
for name, scene, end in (("alone", drill.replace(**alone), 4e-3), ("drill", drill, 2e-3)):
    simulation = Simulation(scene)
    simulation.advance(0.4 * end)
    kept = simulation.save()
    simulation.advance(end)
    found[name] = simulation.energy() | simulation.observe()
    simulation.restore(kept)
    simulation.advance(end)
    found[name]["repeats"] = found[name].items() >= (simulation.energy()).items()
print(json.dumps(found))
"""
COARSE = {
    "wave": {"solver.cells": 4},
    "modal": {"solver.cells": 8},
    "fem": {"fem.elements": 4, "fem.courant": 1.0},
    "rigid": {},
}
END = 4e-3  # of the piston and bit that move alone [s]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("with_components")
    copy = folder / "percussion_model"
    leave_out = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "percussion_model", copy, ignore=leave_out)
    for name, text in (("hertz", HERTZ), ("chambers", CHAMBERS), ("swivel", SWIVEL)):
        (copy / "components" / f"{name}.py").write_text(text)

    def run(solver, **changes):
        changes = COARSE[solver] | {"run.settle": 0.0} | changes
        kept = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
        kept["PYTHONPATH"] = os.pathsep.join((str(folder), str(ROOT)))
        kept["PERCUSSION_CACHE"] = str(folder / "cache")
        if solver != "rigid" and not LONG:
            kept["NUMBA_DISABLE_JIT"] = "1"
        command = [sys.executable, "-W", "ignore", "-c", RUN, solver, json.dumps(changes)]
        ran = subprocess.run(command, cwd=folder, env=kept, capture_output=True, text=True)
        assert ran.returncode == 0, ran.stderr
        libraries = folder / "cache" / "engine" / "libraries"
        assert len([*libraries.glob(f"{solver}-*")]) == (solver == "rigid" or LONG)
        found = json.loads(ran.stdout)
        for name, entries in found.items():
            assert abs(entries["residual_relative"]) < 1e-12, name
            assert entries["repeats"], name
        return found

    return run


@pytest.mark.slow
@pytest.mark.parametrize("solver", COARSE)
def test_a_rock_law(run, solver):
    rock = {"effects.rock": "power", "rock.loading_exponent": 1.5}
    by_power = run(solver, **rock)["drill"]
    # the exponent of the scene has no part in it
    rock |= {"effects.hertz": True, "rock.loading_exponent": 1.4}
    found = run(solver, **rock)["drill"]
    for name in ("crushing", "bit_impulse", "bit_velocity", "penetration"):
        assert found[name] == pytest.approx(by_power[name], rel=1e-6), name


@pytest.mark.parametrize("solver", COARSE)
def test_a_drive_with_two_states(run, solver):
    found = run(solver, **{"effects.chambers": True})
    alone, mass = found["alone"], percussion_model.Scene().piston.mass
    supply, area, t1, t2 = 1e6, 2e-3, 1e-3, 4e-4
    fade_1, fade_2 = math.exp(-END / t1), math.exp(-END / t2)
    second = supply * (1.0 - (t1 * fade_1 - t2 * fade_2) / (t1 - t2))
    impulse = END - (t1**2 * (1.0 - fade_1) - t2**2 * (1.0 - fade_2)) / (t1 - t2)
    assert alone["chambers_first"] == pytest.approx(supply * (1.0 - fade_1), rel=1e-10)
    assert alone["chambers_second"] == pytest.approx(second, rel=1e-10)
    assert alone["piston_velocity"] == pytest.approx(area * supply * impulse / mass, rel=1e-8)
    assert alone["drive_impulse"] == pytest.approx(area * supply * impulse, rel=1e-8)
    given = 0.5 * mass * alone["piston_velocity"] ** 2
    # the ledger is that of the last grid point
    assert alone["chambers"] == pytest.approx(-given, rel=0.02)
    assert alone["drive"] == pytest.approx(0.0, abs=1e-9 * given)


@pytest.mark.parametrize("solver", COARSE)
def test_a_mass_that_turns_and_rubs(run, solver):
    found = run(solver, **{"effects.swivel": True})
    alone, mass = found["alone"], percussion_model.Scene().bit.mass
    rate, steady = 500.0, 50.0
    fade = -math.expm1(-rate * END)
    angle = steady * (END - fade / rate)
    assert alone["swivel_speed"] == pytest.approx(steady * fade, rel=1e-10)
    assert alone["swivel_angle"] == pytest.approx(angle, rel=1e-10)
    velocity = (2500.0 * END + 10.0 * angle) / mass
    assert alone["bit_velocity"] == pytest.approx(velocity, rel=1e-8)
    assert found["drill"]["swivel_speed"] == pytest.approx(-50.0 * math.expm1(-1.0), rel=1e-10)
