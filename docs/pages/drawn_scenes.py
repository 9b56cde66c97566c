"""Scenes of scenarios/drawn, drawn by seed.

Geometry, rock, feed and drive are drawn evenly, ratios and wide ranges by their logarithm,
lengths to a millimetre. The first `COUNT` whose motion is periodic with one blow a cycle, and
soon so, are kept, whatever they show: few blows then tell the rate to more digits than asked for.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from docs.blocks import Made
from percussion_model import Scene, settled

SEED, COUNT = 15, 4
PISTON = 0.15, 0.35  # m
BIT_BY_PISTON = 0.7, 2.5
STIFFNESS = 1e8, 2e9  # N/m
UNLOADING = 2.0, 40.0
FEED = 500.0, 20e3  # N
REVERSAL = 0.01, 0.08  # m
# Modes by which the motion is judged, and how fast a disturbance must shrink from blow to blow.
MODES, SHRINKING = 40, 0.5
RUN = {"run.duration": 2.0, "run.settle": 0.6}  # s
TEXT = """\
# Drawn with seed {seed} by docs/pages/drawn_scenes.py; all else is as in the reference.
title = "{scene.title}"

[[piston.sections]]
length = {scene.piston.length}  # m
area = {scene.piston.sections[0].area}  # m^2

[[bit.sections]]
length = {scene.bit.length}  # m
area = {scene.bit.sections[0].area}  # m^2

[feed]
force = {scene.feed.force}  # N

[drive]
reversal_distance = {scene.drive.reversal_distance}  # m

[rock]
loading_stiffness = {scene.rock.loading_stiffness:.3g}  # N/m
unloading_ratio = {scene.rock.unloading_ratio}

[run]
duration = {scene.run.duration}  # s
settle = {scene.run.settle}  # s
"""


def drawn() -> Iterator[Scene]:
    """Scenes without end, each with its place in the title."""
    generator = np.random.default_rng(SEED)

    def spread(low: float, high: float) -> float:
        return math.exp(generator.uniform(math.log(low), math.log(high)))

    number = 0
    while True:
        number += 1
        piston = round(generator.uniform(*PISTON), 3)
        yield Scene(title=f"Drawn by seed, number {number}").replace(
            **{
                "piston.sections.0.length": piston,
                "bit.sections.0.length": round(piston * spread(*BIT_BY_PISTON), 3),
                "rock.loading_stiffness": float(f"{spread(*STIFFNESS):.3g}"),
                "rock.unloading_ratio": round(spread(*UNLOADING), 1),
                "feed.force": round(spread(*FEED), -1),
                "drive.reversal_distance": round(spread(*REVERSAL), 3),
                **RUN,
            }
        )


def made() -> Made:
    """Judge, tell, and keep."""
    kept: dict[str, str] = {}
    for number, scene in enumerate(drawn(), 1):
        found = settled(scene.replace(**{"solver.cells": MODES}))
        print(f"{number}: {found.kind}, {found.order} a cycle, multiplier {found.multiplier:.2g}")
        if found.order != 1 or not abs(found.multiplier) < SHRINKING:
            continue
        place = len(kept) + 1
        text = TEXT.format(seed=SEED, scene=scene)
        text = text.replace(scene.title, f"Drawn scene {place}, draw {number}")
        kept[f"../scenarios/drawn/drawn_{place}.toml"] = text
        if place == COUNT:
            break
    return Made(texts=kept)
