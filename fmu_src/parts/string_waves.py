"""Body of a drill string as travelling waves on a characteristic grid.

In a step each wave moves by one cell, exactly. With v = d + u and the compression F = Z (d - u) in
each cell, d goes down and u up. An end mass is advanced in closed form under the wave that meets
it: M v' = F + M g - Z (v - 2 u). What moves is d of all cells, the first below the head, and u.
"""

from __future__ import annotations

from typing import NamedTuple

from fmu_src.parts.string_body import (
    cell_mass_of,
    gravity_of,
    impedance_of,
    rubbed,
    step_of,
)
from percussion_model.physics.elementary import exp, expm1
from percussion_model.physics.kernel import kernel


class Grid(NamedTuple):
    """Numbers that follow from parameters.

    Attributes
    ----------
    step : float
        Transit time of a cell [s].
    change : float
        Half of what weight adds to a wave in it [m/s].
    head_mean, head_keeps, casing_mean, casing_keeps : float
        Shares of an end's velocity that count in the mean of a step, and at its end.
    up : int
        Where waves that go up begin in what moves.
    """

    step: float
    impedance: float
    cell_mass: float
    change: float
    head_mean: float
    head_keeps: float
    casing_mean: float
    casing_keeps: float
    up: int


@kernel
def grid_of(p):
    """The grid of a string."""
    step, impedance = step_of(p), impedance_of(p)
    x, y = impedance * step / p.head_mass, impedance * step / p.casing_mass
    return Grid(
        step, impedance, cell_mass_of(p), 0.25 * gravity_of(p) * step,
        -expm1(-x) / x, exp(-x), -expm1(-y) / y, exp(-y), p.rod_most * p.rod_cells,
    )  # fmt: skip


@kernel
def rest_waves(p, s, w, bottom_force):
    """Stand still, with this compression at the casing's upper side [N]."""
    grid, cells, weight = grid_of(p), s.count * p.rod_cells, cell_mass_of(p) * gravity_of(p)
    for k in range(cells):
        force = bottom_force - weight * (cells - 1 - k)
        # a cell keeps the force of its middle
        w.moving[k] = force / (2.0 * grid.impedance) - grid.change
        w.moving[grid.up + k] = -w.moving[k]
    s.total = 0.0


@kernel
def advance_waves(p, s, w, grid, head_force, casing_force):
    """Go on by a transit time under forces on head and casing, without weights [N]."""
    cells, x, up, change = s.count * p.rod_cells, w.moving, grid.up, grid.change
    head_weight, casing_weight = p.head_mass * p.gravity, p.casing_mass * gravity_of(p)
    # half of the weight's effect on a wave comes before it meets an end, half after
    rising, falling = x[up] + change, x[cells - 1] + change
    # an end tends to the velocity at which force and wave are in balance
    settled = (head_force + head_weight) / grid.impedance + 2.0 * rising
    off = s.head_velocity - settled
    s.head_velocity, top = settled + off * grid.head_keeps, settled + off * grid.head_mean
    settled = (casing_force + casing_weight) / grid.impedance + 2.0 * falling
    off = s.casing_velocity - settled
    s.casing_velocity = settled + off * grid.casing_keeps
    bottom = settled + off * grid.casing_mean
    for k in range(cells - 1, 0, -1):
        x[k] = x[k - 1] + 2.0 * change
    for k in range(cells - 1):
        x[up + k] = x[up + k + 1] + 2.0 * change
    x[0], x[up + cells - 1] = top - rising + change, bottom - falling + change
    after = s.total + top + bottom - 2.0 * (falling + rising) + 4.0 * cells * change
    s.head += top * grid.step
    s.casing += bottom * grid.step
    s.weight_work += grid.step * (head_weight * top + casing_weight * bottom)
    # by twice the sum of the waves in the middle of this time
    s.weight_work += 2.0 * grid.cell_mass * change * (s.total + after)
    s.total = after


@kernel
def rub_waves(p, s, w, grid, count):
    """Wall friction of so many transit times: both waves of a cell lose the same."""
    if not (p.friction_force > 0.0 or p.friction_viscosity > 0.0):
        return
    cells, x, up, length = s.count * p.rod_cells, w.moving, grid.up, p.rod_length / p.rod_cells
    if p.friction_force > 0.0:
        s.total = 0.0
        for k in range(cells):
            before = x[k] + x[up + k]
            after = rubbed(p, s, before, grid.cell_mass, length, count * grid.step)
            x[k] += 0.5 * (after - before)
            x[up + k] += 0.5 * (after - before)
            s.total += after
        return
    # viscous friction alone: each velocity loses the same share
    of_one = 1.0 / (1.0 + p.friction_viscosity * length / grid.cell_mass * grid.step)
    left, squares = 1.0, 0.0
    for _ in range(count):
        left *= of_one
    for k in range(cells):
        v = x[k] + x[up + k]
        squares += v * v
        x[k] += 0.5 * (left - 1.0) * v
        x[up + k] += 0.5 * (left - 1.0) * v
    s.friction_loss += 0.5 * grid.cell_mass * (1.0 - left * left) * squares
    s.lost_momentum += grid.cell_mass * (1.0 - left) * s.total
    s.total *= left


@kernel
def add_to_waves(p, s, w):
    """Put a rod below the head, in the state of the place where it joins."""
    x, new, up = w.moving, p.rod_cells, grid_of(p).up
    change = 0.5 * gravity_of(p) * step_of(p)
    for k in range(s.count * new - 1, -1, -1):
        x[new + k], x[up + new + k] = x[k], x[up + k]
    s.count += 1
    for k in range(new):
        x[k], x[up + k] = x[new] - change * (new - k), x[up + new] + change * (new - k)
        s.total += x[k] + x[up + k]


@kernel
def stored_in_waves(p, s, w):
    """Kinetic and elastic energy [J]."""
    up, total = p.rod_most * p.rod_cells, 0.0
    for k in range(s.count * p.rod_cells):
        total += w.moving[k] * w.moving[k] + w.moving[up + k] * w.moving[up + k]
    ends = p.head_mass * (s.head_velocity * s.head_velocity)
    ends += p.casing_mass * (s.casing_velocity * s.casing_velocity)
    return cell_mass_of(p) * total + 0.5 * ends


@kernel
def momentum_of_waves(p, s):
    """Of head, rods and casing [N s]."""
    ends = p.head_mass * s.head_velocity + p.casing_mass * s.casing_velocity
    return cell_mass_of(p) * s.total + ends
