"""Random chains of bars: what must hold of any of them.

Sixty in the suite; PERCUSSION_LONG=1 draws two thousand.
"""

from __future__ import annotations

import math
import os
import pickle
from typing import Any

import numpy as np
import pytest

from percussion_model import Scene, SceneError, Simulation
from percussion_model.physics.records import EventKind
from percussion_model.solvers.base import make_solver
from percussion_model.solvers.wave.records import Bar, Body, Fit, Has, Joint, Place, Steel
from percussion_model.solvers.wave.sections import kept_of
from tests.engine_views import chain_of
from tests.properties.source import Generator, Source, chance, decades
from tests.state_bits import run_bits

SEED = 20261125
COUNT = 2000 if os.environ.get("PERCUSSION_LONG") == "1" else 60
BATCHES = 10
# Of the energy that was put in: rounding of some thousand steps.
MOST_RESIDUAL = 1e-9
# Of the largest momentum or impulse; a reading at a grid point is 1e-6 steps late.
MOST_MOMENTUM = 1e-8
# Of the largest force: rounding.
ROUNDING = 1e-9
STEPS = 3000
C0 = math.sqrt(210e9 / 7850.0)


# -------------------------------------------------------------------------------- drawing


def draw_sections(source: Source, shortest: float) -> list[dict[str, float]]:
    """One to six sections; few of them short, a few of another material."""
    found = []
    for _ in range(source.count(1, 6)):
        one = {
            "length": decades(source, shortest, 0.6),
            "area": decades(source, 3e-4, 2e-2),
        }
        if chance(source, 20):
            one |= {"youngs_modulus": 70e9, "density": source.between(2000.0, 5000.0)}
        found.append(one)
    return found


def draw_joint(source: Source) -> dict[str, Any]:
    kind = source.pick(("perfect", "contact", "lossy", "threaded"))
    joint: dict[str, Any] = {"joint": kind}
    if kind == "lossy":
        joint["transmission"] = source.pick((1.0, source.between(0.01, 0.99)))
        joint["relaxation"] = decades(source, 1e-6, 1e-1)
    if kind in ("contact", "threaded") and chance(source, 50):
        joint["gap"] = decades(source, 1e-6, 1e-2)
    if kind == "threaded":
        joint["preload"] = source.pick((0.0, decades(source, 1e2, 1e6)))
        joint["thread_stiffness"] = source.pick((0.0, decades(source, 1e5, 1e10)))
    return joint


def draw_power(source: Source) -> dict[str, Any]:
    """A power law, which may chip, of one button or several."""
    return {
        "loading_exponent": source.between(1.0, 4.0),
        "reference_penetration": decades(source, 1e-6, 1.0),
        "unloading_exponent": source.pick((0.0, source.between(0.0, 12.0))),
        "buttons": source.count(1, 30),
        "chipping_force": decades(source, 1.0, 1e7),
        "chipping_penetration": source.pick((0.0, decades(source, 1e-6, 1.0))),
    }


def draw_scene(source: Source) -> Scene:
    """A chain of two to eight bars."""
    model = source.pick(("elastic", "elastic", "rigid", "absent"))
    shortest = source.pick((0.1, 0.1, 0.01))
    count = source.count(3 if model != "absent" else 2, 8)
    bars: list[dict[str, Any]] = [
        {"sections": draw_sections(source, shortest)} for _ in range(count)
    ]
    first = 0 if model == "absent" else 1
    for bar in bars[first:-1]:
        bar |= draw_joint(source)
    groups: dict[str, Any] = {}
    effects = {
        "gravity": chance(source, 50),
        "feed": chance(source, 60),
        "loss": chance(source, 50),
        "rock": source.pick(("bilinear", "power", "power", "spring", "wall", "none")),
        "damper": chance(source, 40),
        "joints": not chance(source, 5),
        "drive": "none",
    }
    if effects["rock"] in ("bilinear", "power"):
        effects["barrier"] = chance(source, 50)
        effects["cuttings"] = chance(source, 40)
    start = {
        "bit_velocity": source.pick((0.0, source.between(-2.0, 2.0))),
        "rock_gap": source.pick((0.0, 1e-5, 1e-3)),
    }
    string: dict[str, Any] = {"bottom": source.pick(("rock", "rock", "rock", "open"))}
    if model == "absent":
        groups["piston"] = {"model": "absent"}
        string["top"] = source.pick(("free", "open"))
        string["pulse_force"] = source.between(-3e5, 3e5)
        string["pulse_duration"] = decades(source, 1e-6, 1e-3)
    else:
        bars[0]["model"] = model
        effects["drive"] = source.pick(("pressure", "external", "none"))
        start["piston_velocity"] = source.between(-3.0, 12.0)
        start["gap"] = source.pick((0.0, 1e-5, 1e-3))
    if effects["damper"]:
        groups["damper"] = {
            "stiffness": source.pick((0.0, decades(source, 1e4, 1e8))),
            "damping": source.pick((0.0, decades(source, 1e2, 1e5))),
            "preload": source.pick((0.0, decades(source, 1e2, 1e5))),
            "casing_mass": decades(source, 20.0, 1e3),
        }
    if effects["loss"]:
        groups["loss"] = {"time": decades(source, 1e-9, 1e-6)}
    if effects["rock"] in ("bilinear", "power", "spring"):
        groups["rock"] = {"loading_stiffness": decades(source, 1e6, 1e10)}
    if effects["rock"] == "power":
        groups["rock"] |= draw_power(source)
    if effects.get("cuttings"):
        groups["rock"] |= {
            "removed_share": source.between(0.0, 1.0),
            "removal_exponent": source.pick((1.0, source.between(0.0, 4.0))),
            "removed_by": source.pick(("blow", "cycle")),
        }
    if chance(source, 50):
        groups["solver"] = {"cells": round(source.between(2.0, 40.0))}
    if effects["feed"]:
        groups["feed"] = {"force": source.between(-2e3, 1e4)}
    groups |= {"bars": bars, "effects": effects, "start": start, "string": string}
    scene = Scene(run={"settle": 0.0}, **groups)
    try:
        make_solver(scene)
    except SceneError as error:  # cells too fine for the loss: said, and by the default mended
        if "fewer solver.cells" not in str(error):
            raise
        scene = scene.replace(**{"solver.cells": None})
    return scene


# ---------------------------------------------------------------------------- what must hold


def put_in(simulation: Simulation, ledger: dict[str, float]) -> float:
    """Energy that was put in, by start, works, incident waves and preloaded joints [J]."""
    works = sum(abs(ledger[name]) for name in ("drive", "feed", "gravity", "ends"))
    return abs(ledger["initial"]) + works + abs(ledger["elastic"])


def check_ledger(simulation: Simulation) -> float:
    """Nothing is unexplained, and nothing that only takes has given.

    Returns
    -------
    float
        The residual by the energy put in.
    """
    ledger = simulation.energy()
    for name, value in ledger.items():
        assert name.endswith("_relative") or math.isfinite(value), f"ledger: {name} = {value}"
    scale = put_in(simulation, ledger)
    if scale == 0.0:
        return 0.0
    residual = abs(ledger["residual"]) / scale
    assert residual < MOST_RESIDUAL, f"residual {residual:.3g} of {scale:.3g} J"
    taking = ["crushing", "barrier", "standstill", "contact"]
    if not simulation.scene.effects.damper:
        taking.append("joints")
    for name in taking:
        assert ledger[name] >= -ROUNDING * scale, f"{name} = {ledger[name]} of {scale:.3g} J"
    late = half_arrived(simulation)
    for name in ("loss", "numerical"):
        least = -late - ROUNDING * scale
        assert ledger[name] >= least, f"{name} = {ledger[name]}, late {late:.3g} of {scale:.3g} J"
    return residual


def under_way(simulation: Simulation, k: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Waves of a section by their age.

    Returns
    -------
    waves : ndarray, shape (2, n)
        Without what body forces gave [m/s].
    left : ndarray, shape (n,)
        Share of each that has not arrived.
    late : int
        First age of which a share may have arrived.
    """
    chain, step = chain_of(simulation.solver), int(simulation._state.record[0]["step"])
    place, rings = chain.places[k], simulation._state.arrays[3][0]
    taps, delay, size = place[Place.TAPS], place[Place.DELAY], place[Place.SIZE]
    weights = chain.weights[0, place[Place.WEIGHTS] : place[Place.WEIGHTS] + taps][::-1]
    left = 1.0 - np.concatenate([np.zeros(delay + 1), np.cumsum(weights)])[: delay + taps]
    ages = (step - np.arange(delay + taps)) & (size - 1)
    first = place[Place.RING]
    return np.stack([rings[first + ages], rings[first + 2 * size + ages]]), left, int(delay)


def half_arrived(simulation: Simulation) -> float:
    """Energy of waves of which a part has arrived [J].

    Weights that let no frequency grow take no less than nothing once all has arrived; before,
    by as much too little.
    """
    solver, total = simulation.solver, 0.0
    for k in range(len(chain_of(solver).places)):
        waves, left, late = under_way(simulation, k)
        z = chain_of(solver).steel[k, Steel.IMPEDANCE]
        share = np.maximum(left[late:], 0.0)
        total += z * solver.time_step * float((waves[:, late:] ** 2 @ share).sum())
    return total


def check_joints(simulation: Simulation) -> None:
    """Shoulders never overlap, and none pulls harder than its thread; looks at one more step."""
    solver, joints = simulation.solver, simulation._state.arrays[1]
    before = joints[[Has.CLOSED, Has.GAP]].copy()
    step = int(simulation._state.record[0]["step"])
    simulation.advance((step + 1) * solver.time_step)
    scale = max(1.0, np.abs(joints[Has.FORCE]).max(), np.abs(joints[Has.LEAST]).max())
    for j, fit in enumerate(chain_of(solver).fits):
        if fit[Fit.KIND] not in (Joint.CONTACT, Joint.THREADED):
            continue
        gap, closed, force = joints[Has.GAP, j], joints[Has.CLOSED, j], joints[Has.FORCE, j]
        assert gap >= 0.0, f"joint {j}: gap {gap}"
        assert closed in (0.0, 1.0)
        assert closed == 0.0 or gap == 0.0, f"joint {j}: closed with gap {gap}"
        most = fit[Fit.PRELOAD] + ROUNDING * scale
        if fit[Fit.STIFFNESS] == 0.0:
            pull = -joints[Has.LEAST, j]
            assert pull <= most, f"joint {j}: pull of {pull} N"
        if closed == before[0, j] == 1.0:
            assert -force <= most, f"joint {j}: closed under a pull of {-force} N"
        if closed == before[0, j] == 0.0:  # its thread alone pulls
            gaps = sorted((gap, before[1, j]))
            pulls = [fit[Fit.PRELOAD] + fit[Fit.STIFFNESS] * one for one in gaps]
            slack = ROUNDING * max(scale, pulls[1])
            assert pulls[0] - slack <= -force <= pulls[1] + slack, f"joint {j}: open at {force} N"


def check_finite(simulation: Simulation) -> None:
    """All fields and samples that are defined are finite."""
    for name, values in simulation.fields().items():
        assert np.all(np.isfinite(values)), f"{name} not finite"
    seen = simulation.observe()
    absent = ("piston_position", "piston_velocity", "gap", "relative_displacement")
    for name, value in seen.items():
        if simulation.scene.piston.model != "absent" or name not in absent:
            assert math.isfinite(value), f"{name} = {value}"
    scale = max(1.0, *(np.abs(values).max() for values in simulation.fields().values()))
    for name in ("bit_force", "contact_force"):
        assert seen[name] >= -ROUNDING * scale, f"{name} = {seen[name]} N"


class Balance:
    """Momentum of all bodies, and what outer forces have given; of waves alike."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.first, self.largest = self.moving(), 0.0

    def moving(self) -> float:
        """Momentum of bars, rigid piston and casing [N s]."""
        solver, s = self.simulation.solver, self.simulation._state.record[0]
        total = (
            chain_of(solver).bodies[:, Body.MASS] @ self.simulation._state.arrays[0][Bar.VELOCITY]
        )
        # loss adds to the force of waves what they give later
        par = solver._par[0]
        late = par["viscous"] * par["dt"]
        total -= late * s["g_rock"]
        if self.simulation.scene.piston.model == "rigid":
            total += late * s["g_contact"] + s["v_p"] * self.simulation.scene.piston.mass
        if self.simulation.scene.effects.damper:
            total += s["v_c"] * self.simulation.scene.damper.casing_mass
        return float(total)

    def check(self) -> None:
        """Where no end is open the impulses of feed, weight and rock have changed it."""
        simulation = self.simulation
        scene, state = simulation.scene, simulation._state
        s, t = state.record[0], simulation.solver.time(state)
        mass = chain_of(simulation.solver).bodies[:, Body.MASS].sum()
        if scene.piston.model == "rigid":
            mass += scene.piston.mass
        weight = mass * scene.gravity.acceleration if scene.effects.gravity else 0.0
        feed = scene.feed.force if scene.effects.feed else 0.0
        parts = [weight * t, feed * t, -s["i_bit"]]
        if scene.effects.drive != "none" and not scene.effects.damper:
            parts.append(s["i_drive"])  # its recoil is borne by the casing, if there is one
        moving = self.moving()
        self.largest = max(self.largest, abs(moving), *map(abs, parts))
        off = moving - self.first - sum(parts)
        slack = MOST_MOMENTUM * self.largest
        if scene.effects.drive == "pressure" and scene.effects.damper:
            # a step in which the drive turns (test_recoil_is_the_opposite_of_the_drive)
            turns = np.count_nonzero(simulation.events["kind"] >= EventKind.DRIVE_UP)
            slack += 2.0 * scene.drive.force * simulation.solver.time_step * turns
        assert abs(off) <= slack, f"momentum off by {off} of {self.largest}"


def kept_momentum(simulation: Simulation, k: int) -> float:
    """Momentum by Z dt of what a section of one to two steps keeps apart from its ring [m/s]."""
    places, rings = chain_of(simulation.solver).places[k], simulation._state.arrays[-1][0]
    first = int(places[Place.RING] + 4 * places[Place.SIZE])
    return float(kept_of(chain_of(simulation.solver), k) * rings[first : first + 2].sum())


def check_waves(simulation: Simulation) -> None:
    """What of its waves has not arrived is the momentum of a bar, where no body force is on."""
    scene, solver, state = simulation.scene, simulation.solver, simulation._state
    on = (scene.effects.gravity, scene.effects.feed, scene.effects.damper)
    if any(on) or scene.effects.drive != "none":
        return
    bodies, velocities = chain_of(solver).bodies, state.arrays[0][Bar.VELOCITY]
    for body, velocity in zip(bodies, velocities, strict=True):
        found = scale = 0.0
        for k in range(int(body[Body.FIRST]), int(body[Body.LAST]) + 1):
            waves, left, _ = under_way(simulation, k)
            z = chain_of(solver).steel[k, Steel.IMPEDANCE] * solver.time_step
            found += z * float((waves @ left).sum()) + z * kept_momentum(simulation, k)
            scale += z * float(np.abs(waves).sum())
        off = abs(found - body[Body.MASS] * velocity)
        slack = MOST_MOMENTUM * scale + 1e-12 * body[Body.MASS]
        assert off <= slack, f"waves of a bar: off by {off} of {scale}"


def check_chain(index: int, steps: int = STEPS) -> float:
    """Draw a chain and check all that must hold; its largest residual."""
    source = Generator(SEED, index)
    scene = draw_scene(source)
    simulation = Simulation(scene)
    step = simulation.solver.time_step
    assert step is not None
    count = min(steps, int(3e6 / max(1, 20 * sum(simulation.solver.cells.values()))) + 200)
    end = count * step
    start = simulation.save()
    balance = Balance(simulation)
    residual = 0.0
    for share in sorted(source.between(0.0, 1.0) ** 3 for _ in range(8)):
        simulation.advance(max(share * (end - step), simulation.time))
        residual = max(residual, check_ledger(simulation))
        check_joints(simulation)
        check_finite(simulation)
        check_waves(simulation)
        if scene.string.bottom == "rock" and scene.piston.model != "absent":
            balance.check()
    middle = pickle.loads(pickle.dumps(simulation.save()))
    simulation.advance(end)
    residual = max(residual, check_ledger(simulation))
    check_finite(simulation)
    last = run_bits(simulation)
    simulation.restore(middle)
    simulation.advance(end)
    assert run_bits(simulation) == last, "a restored run gave other bits"
    simulation.restore(start)
    simulation.advance(end)
    assert run_bits(simulation) == last, "one advance gave other bits than several"
    return residual


@pytest.mark.parametrize("batch", range(BATCHES))
def test_random_chains(batch):
    """Finite, balanced, no tension where nothing holds, the same bits however divided."""
    faults = []
    for index in range(batch, COUNT, BATCHES):
        try:
            check_chain(index)
        except Exception as fault:
            faults.append(f"chain {index}: {type(fault).__name__}: {str(fault).splitlines()[0]}")
    assert not faults, "\n".join(faults)
