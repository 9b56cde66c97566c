"""Logs of holes whose rock is known, drilled by settled blows of another solver than the filter's.

With what logs have: noise, outliers, gaps, rod changes, a collar, a rate that lags.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from percussion_model.analysis.identify.cleaning import Log
from percussion_model.analysis.identify.drill import Drill
from percussion_model.analysis.identify.observation import (
    FRICTION,
    GAMMA,
    RENEWAL,
    SETTINGS,
    STIFFNESS,
    THRESHOLD,
    UNKNOWNS,
    Q,
    Table,
)
from percussion_model.analysis.identify.prior import KEYS, Prior
from percussion_model.analysis.identify.tabulate import ETA, IdentifyError
from percussion_model.analysis.stationary import settled

# What changes from layer to layer, and how much the crushing energy then does, by its logarithm;
# the others stay as they are in the hole but for this.
OF_LAYER, LEAP, SLIGHT = (GAMMA, STIFFNESS), 0.35, 0.05
# Noise of one sample by the logarithm; outliers, and rows that are lost, by their share.
NOISE = {"rate": 0.05, "frequency": 0.005, "torque": 0.1, "pressure": 0.004, "feed": 0.004}
OUTLIERS, LOST = 0.01, 0.02
LAG, ROD = 3, 3.0  # of the rate [samples], of rods [m]
CLOCK = 1.0  # from row to row [s]


@dataclass(frozen=True)
class Hole:
    """A log, and the truth at each of its rows.

    Attributes
    ----------
    log : Log
    tops : ndarray
        Where layers begin [m].
    unknowns : ndarray, shape (layers, 6)
        Their logarithms, by `UNKNOWNS`.
    """

    log: Log
    tops: np.ndarray
    unknowns: np.ndarray

    def truth(self, depth: np.ndarray, which: int = Q) -> np.ndarray:
        """Logarithm of an unknown at depths."""
        layer = np.searchsorted(self.tops, depth, side="right") - 1
        return np.asarray(self.unknowns[np.maximum(layer, 0), which])


def make_hole(
    drill: Drill,
    prior: Prior,
    schedule: Sequence[Mapping[str, float]],
    seed: int,
    tops: Sequence[float] = (0.0, 5.0, 10.0, 15.0),
    depth: float = 20.0,
    held: float = 0.5,
    table: Table | None = None,
) -> Hole:
    """Drill a hole through layers drawn from a prior.

    Parameters
    ----------
    drill : Drill
        With a pressure; the solver of its scene is that of the truth.
    schedule : sequence of mapping
        "pressure" [Pa], "feed" [N] and "speed" [rad/s] that follow each other, each for `held`
        metres; one, and nothing changes.
    tops : sequence of float
        Where layers begin [m].
    table : Table, optional
        Whose blows drill in place of the scene's.
    """
    random = np.random.default_rng(seed)
    whole = prior.mean + prior.spread * random.standard_normal(len(UNKNOWNS)).clip(-2.0, 2.0)
    unknowns = np.tile(whole, (len(tops), 1))
    unknowns[:, Q] = prior.mean[Q] + LEAP * random.standard_normal(len(tops)).clip(-2.0, 2.0)
    for k in OF_LAYER:
        drawn = random.standard_normal(len(tops)).clip(-2.0, 2.0)
        unknowns[:, k] = prior.mean[k] + prior.spread[k] * drawn
    for k in (RENEWAL, THRESHOLD, FRICTION):
        unknowns[:, k] += SLIGHT * random.standard_normal(len(tops))
    known: dict[tuple[int, int], np.ndarray] = {}
    rows: list[tuple[float, ...]] = []
    here, time, rods = 0.0, 0.0, 1
    while here < depth:
        layer = int(np.searchsorted(tops, here, side="right")) - 1
        which = int(here / held) % len(schedule)
        if (layer, which) not in known:
            known[layer, which] = _settled(drill, unknowns[layer], schedule[which], table)
        signals, given = known[layer, which], schedule[which]
        soft = min(1.0, 0.5 + here)  # collaring with less of all
        rows.append((time, here, *(soft * given[k] for k in ("pressure", "feed")), given["speed"],
                     soft * signals[0], signals[1], signals[2]))  # fmt: skip
        here += signals[0] * soft * CLOCK
        time += CLOCK
        if here > rods * ROD:
            rows += _rod_change(time, here, given)
            rods, time = rods + 1, rows[-1][0] + CLOCK
    return Hole(_with_faults(np.array(rows), seed, random), np.array(tops), unknowns)


def _settled(
    drill: Drill, unknowns: np.ndarray, given: Mapping[str, float], table: Table | None
) -> np.ndarray:
    """Rate, frequency and torque of the truth, SI."""
    if table is not None:
        here = np.array([given[name] for name in SETTINGS])
        return np.asarray(np.exp(table.predict(unknowns[np.newaxis], here)[0]))
    scene = drill.scene
    values = dict(zip(KEYS, np.exp(unknowns).tolist(), strict=False))
    values[KEYS[0]] *= scene[ETA]
    setting = {"feed.force": given["feed"], "rotation.speed": given["speed"]}
    changed = scene.replace(**drill.changes(given["pressure"]), **setting, **values)
    found = settled(changed, 1e-3, 200, scatter=0.01)
    if not found.rate_of_penetration > 0.0:
        raise IdentifyError("the hammer does not drill in a layer that was drawn")
    torque = float(np.mean(found.counted["rotation_torque"]))
    return np.array([found.rate_of_penetration, 1.0 / found.blow_period, torque])


def _rod_change(time: float, here: float, given: Mapping[str, float]) -> list[tuple[float, ...]]:
    """Rows of a bit that is pulled back while a rod is put in."""
    return [
        (time + k * CLOCK, here - 0.3, 0.05 * given["pressure"], 0.1 * given["feed"],
         0.2 * given["speed"], 0.0, 0.0, 5.0)
        for k in range(20)
    ]  # fmt: skip


def _with_faults(rows: np.ndarray, seed: int, random: np.random.Generator) -> Log:
    names = ("time", "depth", "pressure", "feed", "speed", "rate", "frequency", "torque")
    columns = dict(zip(names, rows.T.copy(), strict=True))
    count = len(rows)
    columns["rate"][LAG:] = columns["rate"][:-LAG].copy()
    for name, sigma in NOISE.items():
        columns[name] *= np.exp(sigma * random.standard_normal(count))
    for name in ("rate", "torque"):
        wild = random.random(count) < OUTLIERS
        columns[name][wild] *= np.exp(random.choice([-1.5, 1.5], int(wild.sum())))
        columns[name][random.random(count) < LOST] = np.nan
    kept = random.random(count) >= LOST
    kept[:1] = True
    columns = {name: values[kept] for name, values in columns.items()}
    return Log(f"hole {seed}", columns, np.flatnonzero(kept) + 2)


def steps_of(drill: Drill) -> list[dict[str, float]]:
    """Settings that tell rock and bit apart: as usual, less rotation, less pressure, more feed."""
    assert drill.pressure is not None
    usual = {
        "pressure": drill.pressure, "feed": 1.1 * drill.scene["feed.force"],
        "speed": drill.scene["rotation.speed"],
    }  # fmt: skip
    return [
        usual, usual | {"speed": 0.4 * usual["speed"]},
        usual | {"pressure": 0.88 * usual["pressure"]}, usual | {"feed": 1.14 * usual["feed"]},
    ]  # fmt: skip


def csv_text(hole: Hole) -> str:
    """Return a log as a rig would write it: its units in the heading, empty cells where none is."""
    shown = {
        "time": ("Time [s]", 1.0, ".0f"), "depth": ("Hole depth [m]", 1.0, ".3f"),
        "rate": ("Penetration rate [m/min]", 60.0, ".3f"),
        "pressure": ("Percussion pressure [bar]", 1e-5, ".2f"),
        "feed": ("Feed force [kN]", 1e-3, ".2f"),
        "speed": ("Rotation speed [rpm]", 30.0 / np.pi, ".1f"),
        "frequency": ("Frequency [Hz]", 1.0, ".2f"), "torque": ("Torque [N m]", 1.0, ".0f"),
    }  # fmt: skip
    lines = [",".join(head for head, _, _ in shown.values())]
    for k in range(len(hole.log.rows)):
        values = [(hole.log.columns[name][k] * f, form) for name, (_, f, form) in shown.items()]
        lines.append(",".join(f"{v:{form}}" if np.isfinite(v) else "" for v, form in values))
    return "\n".join(lines) + "\n"
