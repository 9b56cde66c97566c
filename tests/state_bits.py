"""States as bytes, for tests that ask for the same bits."""

from __future__ import annotations


def state_bits(state) -> bytes:
    """All of a state but the counts of rows that its last call has filled."""
    record = state.record.copy()
    record["n_blows"] = record["n_events"] = 0
    return record.tobytes() + state.workspace.tobytes()


def run_bits(simulation) -> tuple[bytes, bytes, bytes]:
    """State, blow table and events of a simulation as bytes."""
    state = state_bits(simulation.save().state)
    return state, simulation.blows.tobytes(), simulation.events.tobytes()
