"""Section 4 of the paper repeated: drop tests, the stationary blow, and four sweeps."""

from __future__ import annotations

from percussion_model.scene.scene import Scene

# As the paper ran its simulations: rock that pulls in standstill.
PAPER = {"effects.standstill_tension": "paper"}


def paper_scene() -> Scene:
    """The reference scene with the rock law as printed."""
    return Scene(title="The reference of the paper").replace(**PAPER)
