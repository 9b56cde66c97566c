"""A run until its blows repeat by one call, the same for all solvers."""

from __future__ import annotations

from typing import Any

from percussion_model.engine.layout import head_records
from percussion_model.engine.memory import matrix_at, records_at, words_at
from percussion_model.engine.records import ADVANCE, BLOW_BYTES, RECORD
from percussion_model.physics.kernel import composed
from percussion_model.physics.records import Status
from percussion_model.physics.settling import (
    REQUEST,
    WIDTH,
    Verdict,
    blows_wanted,
    judge,
    stalls_at,
)

requests = records_at(REQUEST)


def settler(run: Any, state_time: Any) -> Any:
    """Kernel that lists blows until they are judged, or until a call is long enough.

    Parameters
    ----------
    run, state_time : kernels
        Entries of a solver.
    """

    @composed
    def settle(base, moving, request, blows, room):
        record, rows = requests(request, 1), matrix_at(blows, room, WIDTH)
        asked = record[0]
        head = head_records(base, 1)[0]
        words = words_at(moving + RECORD, head.state_bytes // 8)
        while asked.verdict == Verdict.OPEN and asked.time < asked.until:
            n = asked.blows
            asked.wanted = blows_wanted(asked.judged, asked.most)
            stalled = max(stalls_at(rows, asked.judged), asked.time)
            end = min(stalled, asked.until)
            status = run(
                base, moving, ADVANCE, end, blows + n * BLOW_BYTES, asked.wanted - n, 0, 0, 0
            )
            asked.blows = n + words[head.blow_count_at]
            if status == Status.BLOWS_FULL:
                asked.time = max(asked.time, state_time(base, moving))
            elif status == Status.DONE:
                asked.time = end
            else:
                return status
            if asked.blows >= asked.wanted or asked.time >= stalled:
                judge(rows, record)
        return Status.DONE.value

    return settle
