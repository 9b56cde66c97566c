"""From measurements to a scene: rock parameters with profile-likelihood intervals.

A slow loading and unloading of the rock and drop tests of the bit are fitted together. The
measurements are made here, with noise, from known parameters, so that one can see what the
intervals are worth.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from examples.shared import command_line, tell
from percussion_model import Scene
from percussion_model.analysis.fitting import (
    Curve,
    DropTest,
    drop_test_signal,
    fit_rock,
    slow_force,
)
from percussion_model.interface.plotting.calibration import save_calibration

NAME = "calibration"
TRUTH = {
    "rock.loading_stiffness": 6e8,
    "rock.unloading_ratio": 6.0,
    "rock.barrier_damping": 1.5e4,
    "rock.barrier_energy": 0.1,
}
FORCE_NOISE, POSITION_NOISE = 4e3, 1e-5  # standard deviations [N], [m]
SPEEDS = (5.25, 3.0)  # of the bit [m/s]
SEED = 5


def drop_scene(solver: str) -> Scene:
    """Scene of a bit alone on the reference's rock, which is the first guess."""
    bit = Scene(title="Drop test").replace(**{"piston.model": "absent", "effects.drive": "none"})
    return bit.computed_by(solver, **{"piston.model": "absent"})


def measured_curve(noise: np.random.Generator) -> Curve:
    """A slow test whose gauge begins 50 µm above the rock."""
    way = np.concatenate([np.linspace(0.0, 8.5e-4, 60), np.linspace(8.5e-4, 7.2e-4, 41)[1:]])
    force = slow_force(way, Scene().replace(**TRUTH), datum=5e-5)
    return Curve(way, force + noise.normal(0.0, FORCE_NOISE, len(way)), "slow test")


def measured_drops(scene: Scene, noise: np.random.Generator, samples: int) -> list[DropTest]:
    """Mean position of the bit in drop tests [m]."""
    times = np.linspace(0.0, 45e-3, samples)
    found = []
    for speed in SPEEDS:
        position = drop_test_signal(scene.replace(**TRUTH), times, speed)
        position += noise.normal(0.0, POSITION_NOISE, samples)
        found.append(DropTest(times, position, speed, name=f"drop at {speed:g} m/s"))
    return found


def main(out: Path, quick: bool = False) -> dict[str, Any]:
    """Calibrate the rock and draw data, fits, residuals and profiles."""
    noise = np.random.default_rng(SEED)
    curve = measured_curve(noise)
    if quick:
        fit = fit_rock(drop_scene("rigid"), curve)
    else:
        scene = drop_scene("wave")
        fit = fit_rock(
            scene, curve, measured_drops(scene, noise, 450),
            progress=lambda done: tell(f"{done} computations done"),
        )  # fmt: skip
    save_calibration(fit, Path(out) / f"{NAME}.png")
    return fit.summary() | {"truth": TRUTH}


if __name__ == "__main__":
    command_line(main, NAME)
