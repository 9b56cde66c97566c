"""One blow on a bit that stands still, by the wave solver: an entry of the blow map."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from percussion_model.physics.records import (
    BLOW,
    EVENT,
    READING,
    READING_FIELDS,
    EventKind,
    Mode,
    Status,
)
from percussion_model.scene.scene import Scene
from percussion_model.solvers.blow_map.records import ENTRIES, PATH_TIMES, Entry
from percussion_model.solvers.state import State
from percussion_model.solvers.wave.records import Row
from percussion_model.solvers.wave.solver import WaveSolver

AT = {name: k for k, name in enumerate(READING_FIELDS)}
# Times at which the bit is looked at [s]: those of the path, and until it must rest.
LATER = (20e-3, 28e-3, 40e-3, 60e-3, 80e-3, 100e-3)
# The bit stands still once its energy is below this share of the blow's: it then moves
# at less than half a per cent of the impact velocity where it is as heavy as the piston.
STILL = 2.5e-5
# Nothing worth an entry happens below this share.
SILENT = 1e-7
# A piston that starts so close strikes at once [m].
CLOSE = 1e-12
# The drive must not turn within a blow [m].
FAR = 100.0
_BLOWS, _EVENTS = 4, 4096


def scene_at(scene: Scene, stiffness: float) -> Scene:
    """Return a scene for waves on a rock of another stiffness, about to strike.

    Parameters
    ----------
    scene : Scene
        With elastic bodies.
    stiffness : float
        K_R [N/m]; what rounding puts beyond the bounds of the parameter counts as they do.
    """
    row = scene.row_of("rock.loading_stiffness")
    assert row.lower is not None
    assert row.upper is not None
    return scene.replace(
        **{
            "rock.loading_stiffness": min(max(stiffness, row.lower), row.upper),
            "solver.name": "wave",
            "solver.fidelity": "wave",
            "solver.accuracy": None,
            "start.bit_velocity": 0.0,
            "start.gap": CLOSE,
            "start.rock_gap": 0.0,
            "start.depth": 0.0,
            "start.drive_direction": 1,
        }
    )


class SingleBlow:
    """Computes blows on a rock of one stiffness.

    Parameters
    ----------
    scene : Scene
        With an elastic bit and a pressure drive.
    stiffness : float
        K_R [N/m].
    """

    def __init__(self, scene: Scene, stiffness: float) -> None:
        self.scene = scene_at(scene, stiffness)
        self.solver = WaveSolver(self.scene)
        self._base = self.solver.new_state()
        self.impact = self.solver.place_of_closure * self.solver.time_step
        self._blows = np.zeros(_BLOWS, BLOW)
        self._events = np.zeros(_EVENTS, EVENT)
        gravity = scene.gravity.acceleration if scene.effects.gravity else 0.0
        self.gravity = gravity
        self.weight = gravity * scene.bit.mass

    def start(self, velocity: float, load: float, drive: float) -> State:
        """State shortly before the impact, which comes at `self.impact`.

        Parameters
        ----------
        velocity : float
            Of the whole piston at the impact [m/s].
        load : float
            Static force of the bit on the rock [N].
        drive : float
            F_0 [N].
        """
        solver, state = self.solver, self._base.copy()
        s: Any = state.record[0]
        wp, wb = state.arrays
        n = solver.cells["bit"]
        standing = load / self.scene.bit.mass * solver.static_wave
        wb[Row.DOWN, :n], wb[Row.UP, :n] = standing, -standing
        # the impact comes where in a step its front gets the right width
        before = velocity - (self.gravity + drive / self.scene.piston.mass) * self.impact
        wp[Row.DOWN : Row.UP + 1, : solver.cells.get("piston", 0)] = 0.5 * before
        s["v_p"], s["v_b"] = before, 0.0
        s["gap"] = max(0.5 * (velocity + before) * self.impact, CLOSE)
        s["feed"], s["drive_force"], s["reversal"] = load - self.weight, drive, FAR
        s["mode"], s["p"] = Mode.SS, load / s["k_r"]
        s["p_u"] = s["p"] - load / (s["gamma"] * s["k_r"])
        s["x_r"] = 0.0
        solver.derive(state)
        return state

    def entries(self, velocity: float, load: float, drive: float) -> np.ndarray:
        """Compute one blow.

        Returns
        -------
        ndarray, shape (ENTRIES,)
            In the scales of the table (`Entry`).

        Raises
        ------
        ArithmeticError
            If the wave solver could not continue.
        """
        scene = self.scene
        state = self.start(velocity, load, drive)
        energy = 0.5 * scene.piston.mass * velocity * velocity
        rows = [self._reading(state, self.impact)]
        opened = 0.0
        times = (*PATH_TIMES, *LATER)
        for k, t in enumerate(times):
            opened = max(opened, self._advance(state, self.impact + t) - self.impact)
            row = self._reading(state, self.impact + t)
            rows.append(row)
            if k + 1 >= len(PATH_TIMES) and row[AT["bit_kinetic_energy"]] < SILENT * energy:
                above = row[AT["bit_position"]] - rows[-2][AT["bit_position"]]
                if row[AT["drilling_mode"]] == Mode.SS and abs(load * above) < energy * STILL:
                    break
        found = self._found(np.array(rows), velocity, drive)
        found[Entry.OPENED] = opened
        position = np.array([row[AT["bit_position"]] for row in rows])
        moving = np.array([row[AT["bit_kinetic_energy"]] for row in rows])
        moving += load * np.maximum(position[-1] - position, 0.0)
        late = np.nonzero(moving > STILL * energy)[0]
        last = int(late[-1]) if len(late) else 0
        found[Entry.REST] = times[last] if last < len(rows) - 1 else math.inf
        s = state.record[0]
        found[Entry.CONTACTS], found[Entry.CYCLES] = s["b_contacts"], s["b_cycles"]
        found[Entry.PEAK_CONTACT] = s["b_peak_contact"] / velocity
        found[Entry.PEAK_BIT] = s["b_peak_bit"] / velocity
        return found

    def _reading(self, state: State, t: float) -> np.ndarray:
        """Numbers of a reading at `t` (`READING_FIELDS`)."""
        reading = np.zeros(1, READING)
        self.solver.read(state, t, reading, peaks=False)
        return reading.view(np.float64)

    def _advance(self, state: State, t: float) -> float:
        """Advance to `t`; return when a contact opened last, 0 if none did [s]."""
        opened = 0.0
        while True:
            status, _, count = self.solver.advance(state, t, self._blows, self._events, True)
            rows = self._events[:count]
            times = rows["time"][rows["kind"] == EventKind.CONTACT_OPENED]
            if len(times):
                opened = float(times[-1])
            if status == Status.DONE:
                return opened
            if status not in (Status.BLOWS_FULL, Status.EVENTS_FULL):
                raise ArithmeticError(
                    f"a blow of the map could not be computed: {Status(status).name}"
                )

    def _found(self, rows: np.ndarray, velocity: float, drive: float) -> np.ndarray:
        """Entries that follow from the readings at the start, on the way and at the end."""
        first, last = rows[0], rows[-1]
        t = last[AT["time"]] - first[AT["time"]]
        a = self.gravity - drive / self.scene.piston.mass
        found = np.zeros(ENTRIES)
        advance = rows[:, AT["bit_position"]] - first[AT["bit_position"]]
        rebound = last[AT["piston_velocity"]] - a * t
        way = last[AT["piston_position"]] - first[AT["piston_position"]]
        found[Entry.PENETRATION] = advance[-1] / velocity
        found[Entry.REBOUND] = rebound / velocity
        found[Entry.OFFSET] = (way - t * (rebound + 0.5 * a * t)) / velocity
        found[Entry.PATH :] = advance[1 : len(PATH_TIMES) + 1] / velocity
        for name in ("crushing", "barrier", "standstill", "loss", "numerical"):
            found[Entry[name.upper()]] = (last[AT[name]] - first[AT[name]]) / velocity**2
        return found
