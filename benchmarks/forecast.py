"""Predicted and measured cost of runs over twenty scenes: `python -m benchmarks.forecast`.

`percussion explain` predicts what a run costs from its first blows; one that takes less than a
second is measured. Each scene is forecast, then run as `percussion run` does, and the two are
compared.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from percussion_model import Scene, simulate
from percussion_model.analysis.cost import FACTOR, forecast

HERE = Path(__file__).resolve().parent
LATEST = HERE / "latest_forecast.json"
REFERENCE = HERE.parent / "scenarios" / "reference.toml"
# The middle one of so many is shown.
REPEATS = 3

SCENES: dict[str, dict[str, Any]] = {
    "reference": {},
    "60 s": {"run.duration": 60.0},
    "40 cells": {"solver.cells": 40},
    "60 cells": {"solver.cells": 60},
    "accuracy 1e-2": {"solver.accuracy": 1e-2},
    "accuracy 1e-3": {"solver.accuracy": 1e-3},
    "no leaps": {"solver.leaps": False, "run.duration": 2.0},
    "no leaps, 60 cells": {"solver.leaps": False, "solver.cells": 60, "run.duration": 1.1},
    "loss off": {"effects.loss": False, "run.duration": 3.0},
    "barrier off": {"effects.barrier": False},
    "feed 500 N, 60 s": {"feed.force": 500.0, "run.duration": 60.0},
    "feed 200 N": {"feed.force": 200.0},
    "feed 20 kN": {"feed.force": 20000.0},
    "soft rock, 60 s": {"rock.loading_stiffness": 1e8, "run.duration": 60.0},
    "stiff rock, 30 s": {"rock.loading_stiffness": 5e9, "run.duration": 30.0},
    "gamma 40, 30 s": {"rock.unloading_ratio": 40.0, "run.duration": 30.0},
    "D_1 = 4 mm": {"drive.reversal_distance": 0.004},
    "D_1 = 80 mm, 60 s": {"drive.reversal_distance": 0.08, "run.duration": 60.0},
    "bit of 1 m": {"bit.sections.0.length": 1.05},
    "rigid piston, 20 s": {"piston.model": "rigid", "run.duration": 20.0},
    "drive off": {"effects.drive": "none", "run.duration": 3.0},
    "rigid": {"solver.name": "rigid", "run.duration": 200.0},
    "fem": {"solver.name": "fem", "run.duration": 2.0},
}


def main() -> None:
    """Print a table of ratios and keep them; names after the module choose scenes."""
    rows = []
    for name, changes in SCENES.items():
        if sys.argv[1:] and name not in sys.argv[1:]:
            continue
        others = {key: value for key, value in changes.items() if key != "solver.name"}
        solver = changes.get("solver.name")
        base = Scene.from_toml(REFERENCE)
        scene = base.computed_by(solver, **others) if solver else base.replace(**others)
        # in turn: a machine that slows down slows both
        pairs = [(forecast(scene).wall_time, simulate(scene).wall_time) for _ in range(REPEATS)]
        predicted, measured = sorted(pairs, key=lambda pair: pair[0] / pair[1])[REPEATS // 2]
        ratio = predicted / measured
        rows.append({"scene": name, "predicted": predicted, "measured": measured, "ratio": ratio})
        mark = "" if 1.0 / FACTOR <= ratio <= FACTOR else "  off"
        print(f"{name:20s} {predicted:9.3g} s {measured:9.3g} s {ratio:6.2f}{mark}", flush=True)
    ratios = [row["ratio"] for row in rows]
    print(f"predicted by measured: {min(ratios):.2f} to {max(ratios):.2f}, {len(rows)} scenes")
    LATEST.write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")
    sys.exit(any(not 1.0 / FACTOR <= ratio <= FACTOR for ratio in ratios))


if __name__ == "__main__":
    main()
