"""Runs of section 4 of the paper: drop tests (figure 6) and sweeps (figure 9)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from percussion_model.analysis.study import Study, study, table
from percussion_model.analysis.study.response import KINDS
from percussion_model.physics.records import EventKind
from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import Simulation
from percussion_model.simulation.uncertain import with_error

# As the paper ran its simulations: rock that pulls in standstill.
PAPER = {"effects.standstill_tension": "paper"}
# The bit falls with F_0 D_1 of kinetic energy, rounded in the paper [m/s].
SPEED = 5.25
ENERGIES = (0.005, 0.05, 0.5, 5.0)  # W_R [J]
DAMPINGS = (1e3, 1e4, 1e5)  # C_R [N s/m]
CALIBRATED = (0.05, 1e4)  # those of Table II
LENGTH, STEP = 80e-3, 2e-5  # [s]
# Below this distance, at constant power, the paper finds no stationary motion [m].
PAPER_LEAST_DISTANCE = 3e-3
# Below this feed the paper finds none [N].
PAPER_LEAST_FEED = 350.0
# Stiffness ratio from which the paper's rate rises again, by what it calls numerical chatter.
PAPER_CHATTER = 100.0
# Motion that has not repeated after so many blows is aperiodic.
MOST_BLOWS = 120


def paper_scene() -> Scene:
    """The reference scene with the rock law as printed."""
    return Scene(title="The reference of the paper").replace(**PAPER)


@dataclass(frozen=True)
class Drop:
    """One drop test, SI units."""

    energy: float
    damping: float
    time: np.ndarray
    bit_position: np.ndarray
    rest: float  # displacement of the bit's rock end [m]
    cycles: int  # drilling cycles that crushed more than W_R/100
    settling: float  # from the first contact to the last start of standstill [s]


def drop_scene(scene: Scene, energy: float, damping: float) -> Scene:
    """Scene of a drop test: the bit alone, above the rock of the reference."""
    return scene.replace(
        **{
            "piston.model": "absent",
            "effects.drive": "none",
            "start.bit_velocity": SPEED,
            "rock.barrier_energy": energy,
            "rock.barrier_damping": damping,
        }
    )


def run_drops(scene: Scene) -> list[Drop]:
    """Drop tests over energies and dampings of the barrier."""
    return [_run(scene, energy, damping) for energy in ENERGIES for damping in DAMPINGS]


def _run(scene: Scene, energy: float, damping: float) -> Drop:
    simulation = Simulation(drop_scene(scene, energy, damping))
    samples = simulation.sample(np.arange(0.0, LENGTH, STEP))
    events = simulation.events
    cycles = int(np.sum(events["kind"] == EventKind.MODE_DFC))
    return Drop(
        energy=energy,
        damping=damping,
        time=samples["time"],
        bit_position=samples["bit_position"],
        rest=float(samples["bit_end_position"][-1]),
        cycles=cycles,
        settling=float(events["time"][-1] - events["time"][0]),
    )


@dataclass(frozen=True)
class Sweep:
    """One parameter varied, all else as in the reference."""

    name: str  # letter of the paper's plot
    key: str  # parameter along the axis
    values: np.ndarray  # SI units
    solver: str = "wave"
    changes: Mapping[str, float] = field(default_factory=dict)  # of other parameters, by dotted key


# The text of the paper makes K_C a tenth of the largest entry of the stiffness matrix, 2EA/L_e,
# its Table II fifteen times that [N/m].
TEXT_CONTACT_STIFFNESS = 0.1 * 2 * 210e9 * 5.5e-3 / (0.175 / 50)
_RATIOS = np.geomspace(2.0, 300.0, 46)
SWEEPS = (
    Sweep("a", "rock.loading_stiffness", np.geomspace(1e8, 1e10, 31)),
    Sweep("b", "rock.unloading_ratio", _RATIOS),
    # What the paper draws beside it as the trend of rigid bodies; they cost next to nothing.
    Sweep("b_rigid", "rock.unloading_ratio", np.geomspace(2.0, 300.0, 181), "rigid"),
    # Here answers part: with the paper's own model, and K_C from its table and its text.
    Sweep("b_table", "rock.unloading_ratio", _RATIOS[::2], "fem"),
    Sweep(
        "b_text",
        "rock.unloading_ratio",
        _RATIOS[::2],
        "fem",
        {"fem.contact_stiffness": TEXT_CONTACT_STIFFNESS},
    ),
    Sweep("c", "feed.force", np.geomspace(100.0, 4e4, 41)),
    Sweep("d", "drive.reversal_distance", np.geomspace(1e-3, 0.1, 41)),
)


def force_at_constant_power(scene: Scene, distance: np.ndarray) -> np.ndarray:
    """Drive force that keeps the power scale sqrt(F_0^3 D_1/M_p) of eq. 14 of the paper [N]."""
    reference = scene.drive.reversal_distance
    return np.asarray(scene.drive.force * (reference / distance) ** (1.0 / 3.0))


def run_sweep(
    scene: Scene,
    sweep: Sweep,
    folder: Path,
    processes: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Study:
    """Stationary response along one sweep; what is finished is kept in the folder."""
    columns = {sweep.key: sweep.values}
    if sweep.key == "drive.reversal_distance":
        columns["drive.force"] = force_at_constant_power(scene, sweep.values)
    return study(
        scene.computed_by(sweep.solver, **sweep.changes),
        table(columns),
        folder,
        most_blows=MOST_BLOWS,
        scatter=0.0,
        processes=processes,
        progress=progress,
    )


def along(found: Study) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values of the axis, rates [m/s], and which of them are periodic."""
    kinds = found.rows["kind"] == KINDS.index("periodic")
    return found.points.values[:, 0], found.rows["rate_of_penetration"], kinds


def power_law(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Exponent and factor of y = factor x^exponent, by least squares of the logarithms."""
    x, y = _known(x, y)
    exponent, intercept = np.polyfit(np.log(x), np.log(y), 1)
    return float(exponent), float(np.exp(intercept))


def exponent_and_error(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Exponent of a power law, and its error as that of the line of logarithms (`line_errors`).

    NaN where there are fewer than three points.
    """
    x, y = _known(x, y)
    if len(x) < 3:
        return math.nan, math.nan
    x, y = np.log(x), np.log(y)
    return float(np.polyfit(x, y, 1)[0]), line_errors(x, y)[0]


def straight_line(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Slope, intercept, and share of the scatter that the line explains."""
    x, y = _known(x, y)
    slope, intercept = np.polyfit(x, y, 1)
    off = y - (slope * x + intercept)
    explained = 1.0 - float(np.sum(off * off) / np.sum((y - np.mean(y)) ** 2))
    return float(slope), float(intercept), explained


def line_errors(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Errors of slope and intercept of a straight line.

    Each is the greater of two: the standard error, from the scatter about the line, and half of
    the difference between lines through the lower and through the upper half of the points. The
    first is too small where no line holds over the whole range: it falls with the number of
    points, while the slope drifts. A point in the middle belongs to both halves. NaN where there
    are fewer than three points.
    """
    x, y = _known(x, y)
    if len(x) < 3:
        return math.nan, math.nan
    scatter = np.sqrt(np.diag(np.polyfit(x, y, 1, cov=True)[1]))
    order, half = np.argsort(x), (len(x) + 1) // 2
    lower, upper = (np.polyfit(x[k], y[k], 1) for k in (order[:half], order[-half:]))
    slope, intercept = np.maximum(scatter, 0.5 * np.abs(upper - lower))
    return float(slope), float(intercept)


def fit_text(value: float, error: float) -> str:
    """A fitted number and its error, both to the second digit of the error."""
    return with_error(value, error) if math.isfinite(error) else "unknown, of so few points"


def _known(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Leave out points that failed: one of them must not cost the fit, and all that follows."""
    known = np.isfinite(y)
    return x[known], y[known]


def maxima(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Places of local maxima inside the range."""
    inner = (y[1:-1] > y[:-2]) & (y[1:-1] > y[2:])
    return x[1:-1][inner]
