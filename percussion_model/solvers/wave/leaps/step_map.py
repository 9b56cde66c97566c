"""Linear map of one step in a given configuration, and what it dissipates.

The map is made by the solver's own step, from unit deviations. Its quadratic
forms follow from the same formulas as the ledger of a step
(docs/numerics.md, sections 3, 4 and 5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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


def step_map(configuration: Configuration) -> np.ndarray:
    """What one step makes of each unit deviation.

    Returns
    -------
    ndarray, shape (size, size)
        Row k is the state after a step from the k-th unit deviation: down-going
        waves, up-going waves [m/s] and, on the rock, the penetration [m].
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
    unused = np.zeros(1, BLOW), np.zeros(1, EVENT), np.zeros(1, READING)
    by_column = np.zeros((size, size))
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
        run(
            int(Task.STEP), configuration.par, state, bars, no_operators(),
            Scratch(none, none, none),
            0.0, *unused,
        )  # fmt: skip
        by_column[k, :n], by_column[k, n : 2 * n] = w[Row.DOWN_OTHER, :n], w[Row.UP_OTHER, :n]
        if size > 2 * n:
            by_column[k, -1] = state[0]["p"]
    if size > 2 * n:
        by_column[-1] /= SCALE
    return by_column


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
    configuration: Configuration, by_column: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Quadratic forms of what one step loses [J].

    Returns
    -------
    loss, dashpot, numerical : ndarray, shape (size, size)
        Structural loss, the rock's dashpot, averaging at the loaded end. They
        need not be symmetric.
    """
    par, c, n = configuration.par[0], configuration.c, configuration.grid.n
    size, dt = configuration.size, float(par["dt"])
    unit = np.eye(size)
    down, up = unit[:, :n], unit[:, n : 2 * n]
    down_after, up_after, cells = _before_smoothing(configuration, by_column)
    top = down_after[:, 0] + up[:, 0]
    mean = up_after[:, n - 1] + down[:, n - 1]
    _path, square = _reach(configuration)
    end = end_row(configuration, by_column) if configuration.stiffness else mean
    squared = square * np.outer(end, end)
    averaged = dt * np.outer(mean, mean)
    numerical = par["z_b"] * (squared - averaged)
    dashpot = configuration.damping * squared
    loss = cells
    if par["loss"] and n > 1:
        face = down_after[:, 1:] + up[:, 1:]
        before = c[Coef.ALPHA, 1:n] * down[:, :-1] + c[Coef.BETA, 1:n] * up[:, 1:]
        loss -= dt * ((face - before) / c[Coef.INV_Z, 1:n]) @ face.T
        # what the end cells work against, times their viscous number
        against = (1.0 + par["kappa_t"]) * top - 2.0 * up[:, 0]
        loss += par["z_t"] * dt * np.outer(par["kappa_t"] * top - against, top)
        free = mean
        if configuration.stiffness:
            z = par["z_b"] * (1.0 + par["kappa_b"])
            free = (1.0 + configuration.damping / z) * end
            free = free + configuration.stiffness / z * unit[:, -1]
        against = (1.0 + par["kappa_b"]) * free - 2.0 * down[:, n - 1]
        loss += par["z_b"] * (par["kappa_b"] * squared - dt * np.outer(against, mean))
    return loss, dashpot, numerical


def _before_smoothing(
    configuration: Configuration, by_column: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Waves before the last part of a step, the loss between cells, and its form.

    Returns
    -------
    down, up : ndarray, shape (size, n)
        Waves of each unit deviation as the interfaces sent them.
    form : ndarray, shape (size, size)
        Kinetic energy that the smoothing takes [J].
    """
    c, n = configuration.c, configuration.grid.n
    down, up = by_column[:, :n], by_column[:, n : 2 * n]
    smoothing = np.eye(n)
    flow = np.zeros((n, n))
    for i in range(n - 1):
        flow[i, i : i + 2] += c[Coef.BETWEEN, i] * np.array([-1.0, 1.0])
        flow[i + 1, i : i + 2] -= c[Coef.BETWEEN, i] * np.array([-1.0, 1.0])
    one_part = np.eye(n) + c[Coef.INV_CELL_Z, :n, np.newaxis] * flow
    for _ in range(int(configuration.par[0]["loss"])):
        smoothing = one_part @ smoothing
    after = down + up
    before = np.linalg.solve(smoothing, after.T).T
    half = 0.5 * (after - before)
    mass = 0.5 * configuration.grid.mass
    form = (before * mass) @ before.T - (after * mass) @ after.T
    return down - half, up - half, form
