"""Hard cases, stored beside this file as TOML: one table each.

Keys of a table: `hard` and `holds`, in words; `scene`, what differs from the
reference scene; `script`, inputs that change during the run; `duration` and
`settle` [s]; `solvers`; `aperiodic`; `ceiling`, events per simulated second;
`differs`, why a solver's mean rate is another one.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any

from percussion_model.scene.scene import Scene

SOLVERS = ("wave", "modal", "fem", "rigid")

# What a table leaves out.
DURATION, SETTLING_SHARE = 0.5, 0.1  # [s], and of it
# The reference has 1100 events a second.
CEILING = 20_000.0


@dataclass(frozen=True)
class Change:
    """Inputs that change at a time, or again and again."""

    inputs: dict[str, tuple[float, ...]]  # values of each input, taken in turn
    at: float  # when for the first time [s]
    every: float | None  # and again after so long [s]

    def times(self, end: float) -> list[float]:
        """When the inputs change before `end` [s]."""
        if self.every is None:
            return [self.at] if self.at < end else []
        count = int((end - self.at) / self.every) + 1
        times = [self.at + k * self.every for k in range(count)]
        return [t for t in times if t < end]


@dataclass(frozen=True)
class HardCase:
    """A scene, what makes it hard, and what must hold.

    Attributes
    ----------
    name, group : str
        Of the case, and of the file that it is stored in.
    hard, holds : str
        What makes it hard, and what must hold besides the measures of all cases.
    scene : Scene
    solvers : tuple of str
        Solvers that can compute it.
    aperiodic : bool
        Whether blow follows blow without a period.
    script : tuple of Change
    ceiling : float
        Most events per simulated second [1/s].
    differs : dict of str
        Why the mean rate of a solver is not that of the waves.
    """

    name: str
    group: str
    hard: str
    holds: str
    scene: Scene
    solvers: tuple[str, ...] = SOLVERS
    aperiodic: bool = False
    script: tuple[Change, ...] = ()
    ceiling: float = CEILING
    differs: dict[str, str] = field(default_factory=dict)

    def computed_by(self, solver: str, **changes: Any) -> Scene:
        """Scene of the case for one solver."""
        return self.scene.computed_by(solver, **changes)

    def changes(self, end: float) -> list[tuple[float, dict[str, float]]]:
        """Times before `end` [s] and the inputs that change then, in order."""
        found: dict[float, dict[str, float]] = {}
        for change in self.script:
            for k, t in enumerate(change.times(end)):
                values = {name: row[k % len(row)] for name, row in change.inputs.items()}
                found.setdefault(t, {}).update(values)
        return sorted(found.items())


@cache
def hard_cases() -> dict[str, HardCase]:
    """All hard cases by name, in the order of the files and of the tables in them."""
    found: dict[str, HardCase] = {}
    for group in ("rock", "laws", "drive", "bars", "contact", "inputs", "chains"):
        text = resources.files(__package__).joinpath(f"{group}.toml").read_text(encoding="utf-8")
        for name, table in tomllib.loads(text).items():
            if name in found:
                raise ValueError(f"{group}.toml: there are two cases {name}")
            found[name] = _read(name, group, table)
    return found


def _read(name: str, group: str, table: dict[str, Any]) -> HardCase:
    values = dict(table)
    duration = values.pop("duration", DURATION)
    run = {"duration": duration, "settle": values.pop("settle", SETTLING_SHARE * duration)}
    scene = Scene(title=name, **{**values.pop("scene", {}), "run": run})
    script = tuple(_read_change(row) for row in values.pop("script", ()))
    solvers = tuple(values.pop("solvers", SOLVERS))
    return HardCase(name, group, scene=scene, script=script, solvers=solvers, **values)


def _read_change(row: dict[str, Any]) -> Change:
    row = dict(row)
    every = row.pop("every", None)
    at = row.pop("at", every or 0.0)
    inputs = {
        key: tuple(map(float, value if isinstance(value, list) else [value]))
        for key, value in row.items()
    }
    return Change(inputs, at, every)
