"""Rock by depth: layers, voids, random variation, and stiffness that depends on feed.

    K = K_layer exp(s n(z) - s^2/2) (1 + a (F/F_a - 1)^2) (1 + b (p/p_b - 1)^2)

n(z) is a normal variable, straight between knots a correlation length apart, the same for
the same seed. The third factor makes a feed force F_a the best one: it stands for a bit that
rides on cuttings above it, and sits badly below it. The last one does so for the supply pressure
p, of which too little flushes badly. Both are assumptions to try seekers on, off by default.
The torque on the rotation is r f F.
"""

from __future__ import annotations

import math

from fmu_src.parts.part import COUNT, NUMBER, Entries, Law, PartTable
from percussion_model.physics.elementary import cos, exp, log
from percussion_model.physics.kernel import kernel

LAYERS = 6
TOP, STIFFNESS, RATIO, TORQUE, ENERGY = range(5)
DEEPEST = 1e8  # of a state from outside [m]
# Of a whole number of 32 bits: all, and how many there are.
MASK, ALL = 0xFFFFFFFF, 4294967296.0


@kernel
def begin(p, u, s, w):
    """Look at the rock below the bit."""
    s.depth = p.start_depth + u.bit_position
    hold(u, s)


@kernel
def step(p, u, s, w, h):
    """Follow the bit; rock that was drilled does not come back."""
    s.depth = max(s.depth, p.start_depth + u.bit_position)
    hold(u, s)
    return 0


@kernel
def hold(u, s):
    """Keep what the stiffness depends on."""
    s.feed, s.pressure, s.torque = u.feed_force, u.supply_pressure, u.bit_torque


@kernel
def layer_at(p, depth):
    """Row of the layer at a depth [m]; without any layer all is rock of the first one."""
    found, first = -1, -1
    for k in range(LAYERS):
        top = p.layers[k, TOP]
        if top < 0.0:
            continue
        if first < 0 or top < p.layers[first, TOP]:
            first = k
        if top <= depth and (found < 0 or top >= p.layers[found, TOP]):
            found = k
    return max(found if found >= 0 else first, 0)


@kernel
def mixed(x):
    """A whole number of 32 bits that knows nothing of this one (MurmurHash3, A. Appleby)."""
    x = ((x ^ (x >> 16)) * 0x85EBCA6B) & MASK
    x = ((x ^ (x >> 13)) * 0xC2B2AE35) & MASK
    return x ^ (x >> 16)


@kernel
def knot(seed, number):
    """Normal variable of a knot, the same for the same seed (Box and Muller, 1958)."""
    x = mixed(mixed(mixed(seed) ^ (number & MASK)) ^ ((number >> 32) & MASK))
    size = math.sqrt(-2.0 * log((mixed(x ^ 1) + 1) / ALL))
    return size * cos(2.0 * math.pi * (mixed(x ^ 2) / ALL))


@kernel
def variation(p, depth):
    """The factor exp(s n - s^2/2) at a depth [m]."""
    spread = p.variation_spread
    if spread == 0.0:
        return 1.0
    place = depth / p.variation_length
    above = math.floor(place)
    share, seed = place - above, p.variation_seed
    n = (1.0 - share) * knot(seed, above) + share * knot(seed, above + 1)
    # straight between knots, with the spread kept
    n = n / math.sqrt((1.0 - share) * (1.0 - share) + share * share)
    return exp(spread * n - 0.5 * spread * spread)


@kernel
def growth(value, best, factor):
    """Factor on the stiffness, which is least at the best feed or pressure."""
    off = value / best - 1.0
    return 1.0 + factor * off * off


@kernel
def outputs(p, s, w, y):
    """Present values."""
    k = layer_at(p, s.depth)
    factor = variation(p, s.depth) * growth(s.feed, p.best_feed_force, p.best_feed_factor)
    factor *= growth(s.pressure, p.best_pressure_pressure, p.best_pressure_factor)
    y.loading_stiffness = p.layers[k, STIFFNESS] * factor
    y.unloading_ratio, y.crushing_energy = p.layers[k, RATIO], p.layers[k, ENERGY]
    y.rotation_torque = p.torque_arm * p.layers[k, TORQUE] * s.feed + s.torque
    y.depth, y.layer = s.depth, k + 1
    y.in_void = p.layers[k, STIFFNESS] <= p.void_stiffness


LAW = Law(
    state={"depth": (-DEEPEST, DEEPEST), **dict.fromkeys(("feed", "pressure", "torque"), NUMBER)},
    begin=begin,
    step=step,
    outputs=outputs,
)


_LAYER = {
    "top": ("m", -1.0, 2e4, "depth at which the layer begins (-1: no such layer)"),
    "loading_stiffness": ("N/m", 1e3, 1e13, "loading stiffness K_R"),
    "unloading_ratio": ("1", 1.0, 1e4, "gamma: ratio of unloading to loading stiffness"),
    "torque_factor": ("1", 0.0, 100.0, "torque on the rotation, divided by that of sound rock"),
    "crushing_energy": ("J/m^3", 0.0, 1e12, "e_c, for a hammer with effects.breaking"),
}
_LAYER_START = {
    "top": -1.0, "loading_stiffness": 7.5e8, "unloading_ratio": 5.0, "torque_factor": 1.0,
    "crushing_energy": 5.5e7,
}  # fmt: skip


def _layers() -> Entries:
    """Parameters of six layers; the first begins at the surface."""
    found: Entries = {}
    for i in range(1, LAYERS + 1):
        for name, (unit, lower, upper, text) in _LAYER.items():
            start = 0.0 if i == 1 and name == "top" else _LAYER_START[name]
            found[f"layers[{i}].{name}"] = (unit, lower, upper, start, text)
    return found


TABLE = PartTable(
    name="RockProfile",
    description="Rock by depth: layers, voids, random variation, stiffness by feed",
    inputs={
        "bit_position": ("m", -1e6, 1e6, 0.0, "displacement of the bit"),
        "feed_force": ("N", -1e9, 1e9, 2500.0, "feed force on the bit"),
        "supply_pressure": ("Pa", 0.0, 1e9, 2e6, "gauge pressure at the hammer"),
        "bit_torque": ("N.m", 0.0, 1e12, 0.0, "torque of a hammer with effects.rotation"),
    },
    outputs={
        "loading_stiffness": ("N/m", "loading stiffness K_R at the bit"),
        "unloading_ratio": ("1", "gamma at the bit"),
        "crushing_energy": ("J/m^3", "e_c at the bit"),
        "depth": ("m", "greatest depth of the bit"),
        "rotation_torque": ("N.m", "torque on the rotation, that of the bit and by the rock"),
        "in_void": (False, "whether the layer is soft enough to count as a void"),
        "layer": (COUNT, "number of the layer"),
    },
    parameters=_layers()
    | {
        "start.depth": ("m", 0.0, 2e4, 0.0, "depth of the hole at the start"),
        "variation.spread": ("1", 0.0, 2.0, 0.0, "standard deviation of ln K_R"),
        "variation.length": ("m", 1e-4, 1e3, 0.01, "distance of the knots of the variation"),
        "variation.seed": (COUNT, 0, 1_000_000, 1, "seed of the variation"),
        "best_feed.force": ("N", 1.0, 1e9, 2500.0, "feed force at which K_R is lowest"),
        "best_feed.factor": ("1", 0.0, 1e6, 0.0, "growth of K_R per square of the distance"),
        "best_pressure.pressure": ("Pa", 1.0, 1e9, 2e6, "supply pressure at which K_R is lowest"),
        "best_pressure.factor": ("1", 0.0, 1e6, 0.0, "growth of K_R per square of the distance"),
        "torque_arm": ("m", 0.0, 10.0, 0.04, "torque per feed force in sound rock"),
        "void_stiffness": ("N/m", 0.0, 1e13, 1e7, "K_R up to which a layer counts as a void"),
    },
    at_start={
        "loading_stiffness": ("bit_position", "feed_force", "supply_pressure"),
        "unloading_ratio": ("bit_position",),
        "crushing_energy": ("bit_position",),
        "depth": ("bit_position",),
        "rotation_torque": ("bit_position", "feed_force", "bit_torque"),
        "in_void": ("bit_position",),
        "layer": ("bit_position",),
    },
    law=LAW,
)
