"""Waves in a drill string: what passes its joints, what reaches the rock, where steel is pulled."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from percussion_model.engine.solvers import WaveSolver
from percussion_model.physics.records import EventKind
from percussion_model.scene.bar_groups import Bar
from percussion_model.scene.bars import section_impedance
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.numbers import section_numbers
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.simulate import Simulation
from percussion_model.solvers.state import State
from percussion_model.solvers.wave.records import Has

# Whole blows that means need.
FEWEST_BLOWS = 3
# Share of the duration that settles where the scene's settling time is longer.
SETTLING_SHARE = 0.25


@dataclass(frozen=True)
class JointReport:
    """What a joint does to waves, mean of a blow.

    A wave that crosses a joint several times counts each time, and what the feed presses
    together counts as waves as well: as much in `came` as in `returned`.

    The efficiency is the share of the first wave that does not go back, (came - returned) / came,
    of one blow at the mean impact velocity on a string at rest, without damper and feed; until a
    wave has gone up and down the longer of the two bars after the front came to the joint.
    """

    came: float  # energy of the waves that came down to it [J]
    passed: float  # of those that left it downward [J]; part of it had come up from below
    returned: float  # of those that left it upward [J]; likewise
    efficiency: float
    least_force: float  # in it, mean of a time step; below zero: the greatest tension [N]

    @property
    def net(self) -> float:
        """Energy that went down through it for good [J]."""
        return self.came - self.returned


@dataclass(frozen=True)
class RockReport:
    """What reaches the rock, mean of a blow in the settled run.

    The first penetration is that of the first incident wave: from when the front of the impact
    arrives until the time in which a wave goes up to the struck end and comes back has passed, or
    the next front arrives. So nothing that the rock sent up has been turned back by the struck end.
    """

    incident: float  # energy of the waves that came down to it [J]
    reflected: float  # of those that it sent back [J]
    work: float  # done on it [J]
    penetration: float  # advance of the hole [m]
    first_penetration: float  # [m]

    @property
    def first_share(self) -> float:
        """Share of the penetration that the first incident wave makes."""
        return self.first_penetration / self.penetration if self.penetration > 0.0 else math.nan


@dataclass(frozen=True)
class Extreme:
    """Greatest or least value in a bar over the watched blow."""

    value: float  # [Pa], compression positive
    place: float  # from the top of the bar, the middle of a cell [m]
    time: float  # since the impact [s]


@dataclass(frozen=True)
class BarStress:
    """Greatest compression and greatest tension (the least stress) in a bar."""

    compression: Extreme
    tension: Extreme


@dataclass(frozen=True, repr=False)
class WatchedBlow:
    """One blow of the settled run, step by step. Times count from its impact."""

    time: np.ndarray  # shape (n,), [s]
    start: float  # time of the impact in the run [s]
    edges: dict[str, np.ndarray]  # by bar: edges of its cells, from its own top [m]
    force: dict[str, np.ndarray]  # shape (n, cells), by bar, compression positive [N]
    area: dict[str, np.ndarray]  # by bar: of its cells [m2]
    kinetic: dict[str, np.ndarray]  # shape (n,), energy of motion by bar [J]
    elastic: dict[str, np.ndarray]  # shape (n,), energy of strain by bar [J]
    contacts: list[tuple[float, float]]  # from when to when the piston is on the struck bar [s]

    def __repr__(self) -> str:
        bars = ", ".join(self.force)
        return f"WatchedBlow({len(self.time)} steps from {self.start:.6g} s on: {bars})"

    def stress(self, bar: str) -> np.ndarray:
        """Stress by time and cell [Pa], compression positive."""
        return self.force[bar] / self.area[bar]

    def gauge(self, bar: str, place: float) -> np.ndarray:
        """Stress over `time` in a bar, at a distance from its top [Pa].

        It is that of the cell in which the gauge sits, in steel of the section there.
        """
        if bar not in self.edges:
            raise SimulationError(f"gauge on {bar!r}: must be one of {', '.join(self.edges)}")
        edges = self.edges[bar]
        if not 0.0 <= place <= edges[-1]:
            raise SimulationError(f"gauge at {place!r} m: the {bar} is {edges[-1]:.6g} m long")
        cell = int(np.searchsorted(edges[1:-1], place, side="right"))
        found: np.ndarray = self.force[bar][:, cell] / self.area[bar][cell]
        return found


@dataclass(frozen=True)
class StringReport:
    """Waves of a drill string in the settled run."""

    title: str  # of the scene
    transit_time: float  # of a wave from the struck end to the rock [s]
    blows: int  # whole blows after settling, over which the means are taken
    period: float  # mean [s]
    blow_energy: float  # mean [J]
    joints: dict[str, JointReport]  # by the bars above and below, as "rod 1 / rod 2"
    rock: RockReport
    bars: dict[str, BarStress]  # over the watched blow
    # stress over `watched.time`, by bar and distance from its top [Pa]
    gauges: Mapping[tuple[str, float], np.ndarray] = field(repr=False)
    watched: WatchedBlow

    @property
    def efficiency(self) -> float:
        """Work on the rock by blow energy."""
        return self.rock.work / self.blow_energy if self.blow_energy > 0.0 else math.nan


def string_report(
    scene: Scene,
    duration: float | None = None,
    settle: float | None = None,
    gauges: Sequence[tuple[str, float]] = (),
) -> StringReport:
    """Run a scene with a drill string and tell what its waves do.

    Means are taken over the whole blows after settling. Stress is that of one of these, the
    first, which is watched step by step.

    Parameters
    ----------
    scene : Scene
        With `effects.string` and a piston.
    duration, settle : float, optional
        In place of those of the scene [s].
    gauges : sequence of (str, float)
        Bar and distance from its top [m].

    Raises
    ------
    SceneError
        If the scene has no drill string or no piston, or is not computed by waves.
    SimulationError
        If there are too few whole blows, or no such place for a gauge.
    """
    for gauge in gauges:
        if isinstance(gauge, str) or len(gauge) != 2:
            raise SceneError(f"gauge {gauge!r}: must be a bar and a place [m], as ('rod 2', 1.5)")
    if not scene.effects.string:
        raise SceneError("effects.string = false: a string report needs a drill string")
    if scene.piston.model == "absent":
        raise SceneError('piston.model = "absent": a string report needs blows')
    length = scene.run.duration if duration is None else duration
    wait = scene.run.settle if settle is None else settle
    if settle is None and duration is not None:
        wait = min(wait, SETTLING_SHARE * duration)
    simulation = Simulation(scene)
    solver = simulation.solver
    if not isinstance(solver, WaveSolver):
        raise SceneError(f'solver.name = "{solver.name}": a string report needs "wave"')
    simulation.advance(min(wait, length))
    simulation.advance_blows(1, length)  # to the start of the first whole blow
    before = simulation.blow_rows
    snapshot = simulation.save()
    first = _sums(snapshot.state)
    # a copy of the state, in which only the least force so far begins anew
    snapshot.state.arrays[1][Has.LEAST] = snapshot.state.arrays[1][Has.FORCE]
    simulation.restore(snapshot)
    last, finished = first, -1
    while finished < simulation.blow_rows:
        finished = simulation.blow_rows
        last = _sums(simulation.save().state)
        simulation.advance_blows(1, length)
    blows = simulation.blows[before:]
    if len(blows) < FEWEST_BLOWS:
        raise SimulationError(
            f"{len(blows)} whole blows from {wait:g} s to {length:g} s: a string report needs "
            f"{FEWEST_BLOWS}; set a longer duration"
        )
    each = (last - first) / len(blows)
    names = list(scene.bars)
    least = simulation.save().state.arrays[1][Has.LEAST].tolist()
    transits = [bar.transit_time for name, bar in scene.bars.items() if name != "piston"]
    shares = _first_shares(scene, float(np.mean(blows["impact_velocity"])), transits)
    joints = {
        f"{above} / {below}": _joint(each[:, k], shares[k], least[k])
        for k, (above, below) in enumerate(pairwise(names[1:]))
    }
    transit = sum(transits)
    simulation.restore(snapshot)
    first_way, whole_way = _penetrations(simulation, blows, transit)
    simulation.restore(snapshot)
    watched = _watched(simulation, solver, float(blows["time"][0]), float(blows["period"][0]))
    return StringReport(
        title=scene.title,
        transit_time=transit,
        blows=len(blows),
        period=float(np.mean(blows["period"])),
        blow_energy=float(np.mean(blows["blow_energy"])),
        joints=joints,
        rock=RockReport(
            incident=float(each[-2, 0]),
            reflected=float(each[-1, 0]),
            work=float(np.mean(blows["rock_energy"])),
            penetration=whole_way,
            first_penetration=first_way,
        ),
        bars={
            name: bar_stress(watched.stress(name), watched.edges[name], watched.time)
            for name in watched.force
        },
        gauges={(bar, place): watched.gauge(bar, place) for bar, place in gauges},
        watched=watched,
    )


_ROWS = (Has.CAME, Has.PASSED, Has.RETURNED)


def _joint(sums: np.ndarray, share: float, least: float) -> JointReport:
    came, passed, returned = sums[: len(_ROWS)].tolist()
    return JointReport(came, passed, returned, share, least)


def _sums(state: State) -> np.ndarray:
    """Energies so far: rows of `_ROWS` by joint, then that came to the rock and went back [J]."""
    joints, record = state.arrays[1], state.record[0]
    ends = [np.full(joints.shape[1], record[name]) for name in ("i_came", "i_returned")]
    return np.vstack([*(joints[row] for row in _ROWS), *ends])


def _first_shares(scene: Scene, speed: float, transits: Sequence[float]) -> list[float]:
    """Share of the first wave that does not go back, by joint.

    Parameters
    ----------
    scene : Scene
    speed : float
        With which the piston strikes the string at rest [m/s].
    transits : sequence of float
        Of the bars from the struck one down [s].
    """
    simulation = Simulation(scene.replace(**_AT_REST, **{"start.piston_velocity": speed}), False)
    stay = 2.0 * np.maximum(transits[1:], transits[:-1])
    ends = np.cumsum(transits)[:-1] + stay
    shares = [math.nan] * len(ends)
    for k in np.argsort(ends).tolist():
        simulation.advance(float(ends[k]))
        came, _, returned = _sums(simulation.save().state)[: len(_ROWS), k].tolist()
        shares[k] = 1.0 - returned / came if came > 0.0 else math.nan
    return shares


# Nothing acts on the string but the piston.
_AT_REST: dict[str, Any] = {
    "effects.gravity": False,
    "effects.feed": False,
    "effects.drive": "none",
    "effects.damper": False,
    "start.gap": 0.0,
    "start.bit_velocity": 0.0,
}


def _penetrations(simulation: Simulation, blows: np.ndarray, transit: float) -> tuple[float, float]:
    """Advance of the hole by the first incident wave, and by all, mean of a blow [m].

    The last blow is left out: its waves may arrive after the end of the run.
    """
    arrivals = blows["time"] + transit
    ends = np.minimum(arrivals[:-1] + 2.0 * transit, arrivals[1:])
    times = np.sort(np.concatenate([arrivals, ends]))
    depth = simulation.sample(times)["hole_depth"]
    at = np.searchsorted(times, arrivals[:-1]), np.searchsorted(times, ends)
    first = float(np.mean(depth[at[1]] - depth[at[0]]))
    return first, float(depth[-1] - depth[0]) / len(ends)


def _watched(
    simulation: Simulation, solver: WaveSolver, start: float, period: float
) -> WatchedBlow:
    """Watch a blow step by step, from its start on."""
    step, bars = solver.time_step, simulation.scene.bars
    grids = {name: grid for name in bars if (grid := solver.grid_of(name)) is not None}
    first = math.ceil(simulation.time / step)
    count = math.floor(period / step)
    force: dict[str, list[np.ndarray]] = {name: [] for name in grids}
    kinetic: dict[str, list[float]] = {name: [] for name in grids}
    elastic: dict[str, list[float]] = {name: [] for name in grids}
    impedance = {
        name: np.repeat(list(map(section_impedance, section_numbers(bars[name]))), grid.in_sections)
        for name, grid in grids.items()
    }
    for k in range(count):
        simulation.advance((first + k) * step)
        fields = simulation.fields()
        for name, grid in grids.items():
            f, v = fields[f"{name}_force"], fields[f"{name}_velocity"]
            force[name].append(f)
            kinetic[name].append(0.5 * float(grid.mass @ (v * v)))
            strain = f / impedance[name]
            elastic[name].append(0.5 * float(grid.mass @ (strain * strain)))
    shapes = {name: cells_of(bars[name], grid.in_sections) for name, grid in grids.items()}
    return WatchedBlow(
        time=(first + np.arange(count)) * step - start,
        start=start,
        edges={name: edges for name, (edges, _) in shapes.items()},
        force={name: np.array(rows) for name, rows in force.items()},
        area={name: area for name, (_, area) in shapes.items()},
        kinetic={name: np.array(rows) for name, rows in kinetic.items()},
        elastic={name: np.array(rows) for name, rows in elastic.items()},
        contacts=closed_contacts(simulation.events, start, start + count * step),
    )


def cells_of(bar: Bar, counts: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Edges of the cells of a bar from its top [m], and their areas [m2]; so many a section."""
    heights = [s.length / n for s, n in zip(bar.sections, counts, strict=True) for _ in range(n)]
    areas = [s.area for s, n in zip(bar.sections, counts, strict=True) for _ in range(n)]
    return np.concatenate(([0.0], np.cumsum(heights))), np.array(areas)


def closed_contacts(events: np.ndarray, start: float, end: float) -> list[tuple[float, float]]:
    """Intervals in which the piston is on the struck bar, counted from `start` [s]."""
    contacts: list[tuple[float, float]] = []
    closed_at: float | None = None
    for event in events[np.isin(events["kind"], _CONTACT_KINDS)]:
        time = float(event["time"])
        if event["kind"] == EventKind.CONTACT_CLOSED:
            closed_at = time if closed_at is None else closed_at
        elif closed_at is not None:
            contacts.append((closed_at, time))
            closed_at = None
    if closed_at is not None:
        contacts.append((closed_at, end))
    return [
        (max(a, start) - start, min(b, end) - start)
        for a, b in contacts
        if b >= start - _SAME_TIME and a < end - _SAME_TIME
    ]


_CONTACT_KINDS = (EventKind.CONTACT_CLOSED, EventKind.CONTACT_OPENED)
# The end of a blow is the start of the next, up to rounding [s].
_SAME_TIME = 1e-9


def bar_stress(stress: np.ndarray, edges: np.ndarray, time: np.ndarray) -> BarStress:
    """Where and when a bar is pressed and pulled most.

    Parameters
    ----------
    stress : float array, shape (n, cells)
        Compression positive [Pa].
    edges : float array, shape (cells + 1,)
        Of the cells, from the top of the bar [m].
    time : float array, shape (n,)
        [s]
    """
    middles = 0.5 * (edges[1:] + edges[:-1])

    def extreme(flat: int) -> Extreme:
        step, cell = np.unravel_index(flat, stress.shape)
        return Extreme(float(stress[step, cell]), float(middles[cell]), float(time[step]))

    return BarStress(extreme(int(stress.argmax())), extreme(int(stress.argmin())))
