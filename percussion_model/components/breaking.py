"""Advance of the hole by the volume that is broken, not by what the buttons press in.

A blow that crushes the energy W breaks

    V = eta max(W - max(W_1, N W_0), 0) / e_c

beyond the craters of the energy W_1 that are there already; so the hole gains V by its area, and
no more than what is pressed in (docs/model.md, eq. 20g). Of a further loading of one place counts
what it crushes after reloading the rock.
"""

from __future__ import annotations

from percussion_model.components import Component
from percussion_model.physics.elementary import exp, log
from percussion_model.physics.kernel import LEAST_DIVISOR, inlined

# Tried on single craters of Kuru granite and St Anne limestone, and on the bottom of a hole
# drilled by a bit of 17 buttons (docs/breaking.md).
CRUSHING_ENERGY, THRESHOLD, EFFICIENCY = 5.5e7, 5.0, 0.64
# Less than this by volume counts as none: a volume by it might overflow [J/m^3].
LEAST_ENERGY = 1.0


@inlined
def sharpness(par, s):
    """Efficiency of the buttons after what they have drilled."""
    if par.breaking_wear_length == 0.0:
        return par.breaking_efficiency
    drilled = par.breaking_drilled + s.breaking_volume / par.hole_area
    fresh = exp(-drilled / max(par.breaking_wear_length, LEAST_DIVISOR))
    return par.breaking_efficiency * (par.breaking_worn + (1.0 - par.breaking_worn) * fresh)


@inlined
def flushed(par, volume):
    """Volume of a blow that the hole gains where flushing limits it [m^3]."""
    if par.breaking_flushed_volume == 0.0:
        return volume
    return volume / (1.0 + volume / max(par.breaking_flushed_volume, LEAST_DIVISOR))


@inlined
def crushed_here(par, s):
    """Energy that the present loading adds to what this blow has crushed [J].

    It reloads the rock first, elastically: of what a loading of fresh rock crushes as far, the
    share 1/gamma of the energy crushed before.
    """
    crushed = s.crushed - s.crushed_before
    if par.left == 1:  # its line reloads the rock
        return crushed
    return max(crushed - max(s.breaking_crushed - s.cycle_from, 0.0) / s.gamma, 0.0)


@inlined
def broken(par, s):
    """Volume that the present loading breaks [m^3]."""
    known = max(par.breaking_buttons * par.breaking_threshold, s.breaking_taken)
    beyond = max(s.breaking_crushed + crushed_here(par, s) - known, 0.0)
    beyond -= max(s.breaking_crushed - known, 0.0)
    return sharpness(par, s) * beyond / max(s.breaking_crushing_energy, LEAST_DIVISOR)


@inlined
def gained(par, s, deeper):
    """Advance of the hole by the present loading [m], which presses the buttons in deeper."""
    if s.breaking_crushing_energy < LEAST_ENERGY:
        return deeper
    before = s.breaking_under_way
    volume = flushed(par, before + broken(par, s)) - flushed(par, before)
    # found late, a peak may lie just above the beginning
    return max(min(volume / par.hole_area, deeper), 0.0)


@inlined
def end_loading(par, s, advance):
    """Book what a loading broke, at its peak."""
    if s.breaking_crushing_energy >= LEAST_ENERGY:
        volume = broken(par, s)
        s.breaking_limited += max(volume - advance * par.hole_area, 0.0)
        s.breaking_under_way += volume
    s.breaking_crushed += crushed_here(par, s)
    s.breaking_volume += advance * par.hole_area


@inlined
def next_blow(par, s, period, kept, rest, push, climb):
    """Move to a place that keeps a share of its craters' depth."""
    taken = max(s.breaking_taken, s.breaking_crushed)
    taken *= exp((par.exponent + 1.0) * log(kept)) if kept > 0.0 else 0.0
    s.breaking_taken, s.breaking_under_way, s.breaking_blow_volume = (
        taken,
        0.0,
        s.breaking_under_way,
    )
    # rock that is left as it was is crushed from there on; a loading under way goes on
    under_way = min(s.crushed_before, s.breaking_crushed)
    s.breaking_crushed = taken if par.left == 1 else under_way


COMPONENT = Component(
    "breaking",
    "the hole advances by the volume broken, which needs its diameter and the bit's buttons",
    {
        "buttons": (None, "-", "buttons of the bit", 1, 1000),
        "crushing_energy": (
            CRUSHING_ENERGY,
            "J/m^3",
            "e_c: crushing energy per volume of a crater beyond the threshold; "
            "0: the hole advances by what is pressed in",
            0.0,
            1e12,
        ),
        "threshold": (
            THRESHOLD,
            "J",
            "W_0: crushing energy of one button below which no crater breaks out",
            0.0,
            1e6,
        ),
        "efficiency": (
            EFFICIENCY,
            "-",
            "eta: volume divided by that of craters on flat rock, sharp buttons",
            0.0,
            1.0,
        ),
        "wear_length": (0.0, "m", "hole after which wear is 63 % done; 0: no wear", 0.0, 1e6),
        "worn": (0.55, "-", "efficiency of worn buttons divided by that of sharp ones", 0.0, 1.0),
        "drilled": (0.0, "m", "hole that the bit has drilled before", 0.0, 1e6),
        "flushed_volume": (
            0.0,
            "m^3",
            "volume of a blow that flushing halves; 0: flushing does not limit",
            0.0,
            1.0,
        ),
    },
    state={
        "volume": ("m^3", "volume broken since the start", 0.0),
        "crushed": ("J", "energy crushed at this place, by loadings that have ended", 0.0),
        "taken": ("J", "energy whose craters were there when the bit came to this place", 0.0),
        "under_way": ("m^3", "volume broken in the blow under way", 0.0),
        "blow_volume": ("m^3", "volume broken in the last blow", 0.0),
        "limited": ("m^3", "volume that flushing and the depth pressed in have cut off", 0.0),
    },
    inputs=("crushing_energy",),
    gained=gained,
    end_loading=end_loading,
    next_blow=next_blow,
    of_blow=("blow_volume",),
    needs={"effects.rock": ("bilinear", "power")},
)
