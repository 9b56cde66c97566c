"""Warnings about a motion for the log: each once, and as soon as it is seen."""

from __future__ import annotations

from collections.abc import Iterator

from fmu_src.hammer.motion import AT, Motion
from percussion_model.physics.records import Mode
from percussion_model.scene.scales import barrier_shares
from percussion_model.simulation.validity import (
    barrier_note,
    button_note,
    flight_note,
    guard_notes,
    ledger_note,
    numerical_note,
    rate_note,
    stiffness_at,
)

# Time between two checks of a motion [s]; one costs as much as reading an output.
INTERVAL = 0.1


class Warnings:
    """Finds what is wrong with a motion; tells each thing once."""

    def __init__(self) -> None:
        self._told: set[str] = set()
        self._scene_seen = False
        self._next = 0.0
        self._blows = 0
        self._pushed = 0.0  # when the rock was last seen to be pushed [s]
        self._impulse = 0.0  # of the bit force, then [N s]

    def new(self, motion: Motion, loading_stiffness: float) -> list[str]:
        """Messages that are new.

        Parameters
        ----------
        motion : Motion
        loading_stiffness : float
            Of the rock now, under one button [N/m].
        """
        if motion.time < self._next - INTERVAL:  # an older state has been restored
            self._next, self._pushed = motion.time, motion.time
        due = motion.time >= self._next
        if not due and motion.blow_count == self._blows:
            return []
        found = list(self._of_blow(motion, loading_stiffness))
        if due:
            self._next = motion.time + INTERVAL
            found += self._of_state(motion)
        new = []
        for kind, text in found:
            if kind not in self._told:
                self._told.add(kind)
                new.append(text)
        return new

    def _of_blow(self, motion: Motion, stiffness: float) -> Iterator[tuple[str, str]]:
        """What the last whole blow tells."""
        if motion.blow_count == self._blows:
            return
        self._blows = motion.blow_count
        rock, peak = motion.scene.effects.rock, motion.blow["peak_bit_force"]
        if rock not in ("wall", "none"):
            secant = stiffness_at(motion.scene, peak, stiffness)
            for text in button_note(peak, secant):
                yield "button", text
        period = motion.blow["period"]
        if rock != "none" and period > 0.0:
            for text in rate_note(motion.blow["hole_advance"] / period):
                yield "rate", text

    def _of_state(self, motion: Motion) -> Iterator[tuple[str, str]]:
        """What ledger, counts and forces tell."""
        if not self._scene_seen:  # it does not change, and a check would cost more than the rest
            self._scene_seen = True
            for text in barrier_note(*barrier_shares(motion.scene)):
                yield "barrier", text
        for text in ledger_note(motion.residual()):
            yield "ledger", text
        for text in numerical_note(motion.numerical(), motion.solver.name):
            yield "numerical", text
        for text in guard_notes(motion.solver.statistics(motion._state)):
            yield "guards", text
        if motion.scene.effects.rock == "none":
            return
        row = motion.read()
        impulse = row[AT["bit_impulse"]]
        if row[AT["drilling_mode"]] != Mode.FF or impulse != self._impulse:
            self._pushed, self._impulse = motion.time, impulse
        for text in flight_note(motion.time - self._pushed):
            yield "flight", text
