"""Standstill of the bit as powers of one map, made from the step itself."""

from __future__ import annotations

import numpy as np

from percussion_model.physics.kernel import kernel
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.modal.records import STEP, ModalBar, Move, Reply, Shape, Standstill

# Powers 1, 2, 4, ...: the longest leap is twice the last one.
POWERS = 16


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


def no_standstill(modes: int) -> Standstill:
    """Stand-in where no leaps are made, for a bit of so many modes."""
    maps, row = np.zeros((1, 1, 1)), np.zeros((1, 1))
    return Standstill(maps, maps, maps, np.zeros(1), row, row, np.zeros((2, modes)))


def standstill_of(bar: ModalBar, mass: float, K: float, C: float, dt: float) -> Standstill:
    """Maps of a bit that stands on a spring `K` [N/m] with a dashpot `C` [N s/m].

    The order of numbers is that of `Standstill`; the modes are those of the smallest set.
    """
    last = len(bar.sizes) - 1
    n = int(bar.sizes[last])
    m = 2 * n + 4
    wide = -(-m // WIDTH) * WIDTH
    unit = np.eye(m)
    q, v, (u, speed, r, p) = unit[:n], unit[n : 2 * n], unit[2 * n :]
    reply = bar.reply[last, STEP]
    move = bar.move[STEP, :, :n]
    low, soft = bar.shape[Shape.LOW, :n], bar.shape[Shape.SOFT, :n]
    kept, rest = reply[Reply.LOW_KEPT], reply[Reply.LOW_REST]
    end = u + dt * speed + kept * r
    for k in range(n):
        end = end + low[k] * (move[Move.Q_BY_Q, k] * q[k] + move[Move.Q_BY_V, k] * v[k])
    stiff = 0.5 * K + C / dt
    force = (end - p + K / stiff * p) / (reply[Reply.LOW] + 1.0 / stiff)
    path = (force - K * p) / stiff
    step, loss = np.zeros((m, m)), np.zeros((m, m))
    for k in range(n):
        still = -soft[k] * low[k] * force
        y = q[k] - still
        step[k] = still + move[Move.Q_BY_Q, k] * y + move[Move.Q_BY_V, k] * v[k]
        step[n + k] = move[Move.V_BY_Q, k] * y + move[Move.V_BY_V, k] * v[k]
        cross = np.outer(y, v[k])
        loss += move[Move.LOSS_QQ, k] * np.outer(y, y)
        loss += move[Move.LOSS_QV, k] * 0.5 * (cross + cross.T)
        loss += move[Move.LOSS_VV, k] * np.outer(v[k], v[k])
    step[2 * n] = u + dt * speed - 0.5 * dt * dt / mass * force
    step[2 * n + 1] = speed - dt / mass * force
    step[2 * n + 2] = kept * r - rest * force
    step[2 * n + 3] = p + path
    compliance = bar.beyond[last, 1]
    off = r + compliance * force
    loss += (1.0 - kept * kept) / (2.0 * compliance) * np.outer(off, off)
    powers, forms = np.zeros((POWERS, m, m)), np.zeros((2, POWERS, m, m))
    powers[0], forms[0, 0], forms[1, 0] = step, loss, C / dt * np.outer(path, path)
    _fill_powers(powers, forms, np.zeros((m, m)))
    still = np.zeros(m)
    still[:n] = -soft * low
    still[2 * n + 2] = -compliance
    still[2 * n + 3] = 1.0 / K
    still[2 * n] = 1.0 / K + compliance + float(sum((soft * low * low).tolist()))
    columns, loss, dashpot = np.zeros((3, POWERS, m, wide))
    columns[:, :, :m] = powers.transpose(0, 2, 1)
    loss[:, :, :m], dashpot[:, :, :m] = forms
    room = np.zeros((1, wide)), np.zeros((1, wide)), np.zeros((2, bar.shape.shape[1]))
    return Standstill(columns, loss, dashpot, still, *room)
