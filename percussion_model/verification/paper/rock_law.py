"""The rock law by itself (section 2.3 of the paper): jumps of its datum, sinking."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from percussion_model.physics.records import EventKind, Mode
from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import Simulation, Snapshot
from percussion_model.simulation.uncertain import ABOUT
from percussion_model.verification.paper.runs import CALIBRATED, drop_scene
from percussion_model.verification.paper.statements import Statement

# A datum is read so long before and after an event [s]: far less than the shortest mode lasts.
MOMENT = 1e-9
# The bit moves on between these readings, at some metres a second.
SAME_JUMP = 1e-4
# A sinking bit is followed for so long, read so often [s].
SINKING, SINKING_STEP = 4.0, 1e-3
# A speed that agrees with a closed form does so to this share.
SAME_SPEED = 1e-6
# Share of the run over which a bit is at rest, or still sinks.
LATE = 0.5


@dataclass(frozen=True)
class Jump:
    """Start of a drilling cycle, SI units."""

    after: float  # penetration while drilling just after; above zero where the bit turns under load
    jump: float  # of the datum x_R
    # by eqs 19, 21 and 22 of the paper; NaN where the peak of the cycle before was not seen
    expected: float
    drift: float  # change of x_R since the event before


def datum_jumps(scene: Scene, restart: Snapshot, end: float) -> list[Jump]:
    """Find the jumps of the datum x_R from a snapshot to a time [s]."""
    simulation = Simulation(scene)
    simulation.restore(restart)
    simulation.advance(end)
    events = simulation.events
    events = events[(events["time"] > restart.time + MOMENT) & (events["kind"] <= Mode.SS)]
    before, after = _readings(scene, restart, events["time"])
    datum_before, datum_after = (x["bit_end_position"] - x["penetration"] for x in (before, after))
    gamma, upper = scene.rock.unloading_ratio, math.nan
    found = []
    for k, kind in enumerate(events["kind"]):
        p = float(before["penetration"][k])
        loading = before["drilling_mode"][k] in (Mode.DFC, Mode.FC)
        if kind == EventKind.MODE_BC and loading:
            upper = p * (gamma - 1.0) / gamma
        elif kind in (EventKind.MODE_DFC, EventKind.MODE_FC) and not loading:
            # F_R/K_R of eq. 19, with F_R of eq. 21, or none in free flight
            elastic = gamma * max(p - upper, 0.0) if not math.isnan(upper) else math.nan
            found.append(
                Jump(
                    after=float(after["penetration"][k]),
                    jump=float(datum_after[k] - datum_before[k]),
                    expected=p - elastic,
                    drift=float(datum_before[k] - datum_after[k - 1]) if k else 0.0,
                )
            )
    return found


def _readings(
    scene: Scene, restart: Snapshot, times: np.ndarray
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Samples just before and just after each time."""
    simulation = Simulation(scene)
    simulation.restore(restart)
    both = np.stack([times - MOMENT, times + MOMENT], axis=1).ravel()
    order = np.argsort(both, kind="stable")
    samples = simulation.sample(both[order])
    back = np.argsort(order, kind="stable")
    arranged = {name: values[back] for name, values in samples.items()}
    return (
        {name: values[0::2] for name, values in arranged.items()},
        {name: values[1::2] for name, values in arranged.items()},
    )


def about_datum(jumps: Sequence[Jump], advance: float) -> Iterator[Statement]:
    """Go through eqs 18 and 19 with the jumps of a blow in which the bit advanced so far [m]."""
    whole = sum(one.jump for one in jumps)
    known = [one for one in jumps if not math.isnan(one.expected)]
    off = max(abs(one.jump - one.expected) for one in known)
    drift = max(abs(one.drift) for one in jumps)
    yield Statement(
        "2.3, figure 4",
        "x_R is constant over a drilling cycle, and jumps at the start of the next so that the "
        "force is continuous",
        f"jumps of {', '.join(f'{1e3 * one.jump:.3f}' for one in jumps)} mm, together "
        f"{1e3 * whole:.4f} mm, the bit's advance in the blow {1e3 * advance:.4f} mm; off eq. 19 "
        f"by {1e3 * off:.1g} mm at most; between jumps x_R moves by {1e3 * drift:.1g} mm",
        off < SAME_JUMP * advance and abs(whole - advance) < SAME_JUMP * advance and drift < 1e-15,
        agrees_if=f"within {SAME_JUMP:g} of the advance",
    )


@dataclass(frozen=True)
class Sinking:
    """A drop test followed for long, SI units."""

    name: str
    time: np.ndarray
    position: np.ndarray  # of the mean bit
    speed: float  # over the whole drilling cycles of the late part, 0 at rest

    @property
    def late_advance(self) -> float:
        """Advance over the late part of the run [m]."""
        return float(self.position[-1] - self.position[int(LATE * len(self.position))])


RIGID, RIGID_BARRIER = "rigid bit, no barrier", "rigid bit with barrier"
LOSSLESS, LOSSY = "elastic bit, no barrier, no loss", "elastic bit, no barrier"
FINER = ", twice the cells"
BARRIER = "elastic bit with barrier"
# Without loss waves never decay: how deep such a bit sinks depends on the cells.
OF_THE_CELLS = (LOSSLESS, LOSSLESS + FINER)


def run_sinking(scene: Scene) -> dict[str, Sinking]:
    """Drop tests with and without the energy barrier, of a rigid and of an elastic bit."""
    drop = drop_scene(scene, *CALIBRATED)
    off = {"effects.barrier": False}
    finer = {"solver.cells": 2 * Simulation(drop).solver.cells["bit"]}
    scenes = {
        RIGID: drop.computed_by("rigid", **off),
        RIGID_BARRIER: drop.computed_by("rigid"),
        LOSSLESS: drop.replace(**off, **{"effects.loss": False}),
        LOSSY: drop.replace(**off),
        LOSSLESS + FINER: drop.replace(**off, **finer, **{"effects.loss": False}),
        LOSSY + FINER: drop.replace(**off, **finer),
        BARRIER: drop,
    }
    return {name: _sink(name, chosen) for name, chosen in scenes.items()}


def _sink(name: str, scene: Scene) -> Sinking:
    simulation = Simulation(scene)
    samples = simulation.sample(np.arange(0.0, SINKING + 0.5 * SINKING_STEP, SINKING_STEP))
    events = simulation.events
    starts = events[(events["kind"] == EventKind.MODE_FC) & (events["time"] > LATE * SINKING)]
    speed = 0.0
    if len(starts) > 1:
        first, last = starts[0], starts[-1]
        speed = float(
            (last["bit_position"] - first["bit_position"]) / (last["time"] - first["time"])
        )
    return Sinking(name, samples["time"], samples["bit_position"], speed)


def sinking_speed(scene: Scene) -> float:
    """Speed at which a rigid bit sinks for ever without a barrier, in closed form [m/s].

    Pressed by F, it loads from rest to 2 F/K_R, and unloads to no force just as it comes to
    rest again: a cycle of pi sqrt(M/K_R) (1 + 1/sqrt(gamma)) for an advance of
    2 F/K_R (gamma - 1)/gamma.
    """
    mass, gamma, stiffness = (
        scene.bit.mass,
        scene.rock.unloading_ratio,
        scene.rock.loading_stiffness,
    )
    force = scene.feed.force + mass * scene.gravity.acceleration
    advance = 2.0 * force / stiffness * (gamma - 1.0) / gamma
    return advance / (math.pi * math.sqrt(mass / stiffness) * (1.0 + 1.0 / math.sqrt(gamma)))


def about_sinking(scene: Scene, found: dict[str, Sinking]) -> Iterator[Statement]:
    """Go through what section 2.3 says of a law without an energy barrier."""
    says = "without an energy barrier an indenter in a drop test penetrates without bound"
    rigid, closed = found[RIGID], sinking_speed(scene)
    held = max(abs(found[name].late_advance) for name in (RIGID_BARRIER, BARRIER))
    off = abs(rigid.speed / closed - 1.0)
    yield Statement(
        "2.3, rigid bit",
        says,
        f"it sinks at {1e3 * rigid.speed:.5f} mm/s for as long as it is followed, {SINKING:g} s; "
        f"the law by itself, in closed form, makes {1e3 * closed:.5f}, {off:.1g} off: no creep "
        f"of the solver; with the barrier the bit moves by {1e3 * held:.1g} mm in the last "
        f"{LATE * SINKING:g} s",
        off < SAME_SPEED and held == 0.0,
        agrees_if=f"within {SAME_SPEED:g} of the closed form, and at rest with the barrier",
    )
    depth = {name: 1e3 * one.position[-1] for name, one in found.items()}
    yield Statement(
        "2.3, elastic bit",
        says,
        f"it stops at {depth[LOSSY]:.2f} mm ({depth[LOSSY + FINER]:.2f} with twice the cells), "
        f"with the barrier at {depth[BARRIER]:.2f}; without structural loss it sinks on, after "
        f"{SINKING:g} s at {ABOUT} {1e3 * found[LOSSLESS].speed:.0f} mm/s in "
        f"{ABOUT} {depth[LOSSLESS]:.0f} mm (with twice the cells {ABOUT} "
        f"{1e3 * found[LOSSLESS + FINER].speed:.0f} and {ABOUT} {depth[LOSSLESS + FINER]:.0f}: "
        "what a bit without loss does depends on the cells)",
        abs(found[LOSSY].late_advance) > 0.01 * abs(found[LOSSY].position[-1]),
        "at the end of each cycle force and velocity vanish together, so that the least loss "
        "leaves some force; structural loss in the bar thus stops what never stops in a rigid "
        "or lossless bit, but deeper than the barrier does",
        agrees_if=f"it sinks on by more than 1 % of its depth in the last {LATE * SINKING:g} s",
    )
