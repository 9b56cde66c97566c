"""Rates of presets, over rotation and over feed; takes a minute."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter

from docs.blocks import Made
from percussion_model import Scene, simulate
from percussion_model.scene.bits import bit, bit_of
from percussion_model.scene.hammers import hammer, hammers, with_chambers
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
# The ranges are for all pressures: the least goes with the lowest, as 12 bar by 20. Assumed.
LOW = 0.6
PRESSURE = 24e5  # of air [Pa]
# Of hammers of medium pressure, as that maker's are [Pa].
MEDIUM = (10e5, 12.5e5, 15e5)
DURATION, SETTLE = 20.0, 1.0
RPM = 2.0 * math.pi / 60.0
SPEEDS = (0.5, 1, 2, 3, 5, 7, 10, 14, 20, 28, 40, 55, 75, 100)
CASING_FEEDS = (3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 18, 21, 24, 27, 30, 34, 38)
MOTORS = (600.0, 900.0)
# Of a motor that fits each [N m], assumed, and torque by it up to which it holds its speed.
STALLS, FULL = {"dth3": 300.0, "dth4": 600.0, "dth5": 900.0, "dth6": 1500.0}, 0.8
# Of a pipe of 102 mm with walls of 6 mm on a hole of 140 mm [N m^2], by the fourth power of the
# diameter on others; lengths of it [m]; radius of gyration of a casing by that diameter. Assumed.
PIPE, PIPE_ON, LENGTHS, GYRATION = 3.3e5, 0.14, (5.0, 10.0, 20.0, 40.0, 80.0), 0.4
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
    return f"{recoil_of(scene, told) / FEEDS[name][0]:.2f}"


def recoil_of(scene: Scene, told: dict[str, Any]) -> float:
    """Mean force of the drive [N]: over a blow piston and drive are balanced by the contact."""
    weight = scene.piston.mass * scene.gravity.acceleration
    return float(told["mean_contact_force"]) - weight


def plateau(name: str, scene: Scene, first: float) -> tuple[list[float], float]:
    """Rates [m/h] by feeds from a first one [N] to where the motor loses speed; the last feed."""
    feed, rates, last = first, [], first
    told = with_motor(scene, feed, STALLS[name])
    while told["rotation_torque"] <= FULL * STALLS[name]:
        rates.append(3600.0 * told["rate_of_penetration"])
        last, feed = feed, 1.15 * feed
        told = with_motor(scene, feed, STALLS[name])
    return rates, last


def spread(rates: list[float]) -> str:
    """Least and greatest rate by their mean."""
    mean = float(np.mean(rates))
    return f"{100.0 * (min(rates) / mean - 1.0):+.0f} / {100.0 * (max(rates) / mean - 1.0):+.0f}"


def feed_rows() -> Iterator[list[str]]:
    """A row for each hammer down the hole and rock: rates from recoil to the motor."""
    for name in FEEDS:
        for found in ROCKS:
            scene, air = on_rock(found, hammer(name)), on_rock(found, with_chambers(name, PRESSURE))
            weight = scene["feed.casing_mass"] * scene.gravity.acceleration
            first = recoil_of(scene, summary_of(scene)) - weight
            rates, last = plateau(name, scene, first)
            jammed = with_motor(scene, 6.0 * first, STALLS[name])["rate_of_penetration"] or 0.0
            run = simulate(air, DURATION, SETTLE, error_estimate=False)
            first_air = run.end["recoil_impulse"] / run.duration - weight
            rates_air, last_air = plateau(name, air, first_air)
            yield [
                name,
                found,
                f"{1e-3 * first:.1f} to {1e-3 * last:.1f}",
                f"{np.mean(rates):.1f}",
                spread(rates),
                f"{3600.0 * jammed:.1f}",
                f"{1e-3 * first_air:.1f} to {1e-3 * last_air:.1f}",
                f"{np.mean(rates_air):.1f}",
                spread(rates_air),
            ]


def torque_rows() -> Iterator[list[str]]:
    """A row for each hammer down the hole and rock: torques at feeds of makers."""
    for name, (least, most) in FEEDS.items():
        for found in ROCKS:
            scene = on_rock(found, hammer(name))
            yield [
                name,
                found,
                torques_on_air(name, found, (least, 0.5 * (least + most), most)),
                torques([scene], least, most),
                torques([scene.replace(**string(scene, one)) for one in LENGTHS], least, most),
            ]


def torques_on_air(name: str, found: str, feeds: tuple[float, ...]) -> str:
    """Torques with chambers, at feeds of makers and the pressures that these go with."""
    told = []
    for pressure, feed in zip(MEDIUM, feeds, strict=True):
        scene = on_rock(found, with_chambers(name, pressure))
        told.append(summary_of(scene, **{"feed.force": feed})["rotation_torque"])
    return ", ".join(f"{one:.0f}" for one in told)


def string(scene: Scene, length: float) -> dict[str, float]:
    """A string of that length [m] above the casing."""
    assert scene.hole_diameter is not None
    size = scene.hole_diameter
    arm = GYRATION * size
    return {
        "rotation.string_stiffness": PIPE * (size / PIPE_ON) ** 4 / length,
        "rotation.inertia": scene["feed.casing_mass"] * arm * arm,
    }


def torques(scenes: list[Scene], least: float, most: float) -> str:
    """Torques at makers' least feed, that of the scene and the greatest, means of scenes."""
    drive, found = scenes[0].drive.force, []
    for share, feed in ((LOW, least), (1.0, least), (1.0, scenes[0].feed.force), (1.0, most)):
        changes = {"drive.force": share * drive, "feed.force": feed}
        told = [summary_of(one, **changes)["rotation_torque"] for one in scenes]
        found.append(f"{np.mean(told):.0f}")
    return ", ".join(found)


FEED_HEADINGS = (
    "hammer", "rock", "feed, kN", "mean m/h", "least / most, %", "m/h at six times the first",
    "on air: feed, kN", "mean m/h", "least / most, %",
)  # fmt: skip
TORQUE_HEADINGS = (
    "hammer", "rock", "on air, N m: least, middle, greatest feed",
    "by the pressure law, N m: least with 0.6 of the drive, least, own, greatest feed",
    "the same with strings that twist, N m",
)  # fmt: skip
HEADINGS = (
    "hammer", "rock", "m/h", "blow, J", "MJ/m³", "gauge index, mm", "torque, N m", "K ± 5 %, %",
    "recoil / least feed",
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


def with_motor(scene: Scene, feed: float, stall: float) -> dict[str, Any]:
    """Summary of a run at a feed [N] with a motor that stalls at a torque [N m]."""
    motor = {"rotation.stall_torque": stall, "rotation.full_torque": FULL * stall}
    return summary_of(scene, **{"feed.force": feed, **motor})


def over_feed(scene: Scene, motor: float) -> list[dict[str, float]]:
    """Rate and torque over the feed on the casing, with a motor of a torque [N m]."""
    rows = []
    for feed in CASING_FEEDS:
        told = with_motor(scene, 1e3 * feed, motor)
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
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.set_ylim(bottom=0.0)
    other = axes.twinx()
    other.spines["right"].set_visible(True)
    other.grid(visible=False)
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


def draw() -> Iterator[tuple[str, Figure]]:
    """Rates over rotation and over feed."""
    scene = on_rock(ROCKS[0], hammer("dth5"))
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    draw_rotation(left, over_rotation(scene))
    draw_feed(right, {motor: over_feed(scene, motor) for motor in MOTORS})
    yield "breaking", figure


def made() -> Made:
    """All of it."""
    blocks = {
        "presets": lambda: table(HEADINGS, preset_rows()),
        "feeds": lambda: table(FEED_HEADINGS, feed_rows()),
        "torques": lambda: table(TORQUE_HEADINGS, torque_rows()),
    }
    return Made(("breaking.md",), blocks, figures=draw, dpi=110)
