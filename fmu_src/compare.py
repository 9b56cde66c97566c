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

# Label, factor and unit for print, output of the FMU, column of the blow table.
ROWS = (
    ("start of the last blow", 1.0, "s", "blow_time", "time"),
    ("depth at its start", 1e3, "mm", "blow_position", "bit_position"),
    ("penetration", 1e3, "mm", "penetration_per_blow", "hole_advance"),
    ("impact velocity", 1.0, "m/s", "impact_velocity", "impact_velocity"),
    ("blow energy", 1.0, "J", "blow_energy", "blow_energy"),
    ("stroke", 1e3, "mm", "piston.stroke", "stroke"),
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
    fmu, library = both["fmu"], both["library"]
    same = len(fmu) == len(library)
    lines = [f"{'':24}{'FMU in fmpy':>16}{'library':>16}{'difference':>14}"]

    def add(label: str, unit: str, a: float, b: float, difference: float) -> None:
        lines.append(f"{f'{label} [{unit}]':24}{a:16.9g}{b:16.9g}{difference:14.2g}")

    rates = [
        _rate(table, time_name, advance, settle)
        for table, time_name, advance in (
            (fmu, "blow_time", "penetration_per_blow"),
            (library, "time", "hole_advance"),
        )
    ]
    a, b = (1e3 * rate for rate in rates)
    add("rate of penetration", "mm/s", a, b, a - b)
    for label, factor, unit, output, column in ROWS:
        a, b = fmu[output], library[column]
        worst = float(np.max(np.abs(a - b))) if same else float("nan")
        add(label, unit, factor * a[-1], factor * b[-1], factor * worst)
    lines.append(
        f"{len(fmu)} and {len(library)} whole blows; the difference is the greatest over all of "
        f"them. FMU {both['seconds'][0]:.1f} s, library {both['seconds'][1]:.1f} s. "
        f"With the error of grid and scatter the rate is {both['rate']} mm/s."
    )
    return "\n".join(lines)


def _rate(table: Any, time_name: str, advance: str, settle: float) -> float:
    """Advance of the hole by time from the first to the last blow start after settling [m/s]."""
    counted = table[table[time_name] >= settle]
    took = counted[time_name][-1] - counted[time_name][0]
    return float(np.sum(counted[advance][:-1]) / took)


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
