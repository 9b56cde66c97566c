"""Comparison of several solvers on one scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from percussion_model.analysis.change import Change, change_of
from percussion_model.scene.retired import remark
from percussion_model.scene.scene import Scene, SceneError, refuse_other
from percussion_model.scene.solver_names import SOLVER_NAMES
from percussion_model.simulation.result import Result
from percussion_model.simulation.simulate import simulate
from percussion_model.simulation.warnings import unused_note

# Numbers of a summary that solvers are compared by.
COMPARED = (
    "rate_of_penetration",
    "blow_period",
    "blow_frequency",
    "impact_velocity",
    "rebound_velocity",
    "stroke",
    "blow_energy",
    "transfer_efficiency",
    "penetration_per_blow",
    "contacts_per_blow",
    "drilling_cycles_per_blow",
    "peak_bit_force",
    "peak_contact_force",
    "standstill_bit_force",
    "mean_bit_force",
)

# Compared where nothing else is asked for, behind the solver that the scene takes by itself.
USUAL = ("modal", "wave", "fem", "rigid")

# Numbers of the fall of a bit that nothing strikes, of a `Result.fall`.
OF_FALL = (
    *("depth", "first_contact", "rebound_velocity", "rest_time"),
    *("peak_bit_force", "crushed", "transfer_efficiency"),
)


@dataclass(frozen=True)
class Comparison:
    """Results of several solvers on one scene; the first is the one compared with.

    Attributes
    ----------
    results : dict of Result
        By the name of the solver.
    """

    results: dict[str, Result]

    def __repr__(self) -> str:
        return f"Comparison({', '.join(self.results)}; {self.results[self.first]!r})"

    @property
    def first(self) -> str:
        """Name of the solver that the others are compared with."""
        return next(iter(self.results))

    def summaries(self) -> dict[str, dict[str, Any]]:
        """Summary of each result, by solver."""
        return {name: result.summary() for name, result in self.results.items()}

    @property
    def is_fall(self) -> bool:
        """Whether there are no blows, so that how a bit fell is compared."""
        return not any(len(result.blows) for result in self.results.values())

    def compared(self) -> dict[str, dict[str, Any]]:
        """Numbers that are compared, with their errors, by solver: of blows, or of a fall."""
        summaries = self.summaries()
        if not self.is_fall:
            return summaries
        nothing = dict.fromkeys((*COMPARED, *OF_FALL))
        return {
            name: nothing | one["fall"] | {"errors": one["errors"]}
            for name, one in summaries.items()
        }

    def changes(self) -> dict[str, dict[str, Change]]:
        """Change of each number against the first solver's, by solver; of a fall its numbers."""
        summaries = self.compared()
        base = summaries[self.first]
        return {
            name: {key: change_of(summary, base, key) for key in self._keys}
            for name, summary in summaries.items()
            if name != self.first
        }

    def differences(self) -> dict[str, dict[str, float | None]]:
        """Relative difference of each number to the first solver's, by solver.

        Of a fall those of `Result.fall`. None where a number is not defined, or the first
        solver's is zero.
        """
        return {
            name: {key: change.value for key, change in found.items()}
            for name, found in self.changes().items()
        }

    def difference_errors(self) -> dict[str, dict[str, float | None]]:
        """Error of each of `differences`, by solver: the errors of both numbers combined.

        By grid and scatter; None where a difference is, or where one of the errors is not
        known.
        """
        return {
            name: {key: change.error for key, change in found.items()}
            for name, found in self.changes().items()
        }

    @property
    def _keys(self) -> tuple[str, ...]:
        """Names of what is compared."""
        return OF_FALL if self.is_fall else COMPARED

    def undecided(self) -> dict[str, list[str]]:
        """Numbers whose difference to the first solver is within its error, by solver.

        Or within three standard errors of its scatter. And those that depend on the cells in
        one of the two.
        """
        return {
            name: [key for key, change in found.items() if change.is_undecided]
            for name, found in self.changes().items()
        }

    def warnings(self) -> list[str]:
        """Warnings of all results, each after the name of its solver; once where all have it.

        Of the parameters without effect only those that no solver needs are listed, once.
        """
        scenes = [result.scene for result in self.results.values()]
        unused = [
            key
            for key in scenes[0].given_in_vain
            if all(key in scene.given_in_vain for scene in scenes[1:])
        ]
        texts = [unused_note(unused)] if unused else []
        listed = {
            name: [text for text in result.warnings if text != unused_note(scene.given_in_vain)]
            for (name, result), scene in zip(self.results.items(), scenes, strict=True)
        }
        several = len(listed) > 1
        shared = [
            text for text in listed[self.first] if all(text in own for own in listed.values())
        ] * several
        texts += shared
        for name, own in listed.items():
            texts += [f"{name}: {text}" for text in own if text not in shared]
        return texts

    def to_dict(self) -> dict[str, Any]:
        """Summaries, differences, their errors and what is undecided as plain values for JSON."""
        return {
            "solvers": self.summaries(),
            "differences": self.differences(),
            "difference_errors": self.difference_errors(),
            "undecided": self.undecided(),
        }


def compare(
    scene: Scene,
    solvers: Sequence[str],
    duration: float | None = None,
    settle: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Comparison:
    """Run a scene with several solvers.

    Parameters
    ----------
    scene : Scene
    solvers : sequence of str
        Names; the others are compared with the first.
    duration, settle : float, optional
        Simulated time, and the time before blows count [s]; default those of
        the scene.
    progress : callable, optional
        Called now and then with the time reached, over all solvers [s].

    Returns
    -------
    Comparison

    Raises
    ------
    SceneError, SimulationError
        If a solver cannot compute the scene.
    """
    # Every scene is made before the first is run: a refusal comes at once.
    refuse_other(scene)
    scenes = {name: scene.computed_by(name) for name in solvers}
    end = scene.run.duration if duration is None else duration
    results = {}
    for k, (name, chosen) in enumerate(scenes.items()):
        report = None if progress is None else _after(k * end, progress)
        results[name] = simulate(chosen, duration, settle, progress=report)
    return Comparison(results)


def solver_names() -> tuple[str, ...]:
    """Names of all solvers, as a scene is computed by them."""
    return tuple(name for name in SOLVER_NAMES if name != "auto")


def usual_solvers(scene: Scene) -> tuple[str, ...]:
    """Solvers to compare a scene by where none are named: its own, then others that compute it.

    Raises
    ------
    SceneError
        If there is only its own.
    """
    names = [scene.solver_name]
    for name in USUAL:
        with suppress(SceneError):
            scene.computed_by(name)
            names += [name] * (name not in names)
    if len(names) == 1:
        raise SceneError(f"of the solvers {', '.join(USUAL)} only {names[0]} computes this scene")
    return tuple(names)


def read_solvers(text: str) -> tuple[str, ...]:
    """Read names of solvers with commas between them.

    Raises
    ------
    SceneError
        If there is none, or one that is not known or is given twice.
    """
    names = tuple(name.strip() for name in text.split(","))
    known = solver_names()
    for name in names:
        if name not in known:
            raise SceneError(
                f"--solvers {text}: {name!r} is no solver: {', '.join(known)}{remark('', name)}"
            )
        if names.count(name) > 1:
            raise SceneError(f"--solvers {text}: {name} is given twice")
    return names


def _after(start: float, progress: Callable[[float], None]) -> Callable[[float], None]:
    """Report of a run that begins at a time; the short runs that tell its error report nothing."""
    reached = start

    def report(t: float) -> None:
        nonlocal reached
        if start + t > reached:
            reached = start + t
            progress(reached)

    return report
