"""Print a digest of what the elementary functions return for fixed arguments, as JSON.

Run by itself to see other machines, or plain Python with NUMBA_DISABLE_JIT=1; with the word
`unloaded`, without numba.
"""

from __future__ import annotations

import hashlib
import json
import math
import random
import struct
import sys

from percussion_model.physics import elementary

UNARY = ("exp", "expm1", "log", "sin", "cos", "acos", "atanh")
SPECIAL = (0.0, 1.0, 0.5, 2.0**-1074, 2.0**-1022, 2.0**-54, 709.7, 745.1, 1.6e6, 1e22)
SPECIAL += (1.7976931348623157e308, math.inf)


def arguments(count=300):
    """Numbers of all sizes, and of sizes at which most of the functions are at work."""
    draw = random.Random(8)
    anything = [
        struct.unpack("<d", struct.pack("<Q", draw.getrandbits(64)))[0] for _ in range(count)
    ]
    usual = [
        (2.0 * draw.random() - 1.0) * size for size in (0.01, 1.0, 30.0, 1e4) for _ in range(count)
    ]
    special = [sign * x for x in SPECIAL for sign in (1.0, -1.0)]
    return [x for x in anything if x == x] + usual + special + [math.nan]


def digests():
    """Digest of the bits of each function."""
    x = arguments()
    values = {name: [getattr(elementary, name)(one) for one in x] for name in UNARY}
    values["atan2"] = [elementary.atan2(*pair) for pair in zip(x, x[::-1], strict=True)]
    return {
        name: hashlib.sha256(struct.pack(f"<{len(x)}d", *row)).hexdigest()[:16]
        for name, row in values.items()
    }


if __name__ == "__main__":
    if "unloaded" not in sys.argv:
        import numba  # noqa: F401  # functions are compiled

    print(json.dumps(digests()))
    assert ("numba" in sys.modules) == ("unloaded" not in sys.argv)
