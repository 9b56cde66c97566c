"""Errors and costs of rigid bodies beside those of elastic bars."""

from __future__ import annotations

import math
import time

from docs.blocks import Made
from percussion_model import Scene, Simulation, simulate
from percussion_model.simulation.markdown import table

SCENES: dict[str, dict[str, float]] = {
    "reference": {},
    "soft rock, 4·10⁸ N/m": {"rock.loading_stiffness": 4e8},
    "hard rock, 1.5·10⁹ N/m": {"rock.loading_stiffness": 1.5e9},
    "feed 1200 N": {"feed.force": 1200.0},
    "feed 7000 N": {"feed.force": 7000.0},
    "stroke: $D_1$ = 20 mm, 3780 N": {"drive.reversal_distance": 0.02, "drive.force": 3780.0},
    "high pressure, 4500 N": {"drive.force": 4500.0},
}
COMPARED = {
    "rate_of_penetration": "rate",
    "blow_period": "period",
    "impact_velocity": "impact velocity",
    "peak_bit_force": "peak bit force",
}
DURATION = 4.0
HOUR = 3600.0  # [s]
# Scenes whose runs are timed, and for how long [s].
TIMED = {
    "reference": Scene(),
    "reference, rigid": Scene().replace(**{"solver.fidelity": "rigid"}),
    "`dth4_kuru`": Scene.from_toml("dth4_kuru"),
    "`dth5_st_anne`": Scene.from_toml("dth5_st_anne"),
}
LONG = 40.0


def errors() -> str:
    """Error of rigid bodies against the waves, Markdown."""
    rows = []
    for name, changes in SCENES.items():
        scene = Scene().replace(**changes)
        wave = simulate(scene.computed_by("wave"), DURATION).summary()
        found = simulate(scene.replace(**{"solver.fidelity": "rigid"}), DURATION).summary()
        cells = [f"{100 * (found[key] / wave[key] - 1):+.2f}" for key in COMPARED]
        rows.append([name, *cells])
    return table(["scene", *(f"{one}, %" for one in COMPARED.values())], rows)


def costs() -> str:
    """Processor time of long runs, Markdown."""
    rows = []
    for name, scene in TIMED.items():
        best, blows = math.inf, 1
        for _ in range(5):
            simulation = Simulation(scene, record_events=False)
            began = time.process_time()
            simulation.advance(LONG)
            best, blows = min(best, time.process_time() - began), len(simulation.blows)
        times = (f"{LONG / best:.0f}", f"{1e6 * best / blows:.3g}", f"{HOUR * best / LONG:.2g}")
        rows.append([name, scene.solver_name, *times])
    return table(["scene", "solver", "× real time", "µs a blow", "an hour, s"], rows)


def made() -> Made:
    """Both tables."""
    return Made(("data/fidelity.md",), {"errors": errors, "costs": costs})
