"""Scenes on blow maps that are small enough to be made within a test run."""

from __future__ import annotations

from percussion_model import Scene

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
