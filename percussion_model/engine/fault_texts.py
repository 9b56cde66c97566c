"""Texts of what entries refuse: templates for the numbers of faults, with facts to fill in.

The shell of FMUs puts facts in place of `{0}`, `{1:.3g}` and the like; so does `fault_text`.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence

import numpy as np

from percussion_model.engine.faults import Fault
from percussion_model.scene.contradictions import TEXTS
from percussion_model.scene.parameters import row_of
from percussion_model.solvers.fem.records import FEM_LIMITS
from percussion_model.solvers.modal.faults import FAULTS as MODAL_FAULTS
from percussion_model.solvers.modal.records import MODAL_LIMITS
from percussion_model.solvers.rigid.records import RIGID_LIMITS
from percussion_model.solvers.state import WORKSPACE
from percussion_model.solvers.wave.network import TOO_FINE
from percussion_model.solvers.wave.records import WAVE_LIMITS


def _too_many(name: str, instead: str = "") -> str:
    """Template of a refusal of more cells, elements or modes than can be set up."""
    return (
        f"the bars would have {{0:.3g}} {name}, more than {{1:d}}: ask for fewer, or "
        f"make the bars more alike in length{instead}"
    )


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
        Fault.MODAL_FIELD: of_field(MODAL_LIMITS.names),
        Fault.WAVE_FIELD: of_field(WAVE_LIMITS.names),
        Fault.FEM_FIELD: of_field(FEM_LIMITS.names),
        Fault.RIGID_FIELD: of_field(RIGID_LIMITS.names),
    }
    rules = (_of_rule(TEXTS[rule]) for rule in sorted(TEXTS))
    more = [*(_of_state(text) for text in MODAL_FAULTS[1:]), *rules]
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
        row = row_of(found[1])
        form = f"|{'|'.join(row.choices)}|" if row.choices else "r"
        if row.kind == "whole number":
            form = "d"
        return f"{{{keys.index(found[1])}:{form}}}"

    return _PLACE.sub(place, text)


def of_field(names: list[str]) -> str:
    """Template of a field that is out of its limits, by its word."""
    choice = f"{{0:|{'|'.join(names)}|}}"
    return f"the saved state has {choice} = {{1:r}}, which must be from {{2:g}} to {{3:g}}"


def _of_state(text: str) -> str:
    return "the saved state has " + text.replace("!r}", ":r}").replace(":.0f}", ":d}")


_FACT = re.compile(r"\{(\d)(?::([^{}]*))?\}")


def _written(value: float, form: str) -> str:
    """A fact as a template wants it written: `r` as Python does, `d` whole, or one of words."""
    if form.startswith("|"):
        return form.strip("|").split("|")[round(value) - 1]
    if form == "d":
        return str(int(value))
    return repr(value) if form == "r" else format(value, form)


def fault_text(number: int, facts: Sequence[float] | np.ndarray) -> str:
    """Text of a fault.

    Parameters
    ----------
    number : int
        As an entry gives it.
    facts : sequence of float
        That it has filled in.
    """
    return _FACT.sub(
        lambda found: _written(float(facts[int(found[1])]), found[2] or ""), _templates()[number]
    )


@functools.cache
def _templates() -> tuple[str, ...]:
    return faults()
