"""Random scenes and random calls, drawn from any source of choices."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from percussion_model import Scene, SceneError
from percussion_model.scene.bars import bar_transit_time, section_transit_time
from percussion_model.scene.inputs import INPUTS, no_effect_reason
from percussion_model.scene.numbers import section_numbers
from percussion_model.scene.parameters import find_row
from percussion_model.solvers.base import make_solver
from tests.properties.source import Source, chance, decades

# Bounds of "wide": low and high of the amount, by decades, and what else may come.
BOTH_SIGNS, ZERO = "both signs", "zero"
WIDE: dict[str, tuple[Any, ...]] = {
    "gravity.acceleration": (1e-3, 100.0, BOTH_SIGNS, ZERO),
    "feed.force": (1.0, 1e5, BOTH_SIGNS, ZERO),
    "drive.force": (10.0, 1e5, ZERO),
    "drive.reversal_distance": (1e-4, 1.0),
    "drive.external_force": (1.0, 1e5, BOTH_SIGNS, ZERO),
    "loss.time": (1e-10, 1e-5, ZERO),
    "rock.loading_stiffness": (1e4, 1e11),
    "rock.unloading_ratio": (1.0 + 1e-9, 1000.0),
    "rock.barrier_damping": (1.0, 1e7, ZERO),
    "rock.barrier_energy": (1e-9, 100.0, ZERO),
    "rock.loading_exponent": (1.0, 4.0),
    "rock.reference_penetration": (1e-6, 1.0),
    "rock.unloading_exponent": (1e-3, 12.0, ZERO),
    "rock.buttons": (1.0, 1000.0),
    "rock.chipping_force": (1.0, 1e9),
    "rock.chipping_penetration": (1e-9, 1.0, ZERO),
    "rock.removed_share": (1e-6, 1.0, ZERO),
    "rock.removal_exponent": (1e-3, 4.0, ZERO),
    "contact.restitution": (1e-6, 1.0, ZERO),
    "start.piston_velocity": (1e-12, 30.0, BOTH_SIGNS, ZERO),
    "start.bit_velocity": (1e-12, 30.0, BOTH_SIGNS, ZERO),
    "start.gap": (1e-15, 0.1, ZERO),
    "start.rock_gap": (1e-15, 0.1, ZERO),
    "start.depth": (1e-3, 1e4, ZERO),
    "fem.courant": (0.1, 50.0),
    "fem.contact_stiffness": (1e9, 1e15),
    "fem.damping_ratio": (1e-3, 10.0, ZERO),
    "fem.spectral_radius": (1e-3, 1.0, ZERO),
    "fem.event_tolerance": (1e-12, 0.1),
    "fem.time_tolerance": (1e-9, 0.1),
}
# Of the advance by breaking, a bit that turns and the casing, which are drawn last: what is drawn
# before stays what it was without them.
ADVANCE: dict[str, tuple[Any, ...]] = {
    "hole_diameter": (1e-3, 10.0),
    "feed.casing_mass": (1e-2, 1e4, ZERO),
    "breaking.buttons": (1.0, 1000.0),
    "breaking.crushing_energy": (1e3, 1e11, ZERO),
    "breaking.threshold": (1e-6, 1e5, ZERO),
    "breaking.efficiency": (1e-6, 1.0, ZERO),
    "breaking.wear_length": (1e-6, 1e5, ZERO),
    "breaking.worn": (1e-3, 1.0, ZERO),
    "breaking.drilled": (1e-6, 1e5, ZERO),
    "breaking.flushed_volume": (1e-12, 1.0, ZERO),
    "rotation.speed": (1e-6, 1e4, ZERO),
    "rotation.mean_radius": (1e-4, 10.0),
    "rotation.renewal_length": (1e-6, 1.0, ZERO),
    "rotation.friction": (1e-4, 10.0, ZERO),
    "rotation.stall_torque": (1e-3, 1e8, ZERO),
    "rotation.full_torque": (1e-3, 1e8, ZERO),
    "rotation.response": (1e-6, 1e3, ZERO),
}
# Of chambers of air, drawn after that.
AIR: dict[str, tuple[Any, ...]] = {
    "pneumatic.supply_pressure": (1e3, 1e7, ZERO),
    "pneumatic.supply_volume": (1e-5, 1.0, ZERO),
    "pneumatic.supply_flow": (1e-4, 10.0, ZERO),
    "pneumatic.lower_volume": (1e-5, 1e-2),
    "pneumatic.upper_intake_edge": (1e-3, 0.2, ZERO),
    "pneumatic.upper_exhaust": (1e-6, 1e-2, ZERO),
    "pneumatic.leak": (1e-8, 1e-4, ZERO),
    "pneumatic.ramp": (1e-6, 1e-2),
    "pneumatic.wall_conductance": (1e-3, 1e3, ZERO),
}
# Of chambers of oil, drawn after that.
OIL: dict[str, tuple[Any, ...]] = {
    "hydraulic.flow": (1e-5, 1e-2, ZERO),
    "hydraulic.supply_pressure": (1e5, 5e7, ZERO),
    "hydraulic.rear_volume": (1e-6, 1e-3),
    "hydraulic.spool_mass": (1e-3, 10.0),
    "hydraulic.air": (1e-5, 0.3, ZERO),
    "hydraulic.precharge": (1e5, 5e7),
}
# Of a string that twists, drawn last of all.
STRING: dict[str, tuple[Any, ...]] = {
    "rotation.string_stiffness": (1e-3, 1e9),
    "rotation.inertia": (1e-6, 1e3),
}
# Of a casing that takes the feed, drawn after that.
SHOULDER: dict[str, tuple[Any, ...]] = {
    "shoulder.casing_mass": (1e-1, 1e4),
    "shoulder.stiffness": (1e4, 1e9),
    "shoulder.damping": (1e-1, 1e6, ZERO),
    "shoulder.impedance": (1e2, 1e7, ZERO),
}
BOUNDS = WIDE | ADVANCE | AIR | OIL | STRING | SHOULDER
SWITCHES = ("effects.breaking", "effects.rotation")
# What a scene with breaking or rotation has to be given.
NO_DEFAULT = ("hole_diameter", "breaking.buttons", "rotation.mean_radius")
BY_SOLVER = {"wave": "solver", "fem": "fem", "rigid": "contact"}
SECTION = {
    "length": (0.005, 5.0),
    "area": (1e-5, 0.1),
    "youngs_modulus": (1e8, 1e12),
    "density": (300.0, 3e4),
}
NEAR = 2.0  # "near" is the default by or over this


def number(source: Source, key: str, reach: str) -> float | None:
    """A value for a key: its default, near it, wide, or anything that the table allows."""
    row = find_row(key)
    assert row is not None
    value = any_number(source, key, row, reach)
    return value if row.kind != "whole number" or value is None else round(value)


def any_number(source: Source, key: str, row: Any, reach: str) -> float | None:
    """The same before a count is made whole."""
    kind = source.pick(("default", "near", "wide", "wide", "bound" if reach == "any" else "near"))
    if kind == "default":
        return row.default
    low, high, *more = BOUNDS[key]
    if kind == "near" and row.default:
        value = row.default * NEAR ** source.between(-1.0, 1.0)
        return value if row.allows(value) else row.default
    if kind == "bound":
        value = any_allowed(source, row)
    elif ZERO in more and chance(source, 15):
        return 0.0
    else:
        value = decades(source, low, high)
        if BOTH_SIGNS in more and source.pick((False, True)):
            value = -value
    return value if row.allows(value) else row.default


def any_allowed(source: Source, row: Any) -> float:
    """A bound, the smallest number above it, a denormal, or anything up to the bound."""
    smallest = np.nextafter(row.lower, math.inf) if row.lower_open else row.lower
    top = max(abs(row.upper), 1e-6)
    tiny = 5e-324 if smallest <= 0.0 else float(smallest)
    options = (float(smallest), float(row.upper), tiny, decades(source, 1e-12 * top, top))
    return float(source.pick(options))


def sections(source: Source, reach: str, base: float) -> list[dict[str, float]]:
    """One to four sections."""
    found = []
    for _ in range(source.pick((1, 1, 1, 2, 3, 4))):
        section = {"length": base, "area": 5.5e-3}
        for name, (low, high) in SECTION.items():
            kind = source.pick(
                ("default", "default", "near", "wide" if reach != "near" else "near")
            )
            start = section.get(name, find_row(f"bit.sections.*.{name}").default)
            if kind == "near":
                section[name] = start * NEAR ** source.between(-1.0, 1.0)
            elif kind == "wide":
                section[name] = decades(source, low, high)
        found.append(section)
    return found


# Most cells and steps of a case, so that it takes some ten milliseconds.
MOST_CELLS = 48
MOST_CELL_STEPS = 2e5
MOST_STEPS = 20_000
# Rock met again springs back whole, so that a light bit without a barrier rings on, with two
# events in each turn [s].
LONGEST_RINGING = 0.1


@dataclass
class Case:
    """A scene and the calls that are made on it.

    Attributes
    ----------
    scene : Scene
    length : float
        Simulated time [s].
    calls : list
        (share of the length, what, argument), in the order of time.
    reach : str
        How far from the reference scene its numbers lie: "near", "wide" or "any".
    """

    scene: Scene
    length: float
    calls: list[tuple[float, str, Any]]
    reach: str

    @property
    def changes(self) -> set[str]:
        """Inputs that change at some time."""
        found: set[str] = set()
        for _, what, argument in self.calls:
            if what == "inputs":
                found |= set(argument)
            elif what == "detour":
                found |= set(argument[1])
        return found


def draw_case(source: Source, reaches: tuple[str, ...] = ("near", "wide", "wide", "wide")) -> Case:
    """A scene with calls; `SceneError` where the parts contradict each other."""
    reach = source.pick(reaches)
    scene = draw_scene(source, reach)
    length = draw_length(source, scene)
    # no run of this kind looks at these, but they must fit each other
    scene = scene.replace(**{"run.duration": min(max(length, 1e-300), 1e6), "run.settle": 0.0})
    calls = draw_calls(source, scene, reach)
    scene = with_advance(source, scene, reach)
    if scene.effects.drive in ("pneumatic", "hydraulic"):  # drawn last: inputs of its like are void
        calls = [call for call in calls if call[1] not in ("inputs", "detour")]
    if scene.effects.rotation and chance(source, 50):
        speed = number(source, "rotation.speed", reach)
        calls.append((source.between(0.0, 1.0), "inputs", {"rotation_speed": speed}))
    if scene.effects.rotation and scene["rotation.old_line"]:
        length = min(length, LONGEST_RINGING)
    return Case(scene, length, sorted(calls, key=lambda call: call[0]), reach)


def draw_scene(source: Source, reach: str) -> Scene:
    """Any scene whose parts fit each other."""
    solver = source.pick(("wave", "wave", "fem", "rigid"))
    changes: dict[str, Any] = {
        "solver.name": source.pick((solver, solver, "fem" if solver == "fem" else "auto"))
    }
    usual = "rigid" if solver == "rigid" else "elastic"
    piston = source.pick((usual, usual, usual, usual, "rigid", "absent"))
    changes["piston.model"] = piston
    changes["bit.model"] = "rigid" if solver == "rigid" else "elastic"
    if solver == "rigid" and chance(source, 25):  # rigid bodies in place of elastic ones
        changes |= {"solver.name": "auto", "solver.fidelity": "rigid", "bit.model": "elastic"}
    drives = ("none",) if piston == "absent" else ("pressure",) * 4 + ("external", "none")
    changes["effects.drive"] = source.pick(drives)
    rocks = ("bilinear",) * 4 + ("power",) * 4 + ("spring", "wall", "none")
    changes["effects.rock"] = source.pick(rocks)
    for name in ("gravity", "feed", "loss", "barrier"):
        changes[f"effects.{name}"] = not chance(source, 15)
    is_crushed = changes["effects.rock"] in ("bilinear", "power")
    changes["effects.cuttings"] = is_crushed and chance(source, 40)
    if not is_crushed:
        changes["effects.barrier"] = False
    changes["effects.standstill_tension"] = source.pick(("release", "paper"))
    changes["start.drive_direction"] = source.pick((1, -1))
    for key in WIDE:
        group = key.split(".")[0]
        if group in ("fem", "contact") and group != BY_SOLVER[solver]:
            continue
        if key == "contact.restitution" and piston == "absent":
            continue
        value = number(source, key, reach)
        if value is not None:
            changes[key] = value
    if not chance(source, 40):
        changes["bit.sections"] = sections(source, reach, 0.20125)
        changes["piston.sections"] = sections(source, reach, 0.175)
    changes["solver.leaps"] = not chance(source, 25)
    return with_cells(source, Scene().replace(**changes), solver)


def with_advance(source: Source, scene: Scene, reach: str) -> Scene:
    """The scene with any of breaking, rotation and a casing under the feed."""
    changes: dict[str, Any] = {"feed.on": source.pick(("bit", "casing"))}
    for key in ADVANCE:
        value = number(source, key, reach)
        if value is not None:
            changes[key] = value
        elif key in NO_DEFAULT:
            changes[key] = round(decades(source, 1.0, 100.0)) if "buttons" in key else 0.1
    if changes["rotation.stall_torque"] > 0.0:
        most = changes["rotation.stall_torque"]
        changes["rotation.full_torque"] = min(changes["rotation.full_torque"], most)
    crushed = scene.effects.rock in ("bilinear", "power")
    changes |= {key: crushed and chance(source, 50) for key in SWITCHES}
    # without a barrier nothing damps a bit on its old line, and modes list each of its turns
    rings = scene.solver_name == "modal" and not scene.barrier_on
    if scene.effects.cuttings and changes.get("effects.rotation"):  # both say what is left
        changes["rotation.renewal_length"] = 0.0
    changes["rotation.old_line"] = not (scene.effects.cuttings or rings) and chance(source, 40)
    changes["rock.removed_by"] = source.pick(("blow", "cycle"))
    for key in AIR:
        value = number(source, key, reach)
        if value is not None:
            changes[key] = value
    is_law = scene.effects.drive == "pressure"
    if is_law and chance(source, 20):
        changes["effects.drive"] = "pneumatic"
    for key in OIL:
        value = number(source, key, reach)
        if value is not None:
            changes[key] = value
    if is_law and "effects.drive" not in changes and chance(source, 20):
        changes["effects.drive"] = "hydraulic"
    if changes.get("effects.rotation") and chance(source, 40):
        for key in STRING:
            changes[key] = number(source, key, reach) or 1.0
    if chance(source, 20):
        changes["effects.shoulder"] = True
        for key in SHOULDER:
            value = number(source, key, reach)
            if value is not None:
                changes[key] = value
    return scene.replace(**changes)


def with_cells(source: Source, scene: Scene, solver: str) -> Scene:
    """Give the scene few cells or elements, so that it stays cheap."""
    if solver == "rigid":
        return scene
    key = "solver.cells" if solver == "wave" else "fem.elements"
    wanted = source.pick((1, 2, 3, 4, 5, 5, 8, 10, 20))
    while wanted > 1 and cells_of(scene, wanted) > MOST_CELLS:
        wanted = max(1, wanted // 2)
    scene = scene.replace(**{key: wanted})
    return with_loss_that_fits(scene) if solver == "wave" else scene


def with_loss_that_fits(scene: Scene) -> Scene:
    """The scene with a loss time that waves take in its sections."""
    while scene.effects.loss and scene.loss.time > 0.0:
        try:
            make_solver(scene.computed_by("wave"))
        except SceneError as error:
            if "loss.time" not in str(error):
                break
            scene = scene.replace(**{"loss.time": 0.1 * scene.loss.time})
        else:
            break
    return scene


def bars_of(scene: Scene) -> list[Any]:
    bars = [scene.piston, scene.bit] if scene.piston.model == "elastic" else [scene.bit]
    return [section_numbers(bar) for bar in bars]


def step_of(scene: Scene, wanted: int) -> float:
    """Time step where a wave crosses the first bar in so many [s]."""
    return bar_transit_time(bars_of(scene)[0]) / wanted


def cells_of(scene: Scene, wanted: int) -> int:
    step = step_of(scene, wanted)
    sections = [one for bar in bars_of(scene) for one in bar]
    return sum(max(1, round(section_transit_time(one) / step)) for one in sections)


def draw_length(source: Source, scene: Scene) -> float:
    """Simulated time, bounded by steps [s]."""
    if scene.solver_name == "rigid":
        return decades(source, 1e-4, 0.5)
    if scene.solver_name == "fem":
        wanted = scene.fem.elements
        step = scene.fem.courant * step_of(scene, wanted)
        dear = 8.0
    else:
        wanted = scene.solver.cells or 20
        step = step_of(scene, wanted)
        dear = 1.0
    steps = min(MOST_STEPS, MOST_CELL_STEPS / cells_of(scene, wanted)) / dear
    return step * decades(source, 3.0, max(steps, 10.0))


READS = ("observe", "energy", "fields", "statistics", "result", "blows", "events")


def draw_calls(source: Source, scene: Scene, reach: str) -> list[tuple[float, str, Any]]:
    """What is called and when, as shares of the length."""
    inputs = [name for name in INPUTS if not no_effect_reason(scene, name)]
    calls: list[tuple[float, str, Any]] = []
    for _ in range(source.count(1, 8)):
        share = source.between(0.0, 1.0)
        what = source.pick(("advance", "sample", "read", "detour", "pickle", "inputs"))
        argument: Any = None
        if what == "sample":
            argument = sorted(source.between(share, 1.0) for _ in range(source.count(1, 5)))
            share = argument[0]
        elif what == "read":
            argument = source.pick(READS)
        elif what == "detour":
            argument = (source.between(share, 1.0), draw_inputs(source, inputs, reach))
        elif what == "inputs":
            argument = draw_inputs(source, inputs, reach)
        calls.append((share, what, argument))
    return sorted(calls, key=lambda call: call[0])


def draw_inputs(source: Source, inputs: list[str], reach: str) -> dict[str, float]:
    """New values of up to three inputs."""
    if not inputs:
        return {}
    names = [source.pick(inputs) for _ in range(source.count(1, 3))]
    values = {name: number(source, INPUTS[name].key, reach) for name in names}
    return {name: value for name, value in values.items() if value is not None}
