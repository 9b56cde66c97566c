"""Rods as travelling waves that are polynomials within each cell, open at the low end."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from fmu_src.parts.string_body import Rods

# Polynomials that make up a wave within a cell or a communication step.
DEGREES = 8
# Places and weights from -1 to 1 at which products of two of them are summed up exactly.
PLACES, WEIGHTS = legendre.leggauss(DEGREES)
# From values at these places to shares of the polynomials.
SHARES = (legendre.legvander(PLACES, DEGREES - 1) * WEIGHTS[:, None]).T
SHARES *= np.arange(0.5, DEGREES)[:, None]
# The polynomials by powers: quicker than NumPy's own, which go by recurrence.
_POWERS = np.zeros((DEGREES, DEGREES))
for _k in range(DEGREES):
    _POWERS[: _k + 1, _k] = legendre.leg2poly(np.eye(DEGREES)[_k, : _k + 1])
# Mean squares of the polynomials, and their signs when they are read from the other end.
SQUARES = 1.0 / np.arange(1.0, 2.0 * DEGREES, 2.0)
MIRROR = (-1.0) ** np.arange(DEGREES)
# Places of the integrals that move the head.
FINE, FINE_WEIGHTS = legendre.leggauss(24)


def _values(at: np.ndarray) -> np.ndarray:
    """Values of the polynomials at places, one place a row."""
    return np.vander(at, DEGREES, increasing=True) @ _POWERS


class Packet(NamedTuple):
    """A wave over a time: shares of Legendre polynomials [m/s] from its begin to its end [s]."""

    begin: float
    span: float
    shares: np.ndarray

    @property
    def square(self) -> float:
        """Integral of its square [m2/s]."""
        return self.span * _square(self.shares)


def projected(packets: Iterable[Packet], begin: float, span: float) -> Packet:
    """The wave of successive packets over another time: what polynomials have of it.

    A projection never has more energy than what it is of (Bessel).
    """
    shares = np.zeros(DEGREES)
    for one in packets:
        low = max(begin, one.begin)
        long = min(begin + span, one.begin + one.span) - low
        if long <= 0.0:
            continue
        t = low + 0.5 * long * (PLACES + 1.0)
        values = _values(2.0 * (t - one.begin) / one.span - 1.0) @ one.shares
        shares += (long / span) * (values * WEIGHTS) @ _values(2.0 * (t - begin) / span - 1.0)
    return Packet(begin, span, shares * np.arange(0.5, DEGREES))


class Packets(Rods):
    """Waves in cells; in the transit time of a cell each moves by one, exactly.

    The wave of a cell is a sum of Legendre polynomials of the time from -1 to 1 in which it
    leaves the cell. With v = d + u and the compression F = Z (d - u), d goes down and u up. The
    head is a mass at the upper end, moved in closed form: M v' = F + M g - Z (v - 2 u). What
    leaves the lowest cell, and what comes into it, is for others to take and to give.

    Attributes
    ----------
    down, up : ndarray, shape (cells, DEGREES)
        Waves, the first cell below the head [m/s].
    step : float
        Transit time of a cell [s].
    port_work : float
        Energy that has left at the low end [J].
    """

    STATE = (*Rods.STATE, "waves", "port_work")

    def __init__(self, parameters: dict[str, Any], count: int) -> None:
        super().__init__(parameters, count)
        self.divide(int(parameters["rod.cells"]))
        self.down, self.up = np.zeros((2, count * self.cells_of_rod, DEGREES))
        # what weight adds to a wave that leaves within a transit time, until then and after
        gain = 0.25 * self.gravity * self.step
        self._until = np.array([gain, gain, *[0.0] * (DEGREES - 2)])
        self._after = self._until * MIRROR
        self._fall = self.impedance * self.step / self.head_mass
        self._head_by_wave, self._head_by_force, self._head_keeps = self._head_response()
        self.port_work = 0.0

    def _head_response(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Velocity of the head at the places and at the end of a transit time.

        M v' + Z v = 2 Z u + F, by the polynomials of u, by F [N], and by the velocity before.
        """
        times = np.append(0.5 * (PLACES + 1.0), 1.0)[:, None]
        before = 0.5 * times * (FINE + 1.0)
        kernel = 0.5 * times * FINE_WEIGHTS * np.exp(-self._fall * (times - before))
        waves = legendre.legvander(2.0 * before - 1.0, DEGREES - 1)
        by_wave = 2.0 * self._fall * np.einsum("ij,ijk->ik", kernel, waves)
        by_force = kernel.sum(axis=1) * self.step / self.head_mass
        return by_wave, by_force, np.exp(-self._fall * times[:, 0])

    @property
    def waves(self) -> np.ndarray:
        """All waves in a row, those that go down first."""
        return np.concatenate([self.down.ravel(), self.up.ravel()])

    @waves.setter
    def waves(self, values: Any) -> None:
        self.down, self.up = np.reshape(values, (2, -1, DEGREES)).astype(float)

    def lengths(self, count: int) -> dict[str, int]:
        """Lengths of the lists in a state of so many rods."""
        return {"waves": 2 * count * self.cells_of_rod * DEGREES}

    @property
    def cells(self) -> int:
        """Number of cells."""
        return len(self.down)

    def rest(self, bottom_force: float) -> None:
        """Stand still, with this compression at the low end [N]."""
        above = np.arange(self.cells - 1, -1, -1) + 0.5
        force = bottom_force - self.cell_mass * self.gravity * above
        self.down[:], self.up[:] = 0.0, 0.0
        self.down[:, 0] = force / (2.0 * self.impedance)
        self.up[:, 0] = -self.down[:, 0]
        self.down[:, 1] = self.up[:, 1] = -self._until[1]

    def leaving(self, ahead: int) -> np.ndarray:
        """What leaves the low end in a transit time to come, the next one with 0 [m/s].

        True as far as friction does not take part of it on the way.
        """
        found = self.down[-1 - ahead] + self._until
        found[0] += 2.0 * ahead * self._until[0]
        return found

    def advance(self, head_force: float, coming: np.ndarray, free: int) -> None:
        """Go on by a transit time.

        Parameters
        ----------
        head_force : float
            On the head, without weight [N].
        coming : ndarray, shape (DEGREES,)
            Wave that comes in at the low end [m/s].
        free : int
            Lowest cells in which the wall takes nothing; those above take their part as well.
        """
        leaving, rising = self.leaving(0), self.up[0] + self._until
        weight, stored = self.head_mass * self.head_gravity, self._squares
        found = self._head_by_wave @ rising + self._head_by_force * (head_force + weight)
        found += self._head_keeps * self.head_velocity
        self.head_velocity, head = float(found[-1]), SHARES @ found[:-1]
        returned = head - rising
        self.down = np.vstack([returned + self._after, self.down[:-1]])
        self.up = np.vstack([self.up[1:], coming + self._after])
        self.down[1:, 0] += 2.0 * self._until[0]
        self.up[:-1, 0] += 2.0 * self._until[0]
        self.head += self.step * head[0]
        # by weight is what waves have gained beyond what has come and gone at the ends
        came, went = _square(coming) - _square(leaving), _square(rising) - _square(returned)
        self.port_work -= self.cell_mass * came
        self.weight_work += self.cell_mass * (self._squares - stored - came + went)
        self.weight_work += weight * self.step * head[0]
        self._rub(free)

    def _rub(self, free: int) -> None:
        """Wall friction on the cells above the lowest, which takes from both waves alike."""
        rubbed = self.cells - free
        if rubbed < 1 or not (self.viscous > 0.0 or self.sticking > 0.0):
            return
        down, up = self.down[:rubbed], self.up[:rubbed]
        before = up + MIRROR * down
        more = self.cells / rubbed * self.cell / self.cell_mass * self.step
        after = before / (1.0 + self.viscous * more)
        mean = np.sign(after[:, 0]) * np.maximum(np.abs(after[:, 0]) - self.sticking * more, 0.0)
        after[:, 0] = mean
        change = 0.5 * (after - before)
        up += change
        down += MIRROR * change
        self.friction_loss += 0.5 * self.cell_mass * (_square(before) - _square(after))
        self.lost_momentum += self.cell_mass * float((before - after)[:, 0].sum())

    def add_rod(self) -> None:
        """Put a rod below the head, in the state of the place where it joins."""
        self.count += 1
        above = np.arange(self.cells_of_rod, 0, -1)[:, None] * 2.0 * self._until[0]
        shape = np.array([0.0, -self._until[1], *[0.0] * (DEGREES - 2)])
        mean = np.eye(1, DEGREES)
        self.down = np.vstack([(self.down[0, 0] - above) * mean + shape, self.down])
        self.up = np.vstack([(self.up[0, 0] + above) * mean + shape, self.up])

    @property
    def _squares(self) -> float:
        return _square(self.down) + _square(self.up)

    @property
    def stored(self) -> float:
        """Kinetic and elastic energy of head and rods [J]."""
        return self.cell_mass * self._squares + 0.5 * self.head_mass * self.head_velocity**2

    @property
    def momentum(self) -> float:
        """Of head and rods [N s]."""
        waves = float(self.down[:, 0].sum() + self.up[:, 0].sum())
        return self.cell_mass * waves + self.head_mass * self.head_velocity


def _square(waves: np.ndarray) -> float:
    """Sum of the mean squares of waves [m2/s2]."""
    return float((waves**2 @ SQUARES).sum())
