"""Chambers of hammers down the hole, fitted to the air and the output that a catalogue tells.

The piston is rigid and the bit at rest; output is that before a blow. Impact velocity is told, not
fitted. `benchmarks.chamber_intervals` fits, and writes what was found.
"""

from __future__ import annotations

import math
from functools import partial
from itertools import pairwise

import numpy as np
from scipy.optimize import differential_evolution

import percussion_model.physics.chambers as gas
from percussion_model.components.pneumatic import COMPONENT, open_air
from percussion_model.physics.gas import FREE_AIR
from percussion_model.physics.kernel import kernel
from percussion_model.scene.hammers.library import stored_hammer

# Velocity after a blow by that before it.
REBOUND = 0.3
# Blows from rest in a search, of which the last are looked at.
BLOWS, LAST = 12, 2
# Share of the outer circle that a piston's area may have; of the chamber that a stroke may take.
MOST_BORE, MOST_STROKE = 0.55, 0.9
LEAST_RATE, MOST_RATE, STROKES, UNREST = 23.0, 50.0, (0.08, 0.15), 0.01
# Air and output may be off by these, the air of some hammers by more.
USUAL_OFF, OUTPUT_OFF, AIR_OFF = 0.1, 0.15, {"sandvik-9-inch": 0.15}
# Masses [kg] are searched between these.
MASSES = {
    "sandvik-3-5-inch": (4.2, 5.12), "sandvik-4-inch": (7.4, 9.25), "sandvik-9-inch": (47.0, 58.7),
}  # fmt: skip
SEED, MEMBERS, ROUNDS = 7, 64, 110
# What is searched, by logarithms: areas by the outer circle, by the upper area or by each other,
# heights of volumes above an area, and ways from edge to edge [m].
SPACE = {
    "upper_area": (0.25, 0.55), "lower_area": (0.75, 1.0), "upper_volume": (0.1, 0.26),
    "lower_volume": (0.01, 0.12), "exhaust_volume": (0.03, 0.5),
    "upper_exhaust_edge": (0.01, 0.06), "lower_intake_edge": (2e-3, 0.04),
    "upper_intake_edge": (2e-3, 0.05), "lower_exhaust_edge": (2e-3, 0.05),
    "upper_exhaust": (0.01, 0.4), "lower_intake": (0.01, 0.4), "upper_intake": (0.01, 0.4),
    "lower_exhaust": (0.01, 0.4), "flushing": (0.03, 0.5), "bypass": (1e-4, 0.02),
}  # fmt: skip
EDGES = [key for key in SPACE if key.endswith("_edge")]
DTYPE = np.dtype(
    [("mass_p", "f8"), ("gravity", "f8")]
    + [(f"pneumatic_{key}", "f8") for key in COMPONENT.parameters]
)


@kernel
def strike(pars, supply, out):
    """Let a piston strike from rest; rows are time, velocity, air, and stroke of a blow."""
    par, n, t, begun, most = pars[0], 0, 0.0, 0.0, 0.0
    hole = par.pneumatic_ambient_pressure
    y = gas.started(open_air(par, hole, 0.0), 1e-3, 0.0)
    while n < out.shape[0] and t - begun < 0.15:
        span = par.pneumatic_step
        z = gas.go(par, supply, hole, y, gas.flight(span))
        if z.x < 0.0:
            for _ in range(4):
                if z.v >= 0.0:
                    return n
                span = min(max(span - z.x / z.v, 1e-7), par.pneumatic_step)
                z = gas.go(par, supply, hole, y, gas.flight(span))
            begun = t + span
            out[n, 0], out[n, 1], out[n, 2], out[n, 3] = begun, -z.v, z.done.used, most
            n, most = n + 1, 0.0
            z = gas.started(z.gas, 0.0, -REBOUND * z.v)
        t, y = t + span, z
        most = max(most, z.x)
        if par.pneumatic_upper_area * most > MOST_STROKE * par.pneumatic_upper_volume:
            return n
    return n


def outer(name: str) -> float:
    """Outer diameter [m]."""
    return stored_hammer(name).figure("outer_diameter").value


def told(name: str, key: str) -> dict[float, float]:
    """Catalogue's numbers of a quantity by their pressure [Pa]."""
    return {one.at: one.value for one in stored_hammer(name).figures if one.key == key}


def run(name: str, values: dict[str, float], blows: int = BLOWS) -> np.ndarray | None:
    """Rate, velocity, free air [m^3/s], stroke and unrest at each pressure; None if it stalls."""
    par, rows = np.zeros(1, DTYPE), []
    given = {key: row[0] for key, row in COMPONENT.parameters.items()} | values
    par["mass_p"], par["gravity"] = given.pop("mass"), 9.81
    for key, value in given.items():
        par[f"pneumatic_{key}"] = value
    for at in told(name, "air_consumption"):
        out = np.zeros((blows, 4))
        if strike(par, at + given["ambient_pressure"], out) < blows:
            return None
        last, time = out[-LAST:], out[-1, 0] - out[-1 - LAST, 0]
        v = math.sqrt(np.mean(last[:, 1] ** 2))
        air, unrest = last[:, 2].sum() / time / FREE_AIR, np.ptp(last[:, 1]) / v
        rows.append((LAST / time, v, air, last[:, 3].max(), unrest))
    return np.array(rows)


def reached(name: str, values: dict[str, float], found: np.ndarray) -> np.ndarray:
    """Air at each pressure, and output at the highest, by what the catalogue tells."""
    output = 0.5 * values["mass"] * found[-1, 1] ** 2 * found[-1, 0]
    air = found[:, 2] / list(told(name, "air_consumption").values())
    return np.append(air, output / told(name, "impact_power")[2.4e6])


def faults(name: str, values: dict[str, float], found: np.ndarray, spare: float = 1.0) -> float:
    """By what shares a set is beyond criteria that are not the catalogue's, together."""
    rate, strokes = found[-1, 0], found[:, 3]
    circle = MOST_BORE * math.pi / 4 * outer(name) ** 2
    pairs = [
        (max(values["upper_area"], values["lower_area"]), circle * 1.001),
        (found[:, 4].max(), UNREST),
        (LEAST_RATE * spare, rate), (rate * spare, MOST_RATE),
        (STROKES[0] * spare, strokes.min()), (strokes.max() * spare, STROKES[1]),
        *pairwise(values[key] for key in EDGES),
    ]  # fmt: skip
    return sum(max(is_ / most - 1.0, 0.0) for is_, most in pairs)


def off(name: str, values: dict[str, float], found: np.ndarray) -> np.ndarray:
    """Deviations from the catalogue by what is allowed."""
    allowed = [AIR_OFF.get(name, USUAL_OFF)] * 3 + [OUTPUT_OFF]
    return (reached(name, values, found) - 1.0) / allowed


def set_of(name: str, z: np.ndarray) -> dict[str, float]:
    """Parameters from what is searched, to three digits."""
    values = dict(zip(["mass", *SPACE], map(float, np.exp(z)), strict=True))
    values["upper_area"] *= math.pi / 4 * outer(name) ** 2
    values["lower_area"] *= values["upper_area"]
    values["lower_volume"] *= values["lower_area"]
    for key in ["upper_volume", "exhaust_volume", *list(SPACE)[9:]]:
        values[key] *= values["upper_area"]
    values |= zip(EDGES, np.cumsum([values[key] for key in EDGES]), strict=True)
    size = outer(name) / 0.105
    values |= {"leak": 2e-6 * size, "friction": 20.0 * size}
    return {key: float(f"{value:.3g}") for key, value in values.items()}


def cost(name: str, z: np.ndarray) -> float:
    """What the search makes small."""
    values = set_of(name, z)
    found = run(name, values)
    if found is None:
        return 1e3
    r = off(name, values, found)
    return float(np.abs(r).max() + 0.2 * (r @ r) + 20.0 * faults(name, values, found, 1.02))


def fit(name: str) -> dict[str, float]:
    """Search a set."""
    bounds = np.log([MASSES[name], *SPACE.values()])
    start = np.random.default_rng(SEED).uniform(*bounds.T, (MEMBERS, len(bounds)))
    search = differential_evolution(
        partial(cost, name), bounds, init=start, maxiter=ROUNDS, mutation=(0.4, 0.9),
        recombination=0.85, rng=SEED, polish=False, tol=1e-4,
    )  # fmt: skip
    return set_of(name, search.x)
