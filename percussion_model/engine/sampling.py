"""Samples at many times by one call, the same for all solvers."""

from __future__ import annotations

from typing import Any

from percussion_model.engine.layout import head_records
from percussion_model.engine.memory import floats_at, words_at
from percussion_model.engine.records import ADVANCE, RECORD
from percussion_model.physics.kernel import composed
from percussion_model.physics.records import SAMPLE_FIELDS, Status

WIDTH = len(SAMPLE_FIELDS)
# In place of whether peaks are wanted: nor is the ledger.
SAMPLE_ALONE = -1


def sampler(run: Any, read: Any, state_time: Any, time_of_blow: Any) -> Any:
    """Kernel that advances through rising times and reads at each, as calls of the entries do.

    Parameters
    ----------
    run, read, state_time, time_of_blow : kernels
        Entries of a solver.
    """

    @composed
    def sample(base, moving, copy, advances, times, count, reading, rows, blows, room, events,
               event_room, events_on, done):  # fmt: skip
        wanted, there = floats_at(times, count), words_at(done, 1)
        row, out = floats_at(reading, WIDTH), floats_at(rows, count * WIDTH)
        head = head_records(base, 1)[0]
        words = words_at(moving + RECORD, head.state_bytes // 8)
        there[0] = 0
        for k in range(count):
            t, listed = wanted[k], 0
            if advances:
                status = run(
                    base, moving, ADVANCE, t, blows, room, events, event_room, events_on
                )  # fmt: skip
                if status != Status.DONE:
                    return status
                if k > 0 and time_of_blow(base, moving) > t:  # it is looked for between two calls
                    break
                listed = words[head.blow_count_at] + words[head.event_count_at]
            t = max(t, state_time(base, moving))
            status = read(base, moving, copy, t, reading, SAMPLE_ALONE)
            if status != Status.DONE:
                return status
            for i in range(WIDTH):
                out[k * WIDTH + i] = row[i]
            there[0] = k + 1
            if listed > 0:
                break
        return Status.DONE.value

    return sample
