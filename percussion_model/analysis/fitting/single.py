"""One number and one unknown: where the model gives the number, by bisection."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from percussion_model.analysis.fitting.likelihood import Likelihood, Place, values_at
from percussion_model.analysis.fitting.measurements import QUANTITIES, Reading
from percussion_model.analysis.fitting.predictions import run_error
from percussion_model.analysis.fitting.sampling import Explored, Profile
from percussion_model.simulation.uncertain import in_digits

# The whole range is looked at in so many places: between two of them a number may be met once.
# Then around what explains it in so many.
PLACES, FINER = 13, 13
# Where it is met, to this in the coordinate; where nothing meets it the nearest is sought by so
# many runs.
EXACT, NEAREST = 1e-4, 12
# A jump of the model over the number is no place that meets it: so many errors are left.
MET = 0.5


class Response:
    """How far the model is above a number, in errors, at coordinates of the unknown.

    Parameters
    ----------
    like : Likelihood
        Of one series, which is one number.
    """

    def __init__(self, like: Likelihood) -> None:
        (self._one,) = like.series
        assert self._one.error is not None
        self._like, self.error = like, self._one.error
        self.met: dict[float, Place] = {}

    def place(self, at: float) -> Place:
        """Compute one place."""
        if at not in self.met:
            self.met[at] = self._like.at(np.array([at]))
        return self.met[at]

    def __call__(self, at: float) -> float:
        """How far it is above at a place."""
        return -float(self.place(at).residuals[0][0]) / self.error

    def crossings(self, level: float) -> list[float]:
        """Where the model crosses a level, between places that are known."""
        from scipy.optimize import brentq

        found = [at for at in self.met if self(at) == level]
        for a, b in pairwise(sorted(self.met)):
            if (self(a) - level) * (self(b) - level) < 0.0:
                found.append(float(brentq(lambda at: self(at) - level, a, b, xtol=EXACT)))
        return sorted(found)

    def roots(self) -> list[float]:
        """Where the model gives the number."""
        return [at for at in self.crossings(0.0) if abs(self(at)) < MET]

    def within(self, limit: float) -> list[float]:
        """Known places that give it within so many errors, both ends of them included."""
        for level in (-limit, limit):
            self.crossings(level)
        return [at for at in self.met if abs(self(at)) <= limit]

    def nearest(self) -> None:
        """Seek the place that comes nearest, beside the best so far."""
        from scipy.optimize import minimize_scalar

        known = sorted(self.met)
        k = min(range(len(known)), key=lambda k: abs(self(known[k])))
        if 0 < k < len(known) - 1:
            minimize_scalar(
                lambda at: abs(self(float(at))), bounds=(known[k - 1], known[k + 1]),
                method="bounded", options={"maxiter": NEAREST},
            )  # fmt: skip


def solved(like: Likelihood, reading: Reading, threshold: float) -> Explored:
    """Find the values of one unknown that give a number, what to know of them, and why none does.

    Parameters
    ----------
    like : Likelihood
        Of this number alone.
    reading : Reading
    threshold : float
        Deviance at the ends of the interval.
    """
    response = Response(like)
    low, high = float(like.low[0]), float(like.high[0])
    for at in np.linspace(low, high, PLACES):
        response(float(at))
    roots = response.roots()
    if not roots:
        response.nearest()
    best = min(response.met.values(), key=lambda one: one.deviance)
    own = run_error(like.scene_at(best.at), reading) if reading.speed is None else math.nan
    if own > 0.0:
        response.error = math.hypot(response.error, own)
    limit = math.sqrt(threshold)
    near = response.within(limit)
    if near:
        # the response may rise and fall within the errors, and beside them
        width = max(max(near) - min(near), EXACT)
        for at in np.linspace(min(near) - width, max(near) + width, FINER):
            response(float(np.clip(at, low, high)))
        response.within(limit)
        roots = response.roots()
        best = min(response.met.values(), key=lambda one: one.deviance)
    at = np.array(sorted(response.met))
    above = np.array([response(one) ** 2 for one in at])
    inside = np.flatnonzero(above <= threshold * (1.0 + EXACT))
    unreached: list[str] = []
    notes = [] if math.isnan(own) else [_run_note(reading, best, own)]
    if not len(inside):
        profile = Profile(-math.inf, math.inf, None, at, above)
        unreached = [_reach(like, reading, response)]
    else:
        parts = np.split(at[inside], np.flatnonzero(np.diff(inside) > 1) + 1)
        gaps = [(float(a[-1]), float(b[0])) for a, b in pairwise(parts)]
        profile = Profile(
            -math.inf if 0 in inside else float(at[inside[0]]),
            math.inf if len(at) - 1 in inside else float(at[inside[-1]]),
            max(gaps, key=lambda gap: gap[1] - gap[0]) if gaps else None,
            at,
            above,
        )
    others = [response.place(one) for one in roots if response.place(one) is not best]
    if others:
        values = ", ".join(in_digits(float(values_at(like.names[0], one))) for one in roots)
        notes.append(f"{reading.name}: {len(roots)} values give it alike: {values}")
    spread = np.array([[_variance(response, float(best.at[0]), high)]])
    minima = [best, *others]
    return Explored(best, spread, [profile], minima, threshold, True, notes, unreached)


def _variance(response: Response, at: float, high: float) -> float:
    """Variance of the unknown by the slope of the response."""
    step = 0.01 if at + 0.01 < high else -0.01
    slope = (response(at + step) - response(at)) / step
    return 1.0 / slope**2 if slope else 1.0


def _run_note(reading: Reading, best: Place, own: float) -> str:
    unit = QUANTITIES[reading.quantity][0]
    found = reading.value - float(best.residuals[0][0])
    return (
        f"{reading.name}: the run gives {in_digits(found)} {unit} with an estimated numerical "
        f"error of {in_digits(own, 2)} {unit}, which is in the interval"
    )


def _reach(like: Likelihood, reading: Reading, response: Response) -> str:
    """Say that the number is out of reach, and what is within it."""
    (name,) = like.names
    seen = [reading.value + response(at) * response.error for at in response.met]
    unit, _, most = QUANTITIES[reading.quantity]
    possible = [one for one in seen if one < most] or seen
    ends = [f"{values_at(name, end):.3g}" for end in (like.low[0], like.high[0])]
    return (
        f"{reading.name} = {reading.value:.4g} {unit} is out of reach: with {name} from {ends[0]} "
        f"to {ends[1]} the scene gives {min(possible):.3g} to {max(possible):.3g} {unit}"
    )
