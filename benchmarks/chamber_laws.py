"""Pressure laws that stand for the chambers of ready-made hammers.

`python -m benchmarks.chamber_laws` finds them at the rebound that each hammer's own rock gives,
with the mean recoil on the casing, and writes `percussion_model/scene/hammers/chambers/laws.toml`
anew (some seconds).
"""

from __future__ import annotations

from benchmarks.chamber_intervals import FOLDER
from percussion_model import simulate
from percussion_model.analysis.drive_map import LAW, blow_row, settled_row
from percussion_model.scene.hammers import AIR, with_chambers
from percussion_model.scene.text import write_text

TIME = 3.0  # of drilling for the mean recoil [s]
PRESSURES = (4e5, 6e5, 8e5, 10e5, 14e5, 18e5, 24e5, 30e5, 35e5)


def laws_of(name: str) -> list[str]:
    """Lines of a hammer, a number in each for every pressure."""
    scenes = [with_chambers(name, pressure) for pressure in PRESSURES]
    rows = [blow_row(scene, float(settled_row(scene)["rebound"])) for scene in scenes]
    keys = ("pressure", "rebound", *LAW)
    columns = {key: [row[key] for row in rows] for key in keys}
    columns["recoil"] = [
        simulate(scene, TIME, error_estimate=False).end["recoil_impulse"] / TIME for scene in scenes
    ]
    return [f"{key} = [{', '.join(f'{one:.5g}' for one in all_)}]" for key, all_ in columns.items()]


if __name__ == "__main__":
    lines = [line for name in AIR for line in ("", f"[{name}]", *laws_of(name))]
    told = "# SI units, at the rebound that the rock gives. benchmarks/chamber_laws.py wrote this."
    write_text(FOLDER / "laws.toml", "\n".join([told, *lines, ""]))
