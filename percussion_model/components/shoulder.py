"""A casing at the low end of a rod, and the shoulder by which it pushes the bit.

The casing of mass M has above it a rod of impedance Z, in which a wave of velocity d comes down and
one of u = v - d goes back up (d'Alembert). The rod pushes with Z (d - u), so that

    M v' = Z (2 d - v) + F + M g + R - S,    S = k (x - x_b) + c (v - v_b) >= 0,

with the feed F, the reaction R of the drive, and the push S of the shoulder on the bit. Over a
step of whoever has the rod, d comes as a sum of Legendre polynomials, and what goes back is given
as one: its projection, and its energy, which is that of d less the work on the casing. So whoever
has the rod can keep to it, and the port makes and loses none. Whatever S misses while it is held
is made good by the next.
"""

from __future__ import annotations

from typing import NamedTuple

from percussion_model.components import Component
from percussion_model.physics.kernel import LEAST_DIVISOR, inlined, kernel

# `Mode.FF` of physics/records.py, which asks what components there are.
FREE = 0
# A mean force lasts so many steps while the bit flies or rests.
CALM = 8.0
# Shares of mass by the square of the longest hold, and by it, up to which a held push is stable.
SOFT, SLACK = 0.05, 0.1
# A bit slower than this is calm [m/s].
SLOW = 0.05
# Slower, piston and bit do not meet soon [m/s].
BOUNCE = 1.0
# Waves are followed in pieces of this share of their step, half of the time M/Z at most.
PIECE, SHORT = 0.125, 0.5
# Terms of the series of a velocity within a piece, exact to rounding.
TERMS = 17
# Places of Gauss and Legendre in a piece from 0 to 1, and half of their weights there.
PLACES = 0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263
WEIGHTS = 0.17392742256872692, 0.32607257743127307, 0.32607257743127307, 0.17392742256872692
# Polynomials that make up a wave. A step is over this close to its end, and the next one begins.
DEGREES, ROUNDING, EARLY = 8, 1e-9, 1e-4


@inlined
def longest(par):
    """Time for which the push is held at most [s]."""
    return CALM * par.shoulder_step


@inlined
def lighter(par):
    """Mass of casing or bit [kg]."""
    return min(par.shoulder_casing_mass, par.mass_b)


@inlined
def stiffness(par):
    """Stiffness that holds can bear [N/m]: a push that is late gives back more than it took."""
    most = SOFT * lighter(par) / (longest(par) * longest(par))
    return min(par.shoulder_stiffness, most)


@inlined
def damping(par):
    """Damping that holds can bear [N s/m]."""
    return min(par.shoulder_damping, SLACK * lighter(par) / longest(par))


@inlined
def squeeze(par, s):
    """Compression of the shoulder [m]; negative where it has lifted off."""
    start = par.shoulder_start_force / stiffness(par)
    return start + s.shoulder_position - (s.path_b - s.climb)


@inlined
def push_by(par, squeezed, speed):
    """Push of a shoulder that is compressed by a length, and more so at a speed [N]."""
    if squeezed <= 0.0:
        return 0.0
    return max(stiffness(par) * squeezed + damping(par) * speed, 0.0)


@inlined
def on_bit(par, s, h):
    """Mean push over the next h, with what was missed before [N]."""
    speed = s.shoulder_velocity - s.v_b
    owed = s.shoulder_owed / max(h, par.shoulder_step)  # not all of it at once
    return push_by(par, squeeze(par, s) + 0.5 * h * speed, speed) + owed


@inlined
def lasts(par, s):
    """Time for which the push may be held [s]."""
    step = par.shoulder_step
    if s.closed == 1 or (s.mode != FREE and abs(s.v_b) > SLOW):
        return step
    return min(max(s.gap / max(s.v_p - s.v_b, BOUNCE), step), longest(par))


class Powers(NamedTuple):
    """Coefficients of a polynomial, the constant first."""

    a: float
    b: float
    c: float
    d: float
    e: float
    f: float
    g: float
    h: float


@inlined
def powers_of(s):
    """The wave that comes down, by powers of the place from -1 to 1 in its step [m/s]."""
    a, b, c, d = s.shoulder_now_1, s.shoulder_now_2, s.shoulder_now_3, s.shoulder_now_4
    e, f, g, h = s.shoulder_now_5, s.shoulder_now_6, s.shoulder_now_7, s.shoulder_now_8
    return Powers(
        a - c / 2.0 + 3.0 * e / 8.0 - 5.0 * g / 16.0,
        b - 3.0 * d / 2.0 + 15.0 * f / 8.0 - 35.0 * h / 16.0,
        3.0 * c / 2.0 - 15.0 * e / 4.0 + 105.0 * g / 16.0,
        5.0 * d / 2.0 - 35.0 * f / 4.0 + 315.0 * h / 16.0,
        35.0 * e / 8.0 - 315.0 * g / 16.0,
        63.0 * f / 8.0 - 693.0 * h / 16.0,
        231.0 * g / 16.0,
        429.0 * h / 16.0,
    )


@inlined
def divided(w, at):
    """A polynomial divided by the distance from a place; the rest, its value, comes last."""
    g = w.g + at * w.h
    f = w.f + at * g
    e = w.e + at * f
    d = w.d + at * e
    c = w.c + at * d
    b = w.b + at * c
    return Powers(b, c, d, e, f, g, w.h, w.a + at * b)


@inlined
def value_of(w, at):
    """Value of a polynomial at a place."""
    return divided(w, at).h


@inlined
def about(w, at, scale):
    """A polynomial by powers of the distance from a place, divided by a scale."""
    a = divided(w, at)
    b = divided(Powers(a.a, a.b, a.c, a.d, a.e, a.f, a.g, 0.0), at)
    c = divided(Powers(b.a, b.b, b.c, b.d, b.e, b.f, 0.0, 0.0), at)
    d = divided(Powers(c.a, c.b, c.c, c.d, c.e, 0.0, 0.0, 0.0), at)
    e = divided(Powers(d.a, d.b, d.c, d.d, 0.0, 0.0, 0.0, 0.0), at)
    f = divided(Powers(e.a, e.b, e.c, 0.0, 0.0, 0.0, 0.0, 0.0), at)
    g = divided(Powers(f.a, f.b, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), at)
    two = scale * scale
    four = two * two
    return Powers(
        a.h, b.h * scale, c.h * two, d.h * two * scale, e.h * four, f.h * four * scale,
        g.h * four * two, w.h * four * two * scale,
    )  # fmt: skip


@inlined
def value_beyond(s):
    """Between steps, the wave that comes down at the end of one or the begin of the next [m/s]."""
    even = s.shoulder_now_1 + s.shoulder_now_3 + s.shoulder_now_5 + s.shoulder_now_7
    odd = s.shoulder_now_2 + s.shoulder_now_4 + s.shoulder_now_6 + s.shoulder_now_8
    return even + odd if s.shoulder_now_begin == s.shoulder_returned_begin else even - odd


@inlined
def square_of(s):
    """Mean square of the wave that comes down [m2/s2]."""
    a, b = s.shoulder_now_1 * s.shoulder_now_1, s.shoulder_now_2 * s.shoulder_now_2
    c, d = s.shoulder_now_3 * s.shoulder_now_3, s.shoulder_now_4 * s.shoulder_now_4
    e, f = s.shoulder_now_5 * s.shoulder_now_5, s.shoulder_now_6 * s.shoulder_now_6
    g, h = s.shoulder_now_7 * s.shoulder_now_7, s.shoulder_now_8 * s.shoulder_now_8
    return a + b / 3.0 + c / 5.0 + d / 7.0 + e / 9.0 + f / 11.0 + g / 13.0 + h / 15.0


@inlined
def take_wave(s):
    """Go by the wave that is given, once its step begins: a master may give it a step early.

    At the start, where all is at rest, the next one is as good.
    """
    starts = s.shoulder_returned_until == 0.0
    due = s.shoulder_wave_begin - EARLY * s.shoulder_wave_span
    if not starts and s.shoulder_returned_until < due:
        return
    s.shoulder_now_begin = 0.0 if starts else s.shoulder_wave_begin
    s.shoulder_now_1, s.shoulder_now_2 = s.shoulder_wave_1, s.shoulder_wave_2
    s.shoulder_now_3, s.shoulder_now_4 = s.shoulder_wave_3, s.shoulder_wave_4
    s.shoulder_now_5, s.shoulder_now_6 = s.shoulder_wave_5, s.shoulder_wave_6
    s.shoulder_now_7, s.shoulder_now_8 = s.shoulder_wave_7, s.shoulder_wave_8
    if starts:
        s.shoulder_returned_square = square_of(s)


@inlined
def forget_returned(s):
    """Begin the projection of the wave that goes up."""
    s.shoulder_returned_1 = s.shoulder_returned_2 = s.shoulder_returned_3 = 0.0
    s.shoulder_returned_4 = s.shoulder_returned_5 = s.shoulder_returned_6 = 0.0
    s.shoulder_returned_7 = s.shoulder_returned_8 = 0.0


@inlined
def give_back(s, at, wave):
    """Add a wave that goes up, times its share of the step, at a place to its projection."""
    before, now = 1.0, at
    s.shoulder_returned_1 += 0.5 * wave
    s.shoulder_returned_2 += 1.5 * wave * now
    before, now = now, 1.5 * at * now - 0.5 * before
    s.shoulder_returned_3 += 2.5 * wave * now
    before, now = now, (5.0 * at * now - 2.0 * before) / 3.0
    s.shoulder_returned_4 += 3.5 * wave * now
    before, now = now, (7.0 * at * now - 3.0 * before) / 4.0
    s.shoulder_returned_5 += 4.5 * wave * now
    before, now = now, (9.0 * at * now - 4.0 * before) / 5.0
    s.shoulder_returned_6 += 5.5 * wave * now
    before, now = now, (11.0 * at * now - 5.0 * before) / 6.0
    s.shoulder_returned_7 += 6.5 * wave * now
    before, now = now, (13.0 * at * now - 6.0 * before) / 7.0
    s.shoulder_returned_8 += 7.5 * wave * now


@inlined
def plus(sums, share, powers):
    """Sums at the four places, and a share of the powers there."""
    one, two = sums[0] + share * powers[0], sums[1] + share * powers[1]
    return one, two, sums[2] + share * powers[2], sums[3] + share * powers[3]


@inlined
def next_powers(now):
    """Powers of the four places, one higher."""
    return now[0] * PLACES[0], now[1] * PLACES[1], now[2] * PLACES[2], now[3] * PLACES[3]


@kernel
def move_casing(par, s, at, reach, h, force):
    """Move the casing on for a time h, by the series of its velocity.

    Parameters
    ----------
    at, reach : float
        Place in the step of the wave, from -1 to 1, and by how much it goes on; what goes up
        from 1 on counts in the next step.
    force : float
        On the casing, but for what the rod does [N].
    """
    wave, going_on = Powers(value_beyond(s), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), at < 1.0
    if going_on:
        wave = about(powers_of(s), at, reach)
    fall = s.shoulder_impedance * h / par.shoulder_casing_mass
    own, term, v, way = force * h / par.shoulder_casing_mass, s.shoulder_velocity, 0.0, 0.0
    up, powers, before = (0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0), term
    for n in range(TERMS):
        given = wave[n] if n < DEGREES else 0.0
        v, way = v + term, way + term / (n + 1.0)
        up, powers = plus(up, term - given, powers), next_powers(powers)
        term = (2.0 * fall * given + own - fall * term) / (n + 1.0)
        own = 0.0
    for k in range(4):
        if going_on:
            give_back(s, at + PLACES[k] * reach, reach * WEIGHTS[k] * up[k])
        else:
            s.shoulder_over += h * WEIGHTS[k] * (up[k] - wave.a)
    # what the casing has gained, but for the other forces
    work = 0.5 * par.shoulder_casing_mass * (v - before) * (v + before) - force * (way * h)
    s.shoulder_rod_work += work
    if s.shoulder_impedance > 0.0:
        square = work / (s.shoulder_impedance * s.shoulder_wave_span)
        s.shoulder_returned_square -= square if going_on else 0.0
        s.shoulder_over_square += 0.0 if going_on else square
    s.shoulder_velocity = v
    s.shoulder_position += way * h


@kernel
def follow(par, s, h):
    """Move the casing, and note what the shoulder has missed."""
    if h <= 0.0:
        return
    span = max(s.shoulder_wave_span, LEAST_DIVISOR)
    take_wave(s)
    # what is read a moment late is still that of the step before
    later = s.shoulder_now_begin - s.shoulder_returned_begin
    if later != 0.0 and s.shoulder_since + h - later > EARLY * span:
        s.shoulder_returned_begin, s.shoulder_since = s.shoulder_now_begin, s.shoulder_since - later
        forget_returned(s)
        # bodies may be past the begin already, by another wave: its force is made good
        late = max(s.shoulder_since / span, 0.0)
        wave = value_of(powers_of(s), late - 1.0)
        give_back(s, late - 1.0, 2.0 * (s.shoulder_over / span + late * wave))
        s.shoulder_returned_square = square_of(s) - s.shoulder_over_square
        s.shoulder_over = s.shoulder_over_square = 0.0
    recoil, before = s.i_drive + s.i_on_bit, s.shoulder_squeeze
    if s.shoulder_returned_until == 0.0:
        before = par.shoulder_start_force / stiffness(par)
    s.shoulder_push = s.f_shoulder_bit
    force = s.feed + par.shoulder_casing_mass * par.gravity
    force -= (recoil - s.shoulder_recoil) / h + s.shoulder_push
    swift = SHORT * par.shoulder_casing_mass / max(s.shoulder_impedance, LEAST_DIVISOR)
    most, left, end = min(PIECE * span, swift), h, 1.0 - ROUNDING
    while left > 0.0:
        piece = min(most, left)
        at = min(2.0 * s.shoulder_since / span - 1.0, 1.0)
        reach = 2.0 * piece / span
        if at < end < at + reach:
            reach = 1.0 - at
            piece = min(0.5 * reach * span, left)
        elif at >= end:
            at = 1.0
        move_casing(par, s, at, reach, piece, force)
        s.shoulder_since += piece
        left -= piece
    s.shoulder_returned_until = s.shoulder_returned_begin + s.shoulder_since
    after = squeeze(par, s)
    rate = (after - before) / h
    due = push_by(par, before, rate) + push_by(par, after, rate)
    s.shoulder_owed += (0.5 * due - s.shoulder_push) * h
    s.shoulder_recoil, s.shoulder_squeeze = recoil, after
    take_wave(s)


@inlined
def pass_time(par, s, h):
    """Go on by h."""
    follow(par, s, h)


def _part_of_wave(order: int) -> str:
    which = "mean" if order == 0 else f"share of the Legendre polynomial of degree {order}"
    return f"{which}, over a step of the rod, of the wave"


COMPONENT = Component(
    "shoulder",
    "a casing that takes the feed or the waves of a rod, and whose shoulder pushes the bit",
    {
        "casing_mass": (40.0, "kg", "mass of the casing", 1e-3, 1e5),
        "stiffness": (
            1e5,
            "N/m",
            "stiffness of shoulder, chuck and damper; at most m/(20 h^2) counts, with the lighter "
            "of casing and bit and h of eight steps",
            1e3,
            1e10,
        ),
        "damping": (200.0, "N s/m", "damping of the same; at most m/(10 h) counts", 0.0, 1e7),
        "start_force": (2500.0, "N", "push of the shoulder on the bit at the start", 0.0, 1e7),
        "impedance": (0.0, "N s/m", "impedance of the rod on the casing; 0: none", 0.0, 1e9),
        "wave_begin": (0.0, "s", "begin of the step whose wave is in wave_1 to wave_8", 0.0, 1e9),
        "wave_span": (1e-3, "s", "length of that step", 1e-9, 1e9),
        **{
            f"wave_{k + 1}": (0.0, "m/s", f"{_part_of_wave(k)} that comes down", -1e4, 1e4)
            for k in range(DEGREES)
        },
        "step": (2e-5, "s", "shortest time for which the push is constant", 1e-8, 1e-3),
    },
    on_bit=on_bit,
    state={
        "position": ("m", "displacement of the casing", 0.0),
        "velocity": ("m/s", "velocity of the casing", 0.0),
        "push": ("N", "push of the shoulder on the bit", "start_force"),
        **{
            f"returned_{k + 1}": ("m/s", f"{_part_of_wave(k)} that goes up", 0.0)
            for k in range(DEGREES)
        },
        "returned_square": ("m^2/s^2", "mean square of the wave that goes up, once whole", 0.0),
        "returned_begin": ("s", "begin of the step whose wave is in returned_1 to returned_8", 0.0),
        "returned_until": ("s", "time up to which the wave that goes up is known", 0.0),
        "rod_work": ("J", "work of the rod on the casing", 0.0),
    },
    pass_time=pass_time,
    inputs=("impedance", "wave_begin", "wave_span", *(f"wave_{k + 1}" for k in range(DEGREES))),
    hidden=(
        *("owed", "recoil", "squeeze", "over", "over_square", "since", "now_begin"),
        *(f"now_{k + 1}" for k in range(DEGREES)),
    ),
    needs={"feed.on": ("bit",), "effects.damper": (False,)},
    lasts=lasts,
    takes_feed=True,
)
