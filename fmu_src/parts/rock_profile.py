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
import random
from bisect import bisect_right
from typing import Any

from fmu_src.parts.part import COUNT, Entries, Model, PartTable, slave_of

LAYERS = 6
# Knots of the variation that are kept, by number.
MOST_KNOTS = 64


class RockProfile(Model):
    """What the bit meets at its depth."""

    STATE = ("depth", "feed", "pressure", "torque")

    def __init__(self, parameters: dict[str, Any]) -> None:
        super().__init__(parameters)
        layers = [self._layer(number) for number in range(1, LAYERS + 1)]
        # without any layer all is rock of the first one
        self.layers = sorted(layer for layer in layers if layer[0] >= 0.0) or layers[:1]
        self.tops = [layer[0] for layer in self.layers]
        self.depth = self.feed = self.pressure = self.torque = 0.0
        self._knots: dict[int, float] = {}
        self._spread = parameters["variation.spread"]
        self._length = parameters["variation.length"]
        # number of the knot above the bit, none yet, and the values of it and the next
        self._between: tuple[int | None, float, float] = (None, 0.0, 0.0)
        self._arm = parameters["torque_arm"]

    def _layer(self, number: int) -> tuple[float, float, float, float, float, int]:
        """Top [m], K_R [N/m], gamma, torque factor, e_c [J/m^3] and number of a layer."""
        top, *numbers = (self.parameters[f"layers[{number}].{name}"] for name in _LAYER)
        return top, *numbers, number

    def begin(self, inputs: dict[str, Any]) -> None:
        """Look at the rock below the bit."""
        self.depth = self.parameters["start.depth"] + inputs["bit_position"]
        self._hold(inputs)

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """Follow the bit; rock that was drilled does not come back."""
        here = self.parameters["start.depth"] + inputs["bit_position"]
        self.depth = max(self.depth, here)
        self._hold(inputs)

    def _hold(self, inputs: dict[str, Any]) -> None:
        self.feed, self.pressure = inputs["feed_force"], inputs["supply_pressure"]
        self.torque = inputs["bit_torque"]

    def variation(self, depth: float) -> float:
        """The factor exp(s n - s^2/2) at a depth [m]."""
        s = self._spread
        if s == 0.0:
            return 1.0
        place = depth / self._length
        above = math.floor(place)
        if above != self._between[0]:
            self._between = above, self._knot(above), self._knot(above + 1)
        share = place - above
        _, low, high = self._between
        # straight between knots, with the spread kept
        n = ((1.0 - share) * low + share * high) / math.hypot(1.0 - share, share)
        return math.exp(s * n - 0.5 * s * s)

    def _knot(self, number: int) -> float:
        if number not in self._knots:
            if len(self._knots) > MOST_KNOTS:
                self._knots.clear()
            seed = f"{int(self.parameters['variation.seed'])}:{number}"
            self._knots[number] = random.Random(seed).gauss(0.0, 1.0)
        return self._knots[number]

    def _layer_at_depth(self) -> tuple[float, float, float, float, float, int]:
        return self.layers[max(0, bisect_right(self.tops, self.depth) - 1)]

    def _quadratic_factor(self, value: float, name: str, best: str) -> float:
        """Factor on the stiffness that is least at the best feed, or pressure."""
        factor = self.parameters[f"{name}.factor"]
        if factor == 0.0:
            return 1.0
        off = value / self.parameters[f"{name}.{best}"] - 1.0
        return 1.0 + factor * off * off

    def signals(self) -> dict[str, Any]:
        """What hammer and controller take."""
        _, stiffness, ratio, torque, energy, _ = self._layer_at_depth()
        factor = self.variation(self.depth)
        factor *= self._quadratic_factor(self.feed, "best_feed", "force")
        factor *= self._quadratic_factor(self.pressure, "best_pressure", "pressure")
        return {
            "loading_stiffness": stiffness * factor,
            "unloading_ratio": ratio,
            "crushing_energy": energy,
            "rotation_torque": self._arm * torque * self.feed + self.torque,
        }

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        _, stiffness, *_, which = self._layer_at_depth()
        return self.signals() | {
            "depth": self.depth,
            "in_void": stiffness <= self.parameters["void_stiffness"],
            "layer": which,
        }


RockProfilePart = slave_of(RockProfile)


_LAYER = {
    "top": ("m", -1.0, 2e4, "depth at which the layer begins (-1: no such layer)"),
    "loading_stiffness": ("N/m", 1e3, 1e13, "loading stiffness K_R"),
    "unloading_ratio": ("1", 1.0, 1e4, "gamma: unloading by loading stiffness"),
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
    slave=RockProfilePart,
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
        "best_feed.factor": ("1", 0.0, 1e6, 0.0, "growth of K_R by the square of the distance"),
        "best_pressure.pressure": ("Pa", 1.0, 1e9, 2e6, "supply pressure at which K_R is lowest"),
        "best_pressure.factor": ("1", 0.0, 1e6, 0.0, "growth of K_R by the square of the distance"),
        "torque_arm": ("m", 0.0, 10.0, 0.04, "torque by feed force in sound rock"),
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
)
