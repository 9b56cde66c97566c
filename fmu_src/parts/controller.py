"""Controller of a drill rig: feed, pressure and percussion from what a rig measures.

Blocks that can be switched off, asked in this order: retract where the rotation jams, cut
percussion back in a void, seek the feed of the best rate, keep the feed force by a PI, and
let the pressure follow the feed.
"""

from __future__ import annotations

from fmu_src.parts import seeker
from fmu_src.parts.part import COUNT, NUMBER, Law, PartTable
from fmu_src.parts.seeker import FEED, PRESSURE
from percussion_model.physics.elementary import exp
from percussion_model.physics.kernel import kernel

DRILLING, VOID, RETRACT = 0, 1, 2


@kernel
def begin(p, u, s, w):
    """Start with the force that the rig has."""
    s.wanted, s.command = u.feed_setpoint, p.start_force
    s.integral = s.command - s.wanted
    s.pressure = u.pressure_setpoint
    s.centres[FEED], s.centres[PRESSURE] = s.wanted, s.pressure
    s.pause_end = p.seek_wait


@kernel
def step(p, u, s, w, h):
    """One sample of the controller."""
    s.time += h
    s.speed += (1.0 - exp(-h / p.speed_filter)) * (u.head_velocity - s.speed)
    choose_mode(p, u, s, h)
    goal, pressure = u.feed_setpoint, u.pressure_setpoint
    if p.seek_on:
        if s.mode == DRILLING:
            goal, sought = seeker.sample(p, u, s, h)
            pressure = sought if p.seek_pressure_on else pressure
        else:
            seeker.pause(p, s)
            if p.seek_pressure_on:
                pressure = s.centres[PRESSURE]
    if s.mode == DRILLING:
        # the wanted feed moves at a limited rate
        s.wanted += within(goal - s.wanted, p.feed_rate * h)
        control_feed(p, s, u.feed_force, h)
        set_pressure(p, u, s, pressure, h)
        return 0
    s.wanted = min(s.wanted, p.cutback_feed)
    if s.mode == VOID:
        send(p, s, s.integral + p.cutback_force, h)
        set_pressure(p, u, s, p.cutback_pressure, h)
    else:
        relax_integral(p, s, u.feed_force, h)
        send(p, s, s.integral + p.retract_force, h)
        set_pressure(p, u, s, pressure, h)
    return 0


@kernel
def within(value, most):
    """The value, of at most a size."""
    return min(max(value, -most), most)


@kernel
def choose_mode(p, u, s, h):
    """Take the mode that what is measured asks for."""
    s.since += h
    torque, mode = u.rotation_torque, s.mode
    s.jam_time = s.jam_time + h if torque > p.retract_torque else 0.0
    settled = s.since >= p.mode_time
    if p.retract_on and mode != RETRACT and s.jam_time >= p.retract_delay:
        mode = RETRACT
    elif mode == RETRACT and settled and torque < p.retract_share * p.retract_torque:
        mode = DRILLING
    elif p.cutback_on and mode == DRILLING and s.speed > p.cutback_velocity:
        mode = VOID
    elif mode == VOID and settled and s.speed < 0.5 * p.cutback_velocity:
        mode = DRILLING if u.feed_force > 0.5 * p.cutback_feed else VOID
    if mode != s.mode:
        s.mode, s.since = mode, 0.0


@kernel
def control_feed(p, s, feed, h):
    """PI beside the wanted feed itself; the integral stops where the command is limited.

    So the integral is what weights and reaction bring, which a void does not change much.
    """
    error = s.wanted - feed if p.pi_on else 0.0
    raised = s.integral + h * p.pi_gain / p.pi_time * error
    command = s.wanted + p.pi_gain * error + raised
    if abs(command) <= p.force_limit or error * command < 0.0:
        s.integral = raised
    send(p, s, command, 0.0)


@kernel
def relax_integral(p, s, feed, h):
    """A retract that does not help in its time takes too much for the weights: less of it."""
    if s.since > p.mode_time and s.command > -p.force_limit:
        s.integral -= h * p.pi_gain / p.pi_time * max(0.0, feed - s.wanted)


@kernel
def send(p, s, force, h):
    """Send a force; at a limited rate where `h` [s] is given."""
    force = within(force, p.force_limit)
    if h > 0.0:
        force = s.command + within(force - s.command, p.force_rate * h)
    s.command = force


@kernel
def set_pressure(p, u, s, goal, h):
    """Pressure follows the feed, at a limited rate."""
    if p.ratio_on:
        goal = min(goal, max(p.ratio_lowest, p.ratio_slope * u.feed_force))
    s.pressure += within(goal - s.pressure, p.pressure_rate * h)


@kernel
def outputs(p, s, w, y):
    """Present values."""
    y.force_command, y.pressure_command = s.command, s.pressure
    y.percussion_on = s.mode != VOID or p.cutback_pressure > 0.0
    y.mode, y.feed_wanted = s.mode, s.wanted
    y.seek_centre, y.seek_gradient = s.centres[FEED], s.gradients[FEED]
    y.seek_pressure_centre, y.seek_pressure_gradient = s.centres[PRESSURE], s.gradients[PRESSURE]


LAW = Law(
    state={
        "mode": (DRILLING, RETRACT),
        **dict.fromkeys(
            ("time", "since", "wanted", "integral", "command", "pressure", "jam_time", "speed"),
            NUMBER,
        ),
        **seeker.STATE,
    },
    begin=begin,
    step=step,
    outputs=outputs,
)

TABLE = PartTable(
    name="DrillController",
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
        "ratio.slope": ("Pa/N", 0.0, 1e9, 800.0, "pressure per feed force"),
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
        "seek.swing": ("1", 1e-4, 0.5, 0.06, "swing of the feed divided by its mean"),
        "seek.period": ("s", 0.01, 1e3, 2.0, "period of the swing"),
        "seek.wait": ("s", 0.0, 1e4, 2.0, "time before the first period counts"),
        "seek.gain": ("1", 0.0, 100.0, 0.15, "move of ln feed per gradient found"),
        "seek.largest_move": ("1", 0.0, 1.0, 0.12, "largest move of ln feed in a period"),
        "seek.lowest": ("N", 1.0, 1e9, 500.0, "lowest feed of the seeker"),
        "seek.highest": ("N", 1.0, 1e9, 2e4, "highest feed of the seeker"),
        "seek.pressure_on": ("", 0, 1, False, "seek the pressure too, by a second swing"),
        "seek.pressure_swing": ("1", 1e-4, 0.5, 0.06, "swing of the pressure divided by its mean"),
        "seek.pressure_cycles": (COUNT, 2, 50, 3, "swings of the pressure in a period"),
        "seek.pressure_gain": ("1", 0.0, 100.0, 0.15, "move of ln pressure per gradient found"),
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
    law=LAW,
)  # fmt: skip
