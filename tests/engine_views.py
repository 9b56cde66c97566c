"""What lies in the memory of a solver's motion, for tests of its insides."""

import numpy as np

from percussion_model.engine import fem, modal, wave
from percussion_model.solvers.fem.prepare import refresh
from percussion_model.solvers.modal.records import Forms, Laws
from percussion_model.solvers.wave.records import Body, Chain

WHOLE = (modal.SIZES, modal.LAW_SIZES, modal.WAY)  # rows of whole numbers


def chain_of(solver):
    """`Chain` of a solver by waves."""
    rows = (wave.STEEL, wave.WEIGHTS, wave.PASSAGE, wave.FITS, wave.BODIES)
    motion = solver._motion
    return Chain(motion.array(wave.PLACES, 2, np.int64), *(motion.array(k, 2) for k in rows))


def first_section(solver, name):
    """The topmost section of a bar."""
    return int(chain_of(solver).bodies[solver._names.index(name), Body.FIRST])


class Tables:
    """Tables of a solver by modes, which others may share."""

    def __init__(self, solver):
        def row(k, dimensions):
            kind = np.int64 if k in WHOLE else np.float64
            return solver._motion.array(k, dimensions, kind)

        forms = (modal.SIZES, modal.STIFF, modal.SHAPE, modal.MOVE, modal.YIELDS, modal.CHANGE,
                 modal.JOIN)  # fmt: skip
        self.forms = Forms(*map(row, forms, (1, 1, 3, 4, 3, 4, 3)))
        laws = (modal.LAW_SIZES, modal.DASHPOT, modal.LAW_MOVE, modal.ENDS, modal.OUT, modal.INTO,
                modal.TAKEN, modal.REST, modal.VIEWS, modal.SCANS, modal.SIDES, modal.WAY,
                modal.OVER, modal.PUSHED, modal.HELD)  # fmt: skip
        self.laws = Laws(*map(row, laws, (1, 1, 4, 3, 3, 3, 3, 2, 4, 4, 4, 2, 3, 3, 3)))
        self.shape_p, self.move_p = row(modal.SHAPE_P, 2), row(modal.MOVE_P, 3)


def mesh_of(solver):
    """Nodes of a solver by finite elements."""
    return solver._motion.array(fem.MESH, 2)


def refresh_nodes(solver, state):
    """Derive everything from the nodes, as at the start of a run."""
    refresh(solver._par[0], state.record[0], state.arrays[0], mesh_of(solver))
