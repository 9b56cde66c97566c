"""Controller of a drill rig: feed, pressure and percussion from what a rig measures.

Blocks that can be switched off, asked in this order: retract where the rotation jams, cut
percussion back in a void, seek the feed of the best rate, keep the feed force by a PI, and
let the pressure follow the feed.
"""

from __future__ import annotations

import math
from copy import copy
from typing import Any

from fmu_src.parts.part import Model
from fmu_src.parts.seeker import FEED, PRESSURE, Seeker

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
    STATE = tuple(__annotations__)

    def __init__(self, parameters: dict[str, Any]) -> None:
        super().__init__(parameters)
        for name in self.STATE:
            setattr(self, name, 0.0)
        self.mode = DRILLING
        self.seeker = Seeker(parameters)
        self._share = 0.0, 0.0  # of a step that the filter of the speed lets through

    def begin(self, inputs: dict[str, Any]) -> None:
        """Start with the force that the rig has."""
        self.wanted = inputs["feed_setpoint"]
        self.command = self.parameters["start.force"]
        self.integral = self.command - self.wanted
        self.pressure = inputs["pressure_setpoint"]
        self.seeker.centres = [self.wanted, self.pressure]

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """One sample of the controller."""
        p, h = self.parameters, step_size
        self.time += h
        if h != self._share[0]:
            self._share = h, 1.0 - math.exp(-h / p["speed_filter"])
        self.speed += self._share[1] * (inputs["head_velocity"] - self.speed)
        self._choose_mode(inputs, h)
        goal, pressure = inputs["feed_setpoint"], inputs["pressure_setpoint"]
        if p["seek.on"]:
            if self.mode == DRILLING:
                sought = self.seeker.go_on(inputs, self.time, h)
                goal, pressure = sought if p["seek.pressure_on"] else (sought[0], pressure)
            else:
                self.seeker.pause(self.time)
                if p["seek.pressure_on"]:
                    pressure = self.seeker.centres[PRESSURE]
        if self.mode == DRILLING:
            self._go_towards(goal, h)
            self._keep_feed(inputs["feed_force"], h)
            self._set_pressure(inputs, pressure, h)
        elif self.mode == VOID:
            self.wanted = min(self.wanted, p["cutback.feed"])
            self._command(self.integral + p["cutback.force"], h)
            self._set_pressure(inputs, p["cutback.pressure"], h)
        else:
            self.wanted = min(self.wanted, p["cutback.feed"])
            self._give_way(inputs["feed_force"], h)
            self._command(self.integral + p["retract.force"], h)
            self._set_pressure(inputs, pressure, h)

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

    def _give_way(self, feed: float, h: float) -> None:
        """A retract that does not help in its time takes too much for the weights: less of it."""
        p = self.parameters
        if self.since > p["mode_time"] and self.command > -p["force_limit"]:
            excess = max(0.0, feed - self.wanted)
            self.integral -= h * p["pi.gain"] / p["pi.time"] * excess

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

    def signals(self) -> dict[str, Any]:
        """What rig, supply and hammer take."""
        percussion = self.mode != VOID or self.parameters["cutback.pressure"] > 0.0
        return {
            "force_command": self.command,
            "pressure_command": self.pressure,
            "percussion_on": percussion,
        }

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        return self.signals() | {
            "mode": int(self.mode),
            "feed_wanted": self.wanted,
            "seek.centre": self.seeker.centres[FEED],
            "seek.gradient": self.seeker.gradients[FEED],
            "seek.pressure_centre": self.seeker.centres[PRESSURE],
            "seek.pressure_gradient": self.seeker.gradients[PRESSURE],
        }

    def save(self) -> dict[str, Any]:
        """State of controller and seeker."""
        seeker = {name: copy(getattr(self.seeker, name)) for name in Seeker.STATE}
        return super().save() | {"seeker": seeker}

    def restore(self, saved: dict[str, Any]) -> None:
        """Go back to a state."""
        super().restore(saved)
        for name, value in saved["seeker"].items():
            setattr(self.seeker, name, copy(value))
