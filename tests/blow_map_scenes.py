"""Scenes on blow maps that are small enough to be made within a test run, or by hand."""

from __future__ import annotations

import numpy as np

from percussion_model import Scene, Simulation
from percussion_model.solvers.blow_map.records import ENTRIES, Entry
from percussion_model.solvers.blow_map.solver import BlowMapSolver
from percussion_model.solvers.blow_map.table import BlowTable, Nodes, fixed_values

# Around the reference: a few hundred blows, as dense as the usual table.
RANGES = {
    "velocity": (7.5, 9.5),
    "feed": (2000.0, 3500.0),
    "force": (2500.0, 3500.0),
    "stiffness": (6.8e8, 8.2e8),
}


def mapped(**changes):
    """The reference scene on a small map; further changes by key, with __ for a dot."""
    edges = {
        f"blow_map.{name}_{end}": value
        for name, pair in RANGES.items()
        for end, value in zip(("from", "to"), pair, strict=True)
    }
    given = {key.replace("__", "."): value for key, value in changes.items()}
    start = {"solver.fidelity": "blow-map", "start.piston_velocity": 9.0}
    return Scene().replace(**{**start, **edges, **given})


def by_hand(scene, **entries):
    """A table whose every node holds the same entries."""
    nodes = Nodes.of(scene)
    values = np.zeros((*nodes.counts, ENTRIES))
    for name, value in entries.items():
        values[..., Entry[name.upper()]] = value
    return BlowTable(nodes, values, fixed_values(scene), {}, 0.0)


def run_by_hand(scene, end, **entries):
    """Run a scene on such a table."""
    simulation = Simulation(scene, solver=BlowMapSolver(scene, by_hand(scene, **entries)))
    simulation.advance(end)
    return simulation
