"""Texts of what the kernels tell: faults and notes are numbers, with facts to fill in.

The shell puts facts in place of `{0}`, `{1:.3g}` and the like; the words are those of the
Python package.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from enum import IntEnum

from fmu_src.hammer.inputs import NAMES_OUTSIDE
from percussion_model.scene.contradictions import TEXTS
from percussion_model.scene.inputs import INPUTS
from percussion_model.scene.parameters import find_row
from percussion_model.simulation import validity
from percussion_model.solvers.modal.faults import FAULTS as MODAL_FAULTS
from percussion_model.solvers.modal.records import MODAL_LIMITS
from percussion_model.solvers.state import WORKSPACE


class Fault(IntEnum):
    """Why a kernel refuses; 0 stands for none."""

    MEMORY = 1
    MODES = 2  # how many, at most
    SOLVER = 3
    GAUGE = 4  # place, length of the bar
    NOT_FINITE = 5  # time
    STOPPED = 6  # time
    MOTION = 7  # what a communication step keeps
    WORKSPACE = 8
    MODAL_FIELD = 9  # word, value, its limits
    MODAL_STATE = 10  # and the following: as `solvers.modal.faults.FAULTS`


class Note(IntEnum):
    """What is told of a motion."""

    BARRIER = 1
    LEDGER = 2
    GIVES_ENERGY = 3
    TAKES_ENERGY = 4
    LOCKED = 5
    STORM = 6
    FLIGHT = 7
    BUTTON = 8
    RATE = 9
    IN_VAIN = 10  # and the following: one for each input


class Fact(float):
    """A number that writes itself as a place for a fact, to turn a text into a template.

    What is computed of it is the same fact: kernels give facts as they are to be written.
    """

    place: int

    def __new__(cls, place: int, value: float) -> Fact:
        """Make a fact that is compared as a value."""
        fact = super().__new__(cls, value)
        fact.place = place
        return fact

    def __format__(self, form: str) -> str:
        return f"{{{self.place}:{form}}}" if form else f"{{{self.place}}}"

    def __rmul__(self, factor: float) -> Fact:
        return Fact(self.place, float(self) * factor)

    def __truediv__(self, other: float) -> Fact:
        return Fact(self.place, float(self) / other)


def faults() -> tuple[str, ...]:
    """Templates of the faults, by `Fault`."""
    texts = {
        Fault.MEMORY: "memory is exhausted",
        Fault.MODES: (
            "the bars would have {0:.3g} modes, more than {1:g}: ask for fewer, or make the bars "
            'more alike in length, or take waves (solver.name = "wave")'
        ),
        Fault.SOLVER: (
            "this library does not compute the solver that the parameters ask for: take the FMU "
            "that runs Python"
        ),
        Fault.GAUGE: (
            "gauge.position = {0:r} m: lies below the {2:|piston|bit|}, which is {1:g} m long"
        ),
        Fault.NOT_FINITE: "at t = {0:r} s the state is no longer finite: check the scene",
        Fault.STOPPED: "at t = {0:r} s the solver could not continue",
        Fault.MOTION: "the saved motion has a number that is not finite, or a count below 0",
        Fault.WORKSPACE: f"the saved state has {WORKSPACE}",
        Fault.MODAL_FIELD: _of_field(MODAL_LIMITS.names),
    }
    states = [_of_state(text) for text in MODAL_FAULTS[1:]]
    return ("", *texts.values(), *states, *map(_of_rule, TEXTS.values()))


# Number of the fault for the first of the rules, and places of a scene's values in their texts.
FIRST_RULE = int(Fault.MODAL_STATE) + len(MODAL_FAULTS) - 1
_PLACE = re.compile(r"\{([a-z_]+\.[a-z_]+)(!r)?\}")


def keys_in(text: str) -> list[str]:
    """Keys of a scene whose values stand in a text."""
    return list(dict.fromkeys(found[1] for found in _PLACE.finditer(text)))


def _of_rule(text: str) -> str:
    keys = keys_in(text)

    def place(found: re.Match[str]) -> str:
        row = find_row(found[1])
        assert row is not None
        form = f"|{'|'.join(row.choices)}|" if row.choices else "r"
        if row.kind == "whole number":
            form = "d"
        return f"{{{keys.index(found[1])}:{form}}}"

    return _PLACE.sub(place, text)


def _of_field(names: list[str]) -> str:
    """Template of a field that is out of its limits, by its word."""
    choice = f"{{0:|{'|'.join(names)}|}}"
    return f"the saved state has {choice} = {{1:r}}, which must be from {{2:g}} to {{3:g}}"


def _of_state(text: str) -> str:
    return "the saved state has " + text.replace("!r}", ":r}").replace(":.0f}", ":d}")


def _only(texts: Iterator[str]) -> str:
    (text,) = texts
    return text


def _counted(name: str, two: str, template: str) -> str:
    """Template of a note that counts something, from the note for two of it."""
    text = _only(validity.guard_notes({name: 2}))
    if two not in text:
        raise ValueError(f"{two!r} is not in the note {text!r}")
    return text.replace(two, template, 1)


def notes() -> tuple[str, ...]:
    """Templates of the notes, by `Note`."""
    one = Fact(0, 1.0)
    texts = {
        Note.BARRIER: _only(validity.barrier_note(one, Fact(1, 1.0))),
        Note.LEDGER: _only(validity.ledger_note(one, "modal")),
        Note.GIVES_ENERGY: _only(validity.numerical_note(Fact(0, -1.0), "modal")),
        Note.TAKES_ENERGY: _only(validity.numerical_note(0.5, "modal")).replace(
            "50 %", "{0:.2g} %", 1
        ),
        Note.LOCKED: _counted("locked", "2 time steps", "{0:d} time step{1:||s|}"),
        Note.STORM: _counted("storms", "2 storms", "{0:d} storm{1:||s|}"),
        Note.FLIGHT: _only(validity.flight_note(one)),
        Note.BUTTON: _only(validity.button_note(one, 1.0)),
        Note.RATE: _only(validity.rate_note(one)),
    }
    vain = [f"a new {NAMES_OUTSIDE[name]} has no effect in this scene" for name in INPUTS]
    return ("", *(f"at t = {{6:.6g}} s: {text}" for text in texts.values()), *vain)
