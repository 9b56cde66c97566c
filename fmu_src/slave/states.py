"""Saved states: a header with a hash, where an instance is, values of its variables, its motion."""

from __future__ import annotations

import hashlib
import json
import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from fmu_src.variables import Variable

MAGIC = b"PHAMMER\0"
VERSION = 2
# magic, version, hash of what it belongs to, length of the body; then a hash of these and the body
HEADER = struct.Struct("<8sI32sQ")
DIGEST = 32
START = HEADER.size + DIGEST  # of the body
PLACE = struct.Struct("<BB6xdd")  # phase, is_set_up, start and present time
INTEGERS = (-(2**31), 2**31 - 1)  # of FMI


class StateError(ValueError):
    """Bytes that are no state of this FMU."""


class OwnState(bytes):
    """A state that was made in this process, and so needs no second look."""


class Phase(IntEnum):
    """Where an instance is in the calling sequence of FMI 2.0."""

    INSTANTIATED = 0
    INITIALISING = 1
    STEPPING = 2
    TERMINATED = 3


# Looked up by name, a member of an enumeration takes as long as setting ten inputs.
STEPPING = Phase.STEPPING


@dataclass(frozen=True)
class Place:
    """Where an instance is.

    Attributes
    ----------
    phase : Phase
    is_set_up : bool
        Whether `fmi2SetupExperiment` was called.
    start_time, now : float
        [s]
    """

    phase: Phase
    is_set_up: bool
    start_time: float
    now: float


def fingerprint(*parts: Any) -> bytes:
    """Hash of plain values, floats with all their digits."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).digest()


def pack(owner: bytes, body: bytes) -> OwnState:
    """Put the header before a state.

    Parameters
    ----------
    owner : bytes
        Hash of what the state belongs to.
    """
    header = HEADER.pack(MAGIC, VERSION, owner, len(body))
    return OwnState(header + hashlib.sha256(header + body).digest() + body)


def unpack(state: bytes) -> tuple[bytes, bytes]:
    """Return owner and body of a state; every byte of one from outside is checked.

    Raises
    ------
    StateError
        If it is no state, of another version, cut short or changed.
    """
    if isinstance(state, OwnState):
        return HEADER.unpack_from(state)[2], state[START:]
    if len(state) < START:
        raise StateError(f"a saved state of {len(state)} bytes is too short to be one")
    magic, version, owner, length = HEADER.unpack_from(state)
    if magic != MAGIC:
        raise StateError("these bytes are no saved state of this family of FMUs")
    if version != VERSION:
        raise StateError(f"the saved state has version {version}, this FMU reads {VERSION}")
    body = state[START:]
    if len(body) != length:
        raise StateError(f"the saved state has {len(body)} bytes where {length} belong")
    if hashlib.sha256(state[: HEADER.size] + body).digest() != state[HEADER.size : START]:
        raise StateError("the saved state was changed: its hash does not fit")
    return owner, body


def pack_place(place: Place) -> bytes:
    """Bytes of where an instance is."""
    return PLACE.pack(place.phase, place.is_set_up, place.start_time, place.now)


def unpack_place(body: bytes) -> Place:
    """Read where an instance is from the beginning of a body, and check it."""
    if len(body) < PLACE.size:
        raise StateError(f"the saved state has {len(body)} bytes, too few for a time")
    phase, is_set_up, start, now = PLACE.unpack_from(body)
    if phase not in set(Phase) or is_set_up not in (0, 1) or is_set_up < (phase > 0):
        raise StateError(f"the saved state is in phase {phase}, set up: {is_set_up}")
    if not (math.isfinite(start) and math.isfinite(now) and now >= start):
        raise StateError(f"the saved state has the time {now!r} s after a start at {start!r} s")
    return Place(Phase(phase), bool(is_set_up), start, now)


def pack_values(variables: Sequence[Variable], values: dict[str, Any]) -> bytes:
    """Values of variables, as numbers."""
    return struct.pack(f"<{len(variables)}d", *(values[one.name] for one in variables))


def unpack_values(variables: Sequence[Variable], body: bytes, begin: int) -> dict[str, Any]:
    """Values by name; those of inputs and parameters are checked when they are used."""
    count = len(variables)
    if len(body) < begin + 8 * count:
        raise StateError(f"the saved state has {len(body)} bytes, too few for {count} values")
    numbers = struct.unpack_from(f"<{count}d", body, begin)
    return {one.name: _typed(one, number) for one, number in zip(variables, numbers, strict=True)}


def _typed(one: Variable, number: float) -> Any:
    """A value as its type, which has to hold it exactly."""
    if one.type == "Real":
        return number
    low, high = (0, 1) if one.type == "Boolean" else INTEGERS
    if not low <= number <= high or number != int(number):
        raise StateError(f"the saved state has {one.name} = {number!r}: no {one.type}")
    return bool(number) if one.type == "Boolean" else int(number)
