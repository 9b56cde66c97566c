"""Texts of what the kernels tell of a motion: notes are numbers, with facts to fill in.

The shell puts facts in place of `{0}`, `{1:.3g}` and the like; the words are those of the
Python package.
"""

from __future__ import annotations

from enum import IntEnum

from fmu_src.hammer.inputs import NAMES_OUTSIDE
from percussion_model.engine.records import KINDS
from percussion_model.scene.inputs import INPUTS
from percussion_model.simulation import validity
from percussion_model.simulation.templates import Fact, only


class Note(IntEnum):
    """What is told of a motion."""

    BARRIER = 1
    LEDGER = 2
    GIVES_ENERGY = 3
    TAKES_ENERGY = 4  # and the following: one for each `Kind`
    LOCKED = 8
    STORM = 9
    FLIGHT = 10
    BUTTON = 11
    RATE = 12
    IN_VAIN = 13  # and the following: one for each input


def _counted(name: str, two: str, template: str) -> str:
    """Template of a note that counts something, from the note for two of it."""
    text = only(validity.guard_notes({name: 2}))
    if two not in text:
        raise ValueError(f"{two!r} is not in the note {text!r}")
    return text.replace(two, template, 1)


def notes() -> tuple[str, ...]:
    """Templates of the notes, by `Note`."""
    one = Fact(0, 1.0)
    texts: dict[int, str] = {
        Note.BARRIER: only(validity.barrier_note(one, Fact(1, 1.0))),
        Note.LEDGER: only(validity.ledger_note(one)),
        Note.GIVES_ENERGY: only(validity.numerical_note(Fact(0, -1.0), "modal")),
        Note.LOCKED: _counted("locked", "2 time steps", "{0:d} time step{1:||s|}"),
        Note.STORM: _counted("storms", "2 storms", "{0:d} storm{1:||s|}"),
        Note.FLIGHT: only(validity.flight_note(one)),
        Note.BUTTON: only(validity.button_note(one, 1.0)),
        Note.RATE: only(validity.rate_note(one)),
    }
    for name, kind in KINDS.items():
        text = only(validity.numerical_note(0.5, name))
        texts[Note.TAKES_ENERGY + kind - 1] = text.replace("50 %", "{0:.2g} %", 1)
    ordered = [texts[k] for k in range(1, 1 + len(texts))]
    vain = [f"a new {NAMES_OUTSIDE[name]} has no effect in this scene" for name in INPUTS]
    return ("", *(f"at t = {{6:.6g}} s: {text}" for text in ordered), *vain)
