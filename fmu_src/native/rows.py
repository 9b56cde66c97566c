"""Rows in which kernels tell the shell of notes and faults."""

from __future__ import annotations

from percussion_model.engine.memory import floats_at, words_at
from percussion_model.physics.kernel import preparing

# Rows of notes, as the shell has them (fmu_src/native/shell.h); the first is for a fault.
ROW, ROWS = 8, 32
TIME = 6  # place of the fact that tells when


@preparing
def add_note(notes, number, first, second, time):
    """Write a row: the number of a template and its facts."""
    count = words_at(notes, 1)
    k = max(count[0], 1)
    if k < ROWS:
        words_at(notes + 8 * (1 + ROW * k), 1)[0] = number
        facts = floats_at(notes + 8 * (2 + ROW * k), ROW - 1)
        facts[0], facts[1], facts[TIME] = first, second, time
        count[0] = k + 1


@preparing
def set_fault(notes, number, facts):
    """Write why a kernel refuses, with its facts; its number."""
    words_at(notes, 2)[1] = number
    written = floats_at(notes + 16, ROW - 1)
    for k in range(len(facts)):
        written[k] = facts[k]
    return number
