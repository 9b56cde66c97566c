"""Controller of a drill rig: feed, pressure and percussion from what a rig measures.

Blocks that can be switched off, asked in this order: retract where the rotation jams, cut
percussion back in a void, seek the feed of the best rate, keep the feed force by a PI, and
let the pressure follow the feed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fmu_src.parts.part import COUNT, Model, PartTable, slave_of
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
    jam_time: float
    speed: float
    seeker: Seeker
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
                sought = self.seeker.sample(inputs, self.time, h)
                goal, pressure = sought if p["seek.pressure_on"] else (sought[0], pressure)
            else:
                self.seeker.pause(self.time)
                if p["seek.pressure_on"]:
                    pressure = self.seeker.centres[PRESSURE]
        if self.mode == DRILLING:
            self._ramp_feed(goal, h)
            self._control_feed(inputs["feed_force"], h)
            self._set_pressure(inputs, pressure, h)
        elif self.mode == VOID:
            self.wanted = min(self.wanted, p["cutback.feed"])
            self._send(self.integral + p["cutback.force"], h)
            self._set_pressure(inputs, p["cutback.pressure"], h)
        else:
            self.wanted = min(self.wanted, p["cutback.feed"])
            self._relax_integral(inputs["feed_force"], h)
            self._send(self.integral + p["retract.force"], h)
            self._set_pressure(inputs, pressure, h)

    def _choose_mode(self, inputs: dict[str, Any], h: float) -> None:
        p = self.parameters
        self.since += h
        torque = inputs["rotation_torque"]
        self.jam_time = self.jam_time + h if torque > p["retract.torque"] else 0.0
        settled = self.since >= p["mode_time"]
        mode = self.mode
        if p["retract.on"] and mode != RETRACT and self.jam_time >= p["retract.delay"]:
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

    def _ramp_feed(self, goal: float, h: float) -> None:
        """The wanted feed moves at a limited rate."""
        most = self.parameters["feed_rate"] * h
        self.wanted += min(max(goal - self.wanted, -most), most)

    def _control_feed(self, feed: float, h: float) -> None:
        """PI beside the wanted feed itself; the integral stops where the command is limited.

        So the integral is what weights and reaction bring, which a void does not change much.
        """
        p = self.parameters
        error = self.wanted - feed if p["pi.on"] else 0.0
        raised = self.integral + h * p["pi.gain"] / p["pi.time"] * error
        command = self.wanted + p["pi.gain"] * error + raised
        if abs(command) <= p["force_limit"] or error * command < 0.0:
            self.integral = raised
        self._send(command, 0.0)

    def _relax_integral(self, feed: float, h: float) -> None:
        """A retract that does not help in its time takes too much for the weights: less of it."""
        p = self.parameters
        if self.since > p["mode_time"] and self.command > -p["force_limit"]:
            excess = max(0.0, feed - self.wanted)
            self.integral -= h * p["pi.gain"] / p["pi.time"] * excess

    def _send(self, force: float, h: float) -> None:
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

    def state_fault(self, saved: Mapping[str, Any]) -> str:
        """As in `Model`: modes and lengths of lists."""
        if saved["mode"] not in (DRILLING, VOID, RETRACT):
            return f"mode = {saved['mode']!r}, which must be 0, 1 or 2"
        for name, value in saved["seeker"].items():
            own = getattr(self.seeker, name)
            if isinstance(own, list) and len(value) != len(own):
                return f"{len(value)} numbers in {name}, which must be {len(own)}"
        return ""


DrillControllerPart = slave_of(DrillController)


TABLE = PartTable(
    name="DrillController",
    slave=DrillControllerPart,
    description="Feed PI, pressure by feed, cut-back in voids, retract from jams, rate seeking",
    inputs={
        "feed_setpoint": ("N", 0.0, 1e9, 2500.0, "feed force that is wanted"),
        "pressure_setpoint": ("Pa", 0.0, 1e9, 2e6, "supply pressure that is wanted"),
        "feed_force": ("N", -1e9, 1e9, 2500.0, "measured feed force, filtered"),
        "rate_of_penetration": ("m/s", -1e4, 1e4, 0.0, "measured rate of penetration"),
        "supply_pressure": ("Pa", 0.0, 1e9, 2e6, "measured supply pressure"),
        "blow_frequency": ("Hz", 0.0, 1e6, 0.0, "measured frequency of the blows"),
        "rotation_torque": ("N m", -1e9, 1e9, 0.0, "measured torque of the rotation"),
        "head_velocity": ("m/s", -1e4, 1e4, 0.0, "measured velocity of the head"),
    },
    outputs={
        "force_command": ("N", "force that the rig is to give"),
        "pressure_command": ("Pa", "pressure that the supply is to give"),
        "percussion_on": (False, "whether the drive is to be open"),
        "mode": (COUNT, "0 drilling, 1 void, 2 retract"),
        "feed_wanted": ("N", "feed force that the PI keeps"),
        "seek.centre": ("N", "feed force about which the seeker swings"),
        "seek.gradient": ("1", "d ln rate / d ln feed, as the seeker found it last"),
        "seek.pressure_centre": ("Pa", "pressure about which the seeker swings"),
        "seek.pressure_gradient": ("1", "d ln rate / d ln pressure, as it was found last"),
    },
    parameters={
        "pi.on": ("", 0, 1, True, "PI on the feed force; off: the force at the start stays"),
        "pi.gain": ("1", 0.0, 1e3, 0.5, "gain of the PI"),
        "pi.time": ("s", 1e-3, 1e3, 0.2, "integral time of the PI"),
        "start.force": ("N", -1e6, 1e6, 0.0, "force command at the start"),
        "force_limit": ("N", 0.0, 1e7, 2e4, "greatest force command"),
        "force_rate": ("N/s", 0.0, 1e9, 4e4, "fastest change of the command outside the PI"),
        "feed_rate": ("N/s", 0.0, 1e9, 3e3, "fastest change of the feed that is wanted"),
        "pressure_rate": ("Pa/s", 0.0, 1e12, 2e7, "fastest change of the pressure command"),
        "speed_filter": ("s", 1e-4, 100.0, 0.05, "time of the filter of the head's velocity"),
        "mode_time": ("s", 0.0, 100.0, 0.3, "shortest stay in void or retract"),
        "ratio.on": ("", 0, 1, False, "pressure follows the feed"),
        "ratio.slope": ("Pa/N", 0.0, 1e9, 800.0, "pressure by feed force"),
        "ratio.lowest": ("Pa", 0.0, 1e9, 8e5, "lowest pressure of the ratio"),
        "cutback.on": ("", 0, 1, True, "cut percussion back in a void"),
        "cutback.velocity": ("m/s", 0.0, 100.0, 0.12, "velocity of the head that shows a void"),
        "cutback.pressure": ("Pa", 0.0, 1e9, 4e5, "pressure in a void; 0 shuts the drive"),
        "cutback.force": ("N", -1e6, 1e6, 0.0, "force in a void, beside that of the weights"),
        "cutback.feed": ("N", 0.0, 1e6, 800.0, "feed from which drilling begins again"),
        "retract.on": ("", 0, 1, True, "retract where the rotation jams"),
        "retract.torque": ("N m", 0.0, 1e9, 250.0, "torque that shows a jam"),
        "retract.share": ("1", 0.0, 1.0, 0.4, "share of it at which the jam is over"),
        "retract.delay": ("s", 0.0, 100.0, 0.1, "time that a jam has to last"),
        "retract.force": ("N", -1e6, 1e6, 400.0, "force while retracting, beside the weights"),
        "seek.on": ("", 0, 1, False, "seek the feed of the best rate"),
        "seek.swing": ("1", 1e-4, 0.5, 0.06, "swing of the feed by its mean"),
        "seek.period": ("s", 0.01, 1e3, 2.0, "period of the swing"),
        "seek.wait": ("s", 0.0, 1e4, 2.0, "time before the first period counts"),
        "seek.gain": ("1", 0.0, 100.0, 0.15, "move of ln feed by the gradient found"),
        "seek.largest_move": ("1", 0.0, 1.0, 0.12, "largest move of ln feed in a period"),
        "seek.lowest": ("N", 1.0, 1e9, 500.0, "lowest feed of the seeker"),
        "seek.highest": ("N", 1.0, 1e9, 2e4, "highest feed of the seeker"),
        "seek.pressure_on": ("", 0, 1, False, "seek the pressure too, by a second swing"),
        "seek.pressure_swing": ("1", 1e-4, 0.5, 0.06, "swing of the pressure by its mean"),
        "seek.pressure_cycles": (COUNT, 2, 50, 3, "swings of the pressure in a period"),
        "seek.pressure_gain": ("1", 0.0, 100.0, 0.15, "move of ln pressure by its gradient"),
        "seek.pressure_lowest": ("Pa", 1.0, 1e9, 8e5, "lowest pressure of the seeker"),
        "seek.pressure_highest": ("Pa", 1.0, 1e9, 3e6, "highest pressure of the seeker"),
    },
    at_start={
        "force_command": (),
        "pressure_command": ("pressure_setpoint",),
        "feed_wanted": ("feed_setpoint",),
        "seek.centre": ("feed_setpoint",),
        "seek.pressure_centre": ("pressure_setpoint",),
    },
)  # fmt: skip
