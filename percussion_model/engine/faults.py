"""Numbers of what the entries refuse; `fault_texts` has the words."""

from __future__ import annotations

from enum import IntEnum


class Fault(IntEnum):
    """Why an entry refuses; 0 stands for none."""

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
