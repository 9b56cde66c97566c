"""How a rate is predicted: one set of numbers for all cases, none of them fitted to a rate.

The crushing energy is that of the strength, and the stiffness that of spherical buttons on rock
of that strength. All else is what `scene/rocks/breaking.py` has for a rock without own craters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from percussion_model.analysis.stationary import Settled, settled
from percussion_model.components.breaking import EFFICIENCY
from percussion_model.scene.bits import (
    COUNT,
    HOLE,
    INCH,
    RULE,
    SPEED,
    THRESHOLD,
    ButtonBit,
    bit,
    bits,
)
from percussion_model.scene.drive_calibration import calibrate_drive
from percussion_model.scene.hammers import hammer
from percussion_model.scene.rocks import STIFFNESS
from percussion_model.scene.rocks.breaking import (
    ASSUMED,
    CONTACT_SHARE,
    ENERGY_SHARES,
    energy_by_strength,
)
from percussion_model.scene.rocks.derived import button_stiffness, mean_factor, pressure_factors
from percussion_model.scene.scene import Scene
from percussion_model.verification.rates.cases import DOWN, TOP, Case

# Unloading ratio that the library of rocks has where none is known, and its interval.
RATIO = (5.0, 2.5, 15.0)
# Interval of the threshold, by its value.
THRESHOLDS = next(
    (one.low / one.value, one.high / one.value) for one in ASSUMED if one.key == THRESHOLD
)
# The ready-made hammer that a top hammer's bars and damper are of: bits to this diameter [m] have
# T38 rods, wider ones T45.
WIDEST_T38, T38, T45, RODS = 0.08, "t38", "t45", 1
# The one that hammers down the hole are made of, diameter of its piston [m], and the pressure
# that its drive force is taken to be of [Pa], which no source tells.
OF_DOWN, ITS_PISTON, ITS_PRESSURE = "dth3", 0.057, 2e6
# Rebound speed by the impact speed, from which the search for a drive starts.
REBOUND = 0.3
# Blow energy and frequency of a run are those of the case within this share, or else told.
TUNED, MOST_ROUNDS = 0.01, 8
# Blows are the same within this share; those that are not are enough when the rate has this
# standard error, so that it tells nothing beside a factor of 1.3.
TOLERANCE, SCATTER, MOST_BLOWS = 1e-3, 0.01, 200
STALLED = "stalled"
KINDS_OF_BITS = {TOP: "th", DOWN: "dth"}


@dataclass(frozen=True)
class Prediction:
    """What the model tells for a case, SI units."""

    rate: float  # [m/s]
    numerical_error: float  # by steps and scatter [m/s]
    low: float  # rates by the intervals of the rock's numbers, in closed form [m/s]
    high: float
    closed_form: float  # rate by the closed form with the run's energies [m/s]
    blow_energy: float  # of the run [J]
    frequency: float  # of the run [Hz]
    crushed: float  # energy into the rock of a blow [J]
    threshold: float  # energy of a blow below which nothing breaks [J]
    # of the closed form's volume that the hole did not gain; below 0: several blows at one place
    limited: float
    without_threshold: float  # rate by the closed form if the least crushing broke rock [m/s]
    bit: str  # whose buttons were taken
    rounds: int  # runs that the search for the drive took
    motion: str


def nearest_bit(case: Case) -> ButtonBit:
    """The stored bit of the same kind whose diameter is nearest."""
    kind = KINDS_OF_BITS[case.type]
    known = [bit(name) for name in bits() if name.partition("-")[0] == kind]
    return min(known, key=lambda one: abs(one.diameter - case.bit))


def rock_parameters(case: Case) -> dict[str, Any]:
    """Numbers of rock and bit, by dotted keys."""
    chosen = nearest_bit(case)
    count = round(chosen.buttons.value)
    gauge, front = chosen.gauge_button_diameter, chosen.front_button_diameter
    mean = (chosen.gauge_buttons * gauge + (count - chosen.gauge_buttons) * front) / count
    factor = mean_factor(pressure_factors().values())
    of_one = button_stiffness(0.5 * mean, case.strength, factor)
    return {
        **{one.key: one.value for one in ASSUMED},
        **chosen.parameters,
        HOLE: case.bit,
        SPEED: RULE / (case.bit / INCH) * 2.0 * math.pi / 60.0,
        "effects.rock": "bilinear",
        STIFFNESS: CONTACT_SHARE.value * count * of_one,
        "rock.unloading_ratio": RATIO[0],
        "breaking.crushing_energy": energy_by_strength(case.strength),
        "breaking.efficiency": EFFICIENCY,
    }


def first_scene(case: Case) -> Scene:
    """The case as a scene; of a top hammer before its drive was searched for."""
    if case.type == DOWN:
        return _down_the_hole(case).replace(**rock_parameters(case))
    scene = hammer(T38 if case.bit <= WIDEST_T38 else T45, RODS)
    assert case.frequency is not None
    mass = scene.piston.mass
    speed = math.sqrt(2.0 * case.blow_energy / mass)
    drive = calibrate_drive(mass, speed, -REBOUND * speed, 1.0 / case.frequency)
    return scene.replace(
        **{"drive.force": drive.force, "drive.reversal_distance": drive.reversal_distance},
        **rock_parameters(case),
    )


def _down_the_hole(case: Case) -> Scene:
    """The 3 inch hammer with the areas of the case's piston, at its pressure."""
    assert case.piston is not None
    assert case.pressure is not None
    scene = hammer(OF_DOWN)
    share = (case.piston / ITS_PISTON) ** 2
    areas = {
        f"piston.sections.{k}.area": share * one.area for k, one in enumerate(scene.piston.sections)
    }
    force = scene["drive.force"] * share * case.pressure / ITS_PRESSURE
    return scene.replace(**areas, **{"drive.force": force})


def tuned(case: Case) -> tuple[Scene, int]:
    """The scene of a case with its drive, and how many runs that took.

    Energy goes with F_0 D_1, frequency with the root of F_0/D_1, nearly.
    """
    scene = first_scene(case)
    if case.type == DOWN:
        return scene, 0
    rounds = 0
    while rounds < MOST_ROUNDS:
        rounds += 1
        found = _run(scene)
        if found.kind == STALLED:
            break
        energy = float(np.mean(found.counted["blow_energy"]))
        by_energy = case.blow_energy / energy
        assert case.frequency is not None
        by_frequency = case.frequency / found.means["blow_frequency"]
        if max(abs(by_energy - 1.0), abs(by_frequency - 1.0)) <= TUNED:
            break
        root = math.sqrt(by_energy)
        scene = scene.replace(
            **{
                "drive.force": scene["drive.force"] * root * by_frequency,
                "drive.reversal_distance": scene["drive.reversal_distance"] * root / by_frequency,
            }
        )
    return scene, rounds


def _run(scene: Scene, error_estimate: bool = False) -> Settled:
    return settled(scene, TOLERANCE, MOST_BLOWS, scatter=SCATTER, error_estimate=error_estimate)


def predict(case: Case) -> Prediction:
    """Predict the rate of a case."""
    scene, rounds = tuned(case)
    found = _run(scene, error_estimate=True)
    if found.kind == STALLED:
        return _nothing(scene, case, rounds, str(found.motion))
    rows = found.counted
    crushed = greatest_loading(scene, rows)
    frequency = found.means["blow_frequency"]
    kept = math.exp(-float(np.mean(rows["rotation_index"])) / scene["rotation.renewal_length"])
    closed = frequency * advance(scene, crushed, kept)
    low, high = (frequency * one for one in interval(scene, crushed, kept))
    # bits in contact that break nothing sink by nanometres a blow, by rounding of their cycles
    rate = found.rate_of_penetration if np.any(rows["breaking_blow_volume"] > 0.0) else 0.0
    return Prediction(
        rate=rate, numerical_error=found.rate_of_penetration_error, low=low, high=high,
        closed_form=closed, blow_energy=float(np.mean(rows["blow_energy"])), frequency=frequency,
        crushed=crushed, threshold=scene[COUNT] * scene["breaking.threshold"],
        limited=1.0 - rate / closed if closed > 0.0 else 0.0,
        without_threshold=frequency * advance(scene, crushed, kept, threshold=0.0),
        bit=nearest_bit(case).name, rounds=rounds, motion=str(found.motion),
    )  # fmt: skip


def greatest_loading(scene: Scene, rows: np.ndarray) -> float:
    """Crushing energy of a blow's greatest loading, by what it breaks; of one that breaks
    nothing all that it gives the rock [J]."""
    volume = float(np.mean(rows["breaking_blow_volume"]))
    if volume == 0.0:
        return float(np.mean(rows["rock_energy"]))
    threshold = scene[COUNT] * scene["breaking.threshold"]
    beyond = volume * scene["breaking.crushing_energy"] / scene["breaking.efficiency"]
    return float(beyond + threshold)


def _nothing(scene: Scene, case: Case, rounds: int, motion: str) -> Prediction:
    """Of a hammer whose blows die out: it drills nothing."""
    threshold = scene[COUNT] * scene["breaking.threshold"]
    return Prediction(*(0.0,) * 8, threshold, 0.0, 0.0, nearest_bit(case).name, rounds, motion)


def advance(
    scene: Scene,
    crushed: float,
    kept: float,
    energy: float | None = None,
    threshold: float | None = None,
) -> float:
    """Advance of a blow that crushes so much [m]: eqs 20g and 20h of docs/model.md.

    Parameters
    ----------
    scene : Scene
    crushed : float
        In every blow [J].
    kept : float
        Share of this whose craters are still there in the next blow.
    energy, threshold : float, optional
        In place of the scene's crushing energy [J/m^3] and threshold of a button [J].
    """
    energy = scene["breaking.crushing_energy"] if energy is None else energy
    one = scene["breaking.threshold"] if threshold is None else threshold
    beyond = crushed - max(scene[COUNT] * one, kept * crushed)
    volume = scene["breaking.efficiency"] * max(beyond, 0.0) / energy
    return float(volume / (0.25 * math.pi * scene[HOLE] ** 2))


def interval(scene: Scene, crushed: float, kept: float) -> tuple[float, float]:
    """Least and greatest advance by the intervals of crushing energy, threshold and gamma [m].

    One is moved at a time, and the differences are added in squares. The work of loading stays
    the same, of which a rock with another unloading ratio keeps another share.
    """
    here = advance(scene, crushed, kept)
    energy = scene["breaking.crushing_energy"]
    loading, own = crushed / (1.0 - 1.0 / RATIO[0]), scene["breaking.threshold"]
    moved = [
        [advance(scene, crushed, kept, energy=share * energy) for share in ENERGY_SHARES],
        [advance(scene, crushed, kept, threshold=one * own) for one in THRESHOLDS],
        [advance(scene, loading * (1.0 - 1.0 / one), kept) for one in RATIO[1:]],
    ]
    down = math.hypot(*(here - min(here, *pair) for pair in moved))
    up = math.hypot(*(max(here, *pair) - here for pair in moved))
    return max(here - down, 0.0), here + up
