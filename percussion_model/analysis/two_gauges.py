"""Force and motion at the end of a bar, from two strain gauges on it.

In a uniform bar F = Z (d - u) and v = d + u, where d moves down and u up, unchanged
(docs/model.md, eqs 5-6). Two gauges, a transit time T apart, tell both waves as long as nothing
moved before: d1(t) = F1(t)/Z + u2(t - T), u2(t) = d1(t - T) - F2(t)/Z. So incident and reflected
waves may overlap at the gauges. (B. Lundberg, A. Henchoz, Experimental Mechanics 17 (1977) 213.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from percussion_model.scene.rows import SceneError


class AtEnd(NamedTuple):
    """What a bar does at its lower end."""

    time: np.ndarray  # [s]
    force: np.ndarray  # compression positive [N]
    velocity: np.ndarray  # down positive [m/s]
    displacement: np.ndarray  # down positive [m]
    incident: float  # energy that came down to the end [J]
    reflected: float  # energy that went back up [J]


def at_end(
    time: np.ndarray, upper: np.ndarray, lower: np.ndarray, impedance: float, apart: float,
    below: float,
) -> AtEnd:  # fmt: skip
    """Make out the lower end of a bar at rest from two force histories.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Evenly rising from the instant before anything moves [s].
    upper, lower : ndarray, shape (n,)
        Forces at the gauges, compression positive [N].
    impedance : float
        A sqrt(E rho) [N s/m].
    apart, below : float
        Transit times from gauge to gauge, and from the lower one to the end [s].

    Returns
    -------
    AtEnd
        As long as it can be told: it ends `below` before the histories do.

    Raises
    ------
    SceneError
        If the gauges are in one place, or nearer to each other than two samples.
    """
    step = float(time[1] - time[0])
    if not apart >= step:
        raise SceneError(
            f"gauges a transit time of {apart:.3g} s apart: must be {step:.3g} s at least, the "
            "time between two samples"
        )
    down, up = np.zeros(len(time)), np.zeros(len(time))

    def before(wave: np.ndarray, k: int) -> float:
        """A wave a transit time before sample k; both are known so far."""
        place = k - apart / step
        first = int(np.floor(place))
        if first < 0:
            return 0.0
        share = place - first
        return float((1.0 - share) * wave[first] + share * wave[min(first + 1, k - 1)])

    for k in range(len(time)):
        down[k] = upper[k] / impedance + before(up, k)
        up[k] = before(down, k) - lower[k] / impedance
    # d at the upper gauge and u at the lower one, at the end at one time
    seen = time[time <= time[-1] - below]
    came = np.interp(seen - apart - below, time, down, left=0.0)
    back = np.interp(seen + below, time, up)
    velocity = came + back
    path = np.concatenate([[0.0], np.cumsum(0.5 * step * (velocity[1:] + velocity[:-1]))])
    energies = (impedance * step * float(np.sum(wave**2)) for wave in (came, back))
    return AtEnd(seen, impedance * (came - back), velocity, path, *energies)
