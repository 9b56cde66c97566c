"""Map of the drive: the pressure law that stands for chambers, by pressure and rebound.

Chambers run with a rigid piston over a bit at rest. The law that has their impact velocity and
period at a rebound is the cheap drive (`effects.drive = "pressure"`). What it is off by between
rows, and in the scene's own rock, tells what it is worth.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from percussion_model.analysis.stationary import settled
from percussion_model.scene.drive_calibration import calibrate_drive
from percussion_model.scene.scene import Scene, SceneError

__all__ = ["DriveMap", "drive_map"]

# Rebounds, and pressures by that of the scene, where no others are asked for.
REBOUNDS, PRESSURES = (0.1, 0.3, 0.5, 0.7), (0.25, 0.5, 0.75, 1.0, 1.25)
# What chambers take, by the choice of `effects.drive`: air [kg/s] or oil [m^3/s].
TAKEN = {"pneumatic": "pneumatic_air", "hydraulic": "hydraulic_oil"}
# A bit so large that no blow moves it [m, m^2].
AT_REST = [{"length": 10.0, "area": 10.0}]
# Each correction for weight leaves some per cent of the one before: so many leave rounding.
CORRECTIONS = 20
# With less feed than so many F_0 the bit may bounce by the law, as it did not with four presets.
HELD = 1.5
# Means over blows that do not repeat are known so well, or are those of 400 blows.
SCATTER = 1e-3
# What is told of chambers, of their law, and the relative errors of that.
BLOWS = ("frequency", "impact_velocity", "blow_energy", "stroke", "flow", "rate")
LAW = ("force", "reversal_distance")
LEFT_OUT = ("left_out_frequency", "left_out_blow_energy")
IN_ROCK = {"rock_frequency": "frequency", "rock_blow_energy": "blow_energy", "rock_rate": "rate"}
ROW = np.dtype([(n, "f8") for n in ("pressure", "rebound", *BLOWS, *LAW, *LEFT_OUT, *IN_ROCK)])


@dataclass(frozen=True)
class DriveMap:
    """Pressure laws by pressure and rebound, and what they are off by.

    Attributes
    ----------
    rows : ndarray of ROW, shape (pressures, rebounds)
        Over a bit at rest, without a rate. `left_out` are the errors of the law that is made from
        the rows beside it, `rock` those in the scene's own rock; NaN where nothing tells them.
    own : ndarray of ROW, shape (pressures,)
        Of the chambers in that rock, at the rebound that it gives, with the law of `law`.
    """

    rows: np.ndarray
    own: np.ndarray

    def law(self, pressure: float, rebound: float) -> tuple[float, float]:
        """F_0 [N] and D_1 [m], straight between rows; beyond them the nearest counts."""
        return _between(self.rows, pressure, rebound)

    @property
    def worst(self) -> dict[str, float]:
        """Greatest error of a blow's energy: between rows, in rock by them, and by its rebound.

        Of what nothing tells there is none.
        """
        left_out = self.rows["left_out_blow_energy"]
        errors = {"left_out": left_out, "rows": self.rows["rock_blow_energy"]}
        errors["own"] = self.own["rock_blow_energy"]
        known = {key: np.abs(one[np.isfinite(one)]) for key, one in errors.items()}
        return {key: float(one.max()) for key, one in known.items() if len(one)}


def drive_map(
    scene: Scene,
    pressures: Sequence[float] | None = None,
    rebounds: Sequence[float] = REBOUNDS,
    progress: Callable[[int, int], None] | None = None,
) -> DriveMap:
    """Find the pressure laws that stand for the chambers of a scene.

    Parameters
    ----------
    scene : Scene
        With chambers of air or oil (`effects.drive`).
    pressures : sequence of float, optional
        Of the supply, above that of the surroundings [Pa]; a quarter to five quarters of the
        scene's own if left out.
    rebounds : sequence of float
        Velocities after a blow by those before it, from 0 on and below 1.
    progress : callable, optional
        Called with the laws tried and their count.
    """
    if scene.effects.drive not in TAKEN:
        raise SceneError(
            f'effects.drive = "{scene.effects.drive}": must be "pneumatic" or "hydraulic" for a map'
        )
    supply = f"{scene.effects.drive}.supply_pressure"
    own_pressure = scene[supply]
    columns = sorted(set(pressures or [share * own_pressure for share in PRESSURES]))
    across = sorted(set(rebounds))
    if not across or not 0.0 <= across[0] <= across[-1] < 1.0:
        raise SceneError(f"rebounds {across}: must be numbers from 0 on and below 1")
    rows = np.array([
        [blow_row(scene.replace(**{supply: pressure}), rebound) for rebound in across]
        for pressure in columns
    ])  # fmt: skip
    own = np.array([settled_row(scene.replace(**{supply: pressure})) for pressure in columns])
    for k, row in enumerate(own):
        row["force"], row["reversal_distance"] = _between(rows, row["pressure"], row["rebound"])
        for n, one in enumerate((*rows[k], row)):
            _run_by_law(scene, one, row)
            if progress is not None:
                progress(k * (len(across) + 1) + n + 1, len(columns) * (len(across) + 1))
    _leave_out(scene, rows)
    return DriveMap(rows, own)


def on_a_wall(scene: Scene, rebound: float) -> Scene:
    """Return the scene with a rigid piston over a bit at rest, which gives back a rebound."""
    names = ("feed", "barrier", "cuttings", "breaking", "rotation", "string")
    off = [f"effects.{name}" for name in names]
    changes = {"effects.rock": "wall", "bit.sections": AT_REST, "contact.restitution": rebound}
    changes["string.rods"] = None
    return scene.computed_by("rigid", **dict.fromkeys(off, False), **changes)


def blow_row(scene: Scene, rebound: float) -> np.ndarray:
    """ROW of the chambers at the scene's pressure over a bit at rest, with their law."""
    row = settled_row(on_a_wall(scene, rebound))
    if row["frequency"] > 0.0:
        told = (float(row["impact_velocity"]), rebound, 1.0 / float(row["frequency"]))
        row["force"], row["reversal_distance"] = law_of(*_body(scene), *told)
    row["rebound"], row["rate"] = rebound, math.nan
    return row


def law_of(
    mass: float, weight: float, velocity: float, rebound: float, period: float
) -> tuple[float, float]:
    """F_0 [N] and D_1 [m] of the law with this impact velocity [m/s], rebound and period [s].

    Without weight [N] in closed form, F_0 = M (2 v_1 + v - v_0)/T and D_1 = M (v^2 - v_0^2)/(4 F_0)
    with v_0 = e v and v_1 = sqrt((v^2 + v_0^2)/2). NaN where it would not lift the piston.
    """
    force, distance, _ = calibrate_drive(mass, velocity, -rebound * velocity, period)
    energy = force * distance
    for _ in range(CORRECTIONS):
        if not force > weight:
            return math.nan, math.nan
        force *= law_cycle(mass, weight, force, energy / force, rebound)[1] / period
    return force, energy / force


def law_cycle(
    mass: float, weight: float, force: float, distance: float, rebound: float
) -> tuple[float, float]:
    """Impact velocity [m/s] and period [s] that a law gives a piston with weight.

    The law does the work 2 F_0 D_1 in a cycle (docs/model.md, eq. 13).
    """
    v = math.sqrt(4.0 * force * distance / (mass * (1.0 - rebound * rebound)))
    up, down = (force - weight) / mass, (force + weight) / mass
    v_1 = math.sqrt((rebound * v) ** 2 + 2.0 * up * distance)
    return v, (v_1 - rebound * v) / up + (v_1 + v) / down


def _body(scene: Scene) -> tuple[float, float]:
    """Mass [kg] and weight [N] of the piston."""
    mass = scene.piston.mass
    return mass, mass * scene.gravity.acceleration if scene.effects.gravity else 0.0


def settled_row(scene: Scene) -> np.ndarray:
    """What the settled motion of a scene tells of a ROW; all else, and of none, is NaN."""
    row, found = np.full((), math.nan, ROW), settled(scene, scatter=SCATTER)
    drive = scene.effects.drive
    if drive in TAKEN:
        row["pressure"] = scene[f"{drive}.supply_pressure"]
    if found.kind != "stalled":
        blows = found.counted
        for name in ("impact_velocity", "blow_energy", "stroke"):
            row[name] = np.mean(blows[name])
        row["frequency"] = 1.0 / found.blow_period
        if drive in TAKEN:
            row["flow"] = np.mean(blows[TAKEN[drive]])
        row["rebound"] = -np.mean(blows["rebound_velocity"]) / row["impact_velocity"]
        row["rate"] = found.rate_of_penetration
    return row


def _run_by_law(scene: Scene, row: np.ndarray, chambers: np.ndarray) -> None:
    """Put into a row what its law is off by in the scene's rock."""
    if row["force"] > 0.0:
        law = {f"drive.{name}": float(row[name]) for name in LAW}
        found = settled_row(scene.replace(**{"effects.drive": "pressure", **law}))
        for name, of in IN_ROCK.items():
            row[name] = found[of] / chambers[of] - 1.0


def _between(rows: np.ndarray, pressure: float, rebound: float) -> tuple[float, float]:
    """Law between rows."""
    found = []
    for name in LAW:
        at = [np.interp(rebound, row["rebound"], row[name]) for row in rows]
        found.append(float(np.interp(pressure, rows["pressure"][:, 0], at)))
    return found[0], found[1]


def _leave_out(scene: Scene, rows: np.ndarray) -> None:
    """Put into rows what the law is off by that is made from those on both sides.

    The worse of both where there are some of other pressures and of other rebounds.
    """
    for (k, n), row in np.ndenumerate(rows):
        for axis, place in enumerate((k, n)):
            if not 0 < place < rows.shape[axis] - 1:
                continue
            law = _between(np.delete(rows, place, axis), row["pressure"], row["rebound"])
            v, period = law_cycle(*_body(scene), *law, row["rebound"])
            off = (1.0 / (period * row["frequency"]) - 1.0, (v / row["impact_velocity"]) ** 2 - 1.0)
            if not abs(off[1]) < abs(row[LEFT_OUT[1]]):
                row[LEFT_OUT[0]], row[LEFT_OUT[1]] = off
