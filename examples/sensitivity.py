"""Sensitivity of the rate of penetration to eight parameters: Sobol indices by SALib.

Each parameter is drawn between half and twice its reference value, evenly in the logarithm. The
first-order index is the share of the variance of the rate that a parameter explains by itself, the
total index that in which it has a hand. Bars of confidence are from the bootstrap.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from examples.shared import BLUE, ORANGE, command_line, figure_of, study_points
from percussion_model import Scene
from percussion_model.analysis.study import table
from percussion_model.interface.plotting import style

NAME = "sensitivity"
PARAMETERS = {
    "feed.force": "feed force $F_S$",
    "drive.force": "drive force $F_0$",
    "drive.reversal_distance": "reversal distance $D_1$",
    "rock.loading_stiffness": "loading stiffness $K_R$",
    "rock.unloading_ratio": "unloading / loading stiffness $\\gamma$",
    "rock.barrier_damping": "barrier damping $C_R$",
    "rock.barrier_energy": "barrier energy $W_R$",
    "loss.time": "loss time $\\eta$",
}
FACTOR = 2.0
CONFIDENCE = 0.95
MOST_BLOWS = 80
SEED = 7


def main(out: Path, quick: bool = False) -> dict[str, Any]:
    """Draw Sobol indices of the rate."""
    from SALib.analyze import sobol as indices
    from SALib.sample import sobol as samples

    out, scene = Path(out), Scene()
    ends = np.log(FACTOR) * np.array([-1.0, 1.0])
    problem = {
        "num_vars": len(PARAMETERS),
        "names": list(PARAMETERS),
        "bounds": [(np.log(scene[key]) + ends).tolist() for key in PARAMETERS],
    }
    count = 4 if quick else 256
    drawn = np.exp(samples.sample(problem, count, calc_second_order=False, seed=SEED))
    points = table(dict(zip(PARAMETERS, drawn.T, strict=True)))
    found = study_points(points, out, quick, MOST_BLOWS)
    rate = found.rows["rate_of_penetration"]
    if not np.isfinite(rate).all():
        raise SystemExit(f"{np.sum(~np.isfinite(rate))} points have no rate: see {out / 'points'}")
    # SALib asks for an even spread about zero to be as exact as it can be.
    shares = indices.analyze(
        problem, (rate - rate.mean()) / rate.std(), calc_second_order=False,
        conf_level=CONFIDENCE, seed=SEED,
    )  # fmt: skip
    order = np.argsort(shares["ST"])
    with figure_of(NAME, out, (7.6, 4.6)) as fig:
        ax = fig.subplots()
        bars = (("ST", 0.2, BLUE, "total"), ("S1", -0.2, ORANGE, "first order"))
        for key, shift, colour, words in bars:
            ax.barh(
                np.arange(len(order)) + shift, shares[key][order], 0.38,
                xerr=shares[f"{key}_conf"][order], color=colour, label=words,
                error_kw={"elinewidth": 1.0, "capsize": 2.5},
            )  # fmt: skip
        ax.set_yticks(np.arange(len(order)), np.array(list(PARAMETERS.values()))[order])
        ax.grid(axis="y", visible=False)
        ax.legend(loc="lower right")
        style.label(
            ax, f"share of the variance of the rate [-], bars: {100 * CONFIDENCE:g} % intervals", ""
        )
        style.head(
            fig, f"What decides the rate: {len(PARAMETERS)} parameters, a half to twice each"
        )
    return {
        "points": len(points),
        "indices": {
            key: {name: float(shares[name][k]) for name in ("S1", "S1_conf", "ST", "ST_conf")}
            for k, key in enumerate(PARAMETERS)
        },
    }


if __name__ == "__main__":
    command_line(main, NAME)
