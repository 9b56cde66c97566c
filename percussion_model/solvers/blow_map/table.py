"""The table of a blow map: its nodes, what it was made for, and its file."""

from __future__ import annotations

import hashlib
import io
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any
from zipfile import ZipFile

import numpy as np

from percussion_model.scene.scene import Scene, SceneError
from percussion_model.solvers.blow_map.records import ENTRIES, Axis, Entry
from percussion_model.solvers.blow_map.words import FIXED, SECTION, head_of
from percussion_model.solvers.sources import sources_digest

FORMAT = 2
# Greatest ratio of neighbouring nodes at density 1, axis by axis: rebound and penetration
# wave up and down along the stiffness with the bit's vibration, and are smooth along the
# rest (docs/fidelity.md).
RATIOS = {Axis.STIFFNESS: 1.03, Axis.VELOCITY: 1.3, Axis.LOAD: 1.33, Axis.DRIVE: 1.35}
# Nodes of a table, of some 300 bytes while it is made; the default one has a twentieth.
MOST_NODES = 1_000_000
LARGEST_FILE = 200_000_000  # unpacked [bytes]
_RANGES = {
    Axis.STIFFNESS: "stiffness",
    Axis.VELOCITY: "velocity",
    Axis.LOAD: "feed",
    Axis.DRIVE: "force",
}


class TableError(ValueError):
    """Bytes that are no table of blows."""


def fixed_values(scene: Scene) -> dict[str, Any]:
    """Parameters that a table is made for, by dotted key."""
    found = {key: scene[key] for key in FIXED}
    for bar in ("piston", "bit"):
        for k in range(len(scene[f"{bar}.sections"])):
            for name in SECTION:
                key = f"{bar}.sections.{k}.{name}"
                found[key] = scene[key]
    return found


@dataclass(frozen=True)
class Nodes:
    """Where the nodes of a table lie.

    Attributes
    ----------
    lowest, highest : tuple of float
        Range of K_R, v, F_S and F_0 that is answered.
    origin, step : tuple of float
        Of the axes, as logarithms.
    counts : tuple of int
        Nodes along each axis.
    weight : float
        M_b G [N].
    """

    lowest: tuple[float, ...]
    highest: tuple[float, ...]
    origin: tuple[float, ...]
    step: tuple[float, ...]
    counts: tuple[int, ...]
    weight: float

    @classmethod
    def of(cls, scene: Scene) -> Nodes:
        """Nodes that a scene asks for."""
        ranges = [
            tuple(float(scene[f"blow_map.{name}_{end}"]) for end in ("from", "to"))
            for name in _RANGES.values()
        ]
        weight = scene.bit.mass * scene.gravity.acceleration if scene.effects.gravity else 0.0
        if not scene.effects.feed:
            raise SceneError('solver.fidelity = "blow-map" needs effects.feed = true')
        if not ranges[Axis.LOAD][0] + weight > 0:
            raise SceneError(
                f"blow_map.feed_from = {ranges[Axis.LOAD][0]!r} N: must be above the weight "
                f"that lifts the bit, {-weight!r} N"
            )
        slow, fast = ranges[Axis.VELOCITY]
        spans = list(ranges)
        spans[Axis.LOAD] = tuple(
            (force + weight) / v for force, v in zip(ranges[Axis.LOAD], (fast, slow), strict=True)
        )
        spans[Axis.DRIVE] = tuple(
            force / v for force, v in zip(ranges[Axis.DRIVE], (fast, slow), strict=True)
        )
        origin, step, counts = [], [], []
        for axis in Axis:
            low, high = (math.log(end) for end in spans[axis])
            pieces = math.ceil((high - low) / math.log(RATIOS[axis]) * scene.blow_map.density)
            origin.append(low)
            step.append((high - low) / max(pieces, 1))
            counts.append(max(pieces, 1) + 1)
        if math.prod(counts) > MOST_NODES:
            raise SceneError(
                f"the blow map would have {math.prod(counts):.3g} nodes, more than {MOST_NODES}: "
                "narrow the ranges of [blow_map], or lower blow_map.density"
            )
        return cls(
            tuple(low for low, _ in ranges),
            tuple(high for _, high in ranges),
            tuple(origin),
            tuple(step),
            tuple(counts),
            weight,
        )

    def values(self, axis: Axis) -> np.ndarray:
        """Nodes of an axis, no longer as logarithms."""
        return np.exp(self.origin[axis] + self.step[axis] * np.arange(self.counts[axis]))

    def wanted(self) -> list[tuple[int, int, int]]:
        """Nodes of velocity, load and drive that some answer needs."""
        speeds = self.values(Axis.VELOCITY)
        found = []
        for j in range(len(speeds)):
            slow, fast = speeds[max(j - 1, 0)], speeds[min(j + 1, len(speeds) - 1)]
            loads = self._near(Axis.LOAD, slow, fast, self.weight)
            drives = self._near(Axis.DRIVE, slow, fast, 0.0)
            found += [(j, k, m) for k in loads for m in drives]
        return found

    def blow(self, place: tuple[int, int, int]) -> tuple[float, float, float]:
        """Impact velocity [m/s], static force of the bit and F_0 [N] at such a node."""
        axes = (Axis.VELOCITY, Axis.LOAD, Axis.DRIVE)
        v, load, drive = (float(self.values(a)[k]) for a, k in zip(axes, place, strict=True))
        return v, load * v, drive * v

    def _near(self, axis: Axis, slow: float, fast: float, weight: float) -> range:
        """Nodes of an axis around the forces that belong to impacts from slow to fast."""
        low = math.log((self.lowest[axis] + weight) / fast) - self.origin[axis]
        high = math.log((self.highest[axis] + weight) / slow) - self.origin[axis]
        first = max(math.floor(low / self.step[axis] - 1e-9), 0)
        last = min(math.ceil(high / self.step[axis] + 1e-9), self.counts[axis] - 1)
        return range(first, last + 1)


@dataclass(frozen=True)
class BlowTable:
    """A finished table.

    Attributes
    ----------
    values : float array, shape (nodes of each axis, ENTRIES)
        NaN where no answer needs a node.
    fixed : dict
        Parameters that it was made for (`fixed_values`).
    cells : dict of int
        Of the waves that made it.
    wave_speed_error : float
        The same.
    """

    nodes: Nodes = field(repr=False)
    values: np.ndarray = field(repr=False)
    fixed: dict[str, Any] = field(repr=False)
    cells: dict[str, int]
    wave_speed_error: float

    @property
    def lowest(self) -> tuple[float, ...]:
        """Least K_R, v, F_S and F_0 that is answered."""
        return self.nodes.lowest

    @property
    def highest(self) -> tuple[float, ...]:
        """Greatest K_R, v, F_S and F_0 that is answered."""
        return self.nodes.highest

    @property
    def origin(self) -> tuple[float, ...]:
        """First node of each axis, as logarithm."""
        return self.nodes.origin

    @property
    def step(self) -> tuple[float, ...]:
        """From node to node of each axis, as logarithm."""
        return self.nodes.step

    @property
    def restless(self) -> int:
        """Nodes at which the bit does not come to rest."""
        return int(np.sum(np.isinf(self.values[..., Entry.REST])))

    @property
    def known(self) -> int:
        """Nodes that were computed."""
        return int(np.sum(~np.isnan(self.values[..., Entry.REST])))

    def refuse_other(self, fixed: Mapping[str, Any]) -> None:
        """Raise `SceneError` if the table was made for other parameters."""
        for key in sorted({*fixed, *self.fixed}):
            if fixed.get(key) != self.fixed.get(key):
                raise SceneError(
                    f"{key} = {fixed.get(key)!r}: the blow map was made for "
                    f"{self.fixed.get(key)!r} and holds for that alone"
                )

    @cached_property
    def head(self) -> np.ndarray:
        """All but the values as a row of numbers (`words.Word`)."""
        return head_of(self)

    def to_words(self) -> np.ndarray:
        """The table as a row of numbers, for kernels."""
        return np.concatenate([self.head, self.values.ravel()])

    def to_bytes(self) -> bytes:
        """The table as a file: compressed, with a checksum."""
        about = {
            "format": FORMAT,
            "nodes": [list(part) for part in (self.lowest, self.highest, self.origin, self.step)],
            "counts": self.nodes.counts,
            "weight": self.nodes.weight,
            "fixed": self.fixed,
            "cells": self.cells,
            "wave_speed_error": self.wave_speed_error,
        }
        text = json.dumps(about, sort_keys=True)
        values = self.values.astype(np.float32)
        out = io.BytesIO()
        np.savez_compressed(out, about=np.array(text), values=values, sum=_sum(text, values))
        return out.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes) -> BlowTable:
        """Read what `to_bytes` has written.

        Raises
        ------
        TableError
            If the bytes are damaged, cut short or of another format.
        """
        try:
            with ZipFile(io.BytesIO(data)) as archive:
                if sum(one.file_size for one in archive.infolist()) > LARGEST_FILE:
                    raise TableError(f"it unpacks to more than {LARGEST_FILE} bytes")
            with np.load(io.BytesIO(data), allow_pickle=False) as parts:
                text, values = str(parts["about"]), parts["values"]
                intact = str(parts["sum"]) == str(_sum(text, values))
            about = json.loads(text)
        except Exception as error:  # a damaged archive fails in many ways
            raise TableError(f"this is no table of blows: {error}") from None
        if not intact or about.get("format") != FORMAT or values.shape[-1] != ENTRIES:
            raise TableError("this table of blows is damaged or of another format")
        try:
            found = np.array(about["nodes"], float)
            counts = tuple(int(n) for n in about["counts"])
            fits = found.shape == (4, len(Axis)) and values.shape == (*counts, ENTRIES)
            if not (fits and np.isfinite(found).all() and min(counts) > 1 and min(found[3]) > 0):
                raise ValueError("its nodes are not those of its values")
            lowest, highest, origin, step = map(tuple, found.tolist())
            return cls(
                Nodes(lowest, highest, origin, step, counts, float(about["weight"])),
                np.ascontiguousarray(values, dtype=np.float64),
                about["fixed"],
                dict(about["cells"]),
                float(about["wave_speed_error"]),
            )
        except (LookupError, TypeError, ValueError, AttributeError) as error:
            raise TableError(f"this table of blows is damaged: {error}") from None


def table_key(scene: Scene) -> str:
    """Name of a scene's table: a hash of all that it depends on, the sources included."""
    nodes = Nodes.of(scene)
    parts = [FORMAT, fixed_values(scene), nodes.lowest, nodes.highest, nodes.counts]
    text = json.dumps([*parts, sources_digest()], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def _sum(text: str, values: np.ndarray) -> np.ndarray:
    digest = hashlib.sha256(text.encode())
    digest.update(np.ascontiguousarray(values).tobytes())
    return np.array(digest.hexdigest())
