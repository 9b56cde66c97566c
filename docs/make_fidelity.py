"""Measure the fidelities for docs/fidelity.md: `python -m docs.make_fidelity`.

Makes the usual blow map of the reference scene first, unless it is kept already.
"""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import numpy as np

from percussion_model import Scene, Simulation, SimulationError, piston_cycle, simulate
from percussion_model.analysis.blow_maps import make_map
from percussion_model.interface.commands.blow_map import ready_map
from percussion_model.interface.plotting.style import MM, STYLE
from percussion_model.solvers.blow_map.records import Axis, Entry

PAGE = Path(__file__).with_name("fidelity.md")
FIGURE = Path(__file__).parent / "images" / "blow_map.png"
BEGIN, END = "<!-- tables: begin -->", "<!-- tables: end -->"

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
RUNGS = ("rigid", "blow-map")
DURATION = 4.0
# Long enough to time a run of each [s].
TIMED = {"wave": 4.0, "rigid": 40.0, "blow-map": 400.0}
POINTS, SEED = 30, 1


def on(rung: str, **changes: Any) -> Scene:
    """The reference scene at a fidelity."""
    by = {"solver.name": "wave"} if rung == "wave" else {}
    return Scene().replace(**{"solver.fidelity": rung, **by, **changes})


def errors() -> str:
    """Error of each fidelity against the waves, Markdown."""
    lines = ["| scene | fidelity | " + " | ".join(f"{n}, %" for n in COMPARED.values()) + " |"]
    lines.append("|---" * (2 + len(COMPARED)) + "|")
    for name, changes in SCENES.items():
        wave = simulate(on("wave", **changes), DURATION).summary()
        for rung in RUNGS:
            found = simulate(on(rung, **changes), DURATION).summary()
            cells = [f"{100 * (found[key] / wave[key] - 1):+.2f}" for key in COMPARED]
            lines.append(f"| {name} | {rung} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def costs() -> str:
    """Processor time of each fidelity, Markdown."""
    lines = ["| fidelity | × real time | µs a blow |", "|---|---|---|"]
    for rung, duration in TIMED.items():
        best, blows = math.inf, 1
        for _ in range(5):
            simulation = Simulation(on(rung), record_events=False)
            began = time.process_time()
            simulation.advance(duration)
            best, blows = min(best, time.process_time() - began), len(simulation.blows)
        lines.append(f"| {rung} | {duration / best:.0f} | {1e6 * best / blows:.3g} |")
    return "\n".join(lines)


def random_points() -> str:
    """Rate at random points inside the usual table, as a sentence."""
    scene = on("blow-map")
    ends = {
        name: [float(scene[f"blow_map.{name}_{end}"]) for end in ("from", "to")]
        for name in ("velocity", "feed", "force", "stiffness")
    }
    rng = np.random.default_rng(SEED)
    off, refused = [], 0
    while len(off) < POINTS:
        v, force = (
            rng.uniform(ends["velocity"][0] + 1, ends["velocity"][1] - 1),
            rng.uniform(*ends["force"]),
        )
        changes = {
            "rock.loading_stiffness": math.exp(rng.uniform(*np.log(ends["stiffness"]))),
            "feed.force": rng.uniform(*ends["feed"]),
            "drive.force": force,
            "drive.reversal_distance": 0.87 * scene.piston.mass * v**2 / (4 * force),
            "start.piston_velocity": v,
        }
        try:
            fast = simulate(on("blow-map", **changes), DURATION)
        except SimulationError:
            refused += 1
            continue
        wave = simulate(on("wave", **changes), DURATION)
        off.append(fast.rate_of_penetration / wave.rate_of_penetration - 1)
    worst, mean = 100 * np.max(np.abs(off)), 100 * np.sqrt(np.mean(np.square(off)))
    return (
        f"At {POINTS} points drawn by the seed {SEED}, the rate of the blow map is off by at most "
        f"{worst:.2g} %, {mean:.2g} % root mean square; {refused} more were refused, where the bit "
        "still moves at impact."
    )


def draw() -> None:
    """Penetration per blow over impact velocity and feed, refused nodes marked."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    scene = on(
        "blow-map",
        **{
            "blow_map.stiffness_from": 7.5e8, "blow_map.stiffness_to": 7.6e8,
            "blow_map.velocity_from": 3.0, "blow_map.velocity_to": 14.0,
            "blow_map.feed_from": 100.0, "blow_map.feed_to": 12000.0,
            "blow_map.force_from": 2900.0, "blow_map.force_to": 3100.0,
            "blow_map.density": 1.5,
        },
    )  # fmt: skip
    table = make_map(scene, workers=1)
    speeds, loads, drives = (
        table.nodes.values(axis) for axis in (Axis.VELOCITY, Axis.LOAD, Axis.DRIVE)
    )
    rows = []
    for j, v in enumerate(speeds):
        m = int(np.argmin(np.abs(drives * v - scene.drive.force)))
        for k, load in enumerate(loads):
            feed, entry = load * v - table.nodes.weight, table.values[0, j, k, m]
            if not table.lowest[Axis.LOAD] <= feed <= table.highest[Axis.LOAD]:
                continue
            distance = 0.87 * scene.piston.mass * v**2 / (4 * scene.drive.force)
            rebound = min(v * entry[Entry.REBOUND], 0.0)
            flight = piston_cycle(scene.drive.force, distance, scene.piston.mass, rebound)
            still = entry[Entry.REST] <= flight.flight_time
            rows.append((v, feed, MM * v * entry[Entry.PENETRATION], still))
    x, y, depth, still = np.array(rows).T
    good = still > 0
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(6.4, 4.2), constrained_layout=True)
        dots = axes.scatter(x[good], y[good], c=depth[good], s=52, cmap="viridis", vmin=0)
        axes.scatter(x[~good], y[~good], marker="x", c="#D55E00", s=26,
                     label="refused: the bit still moves at impact")  # fmt: skip
        axes.set(
            yscale="log", xlabel="impact velocity, m/s", ylabel="feed force, N",
            title="Penetration per blow, reference rock and drive force",
        )  # fmt: skip
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), frameon=False)
        figure.colorbar(dots, label="penetration per blow, mm")
        figure.savefig(FIGURE, dpi=130)
        plt.close(figure)


def page() -> str:
    """Text of the page with its tables renewed."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    parts = [errors(), random_points(), costs()]
    return f"{before}{BEGIN}\n\n" + "\n\n".join(parts) + f"\n\n{END}{after}"


if __name__ == "__main__":
    ready_map(on("blow-map"))
    draw()
    PAGE.write_text(page(), encoding="utf-8")
