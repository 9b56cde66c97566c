"""What a rig measures, from the settled response in a table and the equations of breaking.

Of a blow the table has what its motion gives: the energy W that it crushes, its frequency f, the
work A = F D of the mean force F on the rock over the depth D pressed in, F, and r F_0. The rest
follows from equations 20g to 20i of docs/model.md, of a bit whose old craters are crushed again:

    h = min((W - max(W exp(-s/lambda), N W_0)) / (q S), D),   s = r omega / f,
    rate = h f,   T = (1 - exp(-s / (n + 1) lambda)) (A - F h) f / omega + mu r F_0,

with q = e_c / eta, the crushing energy by the efficiency of the bit, and S the hole's area. So a
rate tells q alone; the motion does not know of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

# Unknowns of the rock and the bit, by their logarithms.
UNKNOWNS = (
    "apparent_energy", "unloading_ratio", "loading_stiffness", "renewal_length", "threshold",
    "friction",
)  # fmt: skip
Q, GAMMA, STIFFNESS, RENEWAL, THRESHOLD, FRICTION = range(len(UNKNOWNS))
# Settings of the rig [Pa, N, rad/s], and what it measures [m/s, Hz, N m].
SETTINGS = ("pressure", "feed", "speed")
SIGNALS = ("rate", "frequency", "torque")
RATE, FREQUENCY, TORQUE = range(len(SIGNALS))
# Rows of the table.
CRUSHED, BLOWS, WORK, FORCE, RUBBING = range(5)
# Where nothing breaks, the energy beyond the threshold counts as this share of the blow's.
LEAST = 1e-3
# Polynomials are not asked further out than this, by half the range of the table.
EDGE = 1.1
SLOPE = 0.01  # steps of slopes, by the same


# Terms of pressure and feed by which surfaces over ratio and stiffness go into one another.
BETWEEN = np.array([[0, 0], [1, 0], [0, 1], [1, 1], [2, 0], [0, 2]])


@dataclass(frozen=True)
class Table:
    """Logarithms of a blow's numbers: polynomials, or surfaces of splines at a few settings.

    Attributes
    ----------
    middle, half : ndarray, shape (4,)
        Of the logarithms of pressure [Pa], feed [N], unloading ratio and stiffness [N/m] in it.
    powers : ndarray of int, shape (terms, 4) or (terms, 2)
        Of the scaled logarithms in each term; of the last two where there are surfaces.
    terms : ndarray, shape (5, terms) or (settings * 5, terms)
        Coefficients of ln W, ln f, ln A, ln F and ln r F_0.
    errors : ndarray, shape (3,)
        Of the logarithms of rate, frequency and torque, by points left out of the fit.
    area, radius : float
        Of the hole [m^2]; mean radius of the buttons [m].
    buttons, exponent : float
        Of the bit; of the loading.
    stretch : ndarray, shape (2,)
        By which the scaled logarithms of ratio and stiffness are multiplied for distances: where
        blows meet the waves of earlier ones, they change fast along one of them.
    nodes : ndarray, shape (n, 2)
        Points of the splines, stretched; none for polynomials alone.
    weights : ndarray, shape (settings * 5, n)
        Of thin-plate splines about them.
    """

    middle: np.ndarray
    half: np.ndarray
    powers: np.ndarray
    terms: np.ndarray
    errors: np.ndarray
    area: float
    radius: float
    buttons: float
    exponent: float
    stretch: np.ndarray = field(default_factory=lambda: np.ones(2))
    nodes: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    weights: np.ndarray = field(default_factory=lambda: np.empty((5, 0)))

    def contains(self, settings: np.ndarray) -> np.ndarray:
        """Whether pressure and feed of settings, shape (n, 3), are in the table."""
        off = np.abs((np.log(settings[:, :2]) - self.middle[:2]) / self.half[:2])
        return np.all(off <= 1.0 + 1e-9, axis=1)

    def rows(self, points: np.ndarray) -> np.ndarray:
        """Logarithms of a blow's numbers.

        Parameters
        ----------
        points : ndarray, shape (n, 4)
            Logarithms of pressure, feed, unloading ratio and stiffness.

        Returns
        -------
        ndarray, shape (5, n)
        """
        inside = np.clip((points - self.middle) / self.half, -EDGE, EDGE)
        if not len(self.nodes):
            return np.asarray(self.terms @ basis(inside, self.powers).T)
        rock = inside[:, 2:]
        surfaces = basis(rock, self.powers) @ self.terms.T
        surfaces += splines(rock * self.stretch, self.nodes) @ self.weights.T
        surfaces = surfaces.reshape(len(points), len(BETWEEN), -1)
        return np.einsum("ns,nsr->rn", shares(inside[:, :2]), surfaces)

    def predict(self, unknowns: np.ndarray, settings: np.ndarray) -> np.ndarray:
        """Logarithms of what a rig measures.

        Parameters
        ----------
        unknowns : ndarray, shape (n, 6)
            By `UNKNOWNS`, logarithms of SI values.
        settings : ndarray, shape (3,) or (n, 3)
            By `SETTINGS`, SI.

        Returns
        -------
        ndarray, shape (n, 3)
            By `SIGNALS`, of SI values.
        """
        settings = np.broadcast_to(settings, (len(unknowns), 3))
        points = np.empty((len(unknowns), 4))
        points[:, :2] = np.log(settings[:, :2])
        points[:, 2], points[:, 3] = unknowns[:, GAMMA], unknowns[:, STIFFNESS]
        rows = self.rows(points).T
        return self.signals(rows, unknowns, settings[:, 2])

    def about(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of points, shape (n, 5), and their slopes there, shape (n, 4, 5)."""
        steps = SLOPE * np.diag(self.half)
        many = np.concatenate([points, *(points + s for s in steps), *(points - s for s in steps)])
        rows = self.rows(many).T.reshape(2 * len(steps) + 1, len(points), -1)
        up, down = rows[1 : len(steps) + 1], rows[len(steps) + 1 :]
        slopes = (up - down) / (2.0 * SLOPE * self.half[:, np.newaxis, np.newaxis])
        return rows[0], slopes.transpose(1, 0, 2)

    def signals(
        self, rows: np.ndarray, unknowns: np.ndarray, speed: float | np.ndarray
    ) -> np.ndarray:
        """Logarithms of what a rig measures, shape (..., 3), by those of a blow's numbers."""
        crushed, blows, work, force, rubbing = np.moveaxis(np.exp(rows), -1, 0)
        q, _, _, renewal, threshold, friction = np.moveaxis(unknowns, -1, 0)
        turns = self.radius * speed / (blows * np.exp(renewal))
        known = np.maximum(crushed * np.exp(-turns), self.buttons * np.exp(threshold))
        beyond = np.maximum(crushed - known, LEAST * crushed)
        gained = np.minimum(beyond * np.exp(-q) / self.area, work / force)
        fresh = 1.0 - np.exp(-turns / (self.exponent + 1.0))
        climbing = fresh * np.maximum(work - force * gained, 0.0) * blows / speed
        torque = climbing + rubbing * np.exp(friction)
        return np.stack([np.log(gained * blows), rows[..., BLOWS], np.log(torque)], axis=-1)


# Settings of the surfaces, scaled.
AT = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [0.0, 0.0], [0.0, 1.0]])


def shares(x: np.ndarray) -> np.ndarray:
    """Share of each surface at scaled settings, shape (n, settings)."""
    return np.asarray(np.linalg.solve(basis(AT, BETWEEN).T, basis(x, BETWEEN).T).T)


def splines(x: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Thin-plate splines r^2 ln r about nodes, shape (n, nodes)."""
    square = (
        np.sum(x * x, axis=1)[:, np.newaxis] + np.sum(nodes * nodes, axis=1) - 2.0 * x @ nodes.T
    )
    square = np.maximum(square, 1e-12)
    return 0.5 * square * np.log(square)


def basis(x: np.ndarray, powers: np.ndarray) -> np.ndarray:
    """Terms of polynomials at points, shape (n, terms)."""
    found = np.ones((len(x), len(powers)))
    for k in range(x.shape[1]):
        column = np.stack([x[:, k] ** p for p in range(int(powers[:, k].max()) + 1)], axis=1)
        found *= column[:, powers[:, k]]
    return found
