"""What must hold of any scene under any calls; raises AssertionError with the reason."""

from __future__ import annotations

import math
import pickle
from collections import Counter
from typing import Any

import numpy as np

from percussion_model import Simulation
from percussion_model.physics.records import SAMPLE_FIELDS, EventKind, Mode
from percussion_model.physics.rock import REST_VELOCITY
from percussion_model.solvers.fem.records import Mesh
from percussion_model.solvers.modal.advance import LONGEST
from percussion_model.solvers.modal.records import STEP
from percussion_model.solvers.modal.step import LOADING
from percussion_model.solvers.wave.records import MOST_CUTS
from tests.engine_views import Tables, mesh_of
from tests.properties.scenes import Case
from tests.state_bits import run_bits

# Of the ledger's denominator, for every solver.
MOST_RESIDUAL = 1e-6
# Of the greatest force or travel that occurs: rounding.
ROUNDING = 1e-9
# Of the energy given: by the power law, straight lines do the work of unloading to this.
STRAIGHT = 1e-5
# Of the greatest momentum or impulse: rounding of thousands of steps, each with the
# digits that a stiff penalty leaves to a small gap.
MOST_MOMENTUM = 1e-8
# What is read at a grid point is that of so little of a step later, with room for rounding.
SHORTEST = 1e-5
# A penalty that gives way more than this is none [m/N].
MOST_GIVE = 1e100
# Events of one step: crossings of the rock, two of the contact, one of the drive, one
# of the barrier.
EVENTS_A_STEP = 36
# Steps of the modal solver are halved down to the tick of an event, or of a call. It searches so
# many ahead for the next event, and a call leaves it to search again.
PIECES, AHEAD = STEP + 1, LONGEST >> STEP
# Events of a run of rigid bodies, which has no steps, in the transit time of a bar: 2000 before
# the guard against storms makes all but closures wait, a 200th of the time each, and four rows
# a wait (docs/numerics.md, section 12; `percussion_model.solvers.rigid.schedule`).
RIGID_EVENTS_A_TRANSIT = 2000 + 4 * 200
# What may be undefined, and where.
WITHOUT_PISTON = ("piston_position", "piston_velocity", "gap", "relative_displacement")
UNDEFINED_IN_BLOWS = (
    *("standstill_force", "rebound_velocity"),
    *("barrier_margin", "counting_margin"),  # of a blow in which nothing was decided
)


class Watch:
    """A simulation under calls, with all that was seen of it."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.simulation = Simulation(case.scene)
        self.start = self.simulation.save()
        self.rows: list[np.ndarray] = []
        self.residual = 0.0
        self.given: list[tuple[float, dict[str, float]]] = []

    def run(self) -> None:
        """Make the calls, then see that the end is sound."""
        self.look()
        for share, what, argument in self.case.calls:
            self.simulation.advance(self.time_of(share))
            getattr(self, what)(argument)
        self.simulation.advance(self.case.length)
        self.look()
        self.balance()

    def time_of(self, share: float) -> float:
        return max(share * self.case.length, self.simulation.time)

    # calls

    def advance(self, _: Any) -> None:
        """Nothing besides the advance."""

    def sample(self, shares: list[float]) -> None:
        """Read at several times, which advances as well."""
        seen = self.simulation.sample([self.time_of(share) for share in shares])
        self.rows += list(np.column_stack([seen[name] for name in SAMPLE_FIELDS]))

    def read(self, what: str) -> None:
        """Read something; it must be finite and change nothing."""
        simulation = self.simulation
        if what == "observe":
            self.look()
        elif what == "energy":
            self.balance()
        elif what == "fields":
            for name, values in simulation.fields().items():
                assert np.all(np.isfinite(values)), f"{name} not finite"
        elif what == "result":
            simulation.result().summary()
        elif what == "statistics":
            simulation.statistics()
        else:
            getattr(simulation, what)

    def inputs(self, values: dict[str, float]) -> None:
        """Change inputs."""
        self.given.append((self.simulation.time, values))
        self.simulation.set_inputs(**values)

    def detour(self, argument: tuple[float, dict[str, float]]) -> None:
        """Go on with other inputs, and come back."""
        share, values = argument
        here = self.simulation.save()
        self.simulation.set_inputs(**values)
        self.simulation.advance(self.time_of(share))
        self.look()
        self.balance()
        self.simulation.restore(here)

    def pickle(self, _: Any) -> None:
        """Save, send and restore."""
        self.simulation.restore(pickle.loads(pickle.dumps(self.simulation.save())))

    # what is seen

    def look(self) -> None:
        seen = self.simulation.observe()
        self.rows.append(np.array([seen[name] for name in SAMPLE_FIELDS]))

    def balance(self) -> None:
        """Check the ledger."""
        ledger = self.simulation.energy()
        for name, value in ledger.items():
            if not name.endswith("_relative"):
                assert np.isfinite(value), f"ledger: {name} = {value}"
        scale, (stiffness, way) = scale_of(ledger), rounded_places(self.simulation)
        # the greatest force that this energy gives, on that way
        scale = max(scale, math.sqrt(2.0 * stiffness * scale) * way / MOST_RESIDUAL)
        if scale > 0.0:
            residual = abs(ledger["residual"]) / scale
            assert residual < MOST_RESIDUAL, f"ledger: residual {residual:.3g}"
            self.residual = max(self.residual, residual)

    def repeat(self) -> None:
        """Go back to the start and take another way: the bits must be the same."""
        simulation = self.simulation
        last = run_bits(simulation)
        simulation.restore(self.start)
        for time, values in self.given:
            simulation.advance(0.5 * (simulation.time + time))
            simulation.advance(time)
            simulation.set_inputs(**values)
        simulation.advance(self.case.length)
        assert run_bits(simulation) == last, "other calls gave other bits"


def check_case(case: Case) -> dict[str, Any]:
    """Run a case and check all that must hold.

    Returns
    -------
    dict
        Counts that tell what kind of run it was.
    """
    watch = Watch(case)
    watch.run()
    simulation, scene = watch.simulation, case.scene
    seen = dict(zip(SAMPLE_FIELDS, np.array(watch.rows).T, strict=True))
    check_numbers(seen, scene)
    check_forces(seen, scene)
    check_hole(watch, seen)
    check_broken(watch)
    check_momentum(watch, seen)
    check_blows(simulation.blows, scene)
    check_events(simulation.events, scene)
    counts = simulation.statistics()
    check_effort(counts, watch)
    found = Counter(Mode(int(mode)).name for mode in seen["drilling_mode"])
    blows, events = len(simulation.blows), len(simulation.events)
    watch.repeat()
    return {
        "solver": scene.solver_name,
        "blows": blows,
        "events": events,
        "locked": counts.get("locked", 0),
        "residual": watch.residual,
        "modes": dict(found),
    }


def check_numbers(seen: dict[str, np.ndarray], scene: Any) -> None:
    """All that is defined is finite."""
    for name, values in seen.items():
        if name in WITHOUT_PISTON and scene.piston.model == "absent":
            continue
        if name == "contact_force" and scene.solver_name == "rigid":
            continue
        assert np.all(np.isfinite(values)), f"{name} is {values[~np.isfinite(values)][0]}"


def check_forces(seen: dict[str, np.ndarray], scene: Any) -> None:
    """No tension where contact is unilateral, and nothing interpenetrates."""
    give = 1.0 / scene.fem.contact_stiffness if scene.solver_name == "fem" else 0.0
    if give > MOST_GIVE:
        return
    reach = np.abs(seen["bit_end_position"]).max() + np.abs(seen["bit_position"]).max()
    if scene.piston.model != "absent":
        force = np.nan_to_num(seen["contact_force"])
        assert force.min() >= -ROUNDING * max(1.0, force.max()), f"pull: {force.min()} N"
        travel = max(1e-5, np.abs(seen["gap"]).max(), reach)
        inside = (seen["gap"] + give * force).min()
        assert inside >= -ROUNDING * travel - 1e-15, f"gap: {inside} m"
    force = seen["bit_force"] + pull_at_rest(seen, scene)
    may_pull = scene.effects.standstill_tension == "paper"
    if not (may_pull and scene.matters("effects.standstill_tension")):
        lowest = force.min()
        assert lowest >= -ROUNDING * max(1.0, force.max()), f"rock pulls: {lowest} N"
    if scene.effects.rock == "wall":
        into = (seen["bit_end_position"] - scene.start.rock_gap - give * force).max()
        assert into <= ROUNDING * max(1e-5, reach), f"in the wall: {into} m"


def pull_at_rest(seen: dict[str, np.ndarray], scene: Any) -> np.ndarray:
    """How much rock may pull a bit in loading that is slower than counts as moving [N].

    Its mass on the spring of the rock swings by no more than that velocity tells.
    """
    loads = np.isin(seen["drilling_mode"], (Mode.DFC, Mode.FC))
    rests = loads & (np.abs(seen["bit_end_velocity"]) <= REST_VELOCITY)
    stiffness = scene.rock.loading_stiffness * scene.rock.buttons
    return rests * REST_VELOCITY * math.sqrt(stiffness * scene.bit.mass)


def check_hole(watch: Watch, seen: dict[str, np.ndarray]) -> None:
    """The hole never gets less deep, and there is none where nothing is crushed."""
    scene, blows, depth = watch.case.scene, watch.simulation.blows, seen["hole_depth"]
    reach = np.abs(seen["bit_end_position"]).max()
    if not scene.matters("rock.unloading_ratio"):
        assert not depth.any(), f"a hole of {depth.max()} m"
    one_way = all(what != "detour" for _, what, _ in watch.case.calls)
    if one_way and scene.solver_name != "fem":  # elements read between steps by a step of its own
        back = np.diff(depth[np.argsort(seen["time"], kind="stable")]).min(initial=0.0)
        assert back >= -ROUNDING * max(1e-5, reach), f"hole: back by {-back} m"
    back = blows["hole_advance"].min(initial=0.0)
    assert back >= -ROUNDING * max(1e-5, reach), f"hole: back by {-back} m in a blow"


def scale_of(ledger: dict[str, float]) -> float:
    """Energy that a run began with, and that forces gave or took [J]."""
    works = ("drive", "feed", "gravity", "shoulder")
    return ledger["initial"] + sum(abs(ledger[name]) for name in works)


def rounded_places(simulation: Simulation) -> tuple[float, float]:
    """Stiffest spring at a node [N/m], and how far rounding takes it in all steps together [m].

    Each node is a place that is rounded in each step; independent roundings add up by the root of
    their number. They count where a bit moves by some 1e-10 of how far from the rock it is.
    """
    scene = simulation.scene
    if scene.solver_name != "fem":
        return 0.0, 0.0
    mesh, seen = mesh_of(simulation.solver), simulation.observe()
    place = abs(seen["penetration"]) + np.nan_to_num(seen["gap"])
    count = mesh.shape[1] * (simulation.statistics()["steps"] + 1)
    stiffness = max(scene.fem.contact_stiffness, mesh[Mesh.STIFFNESS].max())
    return float(stiffness), float(np.sqrt(count) * np.spacing(place))


def check_broken(watch: Watch) -> None:
    """The volume broken costs no more energy than was crushed, in each blow and in all."""
    scene, simulation = watch.case.scene, watch.simulation
    if not scene.matters("breaking.efficiency"):
        return
    volume, advance = simulation.observe()["breaking_volume"], simulation.blows["hole_advance"]
    assert volume >= 0.0, f"a volume of {volume} m^3"
    energy, efficiency = scene["breaking.crushing_energy"], scene["breaking.efficiency"]
    # other rock gives back other energy at once, which is booked as crushed
    if {"loading_stiffness", "unloading_ratio"} & watch.case.changes or energy == 0.0:
        return
    ledger = simulation.energy()
    crushed, given = max(ledger["crushing"], 0.0), scale_of(ledger)
    slack = (STRAIGHT if scene.effects.rock == "power" else ROUNDING) * given
    over = volume * energy - efficiency * crushed
    assert over <= slack, f"{over} J broken more than crushed"
    drilled = advance.sum() * 0.25 * np.pi * scene.hole_diameter**2
    over = drilled * energy - efficiency * crushed
    assert over <= slack, f"a hole of {over} J more than crushed"


def has_casing(scene: Any) -> bool:
    """Whether the feed pushes a casing."""
    return scene.effects.feed and scene.feed.on == "casing"


def has_shoulder(scene: Any) -> bool:
    """Whether a casing with a shoulder takes the feed."""
    return bool(scene["effects.shoulder"] and scene.feed.on == "bit" and not scene.effects.damper)


def mass_of(simulation: Simulation, bar: str) -> float:
    """Mass of a body [kg]; waves give a section that is shorter than a step that of a step."""
    cells = simulation.solver.grid_of(bar)
    if simulation.scene.solver_name == "wave" and cells is not None:
        return float(np.sum(cells.mass))
    return float(getattr(simulation.scene, bar).mass)


def check_momentum(watch: Watch, seen: dict[str, np.ndarray]) -> None:
    """Momentum is what impulses gave."""
    case, scene = watch.case, watch.case.scene
    t = seen["time"]
    weight = scene.gravity.acceleration if scene.effects.gravity else 0.0
    feed = scene.feed.force if scene.effects.feed else 0.0
    impulses = (seen[f"{name}_impulse"] for name in ("contact", "bit", "drive", "recoil"))
    contact, rock, drive, recoil = (impulse - impulse[0] for impulse in impulses)
    m_b, m_p = (mass_of(watch.simulation, bar) for bar in ("bit", "piston"))
    # at a grid point one reads the first instant after it, or the point where inputs change
    late = (watch.simulation.solver.time_step or 0.0) * (1.0 if case.changes else SHORTEST)
    stiffness, way = rounded_places(watch.simulation)
    rounding = stiffness * way * (watch.simulation.solver.time_step or 0.0)
    # feed on the casing reaches the bit less the recoil of the last blow
    passed_on = has_casing(scene) or has_shoulder(scene)
    if "feed_force" not in case.changes and not passed_on:
        push = feed + m_b * weight
        parts = (m_b * (seen["bit_velocity"] - seen["bit_velocity"][0]), -push * t, -contact, rock)
        parts += (drive - recoil,)
        scale = max(m_b * np.abs(seen["bit_velocity"]).max(), rounding / MOST_MOMENTUM)
        check_sum(parts, scale, abs(push) * late, "bit")
    changed = any(name == "feed_force" or name.startswith("shoulder") for name in case.changes)
    if has_shoulder(scene) and not changed:
        # what the casing loses, the bit gets
        mass, v = scene["shoulder.casing_mass"], seen["shoulder_velocity"]
        rod = scene["shoulder.impedance"] * seen["shoulder_position"]
        push = feed + (mass + m_b) * weight
        parts = (m_b * (seen["bit_velocity"] - seen["bit_velocity"][0]), mass * v, rod)
        parts += (-push * t, -contact, rock, drive)
        scale = max(m_b * np.abs(seen["bit_velocity"]).max(), rounding / MOST_MOMENTUM)
        held = abs(push) + np.abs(seen["shoulder_push"]).max()
        check_sum(parts, scale, held * late, "bit and casing")
    if scene.piston.model != "absent":
        push = m_p * weight
        parts = (m_p * (seen["piston_velocity"] - seen["piston_velocity"][0]), -push * t)
        parts += (contact, -drive)
        scale = max(m_p * np.abs(seen["piston_velocity"]).max(), rounding / MOST_MOMENTUM)
        check_sum(parts, scale, abs(push) * late, "piston")


def check_sum(parts: tuple[np.ndarray, ...], scale: float, slack: float, what: str) -> None:
    """Parts add up to nothing but rounding."""
    scale = scale + sum(np.abs(part).max() for part in parts)
    if scale > 0.0:
        off = max(np.abs(sum(parts)).max() - slack, 0.0) / scale
        assert off < MOST_MOMENTUM, f"momentum of the {what}: off by {off:.3g}"


def check_blows(blows: np.ndarray, scene: Any) -> None:
    """Blows follow each other, and their numbers are defined."""
    times, periods = blows["time"], blows["period"]
    assert np.all(np.diff(times) > 0), "blow times do not rise"
    assert np.all(periods > 0), "a blow of no length"
    np.testing.assert_allclose(times[:-1] + periods[:-1], times[1:], rtol=1e-9)
    assert np.all(blows["contacts"] >= 1), "a blow without contact"
    for name in blows.dtype.names or ():
        rigid = name == "peak_contact_force" and scene.solver_name == "rigid"
        if name not in UNDEFINED_IN_BLOWS and not rigid:
            assert np.all(np.isfinite(blows[name])), f"blows: {name} not finite"


def check_events(events: np.ndarray, scene: Any) -> None:
    """Events are sound, and closures and openings take turns."""
    for name in ("time", "value", "bit_position"):
        assert np.all(np.isfinite(events[name])), f"events: {name} not finite"
    kinds = events["kind"]
    assert set(kinds) <= {int(kind) for kind in EventKind}, "unknown kind of event"
    drive = kinds[kinds >= EventKind.DRIVE_UP]
    assert np.all(np.diff(drive) != 0), "the drive switched twice the same way"
    contact = kinds[(kinds == EventKind.CONTACT_CLOSED) | (kinds == EventKind.CONTACT_OPENED)]
    if scene.bit.model == "elastic":
        assert np.all(np.diff(contact) != 0), "contact closed or opened twice"


def cuts_of(simulation: Simulation) -> int:
    """How often steps may be cut: twice before each closure, also one to come."""
    closures = np.count_nonzero(simulation.events["kind"] == EventKind.CONTACT_CLOSED)
    return MOST_CUTS * int(closures + 1)


def rock_steps(watch: Watch) -> int:
    """Most steps by which modes follow rock that is not the spring of their form.

    Such a step is halved until it yields to the difference by less than a limit (docs/modal.md,
    section 3), here the greatest between two events: on a curve at one of its ends.
    """
    simulation, again = watch.simulation, Simulation(watch.case.scene)
    tables, par, given = Tables(again.solver), again.solver._par[0], dict(watch.given)
    count, began = 0, 0.0
    for ended in sorted({*simulation.events["time"], *given, watch.case.length}):
        again.advance(0.5 * (began + ended))  # at an event a step may still be to come
        here = again._state.record[0].copy()
        again.advance(ended)
        springs, limit = [here["gamma"] * here["k_r"]], LOADING * par["most_bend"]
        if here["mode"] == Mode.BC:
            limit = par["most_bend"]
        elif here["mode"] != Mode.SS and par["power"] == 1:
            last = again._state.record[0]["line_stiffness"]
            springs = [0.0, here["reload_stiffness"], last]
        elif here["mode"] != Mode.SS:
            springs = [here["k_r"]]
        worst = max(abs(spring - tables.forms.stiff[here["form"]]) for spring in springs)
        yields = tables.forms.yields[here["form"], 1 : STEP + 1].max(axis=1)
        level = np.count_nonzero(worst * yields <= limit)
        count += int((ended - began) / (par["tick"] * (1 << level))) + 1
        if ended in given:
            again.set_inputs(**given[ended])
        began = ended
    return count


def check_effort(counts: dict[str, int], watch: Watch) -> None:
    """Steps and events stay below their ceilings."""
    simulation, case = watch.simulation, watch.case
    length = case.length
    if simulation.solver.time_step is None:
        bars = [bar for bar in (case.scene.piston, case.scene.bit) if bar.model != "absent"]
        transits = 1.0 + length / min(bar.transit_time for bar in bars)
        assert counts["events"] <= RIGID_EVENTS_A_TRANSIT * transits, "storm of events"
        return
    changes = len(case.calls)
    steps = counts["steps"] + counts.get("leap_steps", 0)
    most = length / simulation.solver.time_step + cuts_of(simulation) + changes + 3
    if case.scene.solver_name == "fem":
        most += counts["events"]  # a step ends at each
    pieces = 0
    if case.scene.solver_name == "modal":
        pieces = PIECES * (counts["events"] + changes) + AHEAD * (changes + 1)
        if steps > most + pieces:
            most += rock_steps(watch)
    assert steps <= most + pieces, f"{steps} steps, at most {most + pieces:.0f} are needed"
    assert counts["events"] <= EVENTS_A_STEP * (most + 1), "storm of events"
