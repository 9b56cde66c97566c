"""Standstill of the bit as powers of one map, made from the step itself."""

from __future__ import annotations

import numpy as np

from percussion_model.physics.kernel import kernel
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.modal.records import STEP, Forms, Move, Shape, Standstill

# Powers 1, 2, 4, ...: the longest leap is twice the last one.
POWERS = 16
# A standstill is leapt over once no more modes than these are left.
FEW = WIDTH


@kernel
def _multiply(a, b, out):
    n = a.shape[0]
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += a[i, k] * b[k, j]
            out[i, j] = total


@kernel
def _fill_powers(powers, forms, room):
    """Fill powers, and forms summed over so many steps, from the first of each."""
    n = powers.shape[1]
    for p in range(1, powers.shape[0]):
        before = powers[p - 1]
        _multiply(before, before, powers[p])
        for f in range(forms.shape[0]):
            _multiply(forms[f, p - 1], before, room)
            for i in range(n):
                for j in range(n):
                    total = forms[f, p - 1, i, j]
                    for k in range(n):
                        total += before[k, i] * room[k, j]
                    forms[f, p, i, j] = total


def no_standstill() -> Standstill:
    """Stand-in where no leaps are made."""
    maps, row = np.zeros((1, 2 * FEW, 2 * FEW)), np.zeros((1, 2 * FEW))
    return Standstill(maps, maps, maps, row, row)


def standstill_of(forms: Forms, C: float, eta: float, dt: float) -> Standstill:
    """Maps of a bit that stands on gamma K_R, with a dashpot `C` [N s/m].

    The first numbers are offsets of modes about rest, the others their velocities.
    """
    m = 2 * FEW
    unit = np.eye(m)
    y, v = unit[:FEW], unit[FEW:]
    move, low, soft = forms.move[2, STEP], forms.shape[2, Shape.LOW], forms.shape[2, Shape.SOFT]
    held = float(forms.stiff[2])
    free, yields = np.zeros(m), 0.0
    for k in range(FEW):
        free = free + low[k] * (move[Move.Q_BY_Q, k] * y[k] + move[Move.Q_BY_V, k] * v[k] - y[k])
        yields += float(low[k] * low[k] * move[Move.YIELD, k])
    slope = (C - eta * held) / dt
    force = slope / (1.0 + slope * yields) * free
    path = free - yields * force
    step, loss = np.zeros((2, m, m))
    for k in range(FEW):
        push = low[k] * force
        step[k] = move[Move.Q_BY_Q, k] * y[k] + move[Move.Q_BY_V, k] * v[k]
        step[k] -= move[Move.YIELD, k] * push
        step[FEW + k] = move[Move.V_BY_Q, k] * y[k] + move[Move.V_BY_V, k] * v[k]
        step[FEW + k] -= move[Move.Q_BY_V, k] * push
        off = y[k] + soft[k] * push
        cross = np.outer(off, v[k])
        loss += move[Move.LOSS_QQ, k] * np.outer(off, off)
        loss += move[Move.LOSS_QV, k] * 0.5 * (cross + cross.T)
        loss += move[Move.LOSS_VV, k] * np.outer(v[k], v[k])
    square = np.outer(path, path) / dt
    powers, sums = np.zeros((POWERS, m, m)), np.zeros((2, POWERS, m, m))
    powers[0], sums[0, 0], sums[1, 0] = step, loss - eta * held * square, C * square
    _fill_powers(powers, sums, np.zeros((m, m)))
    columns = np.ascontiguousarray(powers.transpose(0, 2, 1))
    return Standstill(columns, sums[0], sums[1], np.zeros((1, m)), np.zeros((1, m)))
