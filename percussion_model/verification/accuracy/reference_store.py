"""References with error bars as they are kept: JSON with how they were made."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from percussion_model.scene.scene import Scene

__all__ = ["Bar", "Reference", "fingerprint", "package_store", "store", "stored"]

STORE = "references.json"
FORMAT = 1
# Digits of a stored history.
DIGITS = 7


@dataclass(frozen=True)
class Bar:
    """A number with its bar: value, what the two solvers say, and whether it is a reference.

    Attributes
    ----------
    value, error : float
        Reference and its bar, SI units.
    wave, wave_error, fem, fem_error : float
        Limits of the two solvers and their bars.
    agreed : bool
        Whether the limits lie within their bars of each other.
    """

    value: float
    error: float
    wave: float
    wave_error: float
    fem: float
    fem_error: float
    agreed: bool


@dataclass(frozen=True)
class Reference:
    """What a scene comes to.

    Attributes
    ----------
    title : str
    kind : str
        Of the problem.
    bars : dict of Bar
        By the names of `QUANTITIES`.
    history : ndarray or None
        Force on the rock at the problem's offsets, by the finest waves [N].
    made : dict
        How, with which versions, when.
    """

    title: str
    kind: str
    bars: dict[str, Bar]
    history: np.ndarray | None
    made: dict[str, Any] = field(default_factory=dict)

    @property
    def values(self) -> dict[str, float]:
        """Values that are references."""
        return {name: bar.value for name, bar in self.bars.items() if bar.agreed}

    def floor(self, key: str) -> float:
        """Relative bar: errors near it are not resolved. NaN where there is no reference."""
        bar = self.bars.get(key)
        if bar is None or not bar.agreed or not bar.value:
            return math.nan
        return abs(bar.error / bar.value)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        history = None
        if self.history is not None:
            history = [float(f"{value:.{DIGITS}g}") for value in self.history]
        bars = {name: asdict(bar) for name, bar in self.bars.items()}
        return {
            "title": self.title,
            "kind": self.kind,
            "bars": bars,
            "history": history,
            "made": self.made,
        }

    @classmethod
    def from_dict(cls, tree: dict[str, Any]) -> Reference:
        """Read what `to_dict` gave."""
        history = tree["history"]
        return cls(
            tree["title"],
            tree["kind"],
            {name: Bar(**bar) for name, bar in tree["bars"].items()},
            None if history is None else np.array(history),
            tree["made"],
        )


def fingerprint(scene: Scene) -> str:
    """Tell scenes apart by what changes their motion: values that are not the defaults.

    Title, solver and, but for a drop, run times do not count; so parameters that come
    later, at their defaults, leave the fingerprint as it is.
    """
    tree, usual = (asdict(one) for one in (scene, Scene()))
    apart = {"title", "solver", "fem"}
    if scene.piston.model != "absent":
        apart.add("run")
    found = {
        f"{group}.{key}": value
        for group, entries in tree.items()
        if group not in apart
        for key, value in entries.items()
        if value != usual[group][key] and value is not None
    }
    return hashlib.sha256(json.dumps(found, sort_keys=True).encode()).hexdigest()[:16]


def stored(path: Path | None = None) -> dict[str, Reference]:
    """References of a file, by fingerprint; those of the package if left out."""
    path = package_store() if path is None else path
    if not path.exists():
        return {}
    tree = json.loads(path.read_text(encoding="utf-8"))
    return {key: Reference.from_dict(entry) for key, entry in tree["references"].items()}


def package_store() -> Path:
    """Where the references of the package are kept."""
    return Path(str(files("percussion_model.verification.accuracy").joinpath(STORE)))


def store(path: Path, references: dict[str, Reference]) -> None:
    """Write references to a file."""
    from percussion_model.simulation.files import staged_text

    tree = {
        "format": FORMAT,
        "references": {key: one.to_dict() for key, one in sorted(references.items())},
    }
    staged_text(path, json.dumps(tree, indent=1, allow_nan=True) + "\n")
