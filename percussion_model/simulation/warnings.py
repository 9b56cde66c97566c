"""Warnings that a result carries: what limits the trust in its numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from percussion_model.components import DRIVES
from percussion_model.physics.oil import REFERENCE
from percussion_model.physics.records import EventKind, Mode
from percussion_model.scene.inputs import PRESSURES
from percussion_model.scene.parameters import row_of
from percussion_model.scene.rocks import read_rock
from percussion_model.scene.rocks.breaking import rock_of
from percussion_model.scene.scales import barrier_shares
from percussion_model.scene.scene import Scene
from percussion_model.simulation.means import by_volume, numbers_over
from percussion_model.simulation.rate import LARGE_ERROR, LEAST_BLOWS
from percussion_model.simulation.result import Result, end_of, flight_acceleration
from percussion_model.simulation.uncertain import in_digits
from percussion_model.simulation.validity import (
    barrier_note,
    button_note,
    flight_note,
    guard_notes,
    jam_note,
    ledger_note,
    limit_note,
    numerical_note,
    rate_note,
    recoil_note,
    specific_energy_note,
    stiffness_at,
)

# A larger error of the wave speed shows in the answers.
MOST_WAVE_SPEED_ERROR = 1e-3
# A rotation that is slower does not turn [rad/s].
STANDING = 1e-2
# A supply below this share of what it is set to is starved, and one that gives more than it gets,
# but for what a few blows differ by.
STARVED, EVEN = 0.95, 1.02
# Drives that have less where the casing lifts off.
THROTTLED = ("pressure", *(one.name for one in DRIVES if one.is_throttled))
# A back pressure of so much of the supply leaves blows less than half of their energy.
LEAST_BACK = 0.25
# Ports of chambers of air, by their edges from the bit up (Bo et al. 2021, table 1).
PORTS = ("upper_exhaust", "lower_intake", "upper_intake", "lower_exhaust")
# A rear chamber of oil is below the pressure around it for about 3 % of the time, as measured; an
# accumulator is never empty.
MOST_VOID, MOST_EMPTY = 0.1, 0.01
BELOW_PRECHARGE = "the line is below its precharge (hydraulic.precharge)"
# Oil at a mean pressure below this share of what its pump may have is too little: valves let some
# out, and lines swing.
FED = 0.6
# A hammer that takes this share of what the pump gives takes all.
ALL = 0.99
# Work that the oil has done and what bodies got may differ by this share.
MOST_OFF = 0.01
# No hammer takes so long for a blow [s].
SLOWEST = 0.4
# More keys of a table are told by its name.
MOST_NAMED = 8
# Entries of the ledger that put energy in.
_FLOWS = ("initial", "drive", "feed", "gravity")


def find_warnings(result: Result) -> Iterator[str]:
    """Go through the warnings that a result deserves."""
    yield from _about_scene(result)
    yield from _about_grid(result)
    yield from _about_blows(result)
    yield from _about_validity(result)


def warnings_of_motion(result: Result) -> Iterator[str]:
    """Go through those that do not tell how long a run is, and how many of its blows count."""
    yield from _about_scene(result)
    yield from _about_grid(result)
    yield from _about_validity(result)


def _about_scene(result: Result) -> Iterator[str]:
    scene = result.scene
    if scene.given_in_vain:
        yield unused_note(scene.given_in_vain)
    if scene.is_undamped:
        if scene.barrier_on:
            yield (
                "structural loss is off: vibration trapped in the bit keeps its kinetic energy "
                "above the energy barrier, the rate of penetration grows with refinement and "
                "must not be trusted"
            )
        else:
            yield (
                "structural loss is off: vibration trapped in the bars never decays, so the "
                "rate of penetration depends on the cells and must not be trusted"
            )
    yield from barrier_note(*barrier_shares(scene))
    least = least_loss_time(result)
    if scene.loss_on and scene.solver_name in ("wave", "modal") and scene.loss.time < least:
        yield (
            f"structural loss is small: at loss.time = {scene.loss.time:.3g} s the bit still "
            "vibrates above the energy barrier when the next blow comes; the rate of penetration "
            f"depends on the cells, and on the loss itself, up to some {least:.2g} s"
        )


def unused_note(keys: Iterable[str]) -> str:
    """Say that parameters were given that nothing of the scene needs."""
    tables: dict[str, list[str]] = {}
    for key in keys:
        told = f"{key} (needs {row_of(key).effect})" if key.startswith("effects.") else key
        tables.setdefault(key.rpartition(".")[0], []).append(told)
    all_told = (
        ", ".join(found) if len(found) <= MOST_NAMED else f"{table} ({len(found)} keys)"
        for table, found in tables.items()
    )
    return f"given, but without effect in this scene: {', '.join(all_told)}"


def least_loss_time(result: Result) -> float:
    """Loss time that lets a blow's vibration fall below the energy barrier by the next [s].

    The energy of a mode of frequency w falls as exp(-eta w^2 t). The lowest mode of a
    free bit has w = pi / (transit time); what a blow can leave in it is at the most the
    blow energy E. So eta = ln(E / W_R) / (w^2 T), T the period of the blows
    (docs/data/undamped.md). Zero where there is no barrier, or no blow to tell.
    """
    scene, blows = result.scene, result.counted
    if not (scene.barrier_on and scene.bit.model == "elastic" and len(blows)):
        return 0.0
    above = float(blows["blow_energy"].mean()) / scene.rock.barrier_energy
    frequency = math.pi / scene.bit.transit_time
    period = float(blows["period"].mean())
    return math.log(above) / (frequency * frequency * period) if above > 1.0 else 0.0


def _about_grid(result: Result) -> Iterator[str]:
    error = result.wave_speed_error
    if error > MOST_WAVE_SPEED_ERROR:
        yield (
            "a section is shorter than a time step and taken as long as one: its wave speed is "
            f"off by {in_digits(100 * error, 2)} %; more solver.cells make steps shorter"
        )
    if result.scene.loss_on:
        for bar, count in result.cells.items():
            if count == 1:
                yield (
                    f"the {bar} is a single cell: waves in it are not resolved, nor is their loss; "
                    "set more solver.cells"
                )


def _about_blows(result: Result) -> Iterator[str]:
    count = len(result.counted)
    if result.scene.piston.model == "absent":
        yield "there is no piston, so there are no blows: the rate of penetration is undefined"
    elif len(result.blows) == 0:
        yield (
            "the hammer has stalled: " * _is_still(result)
            + "no whole blow in this run: the rate of penetration is undefined"
        )
    elif result.has_stalled:
        yield (
            f"the hammer has stalled: no blow ended after {in_digits(end_of(result.blows))} s of "
            f"{result.duration:.6g} s, so the rate of penetration is undefined"
            + "; the other numbers are those of the blows before"
            * (count > 0)
        )
    elif count < LEAST_BLOWS:
        yield (
            f"only {count} whole blow{'s' if count != 1 else ''} after settling, fewer than "
            f"{LEAST_BLOWS}: the rate of penetration is undefined"
            + f", and how far other blows differ from {'this' if count == 1 else 'these'} is "
            "not known" * (count > 0) + "; run longer"
        )
    yield from _about_flight(result)
    rate, scatter = result.rate_of_penetration, result.rate_of_penetration_standard_error
    if _stands(result):
        yield "the bit does not turn: it meets its own craters, and the hole does not advance"
    elif _has_jammed(result) or _is_starved(result):
        return
    elif rate > 0.0 and scatter > LARGE_ERROR * rate:
        yield (
            f"blows do not repeat: the rate of penetration has a standard error of "
            f"{in_digits(100.0 * scatter / rate, 2)} %; a longer run.duration (--duration) "
            "averages more"
        )


def _is_still(result: Result) -> bool:
    """Whether chambers move a piston to no blow at all."""
    is_long = result.duration > SLOWEST and result.scene.effects.drive in PRESSURES
    return is_long and len(result.blows) == 0


def _is_starved(result: Result) -> bool:
    """Whether a compressor gives less air than the hammer takes."""
    scene, blows = result.scene, result.counted
    if scene.effects.drive != "pneumatic":
        return False
    most, set_to = scene["pneumatic.supply_flow"], scene["pneumatic.supply_pressure"]
    if most > 0.0 == scene["pneumatic.supply_volume"]:
        return False
    falls = len(blows) > 0 and 0.0 < EVEN * most < float(blows["pneumatic_air"].mean())
    return falls or result.hammer_pressure < STARVED * set_to


def _about_supply(result: Result) -> Iterator[str]:
    """Say that a hammer is starved of air, and what is odd about its ports."""
    if result.scene.effects.drive != "pneumatic":
        return
    scene = result.scene
    set_to, found = scene["pneumatic.supply_pressure"], result.hammer_pressure
    most, volume = scene["pneumatic.supply_flow"], scene["pneumatic.supply_volume"]
    ordered = [scene[f"pneumatic.{port}_edge"] for port in PORTS]
    if ordered != sorted(ordered):
        edges = ", ".join(f"pneumatic.{port}_edge" for port in PORTS)
        yield f"edges of ports are out of order, which is from the bit up {edges}: air is wasted"
    ports = (f"pneumatic.{port}" for port in (*PORTS, "flushing"))
    if missing := [port for port in ports if scene[port] == 0.0]:
        yield f"ports are missing ({', '.join(missing)} = 0 m^2): chambers live on leaks"
    back = scene["pneumatic.back_pressure"]
    too_weak = result.has_stalled or _is_still(result) or result.rate_of_penetration == 0.0
    if back >= set_to > 0.0 or (too_weak and back > LEAST_BACK * set_to):
        yield (
            f"pneumatic.back_pressure = {in_digits(back / 1e5)} bar "
            + ("is no less than" if back >= set_to else "takes too much of")
            + f" the supply's {in_digits(set_to / 1e5)} bar (pneumatic.supply_pressure): "
            + ("nothing drives the piston" if back >= set_to else "blows are too weak, or cease")
        )
    if most > 0.0 == volume:
        yield (
            "pneumatic.supply_flow has no effect with pneumatic.supply_volume = 0 m^3, which never "
            "falls in pressure: give a volume above 0 m^3, as of the hose"
        )
    elif _is_starved(result):
        yield (
            "the hammer is starved: the compressor gives too little air (pneumatic.supply_flow), "
            f"and the supply has fallen to {in_digits(found / 1e5)} bar, where "
            f"{in_digits(set_to / 1e5)} bar are set; while it falls no two blows are alike, and a "
            "longer run has a lower rate, which the ± does not hold"
        )


def _about_oil(result: Result) -> Iterator[str]:
    """Say that oil does what it should not."""
    if result.scene.effects.drive != "hydraulic" or not result.end:
        return
    scene = result.scene
    set_to, found = scene["hydraulic.supply_pressure"], result.end["hydraulic_pressure"]
    taken, pump = result.counted["hydraulic_oil"], scene["hydraulic.flow"]
    takes_all = len(taken) > 0 and float(taken.mean()) > ALL * pump
    if 0.0 < found < (STARVED if takes_all else FED) * set_to:
        yield (
            f"the hammer is starved: the pump gives too little oil (hydraulic.flow, "
            f"{in_digits(6e4 * pump)} l/min), at a mean of {in_digits(found / 1e5)} bar, where "
            f"{in_digits(set_to / 1e5)} bar are set"
        )
    times = (result.end[f"hydraulic_{name}"] for name in ("void", "empty"))
    void, empty = (time / result.duration for time in times)
    if void > MOST_VOID:
        yield (
            f"oil cavitates in the rear chamber: for {in_digits(100.0 * void, 2)} % of the time it "
            "is below the pressure of the surroundings"
        )
    oil, held = (result.end[f"hydraulic_{name}_work"] for name in ("oil", "held"))
    if abs(oil - held) > MOST_OFF * abs(oil):
        yield (
            f"work on the piston is {in_digits(100.0 * (held / oil - 1.0), 2)} % off that of the "
            "oil: forces are held too long (hydraulic.step; or bodies that are rigid)"
        )
    if empty > MOST_EMPTY:
        yield (
            f"the accumulator is empty for {in_digits(100.0 * empty, 2)} % of the time: "
            + (precharge_note(scene) or BELOW_PRECHARGE)
        )


def precharge_note(scene: Scene) -> str:
    """Say that oil has less pressure than its accumulator needs; nothing where it has enough."""
    set_to, least = scene["hydraulic.supply_pressure"], scene["hydraulic.precharge"] - REFERENCE
    if scene.effects.drive != "hydraulic" or set_to >= least:
        return ""
    return (
        f"{BELOW_PRECHARGE}, where blows are irregular or none: hydraulic.supply_pressure = "
        f"{in_digits(set_to / 1e5)} bar must be {in_digits(least / 1e5)} bar at least"
    )


def _has_jammed(result: Result) -> bool:
    """Whether the motor of the rotation has less torque than is needed at the end."""
    scene, end = result.scene, result.end
    stall = scene["rotation.stall_torque"]
    return bool(end) and scene.motor_stalls and end["rotation_needed_torque"] > stall


def _stands(result: Result) -> bool:
    """Whether a bit that should turn stands still at the end."""
    turns = result.scene["effects.rotation"] and result.scene["effects.breaking"]
    return bool(turns and result.end and abs(result.end["rotation_turning_speed"]) < STANDING)


def _about_flight(result: Result) -> Iterator[str]:
    """Say that a bit which nothing has struck is in the air when its run ends."""
    scene, end = result.scene, result.end
    if not result.fall or scene.effects.rock == "none" or not end:
        return
    if end["drilling_mode"] == Mode.FF:
        speed, pull = end["bit_velocity"], scene.bit.mass * flight_acceleration(scene)
        gone = speed <= 0.0 and pull <= 0.0
        yield (
            f"at the end of the run the bit is in the air, moving {'up' if speed < 0 else 'down'} "
            f"at {in_digits(abs(speed))} m/s: it has no depth"
            + (
                f"; it flew off, since weight and feed ({in_digits(pull)} N) do not bring it back"
                if gone
                else "; a longer run.duration (--duration) lets it come to rest"
            )
        )


def _about_validity(result: Result) -> Iterator[str]:
    yield from _about_supply(result)
    yield from _about_oil(result)
    if any(result.energy[name] for name in _FLOWS):
        yield from ledger_note(result.energy["residual_relative"])
        yield from numerical_note(result.energy["numerical_relative"], result.solver)
    yield from guard_notes(result.statistics)
    scene = result.scene
    if scene.effects.rock == "none":
        return
    if scene.effects.rock != "wall" and len(result.blows):
        peak = float(result.blows["peak_bit_force"].max())
        yield from button_note(peak, stiffness_at(scene, peak, scene.rock.loading_stiffness))
    yield from flight_note(longest_flight(result))
    yield from rate_note(result.rate_of_penetration)
    yield from _about_breaking(result)
    if scene.loss_on and scene.loss.time > scene.bit.transit_time:
        yield (
            f"loss.time = {scene.loss.time:.3g} s is longer than a wave takes through the bit: "
            "that is no structural loss, and waves do not travel"
        )


def _about_breaking(result: Result) -> Iterator[str]:
    """What limits the trust in volume, rotation and feed on the casing."""
    scene, end, blows = result.scene, result.end, result.counted
    if not (len(blows) and end):
        return
    if scene["effects.breaking"]:
        if not blows["breaking_blow_volume"].any():
            yield (
                "no rock breaks: no blow loads a button beyond breaking.threshold = "
                f"{scene['breaking.threshold']:.3g} J"
            )
        yield from limit_note(end["breaking_limited"], end["breaking_volume"])
    if scene.motor_stalls:
        yield from jam_note(end["rotation_needed_torque"], scene["rotation.stall_torque"])
    if scene.effects.feed and scene.feed.on == "casing":
        gravity = scene.gravity.acceleration if scene.effects.gravity else 0.0
        held = scene.feed.force + scene.feed.casing_mass * gravity
        on_bit = (end["recoil_impulse"] - end["drive_impulse"]) / result.duration
        on_piston = float(blows["drive_impulse"].sum() / blows["period"].sum())
        yield from recoil_note(on_piston + on_bit, held, scene.effects.drive in THROTTLED)
    energy = by_volume(numbers_over(blows), scene.hole_diameter).get("specific_energy")
    if energy is not None and energy > 0.0 and (named := rock_of(scene, ("rock.",))):
        strength = read_rock(named).strength
        if strength is not None:
            yield from specific_energy_note(energy, named, strength.value)


def longest_flight(result: Result) -> float:
    """Longest time without contact of bit and rock [s]; by whole blows without an event list."""
    events = result.events
    modes = events[events["kind"] <= EventKind.MODE_SS]
    if not len(events) and result.statistics.get("events", 0):
        off = result.blows["bit_impulse"] == 0.0
        return float(result.blows["period"][off].max()) if off.any() else 0.0
    times = np.concatenate([[0.0], modes["time"], [result.duration]])
    flying = np.concatenate([[True], modes["kind"] == EventKind.MODE_FF])
    return float(np.max(np.diff(times)[flying], initial=0.0))
