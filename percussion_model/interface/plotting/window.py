"""Window of a run that the figures show in detail, computed again at full rate.

The run is repeated up to the last whole blow after settling, which costs less
than keeping every sample of every run. Without blows, the first contact is shown.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np

from percussion_model.analysis.drill_string import (
    BarStress,
    bar_stress,
    cells_of,
    closed_contacts,
)
from percussion_model.physics.records import EventKind, Mode
from percussion_model.scene.scene import Scene
from percussion_model.simulation.result import Result
from percussion_model.simulation.simulate import Simulation, Snapshot

# Sampling where the solver has no time step of its own [s].
RIGID_SAMPLING = 2e-6
# Longest stretch shown when no whole blow bounds it [s].
LONGEST_WINDOW = 0.06
# Most samples of a window; a slow hammer is sampled at every few steps.
MOST_SAMPLES = 40_000
# Full rate holds for so many samples around each event; in quiet phases one in so many will do.
BUSY_STEPS = 100
QUIET_STRIDE = 8
# A stress diagram shows so many transits of the slowest elastic bar.
TRANSITS_SHOWN = 12.5
# Share of the peak force from which on the bit counts as active.
ACTIVE_SHARE = 0.05
# Where the bit is active for more than this share of the window, a zoom on all of it is no zoom.
MOST_ACTIVE = 0.5
# Room after what matters, as a factor on its duration.
ROOM_AFTER = 1.3
# The range after percussive activation, by the end of the last contact.
CONTACTS_SHARE = 0.55
# A blow is repeated from so many periods before its start.
RESTART = 0.1
# A repeated blow may start off by this share of its period: another machine rounds otherwise.
SAME_BLOW = 0.01
# Stretch sampled before the origin, as a share of the window.
LEAD = 0.002


class NotRepeatable(ValueError):
    """The scene alone does not repeat the run, as after a change of inputs."""


@dataclass(frozen=True)
class Window:
    """A stretch of a run at full rate. Times count from its origin."""

    scene: Scene
    name: str  # as in "blow 86, from 3.876 s"
    origin: float  # [s] of the run
    length: float  # [s]
    samples: dict[str, np.ndarray]  # SAMPLE_FIELDS
    contacts: list[tuple[float, float]]  # closed piston/bit contacts [s]
    is_blow: bool  # a whole blow, so that its end is the start of the next
    restart: Snapshot  # just before the origin

    @property
    def time(self) -> np.ndarray:
        """Time since the origin [s]."""
        return self.samples["time"] - self.origin

    def since_start(self, field: str) -> np.ndarray:
        """Change of a position since the origin [m]."""
        values = self.samples[field]
        return values - np.interp(self.origin, self.samples["time"], values)

    @property
    def active_until(self) -> float:
        """Time until which the bit works hard on the rock [s].

        Where that fills most of the window, the end of the first contact with
        the rock instead.
        """
        force = np.abs(self.samples["bit_force"])
        busy = np.flatnonzero(force > ACTIVE_SHARE * force.max(initial=0.0))
        if len(busy) == 0:
            return self.length
        end = ROOM_AFTER * max(float(self.time[busy[-1]]), 0.0)
        if end > MOST_ACTIVE * self.length:
            end = ROOM_AFTER * self._first_lift_off()
        return min(end, self.length) or self.length

    def _first_lift_off(self) -> float:
        """End of the first contact with the rock, the whole window if it stays on [s]."""
        flying = self.samples["drilling_mode"] == Mode.FF
        lifts = np.flatnonzero(flying[1:] & ~flying[:-1]) + 1
        lifts = lifts[self.time[lifts] > 0.0]
        return float(self.time[lifts[0]]) if len(lifts) else self.length

    @property
    def activation_until(self) -> float:
        """End of the range after percussive activation, with all early contacts [s]."""
        ends = [end for _, end in self.contacts if end < 0.25 * self.length]
        if not ends or max(ends) <= 0.0:
            return self.active_until
        return float(min(max(ends) / CONTACTS_SHARE, self.length))


@dataclass(frozen=True)
class StressField:
    """Axial stress over time and depth in one bar, compression positive."""

    time_edges: np.ndarray  # [s] since the window's origin
    depth_edges: np.ndarray  # [m] from the top of the bar
    stress: np.ndarray  # [Pa], a row for each cell


def last_blow(result: Result) -> tuple[Window, dict[str, StressField]] | None:
    """Window and stress of the last blow; None, with a warning, where it cannot be repeated."""
    try:
        window = last_blow_window(result)
    except NotRepeatable as error:
        warnings.warn(f"no detailed figures: {error}", stacklevel=2)
        return None
    return window, stress_fields(window)


def peak_stresses(fields: dict[str, StressField]) -> dict[str, BarStress]:
    """Where the bars of a window are pressed and pulled most, by bar."""
    return {
        name: bar_stress(
            one.stress.T, one.depth_edges, 0.5 * (one.time_edges[1:] + one.time_edges[:-1])
        )
        for name, one in fields.items()
    }


def last_blow_window(result: Result) -> Window:
    """Run a result's scene again and sample its last blow at full rate.

    Returns
    -------
    Window
        The last whole blow, else what follows the first contact, else the
        start of the run.

    Raises
    ------
    NotRepeatable
        If the scene alone does not repeat the run.
    """
    scene, blows, duration = result.scene, result.blows, result.duration
    simulation = Simulation(scene)
    if len(blows) == 0:
        simulation.advance(duration)
        events = simulation.events
        start, length, name = _first_contact(events, duration)
        simulation = Simulation(scene)
        return _sampled(simulation, events, name, start, length, is_blow=False)
    expected, period = float(blows["time"][-1]), float(blows["period"][-1])
    simulation.advance(max(0.0, expected - RESTART * period))
    before = simulation.save()
    simulation.advance(min(expected + (1.0 + RESTART) * period, duration))
    if simulation.blow_rows < len(blows) and simulation.time < duration:
        # a piston that comes to rest ends its blows late
        simulation.advance_blows(len(blows) - simulation.blow_rows, duration)
    again = simulation.blows[: len(blows)]
    if len(again) < len(blows) or np.any(
        np.abs(again["time"] - blows["time"]) > SAME_BLOW * blows["period"]
    ):
        raise NotRepeatable(
            f"running the scene again gives other blows before {expected:.6g} s; "
            "the inputs may have been changed during the run"
        )
    events = simulation.events
    simulation.restore(before)
    start, length = float(again["time"][-1]), float(again["period"][-1])
    name = f"blow {len(blows)}, from {start:.3f} s on"
    return _sampled(simulation, events, name, start, length, is_blow=True)


def _first_contact(events: np.ndarray, duration: float) -> tuple[float, float, str]:
    """Find the first contact of a run without blows, and how long it stays busy."""
    times = events["time"][np.isin(events["kind"], _FIRST_KINDS)]
    if len(times) == 0:
        return 0.0, min(duration, LONGEST_WINDOW), "from the start on"
    start = float(times[0])
    longest = min(duration - start, LONGEST_WINDOW)
    busy = float(times[times - start <= longest][-1]) - start
    return start, min(ROOM_AFTER * busy, longest) or longest, "from the first contact on"


# A contact begins, be it with the rock or of piston and bit.
_FIRST_KINDS = (
    EventKind.MODE_DFC,
    EventKind.MODE_FC,
    EventKind.MODE_SS,
    EventKind.CONTACT_CLOSED,
)


def _sampled(
    simulation: Simulation,
    events: np.ndarray,
    name: str,
    start: float,
    length: float,
    is_blow: bool,
) -> Window:
    """Sample a stretch of the run, from just before `start`."""
    step = simulation.solver.time_step or RIGID_SAMPLING
    busy = BUSY_STEPS * step
    step *= max(1, math.ceil(length / step / MOST_SAMPLES))
    simulation.advance(max(simulation.time, start - LEAD * length))
    restart = simulation.save()
    times = np.append(np.arange(simulation.time, start, step), start + np.arange(0.0, length, step))
    return Window(
        scene=simulation.scene,
        name=name,
        origin=start,
        length=length,
        samples=simulation.sample(times[_worth_sampling(times, start, busy, events)]),
        contacts=closed_contacts(events, start, start + length),
        is_blow=is_blow,
        restart=restart,
    )


def _worth_sampling(times: np.ndarray, start: float, busy: float, events: np.ndarray) -> np.ndarray:
    """Choose every time near the start and less than `busy` [s] from events, few elsewhere."""
    marks = np.append(events["time"], start)
    marks.sort()
    after = np.searchsorted(marks, times - busy)
    before = np.searchsorted(marks, times + busy)
    chosen: np.ndarray = before > after
    chosen[::QUIET_STRIDE] = True
    chosen[-1] = True
    return chosen


def stress_fields(window: Window) -> dict[str, StressField]:
    """Stress in the elastic bars during the window's first waves.

    Parameters
    ----------
    window : Window

    Returns
    -------
    dict of StressField
        By bar, top to bottom; empty where no bar is elastic.
    """
    scene = window.scene
    simulation = Simulation(scene)
    simulation.restore(window.restart)
    step = simulation.solver.time_step
    bars = {
        name: bar
        for name, bar in (("piston", scene.piston), ("bit", scene.bit))
        if bar.model == "elastic"
    }
    if not bars or not step:
        return {}
    shown = TRANSITS_SHOWN * max(bar.transit_time for bar in bars.values())
    first = math.ceil(max(window.origin / step - 1.0, window.restart.time / step))
    count = math.ceil(min(shown, window.length) / step)
    forces: dict[str, list[np.ndarray]] = {name: [] for name in bars}
    for k in range(count):
        simulation.advance((first + k) * step)
        fields = simulation.fields()
        for name, rows in forces.items():
            rows.append(fields[f"{name}_force"])
    edges = (first + np.arange(count + 1) - 0.5) * step - window.origin
    shapes = {name: cells_of(b, simulation.solver.section_cells(b)) for name, b in bars.items()}
    return {
        name: StressField(edges, depths, np.array(forces[name]).T / areas[:, None])
        for name, (depths, areas) in shapes.items()
    }
