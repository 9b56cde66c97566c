"""Linear map of one step in a given configuration, and what it dissipates.

The map is made by the solver's own step, from unit deviations. Its quadratic
forms follow from the same formulas as the ledger of a step
(docs/numerics.md, sections 3, 4 and 5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from percussion_model.physics.kernel import entry_of
from percussion_model.physics.records import BLOW, EVENT, READING, Mode
from percussion_model.solvers.wave.advance import run
from percussion_model.solvers.wave.grid import Grid
from percussion_model.solvers.wave.records import (
    WAVE_STATE,
    Bars,
    Coef,
    Row,
    Scratch,
    Task,
    no_operators,
)

# Unit in which the map counts the penetration while it is made [m].
SCALE = 1e-6
# A barrier that nothing passes, to hold a configuration in standstill [J].
NO_WAY_OUT = 1e300
STEP = int(Task.STEP)


@dataclass(frozen=True)
class Configuration:
    """A bar whose step map is wanted: free, or on a spring and dashpot."""

    par: np.ndarray
    grid: Grid
    c: np.ndarray
    stiffness: float = 0.0
    damping: float = 0.0

    @property
    def size(self) -> int:
        """Numbers in its state."""
        return 2 * self.grid.n + (1 if self.stiffness else 0)


def step_map(configuration: Configuration) -> tuple[np.ndarray, np.ndarray]:
    """What one step makes of each unit deviation.

    Returns
    -------
    by_column : ndarray, shape (size, size)
        Row k is the state after a step from the k-th unit deviation: down-going
        waves, up-going waves [m/s] and, on the rock, the penetration [m].
    faces : ndarray, shape (size, n + 1)
        Row k holds the interface velocities that the step had [m/s].
    """
    n, size = configuration.grid.n, configuration.size
    start = np.zeros(1, WAVE_STATE)
    start["mode"] = Mode.SS if configuration.stiffness else Mode.FF
    start["leap_end"] = -1
    start["live"] = 1
    start["gamma"] = start["next_gamma"] = 1.0
    start["k_r"] = start["next_k_r"] = configuration.stiffness
    start["c_r"] = configuration.damping
    start["next_c_r"] = 1.0  # a barrier stands, so that standstill lasts
    start["w_r"] = start["next_w_r"] = NO_WAY_OUT
    none = np.zeros(1)
    scratch, operators, advance = Scratch(none, none, none), no_operators(), entry_of(run)
    unused = np.zeros(1, BLOW), np.zeros(1, EVENT), np.zeros(1, READING)
    by_column, faces = np.zeros((size, size)), np.zeros((size, n + 1))
    state, w = start.copy(), np.zeros((len(Row), n + 1))
    bars = Bars(np.zeros((len(Row), 1)), np.zeros((len(Coef), 1)), w, configuration.c)
    # As bytes, since NumPy copies records field by field.
    to, origin = state.view(np.uint8), start.view(np.uint8)
    for k in range(size):
        to[:] = origin
        w[:] = 0.0
        if k < n:
            w[Row.DOWN, k] = 1.0
        elif k < 2 * n:
            w[Row.UP, k - n] = 1.0
        else:
            state["p"] = SCALE
        advance(STEP, configuration.par, state, bars, operators, scratch, 0.0, *unused)
        by_column[k, :n], by_column[k, n : 2 * n] = w[Row.DOWN_OTHER, :n], w[Row.UP_OTHER, :n]
        faces[k] = w[Row.FACE]
        if size > 2 * n:
            by_column[k, -1] = state[0]["p"]
    if size > 2 * n:
        by_column[-1] /= SCALE
        faces[-1] /= SCALE
    return by_column, faces


def end_row(configuration: Configuration, by_column: np.ndarray) -> np.ndarray:
    """Velocity of the loaded end at the start of the step, as a row."""
    row: np.ndarray = by_column[:, -1].copy()
    row[-1] -= 1.0
    return row / _reach(configuration)[0]


def _reach(configuration: Configuration) -> tuple[float, float]:
    """Integrals over a step of the loaded end's velocity and of its square.

    For unit velocity at the start, which then fades with the rate K/(z + C).
    """
    par = configuration.par[0]
    if not configuration.stiffness:
        return float(par["dt"]), float(par["dt"])
    z = par["z_b"] * (1.0 + par["kappa_b"])
    rate = configuration.stiffness / (z + configuration.damping)
    fade = -np.expm1(-rate * par["dt"])
    return float(fade / rate), float(0.5 * fade * (2.0 - fade) / rate)


def step_forms(
    configuration: Configuration, by_column: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Quadratic forms of one step, by the formulas of its ledger.

    Parameters
    ----------
    by_column, faces : ndarray
        From `step_map`.

    Returns
    -------
    loss : ndarray, shape (size, size)
        Structural loss [J]. It need not be symmetric.
    squares : ndarray, shape (size, size)
        Square of the lower end's velocity at the start of the step [m2/s2].
    """
    par, c, n = configuration.par[0], configuration.c, configuration.grid.n
    dt, unit = float(par["dt"]), np.eye(configuration.size)
    down, up = unit[:, :n], unit[:, n : 2 * n]
    path, square = _reach(configuration)
    mean = faces[:, n]
    end = mean * (dt / path)
    squares = np.outer(end, end)
    if not par["loss"] or n < 2:
        return np.zeros_like(squares), squares
    before = c[Coef.ALPHA, 1:n] * down[:, :-1] + c[Coef.BETA, 1:n] * up[:, 1:]
    settled = faces.copy()
    if par["loss"] == 1:  # the step kept them as they were before the loss
        force = np.diff(c[Coef.VISCOUS, :n] * np.diff(faces, axis=1), axis=1)
        settled[:, 1:n] = before + c[Coef.INV_Z, 1:n] * force
    inner = settled[:, 1:n]
    loss = _taken_by_smoothing(configuration, by_column, settled)
    loss -= dt * ((inner - before) / c[Coef.INV_Z, 1:n]) @ inner.T
    # what the end cells work against, times their viscous number
    top = faces[:, 0]
    against = (1.0 + par["kappa_t"]) * top - 2.0 * up[:, 0]
    loss += par["z_t"] * dt * np.outer(par["kappa_t"] * top - against, top)
    free = mean
    if configuration.stiffness:
        z = par["z_b"] * (1.0 + par["kappa_b"])
        free = (1.0 + configuration.damping / z) * end
        free = free + configuration.stiffness / z * unit[:, -1]
    against = (1.0 + par["kappa_b"]) * free - 2.0 * down[:, n - 1]
    loss += par["z_b"] * (par["kappa_b"] * square * squares - dt * np.outer(against, mean))
    return loss, squares


def _taken_by_smoothing(
    configuration: Configuration, by_column: np.ndarray, faces: np.ndarray
) -> np.ndarray:
    """Form of the kinetic energy that the loss between cells takes in a step [J].

    Parameters
    ----------
    faces : ndarray, shape (size, n + 1)
        Final interface velocities of the step.
    """
    n = configuration.grid.n
    after = by_column[:, :n] + by_column[:, n : 2 * n]
    unit = np.eye(configuration.size)
    # what the interfaces sent, less what had come in from the other side
    before = faces[:, :-1] + faces[:, 1:] - unit[:, :n] - unit[:, n : 2 * n]
    mass = 0.5 * configuration.grid.mass
    form: np.ndarray = (before * mass) @ before.T - (after * mass) @ after.T
    return form
