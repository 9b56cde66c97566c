"""Elementary functions against long decimal numbers, C99, plain Python and other processors."""

from __future__ import annotations

import json
import math
import os
import random
import re
import struct
import subprocess
import sys
from decimal import Decimal, localcontext
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from elementary_bits import UNARY, digests
from numba import cfunc, njit, types

from percussion_model.physics import elementary

INF, NAN, PI = math.inf, math.nan, math.pi
# What the docstring grants, in units in the last place.
GRANTED = 0.61
# Digits of the references, beside those of the largest numbers.
DIGITS, MOST_DIGITS = 50, 400
# Digests of the bits on every machine, to be made anew (elementary_bits.py) with a method.
BITS = {
    "exp": "7ad1b97c766b52b4",
    "expm1": "5e4acc34e1ec3f5b",
    "log": "07a6882af63dfda7",
    "sin": "04f48aebdd6c22fb",
    "cos": "4ca70348419adcc7",
    "acos": "0f84a5d0f513c9ca",
    "atanh": "a1cc03218fd86853",
    "atan2": "480104c43a1e8f18",
}


# --- references ----------------------------------------------------------------------------------


def _sum(first, ratio):
    """Sum of a series whose k-th term is `ratio(k)` times the one before."""
    total, term, k = Decimal(0), first, 0
    while total + term != total:
        total += term
        k += 1
        term *= ratio(k)
    return total


def _slopes(t, sign):
    """Series of atan or atanh."""
    total, power, k = Decimal(0), t, 1
    while total + power / k != total:
        total += power / k
        power *= sign * t * t
        k += 2
    return total


def _pi(digits):
    with localcontext() as context:
        context.prec = digits + 5
        return 16 * _slopes(1 / Decimal(5), -1) - 4 * _slopes(1 / Decimal(239), -1)


LONG_PI = _pi(MOST_DIGITS + DIGITS)


def _turned(x):
    """Quarter turns and the rest of an angle."""
    with localcontext() as context:
        context.prec = MOST_DIGITS
        quarters = (x * 2 / LONG_PI).to_integral_value()
        return int(quarters) % 4, x - quarters * LONG_PI / 2


def _wave(x, more):
    quarters, rest = _turned(x)
    quarters = (quarters + more) % 4
    odd = quarters % 2
    first = Decimal(1) if odd else rest
    y = _sum(first, lambda k: -rest * rest / ((2 * k - odd) * (2 * k + 1 - odd)))
    return -y if quarters >= 2 else y


def _angle(y, x):
    """Angle of a point above the axis."""
    if y > abs(x):
        return LONG_PI / 2 - _angle(abs(x), y) if x > 0 else LONG_PI / 2 + _angle(abs(x), y)
    if x < 0:
        return LONG_PI - _angle(y, -x)
    t = y / x
    for _ in range(4):
        t /= 1 + (1 + t * t).sqrt()
    return 16 * _slopes(t, -1)


def _signed_angle(y, x):
    return -_angle(-y, x) if y < 0 else _angle(y, x)


def _other_leg(x):
    return ((1 - x) * (1 + x)).sqrt()


def _expm1(x):
    return x.exp() - 1 if abs(x) > 0.01 else _sum(x, lambda k: x / (k + 1))


def _atanh(x):
    return ((1 + x) / (1 - x)).ln() / 2 if abs(x) > 0.01 else _slopes(x, 1)


EXACT = {
    "exp": lambda x: x.exp(),
    "expm1": _expm1,
    "log": lambda x: x.ln(),
    "sin": lambda x: _wave(x, 0),
    "cos": lambda x: _wave(x, 1),
    "atan2": _signed_angle,
    "acos": lambda x: _angle(_other_leg(x), x),
    "atanh": _atanh,
}


def _error(name, *arguments):
    """Error in units in the last place."""
    y = getattr(elementary, name)(*arguments)
    with localcontext() as context:
        context.prec = DIGITS
        exact = EXACT[name](*map(Decimal, arguments))
        return float(abs(Decimal(y) - exact) / Decimal(math.ulp(float(exact))))


# --- arguments -----------------------------------------------------------------------------------

_draw = random.Random(3)


def _between(low, high, count=120):
    return [_draw.uniform(low, high) for _ in range(count)]


def _of_all_sizes(low, high, count=120):
    """Numbers of both signs with exponents between two."""
    return [_draw.choice((-1.0, 1.0)) * 2.0 ** _draw.uniform(low, high) for _ in range(count)]


def _around(numbers):
    """Numbers and their neighbours."""
    return [y for x in numbers for y in (math.nextafter(x, -INF), x, math.nextafter(x, INF))]


# ends of the pieces of the tables, where what is left is largest
_PIECE = math.log(2.0) / elementary.PIECES
_STEPS = _around([(k + 0.5) * _PIECE for k in range(-130, 130, 2)])
_OCTAVE = [1.0 + k / elementary.PIECES for k in range(-40, 80)]
_ANGLES = [*_between(-0.8, 0.8), *_between(-10.0, 10.0), *_between(-2e6, 2e6), *_between(-1e9, 1e9)]
_ANGLES += [*_of_all_sizes(-1000.0, 1023.9), *_around([k * PI / 4 for k in range(1, 41)])]
# next to multiples of a quarter turn: the worst of all (Kahan), and those of a moderate size
_ANGLES += [6381956970095103.0 * 2.0**797, 1285231.8377688916, 45.553093477052]
_SINES = [*_between(-1.0, 1.0), *_of_all_sizes(-70.0, -0.001)]
_SINES += [1.0 - abs(x) for x in _of_all_sizes(-53.0, -1.0)]
_SLOPES = _around([(k + 0.5) / elementary.SLICES for k in range(elementary.SLICES)])

ARGUMENTS = {
    "exp": [
        *_between(-745.0, 709.7),
        *_between(-1.0, 1.0),
        *_between(-745.0, -655.0),
        *_between(-709.0, -707.0, 400),
        *_of_all_sizes(-70.0, 0.0),
        *_STEPS,
    ],
    "expm1": [
        *_between(-41.0, 709.7),
        *_between(-1.0, 1.0),
        *_between(-0.003, 0.003),
        *_of_all_sizes(-1070.0, 0.0),
        *_STEPS,
    ],
    "log": [
        *map(abs, _of_all_sizes(-1074.0, 1023.9)),
        *_between(0.5, 2.0),
        *_between(0.99, 1.01),
        *[1.0 + x for x in _of_all_sizes(-52.0, -6.0) if x],
        *_around(_OCTAVE[:40] + _OCTAVE[41:]),
    ],
    "sin": _ANGLES,
    "cos": _ANGLES,
    "acos": _SINES,
    "atanh": [*_SINES, *_between(-0.02, 0.02)],
}


@pytest.mark.parametrize("name", UNARY)
def test_error_is_small(name):
    worst, at = max((_error(name, x), x) for x in ARGUMENTS[name] if x != 0.0)
    assert worst < GRANTED, at


def test_error_of_angles_is_small():
    near, far = _of_all_sizes(-30.0, 0.0, 400), _between(-1.0, 1.0, 400)
    points = [*zip(near, far, strict=True), *zip(far, near, strict=True)]
    points += [(x * 2.0**1023, y * 2.0**1023) for x, y in points[:100]]
    points += [(x * 2.0**-1040, y * 2.0**-1040) for x, y in points[:100]]
    points += [(q, math.nextafter(1.0, 2.0)) for q in _SLOPES]
    worst, at = max((_error("atan2", y, x), (y, x)) for y, x in points if y)
    assert worst < GRANTED, at


# --- special values ------------------------------------------------------------------------------

SPECIAL = {
    "exp": [(0.0, 1.0), (-0.0, 1.0), (INF, INF), (-INF, 0.0), (710.0, INF), (-746.0, 0.0)],
    "expm1": [(0.0, 0.0), (-0.0, -0.0), (INF, INF), (-INF, -1.0), (5e-324, 5e-324), (710.0, INF)],
    "log": [(1.0, 0.0), (0.0, -INF), (-0.0, -INF), (INF, INF), (-1.0, NAN), (-INF, NAN)],
    "sin": [(0.0, 0.0), (-0.0, -0.0), (INF, NAN), (-INF, NAN), (-5e-324, -5e-324)],
    "cos": [(0.0, 1.0), (-0.0, 1.0), (INF, NAN), (-INF, NAN)],
    "acos": [(1.0, 0.0), (-1.0, PI), (0.0, PI / 2), (-0.0, PI / 2), (1.1, NAN), (-INF, NAN)],
    "atanh": [(0.0, 0.0), (-0.0, -0.0), (1.0, INF), (-1.0, -INF), (1.1, NAN), (-INF, NAN)],
}


def _bits(x):
    return struct.pack("<d", x)


@pytest.mark.parametrize("name", UNARY)
def test_special_values(name):
    for x, y in [*SPECIAL[name], (NAN, NAN), (-NAN, NAN)]:
        assert _bits(getattr(elementary, name)(x)) == _bits(y), x


def test_special_angles():
    edge = [0.0, -0.0, 1.0, -1.0, INF, -INF, 5e-324, 1.7e308, -1.7e308]
    for y in edge:
        for x in edge:
            got, platform = elementary.atan2(y, x), math.atan2(y, x)
            assert got == pytest.approx(platform, rel=1e-15, abs=0.0)
            assert math.copysign(1.0, got) == math.copysign(1.0, platform), (y, x)
    assert _bits(elementary.atan2(NAN, 1.0)) == _bits(elementary.atan2(1.0, -NAN)) == _bits(NAN)


# --- order ---------------------------------------------------------------------------------------


def _falls(name, start, count=60):
    """Whether a function that grows falls somewhere around a number."""
    x = start
    for _ in range(count // 2):
        x = math.nextafter(x, -INF)
    values = []
    for _ in range(count):
        values.append(getattr(elementary, name)(x))
        x = math.nextafter(x, INF)
    return any(b < a for a, b in pairwise(values))


@pytest.mark.parametrize("name", ["exp", "expm1", "log", "sin", "atanh"])
def test_order_is_kept_where_methods_meet(name):
    ends = {
        "exp": [-660.0, 660.0, -708.4, *_STEPS[::6]],
        "expm1": [-40.0, 40.0, 2.0**-54, *_STEPS[::6]],
        "log": [2.0**-1022, 0.5, 2.0, *_OCTAVE],
        "sin": [2.0**-28, 1e-3, PI / 4],
        "atanh": [2.0**-28, 1 / 256],
    }
    for start in ends[name]:
        assert not _falls(name, start), start


# --- one result everywhere -----------------------------------------------------------------------


def test_bits_are_those_of_every_machine():
    assert digests() == BITS


@pytest.mark.parametrize(
    ("otherwise", "words"),
    [
        pytest.param({"NUMBA_DISABLE_JIT": "1"}, [], id="plain Python"),
        pytest.param({}, ["unloaded"], id="without numba"),
        pytest.param({"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}, [], id="plainest"),
    ],
)
def test_bits_depend_on_no_compiler_and_no_processor(otherwise, words, tmp_path):
    ran = subprocess.run(
        [sys.executable, str(Path(__file__).with_name("elementary_bits.py")), *words],
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)} | otherwise,
        capture_output=True,
        text=True,
        check=True,
    )
    assert json.loads(ran.stdout) == digests()


def test_vectors_change_nothing():
    x = np.array(ARGUMENTS["expm1"])

    @njit(error_model="numpy")
    def all_of_them(x, y):
        for i in range(len(x)):
            y[i] = elementary.exp(x[i]) + elementary.expm1(x[i]) * elementary.log(abs(x[i]))

    found = np.empty_like(x)
    all_of_them(x, found)
    for one, y in zip(x.tolist(), found.tolist(), strict=True):
        lone = elementary.exp(one) + elementary.expm1(one) * elementary.log(abs(one))
        assert _bits(lone) == _bits(y)


# What compiled functions may call: instructions, and what ties them to Python.
HARMLESS = re.compile(
    r"llvm\.(fabs|sqrt|copysign|is\.fpclass|lifetime\..*)(\..*)?|sqrt|Py.*|.*numba.*|NRT.*"
)


@pytest.mark.parametrize("name", [*UNARY, "atan2"])
def test_nothing_of_the_platform_is_called(name):
    function = getattr(elementary, name)
    count = 2 if name == "atan2" else 1
    wrapper = (lambda y, x: function(y, x)) if count == 2 else (lambda x: function(x))
    text = cfunc(types.float64(*[types.float64] * count), error_model="numpy")(
        wrapper
    ).inspect_llvm()
    called = re.findall(r'^declare [^@]*@"?([^"(]+)', text, re.MULTILINE)
    assert [one for one in called if not HARMLESS.fullmatch(one)] == []
    assert not re.search(r"inttoptr \(i64 \d+|fmuladd|llvm\.fma|\bcontract\b", text)


def test_cos_and_sin_come_together():
    for x in [*_ANGLES, 0.0, -0.0, INF, NAN]:
        c, s = elementary.cos_and_sin(x)
        assert _bits(c) == _bits(elementary.cos(x))
        assert _bits(s) == _bits(elementary.sin(x))


def test_powers_of_two():
    for n in (-1022, -1, 0, 1, 52, 1023):
        assert elementary.power_of_two(n) == 2.0**n
