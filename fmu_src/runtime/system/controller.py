"""Controller of a drill rig: feed, pressure and percussion from what a rig measures.

Blocks that can be switched off, asked in this order: retract where the rotation jams, cut
percussion back in a void, seek the feed of the best rate, keep the feed force by a PI, and
let the pressure follow the feed.
"""

from __future__ import annotations

import math
from typing import Any

from fmu_src.runtime.system.part import Model

DRILLING, VOID, RETRACT = 0, 1, 2


class DrillController(Model):
    """All blocks, with their state."""

    time: float
    mode: int
    since: float
    wanted: float
    integral: float
    command: float
    pressure: float
    jammed_for: float
    speed: float
    centre: float
    phase: float
    samples: int
    sum_feed: float
    sum_rate: float
    sum_square: float
    sum_product: float
    gradient: float
    STATE = tuple(__annotations__)

    def __init__(self, parameters: dict[str, Any]) -> None:
        super().__init__(parameters)
        for name in self.STATE:
            setattr(self, name, 0.0)
        self.mode, self.samples = DRILLING, 0

    def begin(self, inputs: dict[str, Any]) -> None:
        """Start with the force that the rig has."""
        self.wanted = self.centre = inputs["feed_setpoint"]
        self.command = self.parameters["start.force"]
        self.integral = self.command - self.wanted
        self.pressure = inputs["pressure_setpoint"]

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """One sample of the controller."""
        p, h = self.parameters, step_size
        self.time += h
        self.speed += (1.0 - math.exp(-h / p["speed_filter"])) * (
            inputs["head_velocity"] - self.speed
        )
        self._choose_mode(inputs, h)
        goal = inputs["feed_setpoint"]
        if p["seek.on"]:
            goal = self._seek(inputs, h)
        if self.mode == DRILLING:
            self._go_towards(goal, h)
            self._keep_feed(inputs["feed_force"], h)
            self._set_pressure(inputs, inputs["pressure_setpoint"], h)
        elif self.mode == VOID:
            self.wanted = min(self.wanted, p["cutback.feed"])
            self._command(self.integral + p["cutback.force"], h)
            self._set_pressure(inputs, p["cutback.pressure"], h)
        else:
            self.wanted = min(self.wanted, p["cutback.feed"])
            self._command(self.integral + p["retract.force"], h)
            self._set_pressure(inputs, inputs["pressure_setpoint"], h)

    def _choose_mode(self, inputs: dict[str, Any], h: float) -> None:
        p = self.parameters
        self.since += h
        torque = inputs["rotation_torque"]
        self.jammed_for = self.jammed_for + h if torque > p["retract.torque"] else 0.0
        settled = self.since >= p["mode_time"]
        mode = self.mode
        if p["retract.on"] and mode != RETRACT and self.jammed_for >= p["retract.delay"]:
            mode = RETRACT
        elif mode == RETRACT and settled and torque < p["retract.share"] * p["retract.torque"]:
            mode = DRILLING
        elif p["cutback.on"] and mode == DRILLING and self.speed > p["cutback.velocity"]:
            mode = VOID
        elif (
            mode == VOID
            and settled
            and self.speed < 0.5 * p["cutback.velocity"]
            and inputs["feed_force"] > 0.5 * p["cutback.feed"]
        ):
            mode = DRILLING
        if mode != self.mode:
            self.mode, self.since = mode, 0.0

    def _go_towards(self, goal: float, h: float) -> None:
        """The wanted feed moves at a limited rate."""
        most = self.parameters["feed_rate"] * h
        self.wanted += min(max(goal - self.wanted, -most), most)

    def _keep_feed(self, feed: float, h: float) -> None:
        """PI beside the wanted feed itself; the integral stops where the command is limited.

        So the integral is what weights and reaction bring, which a void does not change much.
        """
        p = self.parameters
        error = self.wanted - feed if p["pi.on"] else 0.0
        raised = self.integral + h * p["pi.gain"] / p["pi.time"] * error
        command = self.wanted + p["pi.gain"] * error + raised
        if abs(command) <= p["force_limit"] or error * command < 0.0:
            self.integral = raised
        self._command(command, 0.0)

    def _command(self, force: float, h: float) -> None:
        """Send a force; at a limited rate where `h` [s] is given."""
        limit = self.parameters["force_limit"]
        force = min(max(force, -limit), limit)
        if h > 0.0:
            most = self.parameters["force_rate"] * h
            force = self.command + min(max(force - self.command, -most), most)
        self.command = force

    def _set_pressure(self, inputs: dict[str, Any], goal: float, h: float) -> None:
        """Pressure follows the feed, at a limited rate."""
        p = self.parameters
        if p["ratio.on"]:
            goal = min(goal, max(p["ratio.lowest"], p["ratio.slope"] * inputs["feed_force"]))
        most = p["pressure_rate"] * h
        self.pressure += min(max(goal - self.pressure, -most), most)

    def _seek(self, inputs: dict[str, Any], h: float) -> float:
        """Climb towards the feed of the best rate; return the feed to be kept.

        The feed swings about its centre, F = F_0 (1 + a sin w t). The slope of the rate over
        the measured feed in a whole period, by the mean of both, is d ln R / d ln F, whatever
        the rig makes of the swing; it moves ln F_0 by a limited amount.
        """
        p = self.parameters
        swing, period = p["seek.swing"], p["seek.period"]
        feed, rate = inputs["feed_force"], inputs["rate_of_penetration"]
        if self.time > p["seek.wait"]:
            self.samples += 1
            self.sum_feed += feed
            self.sum_rate += rate
            self.sum_square += feed * feed
            self.sum_product += feed * rate
        self.phase += h
        if self.phase >= period - 0.5 * h:
            self._climb()
            self.phase = 0.0
            self.samples = 0
            self.sum_feed = self.sum_rate = self.sum_square = self.sum_product = 0.0
        return self.centre * (1.0 + swing * math.sin(2.0 * math.pi * self.phase / period))

    def _climb(self) -> None:
        """Move the centre by the slope of the period that has ended."""
        p, n = self.parameters, self.samples
        spread = n * self.sum_square - self.sum_feed**2
        if n < 2 or self.sum_rate <= 0.0 or spread <= 0.0:
            return
        slope = (n * self.sum_product - self.sum_feed * self.sum_rate) / spread
        self.gradient = slope * self.sum_feed / self.sum_rate
        most = p["seek.largest_move"]
        move = min(max(p["seek.gain"] * self.gradient, -most), most)
        self.centre = min(max(self.centre * math.exp(move), p["seek.lowest"]), p["seek.highest"])

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        percussion = self.mode != VOID or self.parameters["cutback.pressure"] > 0.0
        return {
            "force_command": self.command,
            "pressure_command": self.pressure,
            "percussion_on": bool(percussion),
            "mode": int(self.mode),
            "feed_wanted": self.wanted,
            "seek.centre": self.centre,
            "seek.gradient": self.gradient,
        }
