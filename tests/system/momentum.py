"""Momentum of a drilling system, as the tests of its runs balance it."""

from __future__ import annotations

PISTON, BIT = 7.555, 8.689  # of the reference hammer [kg]
GRAVITY = 10.0  # [m/s^2]


def missing_momentum(run, piston_velocity):
    """What rig and weights have brought, less what the rock took and what moves [N s].

    Parameters
    ----------
    run : CoupledRun
    piston_velocity : float
        At the start [m/s].

    Returns
    -------
    ndarray, shape (rows,)
    """
    pushed = run["string.head_impulse"] + GRAVITY * (PISTON + BIT) * run["time"]
    pushed += run["string.weight"] * run["time"] - run["string.wall_momentum"]
    moving = run["string.momentum"] + BIT * run["hammer.bit.velocity"]
    moving += PISTON * (run["hammer.piston.velocity"] - piston_velocity)
    return pushed - run["hammer.bit.impulse"] - moving
