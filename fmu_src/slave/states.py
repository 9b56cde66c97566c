"""Saved states: a header, and the bytes that a slave gives."""

from __future__ import annotations

import hashlib
import json
import struct
from typing import Any

MAGIC = b"PHAMMER\0"
VERSION = 1
HEADER = struct.Struct("<8sI32sQ")  # magic, version, hash of the parameters, length of the rest


class StateError(ValueError):
    """Bytes that are no state of this FMU."""


def fingerprint(*parts: Any) -> bytes:
    """Hash of plain values, floats with all their digits."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).digest()


def pack(parameters: bytes, body: bytes) -> bytes:
    """Put the header before a state."""
    return HEADER.pack(MAGIC, VERSION, parameters, len(body)) + body


def unpack(parameters: bytes, state: bytes) -> bytes:
    """Return the body of a state after checking its header.

    Raises
    ------
    StateError
        If it is no state, of another version, of other parameters or cut short.
    """
    if len(state) < HEADER.size:
        raise StateError(f"a saved state of {len(state)} bytes is too short to be one")
    magic, version, found, length = HEADER.unpack_from(state)
    if magic != MAGIC:
        raise StateError("these bytes are no saved state of a percussive hammer")
    if version != VERSION:
        raise StateError(f"the saved state has version {version}, this FMU reads {VERSION}")
    if found != parameters:
        raise StateError("the saved state belongs to other parameters or to another FMU")
    body = state[HEADER.size :]
    if len(body) != length:
        raise StateError(f"the saved state has {len(body)} bytes where {length} belong")
    return body
