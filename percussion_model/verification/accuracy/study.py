"""Accuracy study: all ladders on one scene, error against time, orders, costs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields, replace
from itertools import takewhile
from typing import Any

from percussion_model.engine.library import place_to_compile
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.files import plain
from percussion_model.simulation.simulate import Simulation
from percussion_model.simulation.uncertain import in_digits
from percussion_model.verification.accuracy.ladders import (
    COMPARED,
    LADDERS,
    Rung,
    chosen_ladders,
    ladders,
    refuse_asked,
)
from percussion_model.verification.accuracy.orders import Cost, Order, cost_range, fitted_order
from percussion_model.verification.accuracy.problems import (
    APERIODIC,
    PILOT_MODES,
    QUANTITIES,
    Answer,
    Problem,
    Run,
    by_modes,
    default_solver,
    pose,
    quantities,
    refuse_unfit,
    relative_error,
)
from percussion_model.verification.accuracy.references import Bar, Reference, find_reference
from percussion_model.verification.accuracy.timing import interleaved, machine

# Errors whose cost is told.
WANTED = (1e-2, 3e-3, 1e-3, 5e-4)
# Families of ladders that the default solver is compared with: the best of them counts.
PEERS = ("peer", "fem")
# Ladders of own solvers, and which stands in where the one that "auto" takes was not run.
OWN = ("modal", "wave")
# Errors below this multiple of the reference's bar are not resolved.
RESOLVED = 2.0
# Share of the time that the answers take, measured on the reference scene: each is one run,
# where times are those of up to five.
ANSWERS = 0.35


@dataclass(frozen=True)
class Point:
    """A rung, measured.

    Attributes
    ----------
    ladder, label : str
    size : float
        See `Rung`.
    setup : float
        Time to make the solver [s]; compilation is apart.
    second, blow : float
        Processor time of a simulated second and of a blow [s].
    repeats : int
    spread : float
        Half the range of the repeated times by their median; NaN with one.
    values, errors : dict of float
        By quantity: what was found, and the relative error; None where there
        is no reference.
    note : str
        Why there is no answer.
    """

    ladder: str
    label: str
    size: float
    setup: float
    second: float
    blow: float
    repeats: int
    spread: float
    values: dict[str, float]
    errors: dict[str, float]
    note: str = ""


@dataclass(frozen=True)
class Study:
    """Error against time on one scene.

    Attributes
    ----------
    title : str
    kind : str
        Of the problem.
    duration, period : float
        Simulated time of a run, and of a blow [s].
    reference : Reference
    points : list of Point
    compilation : dict of float
        Time of the first set-up of each solver, compilation or its cache included [s].
    machine : dict
    solver : str
        The one that `solver.name = "auto"` takes.
    """

    title: str
    kind: str
    duration: float
    period: float
    reference: Reference = field(repr=False)
    points: list[Point] = field(repr=False)
    compilation: dict[str, float] = field(repr=False)
    machine: dict[str, Any] = field(repr=False)
    solver: str = ""

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of what is compared, the main one first."""
        return quantities(self.kind)

    @property
    def main(self) -> str:
        """Name of the quantity that comes first."""
        return self.quantities[0]

    def ladder(self, name: str) -> list[Point]:
        """Points of a ladder, cheap to dear, without those that failed."""
        return [point for point in self.points if point.ladder == name and not point.note]

    @property
    def names(self) -> list[str]:
        """Ladders that have a point."""
        return [name for name in LADDERS if self.ladder(name)]

    @property
    def own(self) -> str:
        """Ladder of the default solver; where it was not run, of another own one."""
        chosen = (name for name in (self.solver, *OWN) if name and self.ladder(name))
        return next(chosen, self.solver or OWN[0])

    @property
    def peers(self) -> list[str]:
        """Ladders that the default solver is compared with."""
        return [name for name in self.names if LADDERS[name].family in PEERS]

    def floor(self, key: str) -> float:
        """Error below which the reference cannot tell; 0 where errors are no differences to it."""
        floor = self.reference.floor(key)
        # those of an aperiodic motion are standard errors
        return 0.0 if math.isnan(floor) or self.kind == APERIODIC else floor

    def fitted(self, name: str, key: str) -> list[Point]:
        """Points that an order is fitted to: those that the reference resolves."""
        limit = RESOLVED * self.floor(key)
        return [point for point in self.ladder(name) if point.errors.get(key, math.nan) > limit]

    def order(self, name: str, key: str) -> Order | None:
        """Measured order of a ladder in a quantity."""
        points = self.fitted(name, key)
        return fitted_order([point.size for point in points], [p.errors[key] for p in points])

    def seconds(self, point: Point) -> float:
        """Time that a point costs [s]: of a simulated second, or of the run if it is aperiodic."""
        # where motion is aperiodic the error falls with the length of the run, its size
        return point.second * (point.size if self.kind == APERIODIC else 1.0)

    @property
    def timed(self) -> str:
        """What costs are the times of."""
        return "the run" if self.kind == APERIODIC else "a simulated second"

    def cost(self, name: str, key: str, wanted: float, duration: float = math.inf) -> Cost:
        """Time at which a ladder meets an error for good [s]; see `seconds`.

        Of runs so long with their set-up [s], if a duration is given.
        """
        points = self.ladder(name)
        found = cost_range(
            name,
            [
                (self.seconds(point), point.spread, point.errors.get(key, math.nan))
                for point in points
            ],
            wanted,
            self.floor(key),
        )
        if math.isinf(duration) or not math.isfinite(found.value):
            return found
        more = self.setup(found) / (1.0 if self.kind == APERIODIC else duration)
        value, low, high = (time + more for time in (found.value, found.low, found.high))
        return replace(found, value=value, low=low, high=high, dearest=found.dearest + more)

    def meets(self, cost: Cost) -> Point:
        """Rung at which an error is met for good."""
        points = sorted(self.ladder(cost.ladder), key=self.seconds)
        return next((one for one in points if self.seconds(one) >= cost.value), points[-1])

    def setup(self, cost: Cost) -> float:
        """Set-up of the rung at which an error is met for good [s]; NaN where none meets it."""
        return self.meets(cost).setup if math.isfinite(cost.value) else math.nan

    def best(
        self, families: Sequence[str], key: str, wanted: float, duration: float = math.inf
    ) -> Cost | None:
        """Least cost of an error among the ladders of families; None where none is known to.

        Its range is that of the best in either case: another ladder may be the cheaper one. It
        is a bound where that of its own ladder is: what dearer ladders would cost with coarser
        rungs is left out.
        """
        names = [name for name in self.names if LADDERS[name].family in families]
        found = [self.cost(name, key, wanted, duration) for name in names]
        known = [cost for cost in found if math.isfinite(cost.value)]
        if not known:
            return None
        best = min(known, key=lambda cost: cost.value)
        low = min(cost.low for cost in found if math.isfinite(cost.low))
        highs = [cost.high for cost in known if math.isfinite(cost.high)]
        return replace(best, low=low, high=min(highs, default=math.nan))

    def good(self, name: str, wanted: float, shift: float) -> list[Point]:
        """Points of a ladder that meet an error of the main quantity, as all finer ones do.

        Parameters
        ----------
        name : str
        wanted : float
        shift : float
            What is added to their errors.
        """
        # a finer rung has a smaller size; aperiodic motion, whose size is its time, a longer run
        finest_first = sorted(
            self.ladder(name), key=lambda point: point.size, reverse=self.kind == APERIODIC
        )
        return list(
            takewhile(
                lambda point: point.errors.get(self.main, math.inf) + shift <= wanted, finest_first
            )
        )

    def advice(self, wanted: float) -> str:
        """The sentence "for 1 % take ...".

        What is named is the cheapest of all points that are good, and whose finer ones are. One
        that is cheaper by luck, while finer ones are worse, is told apart.
        """
        # errors of aperiodic motion are those of statistics, without that of the rigid model
        names = [name for name in self.names if self.kind != APERIODIC or name != "rigid"]
        floor, share = self.floor(self.main), f"{100 * wanted:g} %"
        found = [point for name in names for point in self.good(name, wanted, floor)]
        if not found:
            if any(self.good(name, wanted, -floor) for name in names):
                return (
                    f"For {share} the reference does not show it: its bar is "
                    f"{in_digits(100 * floor, 2)} %."
                )
            return f"For {share} there is no method among these."
        best = min(found, key=self.seconds)
        text = (
            f"For {share} take {_setting(best)}, the cheapest whose finer settings are good too: "
            f"{self._time(best)} for {self.timed}, {self._off(best)}."
        )
        lucky = [
            point
            for name in names
            for point in self.ladder(name)
            if point.errors.get(self.main, math.inf) + floor <= wanted
            and self.seconds(point) < self.seconds(best)
        ]
        if lucky:
            least = min(lucky, key=self.seconds)
            text += (
                f" {_setting(least, capital=True)}, at {self._time(least)}, is within {share} by "
                "luck: not all finer settings surely are."
            )
        return text

    def _time(self, point: Point) -> str:
        """Milliseconds of a point, with their spread."""
        spread = f" (± {in_digits(100 * point.spread, 2)} %)" if math.isfinite(point.spread) else ""
        return f"{in_digits(1e3 * self.seconds(point), 2)} ms{spread}"

    def _off(self, point: Point) -> str:
        """By how much the main quantity of a point is off."""
        error, floor = point.errors[self.main], self.floor(self.main)
        label = QUANTITIES[self.main].label
        if self.kind == APERIODIC:
            return f"with a standard error of {in_digits(100 * error, 2)} % in the {label}"
        if error > floor:
            return f"off by {in_digits(100 * error, 2)} % in the {label}"
        return f"off by less than {in_digits(100 * floor, 2)} % in the {label}"

    def costs(self) -> list[dict[str, Any]]:
        """What errors of the main quantity cost each ladder, as plain values."""
        return [
            {"quantity": self.main, "wanted": wanted, **asdict(self.cost(name, self.main, wanted))}
            for wanted in WANTED
            for name in self.names
        ]

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        orders: dict[str, dict[str, Any]] = {}
        for name in self.names:
            found = {key: self.order(name, key) for key in self.quantities}
            orders[name] = {key: asdict(one) for key, one in found.items() if one is not None}
        tree: dict[str, Any] = plain(
            {
                "title": self.title,
                "kind": self.kind,
                "duration": self.duration,
                "period": self.period,
                "solver": self.solver,
                "machine": self.machine,
                "compilation": self.compilation,
                "reference": {
                    "bars": {key: asdict(bar) for key, bar in self.reference.bars.items()},
                    "made": self.reference.made,
                },
                "ladders": {name: asdict(LADDERS[name]) for name in self.names},
                "points": [asdict(point) for point in self.points],
                "orders": orders,
                "costs": self.costs(),
            }
        )
        return tree

    @classmethod
    def from_dict(cls, tree: dict[str, Any]) -> Study:
        """Read what `to_dict` gave; the histories of the reference are not in it."""
        title, kind = tree["title"], tree["kind"]
        bars = {key: Bar.from_dict(_numbers(bar)) for key, bar in tree["reference"]["bars"].items()}
        names = {one.name for one in fields(Point)}
        points = [
            Point(**_numbers({key: value for key, value in point.items() if key in names}))
            for point in tree["points"]
        ]
        return cls(
            title,
            kind,
            tree["duration"],
            tree["period"],
            Reference(title, kind, bars, {}, tree["reference"]["made"]),
            points,
            tree["compilation"],
            tree["machine"],
            tree.get("solver", ""),
        )


def _setting(point: Point, capital: bool = False) -> str:
    """Method and setting of a point, as in "wave, 24 steps"."""
    title = LADDERS[point.ladder].title
    first = title[0].upper() + title[1:] if capital else title
    return ", ".join(filter(None, (first, point.label)))


def _numbers(tree: Any) -> Any:
    """NaN where JSON has null."""
    if isinstance(tree, dict):
        return {key: _numbers(value) for key, value in tree.items()}
    return math.nan if tree is None else tree


def study(
    scene: Scene,
    full: bool = False,
    methods: Sequence[str] | None = None,
    progress: Callable[[str, float | None], None] = lambda text, share: None,
) -> Study:
    """Measure error against time on one scene.

    Parameters
    ----------
    scene : Scene
    full : bool
        Whether to take the costly rungs as well.
    methods : sequence of str, optional
        Names of `LADDERS`, or "compared" for those of the quick methods that carry the scene.
    progress : callable
        Called with what comes next, and the share of the work that is done; None while
        kernels may have to be compiled, which takes minutes or nothing.

    Raises
    ------
    SceneError
        If the scene has nothing to refine, or a method is not known.
    """
    names = chosen_ladders(methods)
    refuse_unfit(scene)
    if methods is not None:
        refuse_asked(scene, chosen_ladders([word for word in methods if word != COMPARED]))
    compilation = {}
    default = default_solver(scene)
    # make each solver once: compile, or load what was compiled before
    for name in solvers_of(names, scene):
        word = "loading" if place_to_compile(name) is None else "compiling"
        progress(f"{word} the solver {name}", None)
        chosen = by_modes(scene, PILOT_MODES) if name == "modal" else scene.computed_by(name)
        compilation[name] = Simulation(chosen).setup_time
    progress("pilot run", None)
    problem = pose(scene)
    reference = find_reference(problem, scene, lambda text: progress(text, None))
    rungs = [rung for rung in ladders(problem, full) if rung.ladder in names]
    points: dict[int, Point] = {}
    runs: list[tuple[int, Run]] = []
    compiling, others = in_turn(rungs)
    for done, k in enumerate([*compiling, *others], -len(compiling)):
        rung, title = rungs[k], LADDERS[rungs[k].ladder].title
        if done < 0:
            progress(f"compiling or loading {title}", None)
            if rung.peer is not None:  # once, so that its set-up has no loading in it
                with suppress(SceneError):
                    Run(problem, rung.scene, rung.peer)
        else:
            progress(f"{title}, {rung.label}".rstrip(", "), ANSWERS * done / len(others))
        points[k], run = _measured(rung, problem, reference)
        if run is not None:
            runs.append((k, run))
    runs.sort(key=lambda one: one[0])
    times = interleaved(
        [run.cost for _, run in runs],
        lambda done: progress("times, turn by turn", ANSWERS + (1.0 - ANSWERS) * done),
    )
    for (k, run), taken in zip(runs, times, strict=True):
        points[k] = replace(
            points[k],
            second=taken.median / run.problem.duration,
            blow=taken.median / points[k].blow,
            repeats=taken.repeats,
            spread=taken.spread,
        )
    return Study(
        scene.title,
        problem.kind,
        problem.duration,
        problem.period,
        reference,
        [points[k] for k in range(len(rungs))],
        compilation,
        machine(),
        default,
    )


def in_turn(rungs: Sequence[Rung]) -> tuple[list[int], list[int]]:
    """Numbers of the first rungs of ladders, whose kernels may be compiled, and of the others."""
    first = {rung.ladder: k for k, rung in reversed(list(enumerate(rungs)))}
    compiling = sorted(first.values())
    return compiling, [k for k in range(len(rungs)) if k not in compiling]


def solvers_of(names: Iterable[str], scene: Scene) -> list[str]:
    """Solvers of the package that are run for ladders that carry a scene, and by the pilot run."""
    default = default_solver(scene)
    needed = {default, *(LADDERS[name].family for name in names)}
    if scene.effects.string:
        return ["wave"]
    known = ("wave", "fem", "rigid") if default != "modal" else ("modal", "wave", "fem", "rigid")
    return [name for name in known if name in needed]


def _measured(rung: Rung, problem: Problem, reference: Reference) -> tuple[Point, Run | None]:
    """Take the answer of a rung; its time is taken later.

    The blows of its run stand in `blow` until then.
    """
    empty = Point(rung.ladder, rung.label, rung.size, 0.0, math.nan, math.nan, 0, math.nan, {}, {})
    if rung.duration is not None:
        problem = replace(problem, duration=rung.duration)
    try:
        run = Run(problem, rung.scene, rung.peer)
        answer = run.answer()
    except (RuntimeError, ValueError, IndexError) as error:
        return replace(empty, note=f"failed: {error}"), None
    errors = _errors(answer, problem, reference)
    point = replace(
        empty, setup=run.setup_time, values=answer.values, errors=errors, blow=answer.blows
    )
    return point, run


def _errors(answer: Answer, problem: Problem, reference: Reference) -> dict[str, float]:
    """Relative errors; of aperiodic motion, relative standard errors."""
    if problem.kind == APERIODIC:
        return {key: abs(answer.errors[key] / answer.values[key]) for key in problem.quantities}
    values, histories = reference.values, reference.histories
    return {key: relative_error(answer, values, histories, key) for key in problem.quantities}
