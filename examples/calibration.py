"""From measurements to a scene: rock parameters with confidence intervals.

A slow loading and unloading of the rock gives K_R and gamma, drop tests of the bit then give C_R
and W_R. The measurements are made here, with noise, from known parameters, so that one can see
what the intervals are worth.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from examples.shared import BLACK, BLUE, ORANGE, command_line, figure_of
from percussion_model import Scene
from percussion_model.analysis.fitting import (
    ROCK,
    DropTest,
    Fit,
    bilinear_force,
    drop_test_signal,
    fit_drop_tests,
    fit_force_penetration,
)
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM, MS

NAME = "calibration"
TRUTH = {
    "rock.loading_stiffness": 7.5e8,
    "rock.unloading_ratio": 5.0,
    "rock.barrier_damping": 1e4,
    "rock.barrier_energy": 0.5,
}
SYMBOLS = ("$K_R$", "$\\gamma$", "$C_R$", "$W_R$")
FORCE_NOISE, POSITION_NOISE = 6e3, 1e-5  # standard deviations [N], [m]
SPEEDS = (3.0, 5.25)  # of the bit [m/s]
GUESS = {"rock.barrier_damping": 3e4, "rock.barrier_energy": 0.2}
SEED = 5


def drop_scene(solver: str) -> Scene:
    """Scene of a bit alone on the rock that is measured."""
    bit = Scene(title="Drop test").replace(**{"piston.model": "absent", "effects.drive": "none"})
    return bit.computed_by(solver, **{"piston.model": "absent"}, **TRUTH)


def measured_curve(noise: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Penetration [m] and force [N] of a slow test whose gauge begins 50 µm above the rock."""
    way = np.concatenate([np.linspace(0.0, 8.5e-4, 60), np.linspace(8.5e-4, 6.7e-4, 41)[1:]])
    force = bilinear_force(
        way, TRUTH["rock.loading_stiffness"], TRUTH["rock.unloading_ratio"], datum=5e-5
    )
    return way, force + noise.normal(0.0, FORCE_NOISE, len(way))


def measured_drops(scene: Scene, noise: np.random.Generator, step: float) -> list[DropTest]:
    """Mean position of the bit in drop tests [m]."""
    times = np.arange(0.0, 45e-3, step)
    return [
        DropTest(
            times,
            drop_test_signal(scene, times, speed, "bit_position")
            + noise.normal(0.0, POSITION_NOISE, len(times)),
            speed,
        )
        for speed in SPEEDS
    ]


def main(out: Path, quick: bool = False) -> dict[str, Any]:
    """Calibrate the rock and draw data, fits and intervals."""
    noise = np.random.default_rng(SEED)
    way, force = measured_curve(noise)
    curve = fit_force_penetration(way, force)
    scene = drop_scene("rigid" if quick else "wave")
    tests = measured_drops(scene, noise, 5e-4 if quick else 2.5e-4)
    # K_R and gamma of the curve are a guess too: their errors would pass for some of C_R.
    guess = scene.replace(**curve.changes(), **GUESS)
    drops = fit_drop_tests(guess, tests, ROCK, span=5.0, steps=5 if quick else 7)
    with figure_of(NAME, Path(out), (10.5, 6.8)) as fig:
        (left, right), (low, found) = fig.subplots(2, 2)
        _draw_curve(left, way, force, curve)
        _draw_drops(right, low, tests, drops)
        _draw_intervals(found, curve, drops)
        style.head(fig, "Calibration of the rock from noisy measurements")
    return {"curve": curve.summary(), "drops": drops.summary(), "truth": TRUTH}


def _draw_curve(ax: Axes, way: np.ndarray, force: np.ndarray, fit: Fit) -> None:
    ax.plot(way * MM, force / KN, "o", color=BLACK, markersize=2.8, label="measured")
    ax.plot(way * MM, fit.fitted / KN, color=BLUE, label="fit")
    low, high = ((fit.fitted + sign * fit.half_width) / KN for sign in (-1.0, 1.0))
    ax.fill_between(way * MM, low, high, color=BLUE, alpha=0.25, lw=0, label="its 95 % band")
    ax.legend()
    style.label(ax, "penetration, by the gauge [mm]", "force [kN]", "Slow loading and unloading")


def _draw_drops(ax: Axes, below: Axes, tests: list[DropTest], fit: Fit) -> None:
    parts = np.split(np.arange(len(fit.fitted)), np.cumsum([len(test.time) for test in tests])[:-1])
    for test, part, colour in zip(tests, parts, (ORANGE, BLUE), strict=True):
        time = test.time * MS
        ax.plot(time, test.values * MM, "o", color=colour, markersize=2.2)
        ax.plot(time, fit.fitted[part] * MM, color=colour, lw=1, label=f"{test.speed:g} m/s")
        below.plot(time, fit.residuals[part] * 1e6, "o", color=colour, markersize=2.2)
        wide = fit.half_width[part] * 1e6
        below.fill_between(time, -wide, wide, color=colour, alpha=0.3, lw=0)
    ax.invert_yaxis()
    ax.legend(loc="upper right")
    style.label(ax, "time [ms]", "mean bit position, down [mm]", "Drop tests: data and fit")
    style.label(
        below, "time [ms]", "data − fit [µm]", "Drop tests: residuals, 95 % band of the fit"
    )


def _draw_intervals(ax: Axes, curve: Fit, drops: Fit) -> None:
    ways = (("slow test", curve, -0.1, ORANGE), ("drop tests", drops, 0.1, BLUE))
    for words, fit, shift, colour in ways:
        keys = [key for key in TRUTH if key in fit.estimates]
        at = [list(TRUTH).index(key) + shift for key in keys]
        rows = np.array([fit.estimates[key] for key in keys])  # value, error, low, high
        value, _error, low, high = 100.0 * (rows.T / [TRUTH[key] for key in keys] - 1.0)
        reach = [value - low, high - value]
        ax.errorbar(at, value, reach, color=colour, marker="o", ls="", capsize=4, label=words)
    ax.axhline(0.0, color=BLACK, linewidth=1.0, label="truth")
    ax.set_xticks(range(len(TRUTH)), SYMBOLS)
    ax.set_xlim(-0.5, len(TRUTH) - 0.5)
    ax.legend()
    style.label(ax, "", "off the truth [%]", "What was found, with intervals of 95 %")


if __name__ == "__main__":
    command_line(main, NAME)
