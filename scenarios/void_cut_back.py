"""A void with and without cut-back of percussion: `python -m scenarios.void_cut_back`.

Rock, then twenty centimetres of soft filling, then rock. In the filling nothing resists the
blows, and the head runs away; the controller sees its velocity and takes pressure and
force back until the bit stands on rock again. Without that the PI winds up meanwhile, and
throws the string on the floor.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from percussion_model.coupling import CoupledRun

from .coupled import FEED, draw_runs, held_since, run, write

NAME = "void_cut_back"
DURATION = 5.0  # [s]
TOP, FLOOR, FILLING = 0.02, 0.22, 1e6  # of the void [m], K_R of what fills it [N/m]
LOW = 0.5  # cut back: pressure below this share of what is wanted while drilling
PRESSURE = 2e6  # [Pa]
SHARE = 0.05  # the feed is back within this of what is wanted
# Numbers as they are printed: words, factor, unit.
SHOWN = {
    "entered": ("the bit enters the void at", 1.0, "s"),
    "left": ("and leaves it at", 1.0, "s"),
    "low_after": ("pressure below half after", 1.0, "s"),
    "dry_blows": ("blows in the void", 1.0, ""),
    "dry_frequency": ("their frequency", 1.0, "Hz"),
    "dry_power": ("their power", 1.0, "W"),
    "speed": ("mean velocity of the head in it", 1e3, "mm/s"),
    "highest": ("highest feed afterwards, by what is wanted", 100.0, "%"),
    "back_after": ("feed within 5 % after", 1.0, "s"),
}


def simulate(system: Path, duration: float = DURATION) -> dict[str, CoupledRun]:
    """Runs with and without cut-back."""
    rock = {
        "rock.layers[2].top": TOP,
        "rock.layers[2].loading_stiffness": FILLING,
        "rock.layers[3].top": FLOOR,
        "rock.layers[3].loading_stiffness": 7.5e8,
    }
    return {
        name: run(system, duration, {**rock, "controller.cutback.on": on})
        for name, on in (("with cut-back", True), ("without cut-back", False))
    }


def numbers(found: CoupledRun) -> dict[str, float]:
    """What happens in the void.

    Returns
    -------
    dict
        entered, left: times at which the bit is in the filling first and last [s];
        low_after: time from entering until the pressure is below half [s], not a number if
        it never is; dry_blows: blows in the void; dry_frequency: their number by the time in
        it [Hz]; dry_power: their energy by that time [W]; speed: mean speed of the head in the
        void [m/s]; highest: feed afterwards, by what is wanted [1]; back_after: time from
        leaving until the feed stays within 5 % [s], not a number if it does not.
    """
    time, void = found["time"], found["rock.in_void"] > 0.0
    entered, left = time[void][0], time[void][-1]
    low = void & (found["supply.supply_pressure"] < LOW * PRESSURE)
    blows = np.diff(found["hammer.blow_count"], prepend=0.0)
    after = time > left
    near = np.abs(found["string.feed_force_mean"][after] / FEED - 1.0) < SHARE
    return {
        "entered": float(entered),
        "left": float(left),
        "low_after": float(time[low][0] - entered) if low.any() else float("nan"),
        "dry_blows": float(blows[void].sum()),
        "dry_frequency": float(blows[void].sum() / (left - entered)),
        "dry_power": float((blows * found["hammer.blow_energy"])[void].sum() / (left - entered)),
        "highest": float(found["string.feed_force_mean"][after].max() / FEED),
        "back_after": held_since(time[after], near) - float(left),
        "speed": float(found["string.head_velocity"][void].mean()),
    }


def draw(runs: dict[str, CoupledRun], path: Path) -> Path:
    """Draw both runs, the time in the void of the first one shaded."""
    first = numbers(next(iter(runs.values())))
    return draw_runs(
        path,
        "A void: percussion is cut back until the bit stands on rock again",
        runs,
        [
            ("depth of the bit [mm]", 1e3, "hammer.bit.position"),
            ("velocity of the head [mm/s]", 1e3, "string.head_velocity"),
            ("supply pressure at the hammer [bar]", 1e-5, "supply.supply_pressure"),
            ("feed force on the bit, filtered [kN]", 1e-3, "string.feed_force_mean"),
            ("energy of the last blow [J]", 1.0, "hammer.blow_energy"),
        ],
        {
            "hammer.bit.position": [(1e3 * TOP, "roof of the void"), (1e3 * FLOOR, "floor")],
            "string.feed_force_mean": [(1e-3 * FEED, "wanted")],
        },
        [(first["entered"], first["left"], "in the void (with cut-back)")],
    )


if __name__ == "__main__":
    write(NAME, simulate, numbers, draw, SHOWN)
