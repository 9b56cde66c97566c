"""Hammers as scenes: what is on the market, with the sources of the numbers in the docs."""

from __future__ import annotations

from pathlib import Path

from percussion_model.scene.parameters import MOST_RODS
from percussion_model.scene.rows import SceneError
from percussion_model.scene.scene import Scene
from percussion_model.scene.text import read_toml

_HERE = Path(__file__).parent
# A top hammer has so many rods where nothing else is asked for.
USUAL_RODS = 4


def hammers() -> list[str]:
    """Names of the hammers that there are."""
    return sorted(path.stem for path in _HERE.glob("*.toml"))


def hammer(name: str, rods: int | None = None) -> Scene:
    """Return the scene of a hammer.

    Parameters
    ----------
    name : str
        One of `hammers()`.
    rods : int, optional
        How many rods are between the shank and the bit of a top hammer.

    Raises
    ------
    SceneError
        If there is no such hammer, or it cannot have so many rods.
    """
    if name not in hammers():
        raise SceneError(f"hammer {name!r}: must be one of {', '.join(hammers())}")
    tree = read_toml(_HERE / f"{name}.toml")
    bars = tree["bars"]
    if len(bars) == 2:
        if rods is not None:
            raise SceneError(f"hammer {name}: works down the hole, without rods")
        return Scene(**tree)
    count = USUAL_RODS if rods is None else rods
    if not 1 <= count <= MOST_RODS - 1:
        raise SceneError(f"rods = {count}: must be from 1 to {MOST_RODS - 1}")
    piston, shank, rod, bit = bars
    title = f"{tree['title']}: {count} of them" if count > 1 else f"{tree['title']}: one"
    return Scene(**{**tree, "title": title, "bars": [piston, shank, *[rod] * count, bit]})
