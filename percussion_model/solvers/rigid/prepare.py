"""Parameters and first state of the rigid-body solver, from the numbers of a scene."""

from __future__ import annotations

import math

from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Piston
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.rigid.forces import acceleration, contact_force, kinetic_energy
from percussion_model.solvers.rigid.restitution import restitution
from percussion_model.solvers.setup import (
    PISTONS,
    REARM_TRANSITS,
    fill_parameters,
    fill_start,
)

# More events than this within a transit of the longer bar are a storm: the reference has
# no more than 13. What rigid bodies do within a transit is not theirs to tell anyway.
MOST_EVENTS = 200
SHORTEST_WINDOW = 1e-6  # of a very short bar [s]


@preparing
def fill_rigid_parameters(p, numbers):
    """Fill a RIGID_PAR record of a scene whose bars count as rigid."""
    has_piston = PISTONS[numbers.values.piston_model] != Piston.ABSENT
    fill_parameters(p, numbers, has_piston)
    p.piston = Piston.RIGID if has_piston else Piston.ABSENT
    p.restitution = restitution(numbers)
    p.window = max(p.rearm_time / REARM_TRANSITS, SHORTEST_WINDOW)
    p.most_events = MOST_EVENTS


@preparing
def begin(p, s, numbers):
    """Fill a RIGID_STATE record at time zero: a piston at rest on the bit is held there."""
    fill_start(s, numbers)
    if p.piston == Piston.ABSENT:
        s.gap = 0.0
    s.start_gap = s.gap
    s.u_r = -s.gap
    s.ss_force = math.nan
    if p.piston != Piston.ABSENT and s.gap == 0.0 and s.v_p == s.v_b:
        s.held = 1
        if not contact_force(p, s, acceleration(p, s)) > 0.0:
            s.held = 0
    s.e_start = kinetic_energy(p, s.v_p, s.v_b)
