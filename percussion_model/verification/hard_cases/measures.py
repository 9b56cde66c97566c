"""Measures of a solver on a hard case: ledger, momentum, events, rate, bits."""

from __future__ import annotations

import math
import time
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from percussion_model.physics.ledger import WORKS
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.scene import Scene
from percussion_model.simulation.files import plain
from percussion_model.simulation.simulate import Simulation
from percussion_model.verification.hard_cases.cases import HardCase

# Readings of a run: the first contact closely, then the whole of it.
FIRST_CONTACT, CLOSE_READINGS, READINGS = 6e-4, 150, 250
# A run that has taken so long is given up [s]; the slowest takes a tenth of it.
MOST_WALL_TIME = 120.0
# How often a solver's guards acted: modes that did not settle, storms of events.
GUARDS = ("locked", "storms")
# Measures that need samples of the whole run.
MECHANICS = ("momentum", "contact_tension", "rock_tension", "interpenetration")
# Without a penalty nothing interpenetrates but by the rounding of a flight of metres [m].
ROUNDING_GAP = 1e-12
# Rigid bodies whose events a guard postpones by 0.2 µs pass each other by 1e-11 m where the
# reference's drive presses them together, and by not much more elsewhere [m].
STORM_GAP = 1e-10
# Forces are compared with the greatest push, or with this where there is none [N].
LEAST_FORCE = 1.0
# Events come in bursts, one a blow: a ceiling per second is one of the mean over a blow at least,
# here that of the reference, or over a case that is shorter [s].
ONE_BLOW = 0.05


@dataclass(frozen=True)
class Measures:
    """Figures of a run; NaN where a case has none.

    Attributes
    ----------
    case, solver : str
    error : str
        Why the run ended early, or what is not finite; empty where all is well.
    residual, numerical, overshoot : float
        Of the energy ledger, divided by its denominator.
    momentum : float
        Greatest difference of momentum and impulses, divided by the greatest impulse.
    contact_tension, rock_tension : float
        Greatest pull between piston and bit, and on the rock where it releases,
        divided by the greatest push.
    interpenetration : float
        Of piston and bit, or of bit and wall, divided by what is allowed: all energy put in
        held by the penalty (finite elements), or rounding (others; in a storm of
        rigid bodies the passing of postponed events).
    events_per_second, ceiling : float
        Mean over the stretch that was run, and the most that it may be: that of the case, or
        in a stretch shorter than a blow as much more as leaves the blow its events [1/s].
    guards : int
        How often a guard of the solver acted.
    same_bits : bool
        Whether the run, repeated in one call for each change of inputs, gave the
        same bits as the run that was read several hundred times.
    rate, rate_error, period : float
        Rate of penetration, its standard error [m/s], and mean period of a blow [s].
    depends_on_cells : bool
        Whether the rate is one of the cells and of nothing else.
    periods : list of float
        Of the counted blows [s].
    path : list of float
        Mean bit position at the readings of the first contact [m].
    drilling_cycles : float
        A blow.
    cells : int
        Cells or elements of the first elastic bar, 0 where there is none.
    wall_time, duration : float
        [s]
    warnings : list of str
    """

    case: str
    solver: str
    error: str
    residual: float
    numerical: float
    overshoot: float
    momentum: float
    contact_tension: float
    rock_tension: float
    interpenetration: float
    events_per_second: float
    ceiling: float
    guards: int
    same_bits: bool
    rate: float
    rate_error: float
    depends_on_cells: bool
    period: float
    periods: list[float]
    path: list[float]
    drilling_cycles: float
    cells: int
    wall_time: float
    duration: float
    warnings: list[str]

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the lists; None where a figure is not defined."""
        left_out = ("periods", "path")
        values = {key: value for key, value in asdict(self).items() if key not in left_out}
        found: dict[str, Any] = plain(values | {"blows": len(self.periods)})
        return found


def measure(
    case: HardCase, solver: str, share: float = 1.0, *, again: bool = True, **changes: Any
) -> Measures:
    """Run a case by one solver and take its measures.

    Parameters
    ----------
    case : HardCase
    solver : str
        "wave", "modal", "fem" or "rigid".
    share : float
        Share of the case's duration.
    again : bool
        Whether to repeat the run in other calls and compare the bits.
    **changes
        Further values by dotted key, as for `Scene.replace`.
    """
    scene = case.computed_by(solver, **changes)
    run = Simulation(scene)
    end = share * scene.run.duration
    began = time.perf_counter()
    samples, error = None, ""
    try:
        samples = _follow(run, case, end, began + MOST_WALL_TIME)
    except SimulationError as caught:
        error = str(caught)
    taken = time.perf_counter() - began
    result = run.result(settle=share * scene.run.settle)
    energy, counts, blows = result.energy, result.statistics, result.counted
    figures = (
        _mechanics(scene, samples, energy, counts.get("storms", 0)) if samples is not None else {}
    )
    close = samples["bit_position"][:CLOSE_READINGS].tolist() if samples is not None else []
    # where nothing ever moves there is no energy to divide by
    idle = energy["residual"] == 0.0
    return Measures(
        case=case.name,
        solver=solver,
        error=error or _not_finite(samples, energy),
        residual=0.0 if idle else energy["residual_relative"],
        numerical=energy["numerical_relative"],
        overshoot=energy["overshoot_relative"],
        **{name: figures.get(name, math.nan) for name in MECHANICS},
        events_per_second=counts["events"] / run.time if run.time > 0.0 else math.nan,
        ceiling=case.ceiling * max(1.0, min(ONE_BLOW, scene.run.duration) / end),
        guards=sum(counts.get(name, 0) for name in GUARDS),
        same_bits=not error and (not again or _repeats(run, case, scene, end)),
        rate=result.rate_of_penetration,
        rate_error=result.rate_of_penetration_standard_error,
        depends_on_cells=scene.is_undamped,
        period=float(np.mean(blows["period"])) if len(blows) else math.nan,
        periods=blows["period"].tolist(),
        path=close,
        drilling_cycles=float(np.mean(blows["drilling_cycles"])) if len(blows) else math.nan,
        cells=next(iter(result.cells.values()), 0),
        wall_time=taken,
        duration=run.time,
        warnings=list(result.warnings),
    )


def readings(end: float) -> np.ndarray:
    """Times at which a run is sampled [s]: the first contact, then the rest."""
    close = np.linspace(0.0, min(FIRST_CONTACT, end), CLOSE_READINGS)
    return np.concatenate([close, np.linspace(close[-1], end, READINGS)[1:]])


def _follow(run: Simulation, case: HardCase, end: float, deadline: float) -> dict[str, np.ndarray]:
    """Run the script of a case; its samples, and the feed's impulse."""
    rows: list[dict[str, float]] = []
    scene = run.scene
    force = scene.feed.force if scene.effects.feed else 0.0
    impulse, since = 0.0, 0.0
    times = readings(end)
    done = 0
    for t, inputs in [*case.changes(end), (end, {})]:
        until = len(times) if not inputs else int(np.searchsorted(times, t))
        for moment in times[done:until]:
            row = {name: float(values[0]) for name, values in run.sample([moment]).items()}
            # after a change of inputs the state may lie a step ahead
            here = max(float(moment), since)
            rows.append(row | {"here": here, "feed_impulse": impulse + force * (here - since)})
            if time.perf_counter() > deadline:
                raise SimulationError(f"given up after {MOST_WALL_TIME:g} s at t = {run.time!r} s")
        done = until
        run.advance(t)
        if inputs:
            run.set_inputs(**inputs)
            changed = max(run.time, run.solver.time(run._state))
            impulse += force * (changed - since)
            since, force = changed, inputs.get("feed_force", force)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _repeats(run: Simulation, case: HardCase, scene: Scene, end: float) -> bool:
    """Whether the run has the bits of another one, in the fewest calls."""
    again = Simulation(scene)
    for t, inputs in case.changes(end):
        again.advance(t)
        again.set_inputs(**inputs)
    again.advance(end)
    return _bits(again) == _bits(run)


def _bits(run: Simulation) -> tuple[bytes, bytes, bytes]:
    """State, blows and events as bytes."""
    state = run.save().state
    record = state.record.copy()
    record["n_blows"] = record["n_events"] = 0  # rows filled in the last call
    plain = record.tobytes() + state.workspace.tobytes()
    return plain, run.blows.tobytes(), run.events.tobytes()


def _not_finite(samples: dict[str, np.ndarray] | None, energy: dict[str, float]) -> str:
    """Return what is not finite in a run; empty where all is."""
    for name, values in (samples or {}).items():
        # what a scene does not have is undefined throughout
        if not np.all(np.isfinite(values)) and not np.all(np.isnan(values)):
            return f"{name} is not finite"
    for name, value in energy.items():
        if not math.isfinite(value) and not name.endswith("relative"):
            return f"{name} of the ledger is not finite"
    return ""


def _mechanics(
    scene: Scene, samples: dict[str, np.ndarray], energy: dict[str, float], storms: int
) -> dict[str, float]:
    """Momentum, tension and interpenetration of a run; see `Measures`.

    Parameters
    ----------
    storms : int
        How many storms of events a guard had to bound.
    """
    put_in = abs(energy["initial"]) + sum(abs(energy[name]) for name in WORKS)
    allowed = ROUNDING_GAP
    if storms:
        allowed = STORM_GAP
    if scene.solver_name == "fem":
        allowed += math.sqrt(2.0 * put_in / scene.fem.contact_stiffness)
    found = {"momentum": _momentum(scene, samples)}
    deep = []
    if scene.piston.model != "absent":
        found["contact_tension"] = _pull(samples["contact_force"])
        deep.append(-float(samples["gap"].min()))
    may_pull = scene.effects.standstill_tension == "paper"
    if not (may_pull and scene.matters("effects.standstill_tension")):
        found["rock_tension"] = _pull(samples["bit_force"])
    if scene.effects.rock == "wall":
        deep.append(float(samples["bit_end_position"].max()) - scene.start.rock_gap)
    if deep:
        found["interpenetration"] = max(0.0, *deep) / allowed
    return found


def _pull(force: np.ndarray) -> float:
    """Greatest tension divided by the greatest compression."""
    return max(0.0, -float(force.min())) / max(float(force.max()), LEAST_FORCE)


def _momentum(scene: Scene, samples: dict[str, np.ndarray]) -> float:
    """Greatest difference of momentum and impulse of a body, divided by the greatest impulse."""
    weight = scene.gravity.acceleration if scene.effects.gravity else 0.0
    t = samples["here"]
    contact = np.nan_to_num(samples["contact_impulse"])
    off, parts = 0.0, [samples["feed_impulse"], contact, samples["bit_impulse"]]
    if not scene.effects.string:  # else it is of all bars, which samples do not tell
        mass = scene.bit.mass
        given = samples["feed_impulse"] + mass * weight * t + contact - samples["bit_impulse"]
        off = _mismatch(mass * samples["bit_velocity"], given)
        parts.append(mass * samples["bit_velocity"])
    if scene.piston.model != "absent":
        mass = scene.piston.mass
        given = mass * weight * t + samples["drive_impulse"] - contact
        off = max(off, _mismatch(mass * samples["piston_velocity"], given))
        parts += [samples["drive_impulse"], mass * samples["piston_velocity"]]
    greatest = max(float(np.abs(part).max()) for part in parts)
    return off / greatest if greatest > 0.0 else off


def _mismatch(momentum: np.ndarray, given: np.ndarray) -> float:
    return float(np.abs((momentum - momentum[0]) - (given - given[0])).max())
