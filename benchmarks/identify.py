"""Rock from logs: does the filter's interval hold? `python -m benchmarks.identify [HOLES]`.

Holes through layers that are drawn anew, drilled by travelling waves, written as logs with noise,
outliers, gaps and rod changes, read as the command reads them, and told by a table of modes.
Beside it stands the usual index of hardness, with its scale from the truth of the whole hole.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.hardness_index import hardness_index
from docs.blocks import DOCS, renewed
from percussion_model.analysis.identify.drill import Drill, drill_of
from percussion_model.analysis.identify.observation import (
    FRICTION,
    RENEWAL,
    SIGNALS,
    THRESHOLD,
    Q,
    Table,
)
from percussion_model.analysis.identify.plan import slopes_of
from percussion_model.analysis.identify.prior import prior_of
from percussion_model.analysis.identify.profile import SURE, Profile, identify
from percussion_model.analysis.identify.synthetic import (
    LEAP,
    NOISE,
    SLIGHT,
    Hole,
    csv_text,
    make_hole,
    steps_of,
)
from percussion_model.interface.drill_log import read_log
from percussion_model.scene.hammers import hammer
from percussion_model.scene.text import write_text
from percussion_model.simulation.markdown import table

HAMMER, ROCK = "dth5", "kuru-granite"
# What was asked: behind a layer's top, after so much hole [m], q within so much.
AFTER, WITHIN = 2.0, 0.1
# So many holes are told in this page.
PUBLISHED, PAGE = 200, DOCS / "tutorials" / "rock_from_a_log.md"
# Errors of a table that has none, by the logarithm.
EXACT = np.array([1e-3, 5e-4, 3e-3])
# Hole over which an error behind a layer is a mean [m].
OVER = 0.15


@dataclass(frozen=True)
class Score:
    """Of one hole.

    Attributes
    ----------
    covered, covered_late : float
        Share of samples whose interval holds the truth: of all, and of those `AFTER` a top.
    spread : float
        Median standard deviation of ln q there.
    errors, index_errors : ndarray
        Of ln q by the filter and by the usual index, `AFTER` the top of each layer; the index
        has its scale from the truth of this hole.
    scale : float
        Its logarithm.
    samples : ndarray of int
        From there to the top.
    layers, found : int
        Changes that there are, and that were found.
    told : bool
        Whether the renewal length is said to be told.
    bounds : ndarray
        Least standard deviations of the errors.
    """

    covered: float
    covered_late: float
    spread: float
    errors: np.ndarray
    index_errors: np.ndarray
    scale: float
    samples: np.ndarray
    layers: int
    found: int
    told: bool
    bounds: np.ndarray


def bounds(hole: Hole, found: Profile) -> np.ndarray:
    """Least standard deviations of ln q, `AFTER` each top, that any estimator has.

    The bound of H. L. Van Trees (1968): the information of all samples up to there with that of the
    prior, for one who knows tops, noise, the response and how rocks were drawn.
    """
    layers, spread = len(hole.tops), found.prior.spread
    common = spread * np.isin(np.arange(6), (RENEWAL, THRESHOLD, FRICTION))
    own = np.where(common > 0.0, SLIGHT, spread)
    own[Q] = LEAP
    known = np.kron(np.eye(layers), np.diag(own**2))
    known += np.kron(np.ones((layers, layers)), np.diag(common**2))
    told = np.linalg.inv(known)
    precision = np.array([NOISE[name] ** -2.0 for name in SIGNALS])
    least = []
    for k, top in enumerate(hole.tops):
        at = np.flatnonzero(np.searchsorted(hole.tops, found.depth, side="right") - 1 == k)
        slopes = slopes_of(found.table, hole.unknowns[k], found.samples.settings[at])
        each = np.einsum("nsi,s,nsj->nij", slopes, precision, slopes)
        here = slice(6 * k, 6 * k + 6)
        early = told.copy()
        early[here, here] += each[found.depth[at] < top + AFTER].sum(axis=0)
        least.append(math.sqrt(np.linalg.inv(early)[6 * k + Q, 6 * k + Q]))
        told[here, here] += each.sum(axis=0)
    return np.array(least[1:])


def drills() -> tuple[Drill, Drill]:
    """Drill of the filter, by modes, and that of the truth, by waves."""
    scene = hammer(HAMMER)
    own = drill_of(scene.computed_by("modal"), HAMMER)
    return own, Drill(scene.computed_by("wave"), own.pressure)


def score(hole: Hole, found: Profile) -> Score:
    """Compare a profile with the truth."""
    truth = hole.truth(found.depth)
    off = found.mean[:, Q] - truth
    holds = np.abs(off) < SURE * found.spread[:, Q]
    top = hole.tops[np.searchsorted(hole.tops, found.depth, side="right") - 1]
    behind = found.depth - top
    index = hardness_index(found.samples)
    scale = float(np.median(index - truth))
    index = index - scale
    errors, others, samples = [], [], []
    for one in hole.tops[1:]:
        at = (top == one) & (behind > AFTER) & (behind < AFTER + OVER)
        errors.append(np.mean(off[at]))
        others.append(np.mean(index[at] - truth[at]))
        samples.append(int(np.sum((top == one) & (behind <= AFTER))))
    late = behind > AFTER
    return Score(
        float(holds.mean()), float(holds[late].mean()), float(np.median(found.spread[late, Q])),
        np.array(errors), np.array(others), scale, np.array(samples), len(hole.tops) - 1,
        len(found.layers), found.determined()["renewal_length"], bounds(hole, found),
    )  # fmt: skip


def campaign(
    seeds: Iterable[int], steps: bool, exact: bool = False, table: Table | None = None
) -> list[Score]:
    """Scores of holes; `steps` of rotation, pressure and feed, or one slow rotation alone.

    Of `exact` holes the blows are those of the filter's table, which then has no errors.
    """
    own, truth = drills()
    prior = prior_of(own.scene, ROCK)
    schedule = steps_of(truth)
    if not steps:
        schedule = schedule[1:2]
    if exact:
        first = make_hole(truth, prior, schedule, 0)
        table = replace(identify(first.log, own, ROCK).table, errors=EXACT)
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            hole = make_hole(truth, prior, schedule, seed, table=table if exact else None)
            path = Path(folder) / f"hole_{seed}.csv"
            path.write_text(csv_text(hole), encoding="utf-8")
            profile = identify(read_log(path), own, ROCK, table=table)
            table = profile.table
            found.append(score(hole, profile))
    return found


def allowed(scores: list[Score]) -> float:
    """Share of layers that the bound lets be within `WITHIN`."""
    least = np.concatenate([one.bounds for one in scores])
    return float(np.mean([math.erf(WITHIN / (math.sqrt(2.0) * one)) for one in least]))


def cells(scores: list[Score]) -> dict[str, str]:
    """Say what holes come to, by what it is."""
    errors = np.concatenate([one.errors for one in scores])
    others = np.concatenate([one.index_errors for one in scores])
    middle = np.median([one.scale for one in scores])
    blind = np.concatenate([one.index_errors + one.scale - middle for one in scores])
    samples = np.concatenate([one.samples for one in scores])
    covered, late = (
        f"{100.0 * np.mean([getattr(one, name) for one in scores]):.1f} %"
        for name in ("covered", "covered_late")
    )
    shares = [
        f"{100 * np.median(np.abs(off)):.1f} %; {100 * np.mean(np.abs(off) < WITHIN):.0f} %"
        for off in (errors, others, blind)
    ]
    found = sum(one.found for one in scores)
    least = np.concatenate([one.bounds for one in scores])
    spread = 100 * np.median([one.spread for one in scores])
    return {
        "holes; layers behind others; found": f"{len(scores)}; {len(errors)}; {found}",
        "intervals of 95 % hold, of all samples": covered,
        f"of those more than {AFTER:g} m below a top": late,
        "standard deviation there": f"{spread:.1f} %",
        f"samples to {AFTER:g} m below a top": f"{np.median(samples):.0f}",
        f"error there, median; layers within {100 * WITHIN:g} %": shares[0],
        "the same by the bound of any estimator": f"{67 * np.median(least):.1f} %; "
        f"{100 * allowed(scores):.1f} %",
        "the same of the usual index, its scale from the truth of each hole": shares[1],
        "the same, one scale for all holes": shares[2],
        "holes in which the renewal length is said to be shown": f"{sum(o.told for o in scores)}",
    }


def main(holes: int) -> None:
    """Print both campaigns and the time of an hour at 1 Hz."""
    stepped = cells(campaign(range(holes), steps=True))
    slow = cells(campaign(range(holes // 4), steps=False))
    exact = cells(campaign(range(holes // 4), steps=True, exact=True))
    rows = [[what, stepped[what], exact[what], slow[what]] for what in stepped]
    heads = ["", "steps of rotation, pressure, feed", "the same, response known exactly",
             "one slow rotation"]  # fmt: skip
    told = table(heads, rows)
    print(told)
    if holes >= PUBLISHED:
        write_text(PAGE, renewed(PAGE, {"holes": told}))
    own, truth = drills()
    hole = make_hole(truth, prior_of(own.scene, ROCK), steps_of(truth), 1, depth=40.0)
    began = time.process_time()
    profile = identify(hole.log, own, ROCK)
    whole = time.process_time() - began
    began = time.process_time()
    identify(hole.log, own, ROCK, table=profile.table)
    rows, again = len(hole.log.rows), time.process_time() - began
    print(f"{rows} rows at 1 Hz: {whole:.1f} s of processor, without the table {again:.1f} s, "
          f"{1e3 * again / len(profile.depth):.2f} ms a sample")  # fmt: skip


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
