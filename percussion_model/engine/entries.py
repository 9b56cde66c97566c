"""Entries that each solver has, by which every host calls it.

Arguments are whole numbers, most of them addresses, and numbers; so are results. No entry keeps
anything outside the memory that it is given. Those of a solver stand in the module of its name
here; the library has them as `<solver>_<entry>`.

`image` is the address of a scene's image, `base` that of what `create` has made, `moving` that of
what moves: the part of `base`, or a copy of it.
"""

from __future__ import annotations

SOLVERS = ("modal", "wave", "fem", "rigid")

# Result and arguments: w a whole number, n a number.
ENTRIES = {
    # image, facts -> number of a fault
    "refuse": "w:ww",
    # image, key -> how many numbers tables follow from besides the bars
    "table_key": "w:ww",
    # image, gauge's bar, place, base whose tables are used -> base
    "create": "w:wwnw",
    # base, moving -> time
    "state_time": "n:ww",
    # base, moving, time -> time
    "grid_point_after": "n:wwn",
    # base, moving -> time
    "readable_until": "n:ww",
    # base, moving, time -> 1 or 0
    "is_quiet": "w:wwn",
    # base, moving -> time
    "time_of_blow": "n:ww",
    # base, moving, task, time, blows, room, events, room, whether events are listed -> Status
    "run": "w:wwwnwwwww",
    # base, moving, copy, time, reading, 1: with peaks, 0: without, -1: a sample alone -> Status
    "read": "w:wwwnww",
    # base, moving, copy, whether to advance, times, count, reading, rows, blows, room, events,
    # room, whether events are listed, count of rows -> Status
    "sample": "w:wwwwwwwwwwwwww",
    # base, moving, what is asked (`settling.REQUEST`), blows, room -> Status
    "settle": "w:wwwww",
    # base, moving, time, facts -> number of a fault
    "find_fault": "w:wwnw",
    # base, moving -> stress at the gauge
    "stress": "n:ww",
    # image, bar, counts, masses -> cells
    "cells": "w:wwww",
    # base, moving, bar -> form
    "shape_form": "w:www",
    # image, bar, form, matrices -> modes
    "shapes": "w:wwww",
    # base, moving, bar, masses, matrices, modes, cells, forces, velocities -> 0
    "fields": "w:wwwwwwwww",
}
# The same of libraries beside those of the solvers.
OTHERS = {
    # calls, places, values, reals, integers, at (addresses: `coupling.calls`), steps, start and
    # step -> steps that are done
    "calls": {"run": "w:wwwwwwwnn"},
}
