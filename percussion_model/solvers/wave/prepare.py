"""Parameters and first state of waves, from the numbers of a scene and its bars cut."""

from __future__ import annotations

from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Piston
from percussion_model.physics.rock import recoverable
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.setup import MOST_CHANGES, REARM_TRANSITS, fill_parameters, fill_start
from percussion_model.solvers.wave.advance import stored
from percussion_model.solvers.wave.network import first_is_piston
from percussion_model.solvers.wave.records import Bar, Body, Has
from percussion_model.solvers.wave.sections import RING, SIZE, kept_of

# Velocity that body forces may give the waves of a bar before it is written into the rings: waves
# are kept less this, and lose digits where it is large [m/s]. To write long strings is dear.
MOST_GIVEN, MOST_GIVEN_IN_STRINGS = 0.02, 1.0
# Loss spreads fronts by so many steps^2 in a transit where any step before a closure is cut.
WIDE = 0.12


@preparing
def fill_wave_parameters(p, numbers, plan, network):
    """Fill a WAVE_PAR record."""
    values, chain = numbers.values, network.chain
    fill_parameters(p, numbers, True)
    p.dt, p.most_changes = plan.time_step, MOST_CHANGES
    p.viscous = 0.5 * plan.eta / plan.time_step if network.lossy_ends else 0.0
    p.lag = p.viscous / (1.0 + p.viscous)
    spread = plan.eta * p.rearm_time / REARM_TRANSITS
    p.cuts_all = 1 if spread > WIDE * plan.time_step**2 else 0
    p.mass_b = chain.bodies[-1, Body.MASS]
    if first_is_piston(numbers):
        p.mass_p = chain.bodies[0, Body.MASS]
    p.sections, p.bars = len(chain.places), len(chain.bodies)
    p.joints, p.struck = len(chain.fits), network.struck
    p.most_given = MOST_GIVEN
    if not values.effects_string:
        return
    p.most_given = MOST_GIVEN_IN_STRINGS
    if p.piston == Piston.ABSENT:
        p.open_top = values.string_top
        p.pulse, p.pulse_end = values.string_pulse_force, values.string_pulse_duration
    p.open_bottom = values.string_bottom
    if values.effects_damper:
        p.damper = 1
        p.damper_stiffness, p.damper_damping = values.damper_stiffness, values.damper_damping
        p.damper_preload, p.casing_mass = values.damper_preload, values.damper_casing_mass


@preparing
def _send_all(chain, waves, bar, v):
    """Fill the rings of a bar that moves as one with the velocity `v`."""
    for k in range(int(chain.bodies[bar, Body.FIRST]), int(chain.bodies[bar, Body.LAST]) + 1):
        first, count = chain.places[k, RING], 4 * chain.places[k, SIZE]
        for i in range(first, first + count):
            waves.rings[0, i] = 0.5 * v
        for i in range(first + count, first + count + 2):
            waves.rings[0, i] = kept_of(chain, k) * 0.5 * v


@preparing
def begin(p, s, chain, waves, numbers):
    """Fill record and waves at time zero.

    Parameters
    ----------
    p, s : WAVE_PAR, WAVE_STATE record
    chain : Chain
    waves : Waves
        Of zeros.
    numbers : Numbers
    """
    fill_start(s, numbers)
    for bar in range(p.bars):
        with_piston = bar == 0 and first_is_piston(numbers)
        v = s.v_p if with_piston else numbers.values.start_bit_velocity
        waves.bars[Bar.VELOCITY, bar] = v
        _send_all(chain, waves, bar, v)
    for k in range(len(numbers.joints)):
        gap = numbers.joints[k, 3]
        waves.joints[Has.GAP, k] = gap
        waves.joints[Has.CLOSED, k] = 1.0 if gap == 0.0 else 0.0
    if p.piston != Piston.ABSENT:
        s.u_r = s.u_0 = -s.gap
    kinetic, elastic = stored(p, s, chain, waves)
    s.e_start = kinetic + elastic + recoverable(p, s)
