"""Fronts of an impact along their characteristics: where they go and how strong they are."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Sequence
from dataclasses import dataclass

from percussion_model import Scene

# Fronts weaker than this share of the first are not followed.
WEAKEST = 0.12


@dataclass(frozen=True)
class Front:
    """A front through one section: it starts and ends at a border, as (time [s], depth [m])."""

    start: tuple[float, float]
    end: tuple[float, float]
    force: float  # force that it brings, by that of the first, positive in compression


def fronts(
    scene: Scene, contacts: Sequence[tuple[float, float]], end: float
) -> tuple[list[Front], list[float]]:
    """Follow the fronts of the first impact (docs/model.md, eqs 7 and 8).

    Free ends reverse the force; so does the rock, whose spring yields to the front itself.

    Parameters
    ----------
    contacts : sequence of tuple
        Intervals in which piston and bit touch, since the impact [s].
    end : float
        Time up to which fronts are followed [s].

    Returns
    -------
    list of Front
    borders : list of float
        Depths of all ends and steps [m].
    """
    sections = [*scene.piston.sections, *scene.bit.sections]
    borders = [0.0]
    for section in sections:
        borders.append(borders[-1] + section.length)
    struck = len(scene.piston.sections)
    found: list[Front] = []
    waiting = [(0.0, struck - 1, -1, 1.0), (0.0, struck, 1, 1.0)]
    while waiting:
        start, k, way, force = waiting.pop()
        arrival = start + sections[k].length / sections[k].wave_speed
        border = k if way < 0 else k + 1
        here = borders[k + 1 if way < 0 else k]
        found.append(Front((start, here), (arrival, borders[border]), force))
        if arrival > end:
            continue
        beyond = k + way
        open_ = border in (0, len(sections)) or (border == struck and not _touch(contacts, arrival))
        if open_:
            waiting.append((arrival, k, -way, -force))
            continue
        one, two = sections[k].impedance, sections[beyond].impedance
        for place, sense, share in (
            (k, -way, (two - one) / (one + two)),
            (beyond, way, 2.0 * two / (one + two)),
        ):
            if abs(share * force) >= WEAKEST:
                waiting.append((arrival, place, sense, share * force))
    return found, borders


def _touch(contacts: Sequence[tuple[float, float]], time: float) -> bool:
    """Whether piston and bit touch at a time."""
    k = bisect([start for start, _ in contacts], time) - 1
    return k >= 0 and time < contacts[k][1]
