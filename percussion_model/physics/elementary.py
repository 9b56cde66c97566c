"""Elementary functions with the same bits on every machine.

The platform's mathematical library differs in the last bit between versions and processors. What
stands here is made of sums, products, quotients, roots and bits alone, in a fixed order and each
rounded by itself, so that every IEEE-754 machine returns the same number; compiled code, code
compiled ahead of time and plain Python alike. Subnormal numbers must not be flushed to zero.

A table takes the argument so close to a point where the function is known to twice the precision
that a few terms of Taylor's series do for the rest: the methods of Tang (ACM TOMS 15, 1989, for
exp; 16, 1990, for log; 18, 1992, for expm1), with tables addressed by bits of the exponent and
the mantissa as in ARM's optimized routines and glibc. What is largest in a result is a sum whose
rounding error is kept (Dekker, Numer. Math. 18, 1971), so that little but the last addition
rounds. Angles are taken into the first octant as Cody and Waite do, large ones as Payne and Hanek
do. Tables are made by arithmetic of whole numbers when the module is imported. Errors stay below
0.61 units in the last place. Special values are those of C99, and what is not a number is always
the same. `float` and `int` around numbers of tables make Python's own of them in plain Python.
"""

from __future__ import annotations

import math
import struct

import numpy as np

from percussion_model.physics.kernel import inlined_scalar, scalar, when_compiling

# Binary places of whole numbers that stand for numbers in the making.
PLACES = 192
# Pieces of an octave in the tables of exp and log: so many bits, which end at this one.
BITS = 7
PIECES, SHIFT = 1 << BITS, 52 - BITS
# Slices of the unit interval in the table of atan.
SLICES = 64
# Bits of a piece of 2/pi, and pieces that the largest number needs.
PIECE_BITS, PIECES_OF_TURN = 24, 52


def _double(whole, places=PLACES):
    """The double next to whole / 2**places: Python rounds quotients of whole numbers well."""
    return whole / (1 << places)


def _head(whole, bits, places=PLACES):
    """The first bits of a whole number as a double, and what is left of the number."""
    cut = 1 << max(abs(whole).bit_length() - bits, 0)
    head = (whole + cut // 2) // cut * cut
    return _double(head, places), whole - head


def _arc(up, down, sign, places=PLACES):
    """Series of atan(up / down) for sign -1, of atanh for sign 1."""
    power, total, k = (up << places) // down, 0, 1
    while power:
        total += power // k if k & 3 == 1 else sign * (power // k)
        power = power * up * up // (down * down)
        k += 2
    return total


def _pi(places):
    """Machin's formula."""
    more = places + 16
    return (16 * _arc(1, 5, -1, more) - 4 * _arc(1, 239, -1, more)) >> 16


def _powers():
    """Bits of 2**(j / PIECES), less those that come with j; and what the double leaves out."""
    root = 2 << PLACES
    for _ in range(BITS):
        root = math.isqrt(root << PLACES)
    bits, rest, power = [], [], 1 << PLACES
    for j in range(PIECES):
        value, left = _head(power, 53)
        bits.append(struct.unpack("<q", struct.pack("<d", value))[0] - (j << SHIFT))
        rest.append(left / power)
        power = power * root >> PLACES
    return np.array(bits), np.array(rest)


# Bits of the number at which the octave of the logarithm's table begins.
LOG_START = 0x3FE6000000000000  # 0.6875
# Denominator of the factors that take a number next to 1, and places of what is added exactly.
FACTOR, LOG_PLACES = 512, 42


def _logarithms():
    """Rows: a factor that takes the numbers of a piece next to 1, minus its logarithm in two."""
    rows = np.zeros((3, PIECES))
    for j in range(PIECES):
        start, end = (
            struct.unpack("<d", struct.pack("<q", LOG_START + (k << SHIFT)))[0] for k in (j, j + 1)
        )
        factor = FACTOR if start <= 1.0 <= end else round(2 * FACTOR / (start + end))
        value = 2 * _arc(abs(FACTOR - factor), FACTOR + factor, 1) * (1 if factor < FACTOR else -1)
        high = value >> (PLACES - LOG_PLACES) << (PLACES - LOG_PLACES)
        rows[:, j] = factor / FACTOR, _double(high), _double(value - high)
    return rows


def _arcs():
    """Rows: atan(j / SLICES) as the sum of two."""
    rows = np.zeros((2, SLICES + 1))
    value = 0
    for j in range(SLICES + 1):
        high, left = _head(value, 53)
        rows[:, j] = high, _double(left)
        value += _arc(SLICES, SLICES * SLICES + j * (j + 1), -1)
    return rows


def _turn():
    """2/pi in pieces, with zeros before them for numbers without a whole part."""
    places = PIECE_BITS * PIECES_OF_TURN
    whole = (2 << 2 * places + 64) // _pi(places + 64)
    mask = (1 << PIECE_BITS) - 1
    pieces = [whole >> places - PIECE_BITS * (k + 1) & mask for k in range(PIECES_OF_TURN)]
    return np.array([0] * TURN_START + pieces)


TURN_START = 8
POWER_BITS, POWER_REST = _powers()
LOG_FACTOR, LOG_HIGH, LOG_LOW = _logarithms()
ARC_HIGH, ARC_LOW = _arcs()
TURN = _turn()

_LN2, _PI = 2 * _arc(1, 3, 1), _pi(PLACES)
# ln 2 over pieces: its product with a number of a piece is exact; and ln 2 by LOG_PLACES.
STEP_HIGH, STEP_LOW = (part / PIECES for part in (_head(_LN2, 34)[0], _double(_head(_LN2, 34)[1])))
STEPS = PIECES / _double(_LN2)
LN2_HIGH = _double(_LN2 >> (PLACES - LOG_PLACES) << (PLACES - LOG_PLACES))
LN2_LOW = _double(_LN2 & ((1 << (PLACES - LOG_PLACES)) - 1))
# Half of pi in two, and in four: products of the first three with numbers below 2**20 are exact.
HALF_PI, _left = _head(_PI // 2, 53)
HALF_PI_LOW = _double(_left)
QUARTER_1, _left = _head(_PI // 2, 33)
QUARTER_2, _left = _head(_left, 33)
QUARTER_3, _left = _head(_left, 33)
QUARTER_4 = _double(_left)
QUARTERS = 1.0 / HALF_PI
# Angles up to here [rad] stay as they are, or are reduced in doubles.
OCTANT, MODERATE = 0.78, 1.6e6

# Adding it leaves the nearest whole number in the last bits.
ROUND = 1.5 * 2.0**52
ROUND_BITS = struct.unpack("<q", struct.pack("<d", ROUND))[0]
# Below it, the next terms of all series are less than a rounding error; and of those in squares.
TINY, SMALL = 2.0**-54, 2.0**-28
# Up to where all parts of exp are normal; where exp leaves all numbers; where it outweighs 1.
NORMAL, LARGEST, LEAST, NO_ONE = 660.0, 709.8, -745.2, 40.0
# Masks that leave the first 17, 26 or 32 bits of a number.
CUBE_MASK, HALF_MASK, LOG_MASK = -1 << 36, -1 << 27, -1 << 21
LEAST_NORMAL_BITS, INFINITY_BITS = 0x0010000000000000, 0x7FF0000000000000
# Series of sin and cos, from the terms in x**3 and x**4 on.
S3, S5, S7, S9, S11, S13, S15, S17 = (
    (-1.0) ** (n // 2) / math.factorial(n) for n in range(3, 18, 2)
)
C4, C6, C8, C10, C12, C14, C16 = ((-1.0) ** (n // 2) / math.factorial(n) for n in range(4, 17, 2))
THIRD, SIXTH = 1.0 / 3.0, 1.0 / 6.0


def bits_of(x):
    """The 64 bits of a number as a whole one with a sign."""
    return struct.unpack("<q", struct.pack("<d", x))[0]


def number_of(bits):
    """The number of 64 bits."""
    return struct.unpack("<d", struct.pack("<q", bits))[0]


def _teach():
    """Let kernels take bits and numbers as one another."""
    from llvmlite import ir
    from numba import types

    from percussion_model.physics.compiling import instruct

    def of_number(typing, x):
        def generate(context, builder, signature, args):
            return builder.bitcast(args[0], ir.IntType(64))

        return types.int64(types.float64), generate

    def of_bits(typing, bits):
        def generate(context, builder, signature, args):
            return builder.bitcast(args[0], ir.DoubleType())

        return types.float64(types.int64), generate

    instruct(bits_of, of_number)
    instruct(number_of, of_bits)


when_compiling(_teach)


# --- sums and products of two numbers, with what rounding leaves out -----------------------------


@inlined_scalar
def _add(a, b):
    """Sum of two numbers and its error, the first the larger one or zero."""
    total = a + b
    return total, (a - total) + b


@inlined_scalar
def _add_any(a, b):
    """Sum of two numbers and its error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@inlined_scalar
def _multiply(a, b):
    """Product of two numbers and its error."""
    product = a * b
    a_high, b_high = number_of(bits_of(a) & HALF_MASK), number_of(bits_of(b) & HALF_MASK)
    a_low, b_low = a - a_high, b - b_high
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, error


@inlined_scalar
def power_of_two(n):
    """2**n for a whole number, as long as that is normal."""
    return number_of((n + 1023) << 52)


# --- exponential ---------------------------------------------------------------------------------


@inlined_scalar
def _nearest_power(x):
    """Number k of the power 2**(k / PIECES) next to exp(x), and what is left of x, in two."""
    shifted = x * STEPS + ROUND
    k = shifted - ROUND
    return bits_of(shifted) - ROUND_BITS, x - k * STEP_HIGH, -k * STEP_LOW


@scalar
def _exp_far(x):
    """`exp` where powers of two or the result are not normal numbers."""
    if x != x:
        return math.nan
    if x > LARGEST:
        return math.inf
    if x < LEAST:
        return 0.0
    k, high, low = _nearest_power(x)
    r = high + low
    square = r * r
    change = float(POWER_REST[k & (PIECES - 1)]) + r
    change += square * (0.5 + r * SIXTH) + square * square * (1.0 / 24.0 + r * (1.0 / 120.0))
    bits = int(POWER_BITS[k & (PIECES - 1)]) + (k << SHIFT)
    if k > 0:
        power = number_of(bits - (1 << 52))
        return 2.0 * (power + power * change)
    power = number_of(bits + (1022 << 52))
    y = power + power * change
    if y < 1.0:
        # rounded once, where the last bit of a subnormal number will be
        rest = (power - y) + power * change
        one, more = _add(1.0, y)
        y = (one + (more + rest)) - 1.0
    return y * 2.0**-1022


@inlined_scalar
def exp(x):
    """Exponential function."""
    if not abs(x) < NORMAL:
        return _exp_far(x)
    k, high, low = _nearest_power(x)
    r = high + low
    square = r * r
    change = float(POWER_REST[k & (PIECES - 1)]) + r
    change += square * (0.5 + r * SIXTH) + square * square * (1.0 / 24.0 + r * (1.0 / 120.0))
    power = number_of(int(POWER_BITS[k & (PIECES - 1)]) + (k << SHIFT))
    return power + power * change


@scalar
def _expm1_far(x):
    """`expm1` of tiny and of large numbers."""
    if abs(x) <= TINY:
        return x
    if x < 0.0:
        return -1.0
    return exp(x)


@inlined_scalar
def expm1(x):
    """exp(x) - 1, precise where x is small."""
    if not TINY < abs(x) < NO_ONE:
        return _expm1_far(x)
    k, high, low = _nearest_power(x)
    r = high + low
    square = r * r
    power = number_of(int(POWER_BITS[k & (PIECES - 1)]) + (k << SHIFT))
    # power (1 + r + bend) - 1, of which power - 1 and r are the largest parts
    bend = square * (0.5 + r * SIXTH)
    bend += square * square * (1.0 / 24.0 + r * (1.0 / 120.0) + square * (1.0 / 720.0))
    less, left = _add_any(power, -1.0)
    total, error = _add(less, high)
    rest = float(POWER_REST[k & (PIECES - 1)])
    change = power * (bend + (low + (rest + rest * r))) + less * high
    return total + (error + (left + change))


# --- logarithm -----------------------------------------------------------------------------------


@inlined_scalar
def _log(bits, change):
    """Logarithm of the normal number of these bits and of 1 + change, a rounding error."""
    offset = bits - LOG_START
    j = (offset >> SHIFT) & (PIECES - 1)
    k = offset >> 52
    near = bits - (k << 52)
    head = number_of(near & LOG_MASK)
    factor = float(LOG_FACTOR[j])
    # near * factor = 1 + r + low, without rounding
    r, low = _add(head * factor - 1.0, (number_of(near) - head) * factor)
    square = r * r
    bend = (r * 0.2 - 0.25) + square * ((r * (1.0 / 7.0) - SIXTH) - square * 0.125)
    bend = square * (r * THIRD - 0.5) + square * square * bend
    turns = float(k)
    total, error = _add(turns * LN2_HIGH + float(LOG_HIGH[j]), r)
    low += (turns * LN2_LOW + float(LOG_LOW[j])) + change
    return total + ((error + low) + bend)


@scalar
def _log_far(x):
    """`log` of what is not a positive normal number."""
    if x == 0.0:
        return -math.inf
    if not x > 0.0:
        return math.nan
    if x == math.inf:
        return x
    return _log(bits_of(x * 2.0**52) - (52 << 52), 0.0)


@inlined_scalar
def log(x):
    """Natural logarithm."""
    bits = bits_of(x)
    if not LEAST_NORMAL_BITS <= bits < INFINITY_BITS:
        return _log_far(x)
    return _log(bits, 0.0)


@scalar
def atanh(x):
    """Inverse hyperbolic tangent, half of log((1 + x) / (1 - x))."""
    if abs(x) < SMALL:
        return x
    if not abs(x) < 1.0:
        return math.copysign(math.inf, x) if abs(x) == 1.0 else math.nan
    up, up_error = _add(1.0, x)
    down, down_error = _add(1.0, -x)
    q = up / down
    product, error = _multiply(q, down)
    # (up + up_error) / (down + down_error) = q (1 + change)
    change = (((up - product) - error) + (up_error - q * down_error)) / up
    return 0.5 * _log(bits_of(q), change)


# --- sine and cosine -----------------------------------------------------------------------------


@inlined_scalar
def _pieces(at, m_0, m_1, m_2, m_3):
    """Sum of the products of pieces of a number and of 2/pi that have the same place."""
    first, second, third, last = TURN[at], TURN[at + 1], TURN[at + 2], TURN[at + 3]
    return m_0 * int(first) + m_1 * int(second) + m_2 * int(third) + m_3 * int(last)


@inlined_scalar
def _reduce_large(x):
    """Quarter turns in x modulo four, and the rest of it in two, by whole numbers."""
    bits = bits_of(abs(x))
    scale = (bits >> 52) - 1075
    mantissa = (bits & ((1 << 52) - 1)) | (1 << 52)
    # x = mantissa 2**scale, shifted until whole quarters end where a piece does
    skip = (scale + 240) // PIECE_BITS - 10
    shift = scale - PIECE_BITS * skip
    mask = (1 << PIECE_BITS) - 1
    part = (mantissa & mask) << shift
    m_0 = part & mask
    part = ((mantissa >> PIECE_BITS & mask) << shift) + (part >> PIECE_BITS)
    m_1 = part & mask
    part = ((mantissa >> 2 * PIECE_BITS) << shift) + (part >> PIECE_BITS)
    m_2 = part & mask
    m_3 = part >> PIECE_BITS
    at = TURN_START + skip - 1
    column = _pieces(at + 7, m_0, m_1, m_2, m_3)
    column = _pieces(at + 6, m_0, m_1, m_2, m_3) + (column >> PIECE_BITS)
    last = column & mask
    column = _pieces(at + 5, m_0, m_1, m_2, m_3) + (column >> PIECE_BITS)
    last += (column & mask) << PIECE_BITS
    column = _pieces(at + 4, m_0, m_1, m_2, m_3) + (column >> PIECE_BITS)
    middle = column & mask
    column = _pieces(at + 3, m_0, m_1, m_2, m_3) + (column >> PIECE_BITS)
    middle += (column & mask) << PIECE_BITS
    column = _pieces(at + 2, m_0, m_1, m_2, m_3) + (column >> PIECE_BITS)
    first = column & mask
    column = _pieces(at + 1, m_0, m_1, m_2, m_3) + (column >> PIECE_BITS)
    first += (column & mask) << PIECE_BITS
    column = _pieces(at, m_0, m_1, m_2, m_3) + (column >> PIECE_BITS)
    quarters = column & 3
    half = first >> (2 * PIECE_BITS - 1)
    quarters += half
    first -= half << (2 * PIECE_BITS)
    total, error = _add_any(float(first) * 2.0**-48, float(middle) * 2.0**-96)
    total, more = _add_any(total, float(last) * 2.0**-144)
    total, error = _add(total, error + more)
    high, more = _multiply(total, HALF_PI)
    high, low = _add(high, more + (total * HALF_PI_LOW + error * HALF_PI))
    if x < 0.0:
        return -quarters & 3, -high, -low
    return quarters & 3, high, low


@inlined_scalar
def _reduce(x):
    """Quarter turns in x modulo four, and the rest of it in two."""
    if abs(x) < OCTANT:
        return 0, x, 0.0
    if not abs(x) < MODERATE:
        return _reduce_large(x)
    shifted = x * QUARTERS + ROUND
    n = shifted - ROUND
    high, low = _add_any(x - n * QUARTER_1, -n * QUARTER_2)
    if abs(high) < 1e-3:
        high, more = _add_any(high, -n * QUARTER_3)
        high, low = _add(high, (low + more) - n * QUARTER_4)
    else:
        high, low = _add(high, low - n * (QUARTER_3 + QUARTER_4))
    return bits_of(shifted) & 3, high, low


@inlined_scalar
def _sine(x, low):
    """Sine of x + low, in the first octant."""
    z = x * x
    w = z * z
    bend = S5 + z * S7 + w * (S9 + z * S11 + w * (S13 + z * S15 + w * S17))
    # x**3 as the exact cube of its first bits and what is left
    head = number_of(bits_of(x) & CUBE_MASK)
    left = (x - head) * (z + head * (x + head))
    total, error = _add(x, head * head * head * S3)
    return total + (error + ((low * (1.0 - 0.5 * z) + left * S3) + x * w * bend))


@inlined_scalar
def _cosine(x, low):
    """Cosine of x + low, in the first octant."""
    z = x * x
    w = z * z
    bend = C4 + z * C6 + w * (C8 + z * C10 + w * (C12 + z * C14 + w * C16))
    head = number_of(bits_of(x) & HALF_MASK)
    total, error = _add(1.0, -0.5 * head * head)
    return total + (((error - 0.5 * (x - head) * (x + head)) + w * bend) - x * low)


@scalar
def sin(x):
    """Sine."""
    if abs(x) < SMALL:
        return x
    if not abs(x) < math.inf:
        return math.nan
    quarters, high, low = _reduce(x)
    y = _cosine(high, low) if quarters & 1 else _sine(high, low)
    return -y if quarters & 2 else y


@scalar
def cos(x):
    """Cosine."""
    if not abs(x) < math.inf:
        return math.nan
    quarters, high, low = _reduce(x)
    y = _sine(high, low) if quarters & 1 else _cosine(high, low)
    return -y if (quarters + 1) & 2 else y


@scalar
def cos_and_sin(x):
    """`cos` and `sin`, both in little more time than one."""
    if not abs(x) < math.inf:
        return math.nan, math.nan
    quarters, high, low = _reduce(x)
    c, s = _cosine(high, low), _sine(high, low)
    if quarters & 1:
        c, s = s, c
    if (quarters + 1) & 2:
        c = -c
    if quarters & 2:
        s = -s
    return c, x if abs(x) < SMALL else s


# --- angles --------------------------------------------------------------------------------------


@inlined_scalar
def _first_octant(a, a_low, b, b_low):
    """Angle of tangent (a + a_low) / (b + b_low), at most an eighth of a turn, in two."""
    shifted = a / b * SLICES + ROUND
    j = bits_of(shifted) - ROUND_BITS
    c = (shifted - ROUND) * (1.0 / SLICES)
    # the angle beyond that of tangent c has the tangent (a - c b) / (b + c a)
    b_head = number_of(bits_of(b) & HALF_MASK)
    up, up_error = _add_any(a - c * b_head, -c * (b - b_head))
    up_error += a_low - c * b_low
    a_head = number_of(bits_of(a) & HALF_MASK)
    down, down_error = _add(b, c * a_head)
    down, down_error = _add(down, down_error + (c * (a - a_head) + (b_low + c * a_low)))
    t, inverse = up / down, 1.0 / down
    product, error = _multiply(t, down)
    low = (((up - product) - error) + (up_error - t * down_error)) * inverse
    z = t * t
    bend = t * z * (THIRD - z * (0.2 - z * (1.0 / 7.0)))
    total, error = _add(float(ARC_HIGH[j]), t)
    return total, error + ((low + float(ARC_LOW[j])) - bend)


@inlined_scalar
def _half_turn(a, a_low, b, b_low, left):
    """Angle from the axis to a point `a` beside it and `b` along it, or `b` behind where `left`."""
    steep = a > b
    if steep:
        a, a_low, b, b_low = b, b_low, a, a_low
    high, low = _first_octant(a, a_low, b, b_low)
    sign = 1.0 if steep == left else -1.0
    axis = 1.0 if steep else 2.0 if left else 0.0
    high, more = _add(axis * HALF_PI, sign * high)
    return high + ((more + axis * HALF_PI_LOW) + sign * low)


@scalar
def atan2(y, x):
    """Angle of the point (x, y), from -pi to pi."""
    if x != x or y != y:
        return math.nan
    a, b = abs(y), abs(x)
    left = bits_of(x) < 0
    most = max(a, b)
    if most == math.inf:
        a, b = 1.0 if a == math.inf else 0.0, 1.0 if b == math.inf else 0.0
    elif most == 0.0:
        b = 1.0
    elif most > 2.0**1000:
        a, b = a * 2.0**-1000, b * 2.0**-1000
    elif most < 2.0**-900:
        a, b = a * 2.0**900, b * 2.0**900
    if not left and a < SMALL * b:
        angle = abs(y) / abs(x) if 0.0 < most < math.inf else a
    else:
        angle = _half_turn(a, 0.0, b, 0.0, left)
    return -angle if bits_of(y) < 0 else angle


@inlined_scalar
def _other_leg(x):
    """Root of 1 - x**2, in two."""
    square, error = _multiply(x, x)
    rest, more = _add(1.0, -square)
    root = math.sqrt(rest)
    inverse = 0.5 / root
    product, left = _multiply(root, root)
    return _add(root, (((rest - product) - left) + (more - error)) * inverse)


@scalar
def acos(x):
    """Inverse cosine."""
    if not abs(x) < 1.0:
        if x == 1.0:
            return 0.0
        return 2.0 * HALF_PI if x == -1.0 else math.nan
    root, low = _other_leg(x)
    return _half_turn(root, low, abs(x), 0.0, x < 0.0)
