"""A failing case with all left out that it does not need to fail."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from percussion_model import SceneError
from tests.properties.checks import check_case
from tests.properties.scenes import Case

# What a fault is known by: the first words of its message.
WORDS = 2


def fault_of(case: Case) -> str:
    """First words of what is wrong with a case; empty where nothing is."""
    try:
        check_case(case)
    except Exception as error:
        return " ".join(str(error).split()[:WORDS]) or type(error).__name__
    return ""


def simpler(case: Case) -> Iterator[Case]:
    """Cases with one thing less."""
    for k in reversed(range(len(case.calls))):
        yield replace(case, calls=case.calls[:k] + case.calls[k + 1 :])
    yield replace(case, length=0.5 * case.length)
    for key in sorted(case.scene.given):
        # what stands for the cost of a case stays
        if key.startswith("run."):
            continue
        try:
            yield replace(case, scene=case.scene.replace(**{key: None}))
        except SceneError:
            continue


def reduced(case: Case, most: int = 400) -> Case:
    """Leave out one thing after the other while the case fails in the same way."""
    fault = fault_of(case)
    tried = 0
    found = True
    while found and tried < most:
        found = False
        for candidate in simpler(case):
            tried += 1
            if fault_of(candidate) == fault:
                case, found = candidate, True
                break
    return case
