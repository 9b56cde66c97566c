"""Texts of what the kernels tell: faults and notes are numbers, with facts to fill in.

The shell puts facts in place of `{0}`, `{1:.3g}` and the like; the words are those of the
Python package.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from enum import IntEnum

from fmu_src.hammer.inputs import NAMES_OUTSIDE
from fmu_src.native.layout import KINDS
from percussion_model.scene.contradictions import TEXTS
from percussion_model.scene.inputs import INPUTS
from percussion_model.scene.parameters import find_row
from percussion_model.scene.scene import SceneError
from percussion_model.simulation import validity
from percussion_model.solvers.fem.records import FEM_LIMITS
from percussion_model.solvers.modal.faults import FAULTS as MODAL_FAULTS
from percussion_model.solvers.modal.records import MODAL_LIMITS
from percussion_model.solvers.rigid.records import RIGID_LIMITS
from percussion_model.solvers.setup import refuse_many
from percussion_model.solvers.state import WORKSPACE
from percussion_model.solvers.wave.network import TOO_FINE
from percussion_model.solvers.wave.records import WAVE_LIMITS


class Fault(IntEnum):
    """Why a kernel refuses; 0 stands for none."""

    MEMORY = 1
    SOLVER = 2
    GAUGE = 3  # place, length of the bar, which
    MODES = 4  # how many, at most
    CELLS = 5
    ELEMENTS = 6
    TOO_FINE = 7  # loss time, length of a section, time step
    NOT_FINITE = 8  # time
    STOPPED = 9  # time
    MOTION = 10  # what a communication step keeps
    WORKSPACE = 11
    BEHIND = 12  # time of the state, present
    NEXT_EVENT = 13  # time of the next event, present
    MODAL_FIELD = 14  # word, value, its limits
    WAVE_FIELD = 15
    FEM_FIELD = 16
    RIGID_FIELD = 17
    MODAL_STATE = 18  # and the following: as `solvers.modal.faults.FAULTS`


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


def _too_many(name: str, instead: str = "") -> str:
    """Template of `refuse_many`."""
    text = refused(lambda: refuse_many(name, math.inf, 10**9, instead))
    return text.replace("inf", "{0:.3g}", 1).replace(str(10**9), "{1:d}", 1)


def refused(work: Callable[[], object]) -> str:
    """Message of an error that work ends with."""
    try:
        work()
    except SceneError as error:
        return str(error)
    raise ValueError("nothing was refused")


def faults(bars: Sequence[str] = ("piston", "bit")) -> tuple[str, ...]:
    """Templates of the faults, by `Fault`.

    Parameters
    ----------
    bars : sequence of str
        That may carry the gauge.
    """
    texts: dict[int, str] = {
        Fault.MEMORY: "memory is exhausted",
        Fault.SOLVER: (
            "this library does not compute the solver that the parameters ask for: take the FMU "
            "that runs Python"
        ),
        Fault.GAUGE: (
            f"gauge.position = {{0:r}} m: lies below the {{2:|{'|'.join(bars)}|}}, "
            "which is {1:g} m long"
        ),
        Fault.MODES: _too_many("modes", ', or take waves (solver.name = "wave")'),
        Fault.CELLS: _too_many("cells"),
        Fault.ELEMENTS: _too_many("elements"),
        Fault.TOO_FINE: TOO_FINE.format(eta="{0:.3g}", length="{1:g}", step="{2:.2g}"),
        Fault.NOT_FINITE: "at t = {0:r} s the state is no longer finite: check the scene",
        Fault.STOPPED: "at t = {0:r} s the solver could not continue",
        Fault.MOTION: "the saved motion has a number that is not finite, or a count below 0",
        Fault.WORKSPACE: f"the saved state has {WORKSPACE}",
        Fault.BEHIND: "the saved state has its time of {0:r} s, far before {1:r} s",
        Fault.NEXT_EVENT: (
            "the saved state has its next event at {0:r} s, at a present of {1:r} s"
        ),
        Fault.MODAL_FIELD: _of_field(MODAL_LIMITS.names),
        Fault.WAVE_FIELD: _of_field(WAVE_LIMITS.names),
        Fault.FEM_FIELD: _of_field(FEM_LIMITS.names),
        Fault.RIGID_FIELD: _of_field(RIGID_LIMITS.names),
    }
    more = [*(_of_state(text) for text in MODAL_FAULTS[1:]), *map(_of_rule, TEXTS.values())]
    texts |= {Fault.MODAL_STATE + k: text for k, text in enumerate(more)}
    return ("", *(texts[k] for k in range(1, 1 + len(texts))))


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
    texts: dict[int, str] = {
        Note.BARRIER: _only(validity.barrier_note(one, Fact(1, 1.0))),
        Note.LEDGER: _only(validity.ledger_note(one)),
        Note.GIVES_ENERGY: _only(validity.numerical_note(Fact(0, -1.0), "modal")),
        Note.LOCKED: _counted("locked", "2 time steps", "{0:d} time step{1:||s|}"),
        Note.STORM: _counted("storms", "2 storms", "{0:d} storm{1:||s|}"),
        Note.FLIGHT: _only(validity.flight_note(one)),
        Note.BUTTON: _only(validity.button_note(one, 1.0)),
        Note.RATE: _only(validity.rate_note(one)),
    }
    for name, kind in KINDS.items():
        text = _only(validity.numerical_note(0.5, name))
        texts[Note.TAKES_ENERGY + kind - 1] = text.replace("50 %", "{0:.2g} %", 1)
    ordered = [texts[k] for k in range(1, 1 + len(texts))]
    vain = [f"a new {NAMES_OUTSIDE[name]} has no effect in this scene" for name in INPUTS]
    return ("", *(f"at t = {{6:.6g}} s: {text}" for text in ordered), *vain)
