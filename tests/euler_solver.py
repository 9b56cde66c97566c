"""Rigid bodies by Euler's method: a solver of few lines, as docs/developers/extend.md adds one."""

import math

import numpy as np

from percussion_model.physics.blows import close_gap, start_blow
from percussion_model.physics.kernel import kernel
from percussion_model.physics.loads import (
    bit_acceleration,
    drive_force,
    piston_acceleration,
    switch_drive,
)
from percussion_model.physics.readings import fill_ledger, fill_motion
from percussion_model.physics.records import Mode, Status
from percussion_model.physics.rock import (
    close_interface,
    damping,
    leave_by_velocity,
    recoverable,
    spring_force,
)
from percussion_model.physics.state import COMMON_PARAMETERS, COMMON_STATE
from percussion_model.scene.numbers import numbers_of
from percussion_model.solvers.base import Solver
from percussion_model.solvers.setup import fill_parameters, fill_start
from percussion_model.solvers.state import State

PAR = np.dtype([("dt", "f8"), *COMMON_PARAMETERS], align=True)
STATE = np.dtype([("time", "f8"), *COMMON_STATE], align=True)


@kernel
def advance(pars, states, t, blows, events):
    par, s = pars[0], states[0]
    s.n_blows = s.n_events = 0
    while s.time + par.dt <= t:
        if s.n_blows == len(blows):
            return Status.BLOWS_FULL
        if s.events_on == 1 and s.n_events + 4 > len(events):
            return Status.EVENTS_FULL
        force = spring_force(par, s) + damping(s) * s.v_b if s.mode != Mode.FF else 0.0
        s.v_b += par.dt * (bit_acceleration(par, s) - force / par.mass_b)
        s.v_p += par.dt * piston_acceleration(par, drive_force(par, s))
        s.i_bit += par.dt * force
        s.p += par.dt * s.v_b
        s.gap += par.dt * (s.v_b - s.v_p)
        u_before, s.u_r = s.u_r, -s.gap
        s.time += par.dt
        s.count_steps += 1
        if s.gap <= 0.0 and s.v_p > s.v_b:
            if s.armed == 1:
                start_blow(par, s, blows, s.time, s.v_p, s.x_r + s.p, math.nan)
            impulse = 1.87 * (s.v_p - s.v_b) * par.mass_p * par.mass_b / (par.mass_p + par.mass_b)
            s.v_p -= impulse / par.mass_p
            s.v_b += impulse / par.mass_b
            close_gap(s, events, s.time, -s.u_r)
        switch_drive(par, s, u_before, s.time, par.dt, events)
        if s.mode == Mode.FF and s.p >= s.p_u and s.v_b > 0.0:
            close_interface(par, s, 0.5 * par.mass_b * s.v_b * s.v_b)
        elif s.mode == Mode.BC and s.p < s.p_u:
            s.mode = Mode.FF
        elif s.mode == Mode.DFC:
            s.mode = Mode.FC
        elif s.mode == Mode.SS and s.v_b * s.v_b * par.mass_b > 2.0 * s.w_r:
            s.mode = Mode.BC
        elif s.mode != Mode.FF:
            leave_by_velocity(par, s, s.v_b, 0.5 * par.mass_b * s.v_b * s.v_b)
    return Status.DONE


class EulerSolver(Solver):
    """Steps of 2 us."""

    name = "euler"
    time_step = 2e-6
    COUNTS = ("steps", "events", "blows")

    def new_state(self):
        """State at time zero."""
        self._par = np.zeros(1, PAR)
        numbers = numbers_of(self.scene)
        fill_parameters(self._par[0], numbers, with_piston=True)
        self._par["dt"] = self.time_step
        state = State(STATE)
        fill_start(state.record[0], numbers)
        return state

    def time(self, state):
        """Time of the last step."""
        return float(state.record["time"][0])

    def advance(self, state, t, blows, events, record_events):
        """Whole steps up to `t`."""
        s = state.record[0]
        s["events_on"] = record_events
        status = advance(self._par, state.record, t, blows, events)
        return status, int(s["n_blows"]), int(s["n_events"])

    def read(self, state, t, reading, spare=None, peaks=True):
        """The state as it is after its last step."""
        s, row = state.record[0], reading[0]
        fill_ledger(
            s, row, 0.5 * self.scene.bit.mass * s["v_b"] ** 2, 0.0, recoverable(self._par[0], s)
        )
        fill_motion(self._par[0], s, row, t, s["x_r"] + s["p"] - s["gap"], s["x_r"] + s["p"])
        return state
