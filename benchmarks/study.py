"""Time of one stationary response and of a study of 10,000 points, and what they are worth.

`python -m benchmarks.study --settled` compares the stationary response of the reference
with a run of 4 s. Without it the map of docs/studies.md is run as well, in a temporary folder,
then a random sample of its points for long, and on a finer grid. The kernels should be compiled
before (`python3 build.py setup`). Take figures for the record on an idle machine.
"""

from __future__ import annotations

import argparse
import os
import resource
import tempfile
import time
from multiprocessing import active_children
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
REFERENCE = ROOT / "scenarios" / "reference.toml"
# Long runs that the sample is compared with: blows, and those that settle.
LONG, SETTLING = 600, 100
# The run that one stationary response is compared with [s], and how often both are timed.
USUAL, REPETITIONS = 4.0, 40


def axes(points: int) -> dict[str, np.ndarray]:
    """Feed, rock and drive around the reference; 25 x 20 x 20 values make 10,000 points."""
    share = (points / 10_000) ** (1.0 / 3.0)
    feeds, others = (max(2, round(share * count)) for count in (25, 20))
    return {
        "feed.force": np.linspace(500.0, 10e3, feeds),
        "rock.loading_stiffness": np.geomspace(1e8, 2e9, others),
        "drive.reversal_distance": np.linspace(0.01, 0.08, others),
    }


def children_time() -> float:
    """Processor time of processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def one_response(scene) -> None:
    """Tell what the stationary response of a scene costs beside a run of `USUAL` seconds."""
    from percussion_model import settled, simulate

    ways = {"settled": lambda: settled(scene), "run": lambda: simulate(scene, duration=USUAL)}
    times = {name: [] for name in ways}
    found = {}
    for _ in range(REPETITIONS + 1):
        for name, way in ways.items():
            began = time.perf_counter()
            found[name] = way()
            times[name].append(1e3 * (time.perf_counter() - began))
    median = {name: float(np.median(taken[1:])) for name, taken in times.items()}
    rate, long = (found[name].rate_of_penetration for name in ways)
    print(f"settled: {len(found['settled'].blows)} blows, {median['settled']:.2f} ms; run of "
          f"{USUAL:g} s: {len(found['run'].blows)} blows, {median['run']:.1f} ms")  # fmt: skip
    print(f"share: {median['settled'] / median['run']:.1%} of the time; "
          f"rates differ by {abs(rate / long - 1.0):.1e}")  # fmt: skip


def main() -> None:
    """Run, tell, compare."""
    from percussion_model import Scene
    from percussion_model.analysis.study import grid, study

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--sample", type=int, default=30, help="points to compare")
    parser.add_argument("--settled", action="store_true", help="one response only")
    chosen = parser.parse_args()
    scene, points = Scene.from_toml(REFERENCE), grid(axes(chosen.points))
    one_response(scene)
    if chosen.settled:
        return
    load = os.getloadavg()[0]
    before, began = children_time(), time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        found = study(scene, points, folder, processes=chosen.processes)
        wall = time.perf_counter() - began
    for worker in active_children():  # only what has ended is counted
        worker.join()
    used = children_time() - before
    print(
        f"{len(points)} points in {wall:.1f} s with {chosen.processes} processes (load {load:.1f})"
    )
    print(f"processor time {used:.1f} s, {1e3 * used / len(points):.1f} ms a point")
    for name, text in found.headlines():
        print(f"{name}: {text}")
    aperiodic = found.rows["order"] == 0
    share = found.rows["wall_time"][aperiodic].sum() / found.rows["wall_time"].sum()
    print(f"{np.mean(aperiodic):.1%} of the points, aperiodic, take {share:.0%} of the time")
    compare(found, chosen.sample)


def compare(found, count: int) -> None:
    """Tell how far a random sample is off long runs, and off a grid of twice the cells."""
    from percussion_model import Simulation, settled
    from percussion_model.simulation.rate import rate_of_blows

    count = min(count, len(found.points))
    chosen = np.random.default_rng(8).choice(len(found.points), count, replace=False)
    off, finer = [], []
    for k in chosen.tolist():
        row = found.rows[k]
        scene = found.scene.replace(**found.points.changes(k))
        simulation = Simulation(scene, record_events=False)
        while len(simulation.blows) < LONG:
            simulation.advance(simulation.time + 50 * float(row["blow_period"]))
        blows = simulation.blows[SETTLING:]
        rate = rate_of_blows(blows)[0]
        off.append(row["rate_of_penetration"] / rate - 1.0)
        fine = settled(scene.replace(**{"solver.cells": 40}), scatter=1e-3).rate_of_penetration
        finer.append(row["rate_of_penetration"] / fine - 1.0)
    periodic = found.rows["order"][chosen] > 0
    off, finer = np.abs(off), np.abs(finer)
    print(f"{count} points against {LONG} blows: {np.sum(periodic)} periodic, off by at most "
          f"{off[periodic].max():.1e}; all: {off.max():.1e}")  # fmt: skip
    print(f"against 40 cells: median {np.median(finer):.1e}, at most {finer.max():.1e}, "
          f"{np.mean(finer > 1e-3):.0%} above 0.1 %")  # fmt: skip


if __name__ == "__main__":
    main()
