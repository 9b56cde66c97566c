"""Scenes that once failed: found at random, most by the power law or cuttings, then made small."""

from __future__ import annotations

import pytest

from percussion_model import Scene
from tests.properties.checks import check_case
from tests.properties.scenes import Case

# What each scene differs in from the reference, its length [s], and further calls.
SCENES = {
    "less is given back the harder the blow, and the cycle resumes with less than the law gives": (
        {
            "effects": {"rock": "power"},
            "loss": {"time": 5e-8},
            "rock": {
                "loading_exponent": 2.0, "reference_penetration": 5.8e-4,
                "unloading_exponent": 4.4, "buttons": 2,
            },
            "start": {"piston_velocity": 14.0, "bit_velocity": 16.0, "rock_gap": 2e-15},
        },
        3.8e-4,
    ),
    "next to nothing is given back, by elements": (
        {
            "effects": {"rock": "power", "cuttings": True},
            "rock": {
                "unloading_exponent": 12.0, "reference_penetration": 1e-4, "removed_share": 0.3,
                "removed_by": "cycle",
            },
            "solver": {"name": "fem"},
        },
        0.5,
    ),
    "the reference penetration is far beyond that of the blow": (
        {
            "effects": {"rock": "power"},
            "rock": {
                "loading_stiffness": 7e10, "reference_penetration": 0.04, "barrier_damping": 50.0,
            },
            "solver": {"cells": 1},
        },
        1.1e-3,
    ),
    "stiff rock under a thin bit": (
        {
            "effects": {"drive": "external", "rock": "power"},
            "piston": {
                "sections": [{"length": 0.145, "area": 5e-5}, {"length": 0.2, "area": 0.007}],
            },
            "bit": {"sections": [{"length": 0.2, "area": 5e-5}]},
            "rock": {"loading_stiffness": 1.4e5, "unloading_exponent": 3.0, "buttons": 91},
        },
        4.6e-4,
    ),
    "stiff rock under two cells": (
        {
            "effects": {"drive": "external", "rock": "power"},
            "rock": {"buttons": 37, "barrier_energy": 0.0},
            "start": {"piston_velocity": 0.0},
            "solver": {"cells": 2},
        },
        0.013,
        (0.0745, "inputs", {"loading_stiffness": 4.36e10}),
    ),
    "the bit turns before it meets the cuttings, by elements of long steps": (
        {
            "effects": {"cuttings": True},
            "piston": {
                "sections": [{"length": 0.35, "area": 0.007}, {"length": 0.2, "area": 0.003}],
            },
            "bit": {"sections": [{"length": 0.2, "area": 0.0055}, {"length": 0.2, "area": 0.0055}]},
            "rock": {
                "loading_stiffness": 6e8, "unloading_ratio": 800.0, "removed_share": 0.3,
                "barrier_energy": 0.09, "removed_by": "cycle",
            },
            "start": {"piston_velocity": 6.0, "rock_gap": 9e-13},
            "solver": {"name": "fem"},
            "fem": {"elements": 5, "courant": 40.0},
        },
        6.6e-3,
    ),
    "the barrier breaks above the surface of the rock, by elements": (
        {
            "effects": {"drive": "none", "rock": "power"},
            "piston": {"model": "absent"},
            "bit": {"sections": [{"length": 0.19, "area": 7e-5, "youngs_modulus": 1.2e10}]},
            "feed": {"force": 8500.0},
            "rock": {
                "loading_exponent": 1.02, "reference_penetration": 5e-5, "buttons": 53,
                "barrier_energy": 0.06, "barrier_damping": 27.7,
            },
            "start": {"rock_gap": 0.09},
            "solver": {"name": "fem"},
            "fem": {"elements": 8, "courant": 0.11, "spectral_radius": 0.27},
        },
        1.7e-3,
    ),
    "a cycle resumes on a stiffer line than that of the cuttings": (
        {
            "effects": {"rock": "power", "cuttings": True},
            "piston": {"sections": [{"length": 0.09, "area": 0.005, "youngs_modulus": 1e9}]},
            "bit": {"sections": [{"length": 0.009, "area": 1e-5}]},
            "feed": {"force": 400.0},
            "rock": {
                "reference_penetration": 2e-3, "unloading_exponent": 0.15, "removed_share": 2e-5,
                "removed_by": "cycle",
            },
            "start": {"piston_velocity": -0.02},
            "solver": {"cells": 5},
        },
        6.1e-3,
    ),
    "two modes, read closely, see the rock end turn": (
        {
            "effects": {"drive": "none"},
            "piston": {"model": "absent"},
            "bit": {
                "sections": [
                    {"length": 0.20125, "area": 3.2e-3, "youngs_modulus": 1.7e10},
                    {"length": 0.20125, "area": 5.5e-3, "youngs_modulus": 4.8e9},
                ],
            },
            "feed": {"force": 2760.0},
            "loss": {"time": 2.6e-7},
            "rock": {
                "unloading_ratio": 580.0, "barrier_damping": 6700.0, "barrier_energy": 2e-5,
            },
            "start": {"bit_velocity": 3.5e-3, "rock_gap": 1.6e-5},
            "solver": {"cells": 2},
        },
        0.06,
        (0.5, "sample", [0.5 + 0.005 * k for k in range(100)]),
    ),
    "contact that pulls between two looks has ended": (
        {"loss": {"time": 5.07e-8}, "start": {"gap": 5.17e-6}, "solver": {"cells": 8}},
        1.11e-4,
        (0.0428, "inputs", {"reversal_distance": 0.241, "loading_stiffness": 5.44e9}),
        (0.12, "detour", (0.651, {"feed_force": 6630.0, "barrier_damping": 5460.0})),
    ),
    "a stiff penalty far from the rock, by elements": (
        {
            "feed": {"force": -5400.0},
            "solver": {"name": "fem"},
            "fem": {"contact_stiffness": 2.9e14},
        },
        3.7,
    ),
    "a dashpot that stops a thin end": (
        {
            "effects": {"drive": "none", "rock": "power"},
            "bit": {
                "sections": [{"length": 0.2, "area": 5.5e-3}, {"length": 0.28, "area": 1.35e-5}],
            },
            "loss": {"time": 4.4e-8},
            "rock": {"barrier_damping": 9e6, "barrier_energy": 6e-5},
            "start": {"bit_velocity": -8.0},
            "solver": {"cells": 5},
        },
        2e-3,
    ),
    "a step that is cut ends an ulp before the closure": (
        {
            "effects": {"drive": "none", "loss": False},
            "piston": {"sections": [{"length": 2.18, "area": 5.5e-3}]},
            "bit": {"sections": [{"length": 0.00713, "area": 2.36e-5}]},
            "start": {"piston_velocity": 1.1e-10, "gap": 7.7e-10, "rock_gap": 2.25e-7},
            "solver": {"name": "wave", "cells": 10},
        },
        2e-3,
    ),
    "a reading past a step that the run cuts": (
        {
            "effects": {"drive": "none"},
            "loss": {"time": 2.7e-7},
            "rock": {"loading_stiffness": 4.4e10},
            "start": {"piston_velocity": 16.0, "rock_gap": 6.5e-6},
            "solver": {"name": "wave", "cells": 5},
        },
        9.3e-5,
        (0.656, "sample", [0.656, 0.871, 0.913]),
    ),
    "a light piston swings on oil while it touches": (
        {
            "effects": {"drive": "hydraulic", "barrier": False},
            "piston": {
                "sections": [
                    {"length": 0.175, "area": 1.8e-5, "youngs_modulus": 1e9, "density": 4700.0},
                ],
            },
            "hydraulic": {"rear_volume": 6.4e-5},
            "solver": {"name": "wave", "cells": 4},
        },
        0.1,
    ),
    "the last shape, out of place, turns the end back at once": (
        {
            "effects": {"drive": "none", "cuttings": True},
            "rock": {
                "unloading_ratio": 1000.0, "removed_share": 0.5, "chipping_penetration": 1e-5,
                "barrier_energy": 1e-10,
            },
            "solver": {"name": "modal", "cells": 3},
        },
        0.08,
    ),
    "an end goes back within a step": (
        {
            "effects": {"drive": "pneumatic", "rock": "power", "barrier": False},
            "piston": {"model": "rigid"},
            "bit": {"sections": [{"length": 0.2, "area": 5.5e-3, "density": 815.0}]},
            "loss": {"time": 8.7e-9},
            "rock": {"unloading_exponent": 5.0, "reference_penetration": 5.8e-4, "buttons": 783},
            "solver": {"name": "modal", "cells": 3},
        },
        1.5e-3,
        (0.05, "sample", [0.05 + 0.01 * step for step in range(96)]),
    ),
    "unloading far from where loading began": (
        {
            "effects": {"rock": "power"},
            "feed": {"force": 0.0},
            "rock": {
                "loading_stiffness": 1.2e4, "loading_exponent": 2.0, "reference_penetration": 0.5,
                "buttons": 2,
            },
            "solver": {"name": "modal"},
        },
        0.1,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_what_must_hold_of_any_scene(name):
    groups, length, *further = SCENES[name]
    scene = Scene(run={"duration": length, "settle": 0.0}, **groups)
    reads = [(share, "read", "energy") for share in (0.2, 0.4, 0.6, 0.8)]
    calls = sorted([*reads, *further], key=lambda call: call[0])
    check_case(Case(scene, length, calls, "wide"))
