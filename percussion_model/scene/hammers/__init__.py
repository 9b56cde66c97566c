"""Hammers as scenes: what is on the market, with the sources of the numbers in the docs."""

from __future__ import annotations

import math
from pathlib import Path

from percussion_model.scene.bar_groups import MOST_RODS
from percussion_model.scene.rows import SceneError
from percussion_model.scene.scene import Scene
from percussion_model.scene.text import read_toml

_HERE = Path(__file__).parent
CHAMBER_FILES = _HERE / "chambers"
# A top hammer has so many rods where nothing else is asked for.
USUAL_RODS = 4
# No temperature falls beyond this height, and none is drilled at [m].
HIGHEST = 11e3
# Hammers with air or oil in their chambers, and whose of `chambers` these are.
AIR = {
    "dth3": "sandvik-3-5-inch",
    "dth4": "sandvik-4-inch",
    "dth5": "sandvik-5-inch",
    "dth6": "sandvik-6-inch",
}
# The feed that holds a casing, by the recoil of the hammer in its own rock.
HELD = 1.1
CHAMBERS = {**AIR, "hc25": "montabert-hc-25", "t38": "cop-1838"}


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


def with_chambers(name: str, pressure: float, rods: int | None = None) -> Scene:
    """Return the scene of a hammer that air or oil drives, in chambers fitted to a catalogue.

    With `effects.drive = "pressure"` it has the pressure law that stands for them; oil, its own.
    The feed is that of the hammer, or more where the recoil of air would lift it.

    Parameters
    ----------
    name : str
        One of `CHAMBERS`.
    pressure : float
        Of air at the hammer, or the greatest of the pump, above that of the surroundings [Pa].
    rods : int, optional
        Of a top hammer.

    Raises
    ------
    SceneError
        If the hammer has no chambers, or the pressure is out of bounds.
    """
    scene = hammer(name, rods)
    if name not in CHAMBERS:
        raise SceneError(
            f"hammer {name}: no chambers are known of it: there are those of {', '.join(CHAMBERS)}"
        )
    drive = "pneumatic" if name in AIR else "hydraulic"
    numbers = read_toml(CHAMBER_FILES / f"{CHAMBERS[name]}.toml")[drive]
    changes = {f"{drive}.{key}": value for key, value in numbers.items()}
    law = _by_pressure(name, pressure, scene) if name in AIR else {}
    changes |= {"effects.drive": drive, f"{drive}.supply_pressure": pressure, **law}
    return scene.replace(**changes)


def _by_pressure(name: str, pressure: float, scene: Scene) -> dict[str, float]:
    """Pressure law and feed, straight between those stored; beyond, forces go with pressure."""
    from numpy import interp

    rows = read_toml(_HERE / "chambers" / "laws.toml")[name]
    known = min(max(pressure, rows["pressure"][0]), rows["pressure"][-1])
    force, distance, recoil = (
        float(interp(known, rows["pressure"], rows[key]))
        for key in ("force", "reversal_distance", "recoil")
    )
    beyond = max(pressure, 0.0) / known
    weight = scene.feed.casing_mass * scene.gravity.acceleration
    holds = HELD * recoil * beyond - weight
    return {
        "drive.force": round(force * beyond, 1),
        "drive.reversal_distance": round(distance, 6),
        "feed.force": max(scene.feed.force, round(holds, -2)),
    }


def atmosphere(height: float) -> tuple[float, float]:
    """Pressure [Pa] and temperature [K] of the standard atmosphere, ISO 2533, at a height [m]."""
    share = 1.0 - 2.25577e-5 * height
    return round(101_325.0 * share**5.25588, 1), round(288.15 * share, 2)


def at_altitude(scene: Scene, height: float) -> Scene:
    """Return the scene of a hammer with air in its chambers at a height above the sea [m].

    Pressures of the supply are above that of the surroundings, a compressor's flow is by mass.
    """
    if scene.effects.drive != "pneumatic":
        raise SceneError(
            "altitude: needs air in chambers, as by percussion new --pressure: effects.drive = "
            '"pneumatic"'
        )
    if not -1000.0 <= height <= HIGHEST:
        raise SceneError(f"altitude = {height:g} m: must be a number from -1000 to {HIGHEST:g} m")
    values = zip(("pressure", "temperature"), atmosphere(height), strict=True)
    return scene.replace(**{f"pneumatic.ambient_{name}": value for name, value in values})


def bar_test() -> Scene:
    """A striker, a long bar and rock at its end, as in the tests of Saksala et al. (2014).

    T. Saksala, D. Gomon, M. Hokka, V.-T. Kuokkala, Int. J. Impact Eng. 72 (2014) 56: striker of
    22 x 200 mm, bar of 32 x 1190 mm, three buttons on Kuru granite, loading stiffness about
    162 kN/mm (second hand).
    """
    return Scene(
        title="Striker, bar and rock",
        piston={"sections": [{"length": 0.2, "area": round(math.pi / 4 * 0.022**2, 9)}]},
        bit={"sections": [{"length": 1.19, "area": round(math.pi / 4 * 0.032**2, 9)}]},
        effects={"gravity": False, "feed": False, "drive": "none", "barrier": False},
        rock={"loading_stiffness": 1.62e8},
        start={"piston_velocity": 10.0, "gap": 0.0, "rock_gap": 0.0},
        run={"duration": 1e-3, "settle": 0.0, "error_estimate": False},
    )
