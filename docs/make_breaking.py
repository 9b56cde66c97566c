"""Rates of presets, over rotation and over feed: `python -m docs.make_breaking`.

Writes docs/images/breaking.png and the table of docs/breaking.md. Takes a minute.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.blocks import DOCS, publish
from percussion_model import Scene, simulate
from percussion_model.interface.plotting import style
from percussion_model.scene.bits import bit, bit_of
from percussion_model.scene.hammers import hammer, hammers
from percussion_model.scene.rocks import rock
from percussion_model.scene.rocks.breaking import parameters_under
from percussion_model.simulation.markdown import table

ROCKS = ("kuru-granite", "st-anne-limestone", "sierra-white-granite")
# Feed that a maker of hammers of 3 to 6 inch recommends [N] (docs/data/hammer_sources.md).
FEEDS = {
    "dth3": (4400.0, 7600.0),
    "dth4": (6500.0, 12300.0),
    "dth5": (8300.0, 13500.0),
    "dth6": (9700.0, 18100.0),
}
DURATION, SETTLE = 20.0, 1.0
RPM = 2.0 * math.pi / 60.0
SPEEDS = (0.5, 1, 2, 3, 5, 7, 10, 14, 20, 28, 40, 55, 75, 100)
CASING_FEEDS = (3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 18, 21, 24, 27, 30, 34, 38)
MOTORS = (600.0, 900.0)
INDEX = (8.0, 15.0)  # usual on the gauge circle [mm]


def on_rock(name: str, scene: Scene) -> Scene:
    """Scene of a preset on a rock of the library."""
    return scene.replace(**parameters_under(rock(name), scene))


def summary_of(scene: Scene, **changes: Any) -> dict[str, Any]:
    """Summary of a run."""
    changed = scene.replace(**changes)
    return simulate(changed, DURATION, SETTLE, error_estimate=False).summary()


def preset_rows() -> Iterator[list[str]]:
    """A row for each preset and rock."""
    for name in hammers():
        for found in ROCKS:
            scene = on_rock(found, hammer(name))
            told = summary_of(scene)
            own = told["rate_of_penetration"]
            stiffness = scene.rock.loading_stiffness
            moved = [
                summary_of(scene, **{"rock.loading_stiffness": share * stiffness})
                for share in (0.95, 1.05)
            ]
            changes = [100.0 * (one["rate_of_penetration"] / own - 1.0) for one in moved]
            yield [
                name,
                found,
                f"{3600.0 * own:.1f}",
                f"{told['blow_energy']:.0f}",
                f"{1e-6 * told['specific_energy']:.0f}",
                f"{1e3 * gauge_index(scene, told):.1f}",
                f"{told['rotation_torque']:.0f}",
                " / ".join(f"{one:+.1f}" for one in changes),
                recoil_share(name, scene, told),
            ]


def gauge_index(scene: Scene, told: dict[str, Any]) -> float:
    """Arc between blows on the gauge circle [m]."""
    own = bit(bit_of(scene))
    return float(told["rotation_index"] * 0.5 * own.diameter / own.mean_radius.value)


def recoil_share(name: str, scene: Scene, told: dict[str, Any]) -> str:
    """Recoil by the least feed that makers recommend."""
    if name not in FEEDS:
        return "-"
    # over a blow piston and drive are balanced by the contact
    recoil = told["mean_contact_force"] - scene.piston.mass * scene.gravity.acceleration
    return f"{recoil / FEEDS[name][0]:.2f}"


HEADINGS = (
    "hammer", "rock", "m/h", "blow, J", "MJ/m³", "gauge index, mm", "torque, N m", "K ± 5 %, %",
    "recoil by least feed",
)  # fmt: skip


def over_rotation(scene: Scene) -> list[dict[str, float]]:
    """Rate, torque and index over the speed of rotation."""
    rows = []
    for rpm in SPEEDS:
        told = summary_of(scene, **{"rotation.speed": rpm * RPM})
        rows.append(
            {
                "rpm": rpm,
                "rate": 3600.0 * told["rate_of_penetration"],
                "torque": told["rotation_torque"],
                "index": 1e3 * gauge_index(scene, told),
            }
        )
    return rows


def over_feed(scene: Scene, motor: float) -> list[dict[str, float]]:
    """Rate and torque over the feed on the casing, with a motor of a torque [N m]."""
    rows = []
    for feed in CASING_FEEDS:
        told = summary_of(
            scene,
            **{
                "feed.force": 1e3 * feed,
                "rotation.stall_torque": motor,
                "rotation.full_torque": 0.8 * motor,
            },
        )
        rate = told["rate_of_penetration"] or 0.0
        rows.append(
            {"feed": feed, "rate": 3600.0 * rate, "torque": told["rotation_torque"] or math.nan}
        )
    return rows


def draw_rotation(axes: Axes, rows: list[dict[str, float]]) -> None:
    """Rate and torque over rotation."""
    rpm = np.array([row["rpm"] for row in rows])
    index = np.array([row["index"] for row in rows])
    axes.axvspan(*np.interp(INDEX, index, rpm), color="0.9", zorder=0)
    (rate,) = axes.plot(rpm, [row["rate"] for row in rows], "o-", ms=3, color="#0072B2")
    axes.set(xscale="log", xlabel="rotation [rpm]", ylabel="rate of penetration [m/h]")
    axes.set_ylim(bottom=0.0)
    other = axes.twinx()
    (torque,) = other.plot(rpm, [row["torque"] for row in rows], "s--", ms=3, color="#D55E00")
    other.set_ylabel("torque [N m]")
    other.set_ylim(bottom=0.0)
    axes.legend([rate, torque], ["rate", "torque"], loc="lower right")


def draw_feed(axes: Axes, series: dict[float, list[dict[str, float]]]) -> None:
    """Rate over feed for motors of two torques."""
    axes.axvspan(*(1e-3 * end for end in FEEDS["dth5"]), color="0.9", zorder=0)
    looks = zip(series.items(), ("#009E73", "#0072B2"), ("s--", "o-"), strict=True)
    for (motor, rows), colour, mark in looks:
        feed = [row["feed"] for row in rows]
        rate = [row["rate"] for row in rows]
        axes.plot(feed, rate, mark, ms=3, color=colour, label=f"motor of {motor:.0f} N m")
    axes.set(xlabel="feed on the casing [kN]", ylabel="rate of penetration [m/h]")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="lower left")


def main() -> None:
    """Compute and write all."""
    scene = on_rock(ROCKS[0], hammer("dth5"))
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    draw_rotation(left, over_rotation(scene))
    draw_feed(right, {motor: over_feed(scene, motor) for motor in MOTORS})
    style.save_png(figure, DOCS / "images" / "breaking.png", 110)
    publish({"presets": lambda: table(HEADINGS, preset_rows())}, DOCS / "breaking.md")


if __name__ == "__main__":
    main()
