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

from fmu_src.runtime.system.part import Model

LAYERS = 6
# Knots of the variation that are kept, by number.
KEPT = 64


class RockProfile(Model):
    """What the bit meets at its depth."""

    STATE = ("depth", "feed", "pressure")

    def __init__(self, parameters: dict[str, Any]) -> None:
        super().__init__(parameters)
        layers = [self._layer(number) for number in range(1, LAYERS + 1)]
        # without any layer all is rock of the first one
        self.layers = sorted(layer for layer in layers if layer[0] >= 0.0) or layers[:1]
        self.tops = [layer[0] for layer in self.layers]
        self.depth = self.feed = self.pressure = 0.0
        self._knots: dict[int, float] = {}

    def _layer(self, number: int) -> tuple[float, float, float, float, int]:
        """Top [m], K_R [N/m], gamma, torque factor and number of a layer."""
        names = ("top", "loading_stiffness", "unloading_ratio", "torque_factor")
        top, stiffness, ratio, torque = (self.parameters[f"layers[{number}].{n}"] for n in names)
        return top, stiffness, ratio, torque, number

    def begin(self, inputs: dict[str, Any]) -> None:
        """Look at the rock below the bit."""
        self.depth = self.parameters["start.depth"] + inputs["bit_position"]
        self.feed, self.pressure = inputs["feed_force"], inputs["supply_pressure"]

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """Follow the bit; rock that was drilled does not come back."""
        here = self.parameters["start.depth"] + inputs["bit_position"]
        self.depth = max(self.depth, here)
        self.feed, self.pressure = inputs["feed_force"], inputs["supply_pressure"]

    def variation(self, depth: float) -> float:
        """The factor exp(s n - s^2/2) at a depth [m]."""
        p = self.parameters
        s = p["variation.spread"]
        if s == 0.0:
            return 1.0
        place = depth / p["variation.length"]
        below = math.floor(place)
        share = place - below
        low, high = self._knot(below), self._knot(below + 1)
        # straight between knots, with the spread kept
        n = ((1.0 - share) * low + share * high) / math.hypot(1.0 - share, share)
        return math.exp(s * n - 0.5 * s * s)

    def _knot(self, number: int) -> float:
        if number not in self._knots:
            if len(self._knots) > KEPT:
                self._knots.clear()
            seed = f"{int(self.parameters['variation.seed'])}:{number}"
            self._knots[number] = random.Random(seed).gauss(0.0, 1.0)
        return self._knots[number]

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        p = self.parameters
        number = max(0, bisect_right(self.tops, self.depth) - 1)
        _, stiffness, ratio, torque, which = self.layers[number]
        factor = self.variation(self.depth)
        for value, name, best in ((self.feed, "best_feed", "force"),
                                  (self.pressure, "best_pressure", "pressure")):  # fmt: skip
            off = value / p[f"{name}.{best}"] - 1.0
            factor *= 1.0 + p[f"{name}.factor"] * off * off
        return {
            "loading_stiffness": stiffness * factor,
            "unloading_ratio": ratio,
            "depth": self.depth,
            "rotation_torque": p["torque_arm"] * torque * self.feed,
            "in_void": stiffness <= p["void_stiffness"],
            "layer": which,
        }
