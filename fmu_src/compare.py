"""The reference scene through the FMU and through the library, side by side.

`python -m fmu_src.compare` builds dist/PercussiveHammer.fmu, runs it in fmpy, and
prints what both find and by how much they differ.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from fmu_src.archive import content, state_of
from fmu_src.hammer.build import build_hammer, refuse_other
from fmu_src.run import run_fmu
from percussion_model.interface.progress import progress
from percussion_model.scene.presets import scene_presets
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.simulate import simulate
from percussion_model.simulation.uncertain import rate_text

DEFAULT = Path("dist") / "PercussiveHammer.fmu"
STEP_SIZE = 0.01  # of the communication [s]

# Label with its unit, factor for print, output of the FMU, column of the blow table.
ROWS = (
    ("start of the last blow [s]", 1.0, "blow_time", "time"),
    ("depth at its start [mm]", 1e3, "blow_position", "bit_position"),
    ("penetration [mm]", 1e3, "penetration_per_blow", "hole_advance"),
    ("impact velocity [m/s]", 1.0, "impact_velocity", "impact_velocity"),
    ("blow energy [J]", 1.0, "blow_energy", "blow_energy"),
    ("stroke [mm]", 1e3, "piston.stroke", "stroke"),
)


def run_both(scene: Scene, path: Path) -> dict[str, Any]:
    """Run a scene through its FMU and through the library.

    Returns
    -------
    dict
        `fmu`: a row for each blow, outputs of the FMU; `library`: its blow table;
        `rate`: its rate of penetration with its error; `seconds` that both took.
    """
    build_hammer(scene, path)
    began = time.perf_counter()
    found = run_fmu(
        path, stop_time=scene.run.duration, step_size=STEP_SIZE, output_interval=STEP_SIZE
    )
    between = time.perf_counter()
    result = simulate(scene)
    ended = time.perf_counter()
    _, first = np.unique(found["blow_count"], return_index=True)
    return {
        "fmu": found[first[1:]],
        "library": result.blows,
        "rate": rate_text(result.summary()),
        "seconds": (between - began, ended - between),
    }


def describe(both: dict[str, Any], settle: float) -> str:
    """Write the last blow, the rate after settling, and all differences as a table."""
    fmu = {column: both["fmu"][output] for _, _, output, column in ROWS}
    library, counts = both["library"], [len(both[name]) for name in ("fmu", "library")]
    a, b = (1e3 * _rate(blows, settle) for blows in (fmu, library))
    rows = [("rate of penetration [mm/s]", a, b, a - b)]
    for label, factor, _, column in ROWS:
        one, other = factor * fmu[column], factor * library[column]
        worst = np.max(np.abs(one - other)) if counts[0] == counts[1] else np.nan
        rows.append((label, one[-1], other[-1], worst))
    lines = [f"{'':26}{'FMU in fmpy':>14}{'library':>16}{'difference':>14}"]
    lines += [f"{label:26}{a:14.9g}{b:16.9g}{off:14.2g}" for label, a, b, off in rows]
    lines.append(
        f"{counts[0]} and {counts[1]} whole blows; the difference is the greatest over all of "
        f"them. FMU {both['seconds'][0]:.1f} s, library {both['seconds'][1]:.1f} s. "
        f"With discretisation error and scatter the rate is {both['rate']} mm/s."
    )
    return "\n".join(lines)


def _rate(blows: Any, settle: float) -> float:
    """Advance of the hole by time from the first to the last blow start after settling [m/s]."""
    counted = blows["time"] >= settle
    time = blows["time"][counted]
    return float(np.sum(blows["hole_advance"][counted][:-1]) / (time[-1] - time[0]))


def main() -> int:
    """Compare on the reference scene."""
    scene = Scene.from_toml(scene_presets()["reference"])
    try:
        refuse_other(DEFAULT, scene)
    except SceneError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    before = content(DEFAULT)
    with progress("running the FMU and the library"):
        both = run_both(scene, DEFAULT)
    print(f"{DEFAULT}: {state_of(DEFAULT, before)}")
    print(f"The reference hammer for {scene.run.duration:g} s, by that FMU and by the library\n")
    print(describe(both, scene.run.settle), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
