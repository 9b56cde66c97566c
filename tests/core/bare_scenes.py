"""Scenes with nothing in them but what an oracle is about, and the numbers of their bars."""

from __future__ import annotations

import math

from percussion_model import Scene, Section

AREA, E, RHO = 5.5e-3, 210e9, 7850.0
C0 = math.sqrt(E / RHO)
Z = AREA * math.sqrt(E * RHO)
L_P, L_B = 0.175, 0.20125
G, F_S = 10.0, 2500.0
GAP = 1e-5
# A reading at a grid point is of 1e-6 steps later: this share of a path of 20 cells.
READING = 1e-7

# Nothing but what an oracle is about.
BARE = {
    "effects.drive": "none",
    "effects.gravity": False,
    "effects.feed": False,
    "effects.loss": False,
    "effects.rock": "none",
    "start.gap": GAP,
    "run.settle": 0.0,
}
SPRING = BARE | {"effects.rock": "spring", "start.rock_gap": 0.0}


def bare(**changes):
    return Scene().replace(**BARE | changes)


def bar(length, area=AREA):
    return (Section(length=length, area=area),)
